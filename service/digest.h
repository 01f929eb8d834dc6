/* SHA-256, by GnuTLS: the key of assets, caches and the quarantine. */
#ifndef PELT_SERVICE_DIGEST_H
#define PELT_SERVICE_DIGEST_H

#include <stddef.h>

enum { DIGEST_BYTES = 32 };

struct digest {
    void *handle; /* gnutls_hash_hd_t */
};

/* Returns 0, or -1 where memory ran out or the library refuses (FIPS self-test). */
int digest_start(struct digest *digest);
int digest_add(struct digest *digest, const void *data, size_t bytes);
void digest_finish(struct digest *digest, unsigned char out[DIGEST_BYTES]); /* and releases it */
void digest_abandon(struct digest *digest); /* takes one that was never started or is finished */

#endif
