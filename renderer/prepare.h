/* Making a scene's objects ready: meshes, shells, voxels, the camera, projections. */
#ifndef PELT_RENDERER_PREPARE_H
#define PELT_RENDERER_PREPARE_H

#include "api/report.h"
#include "renderer/asset/mesh.h"
#include "renderer/asset/source.h"
#include "renderer/asset/volume.h"
#include "renderer/path/path.h"
#include "renderer/shell/shell.h"

/* What stays between pictures. */
struct caches {
    struct mesh_cache *meshes;
    struct shell_cache *shells;
    struct volume_cache *volumes;
    uint64_t newest_mesh, newest_shell; /* serials: whatever has a higher one was made just now */
};

/* A volume that stands in for an object's own: with parts put in for measuring alone
 * (renderer/force.h), or a solid seen from afar (renderer/far_solids.h). */
struct forced_volume {
    const struct volume *original; /* NULL: none stands in */
    struct volume volume;
    float *medium, *solid; /* owned */
};

/* One scene made ready; prepared_finish() gives everything back. */
struct prepared {
    struct path_object *objects;
    size_t object_count;
    double bounds_min[3], bounds_max[3]; /* world */
    struct forced_volume *forced;        /* one for each object, or NULL */
    struct forced_volume *far; /* likewise: solids that are drawn as media (far_solids.h) */
};

/* Acquires what every object needs. `scene` is the copy that becomes `resolved`. Sets *made where a
 * material was generated. Adds the warnings of the pre-flight diagnosis. */
enum status prepare_objects(struct caches *caches, const struct scene *scene,
                            const struct asset_source *assets, struct prepared *prepared,
                            bool *made, struct report *report, struct error *err);

/* Frames the camera if it is not given, makes the views and projects the shells. */
enum status prepare_views(struct prepared *prepared, struct scene *scene, struct view *world,
                          struct error *err);

void prepared_finish(struct caches *caches, struct prepared *prepared);

#endif
