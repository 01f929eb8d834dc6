/* Slices as published: the polygons in which planes cut prisms, in the three ways of Lensch,
 * Daubert & Seidel 2002 (sections 4 to 6). They draw the same picture to rounding, and differ in
 * who does what:
 *
 *   software   the CPU classifies, intersects and interpolates
 *   hybrid     the CPU classifies, the vertex shader intersects
 *   hardware   the vertex shader does both, with six corners for each prism
 *
 * Points of a ray are sampled on planes, so they are of first order wherever the density jumps. */
#ifndef PELT_RENDERER_PATH_POLYGONS_H
#define PELT_RENDERER_PATH_POLYGONS_H

#include "renderer/path/cells.h"
#include "renderer/shell/slice.h"

enum { POLYGON_METHODS = 3 };

/* A method's place in tables; -1: `slabs`, `auto`. */
int polygons_index(enum scene_slicing_method method);

struct polygon_pass; /* a context must be current in all of these */
/* NULL: no memory, or not one of the three. */
struct polygon_pass *polygon_pass_create(enum scene_slicing_method method);
void polygon_pass_destroy(struct polygon_pass *pass); /* takes NULL */

/* Compiles what an object is drawn with. */
enum status polygon_pass_prepare(const struct polygon_pass *pass, const struct path_object *object,
                                 struct picture *picture, struct error *err);

/* Appends what the plane at the depth h (view.h) cuts of prism `prism` of picture->objects[index];
 * false where memory ran out. */
bool polygon_pass_append(struct polygon_pass *pass, const struct path_object *object,
                         uint32_t index, uint32_t prism, double h);
size_t polygon_pass_corners(const struct polygon_pass *pass); /* that wait to be drawn */

/* Draws and forgets what was appended; `spacing` of the planes in H. Shells are in `tables`, their
 * own maps in `maps` where an object is exact. */
enum status polygon_pass_draw(struct polygon_pass *pass, struct cell_pass *tables,
                              struct prism_maps *maps, struct picture *picture, double spacing,
                              bool solid, struct error *err);

/* Whether a prism's normal edges may be cut both ways (slice.h): they never are where all go the
 * same way. Sets the depths of its six vertices. */
bool polygons_part(const struct path_object *object, uint32_t prism, double height[6]);

/* Cuts that are on the device already (lists.h), of one object, and how many they are at most. */
struct polygon_list {
    GLuint cuts;    /* texture, as BINDING_CUTS has it */
    GLuint command; /* that draws them: how many they are only the device knows */
    size_t most;
};
/* Draws them; of the hardware method alone. */
enum status polygon_pass_draw_list(struct polygon_pass *pass, struct cell_pass *tables,
                                   struct prism_maps *maps, struct picture *picture, uint32_t index,
                                   double spacing, bool solid, const struct polygon_list *list,
                                   struct error *err);

#endif
