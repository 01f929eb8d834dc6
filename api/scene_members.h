/* The table of everything that a scene may hold (scene_members.def), as data.
 *
 * The reader, the writer, the JSON Schema and SCENE.md are all driven by this one table, so that a
 * name, a range or a default is said once. A row describes one member of one kind of JSON object
 * (a `node`), and where its value lies in the C struct that the node fills.
 *
 * A node may have alternatives: a mesh is an asset, or a plane, or a sphere. Which one it is is
 * told by a key, or by a key and its value; members belong to all alternatives or to some. */
#ifndef PELT_API_SCENE_MEMBERS_H
#define PELT_API_SCENE_MEMBERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/scene.h"
#include "api/sequence.h"

/* What `transform` holds in JSON; the scene itself keeps the product. */
struct scene_transform {
    double translate[3], rotate_deg[3], scale[3];
    bool is_matrix;
    double matrix[16];
};

enum scene_node {
#define NODE(id, ...) SCENE_NODE_##id,
#include "api/scene_members.def"
    SCENE_NODE_COUNT
};
/* Nodes of the scene come first, those of sequences behind them. */
enum { SCENE_NODES_OF_SCENE = SCENE_NODE_sequence };

enum scene_alternative {
#define ALTERNATIVE(node, id, ...) SCENE_ALTERNATIVE_##node##_##id,
#include "api/scene_members.def"
    SCENE_ALTERNATIVE_COUNT
};
_Static_assert(SCENE_ALTERNATIVE_COUNT <= 64, "masks of alternatives are 64 bits wide");

enum scene_choices {
#define CHOICES(id, ...) SCENE_CHOICES_##id,
#include "api/scene_members.def"
    SCENE_CHOICES_COUNT
};

enum member_kind {
    MEMBER_NUMBER,    /* double, or an array of `count` */
    MEMBER_INTEGER,   /* int or uint32_t, or an array of `count` */
    MEMBER_BOOLEAN,   /* bool */
    MEMBER_CHOICE,    /* an enum, written as one of a few names */
    MEMBER_NAME,      /* const char *, one of a few names */
    MEMBER_ASSET,     /* const char *, the name of an asset */
    MEMBER_OBJECT,    /* a node */
    MEMBER_LIST,      /* pointer and size_t: an array of nodes */
    MEMBER_PAIRS,     /* pointer and size_t: an array of pairs of indices */
    MEMBER_TRANSFORM, /* a transform node, kept as its matrix */
    MEMBER_SCENE,     /* struct json_t *: a scene that is read later (sequences) */
    MEMBER_POINTER,   /* const char *, a JSON Pointer */
    MEMBER_ANY,       /* struct json_t *: any value */
    MEMBER_TEXT,      /* const char *, for people */
};

struct member {
    const char *name, *unit, *text;
    enum scene_node node;
    enum member_kind kind;
    uint64_t when;         /* mask of the alternatives it belongs to; 0: all */
    size_t offset;         /* of the value in the node's struct */
    size_t count;          /* numbers in an array, 0: a plain value */
    double min[4], max[4]; /* of each element; arrays past 4 elements share the last */
    bool required;
    bool square;         /* integers: k * k only */
    bool only_false;     /* booleans: true is refused */
    bool broadcast;      /* one number may stand for the whole array */
    bool absent_if_zero; /* optional, without a default: 0 means that it was not given */
    size_t given;        /* 1 + offset of a bool that tells whether it was given; 0: none */
    bool has_fallback;   /* a default; objects: as if {} was given; lists: as if [{}] was */
    double fallback[16];
    enum scene_choices choices;
    enum scene_node sub_node; /* of objects and lists */
    size_t count_offset;      /* of lists: where their length goes */
    size_t length_min, length_max;
    uint64_t paths; /* quality: the paths it belongs to, a bit for each enum scene_path */
};

struct scene_node_info {
    const char *name, *text;
    size_t bytes, alignment;
};

struct scene_alternative_info {
    enum scene_node node;
    const char *key;   /* the member that tells; NULL: where no other alternative is told */
    const char *value; /* that it must have; NULL: any */
    const char *text;
    bool fallback; /* taken where no key is there at all */
    size_t kind;   /* 1 + offset of an int-sized enum that keeps the choice; 0: none */
    int kind_value;
    size_t sub; /* the same for a second enum (the built-in material) */
    int sub_value;
    size_t flag; /* 1 + offset of a bool that is set for this alternative */
};

struct scene_choice {
    const char *name;
    int value;
};

struct scene_choice_list {
    const struct scene_choice *choice;
    size_t count;
};

extern const struct scene_node_info scene_nodes[SCENE_NODE_COUNT];
extern const struct scene_alternative_info scene_alternatives[SCENE_ALTERNATIVE_COUNT];
extern const struct scene_choice_list scene_choice_lists[SCENE_CHOICES_COUNT];
extern const struct member scene_members[];
extern const size_t scene_member_count;

/* Fills `matrix` from the parts, unless it was given: T * R * S, in double; quarter turns are
 * exact. */
void scene_transform_compose(struct scene_transform *transform);

/* The range of the i-th element. */
double member_min(const struct member *member, size_t i);
double member_max(const struct member *member, size_t i);

/* Whether a member belongs to a node read as `alternative` (a bit; 0: not known which). */
bool member_active(const struct member *member, uint64_t alternative);

/* The alternative that a filled struct holds, as a bit; 0 where its node has none. */
uint64_t scene_alternative_of(enum scene_node node, const void *value);

/* Whether a filled struct holds something to write for this member. */
bool member_is_given(const struct member *member, const void *value);

/* The pattern that the names of assets follow, as in the schema, and the same in C. Length is
 * counted in characters. */
enum { SCENE_ASSET_NAME_MAX = 255 };
#define SCENE_ASSET_PATTERN                                                                        \
    "^(?!/)(?!(?:.*/)?\\.\\.(?:/|$))(?!sha256:(?![0-9a-f]{64}$))"                                  \
    "(?![\\s\\S]*[\\u0000-\\u001f\\u007f\\\\])"
bool scene_asset_name_valid(const char *name);

#endif
