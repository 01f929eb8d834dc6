/* Opaque triangles: bases of shells and plain meshes, with the asset's colours and textures where
 * the scene gives no colour of its own. Two-sided, lit as a surface. */
#include "renderer/path/surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/resident.h"
#include "renderer/path/shadow.h"
#include "renderer/path/variant.h"

enum { DEVICE_BYTES_MAX = 256 << 20 };

/* Each in a buffer of its own, so that what no picture has asked for is not there. */
enum attribute { POSITION, NORMAL, UV, ATTRIBUTES };
static const GLint components[ATTRIBUTES] = {3, 3, 2};

/* Triangles of one surface, next to one another in the buffers. */
struct batch {
    uint32_t first, count; /* corners */
    float color[3];
    GLuint texture; /* 0: none */
};

struct device_mesh {
    GLuint vertex_array, buffers[ATTRIBUTES]; /* 0 until wanted */
    uint32_t batch_count, texture_count;
    struct batch *batches;
    GLuint *textures;
};

struct surface_pass {
    struct resident_cache meshes;
    GLuint frame_buffer;
    GLuint white; /* for measuring what a texture costs: path_object.forced */
};

static void destroy_mesh(void *data) {
    struct device_mesh *mesh = data;
    glDeleteVertexArrays(1, &mesh->vertex_array);
    glDeleteBuffers(ATTRIBUTES, mesh->buffers);
    if (mesh->textures)
        glDeleteTextures((GLsizei)mesh->texture_count, mesh->textures);
    free(mesh->textures);
    free(mesh->batches);
    free(mesh);
}

struct surface_pass *surface_pass_create(void) {
    struct surface_pass *pass = calloc(1, sizeof *pass);
    if (pass) {
        pass->meshes.bytes_max = DEVICE_BYTES_MAX;
        pass->meshes.destroy = destroy_mesh;
    }
    return pass;
}

void surface_pass_destroy(struct surface_pass *pass) {
    if (!pass)
        return;
    resident_clear(&pass->meshes);
    glDeleteBuffers(1, &pass->frame_buffer);
    glDeleteTextures(1, &pass->white);
    free(pass);
}

bool surface_wanted(const struct scene_object *object) {
    return object->kind == SCENE_OBJECT_MESH ||
           (object->kind == SCENE_OBJECT_SHELL && object->shell.has_base);
}

/* The scene's own colour for an object's triangles; NULL where the asset decides. */
static const double *scene_color(const struct scene_object *object) {
    if (object->kind == SCENE_OBJECT_MESH)
        return object->mesh.has_color ? object->mesh.color : NULL;
    return object->shell.base.has_color ? object->shell.base.color : NULL;
}

bool surface_textured(const struct path_object *object) {
    return surface_wanted(object->object) && !scene_color(object->object) &&
           object->mesh->image_count > 0;
}

static GLuint make_texture(const struct mesh_image *image) {
    int longest = image->width > image->height ? image->width : image->height, levels = 1;
    while (longest >> levels)
        levels++;
    GLuint texture;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, levels, GL_SRGB8_ALPHA8, image->width, image->height);
    glTextureSubImage2D(texture, 0, 0, 0, image->width, image->height, GL_RGBA, GL_UNSIGNED_BYTE,
                        image->rgba);
    glGenerateTextureMipmap(texture);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    return texture;
}

/* Corners sorted by surface: a counting sort, since an asset may bring tens of thousands of
 * surfaces and millions of triangles. */
static void make_batches(const struct mesh *mesh, struct device_mesh *device) {
    for (uint32_t f = 0; f < mesh->triangle_count; f++)
        device->batches[mesh->surface[f]].count += 3;
    uint32_t next = 0;
    for (uint32_t s = 0; s < mesh->surface_count; s++) {
        struct batch *batch = &device->batches[s];
        batch->first = next;
        next += batch->count;
        memcpy(batch->color, mesh->surfaces[s].base_color, sizeof batch->color);
        if (mesh->surfaces[s].image >= 0)
            batch->texture = device->textures[mesh->surfaces[s].image];
    }
}

static void fill_corner(const struct mesh *mesh, enum attribute attribute, uint32_t f, int c,
                        const double center[3], float *out) {
    const double *p = mesh->position[mesh->vertex[f][c]];
    for (int i = 0; i < components[attribute]; i++)
        switch (attribute) {
        case POSITION:
            out[i] = (float)(p[i] - center[i]);
            break;
        case NORMAL:
            out[i] = mesh->corner_normal[f][c][i];
            break;
        default:
            /* Wrapping is the sampler's; whole tiles go before fp32 loses the fraction. */
            out[i] = (float)(mesh->corner_uv[f][c][i] - floor(mesh->corner_uv[f][0][i]));
        }
}

static void fill_corners(const struct mesh *mesh, struct device_mesh *device,
                         enum attribute attribute, float *out) {
    double center[3];
    for (int i = 0; i < 3; i++)
        center[i] = mesh->bounds_min[i] + (mesh->bounds_max[i] - mesh->bounds_min[i]) / 2;
    for (uint32_t s = 0; s < mesh->surface_count; s++)
        device->batches[s].count = 0; /* grows again as corners arrive */
    for (uint32_t f = 0; f < mesh->triangle_count; f++) {
        struct batch *batch = &device->batches[mesh->surface[f]];
        for (int c = 0; c < 3; c++) {
            size_t corner = batch->first + batch->count++;
            fill_corner(mesh, attribute, f, c, center,
                        out + corner * (size_t)components[attribute]);
        }
    }
}

static enum status no_memory(const struct mesh *mesh, struct error *err) {
    return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a mesh of %u triangles",
                       mesh->triangle_count);
}

static size_t attribute_bytes(const struct mesh *mesh, enum attribute attribute) {
    return 3 * (size_t)mesh->triangle_count * (size_t)components[attribute] * sizeof(float);
}

/* An attribute that a picture needs, unless an earlier one has needed it. */
static enum status want_attribute(struct device_mesh *device, const struct mesh *mesh,
                                  enum attribute attribute, struct picture *picture,
                                  struct error *err) {
    if (device->buffers[attribute])
        return STATUS_OK;
    size_t bytes = attribute_bytes(mesh, attribute);
    float *corners = malloc(bytes + 1);
    if (!corners)
        return no_memory(mesh, err);
    fill_corners(mesh, device, attribute, corners);
    glCreateBuffers(1, &device->buffers[attribute]);
    glNamedBufferStorage(device->buffers[attribute], (GLsizeiptr)(bytes + 4), NULL,
                         GL_DYNAMIC_STORAGE_BIT);
    glNamedBufferSubData(device->buffers[attribute], 0, (GLsizeiptr)bytes, corners);
    free(corners);
    GLuint array = device->vertex_array, at = (GLuint)attribute;
    glVertexArrayVertexBuffer(array, at, device->buffers[attribute], 0,
                              components[attribute] * (GLsizei)sizeof(float));
    glEnableVertexArrayAttrib(array, at);
    glVertexArrayAttribFormat(array, at, components[attribute], GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(array, at, at);
    picture->report->work.upload_bytes += bytes;
    return gl_check("uploading a mesh", err);
}

/* A mesh without attributes; its textures, where it was read with any. */
static enum status make_mesh(struct surface_pass *pass, const struct mesh *mesh,
                             struct picture *picture, struct error *err) {
    struct device_mesh *device = calloc(1, sizeof *device);
    if (!device)
        return no_memory(mesh, err);
    device->batch_count = mesh->surface_count;
    device->batches = calloc(mesh->surface_count + (size_t)1, sizeof *device->batches);
    device->textures = calloc(mesh->image_count + (size_t)1, sizeof *device->textures);
    if (!device->batches || !device->textures) {
        destroy_mesh(device);
        return no_memory(mesh, err);
    }
    size_t bytes = 0;
    for (uint32_t i = 0; i < mesh->image_count; i++) {
        if (!mesh->images[i].rgba)
            continue;
        device->textures[i] = make_texture(&mesh->images[i]);
        device->texture_count = i + 1;
        bytes += (size_t)mesh->images[i].width * (size_t)mesh->images[i].height * 16 / 3;
    }
    make_batches(mesh, device);
    glCreateVertexArrays(1, &device->vertex_array);
    picture->report->work.upload_bytes += bytes;
    /* The cache counts what may come later as if it were there. */
    for (int a = 0; a < ATTRIBUTES; a++)
        bytes += attribute_bytes(mesh, (enum attribute)a);
    if (!resident_add(&pass->meshes, mesh->serial, device, bytes))
        return no_memory(mesh, err);
    return gl_check("uploading a mesh", err);
}

enum status surface_pass_upload(struct surface_pass *pass, struct picture *picture,
                                struct error *err) {
    resident_begin_picture(&pass->meshes);
    enum status status = STATUS_OK;
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!surface_wanted(object->object))
            continue;
        const struct mesh *mesh = object->mesh;
        bool kept = resident_find(&pass->meshes, mesh->serial) != NULL;
        report_reuse(picture->report, REPORT_PART_tables, kept);
        if (!kept && (status = make_mesh(pass, mesh, picture, err)) != STATUS_OK)
            break;
        struct device_mesh *device = resident_find(&pass->meshes, mesh->serial);
        uint32_t variant =
            variant_of_surface(object, picture->lights.count, surface_textured(object));
        status = want_attribute(device, mesh, POSITION, picture, err);
        if (status == STATUS_OK && (variant & FLAG_LIT))
            status = want_attribute(device, mesh, NORMAL, picture, err);
        if (status == STATUS_OK && (variant & FLAG_TEXTURED))
            status = want_attribute(device, mesh, UV, picture, err);
    }
    return status;
}

enum status surface_pass_cast(struct surface_pass *pass, struct picture *picture,
                              struct error *err) {
    enum status status = STATUS_OK;
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!surface_wanted(object->object))
            continue;
        GLuint program;
        status = gl_programs_get(picture->programs, GL_PROGRAM_CASTER_SURFACE, 0, &program,
                                 &picture->cold, err);
        if (status != STATUS_OK)
            break;
        const struct device_mesh *device = resident_find(&pass->meshes, object->mesh->serial);
        struct frame frame;
        frame_clear(&frame);
        frame_set_view(&frame, picture, &object->mesh_view, object);
        frame_bind(&frame, &pass->frame_buffer);
        glBindVertexArray(device->vertex_array);
        glUseProgram(program);
        glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(3 * object->mesh->triangle_count));
        picture->report->work.draws++;
    }
    return status == STATUS_OK ? gl_check("drawing surfaces for shadows", err) : status;
}

static GLuint white(struct surface_pass *pass) {
    if (!pass->white)
        pass->white = make_texture(&(struct mesh_image){1, 1, (uint8_t[4]){255, 255, 255, 255}});
    return pass->white;
}

enum status surface_pass_draw(struct surface_pass *pass, struct picture *picture,
                              struct error *err) {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    enum status status = STATUS_OK;
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!surface_wanted(object->object))
            continue;
        const struct device_mesh *device = resident_find(&pass->meshes, object->mesh->serial);
        const double *color = scene_color(object->object);
        glBindVertexArray(device->vertex_array);
        struct frame frame;
        frame_clear(&frame);
        frame_set_view(&frame, picture, &object->mesh_view, object);
        shadow_bind(picture, &object->mesh_view, object);
        for (uint32_t b = 0; b < device->batch_count && status == STATUS_OK; b++) {
            const struct batch *batch = &device->batches[b];
            if (batch->count == 0)
                continue;
            bool textured = !color && batch->texture;
            uint32_t variant = variant_of_surface(object, picture->lights.count, textured);
            GLuint program;
            status = gl_programs_get(picture->programs, GL_PROGRAM_SURFACE, variant, &program,
                                     &picture->cold, err);
            if (status != STATUS_OK)
                break;
            for (int c = 0; c < 3; c++)
                frame.v[FRAME_CONSTANT][c] = color ? (float)color[c] : batch->color[c];
            frame_bind(&frame, &pass->frame_buffer);
            if (variant & FLAG_TEXTURED)
                glBindTextureUnit(BINDING_BASE_COLOR, textured ? batch->texture : white(pass));
            glUseProgram(program);
            glDrawArrays(GL_TRIANGLES, (GLint)batch->first, (GLsizei)batch->count);
            picture->report->work.draws++;
            picture->report->work.triangles += batch->count / 3;
        }
    }
    if (status == STATUS_OK)
        status = gl_check("drawing surfaces", err);
    return status;
}
