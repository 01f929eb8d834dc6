/* Triangles as a glTF binary, in memory: for meshes that no built-in shape makes. See matrix.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/stability/matrix.h"

static void append(struct blob *blob, const void *data, size_t bytes) {
    if (blob->size + bytes > blob->capacity) {
        blob->capacity = 2 * (blob->size + bytes);
        blob->data = realloc(blob->data, blob->capacity);
        if (!blob->data)
            abort();
    }
    memcpy(blob->data + blob->size, data, bytes);
    blob->size += bytes;
}

static void append_u32(struct blob *blob, uint32_t value) {
    append(blob, &value, sizeof value);
}

/* glTF is Y-up: Pelt's (x, y, z) is its (x, z, -y). */
static void append_vectors(struct blob *blob, const float (*v)[3], uint32_t count) {
    for (uint32_t i = 0; i < count; i++)
        append(blob, (float[3]){v[i][0], v[i][2], -v[i][1]}, 3 * sizeof(float));
}

void matrix_write_glb(struct blob *glb, const float (*position)[3], const float (*normal)[3],
                      uint32_t vertices, const uint32_t (*triangle)[3], uint32_t triangles) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t v = 0; v < vertices; v++) {
        float p[3] = {position[v][0], position[v][2], -position[v][1]};
        for (int i = 0; i < 3; i++) {
            low[i] = fminf(low[i], p[i]);
            high[i] = fmaxf(high[i], p[i]);
        }
    }
    uint32_t vector_bytes = vertices * 12, index_bytes = triangles * 12;
    uint32_t bin_bytes = vector_bytes * (normal ? 2 : 1) + index_bytes;
    char json[2048];
    int length = snprintf(
        json, sizeof json,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
        "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0%s},"
        "\"indices\":1}]}],\"buffers\":[{\"byteLength\":%u}],\"bufferViews\":["
        "{\"buffer\":0,\"byteOffset\":0,\"byteLength\":%u},"
        "{\"buffer\":0,\"byteOffset\":%u,\"byteLength\":%u}%s",
        normal ? ",\"NORMAL\":2" : "", bin_bytes, vector_bytes, vector_bytes, index_bytes,
        normal ? "," : "");
    if (normal)
        length += snprintf(json + length, sizeof json - (size_t)length,
                           "{\"buffer\":0,\"byteOffset\":%u,\"byteLength\":%u}",
                           vector_bytes + index_bytes, vector_bytes);
    length += snprintf(
        json + length, sizeof json - (size_t)length,
        "],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":%u,\"type\":\"VEC3\","
        "\"min\":[%.9g,%.9g,%.9g],\"max\":[%.9g,%.9g,%.9g]},"
        "{\"bufferView\":1,\"componentType\":5125,\"count\":%u,\"type\":\"SCALAR\"}%s",
        vertices, (double)low[0], (double)low[1], (double)low[2], (double)high[0], (double)high[1],
        (double)high[2], triangles * 3, normal ? "," : "");
    if (normal)
        length += snprintf(
            json + length, sizeof json - (size_t)length,
            "{\"bufferView\":2,\"componentType\":5126,\"count\":%u,\"type\":\"VEC3\"}", vertices);
    length += snprintf(json + length, sizeof json - (size_t)length, "]}");
    while (length % 4)
        json[length++] = ' ';
    *glb = (struct blob){0};
    append(glb, "glTF", 4);
    append_u32(glb, 2);
    append_u32(glb, 12 + 8 + (uint32_t)length + 8 + bin_bytes);
    append_u32(glb, (uint32_t)length);
    append(glb, "JSON", 4);
    append(glb, json, (size_t)length);
    append_u32(glb, bin_bytes);
    append(glb, "BIN\0", 4);
    append_vectors(glb, position, vertices);
    append(glb, triangle, index_bytes);
    if (normal)
        append_vectors(glb, normal, vertices);
}
