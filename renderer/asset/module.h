/* Opens Pelt's own modules (small shared objects under $libdir/pelt that link the heavy libraries)
 * when first needed, and remembers which were opened, for the report. */
#ifndef PELT_RENDERER_ASSET_MODULE_H
#define PELT_RENDERER_ASSET_MODULE_H

#include <stddef.h>

#include "api/status.h"

enum module { MODULE_MESH_GLTF, MODULE_IMAGE_OIIO, MODULE_COUNT };

/* The module's table of functions (mesh_gltf.h, image_oiio.h), opened on first use. Looks beside
 * the executable (lib/pelt and ../lib/pelt), then in the configured libdir; PELT_LIBDIR overrides.
 * The table is static and stays valid until the process ends. NULL with STATUS_IO_ERROR and a
 * message that names the package to install; the fault has no pointer: the machine lacks something,
 * not the scene. Thread: the one that renders. Blocks while libraries load: OpenImageIO about 0.4
 * s. */
const void *module_open(enum module module, struct error *err);

/* The same for a module of another room's: a file of that name, looked for in the same places, and
 * the one symbol it exports. `name` and `package` (of Debian 12) go into messages. */
struct module_spec {
    const char *file, *symbol, *name, *package;
};
const void *module_open_spec(const struct module_spec *spec, struct error *err);

/* What is known of a module without opening it; static. */
const struct module_spec *module_describe(enum module module);

/* Names of the libraries opened so far in this process, e.g. "OpenImageIO", static strings; returns
 * how many. Thread: the one that renders. */
size_t module_loaded(const char *names[MODULE_COUNT]);

#endif
