/* Where a walk through a JSON document stands, as the RFC 6901 pointer of the current value. */
#ifndef PELT_API_JSON_PATH_H
#define PELT_API_JSON_PATH_H

#include <stddef.h>

enum { JSON_PATH_BYTES = 512 };

/* Zero-initialise: the pointer "" of the whole document. A step that would not fit is left out, so
 * that the pointer names the deepest value on the way that it has room for; a request cannot make
 * faults of unbounded size out of long member names. */
struct json_path {
    char text[JSON_PATH_BYTES];
    size_t length;
};

/* Steps into a member or an element. Returns what json_path_leave() takes to step back out. `key`
 * need not be terminated; `~` and `/` are escaped. */
size_t json_path_enter(struct json_path *path, const char *key, size_t key_bytes);
size_t json_path_enter_name(struct json_path *path, const char *name);
size_t json_path_enter_index(struct json_path *path, size_t index);
void json_path_leave(struct json_path *path, size_t mark);

#endif
