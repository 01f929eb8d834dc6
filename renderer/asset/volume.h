/* A material as voxels: what the built-in generators, height fields, volumes from files and
 * voxelised geometry all become. Grid over (u, v, w): periodic in u and v, clamped in w, voxel
 * centres at (k + 1/2) / n. Voxel (x, y, z) is element (z * size[1] + y) * size[0] + x. */
#ifndef PELT_RENDERER_ASSET_VOLUME_H
#define PELT_RENDERER_ASSET_VOLUME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/report.h"
#include "api/scene.h"
#include "renderer/asset/source.h"

/* Depth of a tile in its widths, in which the built-in materials are designed. */
#define VOLUME_TILE_DEPTH 0.25

struct volume {
    int size[3]; /* voxels; {1, 1, 1} for homogeneous */

    /* SHA-256 of all that the voxels depend on (members, seed, image bytes): equal keys mean equal
     * voxels, so what is baked from them may outlive this copy. */
    unsigned char key[32];

    /* No voxels at all: extinction per object unit and radiance are constants. */
    bool homogeneous;
    double extinction, radiance[3];

    /* NULL where the material has no medium. Per voxel 4 floats: extinction-weighted linear colour,
     * then extinction. Both are times the shell's thickness (optical depth across one thickness):
     * sigma * thickness = -log1p(-alpha) * size[2] for a voxel of stored alpha. */
    float *medium;
    float medium_max; /* largest extinction * thickness */
    /* What it lets through straight across, on the mean over all columns of voxels; 1: no medium.
     */
    float medium_through;

    /* NULL where the material has no solid. Per voxel 4 floats: s-weighted linear colour, then
     * s = clamp(1/2 + d/2, 0, 1), d the signed depth below the surface in voxels. Voxels with
     * s >= 1/2 hold no extinction in `medium`. */
    float *solid;

    /* NULL unless the medium is lit by strands (`strand_lit`) whose directions the material knows;
     * where it does not, they run along w. Per voxel 4 floats: the mean of the strands' unit
     * tangents, weighted by extinction, times that extinction; then the extinction, as in `medium`.
     * Tangents are in tile widths, of a tile 1 x 1 x VOLUME_TILE_DEPTH, and point up. */
    float *strands;

    /* What was not as it should be in what it was made from; volume_warn() tells. */
    struct volume_notes {
        uint64_t negative, huge; /* values brought into range */
        uint64_t open_edges;     /* of a tile's mesh: its triangles are sheets */
    } notes;

    /* What fills the shell besides, evenly: extinction without source per object unit, radiance per
     * object unit; and the radiance of a voxel's own, as a multiple of its colour. */
    double absorption, emission[3], glow;
    double tint[3]; /* factors of all extinction, 0 to 1 */

    bool surfaces; /* the medium stands for a solid (far_solids.h): what is seen of it faces the
                      viewer */
    bool lit, strand_lit; /* the latter only where `lit`, and there is a medium */
    float specular, shininess;
    size_t bytes;
    int references;
};

/* Whether `medium` is not all that a ray meets in the shell. */
static inline bool volume_is_filled(const struct volume *volume) {
    return volume->absorption > 0 || volume->glow > 0 || volume->emission[0] > 0 ||
           volume->emission[1] > 0 || volume->emission[2] > 0;
}

/* Whether extinction has colours. */
static inline bool volume_is_tinted(const struct volume *volume) {
    return volume->tint[0] != 1 || volume->tint[1] != 1 || volume->tint[2] != 1;
}

/* Keyed by the material's members and its images' SHA-256; least recently used goes first, volumes
 * in use stay. One cache belongs to one thread. */
struct volume_cache;
struct volume_cache *volume_cache_create(size_t bytes_max);
void volume_cache_destroy(struct volume_cache *cache); /* takes NULL; ends every volume */

/* The volume of a material in a shell of that thickness (object units: OpenVDB holds densities per
 * unit), made or taken from the cache (`*made`: generated now). `pointer` is that of the material
 * in the scene. Loads the OpenImageIO module only for images. Blocks while it makes one: 20-160 ms
 * for 128 x 128 x 32 voxels, up to 3 s for 512 x 512 x 64. The caller gives the volume back with
 * volume_release(). STATUS_BAD_ASSET, STATUS_ASSET_NOT_FOUND, STATUS_IO_ERROR (no OpenImageIO),
 * STATUS_NOT_IMPLEMENTED, STATUS_TOO_COMPLEX, STATUS_OUT_OF_MEMORY. */
enum status volume_acquire(struct volume_cache *cache, const struct scene_material *spec,
                           double thickness, const char *pointer, const struct asset_source *source,
                           const struct volume **volume, bool *made, struct error *err);
/* Adds the notes to the report, one warning for each kind. */
void volume_warn(const struct volume *volume, const char *pointer, struct report *report);

void volume_release(struct volume_cache *cache, const struct volume *volume); /* takes NULL */

#endif
