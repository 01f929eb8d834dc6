/* JSON to scene: limits, the scan, the tree, then node by node along the table of members.
 *
 * jansson makes the tree. What a tree cannot show is found before (json_scan.h). Nothing here knows
 * a member's name; scene_members.def does. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_scan.h"
#include "api/scene_reader.h"

static bool scan_found(const struct reader *reader, const char *pointer) {
    for (size_t i = 0; i < reader->scan_faults && i < reader->err->fault_count; i++) {
        const char *found = reader->err->faults[i].pointer;
        if (found && strcmp(found, pointer) == 0)
            return true;
    }
    return false;
}

bool reader_scan_found_below(const struct reader *reader) {
    for (size_t i = 0; i < reader->scan_faults && i < reader->err->fault_count; i++) {
        const char *found = reader->err->faults[i].pointer;
        if (found && strncmp(found, reader->path.text, reader->path.length) == 0 &&
            (found[reader->path.length] == '/' || found[reader->path.length] == 0))
            return true;
    }
    return reader->err->faults_left_out > 0;
}

void reader_fault(struct reader *reader, const char *format, ...) {
    if (scan_found(reader, reader->path.text))
        return;
    char message[512];
    va_list args;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    error_fault(reader->err, STATUS_INVALID_SCENE, reader->path.text, "%s", message);
}

void reader_refuse(struct reader *reader, enum refusal refusal, const char *format, ...) {
    char particulars[512];
    va_list args;
    va_start(args, format);
    vsnprintf(particulars, sizeof particulars, format, args);
    va_end(args);
    refuse(reader->err, refusal, reader->path.text, "%s", particulars);
}

size_t reader_fault_count(const struct reader *reader) {
    return reader->err->fault_count + reader->err->faults_left_out;
}

const char *reader_type_name(json_t *json) {
    switch (json_typeof(json)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "an array";
    case JSON_STRING:
        return "a string";
    case JSON_INTEGER:
    case JSON_REAL:
        return "a number";
    case JSON_TRUE:
    case JSON_FALSE:
        return "a boolean";
    default:
        return "null";
    }
}

/* The tree of a text that the scan has passed. Integers become doubles, as every number of the
 * scene fits one; jansson's own would overflow at 2^63 without a pointer. */
static json_t *load(const char *text, size_t bytes, bool duplicates, const char *what,
                    struct error *err) {
    size_t flags = JSON_DECODE_ANY | JSON_DECODE_INT_AS_REAL;
    if (!duplicates)
        flags |= JSON_REJECT_DUPLICATES;
    json_error_t why = {0};
    json_t *json = json_loadb(text, bytes, flags, &why);
    if (json)
        return json;
    /* The scan has passed the text, so only memory is left to blame. jansson itself cannot be
     * asked: where a string cannot be allocated it reports a syntax error. The fuzzer and the
     * property test would see a text on which the two disagree. */
    error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out while the %s was parsed (%s)", what,
                why.text[0] ? why.text : "no detail");
    return NULL;
}

static enum status read_text(const char *text, size_t bytes, bool duplicates, enum scene_node node,
                             const char *what, struct arena *arena, void *out, json_t **tree,
                             struct error *err) {
    json_t *json = load(text, bytes, duplicates, what, err);
    if (!json)
        return err->status;
    struct reader reader = {.arena = arena, .err = err, .scan_faults = err->fault_count};
    reader_node(&reader, node, json, out);
    if (reader.out_of_memory) {
        error_clear(err);
        error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out");
    }
    if (err->status == STATUS_OK)
        *tree = json;
    else
        json_decref(json);
    return err->status;
}

enum status reader_document(const char *json, size_t bytes, enum scene_node node, const char *what,
                            struct arena *arena, void *out, json_t **tree, struct error *err) {
    *tree = NULL;
    if (bytes > SCENE_BYTES_MAX)
        return refuse(err, REFUSAL_TOO_LARGE, "", "%zu bytes, at most %d", bytes, SCENE_BYTES_MAX);
    char *text = malloc(bytes + 1);
    if (!text)
        return error_fault(err, STATUS_OUT_OF_MEMORY, "", "memory ran out");
    memcpy(text, json, bytes);
    text[bytes] = 0;

    struct error found = {0};
    bool duplicates = false;
    enum status status = json_scan(text, bytes, SCENE_DEPTH_MAX, &duplicates, &found);
    if (status == STATUS_OK)
        status = read_text(text, bytes, duplicates, node, what, arena, out, tree, &found);
    free(text);
    if (status != STATUS_OK)
        /* Faults of several kinds: the one that ended the reading names the whole. */
        found.status = status;
    error_move(err, &found);
    return status;
}

enum status scene_read(const char *json, size_t bytes, struct arena *arena, struct scene *scene,
                       struct error *err) {
    json_t *tree;
    *scene = (struct scene){0};
    enum status status =
        reader_document(json, bytes, SCENE_NODE_scene, "scene", arena, scene, &tree, err);
    if (status != STATUS_OK)
        *scene = (struct scene){0};
    json_decref(tree);
    return status;
}
