/* Reads scenes and says what scene_read() makes of them; for the checks and the property test.
 *
 *   scene_check FILE...   one line a file; exit 0 if all are valid
 *   scene_check           documents on stdin, each as its length in bytes, a newline and the bytes;
 *                         one JSON line for each on stdout: the problem document, or
 *                         {"status": "ok", "scene": the scene written back,
 *                          "not_implemented": [pointers]} */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_out.h"
#include "api/problem_write.h"
#include "api/scene.h"

static void put_pointers(struct json_out *out, const struct error *err) {
    json_out_open(out, '[');
    for (size_t i = 0; i < err->fault_count; i++)
        json_out_string(out, err->faults[i].pointer);
    json_out_close(out, ']');
}

/* The answer for one document, malloc'ed. */
static char *judge(const char *text, size_t bytes, bool *valid) {
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct json_out out = {0};
    char *answer;
    *valid = scene_read(text, bytes, &arena, &scene, &err) == STATUS_OK;
    if (*valid) {
        char *written = scene_write(&scene);
        scene_check_implemented(&scene, &err);
        json_out_open(&out, '{');
        json_out_key(&out, "status");
        json_out_string(&out, "ok");
        json_out_key(&out, "not_implemented");
        put_pointers(&out, &err);
        json_out_key(&out, "scene");
        json_out_raw(&out, written ? written : "null");
        json_out_close(&out, '}');
        free(written);
        answer = json_out_finish(&out);
    } else {
        answer = problem_write(&err, NULL);
    }
    error_clear(&err);
    arena_free(&arena);
    return answer;
}

static char *read_file(const char *name, size_t *bytes) {
    FILE *file = fopen(name, "rb");
    if (!file)
        return NULL;
    size_t capacity = SCENE_BYTES_MAX + 2;
    char *text = malloc(capacity);
    *bytes = text ? fread(text, 1, capacity, file) : 0;
    fclose(file);
    return text;
}

static int check_files(int count, char **names) {
    int bad = 0;
    for (int i = 0; i < count; i++) {
        size_t bytes;
        bool valid = false;
        char *text = read_file(names[i], &bytes);
        char *answer = text ? judge(text, bytes, &valid) : NULL;
        if (valid)
            printf("ok    %s\n", names[i]);
        else
            printf("BAD   %s: %s\n", names[i], answer ? answer : "cannot be read");
        bad += !valid;
        free(answer);
        free(text);
    }
    return bad ? 1 : 0;
}

static int check_stream(void) {
    size_t bytes;
    while (scanf("%zu", &bytes) == 1 && getchar() == '\n') {
        char *text = malloc(bytes + 1);
        if (!text || fread(text, 1, bytes, stdin) != bytes) {
            fprintf(stderr, "scene_check: a document was cut short\n");
            free(text);
            return 1;
        }
        bool valid;
        char *answer = judge(text, bytes, &valid);
        free(text);
        if (!answer)
            return 1;
        puts(answer);
        free(answer);
    }
    return 0;
}

int main(int argc, char **argv) {
    return argc > 1 ? check_files(argc - 1, argv + 1) : check_stream();
}
