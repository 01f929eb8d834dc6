/* Which name may have been meant. */
#ifndef PELT_API_SPELLING_H
#define PELT_API_SPELLING_H

#include <stddef.h>

/* The optimal string alignment distance of two words: insertions, deletions, substitutions and
 * swaps of neighbours that lead from one to the other. Words of more than 31 bytes are taken as
 * entirely different (the length of the longer). */
size_t spelling_distance(const char *a, const char *b);

#endif
