/* What a draw of media writes: radiance and optical depth, and what is let through of each channel of
 * what lies behind. After common_frame.glsl and common_math.glsl.
 *
 * Where extinction has colours (FLAG_FILL) there are three optical depths, of which the picture's alpha
 * keeps the one that lets through their mean. Such depths do not add up from draw to draw: renderer/tint.h
 * sees to it that there is one draw for a sample, or that alpha is 1 in any case. */
#if (VARIANT & FLAG_FILL) != 0
void show(vec3 color, vec3 tau, out vec4 picture, out vec4 through) {
    picture = vec4(color, depth_of_channels(tau));
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
#if (VARIANT & FLAG_FILL) != 0
    vec3 tau = frame[FRAME_GLOW].yzw * (frame[FRAME_CONSTANT].w * span);
    show(frame[FRAME_CONSTANT].rgb * span * mean_exp(tau), tau, picture, through);
#else
    float tau = frame[FRAME_CONSTANT].w * span;
    show(frame[FRAME_CONSTANT].rgb * one_minus_exp(tau), tau, picture, through);
#endif
}
#endif
