/* Scene to JSON along the table of members, every number so that it reads back to the last bit; and
 * the walk over the assets that a scene names. */
#include <string.h>

#include "api/json_out.h"
#include "api/json_path.h"
#include "api/scene_members.h"

static void write_node(struct json_out *out, enum scene_node node, const void *value);

static double number_at(const struct member *member, const char *field, size_t i) {
    if (member->kind == MEMBER_NUMBER) {
        double value;
        memcpy(&value, field + i * sizeof value, sizeof value);
        return value;
    }
    uint32_t bits;
    memcpy(&bits, field + i * sizeof bits, sizeof bits);
    /* Only seeds reach past an int. */
    return member_max(member, i) > INT32_MAX ? (double)bits : (double)(int32_t)bits;
}

static void write_numbers(struct json_out *out, const struct member *member, const char *field) {
    if (member->count)
        json_out_open(out, '[');
    for (size_t i = 0; i < (member->count ? member->count : 1); i++)
        json_out_number(out, number_at(member, field, i));
    if (member->count)
        json_out_close(out, ']');
}

static void write_choice(struct json_out *out, const struct member *member, const char *field) {
    const struct scene_choice_list *list = &scene_choice_lists[member->choices];
    int value;
    memcpy(&value, field, sizeof value);
    for (size_t i = 0; i < list->count; i++)
        if (list->choice[i].value == value)
            json_out_string(out, list->choice[i].name);
}

static size_t length_of(const struct member *member, const char *value) {
    size_t length;
    memcpy(&length, value + member->count_offset, sizeof length);
    return length;
}

static void write_list(struct json_out *out, const struct member *member, const char *value) {
    const char *list;
    memcpy(&list, value + member->offset, sizeof list);
    json_out_open(out, '[');
    for (size_t i = 0; i < length_of(member, value); i++) {
        if (member->kind == MEMBER_LIST) {
            write_node(out, member->sub_node, list + i * scene_nodes[member->sub_node].bytes);
            continue;
        }
        uint32_t pair[2];
        memcpy(pair, list + i * sizeof pair, sizeof pair);
        json_out_open(out, '[');
        json_out_unsigned(out, pair[0]);
        json_out_unsigned(out, pair[1]);
        json_out_close(out, ']');
    }
    json_out_close(out, ']');
}

static void write_value(struct json_out *out, const struct member *member, const char *value) {
    const char *field = value + member->offset, *text;
    switch (member->kind) {
    case MEMBER_NUMBER:
    case MEMBER_INTEGER:
        write_numbers(out, member, field);
        break;
    case MEMBER_BOOLEAN: {
        bool flag;
        memcpy(&flag, field, sizeof flag);
        json_out_boolean(out, flag);
        break;
    }
    case MEMBER_CHOICE:
        write_choice(out, member, field);
        break;
    case MEMBER_NAME:
    case MEMBER_ASSET:
    case MEMBER_TEXT:
        memcpy(&text, field, sizeof text);
        json_out_string(out, text);
        break;
    case MEMBER_OBJECT:
        write_node(out, member->sub_node, field);
        break;
    case MEMBER_LIST:
    case MEMBER_PAIRS:
        write_list(out, member, value);
        break;
    case MEMBER_SCENE: /* of sequences, which are not written */
    case MEMBER_POINTER:
    case MEMBER_ANY:
        json_out_string(out, NULL);
        break;
    case MEMBER_TRANSFORM:
        json_out_open(out, '{');
        json_out_key(out, "matrix");
        json_out_open(out, '[');
        for (size_t i = 0; i < 16; i++) {
            double element;
            memcpy(&element, field + i * sizeof element, sizeof element);
            json_out_number(out, element);
        }
        json_out_close(out, ']');
        json_out_close(out, '}');
        break;
    }
}

static void write_node(struct json_out *out, enum scene_node node, const void *value) {
    uint64_t bit = scene_alternative_of(node, value);
    json_out_open(out, '{');
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++)
        if (bit == UINT64_C(1) << i && scene_alternatives[i].value) {
            json_out_key(out, scene_alternatives[i].key);
            json_out_string(out, scene_alternatives[i].value);
        }
    for (size_t i = 0; i < scene_member_count; i++) {
        const struct member *member = &scene_members[i];
        if (member->node != node || !member_active(member, bit) || !member_is_given(member, value))
            continue;
        json_out_key(out, member->name);
        write_value(out, member, value);
    }
    json_out_close(out, '}');
}

char *scene_write(const struct scene *scene) {
    struct json_out out = {0};
    write_node(&out, SCENE_NODE_scene, scene);
    return json_out_finish(&out);
}

struct visit {
    scene_asset_visit *call;
    void *user;
    struct json_path path;
};

static void visit_node(struct visit *visit, enum scene_node node, const char *value) {
    uint64_t bit = scene_alternative_of(node, value);
    for (size_t i = 0; i < scene_member_count; i++) {
        const struct member *member = &scene_members[i];
        if (member->node != node || !member_active(member, bit) || !member_is_given(member, value))
            continue;
        size_t mark = json_path_enter_name(&visit->path, member->name);
        const char *field = value + member->offset;
        if (member->kind == MEMBER_ASSET) {
            const char *name;
            memcpy(&name, field, sizeof name);
            visit->call(visit->user, name, visit->path.text);
        } else if (member->kind == MEMBER_OBJECT) {
            visit_node(visit, member->sub_node, field);
        } else if (member->kind == MEMBER_LIST) {
            const char *list;
            memcpy(&list, field, sizeof list);
            for (size_t k = 0; k < length_of(member, value); k++) {
                size_t inner = json_path_enter_index(&visit->path, k);
                visit_node(visit, member->sub_node, list + k * scene_nodes[member->sub_node].bytes);
                json_path_leave(&visit->path, inner);
            }
        }
        json_path_leave(&visit->path, mark);
    }
}

void scene_visit_assets(const struct scene *scene, scene_asset_visit *visit, void *user) {
    struct visit walk = {.call = visit, .user = user};
    visit_node(&walk, SCENE_NODE_scene, (const char *)scene);
}
