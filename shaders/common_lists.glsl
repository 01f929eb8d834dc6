/* Lists of what planes cut, made on the device: what its programs share. renderer/path/lists.h tells how
 * they follow one another. Put after LIST_THREADS, the size of a workgroup, is defined. */
layout(local_size_x = LIST_THREADS) in;

layout(location = 0) uniform uint count; /* of the entries, where they are not a batch's */
layout(location = 1) uniform int batch;  /* -1: all entries */

/* Batches of planes, farthest first, and where each plane of the group lies in its batch. */
layout(std430, binding = BINDING_LIST_BATCHES) buffer Batches {
    uvec4 batches[LIST_PLANES_MAX];     /* begin, end, entries */
    uvec2 plane_range[LIST_PLANES_MAX]; /* first entry, entries */
};

/* Of the picture's entries, or of a batch's after they were put into their planes. */
uint entry_count() {
    return batch < 0 ? count : batches[batch].z;
}

/* How many entries one makes in each of its planes: as many as polygons can be cut there. */
uint fans_of(uvec4 entry) {
    return entry.w == LIST_EVEN ? 1u : uint(LIST_FANS);
}
