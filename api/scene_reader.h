/* Shared by the files that read one scene: scene_read.c (the whole), scene_read_node.c (objects, by
 * the table), scene_read_value.c (what is in a member), scene_check.c (refusals beyond the schema).
 */
#ifndef PELT_API_SCENE_READER_H
#define PELT_API_SCENE_READER_H

#include <jansson.h>

#include "api/json_path.h"
#include "api/refusals.h"
#include "api/scene_members.h"

struct reader {
    struct json_path path;
    struct arena *arena;
    struct error *err;
    size_t scan_faults; /* found before the tree was made; the values there are mended ones */
    bool out_of_memory;
};

/* A fault at the current place, unless the scan found one there: then the value is not the
 * caller's. */
void reader_fault(struct reader *reader, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The particulars of a refusal, at the current place. */
void reader_refuse(struct reader *reader, enum refusal refusal, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

size_t reader_fault_count(const struct reader *reader); /* stored or not */

/* Whether the scan found something at or below the current place. */
bool reader_scan_found_below(const struct reader *reader);

/* Reads a whole text as one node. On STATUS_OK the caller owns *tree (json_decref()), into which
 * parts of the node may point; `what`: "scene", for messages. As scene_read(), but for clearing
 * `out`. */
enum status reader_document(const char *json, size_t bytes, enum scene_node node, const char *what,
                            struct arena *arena, void *out, json_t **tree, struct error *err);

/* Names a member of `node` that is spelt nearly as `name`; NULL: none. `bit`: of the alternative,
 * 0: not known which. */
const char *reader_meant(enum scene_node node, uint64_t bit, const char *name);

/* Fills the struct of a node from a JSON object; `json` NULL: with its defaults. */
void reader_node(struct reader *reader, enum scene_node node, json_t *json, void *out);

/* Fills one member's field; json NULL: with its default. */
void reader_value(struct reader *reader, const struct member *member, json_t *json, void *out);

/* Judges a node that was read from `json` without a fault, and completes what its members leave to
 * it. */
void reader_check(struct reader *reader, enum scene_node node, json_t *json, void *out);

const char *reader_type_name(json_t *json); /* "a number", "an object", ... */

#endif
