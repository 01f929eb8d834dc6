/* The uniform block every program shares, and the ray of a sample. For every stage. A program that
 * draws several shells at once defines FRAMES, and has as many blocks one after another: `at` is where
 * a shell's begins. */
#ifndef FRAMES
#define FRAMES 1
#endif
layout(std140, binding = BINDING_FRAME) uniform Frame {
    vec4 frame[FRAMES * FRAME_VEC4S];
};

/* A read of a uniform block costs llvmpipe a gather, some 27 instructions a word, even where its index is
 * a constant, and no compiler takes it out of a loop: so what loops ask for is read here, before them. */
vec3 frame_size = frame[FRAME_SIZE].xyz; /* voxels along u, v, w */
vec3 frame_normal_x = frame[FRAME_NORMAL].xyz, frame_normal_y = frame[FRAME_NORMAL + 1].xyz;
vec3 frame_normal_z = frame[FRAME_NORMAL + 2].xyz;

vec3 ray_origin(vec2 p, int at) {
    return frame[at + FRAME_O0].xyz + p.x * frame[at + FRAME_OU].xyz + p.y * frame[at + FRAME_OV].xyz;
}

vec3 ray_origin(vec2 p) {
    return ray_origin(p, 0);
}

/* Not normalised: the eye is at t = -1. */
vec3 ray_direction(vec2 p, int at) {
    return frame[at + FRAME_D0].xyz + p.x * frame[at + FRAME_DU].xyz + p.y * frame[at + FRAME_DV].xyz;
}

vec3 ray_direction(vec2 p) {
    return ray_direction(p, 0);
}

/* Toward the viewer, in the world. */
vec3 view_vector(vec2 p) {
    return -normalize(frame[FRAME_VIEW_D0].xyz + p.x * frame[FRAME_VIEW_DU].xyz +
                      p.y * frame[FRAME_VIEW_DV].xyz);
}

vec3 world_normal(vec3 gradient, int at) {
    return vec3(dot(frame[at + FRAME_NORMAL].xyz, gradient),
                dot(frame[at + FRAME_NORMAL + 1].xyz, gradient),
                dot(frame[at + FRAME_NORMAL + 2].xyz, gradient));
}

vec3 world_normal(vec3 gradient) {
    return vec3(dot(frame_normal_x, gradient), dot(frame_normal_y, gradient), dot(frame_normal_z, gradient));
}

/* Steps that a segment takes for each unit of its length. */
#ifndef STEP_RATE
#define STEP_RATE frame[FRAME_STEP].x
#endif
