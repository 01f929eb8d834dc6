/* Sorting, the first half of a pass: how many entries of each chunk go to each bin. Radix sort from the
 * lowest digit on (Knuth, The Art of Computer Programming 3, 5.2.5), with a column of the table for each
 * invocation, so that it keeps the order of equals, and is the same each time. */
#define LIST_THREADS LIST_GROUP
#include "common_lists.glsl"

layout(location = 2) uniform uint farthest; /* plane that comes first */
layout(location = 3) uniform uint shift;    /* of the key: the pass' digit */
layout(location = 4) uniform uint chunks;   /* places for each bin */

layout(std430, binding = BINDING_LIST_FROM) readonly buffer From {
    uvec4 entries[];
};
layout(std430, binding = BINDING_LIST_SUMS) buffer Sums {
    uint sums[]; /* bin after bin, one place for each chunk */
};

/* By the last plane, the farthest first. */
uint bin_of(uvec4 entry) {
    return (farthest - entry.z) >> shift & uint(LIST_BINS - 1);
}

void main() {
    uint chunk = gl_GlobalInvocationID.x, begin = chunk * uint(LIST_SORT_CHUNK);
    if (chunk >= chunks)
        return;
    for (uint bin = 0u; bin < uint(LIST_BINS); bin++)
        sums[bin * chunks + chunk] = 0u;
    uint end = min(begin + uint(LIST_SORT_CHUNK), entry_count());
    for (uint i = begin; i < end; i++)
        sums[bin_of(entries[i]) * chunks + chunk]++;
}
