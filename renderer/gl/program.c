/* The cache of linked programs: one small table, searched in order (a scene uses a handful).
 *
 * Text comes from source.c, flags and file names from shaders/programs.def. Drawing once to make a
 * driver finish its compilation (llvmpipe compiles at the first draw) is the caller's: only the
 * caller knows the state it will draw with. */
#include "renderer/gl/program.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/gl/source.h"
#include "shaders/interface.h"

static const struct {
    const char *name, *vert, *frag, *comp;
    uint32_t flags;
} rows[GL_PROGRAM_COUNT] = {
#define PROGRAM(name, vert, frag, comp, flags)                                                     \
    [GL_PROGRAM_##name] = {#name, vert, frag, comp, flags},
#include "shaders/programs.def"
#undef PROGRAM
};

struct entry {
    enum gl_program_id id;
    uint32_t variant;
    GLuint program;
    uint64_t picture; /* that used it last */
};

struct gl_programs {
    struct entry *entries;
    size_t count, capacity;
    uint64_t picture;
    uint32_t kept, made; /* that this picture uses */
    bool counting;
    GLuint counts; /* COUNT_SLOTS sums of fetches */
};

const char *gl_program_name(enum gl_program_id id) {
    return rows[id].name;
}

uint32_t gl_program_flags(enum gl_program_id id) {
    return rows[id].flags;
}

bool gl_program_makes_sense(enum gl_program_id id, uint32_t variant) {
    uint32_t known = rows[id].flags;
    return (variant & ~known) == 0 && VARIANT_MAKES_SENSE(variant, known);
}

const char *gl_program_file(enum gl_program_id id, const char *stage) {
    if (strcmp(stage, "vert") == 0)
        return rows[id].vert;
    if (strcmp(stage, "frag") == 0)
        return rows[id].frag;
    return strcmp(stage, "comp") == 0 ? rows[id].comp : NULL;
}

char *gl_program_source(enum gl_program_id id, uint32_t variant, const char *stage) {
    const char *file = gl_program_file(id, stage);
    struct gl_source source;
    if (!file)
        return NULL;
    if (gl_source_assemble(&source, file, variant, NULL) != STATUS_OK) {
        gl_source_finish(&source);
        return NULL;
    }
    return source.text; /* gl_source owns nothing else */
}

struct gl_programs *gl_programs_create(void) {
    return calloc(1, sizeof(struct gl_programs));
}

void gl_programs_destroy(struct gl_programs *programs) {
    if (!programs)
        return;
    for (size_t i = 0; i < programs->count; i++)
        glDeleteProgram(programs->entries[i].program);
    glDeleteBuffers(1, &programs->counts);
    free(programs->entries);
    free(programs);
}

/* The log of a shader or a program; malloc'ed, NULL where memory ran out. */
static char *info_log(GLuint object, bool program) {
    GLint length = 0;
    if (program)
        glGetProgramiv(object, GL_INFO_LOG_LENGTH, &length);
    else
        glGetShaderiv(object, GL_INFO_LOG_LENGTH, &length);
    char *log = calloc(1, (size_t)(length > 0 ? length : 0) + 1);
    if (log && length > 0) {
        if (program)
            glGetProgramInfoLog(object, length, NULL, log);
        else
            glGetShaderInfoLog(object, length, NULL, log);
    }
    return log;
}

static enum status compile_stage(GLuint program, const char *file, GLenum type, uint32_t variant,
                                 struct error *err) {
    struct gl_source source;
    GLuint shader = 0;
    char *log = NULL, *readable = NULL;
    enum status status = gl_source_assemble(&source, file, variant, err);
    if (status != STATUS_OK)
        goto done;
    shader = glCreateShader(type);
    const char *text = source.text;
    GLint compiled = GL_FALSE;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (!compiled) {
        log = info_log(shader, false);
        readable = log ? gl_source_translate_log(&source, log) : NULL;
        status = error_fault(err, STATUS_GL_ERROR, NULL,
                             "shader %s, variant 0x%04x, does not compile: %s", file,
                             (unsigned)variant, readable ? readable : "no log");
        goto done;
    }
    glAttachShader(program, shader);
done:
    glDeleteShader(shader); /* only marked while the program holds it */
    gl_source_finish(&source);
    free(log);
    free(readable);
    return status;
}

static enum status build(enum gl_program_id id, uint32_t variant, GLuint *result,
                         struct error *err) {
    enum status status = STATUS_OK;
    GLuint program = glCreateProgram();
    if (rows[id].vert)
        status = compile_stage(program, rows[id].vert, GL_VERTEX_SHADER, variant, err);
    if (status == STATUS_OK && rows[id].frag)
        status = compile_stage(program, rows[id].frag, GL_FRAGMENT_SHADER, variant, err);
    if (status == STATUS_OK && rows[id].comp)
        status = compile_stage(program, rows[id].comp, GL_COMPUTE_SHADER, variant, err);
    if (status != STATUS_OK) {
        glDeleteProgram(program);
        return status;
    }
    GLint linked = GL_FALSE;
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked) {
        char *log = info_log(program, true);
        status =
            error_fault(err, STATUS_GL_ERROR, NULL, "program %s, variant 0x%04x, does not link: %s",
                        rows[id].name, (unsigned)variant, log ? log : "no log");
        free(log);
        glDeleteProgram(program);
        return status;
    }
    *result = program;
    return STATUS_OK;
}

enum status gl_programs_get(struct gl_programs *programs, enum gl_program_id id, uint32_t variant,
                            GLuint *program, bool *compiled, struct error *err) {
    assert(id < GL_PROGRAM_COUNT);
    assert(gl_program_makes_sense(id, variant));
    variant |= programs->counting ? FLAG_COUNT : 0;
    for (size_t i = 0; i < programs->count; i++) {
        struct entry *entry = &programs->entries[i];
        if (entry->id == id && entry->variant == variant) {
            programs->kept += entry->picture != programs->picture;
            entry->picture = programs->picture;
            *program = entry->program;
            return STATUS_OK;
        }
    }
    if (programs->count == programs->capacity) {
        size_t capacity = programs->capacity ? programs->capacity * 2 : 16;
        struct entry *grown = realloc(programs->entries, capacity * sizeof *grown);
        if (!grown)
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "shader programs: memory ran out");
        programs->entries = grown;
        programs->capacity = capacity;
    }
    enum status status = build(id, variant, program, err);
    if (status != STATUS_OK)
        return status;
    programs->entries[programs->count++] = (struct entry){id, variant, *program, programs->picture};
    programs->made++;
    if (compiled)
        *compiled = true;
    return STATUS_OK;
}

void gl_programs_begin_picture(struct gl_programs *programs) {
    programs->picture++;
    programs->kept = programs->made = 0;
}

void gl_programs_used(const struct gl_programs *programs, uint32_t *kept, uint32_t *made) {
    *kept = programs->kept;
    *made = programs->made;
}

enum status gl_programs_count(struct gl_programs *programs, bool on, struct error *err) {
    static const uint32_t zeros[COUNT_SLOTS];
    programs->counting = on;
    if (!on)
        return STATUS_OK;
    glDeleteBuffers(1, &programs->counts);
    glCreateBuffers(1, &programs->counts);
    glNamedBufferStorage(programs->counts, sizeof zeros, zeros, 0);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, BINDING_COUNT, programs->counts);
    return gl_check("counting fetches", err);
}

uint64_t gl_programs_counted(const struct gl_programs *programs) {
    uint32_t counts[COUNT_SLOTS] = {0};
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    if (programs->counts)
        glGetNamedBufferSubData(programs->counts, 0, sizeof counts, counts);
    uint64_t sum = 0;
    for (int i = 0; i < COUNT_SLOTS; i++)
        sum += counts[i];
    return sum;
}

bool gl_programs_at(const struct gl_programs *programs, size_t index, enum gl_program_id *id,
                    uint32_t *variant) {
    if (index >= programs->count)
        return false;
    *id = programs->entries[index].id;
    *variant = programs->entries[index].variant;
    return true;
}
