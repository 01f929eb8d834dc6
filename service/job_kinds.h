/* The kinds of long work, one row each, and what a kind's function is given.
 *
 * To add a kind: a row in job_kinds.c, and, where it has a resource of its own (POST /v1/sweep), a
 * row in routes.c. */
#ifndef PELT_SERVICE_JOB_KINDS_H
#define PELT_SERVICE_JOB_KINDS_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/scene.h"
#include "api/status.h"
#include "renderer/asset/source.h"
#include "renderer/render.h"

/* What runs, as its kind sees it. Everything belongs to the process that runs it, and outlives the
 * call. */
struct task_run {
    const struct scene *scene; /* NULL where the kind reads its own text */
    const char *text;
    size_t text_bytes;
    const struct asset_source *assets;
    const char *options;          /* NAME=VALUE lines, as `check` took them; "": none */
    struct renderer *renderer;    /* NULL unless the kind `draws` */
    const atomic_bool *cancelled; /* set once nobody wants the result: return soon */

    /* Tells how far it is; `what`: a few words shorter than TASK_NAME_MAX (letters, digits, "
     * ,.:;()-"). May be called as often as one likes, from the thread that runs. */
    void (*progress)(void *user, const char *what, uint64_t done, uint64_t total);
    /* Adds an output: `name` of [a-z0-9._-], each once, TASK_OUTPUTS_MAX at most. The bytes are
     * copied. STATUS_OUT_OF_MEMORY, STATUS_IO_ERROR; STATUS_CANCELLED where nobody wants it. */
    enum status (*output)(void *user, const char *name, const char *media_type, const void *data,
                          size_t bytes, struct error *err);
    /* One output may grow while the task runs, and be read meanwhile: begun once; then bytes are
     * added to it, `head` and then `data`; where `part` is not NULL, `data` is fetched by that name
     * too. What was added for good is ended with a last call without a part. Statuses as output().
     */
    enum status (*begin)(void *user, const char *name, const char *media_type, struct error *err);
    enum status (*grow)(void *user, const char *part, const char *head, const void *data,
                        size_t bytes, struct error *err);
    void *user;
};

struct task_kind {
    const char *name;  /* as ?kind= and the job's JSON say it */
    const char *route; /* posting there means this kind, unless ?kind= says another */
    bool draws;        /* needs a GL */
    /* The outputs that GET /v1/jobs/ID/result chooses from by Accept; the most wanted first, NULL
     * at the end. */
    const char *const *main_outputs;
    /* In the front, when the job is posted: refuses what it cannot do with this scene
     * (STATUS_NOT_IMPLEMENTED with pointers) or with these options (STATUS_BAD_REQUEST). Must be
     * quick, and open nothing. */
    enum status (*check)(const struct scene *scene, const char *options, struct error *err);
    /* In a process of its own, which ends with it. Blocks as long as it takes. */
    enum status (*run)(const struct task_run *run, struct error *err);
    /* NULL: the text is a scene. Else: reads it as what it is, in place of scene_read(), of
     * scene_check_implemented() and of `check`, and visits the assets that it names (`visit` may be
     * NULL). */
    enum status (*read)(const char *text, size_t bytes, const char *options,
                        scene_asset_visit *visit, void *user, struct error *err);
};

extern const struct task_kind task_kinds[];
extern const int task_kind_count;

int task_kind_find(const char *name);           /* its index; -1: no such kind */
int task_kind_of_route(const char *route_path); /* the one that is meant without ?kind= */

/* The reference picture, the scene's own beside it, maps and figures of the errors;
 * job_reference.c.
 */
enum status task_reference_check(const struct scene *scene, const char *options, struct error *err);
enum status task_reference_run(const struct task_run *run, struct error *err);

/* Error against run time: paths at a ladder of qualities; job_sweep.c. */
enum status task_sweep_check(const struct scene *scene, const char *options, struct error *err);
enum status task_sweep_run(const struct task_run *run, struct error *err);

/* The frames of a sequence: pictures one by one, GIF, index; job_sequence.c. */
enum status task_sequence_read(const char *text, size_t bytes, const char *options,
                               scene_asset_visit *visit, void *user, struct error *err);
enum status task_sequence_run(const struct task_run *run, struct error *err);

#endif
