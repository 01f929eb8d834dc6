/* Names of requests: taken from the client where they are plain, else made from random bytes. */
#include "service/request_id.h"

#include <stdio.h>
#include <string.h>
#include <sys/random.h>

#include "service/monotonic.h"

void request_id_make(char id[REQUEST_ID_BYTES]) {
    unsigned long long bits = 0;
    /* Before the kernel's pool is ready (early boot) the clock is as good: ids need not be secret.
     */
    if (getrandom(&bits, sizeof bits, GRND_NONBLOCK) != (ssize_t)sizeof bits)
        bits = (unsigned long long)(monotonic_ms() * 1e6);
    snprintf(id, REQUEST_ID_BYTES, "%016llx", bits);
}

bool request_id_take(char id[REQUEST_ID_BYTES], const char *from_client) {
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                  "0123456789._:+/=-";
    if (!from_client)
        return false;
    size_t length = strlen(from_client);
    if (length == 0 || length >= REQUEST_ID_BYTES || strspn(from_client, allowed) != length)
        return false;
    memcpy(id, from_client, length + 1);
    return true;
}
