/* See probe.h. */
#include "renderer/probe.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/gl/clock.h"

void probe_finish(struct probe *probe) {
    gl_blocks_finish(&probe->blocks);
    free(probe->pixels);
    free(probe->index);
    free(probe->chance);
    *probe = (struct probe){0};
}

int probe_block_side(int width, int height, int k) {
    int side = k >= 4 ? 1 : (k + 3) / k;
    int least = width < height ? width : height;
    return side > least ? least : side;
}

/* The grid of blocks: those at the right and at the top are moved inward, to lie in the picture. */
struct grid {
    int width, height, k, side, columns, rows;
    const uint8_t *met;
};

static struct grid grid_of(int width, int height, int k, int side, const uint8_t *met) {
    if (side == 0)
        side = probe_block_side(width, height, k);
    return (struct grid){
        width, height, k, side, (width + side - 1) / side, (height + side - 1) / side, met};
}

static void grid_corner(const struct grid *grid, int column, int row, uint32_t corner[2]) {
    int x = column * grid->side, y = row * grid->side;
    corner[0] = (uint32_t)(x + grid->side > grid->width ? grid->width - grid->side : x);
    corner[1] = (uint32_t)(y + grid->side > grid->height ? grid->height - grid->side : y);
}

static bool grid_eligible(const struct grid *grid, int column, int row) {
    if (!grid->met)
        return true;
    uint32_t corner[2];
    grid_corner(grid, column, row, corner);
    size_t k = (size_t)grid->k, side = (size_t)grid->side * k;
    size_t width = (size_t)grid->width * k;
    const uint8_t *met = grid->met + corner[1] * k * width + corner[0] * k;
    for (size_t y = 0; y < side; y++)
        for (size_t x = 0; x < side; x++)
            if (met[y * width + x])
                return true;
    return false;
}

size_t probe_eligible(int width, int height, int k, int side, const uint8_t *met) {
    struct grid grid = grid_of(width, height, k, side, met);
    size_t count = 0;
    for (int row = 0; row < grid.rows; row++)
        for (int column = 0; column < grid.columns; column++)
            count += grid_eligible(&grid, column, row);
    return count;
}

/* A uniform number in [0, 1): PCG's output function (O'Neill 2014) over a counter. */
static double random_of(uint32_t n) {
    uint32_t state = n * 747796405u + 2891336453u;
    uint32_t word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
    return ((word >> 22) ^ word) * 0x1p-32;
}

/* The blocks are there: room for their pixels, and where these are. Takes both lists over. */
static enum status take_blocks(struct probe *probe, const struct grid *grid, uint32_t (*corner)[2],
                               double *chance, uint32_t count, struct error *err) {
    size_t area = (size_t)grid->side * (size_t)grid->side;
    free(probe->pixels);
    free(probe->index);
    free(probe->chance);
    probe->chance = chance;
    probe->count = count * area;
    probe->pixels = malloc((probe->count + 1) * sizeof *probe->pixels);
    probe->index = malloc((probe->count + 1) * sizeof *probe->index);
    if (!probe->pixels || !probe->index || !corner || !chance) {
        free(corner);
        probe->count = 0;
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for blocks of pixels");
    }
    for (size_t n = 0; n < probe->count; n++) {
        size_t within = n % area;
        size_t x = corner[n / area][0] + within % (size_t)grid->side;
        size_t y = corner[n / area][1] + within / (size_t)grid->side;
        probe->index[n] = (uint32_t)(((size_t)grid->height - 1 - y) * (size_t)grid->width + x);
    }
    return gl_blocks_set(&probe->blocks, grid->width, grid->height, grid->k, grid->side, corner,
                         count, err);
}

static double interest_of(const struct grid *grid, const float *interest, int column, int row) {
    if (!interest)
        return 1;
    uint32_t corner[2];
    double sum = 0;
    grid_corner(grid, column, row, corner);
    for (int y = 0; y < grid->side; y++)
        for (int x = 0; x < grid->side; x++) {
            size_t top = (size_t)grid->height - 1 - (corner[1] + (size_t)y);
            sum += (double)interest[top * (size_t)grid->width + corner[0] + (size_t)x];
        }
    return sum;
}

enum status probe_choose(struct probe *probe, int width, int height, int k, int side,
                         const uint8_t *met, const float *interest, double every,
                         struct error *err) {
    struct grid grid = grid_of(width, height, k, side, met);
    double total = 0, eligible = 0;
    for (int row = 0; row < grid.rows; row++)
        for (int column = 0; column < grid.columns; column++)
            if (grid_eligible(&grid, column, row)) {
                total += interest_of(&grid, interest, column, row);
                eligible++;
            }
    /* Each block takes a stretch of a line; in every unit of that stands a mark, at a place by lot;
     * a block with a mark is chosen. One of a length of at most 1 lies in one unit or in two, by p
     * and q, and is chosen with the probability 1 - (1 - p) (1 - q). */
    size_t room = (size_t)(eligible / every) + 2;
    uint32_t(*corner)[2] = malloc(room * sizeof *corner);
    double *chance = malloc(room * sizeof *chance);
    uint32_t count = 0;
    double begin = 0, scale = total > 0 ? eligible / (every * total) : 0;
    for (int row = 0; row < grid.rows && corner && chance; row++)
        for (int column = 0; column < grid.columns; column++) {
            if (!grid_eligible(&grid, column, row))
                continue;
            double length = fmin(1, scale * interest_of(&grid, interest, column, row));
            double end = begin + length, unit = floor(begin);
            double p = fmin(end, unit + 1) - begin, q = length - p;
            double first = unit + random_of((uint32_t)unit);
            double second = unit + 1 + random_of((uint32_t)unit + 1);
            bool chosen = (first >= begin && first < end) || second < end;
            begin = end;
            if (!chosen || count == room)
                continue;
            grid_corner(&grid, column, row, corner[count]);
            chance[count++] = 1 - (1 - p) * (1 - q);
        }
    return take_blocks(probe, &grid, corner, chance, count, err);
}

/* Cells that are drawn one by one reach every pixel: they need the mask. */
static bool needs_mask(const struct drawing *drawing) {
    const struct picture *picture = drawing->picture;
    for (size_t i = 0; i < picture->object_count; i++)
        if (picture->objects[i].shell && !picture->objects[i].walk)
            return true;
    return drawing->plan->surface;
}

enum status probe_draw(struct probe *probe, const struct drawing *drawing,
                       const double background[4], double factor, double *ms, struct error *err) {
    struct picture *picture = drawing->picture;
    struct gl_target *target = picture->target;
    *ms = 0;
    if (probe->count == 0)
        return STATUS_OK;
    enum status status =
        gl_target_resize(target, target->width, target->height,
                         drawing->plan->depth || picture->depth || needs_mask(drawing), err);
    if (status != STATUS_OK)
        return status;
    int kept[SCENE_OBJECTS_MAX];
    for (size_t i = 0; i < picture->object_count; i++) {
        kept[i] = picture->objects[i].quality;
        picture->objects[i].quality = (int)fmax(1, round(kept[i] * factor));
    }
    double began = clock_now_ms();
    picture->blocks = &probe->blocks;
    status = drawing_run(drawing, err);
    picture->blocks = NULL;
    gl_clock_fence();
    *ms = clock_now_ms() - began;
    for (size_t i = 0; i < picture->object_count; i++)
        picture->objects[i].quality = kept[i];
    if (status == STATUS_OK)
        status = gl_blocks_gather(&probe->blocks, picture->programs, target, background,
                                  probe->pixels, &picture->cold, err);
    return status;
}
