/* Read by C and by GLSL alike: flags of the shader variants, binding points, table layouts.
 * Only preprocessor lines that both understand. */
#ifndef PELT_SHADERS_INTERFACE_H
#define PELT_SHADERS_INTERFACE_H

/* Variant flags: a bit each; GLSL tests (VARIANT & FLAG_X) != 0 in #if. */
#define FLAG_MEDIUM      0x0001 /* the material has extinction */
#define FLAG_SOLID       0x0002 /* the material has a solid field: find its first surface */
#define FLAG_HOMOGENEOUS 0x0004 /* constant extinction: closed form, no texture, no loop */
#define FLAG_LIT         0x0008 /* directional and ambient light */
#define FLAG_SPECULAR    0x0010 /* a specular term */
#define FLAG_OCCLUDED    0x0020 /* opaque things exist: clip each segment at their depth */
#define FLAG_EYE_INSIDE  0x0040 /* the eye may be inside a cell: clip each segment at the eye */
#define FLAG_TEXTURED    0x0080 /* a surface with a base colour texture */

#define LIGHTS_MAX 8

#endif
