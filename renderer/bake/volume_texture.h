/* A material's voxels as textures, uploaded once and shared by every picture that uses them.
 *
 * Texture layout, the same for all paths: GL_TEXTURE_3D over (u, v, w), GL_REPEAT in u and v,
 * GL_CLAMP_TO_EDGE in w, GL_LINEAR without mip levels, so that texture(t, vec3(u, v, w)) is the
 * trilinear interpolation that DESIGN.md defines (u, v already multiplied by `tiles`). */
#ifndef PELT_RENDERER_BAKE_VOLUME_TEXTURE_H
#define PELT_RENDERER_BAKE_VOLUME_TEXTURE_H

#include <glad/gl.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/status.h"
#include "renderer/asset/volume.h"
#include "renderer/gl/clock.h"
#include "shaders/interface.h"

/* Texture names; 0 where the material has no such part, so that a path can leave the fetch out. */
struct baked {
    GLuint medium; /* RGBA32F: extinction-weighted linear colour, then extinction, both times the
                      thickness (struct volume's `medium`) */
    GLuint solid;  /* RGBA32F: s-weighted linear colour, then s (struct volume's `solid`) */

    /* RGBA16F, xyz: the outward direction (from dense to empty) times the change per voxel along u,
     * v, w, as normals.h defines it; of opacity for the medium, of s for the solid; w is 0.
     * 0 until the material is asked for as lit. */
    GLuint medium_gradient, solid_gradient;

    /* RGBA32F, struct volume's `strands`, or one texel, (0, 0, 1, 1), where it has none: strands
     * along w. Stands in for `medium_gradient` where the medium is lit by strands, else 0. */
    GLuint strands;

    /* `medium` and `medium_gradient` with all their mip levels (pyramid.h),
     * GL_LINEAR_MIPMAP_LINEAR; 0 until the material is asked for with the filter `mip`. */
    GLuint medium_mips, gradient_mips;

    /* `strands` for the filters: a sampler3D with all levels for `mip`, GL_TEXTURE_2D_ARRAY of a
     * layer for each of w, coarser along u and v, for `view`; 0 where it has none. */
    GLuint strand_mips, strand_layers;

    /* R8, GL_NEAREST: distances to what holds something (empty_space.h), in voxels; 0 until the
     * material is asked for with `leaps`. */
    GLuint medium_leap, solid_leap;

    /* Beside `medium` and `medium_gradient`: GL_TEXTURE_2D_ARRAY over (u, v), view_pyramid.h, of
     * half as many texels along u and v and all coarser levels; 0 until the material is asked for
     * with the filter `view`, and where u and v are of one voxel each. */
    GLuint medium_views, left_views, moment_views[VIEW_MOMENTS];
    double aspect[2]; /* that they were made for */
};

struct bake_cache; /* one for each GL context; least recently used goes first */

/* `bytes_max`: texture memory kept for volumes that nobody holds. NULL where memory ran out. */
struct bake_cache *bake_cache_create(size_t bytes_max);
void bake_cache_destroy(struct bake_cache *cache); /* takes NULL; the context must be current */

/* The textures of a volume, made and uploaded or taken from the cache. A homogeneous volume has
 * none (all 0). `lit`: gradients are wanted; they are added later if the volume was first asked for
 * without. The volume is only read during the call.
 *
 * `*made` is set to true where something was computed or uploaded now (never to false) and
 * `*upload_bytes` is added to. `clock` is moved to the stage `bake` while the CPU computes and to
 * `upload` while textures are made, and is left in one of the two. All three may be NULL.
 * `*baked` belongs to the cache and is valid until bake_release(). STATUS_TOO_COMPLEX (larger than
 * GL_MAX_3D_TEXTURE_SIZE), STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. Thread: the context's. */
enum status bake_acquire(struct bake_cache *cache, const struct volume *volume, bool lit,
                         const struct baked **baked, bool *made, uint64_t *upload_bytes,
                         struct stage_clock *clock, struct error *err);

/* How a medium is read: never `auto`. `aspect`, for `view`: the length of a tile along u and v, in
 * thicknesses. */
struct bake_filter {
    enum scene_filter kind;
    double aspect[2];
    bool leaps[2]; /* rays leap over what is empty in the medium, in the solid */
};

/* The same for a medium that is read through a filter. `mip`: `medium_mips` stands in for `medium`,
 * and `gradient_mips` for `medium_gradient`, which are not made for it. `view`: `medium_views` and
 * `moment_views` come beside them. */
enum status bake_acquire_filtered(struct bake_cache *cache, const struct volume *volume, bool lit,
                                  const struct bake_filter *filter, const struct baked **baked,
                                  bool *made, uint64_t *upload_bytes, struct stage_clock *clock,
                                  struct error *err);
void bake_release(struct bake_cache *cache, const struct baked *baked); /* takes NULL */

#endif
