/* The prisms' own map in the shaders (shaders/common_prism.glsl) against an inverse in fp64, in the
 * shader itself: random prisms, thin, narrow, tiny, huge, leaning, nearly folding; rays that lie in
 * a layer. What pictures make of it is in test_map.c. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <glad/gl.h>

#include "api/embedded.h"
#include "renderer/gl/context.h"
#include "renderer/gl/target.h"
#include "renderer/shell/prism_map.h"
#include "tests/unit/shader_fixture.h"

enum { SIDE = 64, PRISMS = SIDE * SIDE, CELLS = 3 * PRISMS };

/* ---- random prisms ---- */

struct prisms {
    struct mesh mesh;
    struct shell *shell;
    float (*map)[MAP_TEXELS][4];
};

static double uniform(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

static void unit(double v[3]) {
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* What random prisms are like: edges near `size`, triangles `narrow` times as wide as long, normals
 * that lean by about `lean` from the triangle's. */
struct kind {
    const char *name;
    double size, narrow, lean, thickness;
    bool level;       /* rays along layers of the affine map */
    double rms_most;  /* of the largest error of (b1, b2, w); twice what was measured */
    double less_than; /* the affine map's, times this */
};

static void make_prism(struct mesh *mesh, uint32_t f, const struct kind *kind, uint64_t *seed) {
    double a[3], b[3], n[3], c[3];
    for (int i = 0; i < 3; i++) {
        a[i] = uniform(seed) - 0.5;
        b[i] = uniform(seed) - 0.5;
    }
    unit(a);
    cross(a, b, n);
    unit(n);
    cross(n, a, c);
    double along[3] = {0, 1, uniform(seed)}, across[3] = {0, uniform(seed) - 0.5, 1};
    for (int k = 0; k < 3; k++) {
        /* Welded vertices in both orders, so that half of the cells are mirror images. */
        uint32_t v = 3 * f + (uint32_t)(f & 1 ? 2 - k : k);
        mesh->vertex[f][k] = v;
        for (int i = 0; i < 3; i++) {
            mesh->position[v][i] = kind->size * (along[k] * a[i] + kind->narrow * across[k] * c[i]);
            mesh->normal[v][i] = n[i] + kind->lean * (uniform(seed) - 0.5);
        }
        unit(mesh->normal[v]);
    }
}

static void make_prisms(struct prisms *prisms, const struct kind *kind) {
    struct mesh *mesh = &prisms->mesh;
    *prisms = (struct prisms){.mesh = {.triangle_count = PRISMS, .vertex_count = 3 * PRISMS}};
    mesh->position = calloc(mesh->vertex_count, sizeof *mesh->position);
    mesh->normal = calloc(mesh->vertex_count, sizeof *mesh->normal);
    mesh->vertex = calloc(PRISMS, sizeof *mesh->vertex);
    mesh->corner_uv = calloc(PRISMS, sizeof *mesh->corner_uv);
    mesh->neighbour = malloc(PRISMS * sizeof *mesh->neighbour);
    prisms->map = malloc(CELLS * sizeof *prisms->map);
    assert_true(mesh->position && mesh->normal && mesh->vertex && mesh->corner_uv &&
                mesh->neighbour && prisms->map);
    memset(mesh->neighbour, 0xff, PRISMS * sizeof *mesh->neighbour);
    uint64_t seed = 1;
    for (uint32_t f = 0; f < PRISMS; f++)
        make_prism(mesh, f, kind, &seed);
    struct error err = {0};
    const double tiles[2] = {1, 1};
    assert_int_equal(shell_build(mesh, kind->thickness, tiles, "", &prisms->shell, &err),
                     STATUS_OK);
    prism_map_fill(prisms->shell, prisms->map);
}

static void free_prisms(struct prisms *prisms) {
    free(prisms->map);
    shell_destroy(prisms->shell);
    free(prisms->mesh.position);
    free(prisms->mesh.normal);
    free(prisms->mesh.vertex);
    free(prisms->mesh.corner_uv);
    free(prisms->mesh.neighbour);
}

/* ---- the inverse in fp64 ---- */

/* dP/db1, dP/db2, dP/dw and P at q, relative to corner 0 of the prism over f. */
static void map_at(const struct shell *shell, uint32_t f, const double q[3], double d[3][3],
                   double p[3]) {
    const uint32_t *bottom = shell->tetra[3 * f], *top = shell->tetra[3 * f + 2] + 1;
    const double b[3] = {1 - q[0] - q[1], q[0], q[1]};
    for (int i = 0; i < 3; i++) {
        double layer[3], o = 0;
        for (int k = 0; k < 3; k++) {
            double offset = shell->position[top[k]][i] - shell->position[bottom[k]][i];
            layer[k] =
                shell->position[bottom[k]][i] - shell->position[bottom[0]][i] + q[2] * offset;
            o += b[k] * offset;
        }
        d[0][i] = layer[1] - layer[0];
        d[1][i] = layer[2] - layer[0];
        d[2][i] = o;
        p[i] = b[0] * layer[0] + b[1] * layer[1] + b[2] * layer[2];
    }
}

static void solve(const double d[3][3], const double r[3], double out[3]) {
    double c[3][3], det = 0;
    for (int k = 0; k < 3; k++)
        cross(d[(k + 1) % 3], d[(k + 2) % 3], c[k]);
    for (int i = 0; i < 3; i++)
        det += d[0][i] * c[0][i];
    for (int k = 0; k < 3; k++)
        out[k] = (c[k][0] * r[0] + c[k][1] * r[1] + c[k][2] * r[2]) / det;
}

/* Damped Newton from the guess in q; false where it does not arrive at a point of the prism or
 * close by: the prism folds there. */
static bool invert(const struct shell *shell, uint32_t f, const double x[3], double q[3]) {
    double size = 1;
    for (int round = 0; round < 100 && size > 1e-9; round++) {
        double d[3][3], p[3], r[3], step[3];
        map_at(shell, f, q, d, p);
        for (int i = 0; i < 3; i++)
            r[i] = x[i] - p[i];
        solve((const double(*)[3])d, r, step);
        size = fmax(fabs(step[0]), fmax(fabs(step[1]), fabs(step[2])));
        for (int k = 0; k < 3; k++)
            q[k] += step[k] * fmin(1, 0.3 / size);
    }
    return size <= 1e-9 && q[0] > -0.25 && q[0] < 1.25 && q[1] > -0.25 && q[1] < 1.25 &&
           q[2] > -1e-6 && q[2] < 1 + 1e-6;
}

/* ---- the shader ---- */

/* Four samples along a segment of each prism's cell number `which`; the last one's (b1, b2, w), f.
 */
static const char lookup[] =
    "layout(binding = 0) uniform samplerBuffer ways;\n"
    "layout(location = 0) uniform uint which;\n"
    "layout(location = 0) out vec4 result;\n"
    "void main() {\n"
    "    uint cell = (uint(gl_FragCoord.y) * 64u + uint(gl_FragCoord.x)) * 3u + which;\n"
    "    int at = int(cell) * 2;\n"
    "    Way way = way_begin(cell, vec2(0.0), texelFetch(ways, at).xyz, texelFetch(ways, at + "
    "1).xyz);\n"
    "    float i = 0.5;\n"
    "    do { way_at(way, i / 4.0); } while ((i += 1.0) < 4.0);\n"
    "    result = vec4(way_here(way), way.f);\n"
    "}\n";

struct lookup {
    struct gl_context *context;
    struct gl_target target;
    GLuint program, array;
};

static int open_gl(void **state) {
    static struct lookup gl;
    struct error err = {0};
    struct gl_options options = {.device = -1};
    assert_int_equal(gl_context_create(&options, &gl.context, &err), STATUS_OK);
    assert_int_equal(gl_target_resize(&gl.target, SIDE, SIDE, false, &err), STATUS_OK);
    glCreateVertexArrays(1, &gl.array);
    char head[64];
    snprintf(head, sizeof head, "#version 450 core\n#define VARIANT 0x%x\n",
             FLAG_EXACT | FLAG_MEDIUM);
    const char *interface = embedded_find("shaders/interface.h")->begin;
    const char *vert[] = {head, interface, embedded_find("shaders/fullscreen.vert")->begin};
    const char *frag[] = {head, interface, embedded_find("shaders/common_frame.glsl")->begin,
                          embedded_find("shaders/common_prism.glsl")->begin, lookup};
    gl.program = glCreateProgram();
    glAttachShader(gl.program, compile(GL_VERTEX_SHADER, vert, 3));
    glAttachShader(gl.program, compile(GL_FRAGMENT_SHADER, frag, 5));
    glLinkProgram(gl.program);
    *state = &gl;
    return 0;
}

static int close_gl(void **state) {
    struct lookup *gl = *state;
    glDeleteProgram(gl->program);
    glDeleteVertexArrays(1, &gl->array);
    gl_target_finish(&gl->target);
    gl_context_destroy(gl->context);
    return 0;
}

static GLuint table(GLuint unit_number, const void *data, size_t bytes, GLuint *buffer) {
    GLuint texture;
    glCreateBuffers(1, buffer);
    glNamedBufferStorage(*buffer, (GLsizeiptr)bytes, data, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &texture);
    glTextureBuffer(texture, GL_RGBA32F, *buffer);
    glBindTextureUnit(unit_number, texture);
    return texture;
}

static void draw(struct lookup *gl, uint32_t which, float *rgba) {
    struct error err = {0};
    glUseProgram(gl->program);
    glProgramUniform1ui(gl->program, 0, which);
    glBindVertexArray(gl->array);
    glBindFramebuffer(GL_FRAMEBUFFER, gl->target.framebuffer);
    glViewport(0, 0, SIDE, SIDE);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    assert_int_equal(gl_target_read(&gl->target, rgba, &err), STATUS_OK);
}

/* From a face of the cell to another: coordinates of v1..v3, and their change. */
static void make_way(float way[2][4], bool level, uint64_t *seed) {
    double end[2][4];
    for (int e = 0; e < 2; e++) {
        double sum = 0;
        int zero = (int)(4 * uniform(seed));
        for (int k = 0; k < 4; k++) {
            end[e][k] = k == zero ? 0 : -log(1 - uniform(seed));
            sum += end[e][k];
        }
        for (int k = 0; k < 4; k++)
            end[e][k] /= sum;
    }
    for (int k = 1; k < 4 && level; k++) /* w is lambda_3 in the first cell */
        end[1][k] = k == 3 ? end[0][3] : end[1][k] * (1 - end[0][3]);
    for (int k = 0; k < 3; k++) {
        way[0][k] = (float)end[0][k + 1];
        way[1][k] = (float)(end[1][k + 1] - end[0][k + 1]);
    }
}

/* The affine map of cell `which` of a prism at the coordinates l of v1..v3: shell.h. */
static void affine(int which, const double l[3], double q[3]) {
    static const int vertex[3][4][3] = {/* (b1, b2, w) of v0..v3 */
                                        {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 1}},
                                        {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 1, 1}},
                                        {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}};
    for (int i = 0; i < 3; i++)
        q[i] = l[0] * vertex[which][1][i] + l[1] * vertex[which][2][i] + l[2] * vertex[which][3][i];
}

struct sums {
    double exact, affine;
    int count, lost;
};

static void compare(const struct shell *shell, uint32_t f, int which, const float way[2][4],
                    const float *found, struct sums *sums) {
    const uint32_t *v = shell->tetra[3 * f + (uint32_t)which];
    double l[3], x[3] = {0, 0, 0}, guess[3], q[3], exact = 0, by_affine = 0;
    for (int k = 0; k < 3; k++)
        l[k] = way[0][k] + (double)found[3] * way[1][k];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            x[i] += l[k] * (shell->position[v[k + 1]][i] - shell->position[v[0]][i]);
    affine(which, l, guess);
    memcpy(q, guess, sizeof q);
    if (!invert(shell, f, x, q)) {
        sums->lost++;
        return;
    }
    for (int k = 0; k < 3; k++) {
        exact = fmax(exact, fabs(found[k] - q[k]));
        by_affine = fmax(by_affine, fabs(guess[k] - q[k]));
    }
    sums->exact += exact * exact;
    sums->affine += by_affine * by_affine;
    sums->count++;
}

static void check(struct lookup *gl, const struct kind *kind) {
    struct prisms prisms;
    make_prisms(&prisms, kind);
    float(*ways)[2][4] = calloc(CELLS, sizeof *ways);
    assert_non_null(ways);
    uint64_t seed = 7;
    for (uint32_t c = 0; c < CELLS; c++)
        make_way(ways[c], kind->level, &seed);
    GLuint buffers[2], textures[2];
    textures[0] = table(0, ways, CELLS * sizeof *ways, &buffers[0]);
    textures[1] = table(BINDING_MAPS, prisms.map, CELLS * sizeof *prisms.map, &buffers[1]);
    struct sums sums = {0};
    static float rgba[PRISMS * 4];
    for (int which = 0; which < (kind->level ? 1 : 3); which++) {
        draw(gl, (uint32_t)which, rgba);
        for (uint32_t f = 0; f < PRISMS; f++) /* the top row comes first */
            compare(prisms.shell, f, which, (const float(*)[4])ways[3 * f + (uint32_t)which],
                    rgba + 4 * ((SIDE - 1 - f / SIDE) * SIDE + f % SIDE), &sums);
    }
    double rms = sqrt(sums.exact / sums.count), rms_affine = sqrt(sums.affine / sums.count);
    print_message("%-22s RMS %.1e (affine %.1e); folded %d, left affine %d of %d prisms\n",
                  kind->name, rms, rms_affine, (int)prisms.shell->diagnosis.folded,
                  (int)prisms.shell->diagnosis.uneven, PRISMS);
    assert_true(sums.lost < sums.count / 50);
    assert_true(rms < kind->rms_most);
    assert_true(rms < kind->less_than * rms_affine);
    glDeleteTextures(2, textures);
    glDeleteBuffers(2, buffers);
    free(ways);
    free_prisms(&prisms);
}

static void test_inverse(void **state) {
    static const struct kind kinds[] = {
        {"everyday", 1, 1, 0.2, 0.3, false, 8e-8, 1e-3},
        {"along layers", 1, 1, 0.2, 0.3, true, 6e-8, 1e-3},
        {"leaning, some fold", 1, 1, 1, 1, false, 1.2e-3, 0.02},
        {"columns", 1, 1, 0.3, 5, false, 1.4e-2, 0.12},
        {"slivers", 1, 0.001, 0.3, 0.001, false, 1.1e-6, 1e-3},
        {"thin as 1e-6 edges", 1, 1, 0.3, 1e-6, false, 7e-8, 1e-3},
        {"a millionth in size", 1e-6, 1, 0.3, 3e-7, false, 1.8e-7, 1e-3},
        {"a million in size", 1e6, 1, 0.3, 3e5, false, 1.8e-7, 1e-3},
    };
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        check(*state, &kinds[i]);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_inverse)};
    return cmocka_run_group_tests(tests, open_gl, close_gl);
}
