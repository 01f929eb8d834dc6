/* The emission-absorption integral along one ray,
 *
 *   L = int j(t) T(t) dt,  T(t) = exp(-int sigma dt),  sigma = sum sigma_i,  j = sum sigma_i c_i,
 *
 * of each channel,
 *
 * over every material that the ray is in at t: where shells or folds overlap, extinctions add and
 * colours mix by extinction; what fills a shell evenly adds to both, sigma_a and q.
 *
 * Between two neighbouring ends of cells every field is smooth, but for the light's own kinks.
 * There the integral is taken by the five-point Lobatto rule: optical depths at the nodes by
 * integrating the interpolant of sigma (the coefficients of Lobatto IIIA, order 8: Hairer & Wanner,
 * Solving Ordinary Differential Equations II, IV.5), then the emission by the same rule. It is
 * halved until whole and halves agree, in radiance and in transmittance; what is kept is the
 * halves', whose error is far less than the difference. Where all that is met is homogeneous, the
 * closed form. */
#include <stdlib.h>
#include <string.h>

#include "renderer/reference/trace.h"
#include "renderer/reference/vector.h"
#include "renderer/reference/voxels.h"

/* An interval is halved at most this deep, and this often: where thickness is near the rounding of
 * t the integrand is noise, and no halving would end it. Kinks take some 50, stiff media some 100.
 */
enum { NODES = 5, DEPTH_MAX = 48, HALVINGS_MAX = 2000 };

/* A panel that lets less through is halved whatever its halves say: where sigma rises from 0 to a
 * depth of hundreds, every node but the first lies behind all of the light, whole and halves agree
 * on none, and a lit medium came out black. exp(-8): the emission's peak is a quarter of a panel
 * wide or wider, which five nodes see. */
static const double RESOLVED = 3.3e-4;

/* What is left behind this cannot be seen: 1e-16 of any radiance is below its last digit. */
static const double OPAQUE = 1e-16;

static const double node[NODES] = {0, 0.17267316464601142810, 0.5, 0.82732683535398857190, 1};
static const double weight[NODES] = {1.0 / 20, 49.0 / 180, 16.0 / 45, 49.0 / 180, 1.0 / 20};

/* From 0 to node i + 1. */
static const double depth_to[NODES - 1][NODES] = {
    {0.06772843218615689797, 0.11974476934341168252, -0.02173572186655811367,
     0.01063582422541549188, -0.00370013924241453060},
    {0.04062500000000000000, 0.30318418332304277802, 0.17777777777777777778,
     -0.03096196110082055580, 0.00937500000000000000},
    {0.05370013924241453060, 0.26158639799680673034, 0.37729127742211366922, 0.15247745287881053971,
     -0.01772843218615689797},
    {1.0 / 20, 49.0 / 180, 16.0 / 45, 49.0 / 180, 1.0 / 20}};

/* A cell that the ray is in, with its voxels. */
struct active {
    const struct cell *cell;
    const struct prism_ray *prism;
    const struct volume *volume;
    struct voxels voxels;
    double scale; /* from stored extinction to optical depth for each unit of t */
    double speed; /* object lengths for each unit of t */
};

/* By channels, of which `sigma` and what is let through mostly are one: see struct integral. */
struct sample {
    double sigma[3], j[3];
};

struct panel {
    double radiance[3], transmittance[3];
};

struct integral {
    struct tracer *tracer;
    const double *view;
    bool homogeneous;  /* all that is active */
    bool tinted;       /* extinction has colours: else channel 0 stands for all three */
    int halvings;      /* of the interval, so far */
    double front[3];   /* transmittance in front of the interval */
    double brightness; /* errors count relative to it: 1, or the radiance if that is more */
};

/* What fills the shell besides, wherever it is. */
static void add_fill(const struct active *active, struct sample *sample) {
    for (int i = 0; i < 3; i++)
        sample->sigma[i] += active->volume->tint[i] * active->volume->absorption * active->speed;
    for (int i = 0; i < 3; i++)
        sample->j[i] += active->volume->emission[i] * active->speed;
}

static void add_constant(const struct active *active, struct sample *sample) {
    for (int i = 0; i < 3; i++) {
        double sigma = active->volume->tint[i] * active->volume->extinction * active->scale;
        sample->sigma[i] += sigma;
        sample->j[i] += sigma * active->volume->radiance[i];
    }
}

/* `incident` is found when the first lit medium asks; then *known. False where it cannot be. */
static bool add_voxels(const struct integral *integral, const struct active *active, double t,
                       struct reference_incident *incident, bool *known, struct sample *sample) {
    const struct volume *volume = active->volume;
    const struct prism_ray *prism = active->prism;
    double at[3], b[3], value[4], w = prism_w(prism, &active->cell->span, t);
    if (!voxels_place(prism, t, w, at, b))
        return true;
    voxels_value(&active->voxels, at, value);
    if (!(value[3] > 0))
        return true;
    double source[3];
    if (volume->lit) {
        double gradient[3], normal[3] = {0, 0, 0}, color[3], strand[3];
        if (!*known &&
            !tracer_incident(integral->tracer, t, &(struct origin){.object = NULL}, incident))
            return false;
        *known = true;
        const struct reference_lights *lights = &integral->tracer->world->lights;
        double specular = (double)volume->specular, shininess = (double)volume->shininess;
        for (int i = 0; i < 3; i++)
            color[i] = value[i] / value[3];
        if (volume->strand_lit) {
            voxels_strand(&active->voxels, at, value[3], strand);
            double together = fmin(1, sqrt(dot3(strand, strand)));
            if (!voxels_tangent(prism, b, w, strand, normal))
                together = 0;
            reference_strand_light(lights, incident, color, normal, integral->view, together,
                                   specular, shininess, source);
        } else {
            voxels_gradient(&active->voxels, at, gradient);
            double g = sqrt(dot3(gradient, gradient));
            if (!voxels_normal(volume, prism, b, w, gradient, normal))
                g = 0;
            reference_light(lights, incident, color, normal, integral->view, g / (g + 0.01),
                            specular, shininess, source);
        }
    } else {
        for (int i = 0; i < 3; i++)
            source[i] = value[i] / value[3];
    }
    for (int i = 0; i < 3; i++)
        source[i] += volume->glow * value[i] / value[3];
    for (int i = 0; i < 3; i++) {
        double sigma = volume->tint[i] * value[3] * active->scale;
        sample->sigma[i] += sigma;
        sample->j[i] += sigma * source[i];
    }
    return true;
}

/* Where light cannot be found the sample is dark, and tracer->status tells. */
static void sample_at(const struct integral *integral, double t, struct sample *sample) {
    struct tracer *tracer = integral->tracer;
    struct reference_incident incident;
    bool known = false;
    memset(sample, 0, sizeof *sample);
    for (size_t k = 0; k < tracer->active_count; k++) {
        add_fill(&tracer->active[k], sample);
        if (tracer->active[k].volume->homogeneous)
            add_constant(&tracer->active[k], sample);
        else if (!add_voxels(integral, &tracer->active[k], t, &incident, &known, sample))
            break;
    }
    tracer->evaluations++;
}

static void panel_of(const struct integral *integral, const struct sample samples[NODES], double h,
                     struct panel *panel) {
    memset(panel, 0, sizeof *panel);
    for (int n = 0; n < NODES; n++)
        for (int i = 0; i < 3; i++) {
            double depth = 0;
            for (int k = 0; k < NODES && n > 0 && (i == 0 || integral->tinted); k++)
                depth += depth_to[n - 1][k] * samples[k].sigma[i];
            panel->transmittance[i] =
                i == 0 || integral->tinted ? exp(-h * depth) : panel->transmittance[0];
            panel->radiance[i] += h * weight[n] * samples[n].j[i] * panel->transmittance[i];
        }
}

static void append(struct panel *front, const struct panel *behind) {
    for (int i = 0; i < 3; i++) {
        front->radiance[i] += front->transmittance[i] * behind->radiance[i];
        front->transmittance[i] *= behind->transmittance[i];
    }
}

static double most3(const double x[3]) {
    return fmax(x[0], fmax(x[1], x[2]));
}

static void refine(struct integral *integral, double a, double b,
                   const struct sample samples[NODES], const struct panel *whole, double tolerance,
                   int depth, struct panel *result) {
    double middle = a + (b - a) / 2;
    struct sample half[2][NODES];
    struct panel part[2];
    half[0][0] = samples[0];
    half[0][NODES - 1] = half[1][0] = samples[2];
    half[1][NODES - 1] = samples[NODES - 1];
    for (int n = 1; n < NODES - 1; n++) {
        sample_at(integral, a + (middle - a) * node[n], &half[0][n]);
        sample_at(integral, middle + (b - middle) * node[n], &half[1][n]);
    }
    panel_of(integral, half[0], middle - a, &part[0]);
    panel_of(integral, half[1], b - middle, &part[1]);
    *result = part[0];
    append(result, &part[1]);
    double error = 0;
    bool resolved = true;
    for (int i = 0; i < 3; i++) {
        double through = fabs(result->transmittance[i] - whole->transmittance[i]);
        double light = fabs(result->radiance[i] - whole->radiance[i]) / integral->brightness;
        error = fmax(error, integral->front[i] * fmax(through, light));
        /* A channel that is dark may be as stiff as it likes where another still sees. */
        resolved &= whole->transmittance[i] >= RESOLVED || integral->front[i] <= OPAQUE;
    }
    if (error <= tolerance && resolved)
        return;
    if (depth == DEPTH_MAX || integral->halvings == HALVINGS_MAX || !(middle > a && middle < b) ||
        !isfinite(error)) {
        integral->tracer->unresolved++;
        return;
    }
    integral->halvings++;
    refine(integral, a, middle, half[0], &part[0], tolerance / 2, depth + 1, result);
    double front[3];
    memcpy(front, integral->front, sizeof front);
    for (int i = 0; i < 3; i++)
        integral->front[i] *= result->transmittance[i];
    struct panel second = part[1];
    if (most3(integral->front) > OPAQUE)
        refine(integral, middle, b, half[1], &part[1], tolerance / 2, depth + 1, &second);
    memcpy(integral->front, front, sizeof front);
    append(result, &second);
}

static void closed_form(const struct sample *sample, double h, struct panel *panel) {
    for (int i = 0; i < 3; i++) {
        double depth = sample->sigma[i] * h;
        panel->transmittance[i] = exp(-depth);
        /* The mean transmittance on the way; 1 where nothing is lost, as in a glow without
         * extinction. */
        double mean = depth > 0 ? -expm1(-depth) / depth : 1;
        panel->radiance[i] = sample->j[i] * h * mean;
    }
}

static void over_interval(struct integral *integral, double a, double b, double tolerance,
                          struct panel *result) {
    struct sample samples[NODES];
    sample_at(integral, a, &samples[0]);
    if (integral->homogeneous) {
        closed_form(&samples[0], b - a, result);
        return;
    }
    for (int n = 1; n < NODES; n++)
        sample_at(integral, a + (b - a) * node[n], &samples[n]);
    struct panel whole;
    integral->halvings = 0;
    panel_of(integral, samples, b - a, &whole);
    refine(integral, a, b, samples, &whole, tolerance, 0, result);
}

/* ---- the sweep ---- */

static bool activate(struct tracer *tracer, const struct cell *cell) {
    const struct prism_ray *prism = &tracer->prisms[tracer->segments[cell->segment].prism];
    const struct volume *volume = prism->object->volume;
    if (!volume->homogeneous && !volume->medium)
        return true;
    void *list = tracer->active;
    if (!tracer_grow(tracer, &list, tracer->active_count, &tracer->active_capacity,
                     sizeof *tracer->active))
        return false;
    tracer->active = list;
    struct active *active = &tracer->active[tracer->active_count];
    active->cell = cell;
    active->prism = prism;
    active->volume = volume;
    active->scale = active->speed = prism->ray->speed;
    if (!volume->homogeneous) {
        active->scale /= prism->object->spec->shell.thickness;
        voxels_load(volume, false, volume->lit && !volume->strand_lit, cell->x, cell->y, cell->z,
                    &active->voxels);
        if (volume->strand_lit)
            voxels_load_strands(&active->voxels);
        double most = 0;
        for (int c = 0; c < 8; c++)
            most = fmax(most, active->voxels.value[c][3]);
        if (!(most > 0) && !volume_is_filled(volume))
            return true; /* empty: neither seen nor listed */
    }
    tracer->active_count++;
    return true;
}

static void retire(struct tracer *tracer, double t) {
    size_t kept = 0;
    for (size_t k = 0; k < tracer->active_count; k++)
        if (tracer->active[k].cell->span.t[1] > t) {
            if (kept != k)
                tracer->active[kept] = tracer->active[k];
            kept++;
        }
    tracer->active_count = kept;
}

static bool any_tinted(const struct tracer *tracer) {
    for (size_t k = 0; k < tracer->active_count; k++)
        if (volume_is_tinted(tracer->active[k].volume))
            return true;
    return false;
}

static bool all_homogeneous(const struct tracer *tracer) {
    for (size_t k = 0; k < tracer->active_count; k++)
        if (!tracer->active[k].volume->homogeneous)
            return false;
    return true;
}

bool tracer_integrate(struct tracer *tracer, double t_eye, double t_end, const double view[3],
                      double radiance[3], double transmittance[3]) {
    struct integral integral = {.tracer = tracer, .view = view};
    struct panel sum = {{0, 0, 0}, {1, 1, 1}};
    /* Ten intervals' estimates add up to the tolerance at the worst; what is kept errs by a
     * hundredth of its estimate, or less. */
    double tolerance = tracer->tolerance / 10;
    size_t next = 0;
    double t = t_eye;
    tracer->active_count = 0;
    while (most3(sum.transmittance) > OPAQUE && t < t_end && tracer->status == STATUS_OK) {
        retire(tracer, t);
        while (next < tracer->cell_count && tracer->cells[next].span.t[0] <= t) {
            const struct cell *cell = &tracer->cells[next++];
            if (cell->span.t[1] > t && !activate(tracer, cell))
                return false;
        }
        double to = t_end;
        for (size_t k = 0; k < tracer->active_count; k++)
            to = fmin(to, tracer->active[k].cell->span.t[1]);
        if (next < tracer->cell_count)
            to = fmin(to, tracer->cells[next].span.t[0]);
        else if (tracer->active_count == 0)
            break;
        if (tracer->active_count > 0) {
            struct panel panel;
            integral.homogeneous = all_homogeneous(tracer);
            integral.tinted = any_tinted(tracer);
            memcpy(integral.front, sum.transmittance, sizeof integral.front);
            integral.brightness = fmax(1, most3(sum.radiance));
            over_interval(&integral, t, to, tolerance, &panel);
            append(&sum, &panel);
        }
        t = to;
    }
    memcpy(radiance, sum.radiance, sizeof sum.radiance);
    memcpy(transmittance, sum.transmittance, sizeof sum.transmittance);
    return tracer->status == STATUS_OK;
}
