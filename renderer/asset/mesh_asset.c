/* glTF assets: bytes through the tinygltf module, turned upright, built, coloured.
 *
 * glTF is Y-up, Pelt is Z-up: (x, y, z) becomes (x, -z, y), a rotation, so nothing is mirrored.
 * What faces +z in the file (glTF's front) faces -y here. */
#include "renderer/asset/mesh_asset.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/mesh_build.h"
#include "renderer/asset/module.h"

static void turn_upright(struct gltf_soup *soup) {
    for (uint64_t i = 0; i < 3 * soup->triangle_count; i++) {
        double *p = soup->position[i], y = p[1];
        float *n = soup->normal[i], ny = n[1];
        p[1] = -p[2];
        p[2] = y;
        n[1] = -n[2];
        n[2] = ny;
    }
}

static enum status take_surfaces(const struct gltf_soup *soup, bool want_textures,
                                 const char *pointer, struct mesh *mesh, struct error *err) {
    uint32_t count = soup->surface_count;
    struct mesh_surface *surfaces = realloc(mesh->surfaces, (count ? count : 1) * sizeof *surfaces);
    if (!surfaces)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for %u surfaces", count);
    mesh->surfaces = surfaces;
    mesh->surface_count = count;
    mesh->bytes += count * sizeof *surfaces;
    for (uint32_t i = 0; i < count; i++) {
        memcpy(surfaces[i].base_color, soup->surfaces[i].base_color, sizeof surfaces[i].base_color);
        surfaces[i].image = want_textures ? soup->surfaces[i].image : -1;
    }
    if (!want_textures || soup->image_count == 0)
        return STATUS_OK;
    mesh->images = calloc(soup->image_count, sizeof *mesh->images);
    if (!mesh->images)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for %u images",
                           soup->image_count);
    mesh->image_count = soup->image_count;
    return mesh_decode_images(soup->images, soup->image_count, pointer, mesh, err);
}

/* The soup of a file, upright; `pose` may be NULL. `pointer`: of the mesh. */
static enum status load_soup(const struct gltf_module *gltf, const unsigned char *data,
                             size_t bytes, const struct gltf_pose *pose, const char *pointer,
                             struct gltf_soup *soup, struct error *err) {
    char message[512] = "", at[256];
    enum gltf_outcome code =
        gltf->load(data, bytes, MESH_TRIANGLES_MAX, pose, soup, message, sizeof message);
    if (code == GLTF_OK) {
        turn_upright(soup);
        return STATUS_OK;
    }
    enum status status = code == GLTF_TOO_COMPLEX     ? STATUS_TOO_COMPLEX
                         : code == GLTF_OUT_OF_MEMORY ? STATUS_OUT_OF_MEMORY
                                                      : STATUS_BAD_ASSET;
    snprintf(at, sizeof at, "%s/%s", pointer,
             code != GLTF_NO_ANIMATION || !pose ? "asset"
             : pose->animation                  ? "animation"
                                                : "time");
    return error_fault(err, status, at, "%s", message);
}

enum status mesh_asset_load(const unsigned char *data, size_t bytes, bool want_textures,
                            bool for_poses, const char *pointer, struct mesh **mesh,
                            bool *has_images, struct error *err) {
    *mesh = NULL;
    *has_images = false;
    const struct gltf_module *gltf = module_open(MODULE_MESH_GLTF, err);
    if (!gltf)
        return STATUS_IO_ERROR;
    struct gltf_soup soup = {0};
    char at[256];
    snprintf(at, sizeof at, "%s/asset", pointer);
    enum status status = load_soup(gltf, data, bytes, NULL, pointer, &soup, err);
    if (status != STATUS_OK)
        return status;
    *has_images = soup.image_count > 0;
    struct mesh_soup view = {.triangle_count = soup.triangle_count,
                             .position = soup.position,
                             .normal = soup.normal,
                             .uv = soup.uv,
                             .has_normal = soup.has_normal,
                             .has_uv = soup.has_uv,
                             .surface = soup.surface,
                             .part_count = for_poses ? soup.part_count : 0,
                             .part_end = soup.part_end};
    status = mesh_build(&view, at, mesh, err);
    if (status == STATUS_OK)
        status = take_surfaces(&soup, want_textures, at, *mesh, err);
    gltf->free(&soup);
    if (status != STATUS_OK) {
        mesh_destroy(*mesh);
        *mesh = NULL;
    }
    return status;
}

enum status mesh_asset_pose(const unsigned char *data, size_t bytes, const struct scene_mesh *spec,
                            struct mesh *rest, const char *pointer, struct mesh **mesh,
                            struct error *err) {
    *mesh = NULL;
    const struct gltf_module *gltf = module_open(MODULE_MESH_GLTF, err);
    if (!gltf)
        return STATUS_IO_ERROR;
    struct gltf_soup soup = {0};
    struct gltf_pose pose = {spec->animation, spec->time_s};
    enum status status = load_soup(gltf, data, bytes, &pose, pointer, &soup, err);
    if (status != STATUS_OK)
        return status;
    struct mesh_soup view = {.triangle_count = soup.triangle_count,
                             .position = soup.position,
                             .normal = soup.normal,
                             .has_normal = soup.has_normal};
    if (soup.triangle_count != rest->source_count)
        status = error_fault(err, STATUS_INTERNAL, pointer, "a pose has other triangles");
    else
        status = mesh_pose(rest, &view, pointer, mesh, err);
    gltf->free(&soup);
    return status;
}
