/* Of a batch's entries, plane after plane, the cuts that slices_hardware.vert draws, and the command that
 * draws them. What a prism's six corners cannot say (renderer/shell/slice.h) is named as the CPU does, from
 * the same doubles. In every other plane all is turned around (renderer/path/slicing.c). */
#define LIST_THREADS LIST_GROUP
#include "common_lists.glsl"

layout(location = 2) uniform uint group_begin; /* the first plane that plane_range knows */
layout(location = 3) uniform uint plane_count; /* of the picture */
layout(location = LOCATION_LIST_PLANES) uniform dvec3 depths;

layout(std430, binding = BINDING_LIST_FROM) readonly buffer From {
    uvec4 entries[];
};
layout(std430, binding = BINDING_LIST_HEIGHTS) readonly buffer Heights {
    double heights[];
};
layout(std430, binding = BINDING_LIST_FANS) readonly buffer Fans {
    uint fans[];
};
layout(std430, binding = BINDING_LIST_CUTS) writeonly buffer Cuts {
    uint cuts[]; /* three words each */
};
layout(std430, binding = BINDING_LIST_DRAW) writeonly buffer Draw {
    uint command[5]; /* DrawElementsIndirectCommand */
};

/* slabs_plane() of renderer/shell/slabs.c, rounding for rounding. */
double plane_at(uint k) {
    precise double h = depths.x + (depths.y - depths.x) * double(k) / double(plane_count);
    return k == plane_count ? depths.y : h;
}

void main() {
    uint i = gl_GlobalInvocationID.x, all = batches[batch].z;
    if (i == 0u) {
        command[0] = all * uint(3 * (CUT_CORNERS - 2));
        command[1] = 1u;
        command[2] = command[3] = command[4] = 0u;
    }
    if (i >= all)
        return;
    uvec4 entry = entries[i];
    uint k = entry.z, fan = entry.y;
    precise double h = (plane_at(k) + plane_at(k + 1u)) / 2.0lf;
    uint at = i;
    if ((k & 1u) != 0u) {
        uvec2 range = plane_range[k - group_begin];
        at = 2u * range.x + range.y - 1u - i;
        fan = fans_of(entry) - 1u - fan;
    }
    uint edges = CUT_UNDECIDED;
    if (entry.w != LIST_EVEN) {
        uint sides = 0u;
        for (uint v = 0u; v < 6u; v++)
            sides |= heights[6u * entry.w + v] >= h ? 1u << v : 0u;
        edges = fans[uint(LIST_FANS) * sides + fan];
    }
    cuts[3u * at] = entry.x;
    cuts[3u * at + 1u] = floatBitsToUint(float(h - depths.z));
    cuts[3u * at + 2u] = edges;
}
