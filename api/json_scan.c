/* The pass of json_scan.h: recursive descent over RFC 8259's grammar, at most depth_max deep.
 *
 * Duplicates: the members of the objects that are open lie on one stack; when an object ends, its
 * own are sorted and neighbours compared, so that 100,000 members cost n log n and nothing that a
 * request chooses can make it worse. */
#include "api/json_scan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_path.h"
#include "api/json_utf8.h"
#include "api/refusals.h"

struct key {
    const char *bytes;
    size_t length;
};

struct scan {
    char *text;
    size_t at, bytes;
    int depth, depth_max;
    struct json_path path;
    struct error *err;
    struct key *keys; /* of the objects that are open */
    size_t key_count, key_capacity;
    char *unescaped; /* keys that were written with escapes; as large as the text, made if needed */
    size_t unescaped_bytes;
    bool duplicates;
    enum status status; /* why the pass ended early */
};

static bool scan_value(struct scan *scan);

static bool out_of_memory(struct scan *scan) {
    scan->status = error_fault(scan->err, STATUS_OUT_OF_MEMORY, scan->path.text, "memory ran out");
    return false;
}

/* Ends the pass: what stands at the current place is not what the grammar wants there. */
static bool syntax(struct scan *scan, const char *wanted) {
    size_t line = 1, column = 1;
    for (size_t i = 0; i < scan->at; i++) {
        if (scan->text[i] == '\n') {
            line++;
            column = 1;
        } else if (((unsigned char)scan->text[i] & 0xC0) != 0x80) {
            column++;
        }
    }
    unsigned char found = scan->at < scan->bytes ? (unsigned char)scan->text[scan->at] : 0;
    if (scan->at >= scan->bytes)
        scan->status =
            refuse(scan->err, REFUSAL_SYNTAX, scan->path.text,
                   "line %zu, column %zu: expected %s, found the end", line, column, wanted);
    else if (found > 0x20 && found < 0x7F)
        scan->status =
            refuse(scan->err, REFUSAL_SYNTAX, scan->path.text,
                   "line %zu, column %zu: expected %s, found '%c'", line, column, wanted, found);
    else
        scan->status = refuse(scan->err, REFUSAL_SYNTAX, scan->path.text,
                              "line %zu, column %zu: expected %s, found byte 0x%02x", line, column,
                              wanted, found);
    return false;
}

static bool one_of(char c, const char *set) {
    return c != 0 && strchr(set, c) != NULL;
}

static void skip_space(struct scan *scan) {
    while (scan->at < scan->bytes && one_of(scan->text[scan->at], " \t\n\r"))
        scan->at++;
}

static bool next_is(struct scan *scan, char c) {
    skip_space(scan);
    return scan->at < scan->bytes && scan->text[scan->at] == c;
}

/* Puts a harmless value in the place of what was refused. */
static void mend(struct scan *scan, size_t begin, const char *value) {
    memset(scan->text + begin, ' ', scan->at - begin);
    memcpy(scan->text + begin, value, strlen(value));
}

static int hex_at(const char *text) {
    int value = 0;
    for (int i = 0; i < 4; i++) {
        char c = text[i];
        int digit = c >= '0' && c <= '9'   ? c - '0'
                    : c >= 'a' && c <= 'f' ? c - 'a' + 10
                    : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                           : -1;
        if (digit < 0)
            return -1;
        value = value * 16 + digit;
    }
    return value;
}

/* What a string was found to hold; its faults are reported once the place of it is known (a
 * member's name is refused at its object, a value at itself). */
struct string_faults {
    bool nul, encoding, escapes;
};

static bool scan_escape(struct scan *scan, struct string_faults *faults) {
    faults->escapes = true;
    scan->at++;
    if (scan->at >= scan->bytes)
        return syntax(scan, "an escape");
    char kind = scan->text[scan->at];
    if (one_of(kind, "\"\\/bfnrt")) {
        scan->at++;
        return true;
    }
    if (kind != 'u')
        return syntax(scan, "one of \" \\ / b f n r t u after a backslash");
    int code = scan->bytes - scan->at >= 5 ? hex_at(scan->text + scan->at + 1) : -1;
    if (code < 0)
        return syntax(scan, "four hexadecimal digits after \\u");
    char *digits = scan->text + scan->at + 1;
    scan->at += 5;
    if (code >= 0xD800 && code < 0xDC00 && scan->bytes - scan->at >= 6 &&
        scan->text[scan->at] == '\\' && scan->text[scan->at + 1] == 'u') {
        int low = hex_at(scan->text + scan->at + 2);
        if (low >= 0xDC00 && low < 0xE000) {
            scan->at += 6;
            return true;
        }
    }
    if (code == 0 || (code >= 0xD800 && code < 0xE000)) {
        *(code ? &faults->encoding : &faults->nul) = true;
        for (int i = 0; i < 4; i++)
            digits[i] = "003f"[i];
    }
    return true;
}

/* Leaves `at` behind the closing quote; *inside and *length are what the quotes enclose. */
static bool scan_string(struct scan *scan, const char **inside, size_t *length,
                        struct string_faults *faults) {
    *faults = (struct string_faults){0};
    size_t begin = ++scan->at;
    for (;;) {
        if (scan->at >= scan->bytes)
            return syntax(scan, "a closing quote");
        unsigned char c = (unsigned char)scan->text[scan->at];
        if (c == '"')
            break;
        if (c < 0x20)
            return syntax(scan, "no control character in a string");
        if (c == '\\') {
            if (!scan_escape(scan, faults))
                return false;
            continue;
        }
        size_t step = json_utf8_length(scan->text + scan->at, scan->bytes - scan->at);
        if (step == 0) {
            faults->encoding = true;
            scan->text[scan->at] = '?';
            step = 1;
        }
        scan->at += step;
    }
    *inside = scan->text + begin;
    *length = scan->at - begin;
    scan->at++;
    return true;
}

static void report_string(struct scan *scan, const struct string_faults *faults, const char *what) {
    if (faults->nul)
        refuse(scan->err, REFUSAL_NUL, scan->path.text, "%s", what);
    if (faults->encoding)
        refuse(scan->err, REFUSAL_ENCODING, scan->path.text, "%s", what);
}

static size_t put_utf8(char *out, int code) {
    if (code < 0x80) {
        out[0] = (char)code;
        return 1;
    }
    if (code < 0x800) {
        out[0] = (char)(0xC0 | code >> 6);
        out[1] = (char)(0x80 | (code & 0x3F));
        return 2;
    }
    if (code < 0x10000) {
        out[0] = (char)(0xE0 | code >> 12);
        out[1] = (char)(0x80 | (code >> 6 & 0x3F));
        out[2] = (char)(0x80 | (code & 0x3F));
        return 3;
    }
    out[0] = (char)(0xF0 | code >> 18);
    out[1] = (char)(0x80 | (code >> 12 & 0x3F));
    out[2] = (char)(0x80 | (code >> 6 & 0x3F));
    out[3] = (char)(0x80 | (code & 0x3F));
    return 4;
}

/* "a" and "\u0061" are one name. The result is never longer than what was written. */
static bool unescape(struct scan *scan, struct key *key) {
    if (!scan->unescaped && !(scan->unescaped = malloc(scan->bytes)))
        return out_of_memory(scan);
    char *out = scan->unescaped + scan->unescaped_bytes;
    size_t length = 0;
    for (size_t i = 0; i < key->length;) {
        if (key->bytes[i] != '\\') {
            out[length++] = key->bytes[i++];
            continue;
        }
        static const char from[] = "\"\\/bfnrt", to[] = "\"\\/\b\f\n\r\t";
        char kind = key->bytes[i + 1];
        if (kind != 'u') {
            out[length++] = to[strchr(from, kind) - from];
            i += 2;
            continue;
        }
        int code = hex_at(key->bytes + i + 2);
        i += 6;
        if (code >= 0xD800 &&
            code < 0xDC00) { /* scan_escape() has seen to it that a pair follows */
            code = 0x10000 + ((code - 0xD800) << 10) + (hex_at(key->bytes + i + 2) - 0xDC00);
            i += 6;
        }
        length += put_utf8(out + length, code);
    }
    scan->unescaped_bytes += length;
    *key = (struct key){out, length};
    return true;
}

static bool push_key(struct scan *scan, struct key key) {
    if (scan->key_count == scan->key_capacity) {
        size_t capacity = scan->key_capacity ? scan->key_capacity * 2 : 64;
        struct key *grown = realloc(scan->keys, capacity * sizeof *grown);
        if (!grown)
            return out_of_memory(scan);
        scan->keys = grown;
        scan->key_capacity = capacity;
    }
    scan->keys[scan->key_count++] = key;
    return true;
}

static int compare_keys(const void *a, const void *b) {
    const struct key *x = a, *y = b;
    int order = memcmp(x->bytes, y->bytes, x->length < y->length ? x->length : y->length);
    return order ? order : (x->length > y->length) - (x->length < y->length);
}

/* The members from `first` on are those of the object that ends here. */
static void report_duplicates(struct scan *scan, size_t first) {
    struct key *keys = scan->keys + first;
    size_t count = scan->key_count - first;
    if (count > 1)
        qsort(keys, count, sizeof *keys, compare_keys);
    for (size_t i = 1; i < count; i++) {
        if (compare_keys(&keys[i - 1], &keys[i]) != 0)
            continue;
        scan->duplicates = true;
        if (i > 1 && compare_keys(&keys[i - 2], &keys[i]) == 0)
            continue;
        size_t mark = json_path_enter(&scan->path, keys[i].bytes, keys[i].length);
        refuse(scan->err, REFUSAL_DUPLICATE, scan->path.text, "%s", "");
        json_path_leave(&scan->path, mark);
    }
    scan->key_count = first;
}

static bool scan_object(struct scan *scan) {
    size_t first = scan->key_count;
    scan->at++;
    if (next_is(scan, '}')) {
        scan->at++;
        return true;
    }
    for (;;) {
        if (!next_is(scan, '"'))
            return syntax(scan, "a member's name in quotes");
        struct key key = {0};
        struct string_faults faults;
        if (!scan_string(scan, &key.bytes, &key.length, &faults))
            return false;
        report_string(scan, &faults, "in a member's name");
        if ((faults.escapes && !unescape(scan, &key)) || !push_key(scan, key))
            return false;
        if (!next_is(scan, ':'))
            return syntax(scan, "a colon");
        scan->at++;
        size_t mark = json_path_enter(&scan->path, key.bytes, key.length);
        if (!scan_value(scan))
            return false;
        json_path_leave(&scan->path, mark);
        if (next_is(scan, ',')) {
            scan->at++;
            continue;
        }
        if (!next_is(scan, '}'))
            return syntax(scan, "a comma or a closing brace");
        scan->at++;
        report_duplicates(scan, first);
        return true;
    }
}

static bool scan_array(struct scan *scan) {
    scan->at++;
    if (next_is(scan, ']')) {
        scan->at++;
        return true;
    }
    for (size_t index = 0;; index++) {
        size_t mark = json_path_enter_index(&scan->path, index);
        if (!scan_value(scan))
            return false;
        json_path_leave(&scan->path, mark);
        if (next_is(scan, ',')) {
            scan->at++;
            continue;
        }
        if (!next_is(scan, ']'))
            return syntax(scan, "a comma or a closing bracket");
        scan->at++;
        return true;
    }
}

static bool scan_digits(struct scan *scan) {
    if (scan->at >= scan->bytes || scan->text[scan->at] < '0' || scan->text[scan->at] > '9')
        return syntax(scan, "a digit");
    while (scan->at < scan->bytes && scan->text[scan->at] >= '0' && scan->text[scan->at] <= '9')
        scan->at++;
    return true;
}

static bool scan_number(struct scan *scan) {
    size_t begin = scan->at;
    scan->at += scan->text[scan->at] == '-';
    if (scan->at < scan->bytes && scan->text[scan->at] == '0')
        scan->at++;
    else if (!scan_digits(scan))
        return false;
    if (scan->at < scan->bytes && scan->text[scan->at] == '.') {
        scan->at++;
        if (!scan_digits(scan))
            return false;
    }
    if (scan->at < scan->bytes && (scan->text[scan->at] == 'e' || scan->text[scan->at] == 'E')) {
        scan->at++;
        if (scan->at < scan->bytes && (scan->text[scan->at] == '+' || scan->text[scan->at] == '-'))
            scan->at++;
        if (!scan_digits(scan))
            return false;
    }
    char behind = scan->text[scan->at];
    scan->text[scan->at] = 0;
    bool overflow = isinf(strtod(scan->text + begin, NULL));
    if (overflow)
        refuse(scan->err, REFUSAL_OVERFLOW, scan->path.text, "%.32s", scan->text + begin);
    scan->text[scan->at] = behind;
    if (overflow)
        mend(scan, begin, "0");
    return true;
}

static bool scan_word(struct scan *scan) {
    static const struct {
        const char *word;
        bool refused;
    } words[] = {{"true", false},     {"false", false}, {"null", false}, {"NaN", true},
                 {"-NaN", true},      {"nan", true},    {"-nan", true},  {"Infinity", true},
                 {"-Infinity", true}, {"inf", true},    {"-inf", true}};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        size_t length = strlen(words[i].word);
        if (scan->bytes - scan->at < length ||
            memcmp(scan->text + scan->at, words[i].word, length) != 0)
            continue;
        size_t begin = scan->at;
        scan->at += length;
        if (words[i].refused) {
            refuse(scan->err, REFUSAL_NOT_A_NUMBER, scan->path.text, "%s", words[i].word);
            mend(scan, begin, "0");
        }
        return true;
    }
    return scan->text[scan->at] == '-' ? scan_number(scan) : syntax(scan, "a value");
}

static bool scan_nested(struct scan *scan, bool (*inside)(struct scan *)) {
    if (scan->depth == scan->depth_max) {
        scan->status = refuse(scan->err, REFUSAL_TOO_DEEP, scan->path.text, "at most %d levels",
                              scan->depth_max);
        return false;
    }
    scan->depth++;
    bool good = inside(scan);
    scan->depth--;
    return good;
}

static bool scan_value(struct scan *scan) {
    skip_space(scan);
    if (scan->at >= scan->bytes)
        return syntax(scan, "a value");
    switch (scan->text[scan->at]) {
    case '{':
        return scan_nested(scan, scan_object);
    case '[':
        return scan_nested(scan, scan_array);
    case '"': {
        const char *inside = NULL;
        size_t length = 0;
        struct string_faults faults;
        if (!scan_string(scan, &inside, &length, &faults))
            return false;
        report_string(scan, &faults, "");
        return true;
    }
    case '0':
    case '1':
    case '2':
    case '3':
    case '4':
    case '5':
    case '6':
    case '7':
    case '8':
    case '9':
        return scan_number(scan);
    default:
        return scan_word(scan);
    }
}

enum status json_scan(char *text, size_t bytes, int depth_max, bool *duplicates,
                      struct error *err) {
    struct scan scan = {.text = text, .bytes = bytes, .depth_max = depth_max, .err = err};
    if (scan_value(&scan)) {
        skip_space(&scan);
        if (scan.at < bytes)
            syntax(&scan, "the end");
    }
    free(scan.keys);
    free(scan.unescaped);
    *duplicates = scan.duplicates;
    return scan.status;
}
