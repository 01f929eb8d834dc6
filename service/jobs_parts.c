/* Parts of a task that stand without the store: its input, the parts of an output, names and time.
 */
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "service/jobs.h"
#include "service/monotonic.h"

const char *task_state_name(enum task_state state) {
    static const char *const names[TASK_STATES] = {
        [TASK_QUEUED] = "queued", [TASK_RUNNING] = "running",     [TASK_DONE] = "done",
        [TASK_FAILED] = "failed", [TASK_CANCELLED] = "cancelled",
    };
    return names[state];
}

struct jobs_time jobs_time_now(void) {
    struct timespec wall;
    clock_gettime(CLOCK_REALTIME, &wall);
    return (struct jobs_time){monotonic_ms(), (double)wall.tv_sec + (double)wall.tv_nsec * 1e-9};
}

void task_input_init(struct task_input *input) {
    *input = (struct task_input){.scene_fd = -1};
}

void task_input_finish(struct task_input *input) {
    for (size_t i = 0; i < input->asset_count; i++)
        if (input->assets[i].fd >= 0)
            close(input->assets[i].fd);
    free(input->assets);
    if (input->scene_fd >= 0)
        close(input->scene_fd);
    task_input_init(input);
}

bool task_output_add_part(struct task_output *output, const struct task_part *part) {
    if (output->part_count == output->part_room) {
        size_t room = output->part_room ? 2 * output->part_room : 64;
        struct task_part *grown = realloc(output->parts, room * sizeof *grown);
        if (!grown)
            return false;
        output->parts = grown;
        output->part_room = room;
    }
    output->parts[output->part_count++] = *part;
    return true;
}
