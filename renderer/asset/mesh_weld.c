/* Welding: corners at the same position become one vertex, to the bit and without a tolerance.
 *
 * Why to the bit: a tolerance would close what is meant to be open and would not be transitive.
 * Exporters write the same float for both sides of a UV seam, and built-in shapes compute seams to
 * the bit, so equality is enough.
 *
 * An open-addressing hash table, grown at half load. Its hash is keyed at random: an asset whose
 * points all collide would otherwise cost hours. The numbering follows first appearance and does
 * not depend on the key, so meshes stay the same from run to run. */
#include "renderer/asset/mesh_build.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

struct table {
    uint32_t *slot; /* MESH_NONE: free */
    size_t mask;
    uint64_t key[2];
};

/* Folded multiplication (Wang Yi, wyhash): 128-bit product, halves xored. */
static uint64_t fold(uint64_t a, uint64_t b) {
    __extension__ typedef unsigned __int128 u128;
    u128 product = (u128)a * b;
    return (uint64_t)product ^ (uint64_t)(product >> 64);
}

static uint64_t hash(const struct table *table, const double p[3]) {
    uint64_t bits[3];
    for (int k = 0; k < 3; k++) {
        double value = p[k] + 0.0; /* -0 becomes 0 */
        memcpy(&bits[k], &value, sizeof value);
    }
    uint64_t h = fold(bits[0] ^ table->key[0], bits[1] ^ table->key[1]);
    return fold(h ^ bits[2] ^ table->key[1], 0x9e3779b97f4a7c15u ^ table->key[0]);
}

static bool table_resize(struct table *table, size_t slots, const double (*position)[3],
                         const uint32_t *first, uint32_t distinct) {
    uint32_t *slot = malloc(slots * sizeof *slot);
    if (!slot)
        return false;
    memset(slot, 0xff, slots * sizeof *slot);
    free(table->slot);
    table->slot = slot;
    table->mask = slots - 1;
    for (uint32_t i = 0; i < distinct; i++) {
        size_t at = hash(table, position[first[i]]) & table->mask;
        while (slot[at] != MESH_NONE)
            at = (at + 1) & table->mask;
        slot[at] = i;
    }
    return true;
}

bool mesh_weld(const double (*position)[3], uint32_t count, uint32_t *id, uint32_t *first,
               uint32_t *distinct) {
    struct table table = {0};
    *distinct = 0;
    if (getrandom(table.key, sizeof table.key, GRND_NONBLOCK) != (ssize_t)sizeof table.key) {
        /* Early at boot or barred by a sandbox: addresses are random enough to be hard to guess. */
        table.key[0] = (uint64_t)(uintptr_t)&table * 0x9e3779b97f4a7c15u;
        table.key[1] = (uint64_t)(uintptr_t)position * 0xc2b2ae3d27d4eb4fu;
    }
    if (!table_resize(&table, 1024, position, first, 0))
        return false;
    for (uint32_t i = 0; i < count; i++) {
        size_t at = hash(&table, position[i]) & table.mask;
        const double *p = position[i];
        for (;; at = (at + 1) & table.mask) {
            uint32_t known = table.slot[at];
            if (known == MESH_NONE)
                break;
            const double *q = position[first[known]];
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2])
                break;
        }
        if (table.slot[at] == MESH_NONE) {
            table.slot[at] = *distinct;
            first[(*distinct)++] = i;
        }
        id[i] = table.slot[at];
        if ((size_t)*distinct * 2 > table.mask &&
            !table_resize(&table, (table.mask + 1) * 2, position, first, *distinct)) {
            free(table.slot);
            return false;
        }
    }
    free(table.slot);
    return true;
}
