/* SXMPVO alone: time to order the tetrahedra of closed tori of growing size, with an A-buffer of
 * 512 x 512 and the adjacency prebuilt. Prints one JSON object a line; bench.py makes the table.
 *
 * The shell's thickness is a fifth of a mesh edge's length, so that tetrahedra keep their shape as
 * they grow in number and shells do not invert. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/gl/clock.h"
#include "renderer/shell/sort.h"

enum { GRID = 512 };

static int fail(const struct error *err) {
    fprintf(stderr, "bench_sort: %s\n",
            err->fault_count ? err->faults[0].message : status_title(err->status));
    return 1;
}

static int measure(long tetrahedra, int repeats) {
    /* n x m quads, twice as many triangles, three tetrahedra each; around the ring 2.5 as many as
     * around the tube, which is 0.4 of the ring's radius. */
    int m = (int)lround(sqrt((double)tetrahedra / 6 / 2.5)), n = (int)lround(2.5 * m);
    struct scene_mesh spec = {
        .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {n, m}};
    double thickness = 0.2 * 2 * 3.14159265358979 * 0.4 / m;
    struct error err = {0};
    const struct mesh *mesh = NULL;
    struct shell *shell = NULL;
    struct projection projection = {0};
    struct mesh_cache *cache = mesh_cache_create((size_t)1 << 30);
    int code = 1;
    if (!cache || mesh_acquire(cache, &spec, false, "", NULL, &mesh, &err) != STATUS_OK ||
        shell_build(mesh, thickness, (const double[2]){1, 1}, "", &shell, &err) != STATUS_OK)
        goto done;
    struct scene_camera camera = {
        .given = true, .eye = {0, -3, 2.2}, .target = {0, 0, 0}, .up = {0, 0, 1}, .fov_y_deg = 40};
    struct scene_image image = {.width = GRID, .height = GRID, .samples = 1};
    const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    struct view world, view;
    view_from_camera(&camera, &image, shell->bounds_min, shell->bounds_max, 1, &world);
    view_in_object(&world, identity, shell->center, &view);
    if (project_shell(shell, &view, &projection, &err) != STATUS_OK)
        goto done;
    printf("{\"asked\": %ld, \"tetrahedra\": %u, \"ms\": [", tetrahedra, shell->tetra_count);
    struct sort_result result = {0};
    for (int i = -1; i < repeats; i++) { /* the first run warms */
        double began_ms = clock_now_ms();
        if (sort_tetrahedra(&(struct sort_shell){shell, &projection}, 1, NULL, &result, &err) !=
            STATUS_OK)
            goto done;
        double ms = clock_now_ms() - began_ms;
        sort_result_finish(&result);
        if (i >= 0)
            printf("%s%.3f", i ? ", " : "", ms);
    }
    printf("], \"fragments\": %llu, \"edges\": %llu, \"cycles\": %llu}\n",
           (unsigned long long)result.fragments, (unsigned long long)result.edges,
           (unsigned long long)result.cycles);
    code = 0;
done:
    if (code)
        fail(&err);
    projection_finish(&projection);
    shell_destroy(shell);
    if (mesh)
        mesh_release(cache, mesh);
    mesh_cache_destroy(cache);
    error_clear(&err);
    return code;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fputs("usage: bench_sort TETRAHEDRA REPEATS\n", stderr);
        return 2;
    }
    return measure(strtol(argv[1], NULL, 10), (int)strtol(argv[2], NULL, 10));
}
