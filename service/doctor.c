/* `pelt doctor`: gathers findings into one JSON object, and prints that, or a text made from it
 * (doctor_text.c).
 *
 * Whatever loads a foreign library runs in a child of its own, this program again as
 * `pelt doctor --probe NAME`: one GL backend for each process, and a driver that crashes or hangs
 * is then a finding, not the end of the doctor. A child prints one JSON object; what its libraries
 * print on the standard error is kept as `messages`. */
#include "service/doctor.h"

#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include "api/status.h"
#include "renderer/asset/module.h"
#include "renderer/gl/clock.h"
#include "renderer/gl/probe.h"
#include "service/cli.h"
#include "service/machine.h"

static const char usage[] =
    "usage: pelt doctor [--json] [--wait SECONDS]\n"
    "\n"
    "Says what this machine can draw with, what is missing, and what to install.\n"
    "Exits with 0 where a picture can be drawn, 6 where not.\n"
    "\n"
    "  --json          the findings as JSON\n"
    "  --wait SECONDS  how long to wait for each driver before it counts as hung (20)\n";

/* Drivers and kernels may say anything; JSON holds UTF-8 only. */
static json_t *text(const char *bytes) {
    json_t *string = json_string(bytes);
    if (string)
        return string;
    char *ascii = strdup(bytes);
    for (char *at = ascii; at && *at; at++)
        if ((unsigned char)*at >= 0x80)
            *at = '?';
    string = ascii ? json_string(ascii) : NULL;
    free(ascii);
    return string;
}

/* In the child -----------------------------------------------------------------------------------
 */

static json_t *probe_gl(enum gl_backend backend) {
    static struct gl_probe probe; /* 7 kB */
    gl_probe_backend(backend, &probe);
    json_t *devices = json_array();
    for (size_t i = 0; i < probe.device_count; i++)
        json_array_append_new(devices, json_pack("{s:o, s:b}", "name", text(probe.devices[i].name),
                                                 "software", probe.devices[i].software));
    json_t *found = json_pack("{s:b, s:o, s:b, s:o}", "usable", probe.usable, "library",
                              text(probe.library), "library_opened", probe.library_opened,
                              "library_version", text(probe.library_version));
    if (backend == GL_BACKEND_EGL)
        json_object_set(found, "devices", devices);
    json_decref(devices);
    if (!probe.usable) {
        json_object_set_new(found, "why", text(probe.why));
        return found;
    }
    const struct gl_info *info = &probe.info;
    json_object_update_new(
        found,
        json_pack("{s:o, s:o, s:o, s:o, s:b, s:s, s:i, s:i, s:i, s:f}", "device",
                  text(info->device), "vendor", text(info->vendor), "gl_renderer",
                  text(info->renderer), "gl_version", text(info->version), "software",
                  info->software, "clock", info->clock == REPORT_CLOCK_QUERY ? "query" : "fence",
                  "max_texture_size", info->max_texture_size, "max_3d_texture_size",
                  info->max_3d_texture_size, "max_texture_buffer_texels",
                  info->max_texture_buffer_texels, "open_ms", probe.open_ms));
    return found;
}

static json_t *probe_module(enum module module) {
    struct error err = {0};
    bool usable = module_open(module, &err) != NULL;
    json_t *found = json_pack("{s:b}", "usable", usable);
    if (!usable)
        json_object_set_new(found, "why",
                            text(err.fault_count && err.faults[0].message
                                     ? err.faults[0].message
                                     : status_title(err.status)));
    error_clear(&err);
    return found;
}

static json_t *probe(const char *name) {
    if (strcmp(name, "egl") == 0)
        return probe_gl(GL_BACKEND_EGL);
    if (strcmp(name, "osmesa") == 0)
        return probe_gl(GL_BACKEND_OSMESA);
    for (int i = 0; i < MODULE_COUNT; i++)
        if (strcmp(name, module_describe((enum module)i)->name) == 0)
            return probe_module((enum module)i);
    return NULL;
}

static int probe_main(const char *name) {
    json_t *found = probe(name);
    if (!found)
        return cli_usage("doctor", "there is nothing named %s to probe", name);
    bool good = json_dumpf(found, stdout, JSON_COMPACT) == 0 && fflush(stdout) == 0;
    json_decref(found);
    return good ? 0 : status_exit_code(STATUS_IO_ERROR);
}

/* In the parent ----------------------------------------------------------------------------------
 */

enum { STREAM_BYTES_MAX = 64 * 1024 };

/* One of the child's streams, read until its end; what is past the buffer is thrown away. */
struct stream {
    int descriptor;
    size_t used;
    char bytes[STREAM_BYTES_MAX + 1];
};

struct child {
    pid_t pid;
    bool hung;
    int status; /* of waitpid() */
    struct stream out, messages;
};

static bool start(struct child *child, const char *name) {
    extern char **environ;
    int out[2], messages[2];
    if (pipe2(out, O_CLOEXEC) != 0)
        return false;
    if (pipe2(messages, O_CLOEXEC) != 0) {
        close(out[0]);
        close(out[1]);
        return false;
    }
    char program[] = "/proc/self/exe", command[] = "doctor", option[] = "--probe", what[32];
    snprintf(what, sizeof what, "%s", name);
    char *const argv[] = {program, command, option, what, NULL};
    posix_spawn_file_actions_t actions;
    bool good = posix_spawn_file_actions_init(&actions) == 0;
    if (good) {
        good = posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO) == 0 &&
               posix_spawn_file_actions_adddup2(&actions, messages[1], STDERR_FILENO) == 0 &&
               posix_spawn(&child->pid, program, &actions, NULL, argv, environ) == 0;
        posix_spawn_file_actions_destroy(&actions);
    }
    close(out[1]);
    close(messages[1]);
    child->out.descriptor = out[0];
    child->messages.descriptor = messages[0];
    if (!good) {
        close(out[0]);
        close(messages[0]);
    }
    return good;
}

static void read_stream(struct stream *stream) {
    char rest[4096];
    size_t room = STREAM_BYTES_MAX - stream->used;
    ssize_t got = room ? read(stream->descriptor, stream->bytes + stream->used, room)
                       : read(stream->descriptor, rest, sizeof rest);
    if (got > 0 && room)
        stream->used += (size_t)got;
    if (got == 0 || (got < 0 && errno != EINTR)) {
        close(stream->descriptor);
        stream->descriptor = -1; /* poll() passes over it */
    }
}

/* Reads both streams until the child has ended, or kills it at the deadline. Not until the streams
 * end: what a driver has started may hold them open. */
static void finish(struct child *child, double wait_ms) {
    int process = pidfd_open(child->pid, 0);
    double deadline_ms = clock_now_ms() + wait_ms;
    bool ended = false;
    for (;;) {
        struct pollfd waits[3] = {{.fd = child->out.descriptor, .events = POLLIN},
                                  {.fd = child->messages.descriptor, .events = POLLIN},
                                  {.fd = process, .events = POLLIN}};
        double left_ms = ended ? 0 : deadline_ms - clock_now_ms();
        if (left_ms < 0 || process < 0) {
            child->hung = process >= 0;
            kill(child->pid, SIGKILL);
            break;
        }
        int ready = poll(waits, ended ? 2 : 3, ended ? 0 : (int)left_ms + 1);
        if (ready < 0 && errno != EINTR)
            break;
        if (ready > 0 && waits[0].revents)
            read_stream(&child->out);
        if (ready > 0 && waits[1].revents)
            read_stream(&child->messages);
        if (ended && ready <= 0)
            break; /* nothing is left in the pipes */
        ended = ended || (ready > 0 && waits[2].revents);
    }
    if (child->out.descriptor >= 0)
        close(child->out.descriptor);
    if (child->messages.descriptor >= 0)
        close(child->messages.descriptor);
    if (process >= 0)
        close(process);
    while (waitpid(child->pid, &child->status, 0) < 0 && errno == EINTR)
        ;
}

/* What a child said, or what became of it. */
static json_t *ask(const char *name, double wait_ms) {
    struct child *child = calloc(1, sizeof *child);
    json_t *found = NULL;
    char why[128] = "";
    if (!child || !start(child, name)) {
        free(child);
        return json_pack("{s:b, s:s}", "usable", false, "why", "no process can be started");
    }
    finish(child, wait_ms);
    if (child->hung)
        snprintf(why, sizeof why, "its driver hung: no answer within %.0f ms", wait_ms);
    else if (WIFSIGNALED(child->status))
        snprintf(why, sizeof why, "its driver crashed: %s", strsignal(WTERMSIG(child->status)));
    else if (WEXITSTATUS(child->status) != 0)
        snprintf(why, sizeof why, "its probe ended with exit code %d", WEXITSTATUS(child->status));
    else if (!(found = json_loadb(child->out.bytes, child->out.used, 0, NULL)))
        snprintf(why, sizeof why, "its probe gave no findings");
    if (!found)
        found = json_pack("{s:b, s:s}", "usable", false, "why", why);
    if (child->messages.used) {
        child->messages.bytes[child->messages.used] = 0;
        json_object_set_new(found, "messages", text(child->messages.bytes));
    }
    free(child);
    return found;
}

static bool is_usable(const json_t *found) {
    return json_is_true(json_object_get(found, "usable"));
}

static void miss(json_t *missing, const char *what, const char *packages, bool needed) {
    json_array_append_new(missing, json_pack("{s:s, s:s, s:b}", "what", what, "packages", packages,
                                             "needed", needed));
}

/* What to install. A backend is needed only where no other works, and then it is EGL: OSMesa is on
 * its way out. */
static json_t *list_missing(const json_t *egl, const json_t *osmesa, const json_t *modules) {
    json_t *missing = json_array(), *module;
    size_t i;
    if (!is_usable(egl))
        miss(missing, "EGL",
             json_is_false(json_object_get(egl, "library_opened"))
                 ? "libegl1 libegl-mesa0 libgl1-mesa-dri"
                 : "libegl-mesa0 libgl1-mesa-dri",
             !is_usable(osmesa));
    if (!is_usable(osmesa))
        miss(missing, "OSMesa", "libosmesa6", false);
    json_array_foreach(modules, i, module) if (!is_usable(module))
        miss(missing, json_string_value(json_object_get(module, "name")),
             json_string_value(json_object_get(module, "package")), false);
    return missing;
}

static json_t *look_at_machine(void) {
    static struct machine machine;
    machine_look(&machine);
    json_t *found = json_pack("{s:i, s:o, s:I, s:I}", "cores", machine.cores, "cpu",
                              text(machine.cpu), "memory_bytes", (json_int_t)machine.memory_bytes,
                              "memory_available_bytes", (json_int_t)machine.memory_available_bytes);
    if (machine.memory_limit_bytes)
        json_object_set_new(found, "memory_limit_bytes",
                            json_integer((json_int_t)machine.memory_limit_bytes));
    if (machine.address_space_bytes)
        json_object_set_new(found, "address_space_bytes",
                            json_integer((json_int_t)machine.address_space_bytes));
    return found;
}

static json_t *look_at_cache(void) {
    static struct shader_cache cache; /* 4 kB */
    machine_shader_cache(&cache);
    json_t *found =
        json_pack("{s:o, s:b}", "folder", text(cache.folder), "writable", cache.writable);
    if (!cache.writable)
        json_object_set_new(found, "why", text(cache.why));
    return found;
}

static json_t *examine(double wait_ms) {
    static const char *const needed_for[MODULE_COUNT] = {
        [MODULE_MESH_GLTF] = "meshes from glTF files",
        [MODULE_IMAGE_OIIO] = "images as assets, OpenEXR",
    };
    json_t *egl = ask("egl", wait_ms), *osmesa = ask("osmesa", wait_ms), *modules = json_array();
    for (int i = 0; i < MODULE_COUNT; i++) {
        const struct module_spec *spec = module_describe((enum module)i);
        json_t *found = ask(spec->name, wait_ms);
        json_object_update_new(found, json_pack("{s:s, s:s, s:s}", "name", spec->name, "package",
                                                spec->package, "needed_for", needed_for[i]));
        json_array_append_new(modules, found);
    }
    json_t *missing = list_missing(egl, osmesa, modules);
    const char *backend = is_usable(egl) ? "egl" : is_usable(osmesa) ? "osmesa" : NULL;
    return json_pack("{s:s, s:b, s:s?, s:o, s:o, s:o, s:o, s:o, s:o}", "version", PELT_VERSION,
                     "usable", backend != NULL, "backend", backend, "egl", egl, "osmesa", osmesa,
                     "modules", modules, "shader_cache", look_at_cache(), "machine",
                     look_at_machine(), "missing", missing);
}

int doctor_main(int argc, char **argv) {
    static const struct option rows[] = {{"json", no_argument, NULL, 'j'},
                                         {"wait", required_argument, NULL, 'w'},
                                         {"probe", required_argument, NULL, 'p'},
                                         {"help", no_argument, NULL, 'h'},
                                         {0}};
    bool json = false;
    double wait_s = 20;
    int option;
    char *end;
    while ((option = getopt_long(argc, argv, "h", rows, NULL)) != -1)
        switch (option) {
        case 'j':
            json = true;
            break;
        case 'w':
            wait_s = strtod(optarg, &end);
            if (end == optarg || *end || !(wait_s > 0 && wait_s <= 3600))
                return cli_usage("doctor", "--wait %s is no time between 0 and 3600 s", optarg);
            break;
        case 'p':
            return probe_main(optarg);
        case 'h':
            fputs(usage, stdout);
            return 0;
        default:
            return status_exit_code(STATUS_USAGE);
        }
    if (optind < argc)
        return cli_usage("doctor", "what is %s?", argv[optind]);
    json_t *findings = examine(wait_s * 1e3);
    if (!findings) {
        fputs("pelt doctor: memory ran out\n", stderr);
        return status_exit_code(STATUS_OUT_OF_MEMORY);
    }
    int code = is_usable(findings) ? 0 : status_exit_code(STATUS_NO_GL);
    if (json) {
        json_dumpf(findings, stdout, JSON_INDENT(2) | JSON_PRESERVE_ORDER);
        putchar('\n');
    } else {
        doctor_print(stdout, findings);
    }
    json_decref(findings);
    if (fflush(stdout) != 0 || ferror(stdout))
        return status_exit_code(STATUS_IO_ERROR);
    return code;
}
