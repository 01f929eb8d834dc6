/* Content negotiation. For each type the most specific range that matches decides (type/subtype
 * over type slash star over star slash star), then the highest quality wins. Parameters other than
 * `q` make a range more specific than any type that Pelt has; they are ignored, as most servers do.
 */
#include "service/accept.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

/* "0", "0.5", "1.000": in thousandths; -1 for anything else. */
static int read_quality(const char *at, const char *end) {
    if (at == end || (*at != '0' && *at != '1'))
        return -1;
    int thousandths = (*at - '0') * 1000, unit = 100;
    if (++at < end && *at == '.')
        for (at++; at < end && isdigit((unsigned char)*at) && unit > 0; at++, unit /= 10)
            thousandths += (*at - '0') * unit;
    return at == end && thousandths <= 1000 ? thousandths : -1;
}

static void trim(const char **begin, const char **end) {
    while (*begin < *end && (**begin == ' ' || **begin == '\t'))
        ++*begin;
    while (*end > *begin && ((*end)[-1] == ' ' || (*end)[-1] == '\t'))
        --*end;
}

/* Where the element that starts here ends: at `separator`, outside of quoted strings. */
static const char *element_end(const char *at, const char *end, char separator) {
    for (int quoted = 0; at < end; at++) {
        if (*at == '"')
            quoted = !quoted;
        else if (quoted && *at == '\\' && at + 1 < end)
            at++;
        else if (!quoted && *at == separator)
            return at;
    }
    return end;
}

/* 0: no match; else the more specific, the larger. */
static int match(const char *begin, const char *end, const char *type) {
    size_t length = (size_t)(end - begin), full = strcspn(type, ";"); /* without parameters */
    if (length == full && strncasecmp(begin, type, full) == 0)
        return 3;
    if (length == 3 && memcmp(begin, "*/*", 3) == 0)
        return 1;
    const char *slash = strchr(type, '/');
    size_t family = slash ? (size_t)(slash - type) + 1 : 0;
    if (family > 0 && length == family + 1 && end[-1] == '*' &&
        strncasecmp(begin, type, family) == 0)
        return 2;
    return 0;
}

/* The quality that the header gives to one type, in thousandths. */
static int quality_of(const char *header, const char *type) {
    int best_match = 0, best_quality = 0;
    const char *end = header + strlen(header);
    for (const char *at = header; at < end;) {
        const char *stop = element_end(at, end, ',');
        const char *part_end = element_end(at, stop, ';');
        const char *begin = at, *range_end = part_end;
        trim(&begin, &range_end);
        int quality = 1000;
        while (part_end < stop) {
            const char *parameter = part_end + 1;
            part_end = element_end(parameter, stop, ';');
            const char *parameter_end = part_end;
            trim(&parameter, &parameter_end);
            if (parameter_end - parameter >= 2 && (*parameter | 0x20) == 'q' && parameter[1] == '=')
                quality = read_quality(parameter + 2, parameter_end);
        }
        int matched = quality >= 0 ? match(begin, range_end, type) : 0;
        if (matched > best_match || (matched == best_match && matched && quality > best_quality)) {
            best_match = matched;
            best_quality = quality;
        }
        at = stop + (stop < end);
    }
    return best_quality;
}

int accept_choose(const char *header, const char *const *types, size_t count) {
    int chosen = -1, best = 0;
    if (!header || !header[strspn(header, " \t,")])
        return count > 0 ? 0 : -1;
    for (size_t i = 0; i < count; i++) {
        int quality = quality_of(header, types[i]);
        if (quality > best) {
            best = quality;
            chosen = (int)i;
        }
    }
    return chosen;
}
