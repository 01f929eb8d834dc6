/* What makes the voxels of each material; called by volume.c alone. Each function fills `medium` or
 * `solid`, and `strands` where volume_wants_strands() (allocated here, freed by volume.c) and
 * `medium_max` of a zeroed volume whose `size` is set and within the limits, and leaves the rest
 * alone.
 *
 * The design space of all built-in materials: a tile is 1 wide along u, 1 along v and
 * VOLUME_TILE_DEPTH deep along w, so that 128 x 128 x 32 voxels are cubes. Where a scene's `tiles`
 * and `thickness` have another aspect, the material is stretched with the shell. */
#ifndef PELT_RENDERER_ASSET_VOLUME_GENERATORS_H
#define PELT_RENDERER_ASSET_VOLUME_GENERATORS_H

#include "api/scene.h"
#include "api/status.h"
#include "renderer/asset/source.h"
#include "renderer/asset/volume.h"

enum { VOLUME_SIDE_MAX = 512, VOLUME_DEPTH_MAX = 64 };

/* Zeroed voxels of 4 floats each, for a size within the limits; NULL where memory ran out. */
float *volume_alloc_voxels(const int size[3]);

/* Whether a maker that knows its strands is to fill `strands`: nobody else asks for them. */
static inline bool volume_wants_strands(const struct scene_material *spec) {
    return spec->builtin == SCENE_BUILTIN_FUR && spec->lit &&
           spec->shading == SCENE_SHADING_KAJIYA_KAY;
}

/* The largest extinction of a medium. */
float volume_medium_max(const float *medium, const int size[3]);

/* Each: STATUS_OK or STATUS_OUT_OF_MEMORY. Same spec, same bytes. Thread: any. */
enum status volume_make_fur(const struct scene_material *spec, struct volume *volume);
enum status volume_make_clouds(const struct scene_material *spec, struct volume *volume);
enum status volume_make_fog(const struct scene_material *spec, struct volume *volume);
enum status volume_make_weave(const struct scene_material *spec, struct volume *volume);
enum status volume_make_chain(const struct scene_material *spec, struct volume *volume);
enum status volume_make_rocks(const struct scene_material *spec, struct volume *volume);
enum status volume_make_trees(const struct scene_material *spec, struct volume *volume);
enum status volume_make_grate(const struct scene_material *spec, struct volume *volume);
enum status volume_make_scales(const struct scene_material *spec, struct volume *volume);
enum status volume_make_bark(const struct scene_material *spec, struct volume *volume);

/* Whether one of them makes this material, and that one for spec->builtin, which must be there. */
bool volume_builtin_exists(enum scene_builtin builtin);
enum status volume_make_builtin(const struct scene_material *spec, struct volume *volume);

/* A height field, with colours if `color` is not NULL. Where volume->size is 0 it is taken from the
 * height image: up to 512 x 512, and 32 deep. `pointer`: of the material. STATUS_BAD_ASSET,
 * STATUS_IO_ERROR (no OpenImageIO), STATUS_OUT_OF_MEMORY. */
enum status volume_make_height(const struct scene_material *spec, const struct asset_bytes *height,
                               const struct asset_bytes *color, const char *pointer,
                               struct volume *volume, struct error *err);

/* A volume from a file, for a shell of that thickness in object units. Where volume->size is 0 it
 * is taken from the file: up to 512 x 512 x 64. Sets volume->notes. STATUS_BAD_ASSET,
 * STATUS_IO_ERROR (no OpenImageIO), STATUS_OUT_OF_MEMORY. */
enum status volume_make_file(const struct asset_bytes *bytes, double thickness, const char *pointer,
                             struct volume *volume, struct error *err);

/* A tile of real geometry; see volume_geometry.c. Sets volume->notes. What mesh_acquire() returns.
 */
enum status volume_make_geometry(const struct scene_material *spec,
                                 const struct asset_source *source, const char *pointer,
                                 struct volume *volume, struct error *err);

#endif
