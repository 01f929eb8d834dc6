/* See shadow.h; shaders/common_shadow.glsl says what the maps hold and how they are asked. */
#include "renderer/path/shadow.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/path/cells.h"
#include "renderer/path/frame.h"
#include "renderer/path/light_view.h"
#include "renderer/path/variant.h"
#include "renderer/shell/precision.h"

/* Stands for "nothing there": farther than any depth, and finite. */
static const float FAR_AWAY = 1e30f;

struct shadow_maps {
    struct shadow_need need;
    struct view view[LIGHTS_MAX * SHADOW_FACES]; /* the world's */
    GLuint planes, ranges, depths;               /* for those who ask */
    GLuint depth, framebuffer;
    GLuint block; /* uniform buffer */
    float grid;   /* of the rasteriser, in texels */
};

struct shadow_pass {
    struct shadow_maps maps;
    struct cell_pass *cells;
    struct prism_maps prisms;
    struct outlines outlines;
};

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- maps ---- */

static void drop_maps(struct shadow_maps *maps) {
    glDeleteTextures(1, &maps->planes);
    glDeleteTextures(1, &maps->ranges);
    glDeleteTextures(1, &maps->depths);
    glDeleteTextures(1, &maps->depth);
    glDeleteFramebuffers(1, &maps->framebuffer);
    maps->planes = maps->ranges = maps->depths = maps->depth = maps->framebuffer = 0;
}

static GLuint make_map(GLenum target, GLenum format, int size, int layers) {
    GLuint texture;
    glCreateTextures(target, 1, &texture);
    if (target == GL_TEXTURE_2D)
        glTextureStorage2D(texture, 1, format, size, size);
    else
        glTextureStorage3D(texture, 1, format, size, size, layers);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return texture;
}

static enum status size_maps(struct shadow_maps *maps, const struct shadow_need *need,
                             struct error *err) {
    bool same = maps->framebuffer && maps->need.size == need->size &&
                maps->need.views == need->views && maps->need.layers == need->layers &&
                maps->need.opaque == need->opaque && maps->need.media == need->media &&
                maps->need.channels == need->channels;
    maps->need = *need;
    if (same)
        return STATUS_OK;
    drop_maps(maps);
    glCreateFramebuffers(1, &maps->framebuffer);
    if (need->opaque) {
        maps->planes = make_map(GL_TEXTURE_2D_ARRAY, GL_RGBA32F, need->size, need->views);
        maps->depth = make_map(GL_TEXTURE_2D, GL_DEPTH_COMPONENT32F, need->size, 1);
        glNamedFramebufferTexture(maps->framebuffer, GL_DEPTH_ATTACHMENT, maps->depth, 0);
    }
    if (need->media) {
        maps->ranges = make_map(GL_TEXTURE_2D_ARRAY, GL_RG32F, need->size, need->views);
        maps->depths = make_map(GL_TEXTURE_2D_ARRAY, GL_RGBA32F, need->size,
                                need->views * shadow_map_layers(need));
    }
    GLint bits = 4; /* what GL guarantees */
    glGetIntegerv(GL_SUBPIXEL_BITS, &bits);
    maps->grid = ldexpf(1, -bits);
    return gl_check("maps for shadows", err);
}

/* That a pass writes. */
enum { LAYERS_MAX = SHADOW_CHANNEL_LAYERS };
_Static_assert((int)LAYERS_MAX >= SHADOW_LAYERS && 12 % SHADOW_CHANNEL_LAYERS == 0,
               "passes write all layers of as many slices as there are");

/* From now on into `count` layers of a texture. */
static void aim(const struct shadow_maps *maps, GLuint texture, int layer, int count) {
    static const GLenum buffers[LAYERS_MAX] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                               GL_COLOR_ATTACHMENT2, GL_COLOR_ATTACHMENT3,
                                               GL_COLOR_ATTACHMENT4, GL_COLOR_ATTACHMENT5};
    for (int i = 0; i < LAYERS_MAX; i++)
        if (i >= count)
            glNamedFramebufferTexture(maps->framebuffer, buffers[i], 0, 0);
        else
            glNamedFramebufferTextureLayer(maps->framebuffer, buffers[i], texture, 0, layer + i);
    glNamedFramebufferDrawBuffers(maps->framebuffer, count, buffers);
    glBindFramebuffer(GL_FRAMEBUFFER, maps->framebuffer);
    glViewport(0, 0, maps->need.size, maps->need.size);
}

static void clear(const struct shadow_maps *maps, int count, float r, float g) {
    const float value[4] = {r, g, 0, 0};
    for (int i = 0; i < count; i++)
        glClearNamedFramebufferfv(maps->framebuffer, GL_COLOR, i, value);
}

/* ---- drawing ---- */

struct shadow_pass *shadow_pass_create(void) {
    struct shadow_pass *pass = calloc(1, sizeof *pass);
    if (!pass)
        return NULL;
    prism_maps_init(&pass->prisms);
    pass->cells = cell_pass_create(GL_PROGRAM_CASTER, &pass->prisms);
    if (!pass->cells) {
        shadow_pass_destroy(pass);
        return NULL;
    }
    return pass;
}

void shadow_pass_destroy(struct shadow_pass *pass) {
    if (!pass)
        return;
    drop_maps(&pass->maps);
    glDeleteBuffers(1, &pass->maps.block);
    cell_pass_destroy(pass->cells);
    prism_maps_finish(&pass->prisms);
    outlines_finish(&pass->outlines);
    free(pass);
}

/* All cells of the shells that hold something of the kind. */
static enum status outline(struct shadow_pass *pass, const struct picture *picture, bool solid,
                           struct error *err) {
    outlines_clear(&pass->outlines);
    for (size_t i = 0; i < picture->object_count; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->shell ||
            !(solid ? volume_has_solid(object->volume) : volume_has_medium(object->volume)))
            continue;
        for (uint32_t t = 0; t < object->shell->tetra_count; t++)
            if (!outlines_append(&pass->outlines, object, (uint32_t)i, t))
                return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for outlines");
    }
    picture->report->work.segments += pass->outlines.outline_count;
    if (pass->outlines.corner_count > UINT32_MAX / 2)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects", "too many outlines for one draw");
    return STATUS_OK;
}

static enum status draw_opaque(struct shadow_pass *pass, struct surface_pass *surface,
                               struct picture *picture, int layer, struct error *err) {
    static const float nothing = 0;
    aim(&pass->maps, pass->maps.planes, layer, 1);
    clear(&pass->maps, 1, FAR_AWAY, 0);
    cell_pass_begin_solid();
    glClearNamedFramebufferfv(pass->maps.framebuffer, GL_DEPTH, 0, &nothing);
    glDisable(GL_CULL_FACE);
    enum status status = surface_pass_cast(surface, picture, err);
    cell_pass_cast(pass->cells, GL_PROGRAM_CASTER, (const int[3]){0, 0, 0});
    if (status == STATUS_OK)
        status = outline(pass, picture, true, err);
    return status == STATUS_OK ? cell_pass_draw(pass->cells, picture, &pass->outlines, true, err)
                               : status;
}

static void begin_media(const struct picture *picture, GLuint depth, GLenum equation) {
    cell_pass_begin_media(picture);
    if (depth) {
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_GREATER);
        glBindTextureUnit(BINDING_OCCLUDER, depth);
    }
    glEnable(GL_BLEND);
    glBlendEquation(equation);
    glBlendFunc(GL_ONE, GL_ONE);
}

static enum status draw_media(struct shadow_pass *pass, struct picture *picture, int light,
                              struct error *err) {
    struct shadow_maps *maps = &pass->maps;
    int layers = shadow_map_layers(&maps->need), slices[3] = {3 * maps->need.layers, 0, light};
    int at_once = maps->need.channels ? SHADOW_CHANNEL_LAYERS : SHADOW_LAYERS;
    enum status status = outline(pass, picture, false, err);
    aim(maps, maps->ranges, light, 1);
    clear(maps, 1, FAR_AWAY, FAR_AWAY);
    begin_media(picture, maps->depth, GL_MIN);
    cell_pass_cast(pass->cells, GL_PROGRAM_CASTER_RANGE, slices);
    if (status == STATUS_OK)
        status = cell_pass_draw(pass->cells, picture, &pass->outlines, false, err);
    for (int done = 0; done < layers && status == STATUS_OK; done += at_once) {
        aim(maps, maps->depths, light * layers + done, at_once);
        clear(maps, at_once, 0, 0);
        begin_media(picture, maps->depth, GL_FUNC_ADD);
        slices[1] = maps->need.channels ? done : 3 * done;
        cell_pass_cast(pass->cells, GL_PROGRAM_CASTER, slices);
        glBindTextureUnit(BINDING_SHADOW_RANGES, maps->ranges);
        status = cell_pass_draw(pass->cells, picture, &pass->outlines, false, err);
    }
    glBlendEquation(GL_FUNC_ADD);
    glBindTextureUnit(BINDING_SHADOW_RANGES, 0);
    cell_pass_end_media();
    return status;
}

/* Steps across a thickness, as fine as the eye's. Planes are as far from one another as the shell's
 * diagonal over their number, or nearer; eight steps a layer of voxels err by a sixty-fourth of
 * what one does, and more of them say no more. */
static int steps_of_light(const struct path_object *object) {
    double steps = object->quality;
    if (object->object->path == SCENE_PATH_SLICING) {
        double across[3];
        for (int i = 0; i < 3; i++)
            across[i] = object->shell->bounds_max[i] - object->shell->bounds_min[i];
        steps *= object->shell->thickness / sqrt(dot(across, across));
        steps = fmin(steps, 8.0 * object->layers);
    }
    return steps > object->layers ? (int)steps : object->layers;
}

/* The picture's objects as a light sees them. */
static enum status see(struct picture *picture, struct error *err) {
    for (size_t i = 0; i < picture->object_count; i++) {
        struct path_object *object = &picture->objects[i];
        const double *transform = object->object->transform;
        view_in_object(&picture->world, transform, object->mesh_view.center, &object->mesh_view);
        object->projection = (struct projection){0};
        if (!object->shell)
            continue;
        struct view view;
        view_in_object(&picture->world, transform, object->shell->center, &view);
        enum status status = project_shell(object->shell, &view, &object->projection, err);
        if (status != STATUS_OK)
            return status;
        object->fp64 = precision_needs_fp64(object->shell, &object->projection, &picture->world);
        object->walk = false;
        object->method = SCENE_SLICING_SLABS;
        object->quality = steps_of_light(object);
        object->exact = object->object->quality.map != SCENE_MAP_AFFINE &&
                        path_object_drawn(object) && !object->volume->homogeneous &&
                        !object->shell->affine;
    }
    return STATUS_OK;
}

static enum status draw_light(struct shadow_pass *pass, struct surface_pass *surface,
                              struct picture *picture, int layer, struct error *err) {
    enum status status = see(picture, err);
    if (status == STATUS_OK)
        status = prism_maps_prepare(&pass->prisms, picture, err);
    cell_pass_cast(pass->cells, GL_PROGRAM_CASTER, (const int[3]){0, 0, 0});
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++)
        if (picture->objects[i].shell && path_object_drawn(&picture->objects[i]))
            status = cell_pass_prepare(pass->cells, &picture->objects[i], picture, err);
    if (status == STATUS_OK && pass->maps.need.opaque)
        status = draw_opaque(pass, surface, picture, layer, err);
    if (status == STATUS_OK && pass->maps.need.media)
        status = draw_media(pass, picture, layer, err);
    return status;
}

/* The view that has the layer; where nothing throws a shadow (forced), any. */
static void fit(const struct shadow_need *need, const struct scene *scene,
                const struct picture *picture, int layer, struct view *view) {
    static const double down[3] = {0, 0, -1};
    const double *direction = scene->lights[0].point ? down : scene->lights[0].direction;
    for (size_t k = 0; k < scene->light_count; k++)
        for (int face = 0; face < SHADOW_FACES; face++) {
            if (need->view[k][face] != layer)
                continue;
            if (scene->lights[k].point) {
                light_view_face(picture, scene->lights[k].position, face, need->size, view);
                return;
            }
            direction = scene->lights[k].direction;
        }
    light_view_fit(picture, direction, need->size, view);
}

/* `own`: the maps as a caster's shaders know them, their view being the first. */
static enum status draw_lights(struct shadow_pass *pass, struct surface_pass *surface,
                               struct picture *view, struct shadow_maps *own, struct error *err) {
    struct shadow_maps *maps = &pass->maps;
    const struct scene *scene = &view->report->resolved;
    const struct path_object *seen = view->objects;
    struct path_object *objects = calloc(view->object_count + 1, sizeof *objects);
    enum status status =
        objects ? STATUS_OK
                : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a light's view");
    for (int layer = 0; layer < maps->need.views && status == STATUS_OK; layer++) {
        fit(&maps->need, scene, view, layer, &maps->view[layer]);
        own->view[0] = maps->view[layer];
        for (size_t i = 0; i < view->object_count; i++) {
            objects[i] = seen[i];
            objects[i].projection = (struct projection){0};
        }
        struct picture one = *view;
        one.world = maps->view[layer];
        one.objects = objects;
        status = draw_light(pass, surface, &one, layer, err);
        view->cold |= one.cold;
        for (size_t i = 0; i < view->object_count; i++)
            projection_finish(&objects[i].projection);
    }
    free(objects);
    return status;
}

/* Places along a light's ray are told apart to SHADOW_ROUNDING: a shell that is not sixteen times
 * as deep has shadows on itself that are off by more than a sixteenth of its optical depth. */
void shadow_pass_warn(const struct shadow_pass *pass, const struct picture *picture) {
    const struct shadow_maps *maps = &pass->maps;
    for (size_t i = 0; i < picture->object_count && maps->need.media; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->shell || !variant_needs_normals(object, picture->lights.count) ||
            !volume_has_medium(object->volume))
            continue;
        struct view view;
        view_in_object(&maps->view[0], object->object->transform, object->shell->center, &view);
        double depth = sqrt(dot(view.h_row, view.h_row)) * object->shell->thickness;
        if (depth < 16 * SHADOW_ROUNDING)
            report_warn(
                picture->report, "shadow-coarse", object->pointer, 1, 0,
                "the shell is too thin for the depth of the scene: fp32 cannot tell where in "
                "it light has been stopped");
    }
}

enum status shadow_pass_draw(struct shadow_pass *pass, const struct shadow_need *need,
                             struct surface_pass *surface, struct picture *picture,
                             struct error *err) {
    stage_clock_next(picture->clock, REPORT_STAGE_shadow, true);
    if (!pass->maps.block)
        glCreateBuffers(1, &pass->maps.block);
    enum status status = STATUS_OK;
    if (need->count == 0)
        drop_maps(&pass->maps);
    else
        status = size_maps(&pass->maps, need, err);
    pass->maps.need = *need;
    picture->shadows = &pass->maps;
    if (status != STATUS_OK || need->count == 0)
        return status;
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    cell_pass_begin_picture(pass->cells);
    struct shadow_maps own = pass->maps;
    own.planes = own.ranges = own.depths = 0;
    own.need.views = 1;
    own.need.points = false;
    for (int k = 0; k < LIGHTS_MAX; k++)
        for (int face = 0; face < SHADOW_FACES; face++)
            own.need.view[k][face] = k + face == 0 ? 0 : -1;
    struct gl_target target = {.depth = 0};
    struct picture view = *picture;
    view.shadows = &own;
    view.occluded = need->opaque && need->media;
    view.blocks = NULL;
    view.met = NULL;
    view.target = &target;
    status = draw_lights(pass, surface, &view, &own, err);
    picture->cold |= view.cold;
    return status;
}

/* ---- for those who ask ---- */

static void set_row(float row[4], const double v[3], double scale, double last) {
    for (int i = 0; i < 3; i++)
        row[i] = (float)(v[i] * scale);
    row[3] = (float)last;
}

/* How a view's samples lie in the space of `view`, an object's. */
static void set_view(float (*row)[4], const struct view *world, const struct view *view,
                     const struct path_object *object, double size) {
    struct view light;
    view_in_object(world, object->object->transform, view->center, &light);
    /* In perspective, times 1 + t. */
    double h[4] = {0, 0, 0, 1};
    if (!world->orthographic)
        memcpy(h, light.h_row, sizeof h);
    for (int axis = 0; axis < 2; axis++) {
        const double *from = axis ? light.y_row : light.x_row;
        for (int i = 0; i < 4; i++)
            row[axis ? SHADOW_Y : SHADOW_X][i] = (float)((from[i] + h[i]) * size / 2);
    }
    set_row(row[SHADOW_T], light.h_row, 1, light.h_row[3] - 1);
    set_row(row[SHADOW_U], world->ou, 2 / size, 0);
    double depth = sqrt(dot(world->d0, world->d0));
    set_row(row[SHADOW_V], world->ov, 2 / size, 2 / size * sqrt(dot(world->ov, world->ov)) / depth);
    /* Depths of a light with a direction are within a quarter. */
    set_row(row[SHADOW_D], world->d0, 1,
            world->orthographic ? 1 : 4 * (1 / world->depth_scale + fabs(light.h_row[3] - 1)));
}

/* Where lights stand, from the world's centre, and how places in an object's space lie to that. */
static void set_points(float (*rows)[4], const struct scene *scene, const double world[3],
                       const double center[3], const double m[16]) {
    for (int r = 0; r < 3; r++) {
        double shift = m[12 + r] - world[r];
        for (int c = 0; c < 3; c++) {
            shift += m[4 * c + r] * center[c];
            rows[SHADOW_WORLD + r][c] = (float)m[4 * c + r];
        }
        rows[SHADOW_WORLD + r][3] = (float)shift;
    }
    for (size_t k = 0; k < scene->light_count && k < LIGHTS_MAX; k++) {
        const struct scene_light *light = &scene->lights[k];
        for (int i = 0; i < 3; i++)
            rows[SHADOW_POINT + k][i] = (float)(light->position[i] - world[i]);
        rows[SHADOW_POINT + k][3] = light->point ? (float)(light->radius * light->radius) : 0;
    }
}

void shadow_bind(const struct picture *picture, const struct view *view,
                 const struct path_object *object) {
    const struct shadow_maps *maps = picture->shadows;
    if (!maps)
        return;
    enum { VIEWS = SHADOW_FACES * SHADOW_VIEWS };
    float rows[SHADOW_VIEW + VIEWS * SHADOW_ROWS + 1][4];
    size_t used = SHADOW_VIEW + (maps->need.points ? VIEWS : SHADOW_VIEWS) * SHADOW_ROWS;
    memset(rows, 0, used * sizeof *rows);
    if (shadow_is_tinted(&maps->need))
        set_row(rows[used++], maps->need.tint, 1, 0);
    double size = maps->need.size;
    rows[0][0] = (float)size;
    rows[0][1] = size > 0 ? (float)(1 / size) : 0;
    rows[0][2] = (float)maps->need.layers;
    rows[0][3] = maps->grid;
    for (int k = 0; k < LIGHTS_MAX; k++)
        for (int face = 0; face < SHADOW_FACES; face++) {
            int layer = maps->need.view[k][face];
            rows[SHADOW_FACE + 2 * k + face / 4][face % 4] = (float)layer;
            if (layer >= 0)
                set_view(rows + SHADOW_VIEW + layer * SHADOW_ROWS, &maps->view[layer], view, object,
                         size);
        }
    const struct scene *scene = &picture->report->resolved;
    if (maps->need.points)
        set_points(rows, scene, picture->world.center, view->center, object->object->transform);
    glNamedBufferData(maps->block, (GLsizeiptr)(used * sizeof *rows), rows, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, BINDING_SHADOW, maps->block);
    glBindTextureUnit(BINDING_SHADOW_PLANES, maps->planes);
    glBindTextureUnit(BINDING_SHADOW_DEPTHS, maps->depths);
    if (maps->ranges)
        glBindTextureUnit(BINDING_SHADOW_RANGES, maps->ranges);
}
