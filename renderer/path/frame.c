/* See frame.h; everything is rounded to fp32 here and nowhere before. */
#include "renderer/path/frame.h"

#include <math.h>
#include <string.h>

static void set3(float row[4], const double v[3]) {
    for (int i = 0; i < 3; i++)
        row[i] = (float)v[i];
}

/* What set3() left off. */
static void set3_low(float row[4], const double v[3]) {
    for (int i = 0; i < 3; i++)
        row[i] = (float)(v[i] - (double)(float)v[i]);
}

void frame_clear(struct frame *frame) {
    memset(frame, 0, sizeof *frame);
}

/* Of the ray at the edge of the picture that a half side v leads to; 0 in orthographic views. */
static float slope_squared(const double v[3], double distance) {
    double slope = hypot(hypot(v[0], v[1]), v[2]) / distance;
    return (float)(slope * slope);
}

void frame_set_view(struct frame *frame, const struct picture *picture, const struct view *view,
                    const struct path_object *object) {
    set3(frame->v[FRAME_O0], view->o0);
    set3(frame->v[FRAME_OU], view->ou);
    set3(frame->v[FRAME_OV], view->ov);
    set3(frame->v[FRAME_D0], view->d0);
    set3(frame->v[FRAME_DU], view->du);
    set3(frame->v[FRAME_DV], view->dv);
    frame->v[FRAME_O0][3] = (float)view->depth_scale;
    frame->v[FRAME_OU][3] = (float)(view->h_row[3] - 1);
    frame->v[FRAME_SCREEN][0] = 2.0f / (float)view->width;
    frame->v[FRAME_SCREEN][1] = 2.0f / (float)view->height;
    /* Only its direction matters: scaled to the largest component, so that gradients of objects a
     * millionth or a million units wide neither vanish nor overflow. */
    double largest = 0;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            largest = fmax(largest, fabs(object->normal_rows[r][c]));
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            frame->v[FRAME_NORMAL + r][c] = (float)(object->normal_rows[r][c] / largest);
    set3(frame->v[FRAME_VIEW_D0], picture->world.d0);
    set3(frame->v[FRAME_VIEW_DU], picture->world.du);
    set3(frame->v[FRAME_VIEW_DV], picture->world.dv);
    double length = hypot(hypot(picture->world.d0[0], picture->world.d0[1]), picture->world.d0[2]);
    frame->v[FRAME_VIEW_DU][3] = slope_squared(picture->world.du, length);
    frame->v[FRAME_VIEW_DV][3] = slope_squared(picture->world.dv, length);
    for (int i = 0; i < 4; i++) {
        frame->v[FRAME_X_ROW][i] = (float)view->x_row[i];
        frame->v[FRAME_Y_ROW][i] = (float)view->y_row[i];
        frame->v[FRAME_H_ROW][i] = (float)view->h_row[i];
    }
    const double *rays[6] = {view->o0, view->ou, view->ov, view->d0, view->du, view->dv};
    for (int i = 0; i < 6; i++)
        set3_low(frame->v[FRAME_LOW + i], rays[i]);
    const double *rows[3] = {view->x_row, view->y_row, view->h_row};
    for (int i = 0; i < 3; i++) {
        set3_low(frame->v[FRAME_LOW + 6 + i], rows[i]);
        frame->v[FRAME_LOW + 6 + i][3] = (float)(rows[i][3] - (double)(float)rows[i][3]);
    }
    const struct light_set *lights = &picture->lights;
    memcpy(frame->v[FRAME_AMBIENT], lights->ambient, sizeof lights->ambient);
    frame->v[FRAME_AMBIENT][3] = (float)lights->count;
    memcpy(frame->v[FRAME_LIGHT_SUM], lights->even, sizeof lights->even);
    for (int k = 0; k < lights->count; k++) {
        memcpy(frame->v[FRAME_LIGHT_DIR + k], lights->toward[k], sizeof lights->toward[k]);
        memcpy(frame->v[FRAME_LIGHT_COLOR + k], lights->color[k], sizeof lights->color[k]);
    }
    frame->v[FRAME_SCREEN][3] = picture->shares ? 1 : 0;
    frame->v[FRAME_MATERIAL][3] = view->orthographic ? 1 : 0;
    frame->v[FRAME_SIZE][3] = object->mirrored ? -1 : 1;
}

static double steps_of(const struct path_object *object, int quality) {
    return ceil((double)object->shell->longest * quality / object->shell->thickness) + 1;
}

double frame_steps_needed(const struct path_object *object) {
    return steps_of(object, object->quality);
}

int frame_steps_max(const struct path_object *object) {
    double steps = frame_steps_needed(object);
    if (path_object_leaps(object, false) || path_object_leaps(object, true)) {
        bool more = object->quality > object->layers;
        steps = STEPS_VOXELS * steps_of(object, more ? object->quality : object->layers);
    }
    return (int)fmin(steps, PATH_STEPS_MAX);
}

double path_object_constant(const struct path_object *object, double radiance[3]) {
    const struct volume *volume = object->volume;
    const struct shell *shell = object->shell;
    if (!volume_is_filled(volume)) {
        memcpy(radiance, volume->radiance, sizeof volume->radiance);
        return volume->extinction;
    }
    double extinction = volume->extinction + volume->absorption, diagonal = 0;
    for (int i = 0; i < 3; i++)
        diagonal = hypot(diagonal, shell->bounds_max[i] - shell->bounds_min[i]);
    /* Light that is added where nothing is lost is no multiple of what is lost: so that much is
     * lost as fp32 does not see, 1e-9 across the whole of the shell. */
    if (volume->emission[0] > 0 || volume->emission[1] > 0 || volume->emission[2] > 0)
        extinction = fmax(extinction, 1e-9 / diagonal);
    for (int i = 0; i < 3; i++)
        radiance[i] =
            extinction > 0
                ? (volume->extinction * volume->radiance[i] + volume->emission[i]) / extinction
                : 0;
    return extinction;
}

void frame_set_shell(struct frame *frame, const struct path_object *object) {
    const struct volume *volume = object->volume;
    frame->v[FRAME_STEP][0] = (float)(object->quality / object->shell->thickness);
    frame->v[FRAME_STEP][1] = (float)(1 / object->shell->thickness);
    frame->v[FRAME_STEP][2] = (float)frame_steps_max(object);
    frame->v[FRAME_OV][3] = (float)volume->size[2] / (float)object->quality;
    /* A ray may end where what is left of it cannot matter: that error must vanish with the square
     * of the steps, as the integration's does (1e-4 at 32 steps, where the integration's is 1e-2),
     * and with few steps, where the field may still be constant, be no more than that. */
    frame->v[FRAME_SCREEN][2] =
        (float)fmin(1e-4, 0.1 / ((double)object->quality * object->quality));
    frame->v[FRAME_STEP][3] = object->object->shell.has_base ? 1 : 0;
    double constant[3] = {0, 0, 0}, extinction = 0, thickness = object->shell->thickness;
    /* Tinted: what is given on the way, instead of what it tends to (common_through.glsl). */
    if (volume->homogeneous && volume_is_tinted(volume)) {
        extinction = volume->extinction + volume->absorption;
        for (int i = 0; i < 3; i++)
            constant[i] =
                volume->tint[i] * volume->extinction * volume->radiance[i] + volume->emission[i];
    } else if (volume->homogeneous) {
        extinction = path_object_constant(object, constant);
    }
    for (int i = 0; i < 3; i++) {
        frame->v[FRAME_SIZE][i] = (float)volume->size[i];
        frame->v[FRAME_CONSTANT][i] = (float)constant[i];
        frame->v[FRAME_FILL][i] = (float)(volume->emission[i] * thickness);
        frame->v[FRAME_GLOW][i + 1] = (float)volume->tint[i];
    }
    for (int i = 0; i < 2 && object->filter == SCENE_FILTER_VIEW; i++)
        frame->v[FRAME_NORMAL + i][3] = (float)object->baked->aspect[i];
    frame->v[FRAME_CONSTANT][3] = (float)extinction;
    frame->v[FRAME_FILL][3] = (float)(volume->absorption * thickness);
    frame->v[FRAME_GLOW][0] = (float)volume->glow;
    frame->v[FRAME_MATERIAL][0] = volume->specular;
    frame->v[FRAME_MATERIAL][1] = volume->shininess;
}

void frame_set_spacing(struct frame *frame, double spacing, double step) {
    /* A step may be longer by a 63rd, so that what rounds a run of slabs up costs no step more. */
    frame->v[FRAME_STEP][0] = (float)(63.0 / 64 / spacing);
    frame->v[FRAME_STEP][2] = PATH_STEPS_MAX;
    frame->v[FRAME_VIEW_D0][3] = (float)(63.0 / 64 / step);
}

void frame_bind(const struct frame *frame, GLuint *buffer) {
    if (!*buffer)
        glCreateBuffers(1, buffer);
    glNamedBufferData(*buffer, sizeof *frame, frame, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, BINDING_FRAME, *buffer);
}

/* Voxels that a step may pass before it is told of: of two, a ray at 45 degrees reads every one. */
enum { STEP_VOXELS_MAX = 2 };

void frame_warn_skipped(const struct path_object *object, double step, const char *by,
                        struct report *report) {
    double voxels = 0;
    for (int i = 0; i < 2; i++)
        voxels = fmax(voxels, object->shell->tiles_rate[i] * object->volume->size[i] * step);
    if (voxels > STEP_VOXELS_MAX)
        report_warn(report, "voxels-skipped", object->pointer, 1, 0,
                    "a step along the surface passes %.3g voxels: `tiles` is large for `%s`, and "
                    "slanting rays miss what lies between",
                    voxels, by);
}

void frame_warn_fixed(const struct path_object *object, const char *why, struct report *report) {
    report_warn(report, "traversal-fixed", object->pointer, 1, 0,
                "%s: there steps are of equal length, and leap over nothing", why);
}
