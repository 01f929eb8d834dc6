/* One frame of a sequence: every track's value put into the tree of the scene, which is then read
 * as any scene is. Interpolation is defined in sequence.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/scene_reader.h"

/* ---- values ---- */

/* The last key that is not after `frame`; SIZE_MAX where all are. */
static size_t key_before(const struct sequence_track *track, double frame) {
    size_t low = 0, high = track->key_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (track->keys[middle].frame <= frame)
            low = middle + 1;
        else
            high = middle;
    }
    return low - 1;
}

/* Fritsch and Butland's slope at key k: a weighted harmonic mean of those on both sides, or 0 where
 * they differ in sign, and at the ends. */
static double slope(const struct sequence_track *track, const double *values, size_t k) {
    if (k == 0 || k + 1 == track->key_count)
        return 0;
    double h0 = track->keys[k].frame - track->keys[k - 1].frame;
    double h1 = track->keys[k + 1].frame - track->keys[k].frame;
    double d0 = (values[k] - values[k - 1]) / h0, d1 = (values[k + 1] - values[k]) / h1;
    if (!(d0 > 0 && d1 > 0) && !(d0 < 0 && d1 < 0))
        return 0;
    double w0 = h0 + 2 * h1, w1 = 2 * h0 + h1;
    return (w0 + w1) / (w0 / d0 + w1 / d1);
}

double sequence_value(const struct sequence_track *track, const double *values, double frame) {
    size_t k = key_before(track, frame);
    if (k == SIZE_MAX)
        return values[0];
    double begin = track->keys[k].frame;
    if (k + 1 == track->key_count || track->interpolation == SEQUENCE_STEP || frame == begin)
        return values[k];
    double a = values[k], b = values[k + 1];
    double h = track->keys[k + 1].frame - begin, s = (frame - begin) / h;
    double value;
    if (track->interpolation == SEQUENCE_LINEAR) {
        value = (1 - s) * a + s * b;
    } else {
        double s2 = s * s, s3 = s2 * s;
        value = a + (3 * s2 - 2 * s3) * (b - a) +
                h * ((s - 2 * s2 + s3) * slope(track, values, k) +
                     (s3 - s2) * slope(track, values, k + 1));
    }
    /* Exact arithmetic would not leave [a, b]. */
    return fmin(fmax(value, fmin(a, b)), fmax(a, b));
}

static json_t *number_at(const struct sequence_track *track, long element, double frame,
                         double *values) {
    for (size_t k = 0; k < track->key_count; k++) {
        const json_t *value = track->keys[k].value;
        values[k] = json_number_value(element < 0 ? value : json_array_get(value, (size_t)element));
    }
    double value = sequence_value(track, values, frame);
    return json_real(track->whole ? floor(value + 0.5) : value);
}

/* The track's value at a frame, a new reference; NULL where memory ran out. */
static json_t *value_at(const struct sequence_track *track, double frame) {
    if (track->interpolation == SEQUENCE_STEP) {
        size_t k = key_before(track, frame);
        return json_incref(track->keys[k == SIZE_MAX ? 0 : k].value);
    }
    double *values = malloc(track->key_count * sizeof *values);
    if (!values)
        return NULL;
    json_t *first = track->keys[0].value, *made = NULL;
    if (!json_is_array(first)) {
        made = number_at(track, -1, frame, values);
    } else {
        made = json_array();
        for (size_t i = 0; made && i < json_array_size(first); i++)
            if (json_array_append_new(made, number_at(track, (long)i, frame, values)) != 0) {
                json_decref(made);
                made = NULL;
            }
    }
    free(values);
    return made;
}

/* ---- into the tree ---- */

static enum status nowhere(size_t number, size_t step, const struct sequence_track *track,
                           struct error *err) {
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/tracks/%zu/pointer", number);
    return error_fault(err, STATUS_INVALID_SCENE, pointer,
                       "leads nowhere: the scene has no `%.200s` there", track->steps[step]);
}

static enum status put(const struct sequence *sequence, size_t number, double frame,
                       struct error *err) {
    const struct sequence_track *track = &sequence->tracks[number];
    json_t *at = sequence->scene, *value = value_at(track, frame);
    if (!value)
        return error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out");
    for (size_t i = 0; i < track->step_count; i++) {
        bool last = i + 1 == track->step_count;
        const char *step = track->steps[i];
        if (json_is_object(at)) {
            json_t *next = last ? NULL : json_object_get(at, step);
            if (!next && !last && track->indices & UINT32_C(1) << (i + 1)) {
                json_decref(value); /* objects are made, arrays are not */
                return nowhere(number, i, track, err);
            }
            if (!next && json_object_set_new(at, step, last ? value : json_object()) != 0) {
                if (!last)
                    json_decref(value);
                return error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out");
            }
            at = next ? next : json_object_get(at, step);
            continue;
        }
        size_t index = (size_t)strtoul(step, NULL, 10);
        if (!json_is_array(at) || strspn(step, "0123456789") != strlen(step) ||
            index >= json_array_size(at)) {
            json_decref(value);
            return nowhere(number, i, track, err);
        }
        if (last)
            json_array_set_new(at, index, value);
        at = json_array_get(at, index);
    }
    return STATUS_OK;
}

/* ---- blame ---- */

static bool is_below(const char *pointer, const char *prefix) {
    size_t length = strlen(prefix);
    return strncmp(pointer, prefix, length) == 0 && (pointer[length] == '/' || !pointer[length]);
}

/* The track that drives what a pointer into the scene names; SIZE_MAX: none. */
static size_t find_track(const struct sequence *sequence, const char *pointer) {
    for (size_t i = 0; i < sequence->track_count; i++)
        if (is_below(pointer, sequence->tracks[i].pointer))
            return i;
    return SIZE_MAX;
}

static void place(const struct sequence *sequence, const char *pointer, char *text, size_t bytes) {
    size_t track = find_track(sequence, pointer);
    if (track == SIZE_MAX)
        snprintf(text, bytes, "/scene%s", pointer);
    else
        snprintf(text, bytes, "/tracks/%zu", track);
}

enum status sequence_blame(const struct sequence *sequence, int frame, struct error *from,
                           struct error *to) {
    enum status status = from->status;
    struct error told = {0};
    for (size_t i = 0; i < from->fault_count; i++) {
        const char *pointer = from->faults[i].pointer, *message = from->faults[i].message;
        char text[JSON_PATH_BYTES + 16] = "";
        if (pointer)
            place(sequence, pointer, text, sizeof text);
        bool driven = pointer && strncmp(text, "/tracks/", 8) == 0;
        error_fault(&told, status, pointer ? text : NULL, "frame %d: %s%s%s", frame,
                    message ? message : "", driven ? ", in " : "", driven ? pointer : "");
    }
    if (!from->fault_count)
        error_fault(&told, status, NULL, "frame %d", frame);
    told.status = status;
    told.faults_left_out += from->faults_left_out;
    error_clear(from);
    error_move(to, &told);
    return status;
}

/* ---- frames ---- */

enum status sequence_frame(struct sequence *sequence, int frame, struct arena *arena,
                           struct scene *scene, struct error *err) {
    *scene = (struct scene){0};
    for (size_t i = 0; i < sequence->track_count; i++) {
        enum status status = put(sequence, i, frame, err);
        if (status != STATUS_OK)
            return status;
    }
    struct error found = {0};
    struct reader reader = {.arena = arena, .err = &found};
    reader_node(&reader, SCENE_NODE_scene, sequence->scene, scene);
    if (reader.out_of_memory) {
        error_clear(&found);
        return error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out");
    }
    if (found.status == STATUS_OK)
        scene_check_implemented(scene, &found);
    return found.status == STATUS_OK ? STATUS_OK : sequence_blame(sequence, frame, &found, err);
}

/* Every asset is told once, however many frames name it. */
struct seen {
    struct seen *next;
    const char *name;
};

struct visiting {
    const struct sequence *sequence;
    scene_asset_visit *visit;
    void *user;
    struct arena arena;
    struct seen *seen;
    bool out_of_memory;
};

static void visit_placed(void *user, const char *name, const char *pointer) {
    struct visiting *visiting = user;
    char text[JSON_PATH_BYTES + 16] = "";
    for (const struct seen *at = visiting->seen; at; at = at->next)
        if (strcmp(at->name, name) == 0)
            return;
    struct seen *fresh = arena_alloc(&visiting->arena, 1, sizeof *fresh);
    const char *copy = arena_strdup(&visiting->arena, name);
    if (!fresh || !copy) {
        visiting->out_of_memory = true;
        return;
    }
    *fresh = (struct seen){visiting->seen, copy};
    visiting->seen = fresh;
    place(visiting->sequence, pointer, text, sizeof text);
    visiting->visit(visiting->user, name, text);
}

enum status sequence_check(struct sequence *sequence, int first, int last, scene_asset_visit *visit,
                           void *user, struct error *err) {
    struct visiting visiting = {.sequence = sequence, .visit = visit, .user = user};
    uint64_t samples = 0;
    enum status status = STATUS_OK;
    for (int frame = first; frame <= last && status == STATUS_OK; frame++) {
        struct arena arena = {0};
        struct scene scene;
        status = sequence_frame(sequence, frame, &arena, &scene, err);
        if (status == STATUS_OK) {
            samples += (uint64_t)scene.image.width * (uint64_t)scene.image.height *
                       (uint64_t)scene.image.samples;
            if (visit)
                scene_visit_assets(&scene, visit_placed, &visiting);
        }
        arena_free(&arena);
        if (visiting.out_of_memory)
            status = error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out");
        else if (status == STATUS_OK && samples > SEQUENCE_SAMPLES_MAX)
            status = error_fault(err, STATUS_TOO_COMPLEX, "/frames",
                                 "up to frame %d there are more than %llu pixels times samples",
                                 frame, (unsigned long long)SEQUENCE_SAMPLES_MAX);
    }
    arena_free(&visiting.arena);
    return status;
}
