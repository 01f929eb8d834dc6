/* Light as the design defines it ("One truth", Light): colour x (ambient + sum L max(0, n.l))
 * + specular x sum L max(0, n.h)^shininess, without 1/pi. Blinn 1977 for the half vector.
 * `weight` is 1 on surfaces; a medium weighs the directional terms by it, and what is left over comes
 * evenly from all around: sum L / 4, the mean of max(0, n.l) over the sphere. `material`: specular,
 * shininess. */
vec3 lit(vec3 color, vec3 n, vec3 v, float weight, vec2 material) {
    vec3 diffuse = vec3(0.0), gloss = vec3(0.0);
    int count = int(frame[FRAME_AMBIENT].w), i = 0;
    do {
        vec3 l = frame[FRAME_LIGHT_DIR + i].xyz, radiance = frame[FRAME_LIGHT_COLOR + i].rgb;
        diffuse += radiance * max(0.0, dot(n, l));
#if (VARIANT & FLAG_SPECULAR) != 0
        /* pow(0, 0) is undefined, and the half vector of opposite directions has no length. */
        vec3 h = l + v;
        float c = dot(n, h) * inversesqrt(max(dot(h, h), 1.0e-20));
        gloss += c > 0.0 ? radiance * pow(max(c, 1.0e-20), material.y) : vec3(0.0);
#endif
    } while (++i < min(count, LIGHTS_MAX));
    return color * (frame[FRAME_AMBIENT].rgb + weight * diffuse +
                    (1.0 - weight) * frame[FRAME_LIGHT_SUM].rgb) +
           weight * material.x * gloss;
}

vec3 lit(vec3 color, vec3 n, vec3 v, float weight) {
    return lit(color, n, v, weight, frame[FRAME_MATERIAL].xy);
}
