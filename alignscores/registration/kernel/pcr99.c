/* PCR-99 with unknown scale: of the alignments of random triplets, the one whose m-th smallest error
   is the smallest. */

#include "kernel.h"

#define MARGIN (64 * DBL_EPSILON) /* of a squared error, relative to the largest squared coordinate */
#define AT_ONCE 16                /* hypotheses that are counted while the cameras are in the cache */
#define TILE 1024                 /* cameras that fit there */
#define PADDING 16                /* to whole vectors of single precision */

/* Rows of s R, translation, and the largest squared error, in estimated units. */
typedef struct {
    float m[12], bound;
} rough;

/* Count the cameras within the bounds of two hypotheses. */
EVERY_WIDTH
static void count_two(const float *restrict gt, const float *restrict est, size_t stride, size_t n,
                      const rough *restrict first, const rough *restrict second,
                      uint32_t *restrict counts)
{
    const rough a = *first, b = *second;
    uint32_t a_count = 0, b_count = 0;
    for (size_t i = 0; i < n; i++) {
        float x = gt[i], y = gt[stride + i], z = gt[2 * stride + i];
        float u = est[i], v = est[stride + i], w = est[2 * stride + i];
        float a_u = u - a.m[9] - a.m[0] * x - a.m[1] * y - a.m[2] * z;
        float a_v = v - a.m[10] - a.m[3] * x - a.m[4] * y - a.m[5] * z;
        float a_w = w - a.m[11] - a.m[6] * x - a.m[7] * y - a.m[8] * z;
        float b_u = u - b.m[9] - b.m[0] * x - b.m[1] * y - b.m[2] * z;
        float b_v = v - b.m[10] - b.m[3] * x - b.m[4] * y - b.m[5] * z;
        float b_w = w - b.m[11] - b.m[6] * x - b.m[7] * y - b.m[8] * z;
        a_count += a_u * a_u + a_v * a_v + a_w * a_w <= a.bound;
        b_count += b_u * b_u + b_v * b_v + b_w * b_w <= b.bound;
    }
    counts[0] += a_count;
    counts[1] += b_count;
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

EVERY_WIDTH
static void squared_errors(const double *restrict gt, const double *restrict est, size_t n,
                           const similarity *restrict s, double *restrict errors)
{
    const similarity copy = *s;
    const double shrink = 1 / copy.scale;
    for (size_t i = 0; i < n; i++)
        errors[i] = squared_error(gt, est, n, i, shrink, &copy);
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
    squared_errors(c->exact->gt, c->exact->est, c->exact->n, s, c->errors);
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

/* Find the cheapest hypothesis below a cost. Most are rejected in single precision: fewer than `rank`
   cameras may be within the cost. */
static void find_cheapest(const cloud *c, const similarity *hypotheses, size_t n_hypotheses,
                          size_t rank, double *cost, const similarity **best)
{
    for (size_t first = 0; first < n_hypotheses; first += AT_ONCE) {
        rough some[AT_ONCE] = {{{0}}};
        uint32_t counts[AT_ONCE] = {0};
        size_t n_some = smaller(AT_ONCE, n_hypotheses - first);
        for (size_t h = 0; h < n_some; h++)
            some[h] = roughly(&hypotheses[first + h], *cost, c->farthest);
        for (size_t i = 0; i < c->stride; i += TILE)
            for (size_t h = 0; h < n_some; h += 2)
                count_two(c->gt + i, c->est + i, c->stride, smaller(TILE, c->stride - i), &some[h],
                          &some[h + 1], &counts[h]);
        for (size_t h = 0; h < n_some; h++)
            if ((counts[h] >= rank || some[h].bound == INFINITY)
                && is_cheaper(c, &hypotheses[first + h], rank, cost))
                *best = &hypotheses[first + h];
    }
}

static void to_single(const double *points, size_t n, size_t stride, float *singles)
{
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < stride; i++)
            singles[k * stride + i] = i < n ? (float)points[k * n + i] : NAN;
}

/* A flat triangle says nothing about the spin around its line, so it must beat all others by more
   than a margin of rounding: on a partly straight path many similarities fit m cameras exactly. */
bool pcr99(const cameras *c, const options *o, size_t rank, pcg64 *random, similarity *found,
           size_t *n_used)
{
    pool memory = {0};
    size_t n_max = max_prescreened(c->n, o->n_hypotheses), stride = c->n + (-c->n & (PADDING - 1));
    triplet *triplets = allocate(&memory, n_max, sizeof *triplets);
    similarity *fits = allocate(&memory, n_max, sizeof *fits);
    float *gt = allocate(&memory, 3 * stride, sizeof *gt);
    float *est = allocate(&memory, 3 * stride, sizeof *est);
    double *errors = allocate(&memory, c->n, sizeof *errors);
    bool done = triplets && fits && gt && est && errors
                && prescreened_triplets(c, o->prescreen, o->n_hypotheses, random, triplets, n_used);
    if (done && *n_used > 0) {
        to_single(c->gt, c->n, stride, gt);
        to_single(c->est, c->n, stride, est);
        double square = 0;
        for (size_t i = 0; i < c->n; i++)
            square = fmax(square, dot(point(c->gt, c->n, i), point(c->gt, c->n, i)));
        const cloud all = {c, gt, est, stride, sqrt(square), errors};
        const similarity *best = fits;
        double cost = INFINITY;
        size_t n_fits = fit_triplets(c, triplets, *n_used, o->alignment, fits);
        find_cheapest(&all, fits, n_fits, rank, &cost, &best);
        cost -= fmin(MARGIN * square, DBL_MAX);
        if (cost > 0)
            find_cheapest(&all, fits + n_fits, *n_used - n_fits, rank, &cost, &best);
        *found = *best;
    }
    release(&memory);
    return done;
}
