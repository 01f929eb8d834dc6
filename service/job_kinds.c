/* The table of kinds. */
#include "service/job_kinds.h"

#include <string.h>

static const char *const reference_outputs[] = {"reference.png", "reference.exr", "report.json",
                                                NULL};
static const char *const sequence_outputs[] = {"frames.multipart", "sequence.gif", "frames.json",
                                               NULL};
static const char *const sweep_outputs[] = {"sweep.json", "sweep.html", "sweep.csv", NULL};

const struct task_kind task_kinds[] = {
    {"reference", "/v1/jobs", true, reference_outputs, task_reference_check, task_reference_run,
     NULL},
    {"sweep", "/v1/sweep", true, sweep_outputs, task_sweep_check, task_sweep_run, NULL},
    {"sequence", "/v1/sequences", true, sequence_outputs, NULL, task_sequence_run,
     task_sequence_read},
};
const int task_kind_count = sizeof task_kinds / sizeof *task_kinds;

int task_kind_find(const char *name) {
    for (int i = 0; i < task_kind_count; i++)
        if (strcmp(task_kinds[i].name, name) == 0)
            return i;
    return -1;
}

int task_kind_of_route(const char *route_path) {
    for (int i = 0; i < task_kind_count; i++)
        if (strcmp(task_kinds[i].route, route_path) == 0)
            return i;
    return -1;
}
