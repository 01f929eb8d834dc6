/* Which sample a fragment is: for fragment shaders only, since gl_FragCoord is. After
 * common_frame.glsl. */

/* (x, y) in [-1, 1] of this sample. gl_FragCoord is exact; an interpolant is not. */
vec2 sample_position() {
    return gl_FragCoord.xy * frame[FRAME_SCREEN].xy - 1.0;
}
