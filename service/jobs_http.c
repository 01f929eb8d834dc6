/* The resources of long work. A job outlives the request that posts it: nothing here suspends a
 * connection, and a client that hangs up after its 202 changes nothing.
 *
 * Failures that are the job's own are told in its JSON, not by the status of the GET. A result that
 * is asked for too early is 409 and may be asked for again; one that will never be is 404. */
#include "service/jobs_http.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "api/json_out.h"
#include "api/problem_write.h"
#include "service/accept.h"
#include "service/job_kinds.h"
#include "service/jobs.h"
#include "service/jobs_stream.h"
#include "service/render_request.h"
#include "service/reply.h"
#include "service/routes.h"

/* ---- a job as JSON ---- */

struct writing {
    struct json_out out;
    struct jobs_time now;
};

/* RFC 3339, in UTC, to the millisecond; null where it has not come to that. */
static void write_time(struct json_out *out, const char *name, const struct jobs_time *at) {
    char day[32], text[48];
    struct tm broken;
    double whole = floor(at->unix_s);
    time_t seconds = (time_t)whole;
    json_out_key(out, name);
    if (at->ms <= 0 || !gmtime_r(&seconds, &broken)) {
        json_out_string(out, NULL);
        return;
    }
    strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &broken);
    snprintf(text, sizeof text, "%s.%03dZ", day, (int)((at->unix_s - whole) * 1e3));
    json_out_string(out, text);
}

static const char *what_of(const struct task *task) {
    if (task->state == TASK_QUEUED)
        return "waiting";
    return *task->what ? task->what : "starting";
}

static void write_progress(struct json_out *out, const struct task *task, struct jobs_time now) {
    double until_ms = task->finished.ms > 0 ? task->finished.ms : now.ms;
    double elapsed_s = task->started.ms > 0 ? (until_ms - task->started.ms) * 1e-3 : 0;
    double share = task->total > 0 ? (double)task->done / (double)task->total : 0;
    if (task->state == TASK_DONE)
        share = 1;
    bool guess = task->state == TASK_RUNNING && share > 0;
    json_out_key(out, "progress");
    json_out_open(out, '{');
    json_out_key(out, "done");
    json_out_unsigned(out, task->done);
    json_out_key(out, "total");
    json_out_unsigned(out, task->total);
    json_out_key(out, "share");
    json_out_number(out, share);
    json_out_key(out, "what");
    json_out_string(out, what_of(task));
    json_out_key(out, "elapsed_s");
    json_out_number(out, task->state == TASK_QUEUED ? 0 : elapsed_s);
    json_out_key(out, "left_s");
    json_out_number(out, guess ? elapsed_s * (1 - share) / share : NAN); /* null: not known */
    json_out_close(out, '}');
}

static void write_outputs(struct json_out *out, const struct task *task) {
    json_out_key(out, "results");
    json_out_open(out, '[');
    for (size_t i = 0; i < task->output_count && task->state == TASK_DONE; i++) {
        const struct task_output *output = &task->outputs[i];
        char href[48 + JOBS_ID_BYTES + TASK_NAME_MAX];
        snprintf(href, sizeof href, "/v1/jobs/%s/result/%s", task->id, output->name);
        json_out_open(out, '{');
        json_out_key(out, "name");
        json_out_string(out, output->name);
        json_out_key(out, "media_type");
        json_out_string(out, output->media_type);
        json_out_key(out, "bytes");
        json_out_unsigned(out, output->bytes);
        json_out_key(out, "href");
        json_out_string(out, href);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
}

static void write_task(void *user, const struct task *task) {
    struct writing *writing = user;
    struct json_out *out = &writing->out;
    json_out_open(out, '{');
    json_out_key(out, "id");
    json_out_string(out, task->id);
    json_out_key(out, "kind");
    json_out_string(out, task_kinds[task->kind].name);
    json_out_key(out, "state");
    json_out_string(out, task_state_name(task->state));
    write_progress(out, task, writing->now);
    write_time(out, "created", &task->created);
    write_time(out, "started", &task->started);
    write_time(out, "finished", &task->finished);
    if (task->state == TASK_FAILED) {
        char *problem = problem_write(&task->error, task->request_id);
        json_out_key(out, "error");
        json_out_raw(out, problem ? problem : "null");
        out->failed |= !problem;
        free(problem);
    }
    write_outputs(out, task);
    json_out_close(out, '}');
}

static enum MHD_Result reply_json(struct request *request, unsigned http_status,
                                  struct json_out *out) {
    char *text = json_out_finish(out);
    return reply_text(request, http_status, "application/json", text, text ? strlen(text) : 0);
}

static enum MHD_Result reply_one(struct request *request, unsigned http_status, const char *id) {
    struct writing writing = {.now = jobs_time_now()};
    if (jobs_look(request->http->parts.jobs, id, writing.now, write_task, &writing,
                  &request->error) != STATUS_OK)
        return reply_error(request, &request->error, 0, false);
    return reply_json(request, http_status, &writing.out);
}

/* ---- POST ---- */

/* What the query says. */
struct asked {
    struct task_input *input;
    const char *kind;
    int kinds;
    bool unreadable;
};

static enum MHD_Result read_argument(void *user, enum MHD_ValueKind where, const char *name,
                                     const char *value) {
    struct asked *asked = user;
    char *options = asked->input->options;
    size_t at = strlen(options), room = sizeof asked->input->options - at;
    (void)where;
    if (strcmp(name, "kind") == 0) {
        asked->kind = value ? value : "";
        asked->kinds++;
        return MHD_YES;
    }
    /* One line for each, so a name or value with a line break cannot pass for two. */
    int n = snprintf(options + at, room, "%s=%s\n", name, value ? value : "");
    asked->unreadable |=
        n < 0 || (size_t)n >= room || strpbrk(name, "=\n") || (value && strchr(value, '\n'));
    return MHD_YES;
}

static enum status read_query(struct request *request, struct task_input *input,
                              struct error *err) {
    struct asked asked = {.input = input};
    MHD_get_connection_values(request->mhd, MHD_GET_ARGUMENT_KIND, read_argument, &asked);
    if (asked.kinds > 1 || asked.unreadable)
        return error_fault(err, STATUS_BAD_REQUEST, NULL,
                           asked.kinds > 1 ? "kind is given twice"
                                           : "the query is too long, or holds a line break");
    input->kind =
        asked.kinds ? task_kind_find(asked.kind) : task_kind_of_route(request->route->path);
    if (input->kind >= 0)
        return STATUS_OK;
    char names[128] = "";
    for (int i = 0; i < task_kind_count; i++) {
        size_t at = strlen(names);
        snprintf(names + at, sizeof names - at, "%s%s", i ? ", " : "", task_kinds[i].name);
    }
    return error_fault(err, STATUS_BAD_REQUEST, NULL, "there is no kind \"%s\" of job, but %s",
                       asked.kind ? asked.kind : "", names);
}

static enum status check_kind(void *user, const struct scene *scene, struct error *err) {
    const struct task_input *input = user;
    return task_kinds[input->kind].check(scene, input->options, err);
}

static enum status read_kind(void *user, const char *text, size_t bytes, scene_asset_visit *visit,
                             void *visit_user, struct error *err) {
    const struct task_input *input = user;
    return task_kinds[input->kind].read(text, bytes, input->options, visit, visit_user, err);
}

/* What render_request_prepare() has put into the request's job becomes the task's. */
static void take_input(struct request *request, struct task_input *input) {
    struct job *job = &request->job;
    memcpy(input->request_id, request->id, sizeof input->request_id);
    memcpy(input->key, job->key, sizeof input->key);
    input->scene_fd = job->scene_fd;
    input->scene_bytes = job->scene_bytes;
    input->asset_count = job->asset_count;
    input->assets = job->assets;
    input->held_bytes = request->body_bytes;
    job->scene_fd = -1;
    job->asset_count = 0;
    job->assets = NULL;
}

static enum MHD_Result answer_post(struct request *request) {
    struct jobs *jobs = request->http->parts.jobs;
    struct error *err = &request->error;
    struct task_input input;
    char id[JOBS_ID_BYTES];
    double retry_after_s = 0;
    task_input_init(&input);
    enum status status = read_query(request, &input, err);
    if (status == STATUS_OK)
        status = render_request_prepare(request, check_kind,
                                        task_kinds[input.kind].read ? read_kind : NULL, &input,
                                        &retry_after_s, err);
    if (status == STATUS_OK) {
        take_input(request, &input);
        status = jobs_submit(jobs, &input, jobs_time_now(), id, &retry_after_s, err);
    }
    if (status != STATUS_OK) {
        task_input_finish(&input);
        return reply_error(request, err, retry_after_s, false);
    }
    log_event(request->http->parts.log, LOG_INFO, "job queued", LOG_TEXT("id", request->id),
              LOG_TEXT("job", id));
    snprintf(request->location, sizeof request->location, "/v1/jobs/%s", id);
    return reply_one(request, MHD_HTTP_ACCEPTED, id);
}

static enum MHD_Result answer_list(struct request *request) {
    struct writing writing = {.now = jobs_time_now()};
    json_out_open(&writing.out, '{');
    json_out_key(&writing.out, "jobs");
    json_out_open(&writing.out, '[');
    jobs_look_at_all(request->http->parts.jobs, writing.now, write_task, &writing);
    json_out_close(&writing.out, ']');
    json_out_close(&writing.out, '}');
    return reply_json(request, MHD_HTTP_OK, &writing.out);
}

enum MHD_Result jobs_http_answer(struct request *request) {
    return request->takes_scene ? answer_post(request) : answer_list(request);
}

/* ---- one ---- */

enum MHD_Result jobs_http_answer_one(struct request *request) {
    const char *id = request->captured[0];
    if (strcmp(request->method, MHD_HTTP_METHOD_DELETE) != 0)
        return reply_one(request, MHD_HTTP_OK, id);
    enum task_state was;
    if (jobs_delete(request->http->parts.jobs, id, jobs_time_now(), &was, &request->error) !=
        STATUS_OK)
        return reply_error(request, &request->error, 0, false);
    log_event(request->http->parts.log, LOG_INFO, "job deleted", LOG_TEXT("id", request->id),
              LOG_TEXT("job", id), LOG_TEXT("was", task_state_name(was)));
    return reply_nothing(request);
}

/* ---- results ---- */

struct picking {
    struct request *request;
    const char *name;          /* NULL: the main one, by Accept */
    struct task_output output; /* its parts are the store's and are not looked at */
    bool grows;                /* it is still being made */
    struct task_part part;     /* what is wanted of it; no name: all */
    double retry_after_s;
    struct error *err;
};

static const struct task_output *find_output(const struct task *task, const char *name) {
    for (size_t i = 0; i < task->output_count; i++)
        if (strcmp(task->outputs[i].name, name) == 0)
            return &task->outputs[i];
    return NULL;
}

static const struct task_output *choose_output(const struct task *task, struct request *request,
                                               struct error *err) {
    const struct task_output *outputs[TASK_OUTPUTS_MAX];
    const char *types[TASK_OUTPUTS_MAX];
    char names[256] = "";
    size_t count = 0;
    for (const char *const *name = task_kinds[task->kind].main_outputs; *name; name++) {
        const struct task_output *output = find_output(task, *name);
        if (!output || count == TASK_OUTPUTS_MAX)
            continue;
        size_t at = strlen(names);
        snprintf(names + at, sizeof names - at, "%s%s", count ? ", " : "", output->media_type);
        types[count] = output->media_type;
        outputs[count++] = output;
    }
    int chosen = count ? request_choose_type(request, types, count) : -1;
    if (chosen >= 0)
        return outputs[chosen];
    error_fault(err, STATUS_NOT_ACCEPTABLE, NULL, "the job's result is there as %s", names);
    return NULL;
}

static const struct task_output *growing_output(const struct task *task) {
    for (size_t i = 0; i < task->output_count; i++)
        if (task->outputs[i].grows)
            return &task->outputs[i];
    return NULL;
}

/* The output that has a part of the name that is asked for, which is kept; NULL: none has. */
static const struct task_output *find_part(const struct task *task, struct picking *picking) {
    const struct task_output *output = growing_output(task);
    for (size_t i = 0; output && i < output->part_count; i++)
        if (strcmp(output->parts[i].name, picking->name) == 0) {
            picking->part = output->parts[i];
            return output;
        }
    return NULL;
}

/* Of a task that runs: what grows can be had already; NULL: what is asked for cannot. */
static const struct task_output *pick_early(const struct task *task, struct picking *picking) {
    const struct task_output *output = growing_output(task);
    if (!output)
        return NULL;
    if (picking->name && strcmp(output->name, picking->name) != 0)
        return find_part(task, picking);
    const char *type = output->media_type;
    if (!picking->name && request_choose_type(picking->request, &type, 1) < 0)
        return NULL;
    picking->grows = true;
    return output;
}

static void take(struct picking *picking, const struct task_output *output) {
    picking->output = *output;
    picking->output.fd = fcntl(output->fd, F_DUPFD_CLOEXEC, 0);
    if (picking->output.fd < 0)
        error_fault(picking->err, STATUS_IO_ERROR, NULL, "no descriptor is free for the result");
}

/* With the store's lock held: finds the output and takes a descriptor of its own. */
static void pick(void *user, const struct task *task) {
    struct picking *picking = user;
    const struct task_output *output =
        task->state == TASK_RUNNING ? pick_early(task, picking) : NULL;
    if (output) {
        take(picking, output);
        return;
    }
    if (task->state == TASK_QUEUED || task->state == TASK_RUNNING) {
        picking->retry_after_s = 1;
        error_fault(picking->err, STATUS_NOT_DONE, NULL, "the job is %s",
                    task_state_name(task->state));
        return;
    }
    if (task->state != TASK_DONE) {
        error_fault(picking->err, STATUS_NOT_FOUND, NULL, "the job was %s and has no results",
                    task->state == TASK_CANCELLED ? "cancelled" : "not completed");
        return;
    }
    if (picking->name) {
        output = find_output(task, picking->name);
        if (!output)
            output = find_part(task, picking);
        if (!output)
            error_fault(picking->err, STATUS_NOT_FOUND, NULL, "the job has no result %s",
                        picking->name);
    } else {
        output = choose_output(task, picking->request, picking->err);
    }
    if (output)
        take(picking, output);
}

enum MHD_Result jobs_http_answer_result(struct request *request) {
    const char *name = request->captured[1];
    struct picking picking = {
        .request = request, .name = *name ? name : NULL, .err = &request->error};
    if (jobs_look(request->http->parts.jobs, request->captured[0], jobs_time_now(), pick, &picking,
                  &request->error) != STATUS_OK ||
        request->error.status != STATUS_OK)
        return reply_error(request, &request->error, picking.retry_after_s, false);
    if (picking.grows)
        return jobs_stream_reply(request, request->captured[0], picking.output.media_type,
                                 picking.output.fd);
    if (picking.part.name[0]) /* of a sequence: all are pictures */
        return reply_part(request, "image/png", picking.output.fd, picking.part.offset,
                          picking.part.bytes);
    return reply_file(request, picking.output.media_type, picking.output.fd, picking.output.bytes);
}
