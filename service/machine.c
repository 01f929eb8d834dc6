/* Processors, memory and the shader cache, from the kernel's own files. Linux only, as all of Pelt.
 */
#include "service/machine.h"

#include <errno.h>
#include <pwd.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

/* Calls `line` for each line of a file; a file that is not there has none. */
static void each_line(const char *path, void (*line)(const char *text, void *user), void *user) {
    FILE *file = fopen(path, "re");
    if (!file)
        return;
    char text[512];
    while (fgets(text, sizeof text, file))
        line(text, user);
    fclose(file);
}

static void memory_line(const char *text, void *user) {
    struct machine *machine = user;
    unsigned long long kilobytes;
    if (sscanf(text, "MemTotal: %llu kB", &kilobytes) == 1)
        machine->memory_bytes = kilobytes * 1024;
    else if (sscanf(text, "MemAvailable: %llu kB", &kilobytes) == 1)
        machine->memory_available_bytes = kilobytes * 1024;
}

static void cpu_line(const char *text, void *user) {
    struct machine *machine = user;
    const char *colon = strchr(text, ':');
    if (machine->cpu[0] || !colon || strncmp(text, "model name", 10) != 0)
        return;
    colon += strspn(colon, ": \t");
    snprintf(machine->cpu, sizeof machine->cpu, "%.*s", (int)strcspn(colon, "\n"), colon);
}

/* cgroup v2 shows a container its own limit here; outside one the root has no such file. */
static void limit_line(const char *text, void *user) {
    struct machine *machine = user;
    unsigned long long bytes;
    if (sscanf(text, "%llu", &bytes) == 1) /* "max" is no number */
        machine->memory_limit_bytes = bytes;
}

void machine_look(struct machine *machine) {
    *machine = (struct machine){.cores = 1};
    cpu_set_t cores;
    if (sched_getaffinity(0, sizeof cores, &cores) == 0)
        machine->cores = CPU_COUNT(&cores);
    each_line("/proc/meminfo", memory_line, machine);
    each_line("/proc/cpuinfo", cpu_line, machine);
    each_line("/sys/fs/cgroup/memory.max", limit_line, machine);
    struct rlimit limit;
    if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        machine->address_space_bytes = limit.rlim_cur;
}

/* Mesa's env_var_as_boolean(). */
static bool says_yes(const char *variable) {
    const char *value = getenv(variable);
    return value && (strcmp(value, "1") == 0 || strcasecmp(value, "true") == 0 ||
                     strcasecmp(value, "y") == 0 || strcasecmp(value, "yes") == 0);
}

/* The folder that Mesa puts its own into. False: there is none. */
static bool find_base(char base[4096]) {
    static const char *const variables[] = {"MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR",
                                            "XDG_CACHE_HOME"};
    int length = 0;
    const char *given = NULL;
    for (size_t i = 0; !given && i < sizeof variables / sizeof *variables; i++)
        given = getenv(variables[i]);
    if (given) {
        length = snprintf(base, 4096, "%s", given);
    } else {
        const struct passwd *user = getpwuid(getuid()); /* not $HOME: Mesa does not look at it */
        if (user)
            length = snprintf(base, 4096, "%s/.cache", user->pw_dir);
    }
    return length > 0 && length < 4096;
}

/* Whether `path` is a folder that can be written; -1: it does not exist. */
static int folder_writable(const char *path, struct shader_cache *cache) {
    struct stat info;
    if (stat(path, &info) != 0) {
        snprintf(cache->why, sizeof cache->why, "%.180s: %s", path, strerror(errno));
        return errno == ENOENT ? -1 : 0;
    }
    if (S_ISDIR(info.st_mode) && access(path, W_OK | X_OK) == 0)
        return 1;
    snprintf(cache->why, sizeof cache->why, "%.200s %s", path,
             S_ISDIR(info.st_mode) ? "cannot be written" : "is no folder");
    return 0;
}

void machine_shader_cache(struct shader_cache *cache) {
    *cache = (struct shader_cache){0};
    char path[4096];
    if (says_yes("MESA_SHADER_CACHE_DISABLE") || says_yes("MESA_GLSL_CACHE_DISABLE")) {
        snprintf(cache->why, sizeof cache->why, "switched off by the environment");
        return;
    }
    if (!find_base(path)) {
        snprintf(cache->why, sizeof cache->why,
                 "there is no home folder, and MESA_SHADER_CACHE_DIR is not set");
        return;
    }
    snprintf(cache->folder, sizeof cache->folder, "%.4000s/mesa_shader_cache", path);

    /* Mesa makes its own folder and the one around it, but none above that. */
    int writable = folder_writable(cache->folder, cache);
    if (writable < 0)
        writable = folder_writable(path, cache);
    if (writable < 0) {
        char *slash = strrchr(path, '/');
        if (slash)
            slash[slash == path ? 1 : 0] = 0;
        writable = folder_writable(slash ? path : ".", cache);
    }
    cache->writable = writable == 1;
    if (cache->writable)
        cache->why[0] = 0;
}
