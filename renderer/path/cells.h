/* Drawing a shell cell by cell: each tetrahedron's outline on the sample grid, whole or within a
 * slab, shaded by shaders/tetra.frag. The paths that do so (tetra, slicing) differ in which cells
 * they draw when; what a cell looks like is here alone. */
#ifndef PELT_RENDERER_PATH_CELLS_H
#define PELT_RENDERER_PATH_CELLS_H

#include "renderer/path/path.h"
#include "renderer/path/prism_maps.h"

struct cell_corner {
    float x, y; /* in [-1, 1] on the sample grid */
    float z;    /* nearest depth of what is drawn: hides what lies wholly behind */
    uint32_t cell;
};

/* Consecutive triangles that belong to one object. */
struct cell_run {
    uint32_t object;
    uint32_t first, count; /* indices */
};

/* Outlines, cut into triangles, in the order in which they are drawn. Zeroed is empty. */
struct outlines {
    struct cell_corner *corners;
    float (*slab)[2]; /* for each corner, where slabs are drawn; else NULL */
    uint32_t *indices;
    struct cell_run *runs;
    size_t corner_count, corner_capacity, slab_capacity, index_count, index_capacity, run_count,
        run_capacity;
    size_t outline_count;
    double spacing; /* where slabs are drawn: the longest step along a ray, in H */
};

void outlines_clear(struct outlines *outlines); /* keeps the memory */
void outlines_finish(struct outlines *outlines);

/* Appends a tetrahedron of picture->objects[index]; false where memory ran out. */
bool outlines_append(struct outlines *outlines, const struct path_object *object, uint32_t index,
                     uint32_t tetra);

/* The same within a rectangle of samples {x0, y0, x1, y1} (upper ends excluded) that it covers. */
bool outlines_append_rectangle(struct outlines *outlines, const struct path_object *object,
                               uint32_t index, uint32_t tetra, const uint32_t box[4]);

/* What is drawn of a cell: depths H (view.h), from `low` to `high`. Open at an end where the cell
 * does not reach it: then the segment is the cell's own there, to the bit. */
struct cell_slab {
    double low, high;
    bool open_low, open_high;
};
bool outlines_append_slab(struct outlines *outlines, const struct path_object *object,
                          uint32_t index, uint32_t tetra, const struct cell_slab *slab);

struct cell_pass; /* device copies of shells; a context must be current in all of these */

/* `program`: GL_PROGRAM_TETRA, or GL_PROGRAM_SLABS, which draws outlines with slabs. `maps` are
 * bound where an object is exact; its owner prepares them. NULL where memory ran out. */
struct cell_pass *cell_pass_create(enum gl_program_id program, struct prism_maps *maps);
void cell_pass_destroy(struct cell_pass *pass); /* takes NULL */

/* From now on draws by GL_PROGRAM_CASTER or GL_PROGRAM_CASTER_RANGE, into a light's view; `slices`:
 * the uniform of that name (shaders/common_caster.glsl), read when drawing. Instead of
 * GL_PROGRAM_TETRA.
 */
void cell_pass_cast(struct cell_pass *pass, enum gl_program_id program, const int slices[3]);

void cell_pass_begin_picture(struct cell_pass *pass);

/* Brings an object's shell to the device and compiles what it is drawn with, so that drawing only
 * draws. STATUS_TOO_COMPLEX, STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status cell_pass_prepare(struct cell_pass *pass, const struct path_object *object,
                              struct picture *picture, struct error *err);

/* The first half of that: the table of a shell (BINDING_CELLS), for whoever draws otherwise. */
enum status cell_pass_upload(struct cell_pass *pass, const struct shell *shell,
                             struct picture *picture, struct error *err);
GLuint cell_pass_table(struct cell_pass *pass, const struct shell *shell); /* 0: not uploaded */

void cells_bind_textures(const struct path_object *object, bool solid);

/* The state for one of the two draws: depth test and, for media, blending back to front. Ends with
 * cell_pass_end_media(). */
void cell_pass_begin_solid(void);
void cell_pass_begin_media(const struct picture *picture);
void cell_pass_end_media(void);

/* Draws outlines in their order. */
enum status cell_pass_draw(struct cell_pass *pass, struct picture *picture,
                           const struct outlines *outlines, bool solid, struct error *err);

#endif
