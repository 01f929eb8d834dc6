/* Stage timing. llvmpipe's timer queries lie (a draw of 240 ms reads as 2-3 ms), so the clock is
 * checked once when the context is made: a known load is timed by GL_TIMESTAMP and by fence and CPU
 * clock; where they disagree by more than 10 % the fence is used, and the report names it. */
#ifndef PELT_RENDERER_GL_CLOCK_H
#define PELT_RENDERER_GL_CLOCK_H

#include "api/report.h"

double clock_now_ms(void); /* CLOCK_MONOTONIC */

enum report_clock gl_clock_check(void); /* a context must be current; blocks some milliseconds */

/* Waits until the GL has finished everything issued so far. */
void gl_clock_fence(void);

/* Walks through the stages of one request: each call ends the running stage (with a fence where
 * `fence`) and starts the next. */
struct stage_clock {
    double *stage_ms; /* [REPORT_STAGE_COUNT], added to */
    enum report_stage stage;
    double since_ms;
};
void stage_clock_start(struct stage_clock *clock, double *stage_ms, enum report_stage stage);
void stage_clock_next(struct stage_clock *clock, enum report_stage stage, bool fence);
void stage_clock_stop(struct stage_clock *clock, bool fence);

#endif
