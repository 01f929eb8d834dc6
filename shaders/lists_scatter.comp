/* Sorting, the second half of a pass (lists_count.comp): entries to their bins. */
#define LIST_THREADS LIST_GROUP
#include "common_lists.glsl"

layout(location = 2) uniform uint farthest; /* plane that comes first */
layout(location = 3) uniform uint shift;    /* of the key: the pass' digit */
layout(location = 4) uniform uint chunks;   /* places for each bin */

layout(std430, binding = BINDING_LIST_FROM) readonly buffer From {
    uvec4 entries[];
};
layout(std430, binding = BINDING_LIST_TO) writeonly buffer To {
    uvec4 sorted[];
};
layout(std430, binding = BINDING_LIST_SUMS) buffer Sums {
    uint sums[]; /* summed up: where each chunk's share of each bin begins */
};

/* By the last plane, the farthest first. */
uint bin_of(uvec4 entry) {
    return (farthest - entry.z) >> shift & uint(LIST_BINS - 1);
}

void main() {
    uint chunk = gl_GlobalInvocationID.x, begin = chunk * uint(LIST_SORT_CHUNK);
    uint end = min(begin + uint(LIST_SORT_CHUNK), entry_count());
    for (uint i = begin; i < end; i++) {
        uvec4 entry = entries[i];
        sorted[sums[bin_of(entry) * chunks + chunk]++] = entry;
    }
}
