/* Which clock can be trusted, and walking through the stages of a request with it.
 *
 * llvmpipe stamps GL_TIMESTAMP while it rasterises, once in every tile of 64 x 64 pixels, and keeps
 * the last one: the difference of two stamps is about the time of one tile, and a draw of 240 ms
 * reads as 2-3 ms. (A load within one tile reads right, so the load here covers 16.) A fence that
 * is waited for, between two readings of CLOCK_MONOTONIC, is right everywhere, but includes the
 * round trip to the GL; on hardware the query is the better one. So a known load is timed both
 * ways, and two runs of three decide. */
#include "renderer/gl/clock.h"

#include <glad/gl.h>
#include <math.h>
#include <time.h>

#include "renderer/gl/program.h"
#include "renderer/gl/target.h"

enum { LOAD_SIDE = 256, LOAD_ROUNDS_MIN = 16, LOAD_ROUNDS_MAX = 60000 };
static const double load_wanted_ms = 2, agreement = 0.1;

double clock_now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

void gl_clock_fence(void) {
    GLsync sync = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!sync) {
        glFinish();
        return;
    }
    /* A wait may end early by its time limit; a second is long enough not to spin. */
    while (glClientWaitSync(sync, GL_SYNC_FLUSH_COMMANDS_BIT, 1000000000) == GL_TIMEOUT_EXPIRED)
        ;
    glDeleteSync(sync);
}

struct load {
    GLuint queries[2];
    int rounds;
};

/* Draws the load once; returns what each clock says, in milliseconds. */
static void measure(struct load *load, double *fence_ms, double *query_ms) {
    gl_clock_fence();
    double start_ms = clock_now_ms();
    glQueryCounter(load->queries[0], GL_TIMESTAMP);
    glUniform1i(3, load->rounds);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glQueryCounter(load->queries[1], GL_TIMESTAMP);
    gl_clock_fence();
    *fence_ms = clock_now_ms() - start_ms;
    GLuint64 stamps[2] = {0, 0};
    glGetQueryObjectui64v(load->queries[0], GL_QUERY_RESULT, &stamps[0]);
    glGetQueryObjectui64v(load->queries[1], GL_QUERY_RESULT, &stamps[1]);
    *query_ms = ((double)stamps[1] - (double)stamps[0]) * 1e-6;
}

static enum report_clock compare_clocks(struct load *load) {
    double fence_ms, query_ms;
    /* The first draw compiles; the next ones find the length that takes long enough. */
    measure(load, &fence_ms, &query_ms);
    for (;;) {
        measure(load, &fence_ms, &query_ms);
        if (fence_ms >= load_wanted_ms || load->rounds == LOAD_ROUNDS_MAX)
            break;
        double longer = load->rounds * fmin(16, 1.5 * load_wanted_ms / fmax(fence_ms, 0.01));
        load->rounds = (int)fmin(LOAD_ROUNDS_MAX, fmax(longer, load->rounds * 2.0));
    }
    /* Two of three: what else runs on the machine may stretch one. */
    for (int agree = 0, differ = 0;;) {
        if (fabs(query_ms - fence_ms) <= agreement * fence_ms)
            agree++;
        else
            differ++;
        if (agree == 2 || differ == 2)
            return agree == 2 ? REPORT_CLOCK_QUERY : REPORT_CLOCK_FENCE;
        measure(load, &fence_ms, &query_ms);
    }
}

enum report_clock gl_clock_check(void) {
    /* The fence is always right, so it is the answer where the load cannot be drawn. */
    enum report_clock clock = REPORT_CLOCK_FENCE;
    struct gl_target target = {0};
    struct gl_programs *programs = gl_programs_create();
    GLuint program = 0;
    if (programs &&
        gl_programs_get(programs, GL_PROGRAM_CHECK, 0, &program, NULL, NULL) == STATUS_OK &&
        gl_target_resize(&target, LOAD_SIDE, LOAD_SIDE, false, NULL) == STATUS_OK) {
        GLuint array = 0;
        struct load load = {.rounds = LOAD_ROUNDS_MIN};
        glCreateVertexArrays(1, &array);
        glCreateQueries(GL_TIMESTAMP, 2, load.queries);
        glBindVertexArray(array);
        glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
        glViewport(0, 0, LOAD_SIDE, LOAD_SIDE);
        glUseProgram(program);
        clock = compare_clocks(&load);
        glUseProgram(0);
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        glBindVertexArray(0);
        glDeleteQueries(2, load.queries);
        glDeleteVertexArrays(1, &array);
    }
    gl_target_finish(&target);
    gl_programs_destroy(programs);
    return clock;
}

void stage_clock_start(struct stage_clock *clock, double *stage_ms, enum report_stage stage) {
    *clock = (struct stage_clock){stage_ms, stage, clock_now_ms()};
}

void stage_clock_stop(struct stage_clock *clock, bool fence) {
    if (fence)
        gl_clock_fence();
    double now_ms = clock_now_ms();
    clock->stage_ms[clock->stage] += now_ms - clock->since_ms;
    clock->since_ms = now_ms;
}

void stage_clock_next(struct stage_clock *clock, enum report_stage stage, bool fence) {
    stage_clock_stop(clock, fence);
    clock->stage = stage;
}
