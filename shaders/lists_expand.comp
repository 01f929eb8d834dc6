/* An entry for each plane of a batch that cuts a prism, in the order of the prisms: (prism, which of its
 * polygons, plane, place in the heights). A plane never looks at what it does not cut. */
#define LIST_THREADS LIST_GROUP
#include "common_lists.glsl"

layout(std430, binding = BINDING_LIST_FROM) readonly buffer From {
    uvec4 entries[];
};
layout(std430, binding = BINDING_LIST_TO) writeonly buffer To {
    uvec4 made[];
};
layout(std430, binding = BINDING_LIST_SUMS) readonly buffer Sums {
    uint sums[]; /* summed up: where each chunk begins */
};

void main() {
    uint chunk = gl_GlobalInvocationID.x, begin = chunk * uint(LIST_CHUNK);
    if (begin >= count)
        return;
    uvec4 planes = batches[batch];
    uint at = sums[chunk], end = min(begin + uint(LIST_CHUNK), count);
    /* At most LIST_CHUNK (LIST_PLANES_MAX LIST_FANS + 1) turns: far below 65,535. */
    for (uint i = begin; i < end; i++) {
        uvec4 entry = entries[i];
        uint low = max(entry.y, planes.x), high = min(entry.z + 1u, planes.y), fans = fans_of(entry);
        uint all = low < high ? (high - low) * fans : 0u;
        for (uint n = 0u; n < all; n++)
            made[at + n] = uvec4(entry.x, n % fans, low + n / fans, entry.w);
        at += all;
    }
}
