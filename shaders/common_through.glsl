/* What a draw of media writes: radiance and optical depth, and what is let through of each channel of
 * what lies behind. After common_frame.glsl and common_math.glsl.
 *
 * Where extinction has colours (FLAG_TINT) there are three optical depths. Where all media of a picture
 * have the same colour, a sample keeps the largest, of which the others are shares: these add up from draw to
 * draw, and resolve.frag makes alpha of them. Else it keeps the one that lets through their mean. Such depths
 * do not add up: renderer/tint.h sees to it that there is one draw for a sample, or that alpha is 1 in any
 * case. */
#if (VARIANT & FLAG_TINT) != 0
void show(vec3 color, vec3 tau, out vec4 picture, out vec4 through) {
    picture = vec4(color, frame[FRAME_SCREEN].w != 0.0 ? most_of(tau) : depth_of_channels(tau));
    through = exp(-tau).rgbr; /* a: the blend factor where no extinction has colours */
}
#else
void show(vec3 color, float tau, out vec4 picture, out vec4 through) {
    picture = vec4(color, tau);
    through = vec4(exp(-tau));
}
#endif

#if (VARIANT & FLAG_HOMOGENEOUS) != 0
/* A way through a constant medium, in object units. */
void show_homogeneous(float span, out vec4 picture, out vec4 through) {
#if (VARIANT & FLAG_TINT) != 0
    vec3 tau = frame[FRAME_GLOW].yzw * (frame[FRAME_CONSTANT].w * span);
    show(frame[FRAME_CONSTANT].rgb * span * mean_exp(tau), tau, picture, through);
#else
    float tau = frame[FRAME_CONSTANT].w * span;
    show(frame[FRAME_CONSTANT].rgb * one_minus_exp(tau), tau, picture, through);
#endif
}
#endif
