/* See jobs_stream.h. libmicrohttpd asks for more bytes; where there are none yet the connection is
 * suspended, under the store's lock, so that whoever adds bytes finds it suspended and resumes it:
 * the store's lock is always taken before libmicrohttpd's own.
 *
 * Time limits: none while the task runs (it has its own; libmicrohttpd ends a connection to a
 * client that takes nothing); the usual ones for what is left once it is done. */
#include "service/jobs_stream.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "service/reply.h"

enum { BLOCK_BYTES = 64 * 1024 };

struct stream {
    struct request *request; /* until the reply has been sent */
    struct MHD_Connection *mhd;
    struct jobs *jobs;
    char id[JOBS_ID_BYTES];
    int fd;
    struct jobs_follower follower;
    uint64_t at, available;
    enum { STREAM_GROWS, STREAM_WHOLE, STREAM_BROKEN } state;
    bool hurried; /* has the time limits of what is whole */
};

static void wake(void *user) {
    struct stream *stream = user;
    MHD_resume_connection(stream->mhd);
}

/* How far it has come; true, with the connection suspended, where that is no further. */
static bool look(void *user, const struct task *task) {
    struct stream *stream = user;
    const struct task_output *output = NULL;
    for (size_t i = 0; i < task->output_count; i++)
        if (task->outputs[i].grows)
            output = &task->outputs[i];
    bool lives = task->state == TASK_RUNNING || task->state == TASK_DONE;
    stream->state = !output || !lives             ? STREAM_BROKEN
                    : task->state == TASK_RUNNING ? STREAM_GROWS
                                                  : STREAM_WHOLE;
    if (stream->state != STREAM_BROKEN)
        stream->available = output->bytes;
    if (stream->state != STREAM_GROWS || stream->available > stream->at)
        return false;
    MHD_suspend_connection(stream->mhd);
    return true;
}

static ssize_t read_more(void *user, uint64_t at, char *to, size_t room) {
    struct stream *stream = user;
    struct error err = {0};
    if (at >= stream->available && stream->state == STREAM_GROWS) {
        stream->at = at;
        if (jobs_follow(stream->jobs, stream->id, jobs_time_now(), look, stream, &stream->follower,
                        &err) != STATUS_OK)
            stream->state = STREAM_BROKEN;
        error_clear(&err);
    }
    if (stream->state == STREAM_WHOLE && !stream->hurried) {
        stream->hurried = true;
        connections_enter(&stream->request->http->connections, stream->request->connection,
                          CONNECTION_SENDING, (double)(stream->available - at));
    }
    if (stream->state == STREAM_BROKEN)
        return MHD_CONTENT_READER_END_WITH_ERROR;
    if (at >= stream->available)
        return stream->state == STREAM_WHOLE ? MHD_CONTENT_READER_END_OF_STREAM : 0;
    uint64_t left = stream->available - at;
    ssize_t n = pread(stream->fd, to, left < room ? (size_t)left : room, (off_t)at);
    if (n <= 0)
        return MHD_CONTENT_READER_END_WITH_ERROR;
    stream->request->reply_bytes += (uint64_t)n;
    return n;
}

static void destroy(void *user) {
    struct stream *stream = user;
    jobs_unfollow(stream->jobs, &stream->follower);
    close(stream->fd);
    free(stream);
}

enum MHD_Result jobs_stream_reply(struct request *request, const char *id, const char *media_type,
                                  int fd) {
    struct stream *stream = calloc(1, sizeof *stream);
    struct MHD_Response *response =
        stream ? MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, BLOCK_BYTES, read_more, stream,
                                                   destroy)
               : NULL;
    if (!response) {
        struct error err = {.status = STATUS_OUT_OF_MEMORY};
        free(stream);
        close(fd);
        return reply_error(request, &err, 1, false);
    }
    *stream = (struct stream){.request = request,
                              .mhd = request->mhd,
                              .jobs = request->http->parts.jobs,
                              .fd = fd,
                              .follower = {.wake = wake, .user = stream}};
    snprintf(stream->id, sizeof stream->id, "%s", id);
    return reply_growing(request, media_type, response);
}
