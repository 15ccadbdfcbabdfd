/* PCR-99 with unknown scale: of the alignments of random triplets, the one whose m-th smallest error
   is the smallest. */

#include "kernel.h"

#define MARGIN (64 * DBL_EPSILON) /* of a squared error, relative to the largest squared coordinate */
#define PADDING 16                /* to whole vectors of single precision */

/* Rows of s R, translation, and the largest squared error, in estimated units. */
typedef struct {
    float m[12], bound;
} rough;

/* Count the cameras within the bound of a hypothesis. */
EVERY_WIDTH
static uint32_t count_within(const float *restrict gt, const float *restrict est, size_t n, rough h)
{
    uint32_t count = 0;
    for (size_t i = 0; i < n; i++) {
        float x = gt[i], y = gt[n + i], z = gt[2 * n + i];
        float u = est[i] - h.m[9] - h.m[0] * x - h.m[1] * y - h.m[2] * z;
        float v = est[n + i] - h.m[10] - h.m[3] * x - h.m[4] * y - h.m[5] * z;
        float w = est[2 * n + i] - h.m[11] - h.m[6] * x - h.m[7] * y - h.m[8] * z;
        count += u * u + v * v + w * w <= h.bound;
    }
    return count;
}

/* A hypothesis in single precision. All that is computed of it is off by less than 30 half units in
   the last place of the largest number, of cameras within the cost: the slack is twice that, so that
   no camera is missed. Where that cannot be said the bound is infinite. */
static rough roughly(const similarity *s, double cost, double farthest)
{
    const vector rows[4] = {times(s->scale, s->rotation.x), times(s->scale, s->rotation.y),
                            times(s->scale, s->rotation.z), s->translation};
    rough h;
    for (size_t k = 0; k < 4; k++) {
        h.m[3 * k] = (float)rows[k].x;
        h.m[3 * k + 1] = (float)rows[k].y;
        h.m[3 * k + 2] = (float)rows[k].z;
    }
    double scale = fabs(s->scale), bound = scale * sqrt(cost);
    double largest = sqrt(dot(s->translation, s->translation)) + 2 * scale * farthest + bound;
    double slack = 32 * FLT_EPSILON * largest + (1 + farthest) * FLT_MIN;
    bound += slack;
    h.bound = largest < 1e15 ? (float)(bound * bound * (1 + 8 * FLT_EPSILON)) + FLT_MIN : INFINITY;
    return h;
}

typedef struct {
    const cameras *exact;
    const float *gt, *est; /* (3, stride), what is beyond n is not a number */
    size_t stride;
    double farthest; /* largest coordinate of the ground truth */
    double *errors;  /* (n,) */
} cloud;

/* Take a hypothesis if its cost is below the lowest one; double precision decides. */
static bool is_cheaper(const cloud *c, const similarity *s, size_t rank, double *cost)
{
    size_t count = 0;
    squared_errors(c->exact, s, c->errors);
    for (size_t i = 0; i < c->exact->n; i++) {
        double error = c->errors[i];
        c->errors[count] = error;
        count += error < *cost;
    }
    if (count < rank)
        return false;
    *cost = nth_smallest(c->errors, count, rank - 1);
    return true;
}

/* Find the cheapest hypothesis below a cost, of those that are marked or of the others. Most are
   rejected in single precision: fewer than `rank` cameras may be within the cost. */
static void find_cheapest(const cloud *c, const similarity *hypotheses, size_t n_hypotheses,
                          const double *marks, bool marked, size_t rank, double *cost,
                          const similarity **best)
{
    for (size_t h = 0; h < n_hypotheses; h++) {
        if ((marks[h] > 0) != marked)
            continue;
        rough some = roughly(&hypotheses[h], *cost, c->farthest);
        if ((some.bound == INFINITY || count_within(c->gt, c->est, c->stride, some) >= rank)
            && is_cheaper(c, &hypotheses[h], rank, cost))
            *best = &hypotheses[h];
    }
}

static void to_single(const double *points, size_t n, size_t stride, float *singles)
{
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < stride; i++)
            singles[k * stride + i] = i < n ? (float)points[k * n + i] : NAN;
}

/* Register points of both frames, (3, n), by an alignment of the group: the best one, of `rank` as m.
   Return the number of hypotheses, 0 if there is no alignment, -1 without memory.

   A flat triangle says nothing about the spin around its line, so it must beat all others by more
   than a margin of rounding: on a partly straight path many similarities fit m cameras exactly. */
EXPORTED
ptrdiff_t pcr99(size_t n, const double *gt, const double *est, int alignment, size_t rank,
                size_t n_hypotheses, double prescreen, bitgen *random, similarity *best)
{
    const cameras c = {n, n, gt, est};
    size_t n_max = max_prescreened(n, n_hypotheses), stride = n + (-n & (PADDING - 1));
    triplet *triplets = allocate(n_max, sizeof *triplets);
    similarity *fits = allocate(n_max, sizeof *fits);
    double *is_free = allocate(n_max, sizeof *is_free), *errors = allocate(n, sizeof *errors);
    float *singles = allocate(6 * stride + PADDING, sizeof *singles);
    ptrdiff_t count = -1;
    if (triplets && fits && is_free && errors && singles)
        count = prescreened_triplets(&c, n_hypotheses, prescreen, random, triplets);
    if (count > 0) {
        double square = 0, cost = INFINITY;
        for (size_t i = 0; i < n; i++)
            square = fmax(square, dot(point(gt, n, i), point(gt, n, i)));
        /* Aligned, so that no vector lies in two lines of the cache. */
        float *gt_singles = singles + (-(uintptr_t)singles / sizeof *singles & (PADDING - 1));
        float *est_singles = gt_singles + 3 * stride;
        const cloud all = {&c, gt_singles, est_singles, stride, sqrt(square), errors};
        const similarity *cheapest = fits;
        to_single(gt, n, stride, gt_singles);
        to_single(est, n, stride, est_singles);
        fit_triplets(&c, triplets, (size_t)count, alignment, fits, is_free);
        find_cheapest(&all, fits, (size_t)count, is_free, false, rank, &cost, &cheapest);
        cost -= fmin(MARGIN * square, DBL_MAX);
        if (cost > 0)
            find_cheapest(&all, fits, (size_t)count, is_free, true, rank, &cost, &cheapest);
        *best = *cheapest;
    }
    free(triplets);
    free(fits);
    free(is_free);
    free(errors);
    free(singles);
    return count;
}
