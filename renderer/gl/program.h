/* Shader variants. A variant is a row of shaders/programs.def and a bit field of the flags in
 * shaders/interface.h; the bit field is the key, and reaches GLSL as `#define VARIANT 0x..`, so a
 * branch that a scene does not need is not compiled in. */
#ifndef PELT_RENDERER_GL_PROGRAM_H
#define PELT_RENDERER_GL_PROGRAM_H

#include <glad/gl.h>
#include <stdbool.h>
#include <stdint.h>

#include "api/status.h"

enum gl_program_id {
#define PROGRAM(name, vert, frag, comp, flags) GL_PROGRAM_##name,
#include "shaders/programs.def"
#undef PROGRAM
    GL_PROGRAM_COUNT
};

struct gl_programs; /* a cache of linked variants, for one context */
struct gl_programs *gl_programs_create(void);
void gl_programs_destroy(struct gl_programs *programs);

/* The linked program; compiled on first use, then *compiled (may be NULL) is set to true and never
 * to false. `variant` must make sense (gl_program_makes_sense). Owned by the cache. A context must
 * be current. STATUS_GL_ERROR carries the compiler's log, STATUS_OUT_OF_MEMORY. */
enum status gl_programs_get(struct gl_programs *programs, enum gl_program_id id, uint32_t variant,
                            GLuint *program, bool *compiled, struct error *err);

/* How many variants were asked for since a picture began: linked before, or in it. */
void gl_programs_begin_picture(struct gl_programs *programs);
void gl_programs_used(const struct gl_programs *programs, uint32_t *kept, uint32_t *made);

/* For measuring alone: while on, fragment shaders count the texture fetches that they execute
 * (shaders/common_count.glsl); how many since it was last turned on. STATUS_GL_ERROR. */
enum status gl_programs_count(struct gl_programs *programs, bool on, struct error *err);
uint64_t gl_programs_counted(const struct gl_programs *programs);

/* The variants linked so far, in order; false past the last. */
bool gl_programs_at(const struct gl_programs *programs, size_t index, enum gl_program_id *id,
                    uint32_t *variant);

/* The complete text of one stage of a variant (includes resolved, defines in place), malloc'ed.
 * `stage`: "vert", "frag" or "comp". NULL where the program has no such stage. No GL needed. */
char *gl_program_source(enum gl_program_id id, uint32_t variant, const char *stage);

/* For the checks: the name of a program, the flags it knows, and whether a combination of flags is
 * one that is ever drawn: VARIANT_MAKES_SENSE in shaders/interface.h, and no flag it does not know.
 */
const char *gl_program_name(enum gl_program_id id); /* "TETRA"; static storage */
uint32_t gl_program_flags(enum gl_program_id id);
bool gl_program_makes_sense(enum gl_program_id id, uint32_t variant);

/* The file of a stage ("vert", "frag", "comp") without folder, static storage; NULL: no such stage.
 */
const char *gl_program_file(enum gl_program_id id, const char *stage);

#endif
