/* Triplets of cameras: drawn and prescreened, or all. */

#include "kernel.h"

#define DRAWS_PER_HYPOTHESIS 1000 /* after which the hypotheses found so far are used */
#define MAX_AT_ONCE 65536         /* triplets that are drawn; bounds the memory */

/* What Generator.integers(n) gives: Lemire, "Fast random integer generation in an interval", 2019. */
static void draw_below(bitgen *random, size_t n, uint32_t *numbers, size_t count)
{
    uint32_t biased = (uint32_t)((UINT64_C(1) << 32) % n);
    for (size_t i = 0; i < count; i++) {
        uint64_t product;
        do
            product = (uint64_t)random->next_uint32(random->state) * n;
        while ((uint32_t)product < biased);
        numbers[i] = (uint32_t)(product >> 32);
    }
}

size_t n_triplets(size_t n)
{
    double product = (double)n * ((double)n - 1) * ((double)n - 2); /* 0 of fewer than 3 */
    return product / 6 < (double)(SIZE_MAX >> 8) ? (size_t)(product / 6) : SIZE_MAX >> 8;
}

size_t max_prescreened(size_t n, size_t n_wanted)
{
    return n_triplets(n) <= n_wanted ? 3 * n_triplets(n) : n_wanted;
}

static inline double squared_edge(const double *points, size_t n, size_t i, size_t j)
{
    vector edge = minus(point(points, n, i), point(points, n, j));
    return dot(edge, edge);
}

static inline double squared_ratio(const double *gt, const double *est, size_t n, size_t i, size_t j)
{
    return squared_edge(est, n, i, j) / squared_edge(gt, n, i, j);
}

static inline int alike(double a, double b, double factor)
{
    return (a <= factor * b) & (b <= factor * a);
}

/* 0 and infinity are no ratios, NaN is like none. */
static inline int all_alike(double ij, double ik, double jk, double factor)
{
    return (0 < ij) & (ij < INFINITY) & (0 < ik) & (ik < INFINITY) & (0 < jk) & (jk < INFINITY)
           & alike(ij, ik, factor) & alike(ij, jk, factor) & alike(ik, jk, factor);
}

static inline int passes(const double *gt, const double *est, size_t n, triplet t, double factor)
{
    return all_alike(squared_ratio(gt, est, n, t.i, t.j), squared_ratio(gt, est, n, t.i, t.k),
                     squared_ratio(gt, est, n, t.j, t.k), factor);
}

/* Without branches, since a processor cannot predict which triplets pass. The results are as wide
   as the numbers they are computed from, so that the loop is vectorised. */
EVERY_WIDTH
static void mark_passing(const double *restrict gt, const double *restrict est, size_t n,
                         const uint32_t *restrict drawn, size_t count, double factor,
                         uint64_t *restrict marks)
{
    for (size_t t = 0; t < count; t++) {
        triplet cameras = {drawn[t], drawn[count + t], drawn[2 * count + t]};
        marks[t] = (uint64_t)passes(gt, est, n, cameras, factor);
    }
}

/* All triplets, the longest edge first, so that no order of the cameras matters. */
void all_triplets(const cameras *c, triplet *triplets)
{
    size_t count = 0;
    for (uint32_t i = 0; i < c->n; i++)
        for (uint32_t j = i + 1; j < c->n; j++)
            for (uint32_t k = j + 1; k < c->n; k++) {
                double ij = squared_edge(c->gt, c->n, i, j), jk = squared_edge(c->gt, c->n, j, k);
                double ki = squared_edge(c->gt, c->n, k, i);
                triplets[count++] = ij >= jk && ij >= ki ? (triplet){i, j, k}
                                    : jk >= ki           ? (triplet){j, k, i}
                                                         : (triplet){k, i, j};
            }
}

/* All triplets that pass, each three times: every edge is the first edge once. */
static size_t enumerate(const cameras *c, double factor, triplet *triplets)
{
    size_t count = 0;
    all_triplets(c, triplets);
    for (size_t t = 0; t < n_triplets(c->n); t++) {
        triplets[count] = triplets[t];
        count += (size_t)passes(c->gt, c->est, c->n, triplets[t], factor);
    }
    for (size_t t = 0; t < count; t++) {
        triplets[count + t] = (triplet){triplets[t].j, triplets[t].k, triplets[t].i};
        triplets[2 * count + t] = (triplet){triplets[t].k, triplets[t].i, triplets[t].j};
    }
    return 3 * count;
}

/* Triplets whose log edge ratios differ pairwise by at most a threshold: all, where no more exist
   than are wanted; else as many random ones, or those found in 1000 draws for each wanted one. Return
   how many there are; -1 without memory. */
ptrdiff_t prescreened_triplets(const cameras *c, size_t n_wanted, double prescreen, bitgen *random,
                               triplet *triplets)
{
    const double factor = exp(2 * prescreen);
    if (n_triplets(c->n) <= n_wanted)
        return (ptrdiff_t)enumerate(c, factor, triplets);
    size_t count = 0, n_drawn = 0, batch = 2 * n_wanted, capacity = 0;
    uint32_t *drawn = NULL;
    uint64_t *marks = NULL;
    while (count < n_wanted && n_drawn / DRAWS_PER_HYPOTHESIS < n_wanted) {
        if (batch > capacity) {
            free(drawn);
            free(marks);
            capacity = batch;
            drawn = allocate(capacity, 3 * sizeof *drawn);
            marks = allocate(capacity, sizeof *marks);
        }
        if (drawn == NULL || marks == NULL) {
            capacity = 0;
            break;
        }
        draw_below(random, c->n, drawn, 3 * batch);
        mark_passing(c->gt, c->est, c->n, drawn, batch, factor, marks);
        for (size_t t = 0; t < batch && count < n_wanted; t++) {
            triplets[count] = (triplet){drawn[t], drawn[batch + t], drawn[2 * batch + t]};
            count += marks[t];
        }
        n_drawn += batch;
        double missing = (double)(n_wanted - count), passed = (double)larger(count, 1);
        double more = 64 + floor(1.1 * missing * (double)n_drawn / passed);
        batch = more < MAX_AT_ONCE ? (size_t)more : MAX_AT_ONCE;
    }
    free(drawn);
    free(marks);
    return capacity > 0 ? (ptrdiff_t)count : -1;
}
