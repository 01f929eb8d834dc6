/* How many entries each chunk of prisms makes in the planes of a batch. */
#define LIST_THREADS LIST_GROUP
#include "common_lists.glsl"

layout(std430, binding = BINDING_LIST_FROM) readonly buffer From {
    uvec4 entries[];
};
layout(std430, binding = BINDING_LIST_SUMS) writeonly buffer Sums {
    uint sums[];
};

void main() {
    uint chunk = gl_GlobalInvocationID.x, begin = chunk * uint(LIST_CHUNK);
    if (begin >= count)
        return;
    uvec4 planes = batches[batch];
    uint sum = 0u, end = min(begin + uint(LIST_CHUNK), count);
    for (uint i = begin; i < end; i++) {
        uvec4 entry = entries[i];
        uint low = max(entry.y, planes.x), high = min(entry.z + 1u, planes.y);
        sum += low < high ? (high - low) * fans_of(entry) : 0u;
    }
    sums[chunk] = sum;
}
