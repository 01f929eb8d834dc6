/* The teapot's control points; mesh_teapot_table.c holds them, mesh_teapot.c alone uses them. */
#ifndef PELT_RENDERER_ASSET_MESH_TEAPOT_H
#define PELT_RENDERER_ASSET_MESH_TEAPOT_H

enum { MESH_TEAPOT_PATCHES = 32, MESH_TEAPOT_POINTS = 290 };

extern const unsigned short mesh_teapot_patch[MESH_TEAPOT_PATCHES][16];
extern const double mesh_teapot_point[MESH_TEAPOT_POINTS][3];

#endif
