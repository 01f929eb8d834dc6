/* Boytsov, "Indexing methods for approximate dictionary searching", J. Exp. Algorithmics 16, 2011,
 * section 2.1: Levenshtein's recurrence with transpositions, three rows at a time. */
#include "api/spelling.h"

#include <string.h>

enum { WORD_BYTES = 32 };

static size_t least(size_t a, size_t b) {
    return a < b ? a : b;
}

size_t spelling_distance(const char *a, const char *b) {
    size_t n = strlen(a), m = strlen(b);
    if (n >= WORD_BYTES || m >= WORD_BYTES)
        return n > m ? n : m;
    size_t rows[3][WORD_BYTES] = {{0}};
    for (size_t j = 0; j <= m; j++)
        rows[0][j] = j;
    for (size_t i = 1; i <= n; i++) {
        size_t *row = rows[i % 3];
        const size_t *above = rows[(i + 2) % 3], *two_above = rows[(i + 1) % 3];
        row[0] = i;
        for (size_t j = 1; j <= m; j++) {
            row[j] = least(above[j - 1] + (a[i - 1] != b[j - 1]), least(above[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = least(row[j], two_above[j - 2] + 1);
        }
    }
    return rows[n % 3][m];
}
