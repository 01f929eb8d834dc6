/* The tables made from scene_members.def, and what can be asked of a row. */
#include "api/scene_members.h"

#include <assert.h>
#include <string.h>

#include "api/json_utf8.h"

/* A C type for each node, so that rows can name fields. */
#define NODE(id, type, ...) typedef type node_##id;
#include "api/scene_members.def"

#define AT(node, field)          (1 + offsetof(node_##node, field))
#define BIT(node, id)            (UINT64_C(1) << SCENE_ALTERNATIVE_##node##_##id)
#define KIND(node, field, value) .kind = AT(node, field), .kind_value = (value)
#define SUB(node, field, value)  .sub = AT(node, field), .sub_value = (value)

const struct scene_node_info scene_nodes[SCENE_NODE_COUNT] = {
#define NODE(id, type, text) {#id, text, sizeof(type), _Alignof(type)},
#include "api/scene_members.def"
};

const struct scene_alternative_info scene_alternatives[SCENE_ALTERNATIVE_COUNT] = {
#define ALTERNATIVE(node, id, key, value, text, ...)                                               \
    {SCENE_NODE_##node, key, value, text, __VA_ARGS__},
#include "api/scene_members.def"
};

#define CHOICES(id, ...) static const struct scene_choice choices_##id[] = {__VA_ARGS__};
#include "api/scene_members.def"

const struct scene_choice_list scene_choice_lists[SCENE_CHOICES_COUNT] = {
#define CHOICES(id, ...) {choices_##id, sizeof choices_##id / sizeof *choices_##id},
#include "api/scene_members.def"
};

/* An array has as many elements as its field holds; a plain field has none. */
#define FIELD_BYTES(node, field) sizeof(((node_##node *)0)->field)
#define ELEMENTS(node, field, type)                                                                \
    (FIELD_BYTES(node, field) == sizeof(type) ? 0 : FIELD_BYTES(node, field) / sizeof(type))

#define ROW(owner, name_, field_, kind_, text_, ...)                                               \
    {.node = SCENE_NODE_##owner,                                                                   \
     .name = (name_),                                                                              \
     .kind = MEMBER_##kind_,                                                                       \
     .text = (text_),                                                                              \
     .offset = offsetof(node_##owner, field_),                                                     \
     __VA_ARGS__},

#define ALL4(value)                                                                                \
    { value, value, value, value }
#define RANGE(a, b)          .min = ALL4(a), .max = ALL4(b)
#define EACH_MIN(...)        .min = {__VA_ARGS__}
#define EACH_MAX(...)        .max = {__VA_ARGS__}
#define VOXELS               .min = ALL4(1), .max = {SCENE_VOXELS_UV_MAX, SCENE_VOXELS_UV_MAX, SCENE_VOXELS_W_MAX}
#define DEFAULT(...)         .has_fallback = true, .fallback = {__VA_ARGS__}
#define FILLED               .has_fallback = true
#define REQUIRED             .required = true
#define OPTIONAL             .absent_if_zero = true
#define GIVEN(node, field)   .given = AT(node, field)
#define WHEN(node, a)        .when = BIT(node, a)
#define WHEN2(node, a, b)    .when = BIT(node, a) | BIT(node, b)
#define WHEN3(node, a, b, c) .when = BIT(node, a) | BIT(node, b) | BIT(node, c)
#define PATHS(path)          .paths = UINT64_C(1) << SCENE_PATH_##path
#define PATHS2(a, b)         .paths = UINT64_C(1) << SCENE_PATH_##a | UINT64_C(1) << SCENE_PATH_##b

const struct member scene_members[] = {
#define NUMBER(owner, name_, field_, unit_, text_, ...)                                            \
    ROW(owner, name_, field_, NUMBER, text_, .unit = (unit_),                                      \
        .count = ELEMENTS(owner, field_, double), __VA_ARGS__)
#define INTEGER(owner, name_, field_, unit_, text_, ...)                                           \
    ROW(owner, name_, field_, INTEGER, text_, .unit = (unit_),                                     \
        .count = ELEMENTS(owner, field_, int), __VA_ARGS__)
#define BOOLEAN(owner, name_, field_, text_, ...)                                                  \
    ROW(owner, name_, field_, BOOLEAN, text_, __VA_ARGS__)
#define ASSET(owner, name_, field_, text_, ...) ROW(owner, name_, field_, ASSET, text_, __VA_ARGS__)
#define CHOICE(owner, name_, field_, list_, text_, ...)                                            \
    ROW(owner, name_, field_, CHOICE, text_, .choices = SCENE_CHOICES_##list_, __VA_ARGS__)
#define NAME(owner, name_, field_, list_, text_, ...)                                              \
    ROW(owner, name_, field_, NAME, text_, .choices = SCENE_CHOICES_##list_, __VA_ARGS__)
#define OBJECT(owner, name_, field_, sub_, text_, ...)                                             \
    ROW(owner, name_, field_, OBJECT, text_, .sub_node = SCENE_NODE_##sub_, __VA_ARGS__)
#define ITSELF(owner, name_, sub_, text_, ...)                                                     \
    {.node = SCENE_NODE_##owner,                                                                   \
     .name = (name_),                                                                              \
     .kind = MEMBER_OBJECT,                                                                        \
     .text = (text_),                                                                              \
     .sub_node = SCENE_NODE_##sub_,                                                                \
     __VA_ARGS__},
#define LIST(owner, name_, field_, count_, sub_, least_, most_, text_, ...)                        \
    ROW(owner, name_, field_, LIST, text_, .sub_node = SCENE_NODE_##sub_, .length_min = (least_),  \
        .length_max = (most_), .count_offset = offsetof(node_##owner, count_), __VA_ARGS__)
#define PAIRS(owner, name_, field_, count_, least_, most_, text_, ...)                             \
    ROW(owner, name_, field_, PAIRS, text_, .length_min = (least_), .length_max = (most_),         \
        .count_offset = offsetof(node_##owner, count_), __VA_ARGS__)
#define TRANSFORM(owner, name_, field_, sub_, text_, ...)                                          \
    ROW(owner, name_, field_, TRANSFORM, text_, .sub_node = SCENE_NODE_##sub_, __VA_ARGS__)
#define SCENE(owner, name_, field_, text_, ...) ROW(owner, name_, field_, SCENE, text_, __VA_ARGS__)
#define POINTER(owner, name_, field_, text_, ...)                                                  \
    ROW(owner, name_, field_, POINTER, text_, __VA_ARGS__)
#define ANY(owner, name_, field_, text_, ...)  ROW(owner, name_, field_, ANY, text_, __VA_ARGS__)
#define TEXT(owner, name_, field_, text_, ...) ROW(owner, name_, field_, TEXT, text_, __VA_ARGS__)
#include "api/scene_members.def"
};

const size_t scene_member_count = sizeof scene_members / sizeof *scene_members;

static size_t element(size_t i) {
    return i < 4 ? i : 3;
}

double member_min(const struct member *member, size_t i) {
    return member->min[element(i)];
}

double member_max(const struct member *member, size_t i) {
    return member->max[element(i)];
}

bool member_active(const struct member *member, uint64_t alternative) {
    return member->when == 0 || (member->when & alternative) != 0;
}

static int int_at(const void *value, size_t offset_plus_1) {
    int result;
    memcpy(&result, (const char *)value + offset_plus_1 - 1, sizeof result);
    return result;
}

static bool bool_at(const void *value, size_t offset_plus_1) {
    bool result;
    memcpy(&result, (const char *)value + offset_plus_1 - 1, sizeof result);
    return result;
}

bool member_is_given(const struct member *member, const void *value) {
    const char *field = (const char *)value + member->offset;
    if (member->given)
        return bool_at(value, member->given) || member->has_fallback;
    if (member->absent_if_zero)
        return int_at(field, 1) != 0;
    if (member->kind == MEMBER_ASSET || member->kind == MEMBER_NAME ||
        member->kind == MEMBER_TEXT) {
        const char *text;
        memcpy(&text, field, sizeof text);
        return text != NULL;
    }
    if ((member->kind == MEMBER_LIST || member->kind == MEMBER_PAIRS) && member->required) {
        size_t length;
        memcpy(&length, (const char *)value + member->count_offset, sizeof length);
        return length > 0;
    }
    if (member->kind == MEMBER_OBJECT && !member->required && !member->has_fallback)
        return scene_alternative_of(member->sub_node, field) != 0;
    return true;
}

/* An alternative is told by its enum or flag where it has one, else by whether its key's member was
 * given; a node whose other alternatives are told so falls back to the one that is left. */
static bool holds(const struct scene_alternative_info *info, size_t index, const void *value) {
    if (info->kind && int_at(value, info->kind) != info->kind_value)
        return false;
    if (info->sub && int_at(value, info->sub) != info->sub_value)
        return false;
    if (info->flag)
        return bool_at(value, info->flag);
    if (info->kind || info->sub)
        return true;
    for (size_t i = 0; i < scene_member_count; i++)
        if (scene_members[i].node == info->node && info->key &&
            (scene_members[i].when & UINT64_C(1) << index) &&
            strcmp(scene_members[i].name, info->key) == 0)
            return member_is_given(&scene_members[i], value);
    return false;
}

uint64_t scene_alternative_of(enum scene_node node, const void *value) {
    uint64_t fallback = 0;
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++) {
        const struct scene_alternative_info *info = &scene_alternatives[i];
        if (info->node != node)
            continue;
        if (info->fallback)
            fallback = UINT64_C(1) << i;
        else if (holds(info, i, value))
            return UINT64_C(1) << i;
    }
    return fallback;
}

bool scene_asset_name_valid(const char *name) {
    size_t length = json_utf8_count(name);
    if (length == 0 || length > SCENE_ASSET_NAME_MAX || name[0] == '/')
        return false;
    for (const char *c = name; *c; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7F || *c == '\\')
            return false;
    for (const char *part = name; part; part = strchr(part, '/')) {
        part += *part == '/';
        if (part[0] == '.' && part[1] == '.' && (part[2] == '/' || part[2] == 0))
            return false;
    }
    if (strncmp(name, "sha256:", 7) == 0)
        return strspn(name + 7, "0123456789abcdef") == 64 && name[7 + 64] == 0;
    return true;
}
