/* Sums up: each of `count` numbers becomes the sum of those before it. One workgroup. */
#define LIST_THREADS LIST_WIDE
#include "common_lists.glsl"

layout(std430, binding = BINDING_LIST_SUMS) buffer Sums {
    uint sums[];
};

shared uint parts[LIST_WIDE];

void main() {
    uint t = gl_LocalInvocationID.x, share = (count + uint(LIST_WIDE) - 1u) / uint(LIST_WIDE);
    uint begin = min(t * share, count), end = min(begin + share, count), sum = 0u;
    for (uint i = begin; i < end; i++)
        sum += sums[i];
    parts[t] = sum;
    barrier();
    if (t == 0u) {
        uint before = 0u;
        for (uint i = 0u; i < uint(LIST_WIDE); i++) {
            uint part = parts[i];
            parts[i] = before;
            before += part;
        }
    }
    barrier();
    uint at = parts[t];
    for (uint i = begin; i < end; i++) {
        uint here = sums[i];
        sums[i] = at;
        at += here;
    }
}
