/* The threads: pixels are handed out in blocks by a counter, each is computed by one thread from
 * the scene alone, so the picture does not depend on who computed what. */
#include "renderer/reference/reference.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "renderer/reference/trace.h"

enum { BLOCK = 32, THREADS_MAX = 256 };

struct reference {
    struct world world;
};

enum status reference_create(const struct scene *scene, const struct reference_sources *sources,
                             struct reference **out, struct error *err) {
    *out = NULL;
    struct reference *reference = calloc(1, sizeof *reference);
    if (!reference)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the reference");
    enum status status = world_init(scene, sources, &reference->world, err);
    if (status != STATUS_OK) {
        free(reference);
        return status;
    }
    *out = reference;
    return STATUS_OK;
}

void reference_destroy(struct reference *reference) {
    if (!reference)
        return;
    world_finish(&reference->world);
    free(reference);
}

void reference_bounds(const struct reference *reference, double low[3], double high[3]) {
    memcpy(low, reference->world.bounds_min, 3 * sizeof *low);
    memcpy(high, reference->world.bounds_max, 3 * sizeof *high);
}

bool reference_point(const struct reference *reference, uint64_t index, double point[3]) {
    const struct world *world = &reference->world;
    for (size_t i = 0; i < world->object_count; i++) {
        const struct world_object *object = &world->objects[i];
        uint64_t count = object->mesh->vertex_count, all = object->offset ? 2 * count : count;
        if (index >= all) {
            index -= all;
            continue;
        }
        const double *m = object->spec->transform;
        uint64_t vertex = index < count ? index : index - count;
        for (int r = 0; r < 3; r++) {
            point[r] = m[12 + r];
            for (int c = 0; c < 3; c++)
                point[r] += m[4 * c + r] * (object->center[c] + object->bottom[vertex][c] +
                                            (index < count ? 0 : object->offset[vertex][c]));
        }
        return true;
    }
    return false;
}

void reference_set_camera(struct reference *reference, const struct scene_camera *camera) {
    world_set_camera(&reference->world, camera);
}

uint64_t reference_folded(const struct reference *reference) {
    uint64_t folded = 0;
    for (size_t i = 0; i < reference->world.object_count; i++)
        folded += reference->world.objects[i].folded;
    return folded;
}

/* ---- drawing ---- */

/* What the threads share. */
struct work {
    const struct world *world;
    const struct reference_request *request;
    struct reference_result *result;
    size_t count;
    double tolerance;
    atomic_size_t next, done;
    atomic_int failed; /* an enum status */
};

struct worker {
    struct work *work;
    bool leads; /* tells the progress */
    struct tracer tracer;
    uint64_t rays;
    pthread_t thread;
    bool started;
};

static bool draw_pixel(struct worker *worker, size_t index) {
    struct work *work = worker->work;
    const struct world_camera *camera = &work->world->camera;
    size_t pixel = work->request->pixels ? work->request->pixels[index] : index;
    double x = (double)(pixel % (size_t)camera->width);
    double y = (double)(pixel / (size_t)camera->width);
    double sum[4] = {0, 0, 0, 0};
    int k = camera->k;
    bool touched = false;
    for (int sample = 0; sample < k * k; sample++) {
        double rgba[4];
        if (work->request->cancel && atomic_load(work->request->cancel)) {
            worker->tracer.status = STATUS_CANCELLED;
            return false;
        }
        touched |= tracer_trace(&worker->tracer, x + (sample % k + 0.5) / k,
                                y + (sample / k + 0.5) / k, rgba);
        if (worker->tracer.status != STATUS_OK)
            return false;
        for (int i = 0; i < 4; i++)
            sum[i] += rgba[i];
    }
    for (int i = 0; i < 4; i++)
        work->result->pixels[index][i] = sum[i] / (k * k);
    work->result->touched[index] = touched;
    worker->rays += (uint64_t)k * (uint64_t)k;
    return true;
}

static void *run(void *argument) {
    struct worker *worker = argument;
    struct work *work = worker->work;
    const struct reference_request *request = work->request;
    for (;;) {
        size_t first = atomic_fetch_add(&work->next, BLOCK);
        if (first >= work->count || atomic_load(&work->failed) != STATUS_OK)
            break;
        if (request->cancel && atomic_load(request->cancel)) {
            atomic_store(&work->failed, STATUS_CANCELLED);
            break;
        }
        size_t end = first + BLOCK < work->count ? first + BLOCK : work->count;
        for (size_t i = first; i < end; i++)
            if (!draw_pixel(worker, i)) {
                atomic_store(&work->failed, (int)worker->tracer.status);
                return NULL;
            }
        size_t done = atomic_fetch_add(&work->done, end - first) + end - first;
        if (worker->leads && request->progress)
            request->progress(request->user, done, work->count);
    }
    return NULL;
}

static int thread_count(const struct reference_request *request, size_t pixels) {
    long count = request->threads > 0 ? request->threads : sysconf(_SC_NPROCESSORS_ONLN);
    long blocks = (long)(pixels / BLOCK) + 1;
    count = count < 1 ? 1 : count > THREADS_MAX ? THREADS_MAX : count;
    return (int)(count > blocks ? blocks : count);
}

static enum status tell_failure(enum status status, struct error *err) {
    if (status == STATUS_OUT_OF_MEMORY)
        return error_fault(err, status, NULL, "no memory for one ray's cells");
    if (status == STATUS_TOO_COMPLEX)
        return error_fault(err, status, "/objects",
                           "a ray crosses more than a million voxels of one prism");
    return error_fault(err, status, NULL, "the reference was cancelled");
}

enum status reference_render(const struct reference *reference,
                             const struct reference_request *request,
                             struct reference_result *result, struct error *err) {
    const struct world_camera *camera = &reference->world.camera;
    size_t all = (size_t)camera->width * (size_t)camera->height;
    memset(result, 0, sizeof *result);
    struct work work = {.world = &reference->world,
                        .request = request,
                        .result = result,
                        .count = request->pixels ? request->pixel_count : all,
                        .tolerance = request->tolerance > 0 ? request->tolerance : 1e-8};
    for (size_t i = 0; request->pixels && i < work.count; i++)
        if (request->pixels[i] >= all)
            return error_fault(err, STATUS_INTERNAL, NULL, "pixel %u of %zu",
                               (unsigned)request->pixels[i], all);
    int threads = thread_count(request, work.count);
    struct worker *workers = calloc((size_t)threads, sizeof *workers);
    result->count = work.count;
    result->pixels = calloc(work.count + 1, sizeof *result->pixels);
    result->touched = calloc(work.count + 1, 1);
    bool ready = workers && result->pixels && result->touched;
    for (int i = 0; ready && i < threads; i++) {
        workers[i].work = &work;
        workers[i].leads = i == 0;
        ready = tracer_init(&workers[i].tracer, &reference->world, work.tolerance);
    }
    if (ready) {
        for (int i = 1; i < threads; i++) /* one that cannot be had leaves its work to the others */
            workers[i].started = pthread_create(&workers[i].thread, NULL, run, &workers[i]) == 0;
        run(&workers[0]);
        for (int i = 1; i < threads; i++)
            if (workers[i].started)
                pthread_join(workers[i].thread, NULL);
        if (request->progress && atomic_load(&work.failed) == STATUS_OK)
            request->progress(request->user, work.count, work.count);
    }
    for (int i = 0; workers && i < threads; i++) {
        result->rays += workers[i].rays;
        result->segments += workers[i].tracer.segments_met;
        result->cells += workers[i].tracer.cells_met;
        result->evaluations += workers[i].tracer.evaluations;
        result->unresolved += workers[i].tracer.unresolved;
        tracer_finish(&workers[i].tracer);
    }
    free(workers);
    enum status status = ready ? (enum status)atomic_load(&work.failed) : STATUS_OUT_OF_MEMORY;
    if (status != STATUS_OK) {
        reference_result_finish(result);
        return tell_failure(status, err);
    }
    return STATUS_OK;
}

void reference_result_finish(struct reference_result *result) {
    free(result->pixels);
    free(result->touched);
    memset(result, 0, sizeof *result);
}
