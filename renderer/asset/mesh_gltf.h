/* The thin C face of tinygltf (mesh_gltf.cc, built as a module). Exceptions stop there.
 * Untrusted input: no file system access, own bounds checks on every accessor, buffer view and
 * sparse index; images are handed out encoded, never decoded here. */
#ifndef PELT_RENDERER_ASSET_MESH_GLTF_H
#define PELT_RENDERER_ASSET_MESH_GLTF_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct gltf_surface {
    float base_color[4]; /* linear */
    int image;           /* index into images, -1: none */
};

struct gltf_image {
    unsigned char *data; /* encoded, as the file has it: PNG or JPEG if it is valid. NULL where it
                            lies outside the file or only an extension knows it */
    size_t bytes;
};

/* A triangle soup, one entry for each corner (3 * triangle_count), node transforms applied, still
 * Y-up as in the file. All arrays malloc'ed; `free` of the table releases them. */
struct gltf_soup {
    uint64_t triangle_count;
    double (*position)[3]; /* finite, at most 1e30 */
    float (*normal)[3];    /* of any length; zero where there is none */
    double (*uv)[2];
    uint8_t *has_normal, *has_uv; /* for each triangle; UVs beyond 1e9 (or NaN) count as none */
    uint16_t *surface;            /* for each triangle */
    uint32_t part_count;          /* nodes that show a mesh */
    uint64_t *part_end;           /* triangles up to the end of each */
    uint32_t surface_count, image_count;
    struct gltf_surface *surfaces;
    struct gltf_image *images;
};

enum gltf_outcome {
    GLTF_OK,
    GLTF_BAD,
    GLTF_TOO_COMPLEX,
    GLTF_OUT_OF_MEMORY,
    GLTF_NO_ANIMATION /* or none of that name */
};

/* What of a file is wanted: as it lies there (NULL), or at a time of one of its animations, with
 * node transforms, morph targets and skins. */
struct gltf_pose {
    const char *animation; /* its name; NULL: the first */
    double time_s;         /* before its first key and after its last one: theirs */
};

/* A table, so that the module needs one symbol (`pelt_mesh_module`). */
struct gltf_module {
    /* GLTF_OK, or another outcome and a message of at most message_bytes; then *soup is zeroed.
     * .glb, or .gltf with embedded (data URI) buffers. GLTF_TOO_COMPLEX: more than triangles_max.
     * Posed or not, a file gives the same triangles in the same order; a posed one has neither
     * texture coordinates nor surfaces nor images (NULL). */
    enum gltf_outcome (*load)(const unsigned char *data, size_t bytes, uint64_t triangles_max,
                              const struct gltf_pose *pose, struct gltf_soup *soup, char *message,
                              size_t message_bytes);
    void (*free)(struct gltf_soup *soup);
    const char *(*version)(void);
};

#ifdef __cplusplus
}
#endif

#endif
