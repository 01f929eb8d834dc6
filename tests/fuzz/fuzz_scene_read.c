/* libFuzzer target: bytes as a scene. Whatever is accepted is written back, must read back to the
 * same text, and may be walked for its assets; whatever is refused must come with a fault.
 *
 * Built and run by tests/fuzz/scene_read.sh. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/problem_write.h"
#include "api/scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int condition, const char *what) {
    if (condition)
        return;
    fprintf(stderr, "fuzz_scene_read: %s\n", what);
    abort();
}

static void visit(void *user, const char *name, const char *pointer) {
    (void)user;
    require(*name && pointer[0] == '/', "an asset without name or pointer");
    require(name[0] != '/' && strstr(name, "../") != name, "an asset that leads outside");
}

static char *write_back(const char *text, size_t bytes, int *accepted) {
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    char *written = NULL;
    enum status status = scene_read(text, bytes, &arena, &scene, &err);
    *accepted = status == STATUS_OK;
    if (status == STATUS_OK) {
        require(err.fault_count == 0, "a fault of an accepted scene");
        scene_visit_assets(&scene, visit, NULL);
        scene_check_implemented(&scene, &err);
        written = scene_write(&scene);
        require(written != NULL, "a scene that cannot be written");
    } else {
        require(err.fault_count > 0, "a refusal without a fault");
        require(status != STATUS_OUT_OF_MEMORY, "scan and jansson disagree");
    }
    char *problem = problem_write(&err, NULL);
    require(problem != NULL, "a problem that cannot be written");
    free(problem);
    error_clear(&err);
    arena_free(&arena);
    return written;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    int accepted;
    char *once = write_back((const char *)data, size, &accepted);
    if (!accepted)
        return 0;
    char *twice = write_back(once, strlen(once), &accepted);
    require(accepted && strcmp(once, twice) == 0, "a scene that does not read back");
    free(once);
    free(twice);
    return 0;
}
