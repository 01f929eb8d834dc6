/* Meshes from glTF assets. Internal to the asset room; mesh_cache.c calls it. */
#ifndef PELT_RENDERER_ASSET_MESH_ASSET_H
#define PELT_RENDERER_ASSET_MESH_ASSET_H

#include "renderer/asset/mesh.h"
#include "renderer/asset/mesh_gltf.h"

/* The mesh in a glTF file's bytes, owned by the caller (mesh_destroy). `pointer` is that of the
 * mesh in the scene. `*has_images`: the file has textures on what is drawn, whether they
 * were wanted or not; without `want_textures` the mesh has none, and surfaces keep their colours
 * alone. Loads modules as mesh_acquire() says. STATUS_BAD_ASSET, STATUS_TOO_COMPLEX,
 * STATUS_IO_ERROR, STATUS_OUT_OF_MEMORY.
 * `for_poses`: what different nodes show does not weld, since it may part. */
enum status mesh_asset_load(const unsigned char *data, size_t bytes, bool want_textures,
                            bool for_poses, const char *pointer, struct mesh **mesh,
                            bool *has_images, struct error *err);

/* The mesh in another pose of the file that `rest` is of; shares what mesh.h says with it, which
 * must outlive it. `pointer`: of the mesh. STATUS_BAD_ASSET also where there is no such animation,
 * with its member's pointer. */
enum status mesh_asset_pose(const unsigned char *data, size_t bytes, const struct scene_mesh *spec,
                            struct mesh *rest, const char *pointer, struct mesh **mesh,
                            struct error *err);

/* Decodes an asset's images to 8-bit RGBA into mesh->images (room for `count`, zeroed) and adds
 * them to mesh->bytes. Loads the OpenImageIO module. */
enum status mesh_decode_images(const struct gltf_image *images, uint32_t count, const char *pointer,
                               struct mesh *mesh, struct error *err);

#endif
