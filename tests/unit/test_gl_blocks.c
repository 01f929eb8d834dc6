/* A few pixels of a picture: full-screen passes reach them alone, masks hide all others, and
 * gathering brings back what the whole resolve would. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/blocks.h"
#include "renderer/gl/resolve.h"
#include "shaders/interface.h"
#include "tests/unit/gl_fixture.h"

enum { WIDTH = 23, HEIGHT = 14 };

static struct gl_programs *programs;
static const double background[4] = {0.2, 0.4, 0.6, 0.5};

/* A sample grid of k x k for each pixel, filled with numbers that are all different. */
static void make_samples(int k, struct gl_target *samples) {
    struct error err = {0};
    *samples = (struct gl_target){0};
    assert_int_equal(gl_target_resize(samples, WIDTH * k, HEIGHT * k, true, &err), STATUS_OK);
    size_t count = (size_t)(WIDTH * k) * (size_t)(HEIGHT * k);
    float *data = malloc(count * 4 * sizeof *data);
    assert_non_null(data);
    for (size_t n = 0; n < 4 * count; n++)
        data[n] = (float)(n * 7919 % 10007) / 10007;
    glTextureSubImage2D(samples->color, 0, 0, 0, WIDTH * k, HEIGHT * k, GL_RGBA, GL_FLOAT, data);
    free(data);
}

static void make_blocks(struct gl_blocks *blocks, int k, int side) {
    static const uint32_t places[4][2] = {{0, 0}, {9, 4}, {WIDTH - 1, HEIGHT - 1}, {5, HEIGHT - 1}};
    struct error err = {0};
    uint32_t(*corner)[2] = malloc(sizeof places);
    assert_non_null(corner);
    for (int i = 0; i < 4; i++) {
        corner[i][0] =
            places[i][0] + (uint32_t)side > WIDTH ? WIDTH - (uint32_t)side : places[i][0];
        corner[i][1] =
            places[i][1] + (uint32_t)side > HEIGHT ? HEIGHT - (uint32_t)side : places[i][1];
    }
    assert_int_equal(gl_blocks_set(blocks, WIDTH, HEIGHT, k, side, corner, 4, &err), STATUS_OK);
}

/* Which block holds a pixel (the bottom row being 0), and where in it; -1: none. */
static int block_of(const struct gl_blocks *blocks, int x, int y) {
    for (int b = 0; b < (int)blocks->count; b++) {
        int dx = x - (int)blocks->corner[b][0], dy = y - (int)blocks->corner[b][1];
        if (dx >= 0 && dx < blocks->side && dy >= 0 && dy < blocks->side)
            return b;
    }
    return -1;
}

static void test_gathers_what_resolves(void **state) {
    (void)state;
    for (int k = 1; k <= 5; k++)
        for (int side = 1; side <= 4; side++) {
            struct gl_target samples, picture = {0};
            struct gl_blocks blocks = {0};
            struct error err = {0};
            float whole[HEIGHT][WIDTH][4], gathered[4 * 16][4];
            make_samples(k, &samples);
            make_blocks(&blocks, k, side);
            assert_int_equal(gl_target_resize(&picture, WIDTH, HEIGHT, false, &err), STATUS_OK);
            assert_int_equal(gl_resolve(programs, &samples, k, background, &picture, NULL, &err),
                             STATUS_OK);
            assert_int_equal(gl_target_read(&picture, whole[0][0], &err), STATUS_OK);
            assert_int_equal(
                gl_blocks_gather(&blocks, programs, &samples, background, gathered, NULL, &err),
                STATUS_OK);
            for (int n = 0; n < 4 * side * side; n++) {
                int b = n / (side * side), within = n % (side * side);
                int x = (int)blocks.corner[b][0] + within % side;
                int y = (int)blocks.corner[b][1] + within / side;
                assert_memory_equal(gathered[n], whole[HEIGHT - 1 - y][x], sizeof gathered[n]);
            }
            gl_blocks_finish(&blocks);
            gl_target_finish(&picture);
            gl_target_finish(&samples);
        }
}

/* The resolve as an example of a full-screen pass, drawn over samples-sized blocks: k = 1 in the
 * program, so that each sample of the target is a fragment. */
static void test_draws_blocks_alone(void **state) {
    (void)state;
    for (int k = 1; k <= 5; k++)
        for (int side = 1; side <= 4; side++) {
            struct gl_target samples, all = {0}, some = {0};
            struct gl_blocks blocks = {0};
            struct error err = {0};
            GLuint program, array;
            make_samples(k, &samples);
            make_blocks(&blocks, k, side);
            assert_int_equal(gl_target_resize(&all, WIDTH * k, HEIGHT * k, false, &err), STATUS_OK);
            assert_int_equal(gl_target_resize(&some, WIDTH * k, HEIGHT * k, false, &err),
                             STATUS_OK);
            assert_int_equal(gl_resolve(programs, &samples, 1, background, &all, NULL, &err),
                             STATUS_OK);
            assert_int_equal(gl_programs_get(programs, GL_PROGRAM_RESOLVE, 0, &program, NULL, &err),
                             STATUS_OK);
            gl_target_begin(&some, NULL, NULL);
            glUseProgram(program); /* its uniforms are as the resolve above left them */
            glCreateVertexArrays(1, &array);
            gl_blocks_draw(&blocks, program, array);
            gl_blocks_draw(NULL, program, array); /* leaves no trace on a later whole pass: below */
            glDeleteVertexArrays(1, &array);
            size_t count = (size_t)(WIDTH * k) * (size_t)(HEIGHT * k);
            float(*a)[4] = malloc(count * sizeof *a), (*b)[4] = malloc(count * sizeof *b);
            assert_true(a && b);
            assert_int_equal(gl_target_read(&all, a[0], &err), STATUS_OK);
            assert_int_equal(gl_target_read(&some, b[0], &err), STATUS_OK);
            assert_memory_equal(a, b, count * sizeof *a);

            gl_target_begin(&some, NULL, NULL);
            glUseProgram(program);
            glCreateVertexArrays(1, &array);
            gl_blocks_draw(&blocks, program, array);
            glDeleteVertexArrays(1, &array);
            assert_int_equal(gl_target_read(&some, b[0], &err), STATUS_OK);
            static const float nothing[4] = {0, 0, 0, 0};
            for (int y = 0; y < HEIGHT * k; y++)
                for (int x = 0; x < WIDTH * k; x++) {
                    size_t n = (size_t)(HEIGHT * k - 1 - y) * (size_t)(WIDTH * k) + (size_t)x;
                    bool inside = block_of(&blocks, x / k, y / k) >= 0;
                    assert_memory_equal(b[n], inside ? a[n] : nothing, sizeof *b);
                }
            assert_int_equal(gl_check("drawing blocks", &err), STATUS_OK);
            free(a);
            free(b);
            gl_blocks_finish(&blocks);
            gl_target_finish(&all);
            gl_target_finish(&some);
            gl_target_finish(&samples);
        }
}

static void test_masks_the_rest(void **state) {
    (void)state;
    struct gl_target samples;
    struct gl_blocks blocks = {0};
    struct error err = {0};
    static float depth[HEIGHT * 2][WIDTH * 2];
    make_samples(2, &samples);
    make_blocks(&blocks, 2, 3);
    assert_int_equal(gl_blocks_mask(&blocks, &samples, &err), STATUS_OK);
    glGetTextureImage(samples.depth, 0, GL_DEPTH_COMPONENT, GL_FLOAT, sizeof depth, depth);
    for (int y = 0; y < HEIGHT * 2; y++)
        for (int x = 0; x < WIDTH * 2; x++)
            assert_true(depth[y][x] == (block_of(&blocks, x / 2, y / 2) >= 0 ? 0 : 1));
    gl_blocks_finish(&blocks);
    gl_target_finish(&samples);
}

static void test_of_none(void **state) {
    (void)state;
    struct gl_blocks blocks = {0};
    struct error err = {0};
    uint32_t(*none)[2] = malloc(1);
    assert_int_equal(gl_blocks_set(&blocks, WIDTH, HEIGHT, 1, 2, none, 0, &err), STATUS_OK);
    assert_int_equal(gl_blocks_gather(&blocks, programs, NULL, background, NULL, NULL, &err),
                     STATUS_OK);
    gl_blocks_finish(&blocks);
    gl_blocks_finish(&blocks);
}

static int open_all(void **state) {
    if (gl_fixture_open(state) != 0)
        return -1;
    programs = gl_programs_create();
    return programs ? 0 : -1;
}

static int close_all(void **state) {
    gl_programs_destroy(programs);
    return gl_fixture_close(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gathers_what_resolves),
        cmocka_unit_test(test_draws_blocks_alone),
        cmocka_unit_test(test_masks_the_rest),
        cmocka_unit_test(test_of_none),
    };
    return cmocka_run_group_tests(tests, open_all, close_all);
}
