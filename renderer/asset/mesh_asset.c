/* glTF assets: bytes through the tinygltf module, turned upright, built, coloured.
 *
 * glTF is Y-up, Pelt is Z-up: (x, y, z) becomes (x, -z, y), a rotation, so nothing is mirrored.
 * What faces +z in the file (glTF's front) faces -y here. */
#include "renderer/asset/mesh_asset.h"

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

enum status mesh_asset_load(const unsigned char *data, size_t bytes, bool want_textures,
                            const char *pointer, struct mesh **mesh, bool *has_images,
                            struct error *err) {
    *mesh = NULL;
    *has_images = false;
    const struct gltf_module *gltf = module_open(MODULE_MESH_GLTF, err);
    if (!gltf)
        return STATUS_IO_ERROR;
    struct gltf_soup soup = {0};
    char message[512] = "";
    enum gltf_outcome code =
        gltf->load(data, bytes, MESH_TRIANGLES_MAX, &soup, message, sizeof message);
    if (code != GLTF_OK) {
        enum status status = code == GLTF_TOO_COMPLEX     ? STATUS_TOO_COMPLEX
                             : code == GLTF_OUT_OF_MEMORY ? STATUS_OUT_OF_MEMORY
                                                          : STATUS_BAD_ASSET;
        return error_fault(err, status, pointer, "%s", message);
    }
    turn_upright(&soup);
    *has_images = soup.image_count > 0;
    struct mesh_soup view = {.triangle_count = soup.triangle_count,
                             .position = soup.position,
                             .normal = soup.normal,
                             .uv = soup.uv,
                             .has_normal = soup.has_normal,
                             .has_uv = soup.has_uv,
                             .surface = soup.surface};
    enum status status = mesh_build(&view, pointer, mesh, err);
    if (status == STATUS_OK)
        status = take_surfaces(&soup, want_textures, pointer, *mesh, err);
    gltf->free(&soup);
    if (status != STATUS_OK) {
        mesh_destroy(*mesh);
        *mesh = NULL;
    }
    return status;
}
