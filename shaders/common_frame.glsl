/* The uniform block every program shares, and the ray of a sample. For every stage. */
layout(std140, binding = BINDING_FRAME) uniform Frame {
    vec4 frame[FRAME_VEC4S];
};

vec3 ray_origin(vec2 p) {
    return frame[FRAME_O0].xyz + p.x * frame[FRAME_OU].xyz + p.y * frame[FRAME_OV].xyz;
}

/* Not normalised: the eye is at t = -1. */
vec3 ray_direction(vec2 p) {
    return frame[FRAME_D0].xyz + p.x * frame[FRAME_DU].xyz + p.y * frame[FRAME_DV].xyz;
}

/* Toward the viewer, in the world. */
vec3 view_vector(vec2 p) {
    return -normalize(frame[FRAME_VIEW_D0].xyz + p.x * frame[FRAME_VIEW_DU].xyz +
                      p.y * frame[FRAME_VIEW_DV].xyz);
}

vec3 world_normal(vec3 gradient) {
    return vec3(dot(frame[FRAME_NORMAL].xyz, gradient), dot(frame[FRAME_NORMAL + 1].xyz, gradient),
                dot(frame[FRAME_NORMAL + 2].xyz, gradient));
}
