/* What `pelt doctor` tells of the machine besides OpenGL: processors, memory, the shader cache. */
#ifndef PELT_SERVICE_MACHINE_H
#define PELT_SERVICE_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

struct machine {
    int cores;                                     /* that this process may run on */
    char cpu[128];                                 /* "" where the kernel does not tell */
    uint64_t memory_bytes, memory_available_bytes; /* 0 where the kernel does not tell */
    uint64_t memory_limit_bytes;                   /* of the control group; 0: no limit */
    uint64_t address_space_bytes;                  /* RLIMIT_AS; 0: no limit */
};

void machine_look(struct machine *machine);

/* Where Mesa keeps compiled shaders between runs. Without it each process compiles again: 235 ms in
 * place of 9 for one program. */
struct shader_cache {
    char folder[4096]; /* "" where Mesa has none */
    bool writable;     /* exists and can be written, or can be made */
    char why[256];     /* where not writable */
};

/* Follows Mesa 22.3's rules: MESA_SHADER_CACHE_DISABLE, MESA_SHADER_CACHE_DIR, XDG_CACHE_HOME, the
 * home folder of the user database. Makes nothing. */
void machine_shader_cache(struct shader_cache *cache);

#endif
