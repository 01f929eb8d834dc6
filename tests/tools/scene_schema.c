/* Writes api/scene.schema.json (`sequence`: api/sequence.schema.json; JSON Schema, draft 2020-12)
 * to stdout, from the table of members. `make generate` runs it; a test holds the committed file to
 * it.
 *
 * What the schema cannot say is in api/refusals.def. Alternatives become a oneOf of closed objects;
 * those that differ by nothing but the value of their key share one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_out.h"
#include "api/scene_members.h"

static void put_text(struct json_out *out, const char *key, const char *text) {
    json_out_key(out, key);
    json_out_string(out, text);
}

static void put_number(struct json_out *out, const char *key, double value) {
    json_out_key(out, key);
    json_out_number(out, value);
}

static void put_ref(struct json_out *out, enum scene_node node) {
    char text[64];
    snprintf(text, sizeof text, "#/$defs/%s", scene_nodes[node].name);
    put_text(out, "$ref", text);
}

static void put_scalar(struct json_out *out, const struct member *member, size_t i) {
    put_text(out, "type", member->kind == MEMBER_NUMBER ? "number" : "integer");
    put_number(out, "minimum", member_min(member, i));
    put_number(out, "maximum", member_max(member, i));
    if (!member->square)
        return;
    json_out_key(out, "enum");
    json_out_open(out, '[');
    for (int k = 1; k * k <= member_max(member, i); k++)
        json_out_integer(out, k * k);
    json_out_close(out, ']');
}

static bool uniform(const struct member *member) {
    for (size_t i = 1; i < member->count; i++)
        if (member_min(member, i) != member_min(member, 0) ||
            member_max(member, i) != member_max(member, 0))
            return false;
    return true;
}

static void put_array(struct json_out *out, const struct member *member) {
    put_text(out, "type", "array");
    if (uniform(member)) {
        json_out_key(out, "items");
        json_out_open(out, '{');
        put_scalar(out, member, 0);
        json_out_close(out, '}');
    } else {
        json_out_key(out, "prefixItems");
        json_out_open(out, '[');
        for (size_t i = 0; i < member->count; i++) {
            json_out_open(out, '{');
            put_scalar(out, member, i);
            json_out_close(out, '}');
        }
        json_out_close(out, ']');
    }
    json_out_key(out, "minItems");
    json_out_unsigned(out, member->count);
    json_out_key(out, "maxItems");
    json_out_unsigned(out, member->count);
}

static void put_numbers(struct json_out *out, const struct member *member) {
    if (!member->count) {
        put_scalar(out, member, 0);
        return;
    }
    if (!member->broadcast) {
        put_array(out, member);
        return;
    }
    json_out_key(out, "anyOf");
    json_out_open(out, '[');
    json_out_open(out, '{');
    put_scalar(out, member, 0);
    json_out_close(out, '}');
    json_out_open(out, '{');
    put_array(out, member);
    json_out_close(out, '}');
    json_out_close(out, ']');
}

static void put_names(struct json_out *out, const struct member *member) {
    const struct scene_choice_list *list = &scene_choice_lists[member->choices];
    json_out_key(out, "enum");
    json_out_open(out, '[');
    for (size_t i = 0; i < list->count; i++)
        json_out_string(out, list->choice[i].name);
    json_out_close(out, ']');
}

static void put_list(struct json_out *out, const struct member *member) {
    put_text(out, "type", "array");
    json_out_key(out, "minItems");
    json_out_unsigned(out, member->length_min);
    json_out_key(out, "maxItems");
    json_out_unsigned(out, member->length_max);
    json_out_key(out, "items");
    json_out_open(out, '{');
    if (member->kind == MEMBER_LIST) {
        put_ref(out, member->sub_node);
    } else {
        struct member pair = *member;
        pair.kind = MEMBER_INTEGER;
        pair.count = 2;
        put_array(out, &pair);
    }
    json_out_close(out, '}');
}

static void put_default(struct json_out *out, const struct member *member) {
    json_out_key(out, "default");
    switch (member->kind) {
    case MEMBER_BOOLEAN:
        json_out_boolean(out, member->fallback[0] != 0);
        break;
    case MEMBER_CHOICE:
        json_out_string(out,
                        scene_choice_lists[member->choices].choice[(int)member->fallback[0]].name);
        break;
    case MEMBER_OBJECT:
        json_out_raw(out, "{}");
        break;
    case MEMBER_LIST:
        json_out_raw(out, "[{}]");
        break;
    default:
        if (member->count)
            json_out_open(out, '[');
        for (size_t i = 0; i < (member->count ? member->count : 1); i++)
            json_out_number(out, member->fallback[i]);
        if (member->count)
            json_out_close(out, ']');
    }
}

static void put_member(struct json_out *out, const struct member *member) {
    json_out_key(out, member->name);
    json_out_open(out, '{');
    put_text(out, "description", member->text);
    if (member->unit && *member->unit)
        put_text(out, "x-unit", member->unit);
    switch (member->kind) {
    case MEMBER_NUMBER:
    case MEMBER_INTEGER:
        put_numbers(out, member);
        break;
    case MEMBER_BOOLEAN:
        put_text(out, "type", "boolean");
        if (member->only_false) {
            json_out_key(out, "const");
            json_out_boolean(out, false);
        }
        break;
    case MEMBER_CHOICE:
    case MEMBER_NAME:
        put_names(out, member);
        break;
    case MEMBER_ASSET:
        put_text(out, "$ref", "#/$defs/asset_name");
        break;
    case MEMBER_OBJECT:
    case MEMBER_TRANSFORM:
        put_ref(out, member->sub_node);
        break;
    case MEMBER_LIST:
    case MEMBER_PAIRS:
        put_list(out, member);
        break;
    case MEMBER_SCENE: /* every frame is one; what is given here need not be complete */
        put_text(out, "type", "object");
        break;
    case MEMBER_POINTER:
        put_text(out, "type", "string");
        put_text(out, "pattern", "^(/([^/~]|~[01])*)+$");
        break;
    case MEMBER_TEXT:
        put_text(out, "type", "string");
        put_number(out, "minLength", 1);
        put_number(out, "maxLength", SCENE_TEXT_MAX);
        break;
    case MEMBER_ANY:
        break;
    }
    if (member->has_fallback)
        put_default(out, member);
    json_out_close(out, '}');
}

/* Whether two alternatives have the same key and the same members. */
static bool alike(size_t a, size_t b) {
    const struct scene_alternative_info *x = &scene_alternatives[a], *y = &scene_alternatives[b];
    if (x->node != y->node || !x->value || !y->value || strcmp(x->key, y->key) != 0)
        return false;
    for (size_t i = 0; i < scene_member_count; i++)
        if (scene_members[i].node == x->node &&
            member_active(&scene_members[i], UINT64_C(1) << a) !=
                member_active(&scene_members[i], UINT64_C(1) << b))
            return false;
    return true;
}

static void put_key(struct json_out *out, size_t alternative) {
    json_out_key(out, scene_alternatives[alternative].key);
    json_out_open(out, '{');
    json_out_key(out, "enum");
    json_out_open(out, '[');
    for (size_t i = alternative; i < SCENE_ALTERNATIVE_COUNT; i++)
        if (alike(alternative, i))
            json_out_string(out, scene_alternatives[i].value);
    json_out_close(out, ']');
    json_out_close(out, '}');
}

/* A closed object; `alternative`: SCENE_ALTERNATIVE_COUNT where the node has none. */
static void put_object(struct json_out *out, enum scene_node node, size_t alternative) {
    bool one = alternative < SCENE_ALTERNATIVE_COUNT;
    bool keyed = one && scene_alternatives[alternative].value;
    uint64_t bit = one ? UINT64_C(1) << alternative : 0;
    json_out_key(out, "properties");
    json_out_open(out, '{');
    if (keyed)
        put_key(out, alternative);
    for (size_t i = 0; i < scene_member_count; i++)
        if (scene_members[i].node == node && member_active(&scene_members[i], bit))
            put_member(out, &scene_members[i]);
    json_out_close(out, '}');
    json_out_key(out, "required");
    json_out_open(out, '[');
    if (keyed)
        json_out_string(out, scene_alternatives[alternative].key);
    for (size_t i = 0; i < scene_member_count; i++)
        if (scene_members[i].node == node && member_active(&scene_members[i], bit) &&
            scene_members[i].required)
            json_out_string(out, scene_members[i].name);
    json_out_close(out, ']');
    json_out_key(out, "additionalProperties");
    json_out_boolean(out, false);
}

/* quality is the path's own, once a path is named. */
static void put_path_rules(struct json_out *out) {
    const struct scene_choice_list *paths = &scene_choice_lists[SCENE_CHOICES_path];
    json_out_key(out, "allOf");
    json_out_open(out, '[');
    for (size_t p = 0; p < paths->count; p++) {
        if (paths->choice[p].value == SCENE_PATH_AUTO)
            continue;
        json_out_raw(out, "{\"if\":{\"required\":[\"path\"],\"properties\":{\"path\":{\"const\":");
        json_out_string(out, paths->choice[p].name);
        json_out_close(out, '}');
        json_out_close(out, '}');
        json_out_close(out, '}');
        json_out_key(out, "then");
        json_out_raw(out, "{\"properties\":{\"quality\":{\"propertyNames\":{\"enum\":[");
        for (size_t i = 0; i < scene_member_count; i++)
            if (scene_members[i].paths & UINT64_C(1) << paths->choice[p].value)
                json_out_string(out, scene_members[i].name);
        json_out_close(out, ']');
        for (int close = 0; close < 5; close++)
            json_out_close(out, '}');
    }
    json_out_close(out, ']');
}

static void put_node(struct json_out *out, enum scene_node node) {
    json_out_key(out, scene_nodes[node].name);
    json_out_open(out, '{');
    put_text(out, "description", scene_nodes[node].text);
    put_text(out, "type", "object");
    bool any = false;
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++) {
        if (scene_alternatives[i].node != node)
            continue;
        bool first = true;
        for (size_t k = 0; k < i; k++)
            first = first && !alike(k, i);
        if (!first)
            continue;
        if (!any) {
            json_out_key(out, "oneOf");
            json_out_open(out, '[');
        }
        any = true;
        json_out_open(out, '{');
        put_text(out, "title", scene_alternatives[i].text);
        put_object(out, node, i);
        json_out_close(out, '}');
    }
    if (any)
        json_out_close(out, ']');
    else
        put_object(out, node, SCENE_ALTERNATIVE_COUNT);
    if (node == SCENE_NODE_object)
        put_path_rules(out);
    json_out_close(out, '}');
}

/* Objects, and arrays that hold objects, one member a line; all else in one. */
static void print_indented(const char *json) {
    int depth = 0;
    bool text = false;
    bool broken[64] = {false};
    for (const char *c = json; *c; c++) {
        if (text) {
            putchar(*c);
            if (*c == '\\')
                putchar(*++c);
            else if (*c == '"')
                text = false;
            continue;
        }
        if (*c == '{' || *c == '[') {
            const char *end = c + 1;
            while (*c == '[' && *end && !strchr("{]", *end))
                end++;
            putchar(*c);
            broken[++depth] = c[1] != '}' && (*c == '{' || *end == '{');
            if (broken[depth])
                printf("\n%*s", 2 * depth, "");
        } else if (*c == '}' || *c == ']') {
            if (broken[depth--])
                printf("\n%*s", 2 * depth, "");
            putchar(*c);
        } else if (*c == ',') {
            putchar(',');
            if (broken[depth])
                printf("\n%*s", 2 * depth, "");
            else
                putchar(' ');
        } else {
            putchar(*c);
            if (*c == ':')
                putchar(' ');
            text = *c == '"';
        }
    }
    putchar('\n');
}

static void put_asset_name(struct json_out *out) {
    json_out_key(out, "asset_name");
    json_out_open(out, '{');
    put_text(out, "description",
             "A name, never a path outside: no leading slash, no `..`, no backslash, no control "
             "character; or sha256: and 64 hexadecimal digits.");
    put_text(out, "type", "string");
    put_number(out, "minLength", 1);
    put_number(out, "maxLength", SCENE_ASSET_NAME_MAX);
    put_text(out, "pattern", SCENE_ASSET_PATTERN);
    json_out_close(out, '}');
}

int main(int argc, char **argv) {
    bool sequence = argc == 2 && strcmp(argv[1], "sequence") == 0;
    struct json_out out = {0};
    json_out_open(&out, '{');
    put_text(&out, "$schema", "https://json-schema.org/draft/2020-12/schema");
    put_text(&out, "$id",
             sequence ? "https://pelt.invalid/1/sequence.schema.json"
                      : "https://pelt.invalid/1/scene.schema.json");
    put_text(&out, "title",
             sequence ? "A sequence of Pelt, version 1" : "A scene of Pelt, version 1");
    put_text(&out, "$comment",
             sequence ? "Made by `make generate` from sequence_members.def."
                      : "Made by `make generate` from scene_members.def.");
    put_ref(&out, sequence ? SCENE_NODE_sequence : SCENE_NODE_scene);
    json_out_key(&out, "$defs");
    json_out_open(&out, '{');
    int from = sequence ? (int)SCENE_NODES_OF_SCENE : 0;
    int to = sequence ? (int)SCENE_NODE_COUNT : (int)SCENE_NODES_OF_SCENE;
    for (int node = from; node < to; node++)
        put_node(&out, (enum scene_node)node);
    if (!sequence)
        put_asset_name(&out);
    json_out_close(&out, '}');
    json_out_close(&out, '}');
    char *json = json_out_finish(&out);
    if (!json)
        return 1;
    print_indented(json);
    free(json);
    return 0;
}
