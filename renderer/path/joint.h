/* The joint walk of the tetra path: one draw in which each ray walks through several stretches at
 * once (shaders/overlap.frag), where parts of a shell, or shells, overlap. */
#ifndef PELT_RENDERER_PATH_JOINT_H
#define PELT_RENDERER_PATH_JOINT_H

#include "renderer/path/path.h"
#include "renderer/shell/overlap.h"

/* A shell that takes part. */
struct joint_shell {
    const struct path_object *object;
    GLuint cells, links;   /* buffers of its tables (walk.c) */
    GLuint maps;           /* of its prisms (prism_maps.h); 0: its textures are read affinely */
    uint32_t slots, first; /* stretches of it that are walked at once; its first cell, set here */
};

/* One joint draw; what it holds on the device outlives pictures. Zeroed is empty. */
struct joint {
    struct joint_shell shell[SLOTS_MAX];
    uint32_t shell_count, slots;    /* slots: of all */
    uint32_t starts;                /* entries that every ray begins with */
    GLuint buffers[3], textures[3]; /* cells, links and maps of all shells, one after another */
    GLuint frames, array, corners;  /* rectangles of samples, two triangles each */
    uint32_t corner_count;
    GLuint constant[SLOTS_MAX], nothing; /* textures of one texel: homogeneous media; no gradient */
};

/* Brings the tables of joint->shell[] and the rectangles of samples together and finds the program;
 * shell[], shell_count and starts are set. STATUS_TOO_COMPLEX, STATUS_OUT_OF_MEMORY,
 * STATUS_GL_ERROR. A context must be current in all of these. */
enum status joint_prepare(struct joint *joint, struct picture *picture,
                          const struct overlap_draw *from, GLint texels_max, struct error *err);

/* Draws its samples, or picture->blocks, over what is there. `first`, `entries`: buffer textures
 * with what overlap.h calls first and door. Blending is set. */
enum status joint_draw(struct joint *joint, struct picture *picture, GLuint first, GLuint entries,
                       int visits, struct error *err);

void joint_finish(struct joint *joint);

#endif
