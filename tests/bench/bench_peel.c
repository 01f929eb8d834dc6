/* Depth peeling against sorted and walked cells: what Dufort, Leblanc & Poulin 2005 (section 4.1)
 * gave up for a sort, 20 s against 0.5 s a picture of their vase. Each pass draws all cells anew
 * and keeps of each sample the nearest one that is behind those of the passes before (Everitt
 * 1999), in a depth buffer; layers are composited front to back, until no sample has one left.
 *
 * The product knows nothing of this. The linker puts __wrap_cell_pass_draw() and
 * __wrap_gl_programs_get() before the path's own functions (Makefile), so that the same outlines
 * are drawn by the same shader into the same picture; into the shader's text one test is inserted.
 * A cell is placed by the middle of its segment: neighbours share the point where one ends and the
 * other begins, middles of segments that are longer than a rounding are apart. What is as short as
 * that may be lost; so may one of two cells of overlapping folds whose middles agree.
 *
 * Times of ways that take turns: stage draw, and sort for those that need it. Prints one JSON
 * object a line; ends with 1 where the pictures differ by more than they may.
 *
 *   bench_peel REPEATS SCENE.json [SIDE]    in the scene's folder: assets are relative to it */
#include <math.h>

#include "renderer/gl/context.h"
#include "renderer/path/cells.h"
#include "shaders/interface.h"
#include "tests/bench/bench_support.h"
#include "tests/unit/asset_files.h"

enum { REPEATS_MAX = 101, LAYERS_MAX = 4096, PROGRAMS_MAX = 16 };

/* Root mean square against sorted cells. Peeled: the same sums in fp32, from the other end: 1.3e-7
 * measured on the vase, of up to 112 cells a ray. Walked: bound as in bench_plan, 3e-6 measured. */
static const double peeled_max = 1e-6, walked_max = 5e-5;

enum status __real_cell_pass_draw(struct cell_pass *pass, struct picture *picture,
                                  const struct outlines *outlines, bool solid, struct error *err);
enum status __wrap_cell_pass_draw(struct cell_pass *pass, struct picture *picture,
                                  const struct outlines *outlines, bool solid, struct error *err);
enum status __real_gl_programs_get(struct gl_programs *programs, enum gl_program_id id,
                                   uint32_t variant, GLuint *program, bool *compiled,
                                   struct error *err);
enum status __wrap_gl_programs_get(struct gl_programs *programs, enum gl_program_id id,
                                   uint32_t variant, GLuint *program, bool *compiled,
                                   struct error *err);

/* What stands in for a mutable part of the path: the linker's hooks have no argument for it. */
static struct peeling {
    bool on, drawing; /* drawing: gl_programs_get() gives the peeling program */
    int layers;       /* of the last picture */
    struct {
        uint32_t variant;
        GLuint program;
    } made[PROGRAMS_MAX];
    size_t made_count;
    GLuint composite, blend, array, query;
    int width, height;
    GLuint color, depth[2], sum[2], framebuffer[2], sum_framebuffer[2];
} peeling;

/* ---- programs ---- */

static GLuint compile(GLenum type, const char *text, struct error *err) {
    GLuint shader = glCreateShader(type);
    GLint compiled = GL_FALSE;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (!compiled) {
        char log[512] = "";
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        error_fault(err, STATUS_GL_ERROR, NULL, "a peeling shader does not compile: %s", log);
        glDeleteShader(shader);
        return 0;
    }
    return shader;
}

static enum status make_program(const char *vertex, const char *fragment, GLuint *program,
                                struct error *err) {
    GLuint stages[2] = {compile(GL_VERTEX_SHADER, vertex, err), 0};
    stages[1] = stages[0] ? compile(GL_FRAGMENT_SHADER, fragment, err) : 0;
    GLint linked = GL_FALSE;
    if (stages[1]) {
        *program = glCreateProgram();
        for (int i = 0; i < 2; i++)
            glAttachShader(*program, stages[i]);
        glLinkProgram(*program);
        glGetProgramiv(*program, GL_LINK_STATUS, &linked);
        if (!linked)
            error_fault(err, STATUS_GL_ERROR, NULL, "a peeling program does not link");
    }
    for (int i = 0; i < 2; i++)
        glDeleteShader(stages[i]);
    return linked ? STATUS_OK : err->status;
}

static const char whole[] = "#version 450 core\n"
                            "void main() { gl_Position = vec4((gl_VertexID & 1) * 4 - 1, "
                            "(gl_VertexID & 2) * 2 - 1, 0.0, 1.0); }\n";

/* A layer behind the layers so far: radiance and optical depth. */
static const char composite[] = "#version 450 core\n"
                                "layout(binding = 20) uniform sampler2D sum;\n"
                                "layout(binding = 21) uniform sampler2D layer;\n"
                                "layout(location = 0) out vec4 both;\n"
                                "void main() {\n"
                                "    vec4 a = texelFetch(sum, ivec2(gl_FragCoord.xy), 0);\n"
                                "    vec4 b = texelFetch(layer, ivec2(gl_FragCoord.xy), 0);\n"
                                "    both = vec4(a.rgb + exp(-a.a) * b.rgb, a.a + b.a);\n"
                                "}\n";

/* All layers over the picture, as the path blends media. */
static const char blend[] = "#version 450 core\n"
                            "layout(binding = 20) uniform sampler2D sum;\n"
                            "layout(location = 0, index = 0) out vec4 picture;\n"
                            "layout(location = 0, index = 1) out vec4 through;\n"
                            "void main() {\n"
                            "    picture = texelFetch(sum, ivec2(gl_FragCoord.xy), 0);\n"
                            "    through = vec4(exp(-picture.a));\n"
                            "}\n";

/* Replaces the first `old` in `text`; NULL where it is not there or memory ran out. Frees `text`.
 */
static char *replace(char *text, const char *old, const char *by) {
    char *at = text ? strstr(text, old) : NULL;
    char *made = at ? malloc(strlen(text) + strlen(by) + 1) : NULL;
    if (made)
        sprintf(made, "%.*s%s%s", (int)(at - text), text, by, at + strlen(old));
    free(text);
    return made;
}

/* tetra.frag, but that it keeps its depth and passes over what was peeled. The test stands before
 * the march, so that what is discarded costs no more than finding its segment. */
static char *peeling_source(uint32_t variant) {
    static const char segment[] = "    if (!(begin < end) || below)\n        discard;\n";
    char test[1024];
    snprintf(test, sizeof test,
             "%s"
             "    float middle = float(dot(FRAME_REAL(FRAME_H_ROW, 8).xyz, tetra.v0) +\n"
             "                         frame[FRAME_OU].w + 0.5 * (begin + end));\n"
             "    float depth = DEPTH_OF_T(middle, frame[FRAME_O0].w);\n"
             "    gl_FragDepth = depth;\n"
             "    if (depth >= texelFetch(peeled, ivec2(gl_FragCoord.xy), 0).r)\n"
             "        discard;\n",
             segment);
    char *text = gl_program_source(GL_PROGRAM_TETRA, variant, "frag");
    text = replace(text, "layout(early_fragment_tests) in;", "");
    text = replace(text, "flat in uint cell;",
                   "flat in uint cell;\nlayout(binding = 20) uniform sampler2D peeled;");
    return replace(text, segment, test);
}

enum status __wrap_gl_programs_get(struct gl_programs *programs, enum gl_program_id id,
                                   uint32_t variant, GLuint *program, bool *compiled,
                                   struct error *err) {
    if (!peeling.drawing || id != GL_PROGRAM_TETRA)
        return __real_gl_programs_get(programs, id, variant, program, compiled, err);
    for (size_t i = 0; i < peeling.made_count; i++)
        if (peeling.made[i].variant == variant) {
            *program = peeling.made[i].program;
            return STATUS_OK;
        }
    if (peeling.made_count == PROGRAMS_MAX)
        return error_fault(err, STATUS_TOO_COMPLEX, NULL, "too many variants to peel");
    char *vertex = gl_program_source(GL_PROGRAM_TETRA, variant, "vert");
    char *fragment = peeling_source(variant);
    enum status status =
        vertex && fragment
            ? make_program(vertex, fragment, program, err)
            : error_fault(err, STATUS_INTERNAL, NULL,
                          "shaders/tetra.frag has changed: no place in it to peel at");
    free(vertex);
    free(fragment);
    if (status != STATUS_OK)
        return status;
    peeling.made[peeling.made_count].variant = variant;
    peeling.made[peeling.made_count++].program = *program;
    return STATUS_OK;
}

/* ---- layers ---- */

static GLuint make_texture(GLenum format) {
    GLuint texture;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, format, peeling.width, peeling.height);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

static enum status make_layers(const struct gl_target *target, struct error *err) {
    if (peeling.width == target->width && peeling.height == target->height)
        return STATUS_OK;
    if (peeling.width)
        return error_fault(err, STATUS_INTERNAL, NULL, "pictures of one size alone are peeled");
    peeling.width = target->width;
    peeling.height = target->height;
    peeling.color = make_texture(GL_RGBA32F);
    for (int i = 0; i < 2; i++) {
        peeling.depth[i] = make_texture(GL_DEPTH_COMPONENT32F);
        peeling.sum[i] = make_texture(GL_RGBA32F);
        glCreateFramebuffers(1, &peeling.framebuffer[i]);
        glNamedFramebufferTexture(peeling.framebuffer[i], GL_COLOR_ATTACHMENT0, peeling.color, 0);
        glNamedFramebufferTexture(peeling.framebuffer[i], GL_DEPTH_ATTACHMENT, peeling.depth[i], 0);
        glCreateFramebuffers(1, &peeling.sum_framebuffer[i]);
        glNamedFramebufferTexture(peeling.sum_framebuffer[i], GL_COLOR_ATTACHMENT0, peeling.sum[i],
                                  0);
    }
    glCreateVertexArrays(1, &peeling.array);
    glCreateQueries(GL_ANY_SAMPLES_PASSED, 1, &peeling.query);
    enum status status = make_program(whole, composite, &peeling.composite, err);
    if (status == STATUS_OK)
        status = make_program(whole, blend, &peeling.blend, err);
    return status == STATUS_OK ? gl_check("making layers", err) : status;
}

static void draw_whole(GLuint program, GLuint sum, GLuint layer) {
    glBindTextureUnit(20, sum);
    glBindTextureUnit(21, layer);
    glUseProgram(program);
    glBindVertexArray(peeling.array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

/* Media alone; the order of `outlines` does not matter. */
enum status __wrap_cell_pass_draw(struct cell_pass *pass, struct picture *picture,
                                  const struct outlines *outlines, bool solid, struct error *err) {
    if (!peeling.on || solid || outlines->index_count == 0)
        return __real_cell_pass_draw(pass, picture, outlines, solid, err);
    static const float nothing[4] = {0, 0, 0, 0}, nearest = 1, farthest = 0;
    enum status status = make_layers(picture->target, err);
    if (status != STATUS_OK)
        return status;
    /* Nothing is peeled yet: depths run from 1 at the eye to 0. */
    glDepthMask(GL_TRUE);
    glClearNamedFramebufferfv(peeling.framebuffer[0], GL_DEPTH, 0, &nearest);
    glClearNamedFramebufferfv(peeling.sum_framebuffer[0], GL_COLOR, 0, nothing);
    int layer = 0;
    GLuint any = 1;
    while (any && layer < LAYERS_MAX && status == STATUS_OK) {
        int now = (layer + 1) & 1, before = layer & 1;
        glDepthMask(GL_TRUE); /* or clearing clears nothing */
        glBindFramebuffer(GL_FRAMEBUFFER, peeling.framebuffer[now]);
        glClearNamedFramebufferfv(peeling.framebuffer[now], GL_COLOR, 0, nothing);
        glClearNamedFramebufferfv(peeling.framebuffer[now], GL_DEPTH, 0, &farthest);
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_GREATER);
        glDisable(GL_BLEND);
        glBindTextureUnit(20, peeling.depth[before]);
        peeling.drawing = true;
        glBeginQuery(GL_ANY_SAMPLES_PASSED, peeling.query);
        status = __real_cell_pass_draw(pass, picture, outlines, solid, err);
        glEndQuery(GL_ANY_SAMPLES_PASSED);
        peeling.drawing = false;
        glGetQueryObjectuiv(peeling.query, GL_QUERY_RESULT, &any);
        glDisable(GL_DEPTH_TEST);
        glDepthMask(GL_FALSE);
        glBindFramebuffer(GL_FRAMEBUFFER, peeling.sum_framebuffer[now]);
        draw_whole(peeling.composite, peeling.sum[before], peeling.color);
        layer++;
    }
    peeling.layers = layer;
    glBindFramebuffer(GL_FRAMEBUFFER, picture->target->framebuffer);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFuncSeparate(GL_ONE, GL_SRC1_ALPHA, GL_ONE, GL_ONE);
    draw_whole(peeling.blend, peeling.sum[layer & 1], 0);
    if (status == STATUS_OK && any)
        status = error_fault(err, STATUS_TOO_COMPLEX, NULL, "more than %d layers", LAYERS_MAX);
    return status == STATUS_OK ? gl_check("peeling", err) : status;
}

/* ---- ways ---- */

static int open_files;
static const struct asset_source source = {files_open, files_close, &open_files};

static const struct way {
    const char *name;
    enum scene_order order;
    bool peels;
} ways[] = {{"sorted", SCENE_ORDER_SORTED, false},
            {"peeled", SCENE_ORDER_SORTED, true},
            {"walked", SCENE_ORDER_WALK, false}};
enum { WAYS = sizeof ways / sizeof *ways };

struct taken {
    double draw[REPEATS_MAX], sort[REPEATS_MAX], processor[REPEATS_MAX];
    struct render_result first;
    int layers;
};

static bool draw(struct renderer *renderer, struct scene *scene, const struct way *way,
                 struct render_result *result) {
    struct error err = {0};
    for (size_t i = 0; i < scene->object_count; i++) {
        scene->objects[i].quality.order = way->order;
        scene->objects[i].quality.map = SCENE_MAP_AFFINE; /* by which both orders agree */
    }
    peeling.on = way->peels;
    enum status status = renderer_render(renderer, scene, &source, result, &err);
    peeling.on = false;
    return status == STATUS_OK || bench_failed("bench_peel", way->name, &err);
}

static double rms(const struct render_result *a, const struct render_result *b) {
    size_t count = 4 * (size_t)a->width * (size_t)a->height;
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        double off = (double)a->pixels[i] - (double)b->pixels[i];
        sum += off * off;
    }
    return sqrt(sum / (double)count);
}

static bool measure(struct renderer *renderer, struct scene *scene, const char *name, int repeats) {
    static struct taken taken[WAYS];
    bool good = true;
    for (int n = -1; n < repeats && good; n++) /* the first compiles */
        for (int w = 0; w < WAYS && good; w++) {
            struct render_result result;
            if (ways[w].peels && n != 0)
                continue; /* once: minutes, of which compiling is nothing */
            double began = bench_processor_ms();
            good = draw(renderer, scene, &ways[w], &result);
            if (!good)
                break;
            taken[w].layers = ways[w].peels ? peeling.layers : 1;
            if (n >= 0) {
                taken[w].processor[n] = bench_processor_ms() - began;
                taken[w].draw[n] = result.report.stage_ms[REPORT_STAGE_draw];
                taken[w].sort[n] = result.report.stage_ms[REPORT_STAGE_sort];
            }
            if (taken[w].first.pixels)
                render_result_finish(&result);
            else
                taken[w].first = result;
        }
    for (int w = 0; w < WAYS && good; w++) {
        double off = rms(&taken[w].first, &taken[0].first);
        int runs = ways[w].peels ? 1 : repeats;
        printf("{\"scene\": \"%s\", \"way\": \"%s\", \"side\": %d, \"layers\": %d, ", name,
               ways[w].name, taken[w].first.width, taken[w].layers);
        bench_print_list("draw_ms", taken[w].draw, runs);
        bench_print_list("sort_ms", taken[w].sort, runs);
        bench_print_list("processor_ms", taken[w].processor, runs);
        printf("\"tetrahedra\": %llu, \"from_sorted_rms\": %.3g}\n",
               (unsigned long long)taken[w].first.report.work.tetrahedra, off);
        if (!(off <= (ways[w].peels ? peeled_max : walked_max))) {
            fprintf(stderr, "bench_peel: %s: %s differs from sorted by %.3g rms\n", name,
                    ways[w].name, off);
            good = false;
        }
    }
    for (int w = 0; w < WAYS; w++)
        if (taken[w].first.pixels)
            render_result_finish(&taken[w].first);
    return good;
}

int main(int argc, char **argv) {
    int repeats = argc >= 3 ? (int)strtol(argv[1], NULL, 10) : 0;
    int side = argc == 4 ? (int)strtol(argv[3], NULL, 10) : 512;
    if (argc > 4 || repeats < 1 || repeats > REPEATS_MAX || side < 1) {
        fputs("usage: bench_peel REPEATS SCENE.json [SIDE]\n", stderr);
        return 2;
    }
    struct renderer_options options = {.device = -1};
    struct renderer *renderer = NULL;
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    if (renderer_create(&options, &renderer, NULL) != STATUS_OK)
        return 1;
    bool good = bench_read_scene(argv[2], &arena, &scene, &err) == STATUS_OK ||
                bench_failed("bench_peel", argv[2], &err);
    if (good) {
        scene.image.width = scene.image.height = side;
        good = measure(renderer, &scene, argv[2], repeats);
    }
    arena_free(&arena);
    renderer_destroy(renderer);
    return good ? 0 : 1;
}
