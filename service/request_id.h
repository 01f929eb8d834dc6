/* Names of requests, as X-Request-Id, the log and problem documents carry them. */
#ifndef PELT_SERVICE_REQUEST_ID_H
#define PELT_SERVICE_REQUEST_ID_H

#include <stdbool.h>

enum { REQUEST_ID_BYTES = 65 }; /* with the terminating 0 */

void request_id_make(char id[REQUEST_ID_BYTES]); /* 16 random hexadecimal digits */

/* Takes the client's own where it is 1 to 64 characters of A-Z a-z 0-9 . _ : + / = and -; else
 * false, and `id` is left alone. NULL is no id. */
bool request_id_take(char id[REQUEST_ID_BYTES], const char *from_client);

#endif
