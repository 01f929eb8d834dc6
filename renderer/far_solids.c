/* See far_solids.h. */
#include "renderer/far_solids.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/path/footprint.h"

/* What a voxel that is covered whole lets through. */
static const double THROUGH_SOLID = 1e-6;

static bool turn_to_medium(const struct volume *solid, struct forced_volume *far) {
    struct volume *volume = &far->volume;
    size_t voxels = (size_t)solid->size[0] * (size_t)solid->size[1] * (size_t)solid->size[2];
    *volume = *solid;
    volume->solid = NULL;
    volume->surfaces = !solid->medium;
    volume->medium = far->medium = malloc(voxels * 4 * sizeof *far->medium);
    if (!far->medium)
        return false;
    volume->key[0] ^= 8; /* other voxels than what else has that key (and than force.c's) */
    for (size_t i = 0; i < voxels; i++) {
        const float *from = solid->solid + 4 * i;
        float *to = far->medium + 4 * i;
        double s = (double)from[3], covered = fmin(fmax(2 * s - 0.5, 0), 1 - THROUGH_SOLID);
        double sigma = -log1p(-covered) * solid->size[2];
        for (int c = 0; c < 4; c++) {
            double own = c < 3 ? (s > 0 ? sigma * (double)from[c] / s : 0) : sigma;
            to[c] = (float)(own + (solid->medium ? (double)solid->medium[4 * i + (size_t)c] : 0));
        }
        volume->medium_max = fmaxf(volume->medium_max, to[3]);
    }
    return true;
}

enum status far_solids(struct prepared *prepared, struct report *report, struct error *err) {
    for (size_t i = 0; i < prepared->object_count; i++) {
        struct path_object *object = &prepared->objects[i];
        enum scene_filter asked = object->object->quality.filter;
        bool filtered = asked == SCENE_FILTER_MIP || asked == SCENE_FILTER_VIEW;
        if (!filtered || !object->shell || !volume_has_solid(object->volume))
            continue;
        struct footprint footprint = footprint_find(object);
        if (footprint.least < 1) {
            if (footprint.most > 1)
                report_warn(
                    report, "solid-not-filtered", object->pointer, 1, 0,
                    "samples cover up to %.3g voxels of a solid, and others less than one: it "
                    "is drawn unfiltered; more samples a pixel smooth it",
                    footprint.most);
            continue;
        }
        if (!prepared->far)
            prepared->far = calloc(prepared->object_count, sizeof *prepared->far);
        if (!prepared->far || !turn_to_medium(object->volume, &prepared->far[i]))
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to filter a solid");
        prepared->far[i].original = object->volume;
        object->volume = &prepared->far[i].volume;
        object->far_solid = true;
    }
    return STATUS_OK;
}
