/* Which variants of a program the checks compile. All that make sense are thousands, hours of
 * glslang; a variant breaks by how few of its flags meet, so that of any two flags (or three) every
 * combination of values that occurs is in one that is taken (Kuhn, Wallace & Gallo 2004: of faults,
 * pairs show nine in ten, and threes all but some per cent). `make check` takes pairs;
 * tests/check/shaders.sh takes 3, or all.
 */
#ifndef PELT_TESTS_TOOLS_VARIANT_COVER_H
#define PELT_TESTS_TOOLS_VARIANT_COVER_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "renderer/gl/program.h"

enum { COVER_FLAGS_MAX = 24 };

struct variant_cover {
    enum gl_program_id id;
    int together; /* how many flags at a time: 2 or 3 */
    int count;    /* of flags */
    uint32_t flag[COVER_FLAGS_MAX];
    bool seen[COVER_FLAGS_MAX][COVER_FLAGS_MAX][COVER_FLAGS_MAX][8];
};

static inline void variant_cover_init(struct variant_cover *cover, enum gl_program_id id,
                                      int together) {
    memset(cover, 0, sizeof *cover);
    cover->id = id;
    cover->together = together;
    for (int bit = 0; bit < 32 && cover->count < COVER_FLAGS_MAX; bit++)
        if (gl_program_flags(id) >> bit & 1)
            cover->flag[cover->count++] = (uint32_t)1 << bit;
}

/* Whether a variant that makes sense has a combination that none before it had. Each variant of a
 * program is to be asked about once. */
static inline bool variant_cover_takes(struct variant_cover *cover, uint32_t variant) {
    bool takes = cover->count < 3;
    for (int i = 0; i < cover->count; i++)
        for (int j = 0; j < i; j++)
            for (int k = 0; k < (cover->together == 3 ? j : 1); k++) {
                bool third = cover->together == 3 && (variant & cover->flag[k]);
                int values = (variant & cover->flag[i] ? 1 : 0) |
                             (variant & cover->flag[j] ? 2 : 0) | (third ? 4 : 0);
                takes |= !cover->seen[i][j][k][values];
                cover->seen[i][j][k][values] = true;
            }
    return takes;
}

#endif
