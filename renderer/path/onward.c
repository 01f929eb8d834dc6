/* See onward.h. */
#include "renderer/path/onward.h"

#include <math.h>

#include "renderer/gl/context.h"

/* What a medium lets through straight across its shell, on the mean of its columns, below which the
 * rest is worth hiding. Processor time against that of all slabs, 500 of them at 512 x 512: fur
 * (0.001) on a sphere 0.72, on a torus 0.77; clouds (0.53) 0.96 to 1.00, fog (0.48) over a
 * terrain 1.01. */
static const double THROUGH_MAX = 0.1;

bool onward_pays(const struct picture *picture, uint32_t runs) {
    double through = 1;
    for (size_t i = 0; i < picture->object_count; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->shell || !volume_has_medium(object->volume))
            continue;
        through = fmin(through, object->volume->homogeneous
                                    ? exp(-object->volume->extinction * object->shell->thickness)
                                    : (double)object->volume->medium_through);
    }
    if (picture->forced_order)
        return picture->forced_order > 0;
    return through < THROUGH_MAX && runs > 2 * (uint32_t)ONWARD_RUNS;
}

void onward_finish(struct onward *onward) {
    gl_target_finish(&onward->target);
    glDeleteFramebuffers(1, &onward->hiding);
    glDeleteVertexArrays(1, &onward->array);
}

static void begin_media(const struct onward *onward) {
    glBindFramebuffer(GL_FRAMEBUFFER, onward->target.framebuffer);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_FALSE);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFuncSeparate(GL_DST_ALPHA, GL_ONE, GL_ZERO, GL_SRC1_ALPHA);
}

enum status onward_begin(struct onward *onward, struct picture *picture, struct error *err) {
    static const float nothing[4] = {0, 0, 0, 1}, far = 0;
    const struct gl_target *target = picture->target;
    enum status status =
        gl_target_resize(&onward->target, target->width, target->height, true, err);
    if (status != STATUS_OK)
        return status;
    if (!onward->hiding) {
        glCreateFramebuffers(1, &onward->hiding);
        glNamedFramebufferDrawBuffer(onward->hiding, GL_NONE);
        glCreateVertexArrays(1, &onward->array);
    }
    glNamedFramebufferTexture(onward->hiding, GL_DEPTH_ATTACHMENT, onward->target.depth, 0);
    glDepthMask(GL_TRUE);
    glClearNamedFramebufferfv(onward->target.framebuffer, GL_COLOR, 0, nothing);
    if (target->depth)
        glBlitNamedFramebuffer(target->framebuffer, onward->target.framebuffer, 0, 0, target->width,
                               target->height, 0, 0, target->width, target->height,
                               GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    else
        glClearNamedFramebufferfv(onward->target.framebuffer, GL_DEPTH, 0, &far);
    begin_media(onward);
    return gl_check("drawing slabs from the nearest on", err);
}

/* As for rays that walk (frame_set_shell()): an error that vanishes with the square of the slabs.
 */
static float least_of(const struct picture *picture) {
    double slices = fmax(1, (double)picture->report->work.slices);
    return (float)fmin(1e-4, 0.1 / (slices * slices));
}

enum status onward_hide(struct onward *onward, struct picture *picture, struct error *err) {
    GLuint program;
    enum status status =
        gl_programs_get(picture->programs, GL_PROGRAM_HIDE, 0, &program, &picture->cold, err);
    if (status != STATUS_OK)
        return status;
    glBindFramebuffer(GL_FRAMEBUFFER, onward->hiding);
    glUseProgram(program);
    glProgramUniform1f(program, 0, least_of(picture));
    glBindTextureUnit(BINDING_SAMPLES, onward->target.color);
    glDisable(GL_BLEND);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_ALWAYS);
    glDepthMask(GL_TRUE);
    gl_blocks_draw(picture->blocks, program, onward->array);
    glBindTextureUnit(BINDING_SAMPLES, 0);
    picture->report->work.draws++;
    begin_media(onward);
    return gl_check("hiding what cannot be seen", err);
}

enum status onward_end(struct onward *onward, struct picture *picture, struct error *err) {
    GLuint program;
    enum status status = gl_programs_get(picture->programs, GL_PROGRAM_COMPOSE_ONWARD, 0, &program,
                                         &picture->cold, err);
    glBindFramebuffer(GL_FRAMEBUFFER, picture->target->framebuffer);
    if (status != STATUS_OK)
        return status;
    glUseProgram(program);
    glBindTextureUnit(BINDING_SAMPLES, onward->target.color);
    glDisable(GL_DEPTH_TEST);
    glBlendFuncSeparate(GL_ONE, GL_SRC1_ALPHA, GL_ONE, GL_ONE);
    gl_blocks_draw(picture->blocks, program, onward->array);
    glBindTextureUnit(BINDING_SAMPLES, 0);
    picture->report->work.draws++;
    return gl_check("composing slabs", err);
}
