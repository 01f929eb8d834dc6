/* Light by the moments of normals (shaders/common_moments.glsl), in the shader itself, against sums
 * over the normals: those of plates, strands and spheres, the halves of these that are seen from
 * one side, and voxels of fur and clouds. */
#include <glad/gl.h>

#include "api/embedded.h"
#include "renderer/bake/normals.h"
#include "renderer/gl/context.h"
#include "renderer/gl/target.h"
#include "tests/unit/shader_fixture.h"
#include "tests/unit/volume_fixture.h"

enum { LIGHTS = 64, NORMALS_MAX = 1 << 16, TEXELS = 5 };
static const double SHININESS = 16;

struct normals {
    size_t count;
    double n[NORMALS_MAX][3], weight[NORMALS_MAX], share[NORMALS_MAX]; /* share: of what is seen */
};
static struct normals normals;

static void add(double x, double y, double z, double weight, double share) {
    double length = sqrt(x * x + y * y + z * z);
    assert_true(normals.count < NORMALS_MAX);
    double *n = normals.n[normals.count];
    n[0] = x / length;
    n[1] = y / length;
    n[2] = z / length;
    normals.weight[normals.count] = weight;
    normals.share[normals.count++] = share;
}

/* Directions spread evenly, by the golden angle. */
static void direction(int i, int count, double out[3]) {
    double z = 1 - (2 * i + 1.0) / count, r = sqrt(1 - z * z), a = 2.399963229728653 * i;
    out[0] = r * cos(a);
    out[1] = r * sin(a);
    out[2] = z;
}

static void add_plates(void) {
    add(0.6, 0, 0.8, 1, 1);
    add(-0.6, 0, -0.8, 1, 1);
}
static void add_strand(void) {
    for (int i = 0; i < 720; i++)
        add(cos(i * M_PI / 360), sin(i * M_PI / 360), 0, 1, 1);
}
static void add_strand_seen(void) {
    for (int i = 0; i < 720; i++)
        add(cos(i * M_PI / 360), sin(i * M_PI / 360), 0, 1, fmax(cos(i * M_PI / 360), 0));
}
static void add_sphere(void) {
    for (int i = 0; i < 4000; i++) {
        double n[3];
        direction(i, 4000, n);
        add(n[0], n[1], n[2], 0.7, 1);
    }
}
static void add_sphere_seen(void) {
    for (int i = 0; i < 4000; i++) {
        double n[3];
        direction(i, 4000, n);
        add(n[0], n[1], n[2], 1, fmax(0.6 * n[0] + 0.8 * n[2], 0));
    }
}

/* All voxels, by what one loses across its own height, as high as wide. */
static void add_voxels(enum scene_builtin builtin) {
    struct volume volume = make(builtin, 1, 32, 32, 16);
    size_t count = (size_t)32 * 32 * 16;
    uint16_t *gradients = malloc(count * 4 * sizeof *gradients);
    assert_non_null(gradients);
    assert_int_equal(bake_gradients(&volume, BAKE_FIELD_MEDIUM, gradients), STATUS_OK);
    for (size_t i = 0; i < count; i++) {
        double g[3], length = 0, alpha = -expm1(-(double)volume.medium[4 * i + 3] / 16);
        for (size_t c = 0; c < 3; c++) {
            g[c] = (double)bake_float_from_half(gradients[4 * i + c]);
            length += g[c] * g[c];
        }
        if (length > 0 && alpha > 0)
            add(g[0], g[1], g[2], sqrt(length) / (sqrt(length) + 0.01), alpha);
    }
    free(gradients);
    drop(&volume);
}
static void add_fur(void) {
    add_voxels(SCENE_BUILTIN_FUR);
}
static void add_clouds(void) {
    add_voxels(SCENE_BUILTIN_CLOUDS);
}

/* What the shader is given for each light: m, M, the light, the map of normals' diagonal. */
static void fill(float texels[LIGHTS * TEXELS * 4], const double map[3]) {
    double m[3] = {0}, M[3][3] = {{0}}, all = 0;
    for (size_t k = 0; k < normals.count; k++) {
        all += normals.share[k];
        for (int i = 0; i < 3; i++) {
            m[i] += normals.share[k] * normals.weight[k] * normals.n[k][i];
            for (int j = 0; j < 3; j++)
                M[i][j] += normals.share[k] * normals.weight[k] * normals.n[k][i] * normals.n[k][j];
        }
    }
    for (int l = 0; l < LIGHTS; l++) {
        double light[3];
        direction(l, LIGHTS, light);
        const double rows[TEXELS][3] = {{m[0] / all, m[1] / all, m[2] / all},
                                        {M[0][0] / all, M[1][1] / all, M[2][2] / all},
                                        {M[0][1] / all, M[0][2] / all, M[1][2] / all},
                                        {light[0], light[1], light[2]},
                                        {map[0], map[1], map[2]}};
        for (int r = 0; r < TEXELS; r++)
            for (int i = 0; i < 3; i++)
                texels[(l * TEXELS + r) * 4 + i] = (float)rows[r][i];
    }
}

/* The sums: weight times max(n.l, 0), and its power. */
static void sum_up(int l, const double map[3], double sums[2]) {
    double light[3], all = 0;
    direction(l, LIGHTS, light);
    sums[0] = sums[1] = 0;
    for (size_t k = 0; k < normals.count; k++) {
        double n[3], length = 0, c = 0, part = normals.share[k] * normals.weight[k];
        for (int i = 0; i < 3; i++) {
            n[i] = normals.n[k][i] * map[i];
            length += n[i] * n[i];
            c += n[i] * light[i];
        }
        c = fmax(c / sqrt(length), 0);
        all += normals.share[k];
        sums[0] += part * c;
        sums[1] += part * pow(c, SHININESS);
    }
    sums[0] /= all;
    sums[1] /= all;
}

static const char *const drawn =
    "layout(binding = 0) uniform samplerBuffer given; layout(location = 0) out vec4 result;\n"
    "void main() { int i = 5 * int(gl_FragCoord.x); vec3 d = texelFetch(given, i + 4).xyz;\n"
    "float w = moments_set(texelFetch(given, i).xyz, texelFetch(given, i + 1).xyz,\n"
    "texelFetch(given, i + 2).xyz, mat3(d.x, 0, 0, 0, d.y, 0, 0, 0, d.z));\n"
    "vec3 l = texelFetch(given, i + 3).xyz;\n"
    "result = vec4(w * moments_lambert(l), w * moments_gloss(l, 16.0), 0, 1); }\n";

static void use_program(void) {
    const char *vert[] = {"#version 450 core\n", embedded_find("shaders/interface.h")->begin,
                          embedded_find("shaders/fullscreen.vert")->begin};
    const char *frag[] = {"#version 450 core\n#define VARIANT FLAG_SPECULAR\n",
                          embedded_find("shaders/interface.h")->begin,
                          embedded_find("shaders/common_moments.glsl")->begin, drawn};
    GLuint program = glCreateProgram();
    glAttachShader(program, compile(GL_VERTEX_SHADER, vert, 3));
    glAttachShader(program, compile(GL_FRAGMENT_SHADER, frag, 4));
    glLinkProgram(program);
    glUseProgram(program);
}

static void light_is_that_of_all_normals(void **state) {
    (void)state;
    struct gl_context *context;
    struct error err = {0};
    struct gl_options options = {.device = -1};
    assert_int_equal(gl_context_create(&options, &context, &err), STATUS_OK);
    struct gl_target target = {0};
    assert_int_equal(gl_target_resize(&target, LIGHTS, 1, false, &err), STATUS_OK);
    GLuint array;
    glCreateVertexArrays(1, &array);
    glBindVertexArray(array);
    use_program();
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    glViewport(0, 0, LIGHTS, 1);
    /* Bounds on the largest error over all lights, a fifth or more above what was measured; a light
     * that faces every normal gives 1. Where the map is no rotation, |D n|^2 is put as its mean. */
    static const struct {
        const char *name;
        void (*fill)(void);
        double map[3], lambert, gloss;
    } rows[] = {
        {"plates", add_plates, {1, 1, 1}, 0.003, 0.02},
        {"a strand", add_strand, {1, 1, 1}, 0.003, 0.03},
        {"a strand, seen", add_strand_seen, {1, 1, 1}, 0.018, 0.06},
        {"a sphere", add_sphere, {1, 1, 1}, 0.003, 0.003},
        {"a sphere, seen", add_sphere_seen, {1, 1, 1}, 0.012, 0.017},
        {"fur", add_fur, {1, 1, 1}, 0.018, 0.045},
        {"clouds", add_clouds, {1, 1, 1}, 0.009, 0.042},
        {"a strand, turned", add_strand, {1, 2, 1}, 0.05, 0.06},
        {"fur, twice as high", add_fur, {1, 1, 0.5}, 0.065, 0.045},
        {"clouds, half as high", add_clouds, {1, 1, 2}, 0.06, 0.045},
    };
    bool right = true;
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        static float texels[LIGHTS * TEXELS * 4], rgba[LIGHTS * 4];
        normals.count = 0;
        rows[r].fill();
        fill(texels, rows[r].map);
        GLuint buffer, texture;
        glCreateBuffers(1, &buffer);
        glNamedBufferStorage(buffer, sizeof texels, texels, 0);
        glCreateTextures(GL_TEXTURE_BUFFER, 1, &texture);
        glTextureBuffer(texture, GL_RGBA32F, buffer);
        glBindTextureUnit(0, texture);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        assert_int_equal(gl_target_read(&target, rgba, &err), STATUS_OK);
        glDeleteTextures(1, &texture);
        glDeleteBuffers(1, &buffer);
        double worst[2] = {0}, mean[2] = {0}, true_mean[2] = {0};
        for (int l = 0; l < LIGHTS; l++) {
            double sums[2];
            sum_up(l, rows[r].map, sums);
            for (int k = 0; k < 2; k++) {
                double found = (double)rgba[4 * l + k];
                worst[k] = fmax(worst[k], fabs(found - sums[k]));
                mean[k] += found / LIGHTS;
                true_mean[k] += sums[k] / LIGHTS;
            }
        }
        print_message(
            "%s: Lambert off by %.4f at most, mean %.4f of %.4f; gloss %.4f, %.4f of %.4f\n",
            rows[r].name, worst[0], mean[0], true_mean[0], worst[1], mean[1], true_mean[1]);
        right &= worst[0] < rows[r].lambert && worst[1] < rows[r].gloss;
    }
    assert_true(right);
    gl_target_finish(&target);
    gl_context_destroy(context);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(light_is_that_of_all_normals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
