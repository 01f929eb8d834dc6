/* The plan, held to what each scene needs: what is drawn and what is left out, which branches of
 * the shaders are compiled in, and that what is left out would not have changed the picture. */
#include "tests/support.h"

#include <math.h>

#include "renderer/force.h"
#include "renderer/gl/program.h"
#include "tests/unit/asset_files.h"

/* Every row of the plan. */
static const char *const parts[] = {
    "surface",       "entries",       "solid",        "sort",          "exact-map",
    "slices",        "overlap",       "media",        "resolve",       "trials",
    "error",         "supersampling", "depth",        "occluded",      "voxels",
    "closed-form",   "cells",         "eye-inside",   "fp64",          "light",
    "ambient",       "shadow",        "specular",     "gradients",     "shadow-map",
    "shadow-slices", "point-lights",  "mesh-normals", "base-textures", "OpenImageIO",
    "tinygltf",      "filter",        "leap",         "far-solids",    "strands",
    "fill",          "nearest-first", "cycles",       "folds",         "shadow-colors",
    "tint"};
enum { PART_COUNT = sizeof parts / sizeof *parts };

#define VIEW(samples, beside)                                                                      \
    "{'image': {'width': 24, 'height': 24, 'samples': " samples "}, " beside "'objects': ["
#define ONE  VIEW("1", "")
#define TWO  VIEW("1", "'lights': [{'direction': [1, 1, -1]}, {'direction': [-1, 1, -1]}], ")
#define CAST VIEW("1", "'lights': [{'shadow': true}], ")
#define DIM  VIEW("1", "'lights': [], 'ambient': [1, 1, 1], ")
#define FAR  VIEW("1", "'camera': {'eye': [0, -60, 0], 'fov_y_deg': 3}, ")
#define SHELL(mesh, material, beside)                                                              \
    "{'shell': {'mesh': {" mesh "}, 'material': {" material "}" beside "}"
#define SPHERE "'shape': 'sphere', 'divisions': [12, 6]"
#define TORUS  "'shape': 'torus'"
#define CHAIN  "'builtin': 'chain', 'size': [16, 16, 8]"
#define FUR    "'builtin': 'fur', 'size': [16, 16, 8]"
#define MIST   "'builtin': 'homogeneous', 'extinction': 2, 'color': [0.2, 0.4, 0.8]"
#define HAIR   FUR ", 'shading': 'kajiya-kay'"
#define SORTED ", 'quality': {'order': 'sorted'}"
#define TETRA  ", 'path': 'tetra'"
#define SLABS  ", 'quality': {'slices': 9}"
#define HYBRID ", 'quality': {'slices': 9, 'method': 'hybrid'}"
#define END    "}]}"

struct row {
    const char *json;
    const char *in;       /* parts of `passes`, in order; all others are left out */
    const char *variants; /* programs and flags, in the order in which they are compiled */
};

static const struct row rows[] = {
    {ONE SHELL(SPHERE, CHAIN, "") END,
     "entries solid exact-map resolve voxels leap light gradients",
     "WALK:solid+lit+exact+leap+dda RESOLVE:"},
    {VIEW("4", "") SHELL(SPHERE, CHAIN, "") END,
     "entries solid exact-map resolve supersampling voxels leap light gradients",
     "WALK:solid+lit+exact+leap+dda RESOLVE:"},
    {DIM SHELL(SPHERE, CHAIN, "") END, "entries solid exact-map resolve voxels leap ambient",
     "WALK:solid+ambient+exact+leap+dda RESOLVE:"},
    {VIEW("1", "'report': {'error': 'estimate'}, ") SHELL(SPHERE, FUR ", 'lit': false", "") END,
     "entries exact-map media resolve error voxels", "WALK:medium+exact RESOLVE: RESOLVE:blocks"},
    {ONE SHELL(SPHERE, CHAIN ", 'lit': false", "") END,
     "entries solid exact-map resolve voxels leap", "WALK:solid+exact+leap+dda RESOLVE:"},
    {ONE SHELL(SPHERE, CHAIN ", 'specular': 1", "") END,
     "entries solid exact-map resolve voxels leap light specular gradients",
     "WALK:solid+lit+specular+exact+leap+dda RESOLVE:"},
    {DIM SHELL(SPHERE, CHAIN ", 'specular': 1", "") END,
     "entries solid exact-map resolve voxels leap ambient",
     "WALK:solid+ambient+exact+leap+dda RESOLVE:"},
    {ONE SHELL(SPHERE, CHAIN ", 'lit': false", "") SORTED END,
     "solid exact-map resolve depth voxels leap cells", "TETRA:solid+exact+leap+dda RESOLVE:"},
    {ONE SHELL(SPHERE, CHAIN ", 'lit': false", "") "}, " SHELL(SPHERE, CHAIN ", 'lit': false", "")
         END,
     "entries solid exact-map resolve depth voxels leap", "WALK:solid+exact+leap+dda RESOLVE:"},
    {ONE SHELL(SPHERE, FUR, "") END, "entries exact-map media resolve voxels light gradients",
     "WALK:medium+lit+exact RESOLVE:"},
    {TWO SHELL(SPHERE, FUR, "") END, "entries exact-map media resolve voxels light gradients",
     "WALK:medium+lit+lights+exact RESOLVE:"},
    {ONE SHELL(SPHERE, FUR ", 'lit': false", "") END, "entries exact-map media resolve voxels",
     "WALK:medium+exact RESOLVE:"},
    {DIM SHELL(SPHERE, FUR, "") END, "entries exact-map media resolve voxels ambient",
     "WALK:medium+ambient+exact RESOLVE:"},
    {ONE SHELL(SPHERE, FUR ", 'lit': false", ", 'base': {'color': [1, 0, 0]}") END,
     "surface entries exact-map media resolve depth occluded voxels light mesh-normals",
     "WALK:medium+occluded+exact SURFACE:lit RESOLVE:"},
    {DIM SHELL(SPHERE, FUR ", 'lit': false", ", 'base': {'color': [1, 0, 0]}") SORTED END,
     "surface sort exact-map media resolve depth occluded voxels cells ambient",
     "TETRA:medium+occluded+exact SURFACE:ambient RESOLVE:"},
    /* Sides of a sphere's prisms are plane, a torus's are not. */
    {ONE SHELL(SPHERE, FUR ", 'lit': false", "") SORTED END,
     "sort exact-map media resolve voxels cells", "TETRA:medium+exact RESOLVE:"},
    {ONE SHELL(TORUS, FUR ", 'lit': false", "") SORTED END,
     "sort exact-map media resolve voxels cells", "TETRA:medium+exact+ruled RESOLVE:"},
    {ONE SHELL(SPHERE, FUR ", 'lit': false, 'glow': 1", "") END,
     "entries exact-map media resolve voxels fill", "WALK:medium+exact+fill RESOLVE:"},
    {CAST SHELL(SPHERE, FUR ", 'absorption': 1", "") END,
     "entries exact-map media resolve voxels fill light shadow shadow-slices gradients",
     "CASTER:medium+exact+fill CASTER_RANGE: WALK:medium+lit+exact+dimmed+fill "
     "RESOLVE:"},
    {ONE SHELL(SPHERE, MIST ", 'absorption': 1, 'emission': [1, 0, 0]", "") END,
     "entries media resolve closed-form", "WALK:homogeneous RESOLVE:"},
    {ONE SHELL(SPHERE, MIST ", 'extinction_color': [1, 1, 0.5]", "") END,
     "entries media resolve tint closed-form", "WALK:homogeneous+tint RESOLVE:tint"},
    {ONE SHELL(SPHERE, MIST ", 'extinction_color': [1, 1, 1], 'absorption': 0", "") END,
     "entries media resolve closed-form", "WALK:homogeneous RESOLVE:"},
    {ONE SHELL(SPHERE, HAIR, "") END, "entries exact-map media resolve voxels light strands",
     "WALK:medium+lit+exact+strands RESOLVE:"},
    {ONE SHELL(SPHERE, HAIR, "") SORTED END,
     "sort exact-map media resolve voxels cells light strands",
     "TETRA:medium+lit+exact+strands RESOLVE:"},
    {ONE SHELL(SPHERE, HAIR ", 'lit': false", "") END, "entries exact-map media resolve voxels",
     "WALK:medium+exact RESOLVE:"},
    {DIM SHELL(SPHERE, HAIR, "") END, "entries exact-map media resolve voxels ambient",
     "WALK:medium+ambient+exact RESOLVE:"},
    {ONE SHELL(SPHERE, HAIR, "") "}, " SHELL(SPHERE, FUR, "") END,
     "entries exact-map media resolve voxels light gradients strands overlap",
     "OVERLAP:lit+exact+strands RESOLVE:"},
    {ONE SHELL(SPHERE, "'builtin': 'trees', 'size': [16, 16, 8], 'shading': 'kajiya-kay'", "") END,
     "entries solid exact-map media resolve depth occluded voxels leap light gradients strands",
     "WALK:medium+lit+occluded+exact+strands WALK:solid+lit+exact+leap+dda RESOLVE:"},
    {ONE SHELL(SPHERE, MIST, "") END, "entries media resolve closed-form",
     "WALK:homogeneous RESOLVE:"},
    {ONE SHELL(SPHERE, MIST, "") SORTED END, "sort media resolve closed-form cells",
     "TETRA:homogeneous RESOLVE:"},
    {VIEW("1", "'camera': {'eye': [0, 0, 0], 'target': [1, 0, 0]}, ") SHELL(SPHERE, MIST, "")
         SORTED END,
     "sort media resolve closed-form cells eye-inside", "TETRA:homogeneous+eye RESOLVE:"},
    {VIEW("1", "'camera': {'eye': [0, 0, 0], 'target': [1, 0, 0]}, ") SHELL(SPHERE, MIST, "") END,
     "entries media resolve closed-form", "WALK:homogeneous RESOLVE:"},
    {ONE SHELL(SPHERE, MIST, ", 'thickness': 1e-5") END, "entries media resolve closed-form fp64",
     "WALK:homogeneous+fp64 RESOLVE:"},
    {ONE SHELL(SPHERE, MIST, ", 'thickness': 1e-5") SORTED END,
     "sort media resolve closed-form cells fp64", "TETRA:homogeneous+fp64 RESOLVE:"},
    {ONE SHELL(SPHERE, MIST, "") "}, " SHELL(SPHERE, MIST, "") END,
     "entries media resolve closed-form overlap", "OVERLAP: RESOLVE:"},
    {ONE SHELL(SPHERE, MIST, "") "}, " SHELL(SPHERE, MIST, "") SORTED END,
     "sort media resolve closed-form cells", "TETRA:homogeneous RESOLVE:"},
    {ONE SHELL(SPHERE, MIST, "") "}, " SHELL(SPHERE, FUR, ", 'base': {'color': [1, 0, 0]}") END,
     "surface entries exact-map media resolve depth occluded voxels closed-form light gradients "
     "mesh-normals overlap",
     "OVERLAP:lit+occluded+exact SURFACE:lit RESOLVE:"},
    {ONE SHELL(SPHERE, "'builtin': 'homogeneous', 'extinction': 0", "") END, "resolve", "RESOLVE:"},
    {ONE SHELL(SPHERE, "'builtin': 'homogeneous', 'extinction': 0", "") SLABS END, "resolve",
     "RESOLVE:"},
    {ONE SHELL(SPHERE, FUR, "") SLABS END,
     "exact-map slices media resolve voxels cells light gradients",
     "SLABS:medium+lit+exact RESOLVE:"},
    {ONE SHELL(SPHERE, CHAIN ", 'lit': false", "") SLABS END,
     "solid exact-map slices resolve depth voxels cells", "SLABS:solid+exact RESOLVE:"},
    {VIEW("1", "'camera': {'eye': [0, 0, 0], 'target': [1, 0, 0]}, ") SHELL(SPHERE, MIST, "")
         SLABS END,
     "slices media resolve closed-form cells", "SLABS:homogeneous RESOLVE:"},
    {DIM SHELL(SPHERE, FUR ", 'lit': false", ", 'base': {'color': [1, 0, 0]}") SLABS END,
     "surface exact-map slices media resolve depth occluded voxels cells ambient",
     "SLABS:medium+occluded+exact SURFACE:ambient RESOLVE:"},
    {DIM SHELL(SPHERE, FUR ", 'lit': false", ", 'base': {'color': [1, 0, 0]}") HYBRID END,
     "surface slices media resolve depth occluded voxels cells ambient",
     "SLICES_HYBRID:medium SURFACE:ambient RESOLVE:"},
    {ONE SHELL(SPHERE, FUR,
               "") ", 'quality': {'slices': 9, 'method': 'hardware', 'map': 'exact'}" END,
     "exact-map slices media resolve voxels cells light gradients",
     "SLICES_HARDWARE:medium+lit+exact RESOLVE:"},
    {FAR SHELL(SPHERE, FUR, "") ", 'quality': {'filter': 'none'}" END,
     "entries exact-map media resolve voxels light gradients", "WALK:medium+lit+exact RESOLVE:"},
    {FAR SHELL(SPHERE, FUR, "") ", 'quality': {'filter': 'mip'}" END,
     "entries exact-map media resolve voxels filter light gradients",
     "WALK:medium+lit+exact+filter RESOLVE:"},
    {FAR SHELL(SPHERE, FUR ", 'lit': false", "") ", 'quality': {'filter': 'view'}" END,
     "entries exact-map media resolve voxels filter", "WALK:medium+exact+filter+view RESOLVE:"},
    {FAR SHELL(SPHERE, CHAIN ", 'lit': false", "") ", 'quality': {'filter': 'mip'}" END,
     "entries exact-map media resolve voxels filter far-solids",
     "WALK:medium+exact+filter RESOLVE:"},
    {FAR SHELL(SPHERE, MIST, "") ", 'quality': {'filter': 'view'}" END,
     "entries media resolve closed-form", "WALK:homogeneous RESOLVE:"},
    {ONE "{'mesh': {" SPHERE "}" END, "surface resolve depth light mesh-normals",
     "SURFACE:lit RESOLVE:"},
    {CAST "{'mesh': {" SPHERE "}" END, "surface resolve depth light shadow shadow-map mesh-normals",
     "CASTER_SURFACE: SURFACE:lit+hidden RESOLVE:"},
    {VIEW("1", "'lights': [{'position': [0, 0, 3]}], ") "{'mesh': {" SPHERE "}" END,
     "surface resolve depth light point-lights mesh-normals", "SURFACE:lit+point RESOLVE:"},
    {VIEW("1", "'lights': [{'position': [0, 0, 3], 'shadow': true}], ") "{'mesh': {" SPHERE "}" END,
     "surface resolve depth light shadow shadow-map point-lights mesh-normals",
     "CASTER_SURFACE: SURFACE:lit+hidden+point RESOLVE:"},
    {CAST SHELL(SPHERE, CHAIN, "") END,
     "entries solid exact-map resolve voxels leap light shadow shadow-map gradients",
     "CASTER:solid+lit+exact+leap+dda WALK:solid+lit+exact+hidden+leap+dda RESOLVE:"},
    {CAST SHELL(SPHERE, FUR, "") END,
     "entries exact-map media resolve voxels light shadow shadow-slices gradients",
     "CASTER:medium+exact CASTER_RANGE: WALK:medium+lit+exact+dimmed RESOLVE:"},
    {CAST SHELL(SPHERE, FUR ", 'extinction_color': [1, 1, 0.5]", "") END,
     "entries exact-map media resolve voxels tint light shadow shadow-slices shadow-colors "
     "gradients",
     "CASTER:medium+exact CASTER_RANGE: WALK:medium+lit+exact+dimmed+tint+tinted RESOLVE:tint"},
    {CAST "{'mesh': {" SPHERE "}}, " SHELL(SPHERE, MIST ", 'extinction_color': [1, 1, 0.5]",
                                           "") "}, " SHELL(SPHERE, MIST, "") END,
     "surface entries media resolve depth occluded tint closed-form light shadow shadow-map "
     "shadow-slices shadow-colors mesh-normals overlap",
     "CASTER:homogeneous+occluded+channels CASTER_SURFACE: CASTER_RANGE:occluded "
     "OVERLAP:occluded+tint "
     "SURFACE:lit+hidden+dimmed+channels RESOLVE:"},
    {CAST SHELL(SPHERE, MIST, "") END, "entries media resolve closed-form",
     "WALK:homogeneous RESOLVE:"},
    {VIEW("1", "'lights': [{'shadow': true, 'color': [0, 0, 0]}], ") "{'mesh': {" SPHERE "}" END,
     "surface resolve depth light mesh-normals", "SURFACE:lit RESOLVE:"},
    {DIM "{'mesh': {" SPHERE "}" END, "surface resolve depth ambient", "SURFACE:ambient RESOLVE:"},
    {DIM "{'mesh': {'asset': 'tests/data/gltf/plain.glb'}" END,
     "surface resolve depth ambient tinygltf", "SURFACE:ambient RESOLVE:"},
    {DIM "{'mesh': {'asset': 'tests/data/gltf/texture_transform.glb'}" END,
     "surface resolve depth ambient base-textures OpenImageIO tinygltf",
     "SURFACE:ambient+textured RESOLVE:"},
    {DIM "{'mesh': {'asset': 'tests/data/gltf/texture_transform.glb'}, 'color': [1, 0, 0]" END,
     "surface resolve depth ambient tinygltf", "SURFACE:ambient RESOLVE:"},
    {ONE SHELL(
         SPHERE,
         "'height': 'api/examples/assets/pebbles-height.png', 'size': [16, 16, 8], 'lit': false",
         "") END,
     "entries solid exact-map resolve voxels leap OpenImageIO",
     "WALK:solid+exact+leap+dda RESOLVE:"},
};

static enum status draw(struct renderer *renderer, const char *json, struct render_result *result) {
    char *copy = strdup(json);
    assert_non_null(copy);
    int open = 0;
    struct asset_source source = {files_open, files_close, &open};
    enum status status = support_draw_json(renderer, &source, copy, result);
    free(copy);
    assert_int_equal(open, 0);
    return status;
}

static void append(char *text, size_t size, const char *word, const char *before) {
    size_t length = strlen(text);
    int more = snprintf(text + length, size - length, "%s%s", length ? before : "", word);
    assert_true(more >= 0 && (size_t)more < size - length);
}

/* The programs compiled from index `from` on, as in struct row. */
static void list_variants(const struct renderer *renderer, size_t from, char *text, size_t size) {
    static const struct {
        uint32_t flag;
        const char *name;
    } names[] = {{FLAG_MEDIUM, "medium"},
                 {FLAG_SOLID, "solid"},
                 {FLAG_HOMOGENEOUS, "homogeneous"},
                 {FLAG_LIT, "lit"},
                 {FLAG_LIGHTS, "lights"},
                 {FLAG_AMBIENT, "ambient"},
                 {FLAG_SPECULAR, "specular"},
                 {FLAG_OCCLUDED, "occluded"},
                 {FLAG_EYE_INSIDE, "eye"},
                 {FLAG_EXACT, "exact"},
                 {FLAG_TEXTURED, "textured"},
                 {FLAG_BLOCKS, "blocks"},
                 {FLAG_FP64, "fp64"},
                 {FLAG_SHADOW_OPAQUE, "hidden"},
                 {FLAG_SHADOW_MEDIA, "dimmed"},
                 {FLAG_POINT, "point"},
                 {FLAG_STRANDS, "strands"},
                 {FLAG_FILL, "fill"},
                 {FLAG_TINT, "tint"},
                 {FLAG_SHADOW_TINT, "tinted"},
                 {FLAG_SHADOW_CHANNELS, "channels"},
                 {FLAG_FILTER, "filter"},
                 {FLAG_FILTER_VIEW, "view"},
                 {FLAG_LEAP, "leap"},
                 {FLAG_DDA, "dda"},
                 {FLAG_RULED, "ruled"},
                 {FLAG_FOLDS, "folds"}};
    const char *program;
    uint32_t variant;
    *text = 0;
    for (size_t i = from; renderer_variant(renderer, i, &program, &variant); i++) {
        char flags[128] = "";
        for (size_t f = 0; f < sizeof names / sizeof *names; f++)
            if (variant & names[f].flag) {
                append(flags, sizeof flags, names[f].name, "+");
                variant &= ~names[f].flag;
            }
        assert_int_equal(variant, 0);
        append(text, size, program, " ");
        append(text, size, ":", "");
        append(text, size, flags, "");
    }
}

static void test_each_scene_takes_what_it_needs(void **state) {
    (void)state;
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct renderer *renderer = support_renderer(); /* has compiled nothing */
        struct render_result result;
        assert_int_equal(draw(renderer, rows[r].json, &result), STATUS_OK);
        const struct report *report = &result.report;
        char in[512] = "", variants[256];
        int told[PART_COUNT] = {0};
        for (size_t i = 0; i < report->pass_count + report->left_out_count; i++) {
            bool is_in = i < report->pass_count;
            const struct report_pass *part =
                is_in ? &report->passes[i] : &report->left_out[i - report->pass_count];
            int known = 0;
            while (known < PART_COUNT && strcmp(parts[known], part->name) != 0)
                known++;
            if (known == PART_COUNT)
                fail_msg("row %zu: the plan tells of %s, which this test does not know", r,
                         part->name);
            told[known]++;
            assert_true(part->why[0]);
            if (is_in)
                append(in, sizeof in, part->name, " ");
        }
        for (int i = 0; i < PART_COUNT; i++)
            if (told[i] != 1)
                fail_msg("row %zu: the plan tells of %s %d times", r, parts[i], told[i]);
        list_variants(renderer, 0, variants, sizeof variants);
        if (strcmp(in, rows[r].in) != 0 || strcmp(variants, rows[r].variants) != 0)
            fail_msg("row %zu: %s\n  plan     %s\n  expected %s\n  variants %s\n  expected %s", r,
                     rows[r].json, in, rows[r].in, variants, rows[r].variants);
        render_result_finish(&result);
        renderer_destroy(renderer);
    }
}

static double largest_difference(const struct render_result *a, const struct render_result *b) {
    double worst = 0;
    assert_int_equal(a->width * a->height, b->width * b->height);
    for (int i = 0; i < 4 * a->width * a->height; i++)
        worst = fmax(worst, fabs((double)a->pixels[i] - (double)b->pixels[i]));
    return worst;
}

/* What is left out, put in: it is there, and changes nothing but by what `most` allows: nothing,
 * the rounding of sums in another order, or for a walk against sorted cells what ends rays early.
 */
static void test_what_is_left_out_changes_nothing(void **state) {
    (void)state;
    static const struct {
        const char *json;
        uint32_t force;
        const char *variants; /* compiled for it */
        double most;
    } forced[] = {
        {DIM SHELL(SPHERE, FUR, "") END, FORCE_LIGHT, "WALK:medium+lit+exact", 0},
        {DIM SHELL(SPHERE, CHAIN, "") END, FORCE_LIGHT, "WALK:solid+lit+exact+leap+dda", 0},
        {DIM SHELL(SPHERE, CHAIN ", 'lit': false", "") SORTED END, FORCE_LIGHT,
         "TETRA:solid+lit+exact+leap+dda", 0},
        {DIM "{'mesh': {" SPHERE "}" END, FORCE_LIGHT, "SURFACE:lit", 0},
        {DIM "{'mesh': {" SPHERE "}" END, FORCE_TEXTURED, "SURFACE:ambient+textured", 0},
        {ONE SHELL(SPHERE, FUR, "") END, FORCE_SPECULAR, "WALK:medium+lit+specular+exact", 0},
        {ONE SHELL(SPHERE, CHAIN, "") SORTED END, FORCE_SPECULAR,
         "TETRA:solid+lit+specular+exact+leap+dda", 0},
        {ONE SHELL(SPHERE, FUR, "") END, FORCE_OCCLUDED, "WALK:medium+lit+occluded+exact", 0},
        {ONE SHELL(SPHERE, MIST, "") SORTED END, FORCE_OCCLUDED, "TETRA:homogeneous+occluded", 0},
        {ONE SHELL(SPHERE, MIST, "") SORTED END, FORCE_EYE_INSIDE, "TETRA:homogeneous+eye", 0},
        {ONE SHELL(SPHERE, CHAIN, "") SORTED END, FORCE_EYE_INSIDE,
         "TETRA:solid+lit+eye+exact+leap+dda", 0},
        {ONE SHELL(SPHERE, CHAIN, "") END, FORCE_DEPTH, "", 0},
        {ONE SHELL(SPHERE, CHAIN, "") END, FORCE_MEDIUM, "WALK:medium+lit+occluded+exact", 0},
        {ONE SHELL(SPHERE, CHAIN, "") SORTED END, FORCE_MEDIUM, "TETRA:medium+lit+occluded+exact",
         0},
        {ONE SHELL(SPHERE, FUR, "") END, FORCE_SOLID,
         "WALK:medium+lit+occluded+exact WALK:solid+lit+exact+leap+dda", 0},
        {ONE SHELL(SPHERE, FUR, "") END, FORCE_SHADOW,
         "CASTER:medium+exact CASTER_RANGE: WALK:medium+lit+exact+dimmed", 0},
        {ONE "{'mesh': {" SPHERE "}" END, FORCE_SHADOW, "CASTER_SURFACE: SURFACE:lit+hidden", 0},
        {ONE SHELL(SPHERE, MIST, "") END, FORCE_VOXELS, "WALK:medium+exact", 2e-6},
        {ONE SHELL(SPHERE, MIST, "") TETRA END, FORCE_SORT, "TETRA:homogeneous", 2e-5},
    };
    for (size_t r = 0; r < sizeof forced / sizeof *forced; r++) {
        struct renderer *renderer = support_renderer();
        struct render_result as_planned, with_more;
        const char *program;
        uint32_t variant;
        char variants[256];
        size_t compiled = 0;
        assert_int_equal(draw(renderer, forced[r].json, &as_planned), STATUS_OK);
        while (renderer_variant(renderer, compiled, &program, &variant))
            compiled++;
        renderer_force(renderer, forced[r].force);
        assert_int_equal(draw(renderer, forced[r].json, &with_more), STATUS_OK);
        list_variants(renderer, compiled, variants, sizeof variants);
        assert_string_equal(variants, forced[r].variants);
        double worst = largest_difference(&as_planned, &with_more);
        if (!(worst <= forced[r].most))
            fail_msg("row %zu: %s: off by %.3g", r, forced[r].json, worst);
        if (worst > 0)
            print_message("row %zu: off by %.3g\n", r, worst);
        render_result_finish(&as_planned);
        render_result_finish(&with_more);
        renderer_destroy(renderer);
    }
}

/* A mesh on the device gets normals and texture coordinates when a later picture needs them. */
static void test_attributes_come_when_needed(void **state) {
    (void)state;
    static const char *const order[] = {
        DIM "{'mesh': {" SPHERE "}" END,
        ONE "{'mesh': {" SPHERE "}" END,
    };
    struct renderer *both = support_renderer();
    struct render_result first, later, alone;
    assert_int_equal(draw(both, order[0], &first), STATUS_OK);
    assert_int_equal(draw(both, order[1], &later), STATUS_OK);
    renderer_destroy(both);
    struct renderer *fresh = support_renderer();
    assert_int_equal(draw(fresh, order[1], &alone), STATUS_OK);
    assert_true(largest_difference(&later, &alone) == 0);
    assert_true(first.report.work.upload_bytes > 0);
    assert_int_equal(later.report.work.upload_bytes, first.report.work.upload_bytes);
    assert_int_equal(alone.report.work.upload_bytes, 2 * first.report.work.upload_bytes);
    render_result_finish(&first);
    render_result_finish(&later);
    render_result_finish(&alone);
    renderer_destroy(fresh);
}

/* Fetches are counted: one a sample to resolve, and one more where a texture covers everything. */
static void test_fetches_are_counted(void **state) {
    (void)state;
    static const char scene[] =
        "{'image': {'width': 40, 'height': 24, 'samples': 4}, 'lights': [], 'camera': {'eye': [0, "
        "0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 1}, 'objects': [{'mesh': "
        "{'shape': 'plane', 'size': [8, 8]}}]}";
    enum { SAMPLES = 40 * 24 * 4 };
    struct renderer *renderer = support_renderer();
    struct render_result result;
    struct error err = {0};
    static const uint32_t forces[] = {0, FORCE_TEXTURED};
    for (size_t i = 0; i < 2; i++) {
        renderer_force(renderer, forces[i]);
        assert_int_equal(renderer_count_fetches(renderer, true, &err), STATUS_OK);
        assert_int_equal(draw(renderer, scene, &result), STATUS_OK);
        assert_int_equal(renderer_fetches(renderer), SAMPLES * (i + 1));
        render_result_finish(&result);
    }
    assert_int_equal(renderer_count_fetches(renderer, false, &err), STATUS_OK);
    assert_int_equal(draw(renderer, scene, &result), STATUS_OK);
    assert_int_equal(renderer_fetches(renderer), SAMPLES * 2);
    render_result_finish(&result);
    renderer_destroy(renderer);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_scene_takes_what_it_needs),
        cmocka_unit_test(test_what_is_left_out_changes_nothing),
        cmocka_unit_test(test_attributes_come_when_needed),
        cmocka_unit_test(test_fetches_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
