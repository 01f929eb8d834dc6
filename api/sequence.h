/* A sequence: one scene, and tracks that say how members of it change from frame to frame.
 *
 *   {"scene": {...}, "frames": 60, "fps": 25,
 *    "tracks": [{"pointer": "/camera/eye", "interpolation": "smooth",
 *                "keys": [{"frame": 0, "value": [0, -3, 2]}, {"time": 2.4, "value": [3, 0, 2]}]}]}
 *
 * Frame k is what the scene is with every track's value at k put where its JSON Pointer points; it
 * is read as any scene is, so nothing holds in a frame that does not hold in a scene. Before its
 * first key a track has that key's value, after its last that one's, and at a key exactly the
 * key's. Between keys: step    the value of the key before; linear  numbers, and arrays of numbers
 * element by element (rotate_deg too: three angles); smooth  a piecewise cubic that is at rest at
 * the first and the last key and monotone from key to key, so that it never leaves the values on
 * either side: slopes after Fritsch and Butland 1984, "A method for constructing local monotone
 * piecewise cubic interpolants", equation (2); between two keys alone it is 3 s^2 - 2 s^3. Members
 * that are whole numbers are rounded to the nearest.
 *
 * sequence_members.def has every member; the tree of the text is kept, and changed in place. */
#ifndef PELT_API_SEQUENCE_H
#define PELT_API_SEQUENCE_H

#include "api/scene.h"

struct json_t; /* jansson's */

enum {
    SEQUENCE_FRAMES_MAX = 3600,
    SEQUENCE_TRACKS_MAX = 256,
    SEQUENCE_KEYS_MAX = 4096, /* of one track */
    SEQUENCE_STEPS_MAX = 32   /* of one pointer: scenes nest no deeper */
};
/* What all frames draw together: pixels times samples. */
#define SEQUENCE_SAMPLES_MAX (UINT64_C(1) << 33)
/* Frames times bytes of the text, which bounds what reading every frame takes: 0.8 s of processor
 * time, measured with 255 objects (3 s for four times as much). */
#define SEQUENCE_TEXT_MAX (UINT64_C(16) << 20)

enum sequence_interpolation { SEQUENCE_LINEAR, SEQUENCE_STEP, SEQUENCE_SMOOTH };

struct sequence_key {
    double at;    /* seconds or frames, as it was given */
    bool by_time; /* seconds */
    double frame;
    struct json_t *value; /* of the tree */
};

struct sequence_track {
    const char *pointer; /* into the scene */
    enum sequence_interpolation interpolation;
    size_t key_count;
    struct sequence_key *keys; /* in order of time */
    size_t step_count;
    const char **steps; /* of the pointer, unescaped */
    uint32_t indices;   /* bit i: step i is an index into an array */
    bool whole;         /* the member holds whole numbers */
};

struct sequence {
    int frames;
    double fps;
    size_t track_count;
    struct sequence_track *tracks;
    struct json_t *scene; /* of the tree; holds the frame that was read last */
    struct json_t *tree;
    size_t bytes; /* of its text */
};

/* Reads and validates one sequence but for what only its frames tell (sequence_check()). As
 * scene_read(), with pointers into the sequence; on STATUS_OK the caller calls sequence_finish().
 * Apart from the tree everything is the arena's. Thread: any, one at a time for each sequence. */
enum status sequence_read(const char *json, size_t bytes, struct arena *arena,
                          struct sequence *sequence, struct error *err);
void sequence_finish(struct sequence *sequence); /* takes a zeroed one */

/* The scene of one frame, as scene_read() and scene_check_implemented() pass it; its parts are the
 * arena's. A fault's message begins with the frame, its pointer is that of the track that drives
 * the member at fault, else that of the member under /scene. */
enum status sequence_frame(struct sequence *sequence, int frame, struct arena *arena,
                           struct scene *scene, struct error *err);

/* Reads frames `first` to `last`, and stops at the first that is at fault; STATUS_TOO_COMPLEX where
 * all together are more than may be drawn. Visits the assets of each (`visit` may be NULL), with
 * pointers into the sequence. */
enum status sequence_check(struct sequence *sequence, int first, int last, scene_asset_visit *visit,
                           void *user, struct error *err);

/* Moves what was found about one frame's scene (with pointers into the scene, or NULL) behind what
 * `to` holds, told as sequence_frame() does. Returns the status of `from`. */
enum status sequence_blame(const struct sequence *sequence, int frame, struct error *from,
                           struct error *to);

/* The value of one element of a track at a frame: `values[k]` is that of keys[k]. Of unit-tested
 * closed forms; sequence_frame() uses it. */
double sequence_value(const struct sequence_track *track, const double *values, double frame);

#endif
