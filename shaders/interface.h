/* Read by C and by GLSL alike: flags of the shader variants, binding points, table layouts.
 * Only preprocessor lines that both understand. */
#ifndef PELT_SHADERS_INTERFACE_H
#define PELT_SHADERS_INTERFACE_H

/* Which variants of a program that knows the flags `known` make sense: a cell holds one thing, not
 * two (media of other objects are other draws); a homogeneous medium is unlit, its colour is its
 * radiance, and no map leads into it; a highlight needs a light with a direction, and where there
 * is none nothing needs a normal; a surface is always lit; solids are hidden by the depth test, not
 * by clipping; footprints are found by the prisms' own map, and are a medium's; shadows and point
 * lights need light; strands are a
 * lit medium's, and not filtered (joint walks may hold other media that are); what fills a shell
 * besides its material is a medium; shadows have colours by media, in one way or the other, and a
 * caster's three optical depths are a medium's. The checks
 * compile of the variants for which this holds those of tests/tools/variant_cover.h, and
 * gl_programs_get() takes no other. */
#define FLAGS_LIGHT   (FLAG_LIT | FLAG_AMBIENT)
#define FLAGS_SHADOW  (FLAG_SHADOW_OPAQUE | FLAG_SHADOW_MEDIA)
#define FLAGS_PLACE   (FLAGS_SHADOW | FLAG_POINT)
#define FLAGS_COLORED (FLAG_SHADOW_TINT | FLAG_SHADOW_CHANNELS)
#define FLAGS_CONTENT (FLAG_MEDIUM | FLAG_SOLID | FLAG_HOMOGENEOUS)
#define VARIANT_MAKES_SENSE(v, known)                                                              \
    ((((v)&FLAGS_CONTENT) == FLAG_MEDIUM || ((v)&FLAGS_CONTENT) == FLAG_SOLID ||                   \
      ((v)&FLAGS_CONTENT) == FLAG_HOMOGENEOUS || ((known)&FLAGS_CONTENT) == 0) &&                  \
     (((v)&FLAGS_LIGHT) == 0 || ((v)&FLAG_HOMOGENEOUS) == 0) &&                                    \
     ((v)&FLAGS_LIGHT) != FLAGS_LIGHT &&                                                           \
     (((v)&FLAGS_LIGHT) != 0 || ((known)&FLAG_TEXTURED) == 0) &&                                   \
     (((v)&FLAG_SPECULAR) == 0 || ((v)&FLAG_LIT) != 0) &&                                          \
     (((v)&FLAG_OCCLUDED) == 0 || ((v)&FLAG_SOLID) == 0) &&                                        \
     (((v)&FLAG_EXACT) == 0 || ((v)&FLAG_HOMOGENEOUS) == 0) &&                                     \
     (((v)&FLAGS_PLACE) == 0 || ((v)&FLAG_LIT) != 0) && ((v)&FLAGS_COLORED) != FLAGS_COLORED &&    \
     (((v)&FLAGS_COLORED) == 0 || ((v)&FLAG_SHADOW_MEDIA) != 0 ||                                  \
      (((known)&FLAG_SHADOW_MEDIA) == 0 && ((v)&FLAG_SOLID) == 0)) &&                              \
     (((v)&FLAG_LIGHTS) == 0 || ((v)&FLAG_LIT) != 0) &&                                            \
     (((v)&FLAG_FILTER) == 0 || (((v)&FLAG_EXACT) != 0 && ((v)&FLAG_SOLID) == 0)) &&               \
     (((v)&FLAG_FILTER_VIEW) == 0 || ((v)&FLAG_FILTER) != 0) &&                                    \
     (((v)&FLAG_LEAP) == 0 || ((v) & (FLAG_HOMOGENEOUS | FLAG_FILTER)) == 0) &&                    \
     (((v)&FLAG_DDA) == 0 || ((v)&FLAG_LEAP) != 0) &&                                              \
     (((v)&FLAG_FOLDS) == 0 || ((v)&FLAG_SOLID) != 0) &&                                           \
     (((v)&FLAG_RULED) == 0 || ((v)&FLAG_EXACT) != 0) &&                                           \
     (((v)&FLAG_FILL) == 0 || ((v) & (FLAG_SOLID | FLAG_HOMOGENEOUS)) == 0) &&                     \
     (((v)&FLAG_TINT) == 0 || ((v)&FLAG_SOLID) == 0) &&                                            \
     (((v)&FLAG_STRANDS) == 0 || (((v)&FLAG_LIT) != 0 && ((v)&FLAG_SOLID) == 0)))

/* Variant flags: a bit each; GLSL tests (VARIANT & FLAG_X) != 0 in #if. */
#define FLAG_MEDIUM      0x0001 /* the material has extinction */
#define FLAG_SOLID       0x0002 /* the material has a solid field: find its first surface */
#define FLAG_HOMOGENEOUS 0x0004 /* constant extinction: closed form, no texture, no loop */
#define FLAG_LIT         0x0008 /* directional and ambient light, which needs normals */
#define FLAG_SPECULAR    0x0010 /* a specular term */
#define FLAG_OCCLUDED    0x0020 /* opaque things exist: clip each segment at their depth */
#define FLAG_EYE_INSIDE  0x0040 /* the eye may be inside a cell: clip each segment at the eye */
#define FLAG_TEXTURED    0x0080 /* a surface with a base colour texture */
#define FLAG_BLOCKS      0x0100 /* resolve: only blocks of pixels, one after another */
#define FLAG_AMBIENT     0x0200 /* ambient light alone, the same from everywhere: no normals */
#define FLAG_FP64        0x0400 /* rays meet cells in doubles (renderer/shell/precision.h) */
#define FLAG_EXACT       0x0800 /* texture coordinates by the prisms' own map, not the tetrahedra's */
#define FLAG_SLOTS_1     0x1000 /* overlap: one slot more than two */
#define FLAG_SLOTS_2     0x2000 /* overlap: two slots more */
#define FLAG_FILTER                                                                                \
    0x100000 /* voxels are read at the level of the footprint (common_filter.glsl) */
#define FLAG_FILTER_VIEW 0x200000 /* and by the side from which they are seen */
#define FLAG_LEAP                                                                                  \
    0x800000 /* traversal `adaptive`, `dda`: leap over what is empty, step by voxels */
#define FLAG_RULED 0x2000000 /* sides of prisms are bent by what shows: cells end there */
#define FLAG_FOLDS 0x8000000 /* stretches of the ray overlap: the nearest of their surfaces */
#define FLAG_DDA   0x1000000 /* and end no step beyond the next plane of voxel centres */
#define FLAG_COUNT 0x8000    /* for measuring alone, and in no row of programs.def: count fetches */

#define FLAG_SHADOW_OPAQUE 0x10000 /* a light throws shadows of opaque things */
#define FLAG_SHADOW_MEDIA  0x20000 /* a light throws shadows of media */
#define FLAG_POINT         0x40000 /* a light stands at a point */
#define FLAG_SHADOW_TINT                                                                           \
    0x4000000 /* media dim each channel of a light by its own share of one optical depth */
#define FLAG_SHADOW_CHANNELS 0x20000000 /* or have three of them */

#define FLAG_LIGHTS  0x10000000 /* more than one light */
#define FLAG_STRANDS 0x80000    /* a medium is lit by its strands, not by normals */

#define FLAG_FILL 0x400000 /* voxels glow, or their shell absorbs or emits */
#define FLAG_TINT 0x4000   /* extinction has colours; resolve: and all media have the same */

#define LIGHTS_MAX        8
#define PIXEL_SAMPLES_MAX 256 /* of a pixel */

/* The uniform block `frame`: one vec4 a row. Rays and projection are those of view.h, in the
 * object's space; the rest is in the world's. */
#define FRAME_O0 0 /* ray origin: o0, ou, ov; w: view.depth_scale */
#define FRAME_OU 1 /* w: t of the object's centre */
#define FRAME_OV 2 /* w: voxels that a step passes at most, FLAG_LEAP */
#define FRAME_D0 3 /* ray direction: d0, du, dv */
#define FRAME_DU 4
#define FRAME_DV 5
#define FRAME_SCREEN                                                                               \
    6 /* 2 / width, 2 / height of the sample grid; transmittance that ends a ray; w: FLAG_TINT, 1  \
         where a sample keeps the optical depth of the channel that loses most */
#define FRAME_STEP 7 /* steps per unit of length, 1 / thickness, most steps */
#define FRAME_NORMAL                                                                               \
    8 /* three rows: world normal from the object's gradient; w of two: FLAG_FILTER_VIEW, a tile's \
         length along u and v in thicknesses, on the mean */
#define FRAME_VIEW_D0                                                                              \
    11 /* ray direction in the world; w of a slab: least steps per unit of length in the middle,   \
          of DU and DV: (|du| / |d0|)^2 */
#define FRAME_VIEW_DU     12
#define FRAME_VIEW_DV     13
#define FRAME_X_ROW       14 /* projection of a point */
#define FRAME_Y_ROW       15
#define FRAME_H_ROW       16
#define FRAME_AMBIENT     17 /* rgb; w: number of lights */
#define FRAME_LIGHT_SUM   18 /* sum of the lights' colours / 4 */
#define FRAME_MATERIAL    19 /* specular, shininess; w: 1 in orthographic views */
#define FRAME_CONSTANT    20 /* homogeneous: radiance, extinction; surface: base colour */
#define FRAME_SIZE        21 /* voxels along u, v, w; w: -1 where the transform mirrors, else 1 */
#define FRAME_LIGHT_DIR   22 /* LIGHTS_MAX unit vectors toward the lights */
#define FRAME_LIGHT_COLOR 30
#define FRAME_LOW         38 /* what fp32 leaves off O0 to DV, then off X_ROW to H_ROW */
#define FRAME_FILL        47 /* what fills the shell, times its thickness: emission, absorption */
#define FRAME_GLOW        48 /* x: a voxel's own radiance, as a multiple of its colour; yzw: tint */
#define FRAME_VEC4S       49

#define BINDING_FRAME           0
#define BINDING_CELLS           0 /* samplerBuffer: tetrahedra, shell.h */
#define BINDING_MEDIUM          1
#define BINDING_MEDIUM_GRADIENT 2
#define BINDING_SOLID           3
#define BINDING_SOLID_GRADIENT  4
#define BINDING_OCCLUDER        5 /* sampler2D: depth of what is opaque */
#define BINDING_BASE_COLOR      6
#define BINDING_SAMPLES         7  /* sampler2D: the picture before resolving */
#define BINDING_LINKS           8  /* usamplerBuffer: what lies across a cell's faces */
#define BINDING_ENTRIES         9  /* usamplerBuffer: where rays enter a shell */
#define BINDING_FIRST           10 /* usamplerBuffer: a sample's first entry */
#define BINDING_BLOCKS          11 /* samplerBuffer: the blocks' lower left pixels */
#define BINDING_CUTS            9  /* usamplerBuffer: what planes cut; slices do not walk */
#define BINDING_LEAP                                                                               \
    7 /* sampler3D: how far it is to what holds something; where nothing is resolved */
#define BINDING_MAPS 13 /* samplerBuffer: the prisms' own maps, prism_map.h */

/* The uniform block of shadows: texels along the maps' sides, 1 over that, layers of four depths,
 * the raster's grid in texels. For each light, in two vec4s, the view of each of its faces, -1
 * where there is none (+x, -x, +y, -y; +z, -z; the only one of a light with a direction is the
 * first). Then, where lights stand at points, the world from the object's space, and the points.
 * Then for each view how the object's space falls on its map: the texel (x, y), times 1 + t in
 * perspective, and the depth t of a point; what a texel to the right, one up and a unit of depth
 * are in the world; w of the last two: a texel's width in units of depth, and rounding over
 * SHADOW_ROUNDING. And last, for FLAG_SHADOW_TINT, the channels' shares of optical depths. */
#define BINDING_SHADOW 1
#define SHADOW_FACES   6  /* of a light that stands at a point */
#define SHADOW_FACE    1  /* 2 LIGHTS_MAX */
#define SHADOW_WORLD   17 /* three rows */
#define SHADOW_POINT   20 /* LIGHTS_MAX, in that world; w: radius^2, 0 where it has a direction */
#define SHADOW_VIEW    28 /* a view's rows: */
#define SHADOW_X       0
#define SHADOW_Y       1
#define SHADOW_T       2
#define SHADOW_U       3
#define SHADOW_V       4
#define SHADOW_D       5
#define SHADOW_ROWS    6
#define SHADOW_VIEWS   8 /* without points; times SHADOW_FACES with them */
#define SHADOW_LAYERS                                                                              \
    4 /* that one pass writes; each holds three slices, and the next one's first */
#define SHADOW_CHANNEL_LAYERS                                                                      \
    6 /* FLAG_SHADOW_CHANNELS: a layer a slice, three optical depths at its end; a divisor of 12   \
       */

/* What fp32 may leave of equal depths, which are between -1 and 1: eight roundings of 2^-24 each in
 * two sums of four products. Of lights with a direction; others' rows say by what it is larger. */
#define SHADOW_ROUNDING 1.0e-6

/* By what angle a solid's normal, interpolated between voxels, may be off that of its surface. */
#define SHADOW_NORMALS 0.25

#define BINDING_SHADOW_PLANES 22 /* sampler2DArray: a layer a view */
#define BINDING_SHADOW_DEPTHS 23 /* sampler2DArray: a view's layers after another's */
#define BINDING_SHADOW_RANGES 30 /* sampler2DArray: a layer a view */

/* What is seen from each side, where footprints are larger than a voxel
 * (renderer/bake/view_pyramid.h): the layers of an array come one side after another. */
#define BINDING_VIEW         14 /* sampler2DArray */
#define BINDING_VIEW_LEFT    15
#define BINDING_VIEW_MOMENTS 16 /* VIEW_MOMENTS; of no slot: joint walks know no sides */
#define VIEW_ABOVE           0  /* at each of VIEW_SLANTS slants */
#define VIEW_BELOW           3
#define VIEW_SIDE            6
#define VIEW_SIDES           7
#define VIEW_SLANTS          3
#define VIEW_MOMENTS         3   /* textures of four numbers, of the normals that are seen */
#define VIEW_COS2_1          0.5 /* the slants' squared cosines to w; of the first, 1 */
#define VIEW_COS2_2          0.125

#define BINDING_STRANDS 31   /* of no slot: there they stand in for the gradients */
#define TILE_DEPTH      0.25 /* of a tile, in its widths: VOLUME_TILE_DEPTH of volume.h */

#define BINDING_COUNT 0 /* shader storage: sums of fetches; any of them takes a fragment's */
#define COUNT_SLOTS   64

/* Programs that walk through several stretches at once: consecutive units, one a slot. */
#define SLOTS_MAX             5 /* of the units that GL 4.5 guarantees a stage, 15 are taken */
#define BINDING_SLOT_MEDIUM   16
#define BINDING_SLOT_GRADIENT 24

#define LOCATION_BLOCK 15 /* of the uniform in fullscreen.vert; programs' own begin at 0 */

#define BINDING_CELLS_LOW 12 /* samplerBuffer: what fp32 leaves off the cells */

/* Corners of prisms for walks (FLAG_RULED): common_sides.glsl. */
#define BINDING_SIDES 6

#define CELL_TEXELS  8
#define WALK_TEXELS  6
#define LOW_TEXELS   3 /* of the four vectors that a ray is met with, one after another */
#define MAP_TEXELS   5
#define SIDE_TEXELS  9
#define SIDE_OFFSETS 3 /* after the bottoms */
#define SIDE_LOW     6

/* A cut of a prism by a plane, one texel: the prism, the plane's depth as bits, and which edge each
 * of six corners is on, four bits a corner; or that the shader finds out. */
#define CUT_CORNERS   6
#define CUT_UNDECIDED 0xffffffffu

/* Lists of what planes cut, made on the device (renderer/path/lists.h). Storage buffers; GL 4.5
 * promises a compute stage the points 0 to 7. */
#define BINDING_LIST_FROM    1 /* entries: prism, first plane, last plane, place in the heights */
#define BINDING_LIST_TO      2
#define BINDING_LIST_SUMS    3
#define BINDING_LIST_BATCHES 4
#define BINDING_LIST_HEIGHTS 5 /* depths of six vertices, doubles, of prisms whose edges part */
#define BINDING_LIST_FANS    6 /* of each combination of sides: LIST_FANS words like cut's */
#define BINDING_LIST_CUTS    7
#define BINDING_LIST_DRAW    2 /* the command; in the last of the programs */
#define LOCATION_LIST_PLANES 8 /* doubles: depths of the first plane and past the last, center */
#define LIST_GROUP           64
#define LIST_WIDE            256 /* invocations of what one workgroup does */
#define LIST_PLANES_MAX      512 /* of one group of planes */
#define LIST_CHUNK           16  /* entries that one invocation puts into their planes */
#define LIST_SORT_CHUNK      128 /* that one invocation sorts */
#define LIST_BITS            5   /* of the key, in one pass of sorting */
#define LIST_BINS            32
#define LIST_FANS            2           /* of a prism whose edges part; of others 1 */
#define LIST_EVEN            0xffffffffu /* a place in the heights: none */

/* A face of a cell is cell << 2 | face; this is none. */
#define LINK_NONE 0xffffffffu

/* Where several shells are walked at once, an entry's first word is the shell and such a face, its
 * second the ray parameter. */
#define ENTRY_SHELL(word)       ((word) >> 29)
#define ENTRY_LINK(word)        ((word)&0x1fffffffu)
#define ENTRY_WORD(shell, link) ((shell) << 29 | (link))

/* The bottom of a prism is the face opposite the last vertex of its first cell (shell.h). */
#define IS_BOTTOM(cell, face) ((cell) % 3u == 0u && (face) == 3u)

/* Depth of a point at the ray parameter t (eye -1, far away infinite): reversed, in (0, 1]. `scale`
 * is view.depth_scale: t times it is at least -1 wherever an object is, and a unit of it no more
 * than the scene's radius, so that fp32 tells depths apart to some 1e-7 of that from any distance.
 */
#define DEPTH_OF_T(t, scale) (1.0 / (2.0 + (scale) * (t)))

/* Where what is hidden begins: behind a depth that was read by as much as it may have been rounded
 * (2^-24 for z, some more for the t that a rasteriser interpolates), so that nothing is cut off
 * that lies in front: a shell over its base may be as thin as that. */
#define T_HIDDEN(z, scale) (((1.0 + 4.8e-7) / (z)-2.0) / (scale))

/* The optical depth that stands for "opaque": exp(-x) is 0 and sums stay finite. */
#define OPAQUE_DEPTH 1.0e30

#endif
