/* Reads what is in one member, or its default: numbers within their range, names, assets, objects,
 * lists. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/json_out.h"
#include "api/json_utf8.h"
#include "api/scene_reader.h"

static void store_number(const struct member *member, void *out, size_t i, double value) {
    char *field = (char *)out + member->offset;
    if (member->kind == MEMBER_NUMBER) {
        memcpy(field + i * sizeof value, &value, sizeof value);
    } else { /* int and uint32_t keep the same 32 bits */
        uint32_t bits = value < 0 ? (uint32_t)(int32_t)value : (uint32_t)value;
        memcpy(field + i * sizeof bits, &bits, sizeof bits);
    }
}

/* Whether `json` is a number this element may have; a fault if not. */
static bool read_number(struct reader *reader, const struct member *member, size_t i, json_t *json,
                        double *value) {
    bool whole = member->kind != MEMBER_NUMBER;
    if (!json_is_number(json)) {
        reader_fault(reader, "must be %s, is %s", whole ? "an integer" : "a number",
                     reader_type_name(json));
        return false;
    }
    *value = json_number_value(json);
    char is[JSON_NUMBER_BYTES], limit[JSON_NUMBER_BYTES];
    json_number_text(*value, is);
    if (whole && *value != floor(*value)) {
        reader_fault(reader, "must be an integer, is %s", is);
    } else if (*value < member_min(member, i)) {
        json_number_text(member_min(member, i), limit);
        reader_fault(reader, "must be at least %s, is %s", limit, is);
    } else if (*value > member_max(member, i)) {
        json_number_text(member_max(member, i), limit);
        reader_fault(reader, "must be at most %s, is %s", limit, is);
    } else if (member->square && sqrt(*value) != floor(sqrt(*value))) {
        reader_fault(reader, "must be the square of an integer, is %s", is);
    } else {
        return true;
    }
    return false;
}

static void read_numbers(struct reader *reader, const struct member *member, json_t *json,
                         void *out) {
    double value;
    size_t count = member->count ? member->count : 1;
    if (!json) {
        for (size_t i = 0; i < count && member->has_fallback; i++)
            store_number(member, out, i, member->fallback[i]);
        return;
    }
    if (member->count == 0 || (member->broadcast && json_is_number(json))) {
        if (read_number(reader, member, 0, json, &value))
            for (size_t i = 0; i < count; i++)
                store_number(member, out, i, value);
        return;
    }
    if (!json_is_array(json)) {
        reader_fault(reader, "must be an array of %zu numbers, is %s", count,
                     reader_type_name(json));
        return;
    }
    if (json_array_size(json) != count)
        reader_fault(reader, "must have %zu elements, has %zu", count, json_array_size(json));
    for (size_t i = 0; i < count && i < json_array_size(json); i++) {
        size_t mark = json_path_enter_index(&reader->path, i);
        if (read_number(reader, member, i, json_array_get(json, i), &value))
            store_number(member, out, i, value);
        json_path_leave(&reader->path, mark);
    }
}

static bool is_boolean(const json_t *json) {
    json_type type = json_typeof(json);
    return type == JSON_TRUE || type == JSON_FALSE;
}

static void read_boolean(struct reader *reader, const struct member *member, json_t *json,
                         void *out) {
    bool value = member->fallback[0] != 0;
    if (json && !is_boolean(json))
        reader_fault(reader, "must be true or false, is %s", reader_type_name(json));
    else if (json && json_typeof(json) == JSON_TRUE && member->only_false)
        reader_fault(reader, "must be false here");
    else if (json)
        value = json_typeof(json) == JSON_TRUE;
    memcpy((char *)out + member->offset, &value, sizeof value);
}

/* A choice keeps its enum's value, a name its text. */
static void read_choice(struct reader *reader, const struct member *member, json_t *json,
                        void *out) {
    char *field = (char *)out + member->offset;
    const struct scene_choice_list *list = &scene_choice_lists[member->choices];
    if (!json) {
        int value = (int)member->fallback[0];
        if (member->kind == MEMBER_CHOICE)
            memcpy(field, &value, sizeof value);
        return;
    }
    const char *text = json_string_value(json);
    for (size_t i = 0; text && i < list->count; i++) {
        if (strcmp(list->choice[i].name, text) != 0)
            continue;
        if (member->kind == MEMBER_CHOICE)
            memcpy(field, &list->choice[i].value, sizeof list->choice[i].value);
        else
            memcpy(field, &list->choice[i].name, sizeof list->choice[i].name);
        return;
    }
    char names[256] = "";
    for (size_t i = 0; i < list->count; i++)
        snprintf(names + strlen(names), sizeof names - strlen(names), "%s`%s`", i ? ", " : "",
                 list->choice[i].name);
    reader_fault(reader, "must be one of %s", names);
}

static void read_asset(struct reader *reader, const struct member *member, json_t *json,
                       void *out) {
    if (!json)
        return;
    const char *name = json_string_value(json);
    if (!name) {
        reader_fault(reader, "must be the name of an asset, is %s", reader_type_name(json));
        return;
    }
    if (!scene_asset_name_valid(name)) {
        reader_fault(reader,
                     "not the name of an asset: a relative path of at most %d characters without "
                     "`..`, backslashes and control characters, or `sha256:` and 64 lower-case "
                     "hexadecimal digits",
                     SCENE_ASSET_NAME_MAX);
        return;
    }
    const char *copy = arena_strdup(reader->arena, name);
    reader->out_of_memory = reader->out_of_memory || !copy;
    memcpy((char *)out + member->offset, &copy, sizeof copy);
}

static bool read_length(struct reader *reader, const struct member *member, json_t *json) {
    size_t length = json_array_size(json);
    if (!json_is_array(json))
        reader_fault(reader, "must be an array, is %s", reader_type_name(json));
    else if (length < member->length_min)
        reader_fault(reader, "must have at least %zu elements, has %zu", member->length_min,
                     length);
    else if (length > member->length_max)
        reader_fault(reader, "must have at most %zu elements, has %zu", member->length_max, length);
    else
        return true;
    return false;
}

static void *allocate(struct reader *reader, const struct member *member, size_t count,
                      size_t bytes, void *out) {
    void *list = arena_alloc(reader->arena, count, bytes);
    if (!list) {
        reader->out_of_memory = true;
        return NULL;
    }
    memcpy((char *)out + member->offset, &list, sizeof list);
    memcpy((char *)out + member->count_offset, &count, sizeof count);
    return list;
}

static void read_list(struct reader *reader, const struct member *member, json_t *json, void *out) {
    size_t count = member->has_fallback, bytes = scene_nodes[member->sub_node].bytes;
    if (json) {
        if (!read_length(reader, member, json))
            return;
        count = json_array_size(json);
    }
    char *list = allocate(reader, member, count, bytes, out);
    for (size_t i = 0; list && i < count; i++) {
        size_t mark = json_path_enter_index(&reader->path, i);
        reader_node(reader, member->sub_node, json ? json_array_get(json, i) : NULL,
                    list + i * bytes);
        json_path_leave(&reader->path, mark);
    }
}

static void read_pairs(struct reader *reader, const struct member *member, json_t *json,
                       void *out) {
    if (!json || !read_length(reader, member, json))
        return;
    size_t count = json_array_size(json);
    uint32_t(*pairs)[2] = allocate(reader, member, count, sizeof *pairs, out);
    for (size_t i = 0; pairs && i < count; i++) {
        json_t *pair = json_array_get(json, i);
        size_t mark = json_path_enter_index(&reader->path, i);
        if (!json_is_array(pair) || json_array_size(pair) != 2)
            reader_fault(reader, "must be an array of 2 indices");
        for (size_t k = 0; k < 2 && k < json_array_size(pair); k++) {
            double value;
            size_t inner = json_path_enter_index(&reader->path, k);
            if (read_number(reader, member, 0, json_array_get(pair, k), &value))
                pairs[i][k] = (uint32_t)value;
            json_path_leave(&reader->path, inner);
        }
        json_path_leave(&reader->path, mark);
    }
}

/* The object keeps the product; its parts live only here. */
static void read_transform(struct reader *reader, const struct member *member, json_t *json,
                           void *out) {
    struct scene_transform transform = {0};
    reader_node(reader, member->sub_node, json, &transform);
    scene_transform_compose(&transform);
    memcpy((char *)out + member->offset, transform.matrix, sizeof transform.matrix);
}

static void read_free_text(struct reader *reader, const struct member *member, json_t *json,
                           void *out) {
    const char *text = json_string_value(json);
    size_t length = text ? json_utf8_count(text) : 0;
    if (!json)
        return;
    if (length < 1 || length > SCENE_TEXT_MAX) {
        reader_fault(reader, "must be a text of 1 to %d characters", SCENE_TEXT_MAX);
        return;
    }
    const char *copy = arena_strdup(reader->arena, text);
    reader->out_of_memory = reader->out_of_memory || !copy;
    memcpy((char *)out + member->offset, &copy, sizeof copy);
}

static void read_pointer(struct reader *reader, const struct member *member, json_t *json,
                         void *out) {
    const char *text = json_string_value(json);
    if (json && !text) {
        reader_fault(reader, "must be a JSON Pointer, is %s", reader_type_name(json));
        return;
    }
    const char *copy = arena_strdup(reader->arena, text ? text : "");
    reader->out_of_memory = reader->out_of_memory || !copy;
    memcpy((char *)out + member->offset, &copy, sizeof copy);
}

void reader_value(struct reader *reader, const struct member *member, json_t *json, void *out) {
    if (member->given)
        memcpy((char *)out + member->given - 1, &(bool){json != NULL}, sizeof(bool));
    switch (member->kind) {
    case MEMBER_NUMBER:
    case MEMBER_INTEGER:
        read_numbers(reader, member, json, out);
        break;
    case MEMBER_BOOLEAN:
        read_boolean(reader, member, json, out);
        break;
    case MEMBER_CHOICE:
    case MEMBER_NAME:
        read_choice(reader, member, json, out);
        break;
    case MEMBER_ASSET:
        read_asset(reader, member, json, out);
        break;
    case MEMBER_OBJECT:
        reader_node(reader, member->sub_node, json, (char *)out + member->offset);
        break;
    case MEMBER_LIST:
        read_list(reader, member, json, out);
        break;
    case MEMBER_PAIRS:
        read_pairs(reader, member, json, out);
        break;
    case MEMBER_TRANSFORM:
        read_transform(reader, member, json, out);
        break;
    case MEMBER_POINTER:
        read_pointer(reader, member, json, out);
        break;
    case MEMBER_TEXT:
        read_free_text(reader, member, json, out);
        break;
    case MEMBER_SCENE:
    case MEMBER_ANY: { /* the tree outlives the struct */
        const void *tree = json;
        memcpy((char *)out + member->offset, &tree, sizeof tree);
        break;
    }
    }
}
