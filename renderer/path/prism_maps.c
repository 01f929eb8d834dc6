/* See prism_maps.h. A table beside that of the cells: whoever draws by the affine map neither
 * uploads nor fetches it. */
#include "renderer/path/prism_maps.h"

#include <stdlib.h>

#include "renderer/gl/context.h"
#include "renderer/shell/prism_map.h"

enum { DEVICE_BYTES_MAX = 256 << 20 };

struct device_maps {
    GLuint buffer, texture;
};

static void destroy_maps(void *data) {
    struct device_maps *device = data;
    glDeleteTextures(1, &device->texture);
    glDeleteBuffers(1, &device->buffer);
    free(device);
}

void prism_maps_init(struct prism_maps *maps) {
    *maps = (struct prism_maps){.shells = {.bytes_max = DEVICE_BYTES_MAX, .destroy = destroy_maps}};
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &maps->texels_max);
}

void prism_maps_finish(struct prism_maps *maps) {
    resident_clear(&maps->shells);
}

static enum status upload(struct prism_maps *maps, const struct shell *shell,
                          struct picture *picture, struct error *err) {
    size_t count = shell->tetra_count;
    if (count * MAP_TEXELS > (size_t)maps->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "a shell of %zu tetrahedra: this GL holds the maps of %zu in one table",
                           count, (size_t)maps->texels_max / MAP_TEXELS);
    float(*map)[MAP_TEXELS][4] = malloc((count + 1) * sizeof *map);
    struct device_maps *device = calloc(1, sizeof *device);
    if (!map || !device) {
        free(map);
        free(device);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's maps");
    }
    prism_map_fill(shell, map);
    glCreateBuffers(1, &device->buffer);
    glNamedBufferStorage(device->buffer, (GLsizeiptr)(count * sizeof *map), map, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &device->texture);
    glTextureBuffer(device->texture, GL_RGBA32F, device->buffer);
    picture->report->work.upload_bytes += count * sizeof *map;
    free(map);
    if (!resident_add(&maps->shells, shell->serial, device, count * sizeof *map))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's maps");
    return gl_check("uploading a shell's maps", err);
}

enum status prism_maps_prepare(struct prism_maps *maps, struct picture *picture,
                               struct error *err) {
    resident_begin_picture(&maps->shells);
    enum status status = STATUS_OK;
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->exact)
            continue;
        bool kept = resident_find(&maps->shells, object->shell->serial) != NULL;
        report_reuse(picture->report, REPORT_PART_tables, kept);
        if (!kept)
            status = upload(maps, object->shell, picture, err);
    }
    return status;
}

GLuint prism_maps_buffer(struct prism_maps *maps, const struct path_object *object) {
    const struct device_maps *device =
        object->exact ? resident_find(&maps->shells, object->shell->serial) : NULL;
    return device ? device->buffer : 0;
}

void prism_maps_bind(struct prism_maps *maps, const struct path_object *object) {
    if (!object->exact)
        return;
    const struct device_maps *device = resident_find(&maps->shells, object->shell->serial);
    glBindTextureUnit(BINDING_MAPS, device->texture);
}
