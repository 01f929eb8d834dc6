/* Cuts a group of planes into batches of at most `capacity` entries, from the farthest plane on, and finds
 * where in its batch each plane begins. One workgroup. No plane alone holds more than `capacity`. */
#define LIST_THREADS LIST_WIDE
#include "common_lists.glsl"

layout(location = 2) uniform uvec2 group; /* planes */
layout(location = 3) uniform uint capacity;

layout(std430, binding = BINDING_LIST_FROM) readonly buffer From {
    uvec4 entries[];
};

/* Of the planes: first by how much each holds more than the one before it, then how much it holds. */
shared int held[LIST_PLANES_MAX + 1];

void main() {
    uint t = gl_LocalInvocationID.x;
    for (uint k = t; k <= uint(LIST_PLANES_MAX); k += uint(LIST_WIDE))
        held[k] = 0;
    barrier();
    for (uint i = t; i < count; i += uint(LIST_WIDE)) {
        uvec4 entry = entries[i];
        uint low = max(entry.y, group.x), high = min(entry.z + 1u, group.y);
        if (low < high) {
            atomicAdd(held[low - group.x], int(fans_of(entry)));
            atomicAdd(held[high - group.x], -int(fans_of(entry)));
        }
    }
    barrier();
    if (t != 0u)
        return;
    uint planes = group.y - group.x;
    int sum = 0;
    for (uint k = 0u; k < planes; k++) {
        sum += held[k];
        held[k] = sum;
    }
    uint made = 0u, used = 0u, end = group.y;
    for (uint n = 0u; n < planes; n++) {
        uint k = planes - 1u - n, here = uint(held[k]);
        if (used + here > capacity) {
            batches[made++] = uvec4(group.x + k + 1u, end, used, 0u);
            end = group.x + k + 1u;
            used = 0u;
        }
        plane_range[k] = uvec2(used, here);
        used += here;
    }
    batches[made++] = uvec4(group.x, end, used, 0u);
    for (; made < uint(LIST_PLANES_MAX); made++)
        batches[made] = uvec4(group.x, group.x, 0u, 0u);
}
