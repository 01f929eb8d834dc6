/* Which of the media types that can be made a client wants (RFC 9110, 12.5.1). */
#ifndef PELT_SERVICE_ACCEPT_H
#define PELT_SERVICE_ACCEPT_H

#include <stddef.h>

/* `header`: the Accept header's value, several lines joined by commas; NULL or empty accepts all.
 * `types`: the server's, the most wanted first; lower case. Returns the index of the type with the
 * highest quality, the first among equals; -1 where none is accepted. A range with a quality that
 * cannot be read counts as not there. */
int accept_choose(const char *header, const char *const *types, size_t count);

#endif
