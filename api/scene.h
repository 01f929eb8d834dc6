/* The scene, version 1: what a request asks for, in plain structs.
 *
 * scene_read.c fills these from JSON and refuses whatever breaks the contract; after it has said
 * STATUS_OK every number below is finite and within its range (scene_members.def), every enum is
 * valid, and every default is filled in except those that need the geometry (a camera that is not
 * `given`, materials whose `size` is 0). Lengths are in the object's own units unless a
 * name says otherwise; angles are in degrees; colours are linear; matrices are column-major.
 * All pointers are owned by the arena that scene_read() was given. */
#ifndef PELT_API_SCENE_H
#define PELT_API_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/arena.h"
#include "api/status.h"

enum {
    SCENE_BYTES_MAX = 1 << 20,   /* one scene's JSON text */
    SCENE_DEPTH_MAX = 32,        /* nesting of its JSON */
    SCENE_IMAGE_SIDE_MAX = 8192, /* width and height */

    /* What is drawn for an image of samples = k * k: its sides times k, and their product. */
    SCENE_DRAWN_SIDE_MAX = 16384,
    SCENE_DRAWN_PIXELS_MAX = 16 * 1024 * 1024,

    SCENE_LIGHTS_MAX = 8,
    SCENE_SHADOW_SIZE_MAX = 4096,
    SCENE_SHADOW_SLICES_MAX = 96,
    SCENE_OBJECTS_MAX = 256,
    SCENE_JOINTS_MAX = 65536, /* and segments */
    SCENE_TEXT_MAX = 255,     /* characters of the name of an animation */
    SCENE_VOXELS_UV_MAX = 512,
    SCENE_VOXELS_W_MAX = 64,
    SCENE_TRIANGLES_MAX = 4000000 /* of all built-in shapes of one scene together */
};

struct scene_image {
    int width, height;    /* pixels */
    int samples;          /* k * k of a regular grid within each pixel: 1, 4, 9, 16, ... */
    double background[4]; /* straight linear RGBA */
};

struct scene_camera {
    bool given;        /* false: the renderer frames the objects and fills the rest in */
    bool orthographic; /* ortho_height instead of fov_y_deg */
    double eye[3], target[3], up[3];
    double fov_y_deg;    /* vertical, in (0, 180) */
    double ortho_height; /* world units from the bottom to the top edge */
};

struct scene_light {
    bool point;
    double direction[3]; /* where the light travels; of any length > 0; unless `point` */
    double position[3];  /* `point`: world units */
    double radius;       /* `point`: nearer than this it grows no stronger */
    double color[3];
    bool shadow;
};

/* How finely shadows are drawn; 0 where not given: the renderer's own choice, which `resolved`
 * reports. */
struct scene_shadow {
    int size;   /* texels along a side of each light's map */
    int slices; /* through the media on each of its rays */
};

enum scene_mesh_kind {
    SCENE_MESH_ASSET,
    SCENE_MESH_PLANE,
    SCENE_MESH_SPHERE,
    SCENE_MESH_TORUS,
    SCENE_MESH_CYLINDER,
    SCENE_MESH_TERRAIN,
    SCENE_MESH_TEAPOT
};

struct scene_mesh {
    enum scene_mesh_kind kind;
    const char *asset; /* SCENE_MESH_ASSET: a name; else NULL */
    /* Of an asset, where one of the two was given: its animation (NULL: the first) at a time. */
    bool has_time;
    double time_s;
    const char *animation;
    double size[2];   /* plane, terrain */
    double radius;    /* sphere, torus, cylinder */
    double tube;      /* torus */
    double height;    /* cylinder, terrain */
    uint32_t seed;    /* terrain */
    int divisions[2]; /* built-in shapes */
};

enum scene_material_kind {
    SCENE_MATERIAL_BUILTIN,  /* homogeneous, fur, ... */
    SCENE_MATERIAL_VOLUME,   /* a voxel volume from an asset */
    SCENE_MATERIAL_HEIGHT,   /* height and colour images */
    SCENE_MATERIAL_GEOMETRY, /* a tile of real geometry, voxelised */
    SCENE_MATERIAL_NONE      /* a skeleton without relief */
};

enum scene_builtin {
    SCENE_BUILTIN_HOMOGENEOUS,
    SCENE_BUILTIN_FUR,
    SCENE_BUILTIN_CLOUDS,
    SCENE_BUILTIN_FOG,
    SCENE_BUILTIN_WEAVE,
    SCENE_BUILTIN_CHAIN,
    SCENE_BUILTIN_ROCKS,
    SCENE_BUILTIN_TREES,
    SCENE_BUILTIN_GRATE,
    SCENE_BUILTIN_SCALES,
    SCENE_BUILTIN_BARK
};

enum scene_shading { SCENE_SHADING_NORMALS, SCENE_SHADING_KAJIYA_KAY };

struct scene_material {
    enum scene_material_kind kind;
    enum scene_builtin builtin;
    int size[3]; /* voxels along u, v, w; at most 512 x 512 x 64; a height material
                    whose size is not given has 0 here: its image decides */
    uint32_t seed;
    bool has_growth;    /* fur: `growth` was given, else it is grown */
    double growth;      /* length of the hairs, of their whole one */
    double phase;       /* clouds: turns */
    double extinction;  /* homogeneous: per object unit of length */
    bool has_color;     /* `color` as [r, g, b] was given (else it holds the default) */
    double color[3];    /* homogeneous: radiance; other built-ins: their tint */
    const char *volume; /* asset names; NULL where not given */
    const char *height;
    const char *color_image;
    struct scene_mesh geometry;
    double specular, shininess;
    bool lit;
    enum scene_shading shading; /* of its medium, if it has one */
    double extinction_color[3]; /* factors of extinction; likewise */
    double absorption;          /* per object unit; materials with a medium */
    double emission[3];         /* radiance per object unit; likewise */
    double glow;                /* likewise, of voxels */
};

struct scene_base {
    bool has_color; /* false: the asset's own base colour and textures, or white */
    double color[3];
};

struct scene_shell {
    struct scene_mesh mesh;
    double thickness;
    double tiles[2];
    bool has_base;
    struct scene_base base;
    struct scene_material material;
};

struct scene_joint {
    double position[3], radius;
};

struct scene_skeleton {
    const char *builtin; /* NULL, or "elm", "pine", ... */
    const char *asset;   /* NULL, or an asset's name */
    uint32_t seed;
    size_t joint_count, segment_count;
    struct scene_joint *joints;
    uint32_t (*segments)[2];
    bool has_relief;
    struct scene_material relief;
    double relief_height;
    double tiles[2];
};

struct scene_plain_mesh {
    struct scene_mesh mesh;
    bool has_color;
    double color[3];
};

enum scene_path {
    SCENE_PATH_AUTO,
    SCENE_PATH_TETRA,
    SCENE_PATH_SLICING,
    SCENE_PATH_GDM,
    SCENE_PATH_DISTANCE,
    SCENE_PATH_FRUSTA
};

enum scene_order { SCENE_ORDER_AUTO, SCENE_ORDER_SORTED, SCENE_ORDER_WALK };
enum scene_map { SCENE_MAP_AUTO, SCENE_MAP_AFFINE, SCENE_MAP_EXACT };
enum scene_filter { SCENE_FILTER_AUTO, SCENE_FILTER_NONE, SCENE_FILTER_MIP, SCENE_FILTER_VIEW };
enum scene_traversal {
    SCENE_TRAVERSAL_AUTO,
    SCENE_TRAVERSAL_FIXED,
    SCENE_TRAVERSAL_ADAPTIVE,
    SCENE_TRAVERSAL_DDA
};
enum scene_slicing_method {
    SCENE_SLICING_AUTO,
    SCENE_SLICING_SOFTWARE,
    SCENE_SLICING_HYBRID,
    SCENE_SLICING_HARDWARE,
    SCENE_SLICING_SLABS
};

/* What each path takes as its quality. 0 where not given: the path's own default, which `resolved`
 * reports. */
struct scene_quality {
    int samples; /* tetra: steps across one thickness at normal incidence */
    enum scene_order order;
    enum scene_traversal traversal;
    enum scene_map map;
    enum scene_filter filter; /* tetra, slicing: of voxels smaller than a sample */
    int slices;               /* slicing: planes across the depth of all shells */
    enum scene_slicing_method method;
    int rank;
    int iterations;
    int relief_steps, bisections;
};

enum scene_object_kind { SCENE_OBJECT_SHELL, SCENE_OBJECT_SKELETON, SCENE_OBJECT_MESH };

struct scene_object {
    enum scene_object_kind kind;
    struct scene_shell shell;
    struct scene_skeleton skeleton;
    struct scene_plain_mesh mesh;
    double transform[16]; /* world from object, column-major, invertible; identity by default */
    enum scene_path path;
    struct scene_quality quality;
};

enum scene_error_mode { SCENE_ERROR_NONE, SCENE_ERROR_ESTIMATE, SCENE_ERROR_REFERENCE };

struct scene_target {
    bool has_max_error, has_deadline_ms;
    double max_error;   /* RMSE, linear premultiplied */
    double deadline_ms; /* soft */
};

struct scene {
    struct scene_image image;
    struct scene_camera camera;
    size_t light_count;
    struct scene_light *lights;
    struct scene_shadow shadow;
    double ambient[3];
    size_t object_count;
    struct scene_object *objects;
    struct scene_target target;
    enum scene_error_mode error_mode;
};

/* Reads and validates one scene.
 *
 * `json`, `bytes`: the text, not necessarily terminated. On STATUS_OK `*scene` is complete and
 * owned by `arena`; otherwise `err` holds one fault for each thing found wrong (not only the
 * first), each with its JSON Pointer, and `*scene` is zeroed. STATUS_BAD_JSON,
 * STATUS_SCENE_TOO_LARGE, STATUS_INVALID_SCENE, STATUS_OUT_OF_MEMORY. Thread: any. */
enum status scene_read(const char *json, size_t bytes, struct arena *arena, struct scene *scene,
                       struct error *err);

/* Faults, with STATUS_NOT_IMPLEMENTED and a pointer each, for whatever a valid scene asks for that
 * this version cannot draw. STATUS_OK if nothing. */
enum status scene_check_implemented(const struct scene *scene, struct error *err);

/* The scene as JSON with every member written out; reading it back gives an equal scene, to the
 * last bit of every number. Returns malloc'ed text (caller frees), NULL where memory ran out. */
char *scene_write(const struct scene *scene);

/* Visits the name of every asset that the scene refers to, with its pointer, each use once. */
typedef void scene_asset_visit(void *user, const char *name, const char *pointer);
void scene_visit_assets(const struct scene *scene, scene_asset_visit *visit, void *user);

#endif
