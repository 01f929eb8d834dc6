/* Shadows: what of each light arrives at a point (api/README.md, "The truth of shadow"), for every
 * path alike. Before a picture is drawn, each light that throws shadows gets a view of its own,
 * orthographic and fitted to the objects, or, where it stands at a point, up to six in perspective,
 * through the faces of a cube around it; and everything is drawn into each: opaque things as
 * planes in a shadow map, media as optical depths in slices (shaders/common_shadow.glsl). The draws
 * of lit things then ask these maps at every sample.
 *
 * Cells are drawn in any order, whatever the path: optical depths add. Two or three passes a light,
 * each only where something is of that kind. Errors vanish with the maps' size and slices
 * (tests/unit/test_shadow.c). */
#ifndef PELT_RENDERER_PATH_SHADOW_H
#define PELT_RENDERER_PATH_SHADOW_H

#include <glad/gl.h>

#include "renderer/path/path.h"
#include "renderer/path/surface.h"

/* What a picture needs of it. */
struct shadow_need {
    int count;          /* lights with maps; 0: nothing of all this */
    int views;          /* of all of them: their maps are one layer each */
    bool opaque, media; /* whether there are such things to throw them */
    bool points;        /* lights stand at points, which is told with the maps or without */
    bool channels;      /* extinctions of several colours: three optical depths */
    double tint[3];     /* else each channel's share of the one */
    int size, layers;   /* of a map; of four depths each */
    /* Each light's views, -1: it throws no shadow, or nothing lies there. A light with a direction
     * has the first alone; others one for each face of the cube around them (light_view.h). */
    int view[LIGHTS_MAX][SHADOW_FACES];
};

/* Of optical depths, in a view. */
static inline int shadow_map_layers(const struct shadow_need *need) {
    return need->channels ? 3 * need->layers : need->layers;
}

static inline bool shadow_is_tinted(const struct shadow_need *need) {
    return need->media && !need->channels &&
           (need->tint[0] != 1 || need->tint[1] != 1 || need->tint[2] != 1);
}

/* Decides by the scene and its objects, sets path_object.shadow of all of them and scene->shadow.
 * `forced` (for measuring alone): maps for the first light although it throws no shadow, and all
 * that asks them. STATUS_TOO_COMPLEX where the scene asks for more than SHADOW_BYTES_MAX. */
#define SHADOW_BYTES_MAX (256 << 20)
enum status shadow_choose(struct scene *scene, struct path_object *objects, size_t count,
                          bool forced, struct shadow_need *need, struct error *err);

struct shadow_pass; /* maps, device copies of shells; a context must be current in all of these */
struct shadow_pass *shadow_pass_create(void);       /* NULL where memory ran out */
void shadow_pass_destroy(struct shadow_pass *pass); /* takes NULL */

/* Draws the maps of a picture whose meshes are uploaded and whose textures are baked, and sets
 * picture->shadows, which lasts until the next call. Moves picture->clock to the stage `shadow`. */
enum status shadow_pass_draw(struct shadow_pass *pass, const struct shadow_need *need,
                             struct surface_pass *surface, struct picture *picture,
                             struct error *err);

/* Warns in picture->report (`shadow-coarse`) of shells that the maps just drawn are too coarse for.
 */
void shadow_pass_warn(const struct shadow_pass *pass, const struct picture *picture);

/* Binds the maps and how the space of `view`, an object's, falls on them; nothing where there are
 * none. */
void shadow_bind(const struct picture *picture, const struct view *view,
                 const struct path_object *object);

#endif
