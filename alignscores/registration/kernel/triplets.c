/* Triplets of cameras: drawn and prescreened, all of few, or any. */

#include "kernel.h"

#define DRAWS_PER_HYPOTHESIS 1000 /* after which the hypotheses found so far are used */
#define MOST_AT_ONCE 65536        /* triplets that are drawn; bounds the memory */

/* What Generator.integers(n) gives: Lemire, "Fast random integer generation in an interval", 2019. */
static void draw_below(bitgen *random, size_t n, uint32_t *numbers, size_t count)
{
    uint32_t biased = (uint32_t)((UINT64_C(1) << 32) % n);
    const bitgen g = *random;
    for (size_t i = 0; i < count; i++) {
        uint64_t product = 0;
        if (n > 1)
            do
                product = (uint64_t)g.next_uint32(g.state) * n;
            while ((uint32_t)product < biased);
        numbers[i] = (uint32_t)(product >> 32);
    }
}

size_t n_triplets(size_t n)
{
    double product = (double)n * ((double)n - 1) * ((double)n - 2); /* 0 of fewer than 3 */
    return product / 6 < (double)(SIZE_MAX >> 8) ? (size_t)(product / 6) : SIZE_MAX >> 8;
}

size_t most_prescreened(size_t n, size_t n_wanted)
{
    return n_triplets(n) <= n_wanted ? 3 * n_triplets(n) : n_wanted;
}

static inline double squared_ratio(const double *gt, const double *est, size_t n, size_t i, size_t j)
{
    vector a = minus(point(gt, n, i), point(gt, n, j));
    vector b = minus(point(est, n, i), point(est, n, j));
    return dot(b, b) / dot(a, a);
}

static inline int usable(double ratio)
{
    return (0 < ratio) & (ratio < INFINITY);
}

static inline int alike(double a, double b, double factor)
{
    return (a <= factor * b) & (b <= factor * a);
}

static inline int passes(const double *gt, const double *est, size_t n, triplet t, double factor)
{
    double ij = squared_ratio(gt, est, n, t.i, t.j);
    double ik = squared_ratio(gt, est, n, t.i, t.k);
    double jk = squared_ratio(gt, est, n, t.j, t.k);
    return usable(ij) & usable(ik) & usable(jk) & alike(ij, ik, factor) & alike(ij, jk, factor)
           & alike(ik, jk, factor);
}

/* Without branches, since a processor cannot predict which triplets pass. The results are as wide
   as the numbers they are computed from, so that the loop is vectorised. */
EVERY_WIDTH
static void mark_passing(const double *restrict gt, const double *restrict est, size_t n,
                         const uint32_t *restrict drawn, size_t count, double factor,
                         uint64_t *restrict marks)
{
    for (size_t t = 0; t < count; t++) {
        triplet corners = {drawn[t], drawn[count + t], drawn[2 * count + t]};
        marks[t] = (uint64_t)passes(gt, est, n, corners, factor);
    }
}

/* All triplets that pass, each three times: every edge is the first edge once. */
static size_t enumerate(const cameras *c, double factor, triplet *kept)
{
    size_t count = 0;
    for (int turn = 0; turn < 3; turn++)
        for (uint32_t i = 0; i < c->n; i++)
            for (uint32_t j = i + 1; j < c->n; j++)
                for (uint32_t k = j + 1; k < c->n; k++) {
                    triplet t = turn == 0 ? (triplet){i, j, k}
                                : turn == 1 ? (triplet){j, k, i}
                                            : (triplet){k, i, j};
                    kept[count] = t;
                    count += (size_t)passes(c->gt, c->est, c->n, t, factor);
                }
    return count;
}

/* Triplets whose log edge ratios differ pairwise by at most a threshold: all, where no more exist
   than are wanted; else as many random ones, or those found in 1000 draws for each wanted one. */
bool prescreened_triplets(const cameras *c, double prescreen, size_t n_wanted, bitgen *random,
                          triplet *kept, size_t *n_kept)
{
    double factor = exp(2 * prescreen);
    *n_kept = 0;
    if (n_triplets(c->n) <= n_wanted) {
        *n_kept = enumerate(c, factor, kept);
        return true;
    }
    pool memory = {0};
    size_t count = 0, n_drawn = 0, batch = 2 * n_wanted, most = larger(batch, MOST_AT_ONCE);
    uint32_t *drawn = allocate(&memory, most, 3 * sizeof *drawn);
    uint64_t *marks = allocate(&memory, most, sizeof *marks);
    bool done = drawn && marks;
    while (done && count < n_wanted && n_drawn < DRAWS_PER_HYPOTHESIS * n_wanted) {
        draw_below(random, c->n, drawn, 3 * batch);
        mark_passing(c->gt, c->est, c->n, drawn, batch, factor, marks);
        for (size_t t = 0; t < batch && count < n_wanted; t++)
            if (marks[t])
                kept[count++] = (triplet){drawn[t], drawn[batch + t], drawn[2 * batch + t]};
        n_drawn += batch;
        double missing = (double)(n_wanted - count), found = (double)larger(count, 1);
        double more = 64 + floor(1.1 * missing * (double)n_drawn / found);
        batch = more < MOST_AT_ONCE ? (size_t)more : MOST_AT_ONCE;
    }
    release(&memory);
    *n_kept = count;
    return done;
}

/* All triplets, the longest edge first, so that no order of the cameras matters. */
void all_triplets(const cameras *c, triplet *triplets)
{
    size_t count = 0;
    for (uint32_t i = 0; i < c->n; i++)
        for (uint32_t j = i + 1; j < c->n; j++)
            for (uint32_t k = j + 1; k < c->n; k++) {
                vector a = point(c->gt, c->n, i), b = point(c->gt, c->n, j);
                vector third = point(c->gt, c->n, k);
                vector ij = minus(a, b), jk = minus(b, third), ki = minus(third, a);
                double squares[3] = {dot(ij, ij), dot(jk, jk), dot(ki, ki)};
                triplet t = {i, j, k};
                if (squares[1] > squares[0] && !(squares[2] > squares[1]))
                    t = (triplet){j, k, i};
                else if (squares[2] > squares[0])
                    t = (triplet){k, i, j};
                triplets[count++] = t;
            }
}

/* Triplets of distinct cameras, all as probable. */
bool any_triplets(size_t n, bitgen *random, triplet *triplets, size_t count)
{
    pool memory = {0};
    uint32_t *drawn = allocate(&memory, count, 3 * sizeof *drawn);
    for (size_t row = 0; drawn && row < 3; row++)
        draw_below(random, n - row, drawn + row * count, count);
    for (size_t t = 0; drawn && t < count; t++) {
        uint32_t i = drawn[t], j = drawn[count + t], k = drawn[2 * count + t];
        j += j >= i; /* one of the others */
        k += k >= (i < j ? i : j);
        k += k >= (i < j ? j : i);
        triplets[t] = (triplet){i, j, k};
    }
    release(&memory);
    return drawn != NULL;
}
