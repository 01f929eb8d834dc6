/* JSON to a sequence: the table's reader, then what the table cannot say of tracks: that a pointer
 * leads to a member of the scene, that keys are in order, that values can be interpolated, that no
 * two tracks drive the same. What only the frames themselves can tell is sequence_frame()'s. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/scene_reader.h"

/* A fault below a track. */
__attribute__((format(printf, 4, 5))) static void
fault(struct error *err, size_t track, const char *below, const char *format, ...) {
    char pointer[128], message[768];
    snprintf(pointer, sizeof pointer, "/tracks/%zu%s", track, below);
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    error_fault(err, STATUS_INVALID_SCENE, pointer, "%s", message);
}

/* ---- pointers ---- */

/* Cuts a pointer into its steps. False where it is none (RFC 6901), or too long. */
static bool split(struct arena *arena, struct sequence_track *track, bool *out_of_memory) {
    char *text = arena_strdup(arena, track->pointer);
    track->steps = arena_alloc(arena, SEQUENCE_STEPS_MAX, sizeof *track->steps);
    if (!text || !track->steps) {
        *out_of_memory = true;
        return false;
    }
    if (*text != '/')
        return false;
    for (char *step = text + 1, *next; step; step = next) {
        if (track->step_count == SEQUENCE_STEPS_MAX)
            return false;
        next = strchr(step, '/');
        if (next)
            *next++ = 0;
        track->steps[track->step_count++] = step;
        char *to = step;
        for (const char *from = step; *from; from++) {
            if (*from == '~' && from[1] != '0' && from[1] != '1')
                return false;
            *to++ = (char)(*from != '~' ? *from : *++from == '0' ? '~' : '/');
        }
        *to = 0;
    }
    return true;
}

/* An index into a list, as RFC 6901 writes it; -1 for anything else. */
static long index_of(const char *step) {
    size_t length = strlen(step);
    if (length == 0 || length > 6 || strspn(step, "0123456789") != length ||
        (length > 1 && step[0] == '0'))
        return -1;
    return strtol(step, NULL, 10);
}

static const struct member *find_member(enum scene_node node, const char *name) {
    for (size_t i = 0; i < scene_member_count; i++)
        if (scene_members[i].node == node && strcmp(scene_members[i].name, name) == 0)
            return &scene_members[i];
    return NULL;
}

static bool is_key_of_alternatives(enum scene_node node, const char *name) {
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++)
        if (scene_alternatives[i].node == node && scene_alternatives[i].key &&
            strcmp(scene_alternatives[i].key, name) == 0)
            return true;
    return false;
}

/* Follows a pointer through the table of members; false after a fault. */
static bool follow(struct sequence_track *track, size_t number, struct error *err) {
    enum scene_node node = SCENE_NODE_scene;
    size_t at = 0;
    while (at < track->step_count) {
        const char *name = track->steps[at++];
        const struct member *member = find_member(node, name);
        if (!member && is_key_of_alternatives(node, name) && at == track->step_count)
            return true; /* which shape, which built-in */
        if (!member) {
            const char *meant = reader_meant(node, 0, name);
            if (meant)
                fault(err, number, "/pointer", "a scene has no such member: `%s`; is `%s` meant?",
                      name, meant);
            else
                fault(err, number, "/pointer", "a scene has no such member: `%s` in `%s`", name,
                      scene_nodes[node].name);
            return false;
        }
        track->whole = member->kind == MEMBER_INTEGER;
        bool list = member->kind == MEMBER_LIST, array = member->count > 0 || member->length_max;
        if (at == track->step_count)
            return true;
        if (member->kind == MEMBER_OBJECT || member->kind == MEMBER_TRANSFORM) {
            node = member->sub_node;
            continue;
        }
        track->indices |= UINT32_C(1) << at;
        const char *index = track->steps[at++];
        if (!array || index_of(index) < 0 || (!list && at < track->step_count)) {
            fault(err, number, "/pointer", "leads nowhere: `%s` has nothing called `%s`", name,
                  index);
            return false;
        }
        if (!list)
            return true;
        node = member->sub_node;
    }
    return true;
}

/* The picture's size decides what all frames are written into. */
static bool is_size(const struct sequence_track *track) {
    if (strcmp(track->steps[0], "image") != 0)
        return false;
    return track->step_count == 1 || strcmp(track->steps[1], "width") == 0 ||
           strcmp(track->steps[1], "height") == 0;
}

/* Whether one of two pointers leads through what the other drives. */
static bool overlaps(const struct sequence_track *a, const struct sequence_track *b) {
    size_t common = a->step_count < b->step_count ? a->step_count : b->step_count;
    for (size_t i = 0; i < common; i++)
        if (strcmp(a->steps[i], b->steps[i]) != 0)
            return false;
    return true;
}

static bool check_pointer(struct arena *arena, struct sequence *sequence, size_t number,
                          struct error *err) {
    struct sequence_track *track = &sequence->tracks[number];
    bool out_of_memory = false;
    if (!split(arena, track, &out_of_memory)) {
        track->step_count = 0;
        if (out_of_memory)
            error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out");
        else
            fault(err, number, "/pointer",
                  "not a JSON Pointer to a member: `%.200s` must begin with / and have at most 32 "
                  "steps",
                  track->pointer);
        return false;
    }
    if (!follow(track, number, err))
        return false;
    if (is_size(track)) {
        fault(err, number, "/pointer",
              "the size of the picture is that of all frames: animate other members of `image`");
        return false;
    }
    for (size_t i = 0; i < number; i++)
        if (sequence->tracks[i].step_count > 0 && overlaps(&sequence->tracks[i], track)) {
            fault(err, number, "/pointer", "drives what track %zu drives: `%.200s`", i,
                  sequence->tracks[i].pointer);
            return false;
        }
    return true;
}

/* ---- keys ---- */

static bool order_keys(struct sequence *sequence, size_t number, struct error *err) {
    struct sequence_track *track = &sequence->tracks[number];
    for (size_t k = 0; k < track->key_count; k++) {
        struct sequence_key *key = &track->keys[k];
        key->frame = key->by_time ? key->at * sequence->fps : key->at;
        if (k == 0 || key->frame > track->keys[k - 1].frame)
            continue;
        char below[64];
        snprintf(below, sizeof below, "/keys/%zu/%s", k, key->by_time ? "time" : "frame");
        fault(err, number, below, "must be later than the key before");
        return false;
    }
    return true;
}

/* How many numbers a value holds: 0 for one that stands alone, -1 where it is anything else. */
static long numbers_in(const json_t *value) {
    if (json_is_number(value))
        return 0;
    if (!json_is_array(value) || json_array_size(value) == 0)
        return -1;
    for (size_t i = 0; i < json_array_size(value); i++)
        if (!json_is_number(json_array_get(value, i)))
            return -1;
    return (long)json_array_size(value);
}

static bool check_values(const struct sequence *sequence, size_t number, struct error *err) {
    const struct sequence_track *track = &sequence->tracks[number];
    if (track->interpolation == SEQUENCE_STEP)
        return true;
    long first = numbers_in(track->keys[0].value);
    for (size_t k = 0; k < track->key_count; k++) {
        long has = numbers_in(track->keys[k].value);
        if (has >= 0 && has == first)
            continue;
        char below[64];
        snprintf(below, sizeof below, "/keys/%zu/value", k);
        fault(err, number, below, "%s, unless `interpolation` is `step`",
              has < 0 ? "must be a number or an array of numbers"
                      : "must hold as many numbers as the first key's");
        return false;
    }
    return true;
}

/* ---- the whole ---- */

enum status sequence_read(const char *json, size_t bytes, struct arena *arena,
                          struct sequence *sequence, struct error *err) {
    *sequence = (struct sequence){0};
    struct error found = {0};
    json_t *tree;
    enum status status = reader_document(json, bytes, SCENE_NODE_sequence, "sequence", arena,
                                         sequence, &tree, &found);
    sequence->tree = tree;
    sequence->bytes = bytes;
    if (status == STATUS_OK && !json_is_object(sequence->scene))
        error_fault(&found, STATUS_INVALID_SCENE, "/scene", "must be an object, is %s",
                    reader_type_name(sequence->scene));
    for (size_t i = 0; i < sequence->track_count && status == STATUS_OK; i++)
        if (order_keys(sequence, i, &found) && check_values(sequence, i, &found))
            check_pointer(arena, sequence, i, &found);
        else /* what is wrong with it is told; others shall not be compared with it */
            sequence->tracks[i].step_count = 0;
    if (found.status == STATUS_OK && (uint64_t)sequence->frames * bytes > SEQUENCE_TEXT_MAX)
        error_fault(&found, STATUS_TOO_COMPLEX, "/frames",
                    "%d frames of a text of %zu bytes: the product may be %llu", sequence->frames,
                    bytes, (unsigned long long)SEQUENCE_TEXT_MAX);
    if (found.status != STATUS_OK)
        sequence_finish(sequence);
    status = found.status;
    error_move(err, &found);
    return status;
}

void sequence_finish(struct sequence *sequence) {
    json_decref(sequence->tree);
    *sequence = (struct sequence){0};
}
