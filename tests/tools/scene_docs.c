/* Writes api/SCENE.md, the documentation of every member of the scene (`sequence`:
 * api/SEQUENCE.md), to stdout, from the table of members and the table of refusals. `make generate`
 * runs it; a test holds the committed file to it. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/json_out.h"
#include "api/refusals.h"
#include "api/scene_members.h"

static void print_number(double value) {
    char text[JSON_NUMBER_BYTES];
    for (int power = 6; power <= 12; power++)
        if (fabs(value) == pow(10, power)) {
            printf("%s1e%d", value < 0 ? "-" : "", power);
            return;
        }
    json_number_text(value, text);
    fputs(text, stdout);
}

static bool has_alternatives(enum scene_node node) {
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++)
        if (scene_alternatives[i].node == node)
            return true;
    return false;
}

static bool same_range(const struct member *member) {
    for (size_t i = 1; i < member->count; i++)
        if (member_min(member, i) != member_min(member, 0) ||
            member_max(member, i) != member_max(member, 0))
            return false;
    return true;
}

static void print_limits(const struct member *member,
                         double (*limit)(const struct member *, size_t)) {
    if (same_range(member)) {
        print_number(limit(member, 0));
        return;
    }
    for (size_t i = 0; i < member->count; i++) {
        fputs(i ? ", " : "[", stdout);
        print_number(limit(member, i));
    }
    putchar(']');
}

static void print_names(const struct member *member) {
    const struct scene_choice_list *list = &scene_choice_lists[member->choices];
    for (size_t i = 0; i < list->count; i++)
        printf("%s`%s`", i ? ", " : "", list->choice[i].name);
}

static void print_type(const struct member *member) {
    const char *sub = scene_nodes[member->sub_node].name;
    switch (member->kind) {
    case MEMBER_NUMBER:
    case MEMBER_INTEGER: {
        const char *one = member->kind == MEMBER_NUMBER ? "number" : "integer";
        if (member->broadcast)
            printf("%s or ", one);
        if (member->count)
            printf("%zu %ss", member->count, one);
        else
            printf("%s", member->square ? "square of an integer" : one);
        break;
    }
    case MEMBER_BOOLEAN:
        fputs(member->only_false ? "`false`" : "boolean", stdout);
        break;
    case MEMBER_CHOICE:
    case MEMBER_NAME:
        print_names(member);
        break;
    case MEMBER_ASSET:
        fputs("asset name", stdout);
        break;
    case MEMBER_OBJECT:
    case MEMBER_TRANSFORM:
        printf("[%s](#%s)", sub, sub);
        break;
    case MEMBER_LIST:
        printf("%zu to %zu [%s](#%s)", member->length_min, member->length_max, sub, sub);
        break;
    case MEMBER_PAIRS:
        printf("%zu to %zu pairs of integers", member->length_min, member->length_max);
        break;
    case MEMBER_SCENE:
        fputs("[scene](SCENE.md)", stdout);
        break;
    case MEMBER_POINTER:
        fputs("JSON Pointer", stdout);
        break;
    case MEMBER_TEXT:
        fputs("text", stdout);
        break;
    case MEMBER_ANY:
        fputs("any", stdout);
        break;
    }
}

static void print_range(const struct member *member) {
    if (member->kind != MEMBER_NUMBER && member->kind != MEMBER_INTEGER &&
        member->kind != MEMBER_PAIRS)
        return;
    print_limits(member, member_min);
    fputs(" to ", stdout);
    print_limits(member, member_max);
}

static void print_default(const struct member *member) {
    if (member->required) {
        fputs("required", stdout);
        return;
    }
    if (!member->has_fallback) {
        fputs(member->kind == MEMBER_TRANSFORM ? "identity" : "-", stdout);
        return;
    }
    switch (member->kind) {
    case MEMBER_BOOLEAN:
        fputs(member->fallback[0] != 0 ? "`true`" : "`false`", stdout);
        break;
    case MEMBER_CHOICE:
        printf("`%s`", scene_choice_lists[member->choices].choice[(int)member->fallback[0]].name);
        break;
    case MEMBER_OBJECT:
        fputs("`{}`", stdout);
        break;
    case MEMBER_LIST:
        fputs("`[{}]`", stdout);
        break;
    default:
        for (size_t i = 0; i < (member->count ? member->count : 1); i++) {
            fputs(i ? ", " : member->count ? "[" : "", stdout);
            print_number(member->fallback[i]);
        }
        fputs(member->count ? "]" : "", stdout);
    }
}

/* Which alternatives a member belongs to: names, or "all". */
static void print_when(const struct member *member) {
    if (!member->when) {
        fputs("all", stdout);
        return;
    }
    const char *comma = "";
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++) {
        if (!(member->when & UINT64_C(1) << i))
            continue;
        const struct scene_alternative_info *info = &scene_alternatives[i];
        printf("%s%s", comma, info->value ? info->value : info->key ? info->key : "parts");
        comma = ", ";
    }
}

static void print_paths(const struct member *member) {
    const struct scene_choice_list *paths = &scene_choice_lists[SCENE_CHOICES_path];
    for (size_t i = 0; i < paths->count; i++)
        if (member->paths & UINT64_C(1) << paths->choice[i].value)
            fputs(paths->choice[i].name, stdout);
}

static void print_alternatives(enum scene_node node) {
    printf("| one of | |\n|---|---|\n");
    for (size_t i = 0; i < SCENE_ALTERNATIVE_COUNT; i++) {
        const struct scene_alternative_info *info = &scene_alternatives[i];
        if (info->node != node)
            continue;
        if (info->value)
            printf("| `\"%s\": \"%s\"` | %s |\n", info->key, info->value, info->text);
        else if (info->key)
            printf("| `%s`%s | %s |\n", info->key, info->fallback ? ", or none" : "", info->text);
        else
            printf("| none of the others | %s |\n", info->text);
    }
    putchar('\n');
}

static void print_node(enum scene_node node) {
    bool alternatives = has_alternatives(node), paths = node == SCENE_NODE_quality;
    printf("\n## %s\n\n%s\n\n", scene_nodes[node].name, scene_nodes[node].text);
    if (alternatives)
        print_alternatives(node);
    printf("| member | %stype | range | default | unit | meaning |\n|---|%s---|---|---|---|---|\n",
           alternatives ? "of | "
           : paths      ? "path | "
                        : "",
           alternatives || paths ? "---|" : "");
    for (size_t i = 0; i < scene_member_count; i++) {
        const struct member *member = &scene_members[i];
        if (member->node != node)
            continue;
        printf("| `%s` | ", member->name);
        if (alternatives)
            print_when(member);
        else if (paths)
            print_paths(member);
        fputs(alternatives || paths ? " | " : "", stdout);
        print_type(member);
        fputs(" | ", stdout);
        print_range(member);
        fputs(" | ", stdout);
        print_default(member);
        printf(" | %s | %s |\n", member->unit ? member->unit : "", member->text);
    }
}

static void print_sequence(void) {
    printf(
        "# Sequences, version 1\n\n"
        "<!-- Made by `make generate` from sequence_members.def: edit that. -->\n\n"
        "A sequence is one JSON object of at most %d bytes: a [scene](SCENE.md) and tracks that "
        "say "
        "how members of it\n"
        "change from frame to frame. Every frame is read as a scene is; a fault names the frame, "
        "and "
        "the track that\n"
        "drives the member at fault.\n\n"
        "```json\n"
        "{\"frames\": 60, \"tracks\": [{\"pointer\": \"/objects/0/transform/rotate_deg\", "
        "\"keys\": [\n"
        "    {\"frame\": 0, \"value\": [0, 0, 0]}, {\"frame\": 60, \"value\": [0, 0, 360]}]}],\n"
        " \"scene\": {\"objects\": [{\"shell\": {\"mesh\": {\"shape\": \"torus\"}, "
        "\"material\": {\"builtin\": \"fur\"}}}]}}\n"
        "```\n\n"
        "All frames draw at most %llu pixels times samples together, and frames times bytes of the "
        "text are at most\n%llu.\n",
        SCENE_BYTES_MAX, (unsigned long long)SEQUENCE_SAMPLES_MAX,
        (unsigned long long)SEQUENCE_TEXT_MAX);
    for (int node = SCENE_NODES_OF_SCENE; node < SCENE_NODE_COUNT; node++)
        print_node((enum scene_node)node);
}

int main(int argc, char **argv) {
    if (argc == 2 && strcmp(argv[1], "sequence") == 0) {
        print_sequence();
        return 0;
    }
    printf(
        "# The scene, version 1\n\n"
        "<!-- Made by `make generate` from scene_members.def and refusals.def: edit those. -->\n\n"
        "A scene is one JSON object of at most %d bytes, nested at most %d deep. Unknown members "
        "are\n"
        "refused. Lengths are in the object's own units, angles in degrees, colours linear. An "
        "integer\n"
        "may be written as 512 or 512.0. The least scene is complete, framed and lit:\n\n"
        "```json\n"
        "{\"objects\": [{\"shell\": {\"mesh\": {\"shape\": \"sphere\"}, \"material\": "
        "{\"builtin\": \"fur\"}}}]}\n"
        "```\n\n"
        "An *asset name* has 1 to %d characters: on the command line a path relative to the scene "
        "file,\n"
        "over HTTP the name of a part of the request or of a file on the server; never an absolute "
        "path,\n"
        "never one with `..`, a backslash or a control character. `sha256:` and 64 lower-case "
        "hexadecimal\n"
        "digits name a file by its content.\n\n"
        "A dash as default: left out, the member is simply not there.\n",
        SCENE_BYTES_MAX, SCENE_DEPTH_MAX, SCENE_ASSET_NAME_MAX);
    for (int node = 0; node < (int)SCENE_NODES_OF_SCENE; node++)
        print_node((enum scene_node)node);
    printf(
        "\n## Refused beyond the schema\n\n"
        "What [scene.schema.json](scene.schema.json) cannot say. Every fault found is told, each\n"
        "with its JSON Pointer.\n\n"
        "| refusal | `type` of the problem | HTTP status |\n|---|---|---|\n");
    for (int i = 0; i < REFUSAL_COUNT; i++) {
        enum status status = refusal_status((enum refusal)i);
        printf("| %s | `/problems/%s` | %d |\n", refusal_text((enum refusal)i), status_slug(status),
               status_http(status));
    }
    printf("\nA picture is drawn at its size times the square root of `samples`: at most %d a side "
           "and\n"
           "%d pixels. Built-in shapes have at most %d triangles together.\n",
           SCENE_DRAWN_SIDE_MAX, SCENE_DRAWN_PIXELS_MAX, SCENE_TRIANGLES_MAX);
    return 0;
}
