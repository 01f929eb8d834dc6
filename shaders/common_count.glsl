/* For measuring alone: counts the texture fetches that a fragment shader executes. Put before its text,
 * where it stands before every fetch, and again after it, where it makes main() (renderer/gl/source.c,
 * where FLAG_COUNT is set). What is counted are calls that are reached by samples inside a triangle,
 * those that end in `discard` included; a linear fetch counts once, however many texels it mixes. */
#ifndef COUNTING
#define COUNTING

layout(std430, binding = BINDING_COUNT) buffer Counts {
    uint counts[COUNT_SLOTS];
};

uint fetches = 0u;

/* By column: sums stay within 32 bits, and few samples wait for one another. */
void end_counting() {
    atomicAdd(counts[uint(gl_FragCoord.x) % uint(COUNT_SLOTS)], fetches);
}

vec4 count_fetch(samplerBuffer s, int at) {
    fetches++;
    return texelFetch(s, at);
}
uvec4 count_fetch(usamplerBuffer s, int at) {
    fetches++;
    return texelFetch(s, at);
}
vec4 count_fetch(sampler2D s, ivec2 at, int level) {
    fetches++;
    return texelFetch(s, at, level);
}
vec4 count_fetch(sampler2DArray s, ivec3 at, int level) {
    fetches++;
    return texelFetch(s, at, level);
}
vec4 count_texture(sampler2DArray s, vec3 at) {
    fetches++;
    return texture(s, at);
}
vec4 count_texture(sampler2D s, vec2 at) {
    fetches++;
    return texture(s, at);
}
vec4 count_texture(sampler3D s, vec3 at) {
    fetches++;
    return texture(s, at);
}

#define texelFetch count_fetch
#define texture count_texture
#define main counted_main
#define discard { end_counting(); discard; }

#else
#undef main
void main() {
    counted_main();
    end_counting();
}
#endif
