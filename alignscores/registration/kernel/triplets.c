/* Triplets of cameras: drawn and prescreened, all of few, or any. */

#include "kernel.h"

#define DRAWS_PER_HYPOTHESIS 1000 /* after which the hypotheses found so far are used */
#define MAX_AT_ONCE 65536        /* triplets that are drawn; bounds the memory */
#define TABULATED 128             /* cameras whose ratios of all edges fit in the cache */

__extension__ typedef unsigned __int128 uint128;

/* The next 32 bits of PCG64, as numpy.random.PCG64 gives them (O'Neill, "PCG: a family of simple fast
   space-efficient statistically good algorithms for random number generation", 2014). */
static inline uint32_t next_bits(pcg64 *g)
{
    if (g->has_half) {
        g->has_half = 0;
        return (uint32_t)g->half;
    }
    const uint128 factor = (uint128)2549297995355413924u << 64 | 4865540595714422341u;
    uint128 state = ((uint128)g->state[0] << 64 | g->state[1]) * factor
                    + ((uint128)g->increment[0] << 64 | g->increment[1]);
    g->state[0] = (uint64_t)(state >> 64);
    g->state[1] = (uint64_t)state;
    uint64_t folded = g->state[0] ^ g->state[1], turn = g->state[0] >> 58;
    uint64_t bits = folded >> turn | folded << (-turn & 63);
    g->has_half = 1;
    g->half = bits >> 32;
    return (uint32_t)bits;
}

/* What Generator.integers(n) gives: Lemire, "Fast random integer generation in an interval", 2019. */
static void draw_below(pcg64 *random, size_t n, uint32_t *numbers, size_t count)
{
    uint32_t biased = (uint32_t)((UINT64_C(1) << 32) % n);
    pcg64 g = *random;
    for (size_t i = 0; i < count; i++) {
        uint64_t product = 0;
        if (n > 1)
            do
                product = (uint64_t)next_bits(&g) * n;
            while ((uint32_t)product < biased);
        numbers[i] = (uint32_t)(product >> 32);
    }
    *random = g;
}

/* An order as Generator.permutation gives it. */
void permute(pcg64 *random, size_t n, uint32_t *order)
{
    for (size_t i = 0; i < n; i++)
        order[i] = (uint32_t)i;
    for (size_t i = n; i > 1; i--) {
        size_t mask = 1, other;
        while (mask < i - 1)
            mask = 2 * mask + 1;
        do
            other = next_bits(random) & mask;
        while (other > i - 1);
        uint32_t last = order[i - 1];
        order[i - 1] = order[other];
        order[other] = last;
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

static inline double squared_ratio(const double *gt, const double *est, size_t n, size_t i, size_t j)
{
    vector a = minus(point(gt, n, i), point(gt, n, j));
    vector b = minus(point(est, n, i), point(est, n, j));
    return dot(b, b) / dot(a, a);
}

/* The squared ratios of all edges, (n, n). */
EVERY_WIDTH
static void tabulate_ratios(const double *restrict gt, const double *restrict est, size_t n,
                            double *restrict table)
{
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            table[n * i + j] = squared_ratio(gt, est, n, i, j);
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

/* Without branches, since a processor cannot predict which triplets pass. The results are as wide
   as the numbers they are computed from, so that the loop is vectorised. */
EVERY_WIDTH
static void mark_passing(const double *restrict gt, const double *restrict est,
                         const double *restrict table, size_t n, const uint32_t *restrict drawn,
                         size_t count, double factor, uint64_t *restrict marks)
{
    const uint32_t *first = drawn, *second = drawn + count, *third = drawn + 2 * count;
    if (table)
        for (size_t t = 0; t < count; t++)
            marks[t] = (uint64_t)all_alike(table[n * first[t] + second[t]],
                                           table[n * first[t] + third[t]],
                                           table[n * second[t] + third[t]], factor);
    else
        for (size_t t = 0; t < count; t++)
            marks[t] = (uint64_t)all_alike(squared_ratio(gt, est, n, first[t], second[t]),
                                           squared_ratio(gt, est, n, first[t], third[t]),
                                           squared_ratio(gt, est, n, second[t], third[t]), factor);
}

/* All triplets that pass, each three times: every edge is the first edge once. */
static size_t enumerate(const double *table, size_t n, double factor, triplet *kept)
{
    size_t count = 0;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = i + 1; j < n; j++)
            for (uint32_t k = j + 1; k < n; k++) {
                kept[count] = (triplet){i, j, k};
                count += (size_t)all_alike(table[n * i + j], table[n * i + k], table[n * j + k],
                                           factor);
            }
    for (size_t t = 0; t < count; t++) {
        kept[count + t] = (triplet){kept[t].j, kept[t].k, kept[t].i};
        kept[2 * count + t] = (triplet){kept[t].k, kept[t].i, kept[t].j};
    }
    return 3 * count;
}

/* Triplets whose log edge ratios differ pairwise by at n_max a threshold: all, where no more exist
   than are wanted; else as many random ones, or those found in 1000 draws for each wanted one. */
bool prescreened_triplets(const cameras *c, double prescreen, size_t n_wanted, pcg64 *random,
                          triplet *kept, size_t *n_kept)
{
    pool memory = {0};
    bool is_enumerated = n_triplets(c->n) <= n_wanted;
    double factor = exp(2 * prescreen), *table = NULL;
    size_t count = 0, n_drawn = 0, batch = 2 * n_wanted;
    bool has_table = is_enumerated || c->n <= TABULATED;
    if (has_table)
        table = allocate(&memory, c->n * c->n, sizeof *table);
    bool done = table || !has_table;
    if (done && table)
        tabulate_ratios(c->gt, c->est, c->n, table);
    if (done && is_enumerated)
        count = enumerate(table, c->n, factor, kept);
    while (done && !is_enumerated && count < n_wanted && n_drawn < DRAWS_PER_HYPOTHESIS * n_wanted) {
        pool triplets = {0};
        uint32_t *drawn = allocate(&triplets, batch, 3 * sizeof *drawn);
        uint64_t *marks = allocate(&triplets, batch, sizeof *marks);
        done = drawn && marks;
        if (!done)
            batch = 0;
        draw_below(random, c->n, drawn, 3 * batch);
        mark_passing(c->gt, c->est, table, c->n, drawn, batch, factor, marks);
        for (size_t t = 0; t < batch && count < n_wanted; t++) {
            kept[count] = (triplet){drawn[t], drawn[batch + t], drawn[2 * batch + t]};
            count += marks[t];
        }
        release(&triplets);
        n_drawn += batch;
        double missing = (double)(n_wanted - count), found = (double)larger(count, 1);
        double more = 64 + floor(1.1 * missing * (double)n_drawn / found);
        batch = more < MAX_AT_ONCE ? (size_t)more : MAX_AT_ONCE;
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
