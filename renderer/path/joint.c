/* See joint.h; shaders/overlap.frag says what is done. */
#include "renderer/path/joint.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/shadow.h"
#include "renderer/path/variant.h"

enum { CELL_BYTES = WALK_TEXELS * 16, LINK_BYTES = 16, MAP_BYTES = MAP_TEXELS * 16 };
enum { TABLES = 3 }; /* cells, links, maps */

/* Bits of slot[].z in the shader. */
enum { SLOT_LIT = 1, SLOT_EXACT = 2, SLOT_MIPS = 4, SLOT_STRANDS = 8 };

static bool any_exact(const struct joint *joint) {
    for (uint32_t i = 0; i < joint->shell_count; i++)
        if (joint->shell[i].maps)
            return true;
    return false;
}

/* A homogeneous medium's filling is part of its constants, but not where channels lose shares of
 * it.
 */
static bool fills(const struct joint *joint) {
    bool tinted = false, filled = false, voxels = false;
    for (uint32_t i = 0; i < joint->shell_count; i++) {
        const struct volume *volume = joint->shell[i].object->volume;
        tinted |= volume_is_tinted(volume);
        filled |= volume_is_filled(volume);
        voxels |= volume_is_filled(volume) && !volume->homogeneous;
    }
    return voxels || (tinted && filled);
}

/* Lit shells of one picture are all lit by the same lights: with a direction, or by none. */
static uint32_t variant_of(const struct joint *joint, const struct picture *picture) {
    uint32_t more = joint->slots - 2, flags = picture->occluded ? FLAG_OCCLUDED : 0;
    flags |= fills(joint) ? FLAG_FILL : 0;
    flags |= (more & 1 ? FLAG_SLOTS_1 : 0) | (more & 2 ? FLAG_SLOTS_2 : 0);
    for (uint32_t i = 0; i < joint->shell_count; i++)
        flags |= variant_of_shell(joint->shell[i].object, picture->lights.count, false, false) &
                 (FLAG_LIT | FLAG_LIGHTS | FLAG_SPECULAR | FLAG_AMBIENT | FLAG_STRANDS | FLAG_TINT |
                  FLAGS_PLACE | FLAGS_COLORED);
    if (flags & FLAG_LIT)
        flags &= ~(uint32_t)FLAG_AMBIENT;
    for (uint32_t i = 0; i < joint->shell_count; i++)
        if (joint->shell[i].object->filter == SCENE_FILTER_MIP)
            flags |= FLAG_FILTER;
    return flags | (any_exact(joint) ? FLAG_EXACT : 0);
}

/* A fragment shader has 16 texture units by GL's guarantee: five slots take 16, and shadows three
 * more. What a driver without them would say on linking names no cause. */
static enum status check_units(const struct joint *joint, const struct picture *picture,
                               struct error *err) {
    enum { OWN = 6 }; /* cells, links, maps, entries, first entries, the depth of what is opaque */
    uint32_t flags = variant_of(joint, picture);
    int slots = 2 + (flags & FLAG_SLOTS_1 ? 1 : 0) + (flags & FLAG_SLOTS_2 ? 2 : 0);
    int needed = OWN + 2 * slots + (flags & FLAG_SHADOW_OPAQUE ? 1 : 0) +
                 (flags & FLAG_SHADOW_MEDIA ? 2 : 0);
    GLint units = 16;
    glGetIntegerv(GL_MAX_TEXTURE_IMAGE_UNITS, &units);
    if (needed <= units)
        return STATUS_OK;
    return error_fault(
        err, STATUS_NOT_IMPLEMENTED, "/objects",
        "shells that overlap, under lights that throw shadows, take %d textures: this "
        "GL holds %d in a shader; `quality.order` `sorted` takes fewer",
        needed, (int)units);
}

static GLuint one_texel(const float value[4]) {
    GLuint texture;
    glCreateTextures(GL_TEXTURE_3D, 1, &texture);
    glTextureStorage3D(texture, 1, GL_RGBA32F, 1, 1, 1);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTextureSubImage3D(texture, 0, 0, 0, 0, 1, 1, 1, GL_RGBA, GL_FLOAT, value);
    return texture;
}

/* The layout of a baked medium: extinction-weighted colour and extinction, times the thickness.
 * `filled`: the frame holds what fills it besides, else that is part of it. */
static GLuint constant_of(const struct path_object *object, bool filled) {
    double radiance[3], depth = path_object_constant(object, radiance);
    if (filled) {
        depth = object->volume->extinction;
        memcpy(radiance, object->volume->radiance, sizeof radiance);
    }
    depth *= object->shell->thickness;
    float value[4] = {(float)(depth * radiance[0]), (float)(depth * radiance[1]),
                      (float)(depth * radiance[2]), (float)depth};
    return one_texel(value);
}

static void drop_tables(struct joint *joint) {
    glDeleteTextures(TABLES, joint->textures);
    glDeleteBuffers(TABLES, joint->buffers);
    for (int table = 0; table < TABLES; table++)
        joint->textures[table] = joint->buffers[table] = 0;
}

static enum status upload_area(struct joint *joint, const struct overlap_draw *from,
                               struct picture *picture, struct error *err) {
    float(*corner)[2] = malloc(((size_t)from->area_count * 6 + 1) * sizeof *corner);
    if (!corner)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to walk");
    static const int at[6][2] = {{0, 1}, {2, 1}, {2, 3}, {0, 1}, {2, 3}, {0, 3}};
    uint32_t count = 0;
    for (uint32_t i = 0; i < from->area_count; i++)
        for (int v = 0; v < 6; v++, count++)
            for (int c = 0; c < 2; c++)
                corner[count][c] = (float)from->area[i][at[v][c]]; /* exact: below 2^24 */
    if (!joint->array) {
        glCreateBuffers(1, &joint->corners);
        glCreateVertexArrays(1, &joint->array);
        glEnableVertexArrayAttrib(joint->array, 0);
        glVertexArrayAttribFormat(joint->array, 0, 2, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(joint->array, 0, 0);
        glVertexArrayVertexBuffer(joint->array, 0, joint->corners, 0, sizeof *corner);
    }
    joint->corner_count = count;
    glNamedBufferData(joint->corners, (GLsizeiptr)(count * sizeof *corner), corner, GL_STREAM_DRAW);
    picture->report->work.upload_bytes += count * sizeof *corner;
    free(corner);
    return STATUS_OK;
}

enum status joint_prepare(struct joint *joint, struct picture *picture,
                          const struct overlap_draw *from, GLint texels_max, struct error *err) {
    static const GLenum formats[TABLES] = {GL_RGBA32F, GL_RGBA32UI, GL_RGBA32F};
    static const size_t sizes[TABLES] = {CELL_BYTES, LINK_BYTES, MAP_BYTES};
    size_t cells = 0;
    bool filled = fills(joint);
    joint->slots = 0;
    for (uint32_t i = 0; i < joint->shell_count; i++) {
        joint->shell[i].first = (uint32_t)cells;
        cells += joint->shell[i].object->shell->tetra_count;
        joint->slots += joint->shell[i].slots;
        glDeleteTextures(1, &joint->constant[i]);
        joint->constant[i] = joint->shell[i].object->volume->homogeneous
                                 ? constant_of(joint->shell[i].object, filled)
                                 : 0;
    }
    if (cells * WALK_TEXELS > (size_t)texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "overlapping shells of %zu tetrahedra: this GL holds %zu in one table",
                           cells, (size_t)texels_max / WALK_TEXELS);
    int tables = any_exact(joint) ? TABLES : TABLES - 1;
    drop_tables(joint);
    glCreateBuffers(tables, joint->buffers);
    glCreateTextures(GL_TEXTURE_BUFFER, tables, joint->textures);
    for (int table = 0; table < tables; table++) {
        /* Copied on the device; one shell's own buffers serve as they are. Where a shell has no
         * maps their place is there, and what is read of it is not used. */
        GLuint buffer = joint->buffers[table];
        if (joint->shell_count > 1)
            glNamedBufferStorage(buffer, (GLsizeiptr)(cells * sizes[table]), NULL, 0);
        for (uint32_t i = 0; i < joint->shell_count; i++) {
            const struct joint_shell *shell = &joint->shell[i];
            GLuint own = table == 0 ? shell->cells : table == 1 ? shell->links : shell->maps;
            if (joint->shell_count == 1)
                buffer = own;
            else if (own)
                glCopyNamedBufferSubData(
                    own, buffer, 0, (GLintptr)(shell->first * sizes[table]),
                    (GLsizeiptr)(shell->object->shell->tetra_count * sizes[table]));
        }
        glTextureBuffer(joint->textures[table], formats[table], buffer);
    }
    GLuint program;
    enum status status = check_units(joint, picture, err);
    if (status == STATUS_OK)
        status = upload_area(joint, from, picture, err);
    if (status == STATUS_OK)
        status = gl_programs_get(picture->programs, GL_PROGRAM_OVERLAP, variant_of(joint, picture),
                                 &program, &picture->cold, err);
    return status == STATUS_OK ? gl_check("joining shells", err) : status;
}

/* The uniform blocks, one a slot; `limit`: most steps, what is let through where a ray ends. */
static enum status bind_frames(struct joint *joint, struct picture *picture, float limit[2],
                               struct error *err) {
    struct frame frames[SLOTS_MAX];
    uint32_t slot = 0;
    limit[0] = 1;
    limit[1] = INFINITY;
    for (uint32_t i = 0; i < joint->shell_count; i++) {
        const struct path_object *object = joint->shell[i].object;
        for (uint32_t k = 0; k < joint->shell[i].slots; k++, slot++) {
            struct frame *frame = &frames[slot];
            frame_clear(frame);
            frame_set_view(frame, picture, &object->projection.view, object);
            frame_set_shell(frame, object);
            if (object->volume->homogeneous) {
                frame->v[FRAME_STEP][0] = 0; /* exact in one step */
                continue;
            }
            limit[0] = fmaxf(limit[0], frame->v[FRAME_STEP][2]);
            limit[1] = fminf(limit[1], frame->v[FRAME_SCREEN][2]);
        }
    }
    limit[1] = isinf(limit[1]) ? 0 : limit[1];
    shadow_bind(picture, &joint->shell[0].object->projection.view, joint->shell[0].object);
    if (!joint->frames)
        glCreateBuffers(1, &joint->frames);
    glNamedBufferData(joint->frames, (GLsizeiptr)(slot * sizeof *frames), frames, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, BINDING_FRAME, joint->frames);
    return gl_check("uploading a joint walk's constants", err);
}

enum status joint_draw(struct joint *joint, struct picture *picture, GLuint first, GLuint entries,
                       int visits, struct error *err) {
    GLuint program;
    float limit[2];
    enum status status = gl_programs_get(picture->programs, GL_PROGRAM_OVERLAP,
                                         variant_of(joint, picture), &program, &picture->cold, err);
    if (status == STATUS_OK)
        status = bind_frames(joint, picture, limit, err);
    if (status != STATUS_OK)
        return status;
    if (!joint->nothing)
        joint->nothing = one_texel((const float[4]){0, 0, 0, 0});
    glUseProgram(program);
    glProgramUniform1i(program, 0, (GLint)joint->starts);
    glProgramUniform1i(program, 1, picture->world.width);
    glProgramUniform1i(program, 2, visits);
    glProgramUniform2f(program, 3, limit[0], limit[1]);
    GLuint slot = 0;
    for (uint32_t i = 0; i < joint->shell_count; i++) {
        const struct joint_shell *shell = &joint->shell[i];
        const struct baked *baked = shell->object->baked;
        bool lit = baked && shell->object->volume->lit;
        bool mips = shell->object->filter == SCENE_FILTER_MIP;
        bool strands =
            baked && shell->object->volume->strand_lit && path_object_strands(shell->object);
        GLuint gradient = !baked    ? 0
                          : strands ? path_object_strands(shell->object)
                          : mips    ? baked->gradient_mips
                                    : baked->medium_gradient;
        for (uint32_t k = 0; k < shell->slots; k++, slot++) {
            glProgramUniform3ui(program, (GLint)(4 + slot), i, shell->first,
                                (lit ? SLOT_LIT : 0u) | (shell->maps ? SLOT_EXACT : 0u) |
                                    (mips ? SLOT_MIPS : 0u) | (strands ? SLOT_STRANDS : 0u));
            glBindTextureUnit(BINDING_SLOT_MEDIUM + slot, !baked ? joint->constant[i]
                                                          : mips ? baked->medium_mips
                                                                 : baked->medium);
            glBindTextureUnit(BINDING_SLOT_GRADIENT + slot, gradient ? gradient : joint->nothing);
        }
    }
    glBindTextureUnit(BINDING_CELLS, joint->textures[0]);
    glBindTextureUnit(BINDING_LINKS, joint->textures[1]);
    if (joint->textures[2])
        glBindTextureUnit(BINDING_MAPS, joint->textures[2]);
    glBindTextureUnit(BINDING_FIRST, first);
    glBindTextureUnit(BINDING_ENTRIES, entries);
    if (picture->blocks) {
        gl_blocks_draw(picture->blocks, program, 0);
    } else {
        /* fullscreen.vert, its corners being whole samples. */
        glProgramUniform4f(program, LOCATION_BLOCK, 1, 2 / (float)picture->world.width,
                           2 / (float)picture->world.height, 0);
        glBindVertexArray(joint->array);
        glDrawArrays(GL_TRIANGLES, 0, (GLsizei)joint->corner_count);
    }
    picture->report->work.draws++;
    return gl_check("walking through overlapping shells", err);
}

void joint_finish(struct joint *joint) {
    drop_tables(joint);
    glDeleteBuffers(1, &joint->frames);
    glDeleteBuffers(1, &joint->corners);
    glDeleteVertexArrays(1, &joint->array);
    glDeleteTextures(SLOTS_MAX, joint->constant);
    glDeleteTextures(1, &joint->nothing);
    *joint = (struct joint){0};
}
