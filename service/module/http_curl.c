/* libcurl behind one function: a multipart POST and its answer.
 *
 * Left out: redirects (a daemon sends none, and a POST would be repeated), cookies, other
 * protocols than HTTP and HTTPS. Proxies are taken from the environment, as curl does. */
#include "service/module/http_curl.h"

#include <curl/curl.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { CONNECT_SECONDS = 10, TOTAL_SECONDS = 600 };

struct answer {
    struct http_response *response;
    size_t capacity, body_max;
    bool too_large;
};

static size_t take_body(char *data, size_t size, size_t count, void *user) {
    struct answer *answer = user;
    struct http_response *response = answer->response;
    size_t bytes = size * count;
    if (bytes > answer->body_max - response->bytes) {
        answer->too_large = true;
        return 0;
    }
    if (answer->capacity - response->bytes <= bytes) {
        size_t capacity = 2 * answer->capacity + bytes + 4096;
        unsigned char *grown = realloc(response->body, capacity);
        if (!grown)
            return 0;
        response->body = grown;
        answer->capacity = capacity;
    }
    memcpy(response->body + response->bytes, data, bytes);
    response->bytes += bytes;
    response->body[response->bytes] = 0;
    return bytes;
}

/* The value of one header line, if it is this header's. */
static void take_value(const char *line, size_t bytes, const char *name, char *value, size_t room) {
    size_t skip = strlen(name);
    if (bytes <= skip || strncasecmp(line, name, skip) != 0)
        return;
    while (skip < bytes && (line[skip] == ' ' || line[skip] == '\t'))
        skip++;
    while (bytes > skip && (line[bytes - 1] == '\r' || line[bytes - 1] == '\n'))
        bytes--;
    snprintf(value, room, "%.*s", (int)(bytes - skip), line + skip);
}

static size_t take_header(char *line, size_t size, size_t count, void *user) {
    struct answer *answer = user;
    take_value(line, size * count, "content-type:", answer->response->type,
               sizeof answer->response->type);
    take_value(line, size * count, "server-timing:", answer->response->timing,
               sizeof answer->response->timing);
    return size * count;
}

static bool add_parts(curl_mime *mime, const struct http_part *parts, size_t count) {
    for (size_t i = 0; i < count; i++) {
        curl_mimepart *part = curl_mime_addpart(mime);
        if (!part || curl_mime_name(part, parts[i].name) != CURLE_OK ||
            curl_mime_filename(part, parts[i].name) != CURLE_OK ||
            curl_mime_type(part, parts[i].type) != CURLE_OK ||
            curl_mime_data(part, (const char *)parts[i].data, parts[i].bytes) != CURLE_OK)
            return false;
    }
    return true;
}

static int post(const char *url, const char *accept, const struct http_part *parts, size_t count,
                size_t body_max, struct http_response *response, char *message,
                size_t message_bytes) {
    *response = (struct http_response){0};
    struct answer answer = {.response = response, .body_max = body_max};
    char error[CURL_ERROR_SIZE] = "";
    char accept_line[160];
    snprintf(accept_line, sizeof accept_line, "Accept: %s", accept);
    CURLcode code = CURLE_OUT_OF_MEMORY;
    struct curl_slist *headers = NULL, *grown;
    curl_mime *mime = NULL;
    CURL *curl = curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK ? curl_easy_init() : NULL;
    if (!curl || !(mime = curl_mime_init(curl)) || !add_parts(mime, parts, count))
        goto done;
    /* curl would otherwise ask whether to go on, and wait a second for servers that do not say. */
    if (!(headers = curl_slist_append(NULL, accept_line)) ||
        !(grown = curl_slist_append(headers, "Expect:")))
        goto done;
    headers = grown;
    if ((code = curl_easy_setopt(curl, CURLOPT_URL, url)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https")) != CURLE_OK ||
        /* Quotes in names by a backslash: as %22, curl's default, they would be a name with %22. */
        (code = curl_easy_setopt(curl, CURLOPT_MIME_OPTIONS, (long)CURLMIMEOPT_FORMESCAPE)) !=
            CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_MIMEPOST, mime)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, take_body)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_WRITEDATA, &answer)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, take_header)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_HEADERDATA, &answer)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, error)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L)) != CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, (long)CONNECT_SECONDS)) !=
            CURLE_OK ||
        (code = curl_easy_setopt(curl, CURLOPT_TIMEOUT, (long)TOTAL_SECONDS)) != CURLE_OK)
        goto done;
    code = curl_easy_perform(curl);
    if (code == CURLE_OK)
        code = curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &response->status);
done:
    if (code != CURLE_OK) {
        snprintf(message, message_bytes, "%s",
                 answer.too_large ? "the answer is too large"
                 : error[0]       ? error
                                  : curl_easy_strerror(code));
        free(response->body);
        *response = (struct http_response){0};
    }
    curl_slist_free_all(headers);
    curl_mime_free(mime);
    curl_easy_cleanup(curl);
    return code != CURLE_OK;
}

static const char *version(void) {
    return curl_version_info(CURLVERSION_NOW)->version;
}

__attribute__((visibility("default"))) extern const struct http_module pelt_http_module;
const struct http_module pelt_http_module = {.post = post, .version = version};
