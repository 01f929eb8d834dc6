/* JSON Pointers (RFC 6901) grown and cut while a document is walked. */
#include "api/json_path.h"

#include <stdio.h>
#include <string.h>

size_t json_path_enter(struct json_path *path, const char *key, size_t key_bytes) {
    size_t mark = path->length, length = mark;
    if (key_bytes >= JSON_PATH_BYTES - mark - 1)
        return mark;
    path->text[length++] = '/';
    for (size_t i = 0; i < key_bytes; i++) {
        if (length + 3 > JSON_PATH_BYTES) {
            path->text[mark] = 0;
            return mark;
        }
        if (key[i] == '~' || key[i] == '/') {
            path->text[length++] = '~';
            path->text[length++] = key[i] == '~' ? '0' : '1';
        } else {
            path->text[length++] = key[i];
        }
    }
    path->text[length] = 0;
    path->length = length;
    return mark;
}

size_t json_path_enter_name(struct json_path *path, const char *name) {
    return json_path_enter(path, name, strlen(name));
}

size_t json_path_enter_index(struct json_path *path, size_t index) {
    char digits[24];
    int length = snprintf(digits, sizeof digits, "%zu", index);
    return json_path_enter(path, digits, (size_t)length);
}

void json_path_leave(struct json_path *path, size_t mark) {
    path->length = mark;
    path->text[mark] = 0;
}
