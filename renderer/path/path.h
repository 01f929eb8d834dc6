/* What a path is: a small table of functions. The facade makes every object ready (mesh, shell,
 * voxels, textures, projection), then asks the path that the plan chose to upload, sort and draw.
 * A method is added or taken away by one file here, its shaders, and one row of path_table. */
#ifndef PELT_RENDERER_PATH_PATH_H
#define PELT_RENDERER_PATH_PATH_H

#include <stdbool.h>
#include <stddef.h>

#include "api/report.h"
#include "api/scene.h"
#include "renderer/asset/mesh.h"
#include "renderer/asset/volume.h"
#include "renderer/bake/volume_texture.h"
#include "renderer/gl/blocks.h"
#include "renderer/gl/clock.h"
#include "renderer/gl/program.h"
#include "renderer/gl/target.h"
#include "renderer/light/light.h"
#include "renderer/shell/project.h"
#include "renderer/shell/shell.h"
#include "renderer/shell/view.h"

/* One object of the scene, ready to be drawn. Everything is owned by the facade. */
struct path_object {
    const struct scene_object *object;
    char pointer[32]; /* of the object in the scene */
    const struct mesh *mesh;
    struct view mesh_view;    /* in object space, relative to the mesh's centre */
    double normal_rows[3][3]; /* world normal from the object's gradient */
    bool mirrored;            /* the transform turns triangles inside out */

    /* Shells only, else NULL. */
    const struct shell *shell;
    const struct volume *volume;
    const struct baked *baked;
    struct projection projection;
    int layers;        /* steps across one thickness that do its voxels justice */
    int quality;       /* what its path may spend, the more the better: path.quality_name */
    bool quality_free; /* the scene leaves it open, and it matters */
    bool any_quality;  /* it is drawn the same at any */
    bool walk;         /* rays walk through it from cell to cell; else its cells are drawn */
    bool walk_asked;   /* the scene asks for that, so nothing else may be done */
    bool solid_folds;  /* walked, and folds of its solid overlap (set by the path's `prepare`) */
    bool
        solid_cells; /* walked, but for its solid: the eye stands where folds of it overlap, and
                        the  depth test of its cells finds the nearest surface (set by `prepare`) */
    enum scene_slicing_method method;  /* of the slicing path, never `auto` */
    bool fp64;                         /* rays meet its cells in doubles (shell/precision.h) */
    enum scene_traversal traversal[2]; /* of its medium and its solid; `auto`: the path has none */
    enum scene_filter filter;          /* of its voxels, never `auto` */
    bool far_solid;                    /* its solid is drawn as a medium (renderer/far_solids.h) */
    double footprint;                  /* the largest of any sample, in voxels (footprint.h) */
    bool exact; /* textures are read by the prisms' own map; else by the tetrahedra's affine one */

    uint32_t shadow; /* FLAGS_PLACE that its lit draws need */

    bool every_plane; /* for measuring alone: planes look at every prism */
    uint32_t forced;  /* FLAG_* put in for measuring alone (renderer/force.h), else 0 */
};

struct shadow_maps;

/* Everything that the passes of one picture share. */
struct picture {
    struct gl_programs *programs;
    struct gl_target
        *target; /* the sample grid: fp32 colour, and depth where something is opaque */
    struct view world;
    struct light_set lights;
    const struct shadow_maps *shadows; /* NULL: no light throws any (renderer/path/shadow.h) */
    struct path_object *objects;
    size_t object_count;
    bool occluded; /* something opaque is drawn before the media */
    /* NULL; or, where extinction has colours, the background (straight linear RGBA): it is drawn
     * first, since each channel lets a share of its own through. */
    const double *behind;
    /* NULL; or, where that is transparent and all media have one colour of extinction, the
     * channels' shares of the optical depth that samples keep, which is the largest (tint.h). */
    const double *shares;
    /* NULL: the whole picture. Else only these blocks: a path draws its full-screen passes with
     * gl_blocks_draw(), and all others under the depth test, which lets nothing through elsewhere.
     */
    const struct gl_blocks *blocks;
    int forced_order;  /* for measuring alone: slabs nearest first (1) or farthest first (-1) */
    bool device_lists; /* slices as published: the device finds what planes cut (lists.h), not the
                          processor */
    uint8_t *met;      /* NULL, or set by the path's `prepare` to 1 for each sample, the bottom row
                          first, whose ray meets a shell */
    bool depth; /* set by the path's `prepare` where its draws need a depth buffer that the plan
                   knows nothing of */
    uint64_t approximate; /* set by the path's `prepare`: samples whose overlapping colours it
                             cannot mix in the right order */
    bool cold;            /* set where a shader was compiled */
    struct report *report;
    struct stage_clock *clock;
};

struct path {
    const char *name;
    enum scene_path id;
    const char *quality_name; /* the member of the scene's `quality` that is path_object.quality */
    int quality_max;          /* the most that a scene may ask for */
    /* State that outlives pictures: buffers, caches. A context is current in all of these. */
    enum status (*create)(void **state, struct error *err);
    void (*destroy)(void *state); /* takes NULL */
    /* Sets quality, quality_free and any_quality of all shells, whose views are made: as the scene
     * asks, else the path's own choice. Needs no context. */
    enum status (*choose)(struct path_object *objects, size_t count, struct error *err);
    /* Tells what an object was drawn with, for `resolved`. */
    void (*resolve)(const struct path_object *object, struct scene_quality *quality);
    /* Before drawing: order, buffers. Moves picture->clock through sort and upload. */
    enum status (*prepare)(void *state, struct picture *picture, struct error *err);
    /* Opaque parts of materials: writes colour and depth. Called if any volume has a solid. */
    enum status (*draw_solid)(void *state, struct picture *picture, struct error *err);
    /* Media, blended over what is there. Called if any volume has a medium. */
    enum status (*draw_media)(void *state, struct picture *picture, struct error *err);
};

extern const struct path path_tetra, path_slicing;

extern const struct path *const path_table[]; /* ends with NULL */

/* The path of an id; NULL if this version has none. */
const struct path *path_find(enum scene_path id);

/* Whether a volume needs each of the two draws. */
static inline bool volume_has_medium(const struct volume *volume) {
    return volume->homogeneous ? volume->extinction > 0 || volume_is_filled(volume)
                               : volume->medium != NULL;
}
static inline bool volume_has_solid(const struct volume *volume) {
    return volume->solid != NULL;
}

/* Whether its medium's, or its solid's, draws leap over empty voxels. What a filter reads reaches
 * beyond the voxels, and what absorbs or emits everywhere fills them: there they do not. */
static inline bool path_object_leaps(const struct path_object *object, bool solid) {
    enum scene_traversal traversal = object->traversal[solid];
    return object->shell && !object->volume->homogeneous &&
           (solid || (object->filter == SCENE_FILTER_NONE && !volume_is_filled(object->volume))) &&
           (traversal == SCENE_TRAVERSAL_ADAPTIVE || traversal == SCENE_TRAVERSAL_DDA);
}

/* Whether an object is a shell that holds anything. */
static inline bool path_object_drawn(const struct path_object *object) {
    return object->shell && (volume_has_medium(object->volume) || volume_has_solid(object->volume));
}

/* A homogeneous medium and what fills it besides as one: returns extinction per object unit, and
 * sets the radiance that this extinction stands for, (sigma c + q) / (sigma + sigma_a). */
double path_object_constant(const struct path_object *object, double radiance[3]);

/* A medium's strands, as the object's filter reads them. */
static inline GLuint path_object_strands(const struct path_object *object) {
    const struct baked *baked = object->baked;
    if (object->filter == SCENE_FILTER_VIEW)
        return baked->strand_layers;
    bool mips = object->filter == SCENE_FILTER_MIP && object->volume->strands;
    return mips ? baked->strand_mips : baked->strands;
}

/* Binds a medium's voxels and gradients, as the object's filter reads them. */
static inline void path_object_bind_medium(const struct path_object *object, GLuint medium,
                                           GLuint gradient) {
    const struct baked *baked = object->baked;
    bool mips = object->filter == SCENE_FILTER_MIP;
    glBindTextureUnit(medium, mips ? baked->medium_mips : baked->medium);
    glBindTextureUnit(gradient, mips ? baked->gradient_mips : baked->medium_gradient);
    if (baked->medium_leap)
        glBindTextureUnit(BINDING_LEAP, baked->medium_leap);
    if (object->volume->strand_lit)
        glBindTextureUnit(BINDING_STRANDS, path_object_strands(object));
    if (object->filter == SCENE_FILTER_VIEW) {
        glBindTextureUnit(BINDING_VIEW, baked->medium_views);
        glBindTextureUnit(BINDING_VIEW_LEFT, baked->left_views);
        for (GLuint k = 0; k < VIEW_MOMENTS; k++)
            glBindTextureUnit(BINDING_VIEW_MOMENTS + k, baked->moment_views[k]);
    }
}

#endif
