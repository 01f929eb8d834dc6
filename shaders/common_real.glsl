/* What rays meet cells in: fp32, or doubles where that would lose thin or long cells (FLAG_FP64; when:
 * renderer/shell/precision.h). Doubles arrive as two floats each. After common_frame.glsl. */
#if (VARIANT & FLAG_FP64) != 0
#define REAL  double
#define REAL2 dvec2
#define REAL3 dvec3
#define REAL4 dvec4
#define FRAME_REAL(at, low) (dvec4(frame[at]) + dvec4(frame[FRAME_LOW + (low)]))

layout(binding = BINDING_CELLS_LOW) uniform samplerBuffer cells_low;

/* What the four vectors of a cell are too short of. */
void fetch_low(samplerBuffer cells_low, int cell, out dvec3 low0, out dvec3 low1, out dvec3 low2, out dvec3 low3) {
    vec4 a = texelFetch(cells_low, cell * LOW_TEXELS);
    vec4 b = texelFetch(cells_low, cell * LOW_TEXELS + 1);
    vec4 c = texelFetch(cells_low, cell * LOW_TEXELS + 2);
    low0 = dvec3(a.xyz);
    low1 = dvec3(a.w, b.xy);
    low2 = dvec3(b.zw, c.x);
    low3 = dvec3(c.yzw);
}

/* The grid's size is a whole number, which 2 / size in fp32 still tells. */
REAL2 sample_position_real() {
    return dvec2(gl_FragCoord.xy) * 2.0lf / dvec2(round(2.0 / frame[FRAME_SCREEN].xy)) - 1.0lf;
}
#else
#define REAL  float
#define REAL2 vec2
#define REAL3 vec3
#define REAL4 vec4
#define FRAME_REAL(at, low) frame[at]

REAL2 sample_position_real() {
    return sample_position();
}
#endif

REAL3 ray_origin_real(REAL2 p) {
    return FRAME_REAL(FRAME_O0, 0).xyz + p.x * FRAME_REAL(FRAME_OU, 1).xyz +
           p.y * FRAME_REAL(FRAME_OV, 2).xyz;
}

REAL3 ray_direction_real(REAL2 p) {
    return FRAME_REAL(FRAME_D0, 3).xyz + p.x * FRAME_REAL(FRAME_DU, 4).xyz +
           p.y * FRAME_REAL(FRAME_DV, 5).xyz;
}
