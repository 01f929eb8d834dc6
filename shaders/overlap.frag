/* A whole ray where stretches of it overlap: parts of one shell that fold over itself, and several
 * shells. Extinctions add and colours mix by extinction (DESIGN.md, "One truth", Picture):
 *
 *     dL/dt = -sum_k kappa_k L + sum_k kappa_k c_k,   kappa_k = sigma_k |d_k|,
 *
 * in the ray parameter t, which all shells share, d_k being the ray's direction in the space of the
 * shell k: so no transform changes an optical depth.
 *
 * A stretch is what lies between an entry and the exit that its walk finds. SLOTS of them are walked
 * at once, each from cell to cell as in walk.frag. An iteration goes on to the next event, which is
 * the nearest exit from a cell or the next entry, samples all slots at the same points on the way
 * (midpoint rule: between events every texture map is smooth, so it is of second order), and fetches
 * the one cell that begins there: as many cells as separate walks would fetch, and SLOTS texture
 * fetches a sample. The CPU has counted how deep stretches nest (renderer/shell/overlap.h) and so
 * how many slots each shell needs; each slot belongs to one shell, so its textures are bound, not
 * chosen. An entry that finds no slot free, by rounding, waits for the exit that it coincides with.
 *
 * Where prisms are not affine (FLAG_EXACT; common_prism.glsl), a cell's way through the texture is the
 * parabola through the prism's own map where the ray enters, half way, and where it leaves: three
 * inversions a cell instead of one a sample for each slot, third order in the cell's size. (Cells that
 * walk alone end where the prism's ruled side is; here they end at their own plane faces.) Normals are
 * those half way.
 *
 * A homogeneous medium is a texture of one texel, and asks for no steps. */
#define SLOTS (2 + (VARIANT & FLAG_SLOTS_1) / FLAG_SLOTS_1 + (VARIANT & FLAG_SLOTS_2) / FLAG_SLOTS_2 * 2)
#define FRAMES SLOTS
#include "common_frame.glsl"
#include "common_sample.glsl"
#include "common_math.glsl"
#include "common_through.glsl"
#include "common_walk.glsl"
#if (VARIANT & FLAG_EXACT) != 0
#include "common_prism.glsl"
#endif
#include "common_filter.glsl"
#if (VARIANT & FLAG_LIT) != 0
#include "common_light.glsl"
#endif
#include "common_strands.glsl"

layout(binding = BINDING_ENTRIES) uniform usamplerBuffer entries; /* ENTRY_*: link, t */
layout(binding = BINDING_SLOT_MEDIUM) uniform sampler3D medium[SLOTS];
#if (VARIANT & FLAG_LIT) != 0
layout(binding = BINDING_SLOT_GRADIENT) uniform sampler3D medium_gradient[SLOTS]; /* SLOT_STRANDS: strands */
#endif

layout(location = 0) uniform int starts; /* entries, from 0 on, that every ray begins with */
layout(location = 1) uniform int width;  /* of the sample grid */
layout(location = 2) uniform int visits; /* most cells that a ray may see */
layout(location = 3) uniform vec2 limit; /* most steps; transmittance that ends a ray */
/* Which shell a slot belongs to, the first of that shell's cells in the table, SLOT_*. */
layout(location = 4) uniform uvec3 slot[SLOTS];
#define SLOT_LIT 1u
#define SLOT_EXACT 2u
#define SLOT_MIPS 4u
#define SLOT_STRANDS 8u

layout(location = 0, index = 0) out vec4 picture; /* radiance; optical depth */
layout(location = 0, index = 1) out vec4 through; /* transmittance, the blend factor */

#if (VARIANT & FLAG_TINT) != 0
#define CHANNELS vec3 /* of what is let through */
#define MOST(x) most_of(x)
#else
#define CHANNELS float
#define MOST(x) (x)
#endif

#define IDLE 1.0e38 /* t_out of a slot that walks through nothing */

struct Slot {
    vec3 origin, d;          /* the ray in its shell's space */
    float density, fineness; /* extinction and steps for a unit of t, times and over the texture's */
    float t_in, t_out;       /* where the cell begins and ends */
    uint next;               /* what lies beyond */
    vec3 q, dq;              /* texture coordinates at t_in, and how they change with t */
#if (VARIANT & FLAG_EXACT) != 0
    vec3 ddq; /* and with its square */
#endif
#if (VARIANT & FLAG_LIT) != 0
    mat3 normal; /* from a gradient over texture space to the object's */
#endif
#if (VARIANT & FLAG_FILTER) != 0
    float level;
#endif
};

#if (VARIANT & FLAG_FILTER) != 0
#define READ(voxels, k) textureLod(voxels[k], q, s[k].level)
#else
#define READ(voxels, k) texture(voxels[k], q)
#endif

Slot slot_for(int k, vec2 p) {
    Slot s;
    s.origin = ray_origin(p, k * FRAME_VEC4S);
    s.d = ray_direction(p, k * FRAME_VEC4S);
    float speed = length(s.d);
    s.fineness = speed * frame[k * FRAME_VEC4S + FRAME_STEP].x;
    s.density = speed * frame[k * FRAME_VEC4S + FRAME_STEP].y;
    s.t_in = 0.0;
    s.t_out = IDLE;
    s.next = LINK_NONE;
    s.q = s.dq = vec3(0.0);
#if (VARIANT & FLAG_EXACT) != 0
    s.ddq = vec3(0.0);
#endif
#if (VARIANT & FLAG_LIT) != 0
    s.normal = mat3(0.0);
#endif
#if (VARIANT & FLAG_FILTER) != 0
    s.level = 0.0;
#endif
    return s;
}

/* GLSL would let samplers be indexed by a loop's counter, and llvmpipe would index the rest through
 * memory: so each slot is written out. */
#if SLOTS == 2
#define EACH_SLOT(f) f(0) f(1)
#elif SLOTS == 3
#define EACH_SLOT(f) f(0) f(1) f(2)
#elif SLOTS == 4
#define EACH_SLOT(f) f(0) f(1) f(2) f(3)
#else
#define EACH_SLOT(f) f(0) f(1) f(2) f(3) f(4)
#endif

void main() {
    vec2 p = sample_position();
    int sample_index = int(gl_FragCoord.y) * width + int(gl_FragCoord.x);
    int first = int(texelFetch(firsts, sample_index).r);
    int last = int(texelFetch(firsts, sample_index + 1).r);
    if (first >= last && starts == 0)
        discard;
    float t_stop = stop_at_occluder();
#if (VARIANT & FLAG_LIT) != 0
    vec3 v = view_vector(p);
#endif
    Slot s[SLOTS];
#define BEGIN(k) s[k] = slot_for(k, p);
    EACH_SLOT(BEGIN)
#if (VARIANT & FLAGS_PLACE) != 0
    /* Light is asked for in the first slot's space, by the ray parameter. */
    place_in = s[0].origin;
    place_on = s[0].d;
#endif

    int entry = starts > 0 ? 0 : first;
    int visit = 0;
    float t = -1.0;
    CHANNELS tau = CHANNELS(0.0), left = CHANNELS(1.0);
    vec3 color = vec3(0.0);
    bool more;
    do {
        /* The next event. */
        float t_exit = IDLE, fineness = 0.0;
        int leaver = -1;
#define NEAREST(k)                                                                                 \
    leaver = s[k].t_out < t_exit ? k : leaver;                                                     \
    t_exit = min(t_exit, s[k].t_out);                                                              \
    fineness = s[k].t_out < IDLE ? max(fineness, s[k].fineness) : fineness;
        EACH_SLOT(NEAREST)
        bool waiting = entry < starts || entry < last;
        uvec2 door = texelFetch(entries, entry).rg;
        int vacant = -1;
#define VACANT(k)                                                                                  \
    vacant = s[k].t_out == IDLE && slot[k].x == ENTRY_SHELL(door.x) ? k : vacant;
        EACH_SLOT(VACANT)
        float t_enter = waiting && vacant >= 0 ? uintBitsToFloat(door.y) : IDLE;
        bool enters = t_enter < t_exit;
        float t_next = max(min(t_enter, t_exit), t);
        t_next = enters || leaver >= 0 ? t_next : t;
        float t_end = min(t_next, t_stop);

        float span = max(t_end - t, 0.0);
        float steps = clamp(ceil(span * fineness), 1.0, limit.x), i = 0.5;
        do {
            float at = t + span * (i / steps);
            CHANNELS sigma = CHANNELS(0.0);
            vec3 emitted = vec3(0.0);
#if (VARIANT & FLAG_STRANDS) != 0
#define STRAND(k)                                                                                  \
    by_strand = (slot[k].z & SLOT_STRANDS) != 0u;                                                  \
    float strand_weight;                                                                           \
    vec3 strand = strand_tangent(                                                                  \
        around, world_normal(s[k].normal[0], k * FRAME_VEC4S),                                     \
        world_normal(s[k].normal[1], k * FRAME_VEC4S),                                             \
        world_normal(s[k].normal[2], k * FRAME_VEC4S), strand_weight);                             \
    n = by_strand ? strand : n;                                                                    \
    weight = by_strand ? strand_weight : weight;
#else
#define STRAND(k)
#endif
#if (VARIANT & FLAG_LIT) != 0
#define LIGHT(k)                                                                                   \
    vec4 around = READ(medium_gradient, k);                                                        \
    vec3 gradient = around.xyz;                                                                    \
    float g = length(gradient), weight = g / (g + 0.01);                                           \
    vec3 n = world_normal(s[k].normal * (gradient * frame[k * FRAME_VEC4S + FRAME_SIZE].xyz),      \
                          k * FRAME_VEC4S);                                                        \
    n *= inversesqrt(max(dot(n, n), 1.0e-37));                                                     \
    STRAND(k)                                                                                      \
    vec3 shaded = lit_by(m.rgb / max(m.a, 1.0e-30), n, n, v, weight,                               \
                         frame[k * FRAME_VEC4S + FRAME_MATERIAL].xy, place_at(at)) *               \
                  m.a;                                                                             \
    m.rgb = (slot[k].z & SLOT_LIT) != 0u ? shaded : m.rgb;
#elif (VARIANT & FLAG_AMBIENT) != 0
#define LIGHT(k) m.rgb *= (slot[k].z & SLOT_LIT) != 0u ? frame[FRAME_AMBIENT].rgb : vec3(1.0);
#else
#define LIGHT(k)
#endif
#if (VARIANT & FLAG_EXACT) != 0
#define PLACE(k, dt) s[k].q + dt * (s[k].dq + dt * s[k].ddq)
#else
#define PLACE(k, dt) s[k].q + dt * s[k].dq
#endif
#if (VARIANT & FLAG_FILL) != 0 && (VARIANT & FLAG_TINT) != 0
#define FILL(k)                                                                                    \
    vec4 glow = frame[k * FRAME_VEC4S + FRAME_GLOW], fill = frame[k * FRAME_VEC4S + FRAME_FILL];   \
    m.rgb = glow.yzw * (m.rgb + glow.x * own) + fill.rgb;                                          \
    vec3 taken = glow.yzw * (m.a + fill.w);
#elif (VARIANT & FLAG_FILL) != 0
#define FILL(k)                                                                                    \
    vec4 fill = frame[k * FRAME_VEC4S + FRAME_FILL];                                               \
    m.rgb += frame[k * FRAME_VEC4S + FRAME_GLOW].x * own + fill.rgb;                               \
    float taken = m.a + fill.w;
#elif (VARIANT & FLAG_TINT) != 0
#define FILL(k)                                                                                    \
    vec3 tint = frame[k * FRAME_VEC4S + FRAME_GLOW].yzw, taken = tint * m.a;                       \
    m.rgb *= tint;
#else
#define FILL(k) float taken = m.a;
#endif
#define SAMPLE(k)                                                                                  \
    {                                                                                              \
        float dt = at - s[k].t_in;                                                                 \
        vec3 q = PLACE(k, dt);                                                                     \
        vec4 m = READ(medium, k);                                                                  \
        vec3 own = m.rgb;                                                                          \
        LIGHT(k)                                                                                   \
        FILL(k)                                                                                    \
        float density = s[k].t_out < IDLE ? s[k].density : 0.0;                                    \
        sigma += density * taken;                                                                  \
        emitted += density * m.rgb;                                                                \
    }
            EACH_SLOT(SAMPLE)
            CHANNELS tau_i = sigma * (span / steps), lost = left * one_minus_exp(tau_i);
#if (VARIANT & FLAG_FILL) != 0
            color += left * (span / steps) * mean_exp(tau_i) * emitted;
#else
            color += lost * (emitted / max(sigma, 1.0e-30));
#endif
            left -= lost;
            tau += tau_i;
        } while ((i += 1.0) < steps);
        t = t_next;

        /* The cell that begins there, if any, for the slot concerned. */
        int k_next = enters ? vacant : leaver;
        uint here = enters ? ENTRY_LINK(door.x) : LINK_NONE, base = 0u, kind = 0u;
        vec3 origin = vec3(0.0), d = vec3(1.0);
#define CONCERNED(k)                                                                               \
    here = leaver == k && !enters ? s[k].next : here;                                              \
    origin = k_next == k ? s[k].origin : origin;                                                   \
    d = k_next == k ? s[k].d : d;                                                                  \
    base = k_next == k ? slot[k].y : base;                                                         \
    kind = k_next == k ? slot[k].z : kind;
        EACH_SLOT(CONCERNED)
        bool inside = here != LINK_NONE;
        bool at_eye = enters && entry < starts;
        int index = int(base + (inside ? here >> 2 : 0u));
        int face = at_eye ? 4 : int(here & 3u);
        Cell cell = fetch_cell(index, origin, d);
        float t_in = t - cell.near;
        uint next;
        float t_out = leave_cell(cell, index, face, t_in, next) + cell.near;
        t_out = inside ? max(t_out, t) : IDLE;
        vec3 u1, u2, u3;
        float scale;
        vec3 uvw = fetch_texture(cell, index, u1, u2, u3, scale);
        vec3 q = uvw + (cell.a.y + t_in * cell.b.y) * u1 + (cell.a.z + t_in * cell.b.z) * u2 +
                 (cell.a.w + t_in * cell.b.w) * u3;
        vec3 dq = cell.b.y * u1 + cell.b.z * u2 + cell.b.w * u3;
#if (VARIANT & FLAG_EXACT) != 0
        /* Both ends first, then the middle, whose products stay for the normals. */
        float length_t = inside ? t_out - t : 0.0, over = 1.0 / max(length_t, 1.0e-15);
        Way way = way_begin(uint(index), uvw.xy, cell.a.yzw + t_in * cell.b.yzw,
                            length_t * cell.b.yzw);
        vec3 q_in = way_at(way, 0.0), q_out = way_at(way, 1.0), q_mid = way_at(way, 0.5);
        bool exact = inside && (kind & SLOT_EXACT) != 0u;
        q = exact ? q_in : q;
        dq = exact ? (4.0 * (q_mid - q_in) - (q_out - q_in)) * over : dq;
        vec3 ddq = exact ? (2.0 * (q_out - q_in) - 4.0 * (q_mid - q_in)) * over * over : vec3(0.0);
#endif
#if (VARIANT & FLAG_LIT) != 0
        vec3 n1 = cell.c1.xyz * scale, n2 = cell.c2.xyz * scale, n3 = cell.c3.xyz * scale;
        mat3 normal =
            mat3(n1 * u1.x + n2 * u2.x + n3 * u3.x, n1 * u1.y + n2 * u2.y + n3 * u3.y,
                 n1 * u1.z + n2 * u2.z + n3 * u3.z);
#if (VARIANT & FLAG_EXACT) != 0
        normal[0] = exact ? way.X * way.du1.x + way.Y * way.du2.x : normal[0];
        normal[1] = exact ? way.X * way.du1.y + way.Y * way.du2.y : normal[1];
        normal[2] = exact ? way.Z : normal[2];
#endif
#define TURN(k)                                                                                    \
    s[k].normal[0] = k_next == k ? normal[0] : s[k].normal[0];                                     \
    s[k].normal[1] = k_next == k ? normal[1] : s[k].normal[1];                                     \
    s[k].normal[2] = k_next == k ? normal[2] : s[k].normal[2];
        EACH_SLOT(TURN)
#endif
#if (VARIANT & FLAG_FILTER) != 0
        float level = exact && (kind & SLOT_MIPS) != 0u
                          ? mip_level(way, 0.5 * (t + t_out), max(k_next, 0) * FRAME_VEC4S)
                          : 0.0;
#define LEVEL(k) s[k].level = k_next == k ? level : s[k].level;
        EACH_SLOT(LEVEL)
#endif
#define STORE(k)                                                                                   \
    s[k].t_in = k_next == k ? t : s[k].t_in;                                                       \
    s[k].t_out = k_next == k ? t_out : s[k].t_out;                                                 \
    s[k].next = k_next == k ? next : s[k].next;                                                    \
    s[k].q = k_next == k ? q : s[k].q;                                                             \
    s[k].dq = k_next == k ? dq : s[k].dq;
        EACH_SLOT(STORE)
#if (VARIANT & FLAG_EXACT) != 0
#define BEND(k) s[k].ddq = k_next == k ? ddq : s[k].ddq;
        EACH_SLOT(BEND)
#endif
        entry += enters ? 1 : 0;
        entry = enters && entry == starts ? first : entry;
        more = entry < starts || entry < last;
#define WALKING(k) more = more || s[k].t_out < IDLE;
        EACH_SLOT(WALKING)
        more = more && t < t_stop && MOST(left) >= limit.y && k_next >= 0;
    } while (more && ++visit < visits);

    show(color, tau, picture, through);
    /* A ray that has seen too many cells is no picture: told as such (renderer/render.c). */
    picture = visit < visits ? picture : vec4(uintBitsToFloat(0x7fc00000u));
}
