/* SHA-256 by GnuTLS, in the few calls that the rest of the service uses. */
#include "service/digest.h"

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

int digest_start(struct digest *digest) {
    gnutls_hash_hd_t handle = NULL;
    if (gnutls_hash_init(&handle, GNUTLS_DIG_SHA256) != 0)
        return -1;
    digest->handle = handle;
    return 0;
}

int digest_add(struct digest *digest, const void *data, size_t bytes) {
    return gnutls_hash(digest->handle, data, bytes) == 0 ? 0 : -1;
}

void digest_finish(struct digest *digest, unsigned char out[DIGEST_BYTES]) {
    gnutls_hash_deinit(digest->handle, out);
    digest->handle = NULL;
}

void digest_abandon(struct digest *digest) {
    if (digest->handle)
        gnutls_hash_deinit(digest->handle, NULL);
    digest->handle = NULL;
}
