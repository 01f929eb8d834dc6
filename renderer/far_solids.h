/* Solids whose voxels are all smaller than a sample, drawn as media. */
#ifndef PELT_RENDERER_FAR_SOLIDS_H
#define PELT_RENDERER_FAR_SOLIDS_H

#include "renderer/prepare.h"

/* A mean of s is no coverage, and the first s = 1/2 along one ray is what aliases: a filtered solid
 * is partly transparent. So where a scene asks for a filter and every footprint of a shell is at
 * least a voxel, its solid becomes extinction: a voxel is covered by clamp(1/2 + d, 0, 1) = clamp(2
 * s - 1/2, 0, 1), d being the depth below the surface in voxels (renderer/asset/volume.h), and lets
 * that much less through over its own height; covered whole, 1e-6, more than which no picture
 * shows. The surface is then blurred by half a voxel to each side, which is less than a sample
 * sees. Light falls on it by the gradient of its opacity, which there weighs it by 0.98.
 *
 * Where some footprints are smaller the solid stays what it is, and the report warns
 * (`solid-not-filtered`): more samples a pixel are the way.
 *
 * After prepare_views(), before anything asks what a volume holds. STATUS_OUT_OF_MEMORY. */
enum status far_solids(struct prepared *prepared, struct report *report, struct error *err);

#endif
