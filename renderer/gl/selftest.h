/* What Pelt needs of a GL, tried rather than believed: fp32 colour with blending from two sources,
 * a depth buffer of 32-bit floats that can be read. Private to renderer/gl. */
#ifndef PELT_RENDERER_GL_SELFTEST_H
#define PELT_RENDERER_GL_SELFTEST_H

#include "renderer/gl/context.h"

/* Draws 4 x 4 pixels and compares each with the exact result. STATUS_NO_GL says which ability is
 * missing. A context must be current; blocks until the GL is done; GL state is left as it was. */
enum status gl_selftest(const struct gl_info *info, struct error *err);

const char *gl_error_name(unsigned code); /* "GL_INVALID_ENUM"; static storage */

#endif
