/* The life of a job; job.h says who owns it when. */
#include "service/job.h"

#include <stdlib.h>
#include <unistd.h>

void job_init(struct job *job) {
    *job = (struct job){.scene_fd = -1, .client_fd = -1, .body_fd = -1};
}

void job_finish(struct job *job) {
    for (size_t i = 0; i < job->asset_count; i++)
        if (job->assets[i].fd >= 0)
            close(job->assets[i].fd);
    free(job->assets);
    if (job->scene_fd >= 0)
        close(job->scene_fd);
    if (job->body_fd >= 0)
        close(job->body_fd);
    error_clear(&job->error);
    job_init(job);
}
