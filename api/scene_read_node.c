/* Reads one JSON object into the struct of its node: which alternative it is, what does not belong,
 * what is missing, then each member. */
#include <stdio.h>
#include <string.h>

#include "api/scene_reader.h"
#include "api/spelling.h"

enum { NAMES_BYTES = 256 };

static void append(char names[NAMES_BYTES], const char *name) {
    size_t length = strlen(names);
    snprintf(names + length, NAMES_BYTES - length, "%s`%s`", length ? ", " : "", name);
}

/* The keys that tell a node's alternatives apart, each once. */
static size_t distinct_keys(enum scene_node node, const char *keys[SCENE_ALTERNATIVE_COUNT]) {
    size_t count = 0;
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++) {
        const struct scene_alternative_info *info = &scene_alternatives[i];
        bool known = info->node != node || !info->key;
        for (size_t k = 0; k < count && !known; k++)
            known = strcmp(keys[k], info->key) == 0;
        if (!known)
            keys[count++] = info->key;
    }
    return count;
}

/* The alternative of `node` that `key` (NULL: none at all) with its value tells; its index, or
 * SCENE_ALTERNATIVE_COUNT. */
static size_t find_alternative(enum scene_node node, const char *key, json_t *value) {
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++) {
        const struct scene_alternative_info *info = &scene_alternatives[i];
        if (info->node != node)
            continue;
        if (!key) {
            if (info->fallback)
                return i;
            continue;
        }
        if (!info->key || strcmp(info->key, key) != 0)
            continue;
        const char *text = json_string_value(value);
        if (!info->value || (text && strcmp(info->value, text) == 0))
            return i;
    }
    return SCENE_ALTERNATIVE_COUNT;
}

static void fault_unknown_value(struct reader *reader, enum scene_node node, const char *key) {
    char names[NAMES_BYTES] = "";
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++)
        if (scene_alternatives[i].node == node && scene_alternatives[i].key &&
            strcmp(scene_alternatives[i].key, key) == 0)
            append(names, scene_alternatives[i].value);
    size_t mark = json_path_enter_name(&reader->path, key);
    reader_fault(reader, "must be one of %s", names);
    json_path_leave(&reader->path, mark);
}

/* Which alternative a JSON object is, after its faults have been told: its index, or
 * SCENE_ALTERNATIVE_COUNT if the node has none or it cannot be told. */
static size_t choose(struct reader *reader, enum scene_node node, json_t *json,
                     const char **chosen_key) {
    const char *keys[SCENE_ALTERNATIVE_COUNT] = {NULL};
    size_t count = distinct_keys(node, keys);
    *chosen_key = NULL;
    if (count == 0)
        return SCENE_ALTERNATIVE_COUNT;
    for (size_t k = 0; k < count; k++) {
        if (!json_object_get(json, keys[k]))
            continue;
        if (!*chosen_key) {
            *chosen_key = keys[k];
            continue;
        }
        size_t mark = json_path_enter_name(&reader->path, keys[k]);
        reader_fault(reader, "excludes `%s`: give one of them", *chosen_key);
        json_path_leave(&reader->path, mark);
    }
    size_t found = find_alternative(node, *chosen_key,
                                    *chosen_key ? json_object_get(json, *chosen_key) : NULL);
    if (found < SCENE_ALTERNATIVE_COUNT)
        return found;
    if (*chosen_key) {
        fault_unknown_value(reader, node, *chosen_key);
        return found;
    }
    char names[NAMES_BYTES] = "";
    for (size_t k = 0; k < count; k++)
        append(names, keys[k]);
    reader_fault(reader, "needs %s%s", count > 1 ? "one of " : "", names);
    return found;
}

static bool is_key(enum scene_node node, const char *name) {
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++)
        if (scene_alternatives[i].node == node && scene_alternatives[i].key &&
            strcmp(scene_alternatives[i].key, name) == 0)
            return true;
    return false;
}

const char *reader_meant(enum scene_node node, uint64_t bit, const char *name) {
    const char *meant = NULL;
    size_t nearest = 3;
    for (size_t i = 0; i < scene_member_count; i++) {
        const struct member *member = &scene_members[i];
        if (member->node != node || (bit && !member_active(member, bit)))
            continue;
        size_t distance = spelling_distance(name, member->name);
        if (distance < nearest && 2 * distance < strlen(member->name)) {
            nearest = distance;
            meant = member->name;
        }
    }
    return meant;
}

/* Only for faults that are kept: a text full of unknown names shall not cost their spelling. */
static void fault_unknown(struct reader *reader, enum scene_node node, uint64_t bit,
                          const char *name) {
    const char *meant = NULL;
    if (reader->err->fault_count < ERROR_FAULTS_MAX)
        meant = reader_meant(node, bit, name);
    if (meant)
        reader_fault(reader, "unknown member; is `%s` meant?", meant);
    else
        reader_fault(reader, "unknown member");
}

/* Faults for the members that have no place here. The keys of alternatives were judged before. */
static void refuse_strangers(struct reader *reader, enum scene_node node, json_t *json,
                             size_t chosen, const char *chosen_key) {
    const uint64_t bit = chosen < SCENE_ALTERNATIVE_COUNT ? UINT64_C(1) << chosen : 0;
    const char *name;
    json_t *value;
    json_object_foreach(json, name, value) {
        if (is_key(node, name))
            continue;
        bool known = false, active = false;
        for (size_t i = 0; i < scene_member_count; i++) {
            const struct member *member = &scene_members[i];
            if (member->node != node || strcmp(member->name, name) != 0)
                continue;
            known = true;
            active = active || bit == 0 || member_active(member, bit);
        }
        if (active)
            continue;
        size_t mark = json_path_enter_name(&reader->path, name);
        if (!known)
            fault_unknown(reader, node, bit, name);
        else if (chosen_key && scene_alternatives[chosen].value)
            reader_fault(reader, "does not belong to %s `%s`", chosen_key,
                         scene_alternatives[chosen].value);
        else
            reader_fault(reader, "does not belong here");
        json_path_leave(&reader->path, mark);
    }
}

static void store_alternative(const struct scene_alternative_info *info, void *out) {
    char *bytes = out;
    if (info->kind)
        memcpy(bytes + info->kind - 1, &info->kind_value, sizeof info->kind_value);
    if (info->sub)
        memcpy(bytes + info->sub - 1, &info->sub_value, sizeof info->sub_value);
    if (info->flag)
        memcpy(bytes + info->flag - 1, &(bool){true}, sizeof(bool));
}

static void read_members(struct reader *reader, enum scene_node node, json_t *json, uint64_t bit,
                         void *out) {
    for (size_t i = 0; i < scene_member_count; i++) {
        const struct member *member = &scene_members[i];
        if (member->node != node || !member_active(member, bit))
            continue;
        json_t *value = json ? json_object_get(json, member->name) : NULL;
        size_t mark = json_path_enter_name(&reader->path, member->name);
        if (!value && json && member->required) {
            json_path_leave(&reader->path, mark);
            reader_fault(reader, "`%s` is required", member->name);
            continue;
        }
        reader_value(reader, member, value, out);
        json_path_leave(&reader->path, mark);
    }
}

void reader_node(struct reader *reader, enum scene_node node, json_t *json, void *out) {
    size_t before = reader_fault_count(reader);
    if (json && !json_is_object(json)) {
        reader_fault(reader, "must be an object, is %s", reader_type_name(json));
        return;
    }
    const char *key = NULL;
    size_t chosen = json ? choose(reader, node, json, &key) : find_alternative(node, NULL, NULL);
    uint64_t bit = chosen < SCENE_ALTERNATIVE_COUNT ? UINT64_C(1) << chosen : 0;
    if (json)
        refuse_strangers(reader, node, json, chosen, key);
    if (bit)
        store_alternative(&scene_alternatives[chosen], out);
    read_members(reader, node, json, bit, out);
    if (json && reader_fault_count(reader) == before && !reader_scan_found_below(reader))
        reader_check(reader, node, json, out);
}
