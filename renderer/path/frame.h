/* The uniform block that all programs share (FRAME_* of shaders/interface.h), filled from what a
 * picture and an object know. */
#ifndef PELT_RENDERER_PATH_FRAME_H
#define PELT_RENDERER_PATH_FRAME_H

#include <glad/gl.h>

#include "renderer/path/path.h"

struct frame {
    float v[FRAME_VEC4S][4];
};

void frame_clear(struct frame *frame);

/* Rays and projection in an object's space, the world's view vectors, lights, normals. */
void frame_set_view(struct frame *frame, const struct picture *picture, const struct view *view,
                    const struct path_object *object);

/* Shell: step length, extinction scale, voxels, material constants. */
void frame_set_shell(struct frame *frame, const struct path_object *object);

/* For shaders/slabs.frag: steps no longer than from plane to plane, `spacing` apart in H (view.h),
 * nor than `step`, object units, in the middle of the picture (runs_step()). After
 * frame_set_view(). */
void frame_set_spacing(struct frame *frame, double spacing, double step);

/* The most steps any segment of the object's shell needs; a segment takes PATH_STEPS_MAX at most
 * (it bounds every loop; a driver ends a longer one silently at 65,535). */
enum { PATH_STEPS_MAX = 8192 };
double frame_steps_needed(const struct path_object *object);

/* The most steps that rays take in any segment of it. Those that leap from voxel to voxel may take
 * STEPS_VOXELS times as many as others need for their layers; smaller voxels they pass over. */
enum { STEPS_VOXELS = 16 };
int frame_steps_max(const struct path_object *object);

/* Warns (`voxels-skipped`) where a step of `step` object units along the surface passes over
 * voxels, which are few for what the quality named `by` asks for. */
void frame_warn_skipped(const struct path_object *object, double step, const char *by,
                        struct report *report);

/* Warns (`traversal-fixed`) that a medium's steps do not leap as asked, `why`. */
void frame_warn_fixed(const struct path_object *object, const char *why, struct report *report);

/* Uploads the block into `buffer` (made if 0) and binds it. */
void frame_bind(const struct frame *frame, GLuint *buffer);

#endif
