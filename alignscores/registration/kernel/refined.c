/* The registration that maximises the score: the smallest truncated L1 cost over the cameras,
   sum(min(sqrt(e^2 + r^2), T)), with the largest threshold T and the resolution r. See
   docs/explanation/registration.md. */

#include "kernel.h"

#define FARTHEST_SQUARABLE 1e100 /* thresholds beyond may overflow */
#define PRESCREEN 0.1      /* of the paper */
#define N_STARTS 64        /* hypotheses that are refined; their number is halved in each step */
#define SMALL_N 30         /* cameras up to which all triplets are tried */
#define FEWEST 8           /* cameras up to which a fit to each subset is tried, too */
#define N_NEIGHBOURHOODS 4 /* the densest ones; a fit to each is tried as a start, too */
#define N_FINALISTS 8      /* alignments that are refined with all cameras */
#define SAMPLE 1000        /* cameras with which the starts are refined until few are left */
#define SMALL_SAMPLE 250   /* cameras with which hypotheses are sorted out */
#define RESOLUTION 0.01    /* of the largest threshold: finer differences of errors do not count */
#define TOLERANCE 1e-5     /* gain in score; the refinement ends with the first step that gains less */
#define FINE_TOLERANCE 1e-9 /* of up to SMALL_N cameras, where steps cost little */
#define MAX_STARTS (N_STARTS + N_NEIGHBOURHOODS + 2)

/* Cameras, and what is asked for: the largest threshold T, the resolution r. */
typedef struct {
    cameras c;
    double threshold, resolution;
    int alignment;
    double *squares; /* (n,), overwritten */
} problem;

/* Sum of smoothed errors below the threshold, which counts for the others. */
EVERY_WIDTH
static double truncated_sum(const double *restrict squares, size_t n, double resolution,
                            double threshold)
{
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t i = 0; i < n; i++) {
        double smoothed = sqrt(squares[i] + resolution * resolution);
        sum += smoothed < threshold ? smoothed : threshold;
    }
    return sum;
}

EVERY_WIDTH
static void to_weights(double *restrict squares, size_t n, double resolution, double threshold)
{
    for (size_t i = 0; i < n; i++) {
        double smoothed = sqrt(squares[i] + resolution * resolution);
        squares[i] = smoothed < threshold ? 1 / smoothed : 0;
    }
}

static double truncated_cost(const problem *p, const similarity *s)
{
    squared_errors(&p->c, s, p->squares);
    return truncated_sum(p->squares, p->c.n, p->resolution, p->threshold);
}

/* The lowest costs, in order, and what they are of. */
typedef struct {
    size_t n_max, count;
    double costs[4 * N_STARTS];
    size_t indices[4 * N_STARTS];
} ranking;

static void insert(ranking *lowest, double cost, size_t index)
{
    if (lowest->count == lowest->n_max && !(cost < lowest->costs[lowest->n_max - 1]))
        return;
    lowest->count += lowest->count < lowest->n_max;
    size_t position = lowest->count - 1;
    for (; position > 0 && lowest->costs[position - 1] > cost; position--) {
        lowest->costs[position] = lowest->costs[position - 1];
        lowest->indices[position] = lowest->indices[position - 1];
    }
    lowest->costs[position] = cost;
    lowest->indices[position] = index;
}

/* Choose the cheapest of some similarities, the cheapest first; return how many there are. */
static size_t choose(const problem *p, const similarity *all, size_t count, size_t n_max,
                     similarity *chosen)
{
    ranking lowest = {.n_max = n_max};
    for (size_t h = 0; h < count; h++)
        insert(&lowest, truncated_cost(p, &all[h]), h);
    for (size_t i = 0; i < lowest.count; i++)
        chosen[i] = all[lowest.indices[i]];
    return lowest.count;
}

/* An alignment on its way down. */
typedef struct {
    similarity at;
    double cost, gain; /* of the last step */
} start;

/* Refine by iteratively reweighted least squares. A step is the fit with the weights
   1 / sqrt(e^2 + r^2), 0 beyond the threshold, where its cost is lower; in exact arithmetic it is,
   where the cameras within the threshold determine the fit. After each step drop the more expensive
   half, but never the best `n_left`, until no step gains more than a cost. Return how many are left. */
static size_t refine_starts(const problem *p, similarity *rows, size_t count, size_t n_left,
                     double least_gain)
{
    start starts[MAX_STARTS];
    double largest_gain = INFINITY;
    for (size_t h = 0; h < count; h++)
        starts[h] = (start){rows[h], truncated_cost(p, &rows[h]), INFINITY};
    while (count > n_left || largest_gain > least_gain) {
        for (size_t h = 0; h < count; h++) {
            squared_errors(&p->c, &starts[h].at, p->squares);
            to_weights(p->squares, p->c.n, p->resolution, p->threshold);
            const moments sums = weighted_moments(&p->c, p->squares);
            fit_moments(&sums, p->alignment, &rows[h]);
        }
        for (size_t h = 0; h < count; h++) {
            start moved = starts[h];
            double cost = truncated_cost(p, &rows[h]);
            moved.gain = moved.cost - cost;
            if (moved.gain > 0) {
                moved.at = rows[h];
                moved.cost = cost;
            }
            size_t position = h; /* the others are in order */
            for (; position > 0 && starts[position - 1].cost > moved.cost; position--)
                starts[position] = starts[position - 1];
            starts[position] = moved;
        }
        count = smaller(larger(count / 2, n_left), count);
        largest_gain = 0;
        for (size_t h = 0; h < count; h++)
            largest_gain = fmax(largest_gain, starts[h].gain);
    }
    for (size_t h = 0; h < count; h++)
        rows[h] = starts[h].at;
    return count;
}

EVERY_WIDTH
static void squared_distances(const double *restrict points, size_t stride, size_t from, size_t n,
                              double *restrict squares)
{
    const vector centre = point(points, stride, from);
    for (size_t i = 0; i < n; i++) {
        vector difference = minus(centre, point(points, stride, i));
        squares[i] = dot(difference, difference);
    }
}

/* The least-squares fits to all cameras, and to those within T of one in each of the densest
   neighbourhoods. An estimate that is shrunk to a place where many cameras stand scores all of them,
   however wrong it is; hypotheses of three cameras hardly ever find that. Return how many there are. */
static size_t fit_neighbourhoods(const problem *p, similarity *fits)
{
    const cameras *c = &p->c;
    double *squares = p->squares;
    ranking densest = {.n_max = N_NEIGHBOURHOODS};
    size_t n_candidates = smaller(c->n, SMALL_SAMPLE);
    for (size_t i = 0; i < n_candidates; i++) {
        squared_distances(c->gt, c->stride, i, n_candidates, squares);
        insert(&densest, truncated_sum(squares, n_candidates, 0, p->threshold), i);
    }
    for (size_t k = 0; k <= densest.count; k++) {
        bool all = k == densest.count;
        if (!all)
            squared_distances(c->gt, c->stride, densest.indices[k], c->n, squares);
        for (size_t i = 0; i < c->n; i++)
            squares[i] = all || sqrt(squares[i]) < p->threshold; /* weights */
        const moments sums = weighted_moments(c, squares);
        fit_moments(&sums, p->alignment, &fits[k]);
    }
    return densest.count + 1;
}

/* The least-squares fits to all subsets of so few cameras, which a triplet may miss: without a
   scale two cameras determine nearly all. Return how many there are. */
static size_t fit_subsets(const cameras *c, int alignment, similarity *fits)
{
    size_t count = 0;
    for (unsigned set = 0; set < 1u << c->n; set++) {
        double weights[FEWEST];
        size_t size = 0;
        for (size_t i = 0; i < c->n; i++)
            size += (weights[i] = set >> i & 1) > 0;
        if (size >= (alignment == SIMILARITY ? 3 : 2)) {
            const moments sums = weighted_moments(c, weights);
            fit_moments(&sums, alignment, &fits[count++]);
        }
    }
    return count;
}

static bool is_usable(const similarity *s)
{
    const double *numbers = &s->scale;
    for (size_t i = 0; i < 13; i++)
        if (!(fabs(numbers[i]) < INFINITY))
            return false;
    return s->scale > 0;
}

/* The largest number of hypotheses of n cameras. */
EXPORTED
size_t max_hypotheses(size_t n, size_t n_wanted)
{
    size_t n_subsets = n <= FEWEST ? (size_t)1 << n : 0;
    return n_subsets + (n <= SMALL_N ? n_triplets(n) : max_prescreened(n, n_wanted));
}

/* The hypotheses for points of both frames, (3, n): those of PCR-99, of few cameras all triplets. Return
   how many there are; -1 without memory. */
EXPORTED
ptrdiff_t refined_hypotheses(size_t n, const double *gt, const double *est, int alignment,
                             size_t n_wanted, bitgen *random, similarity *fits)
{
    const cameras c = {n, n, gt, est};
    size_t n_max = max_hypotheses(n, n_wanted), n_usable = 0;
    triplet *triplets = allocate(n_max, sizeof *triplets);
    double *is_free = allocate(n_max, sizeof *is_free); /* which does not matter here */
    ptrdiff_t count = -1;
    if (triplets && is_free && n <= SMALL_N) {
        all_triplets(&c, triplets);
        count = (ptrdiff_t)n_triplets(n);
    } else if (triplets && is_free) {
        count = prescreened_triplets(&c, n_wanted, PRESCREEN, random, triplets);
    }
    if (count >= 0) {
        fit_triplets(&c, triplets, (size_t)count, alignment, fits, is_free);
        if (n <= FEWEST)
            count += (ptrdiff_t)fit_subsets(&c, alignment, fits + count);
        for (ptrdiff_t h = 0; h < count; h++)
            if (is_usable(&fits[h]))
                fits[n_usable++] = fits[h];
        count = (ptrdiff_t)n_usable;
    }
    free(triplets);
    free(is_free);
    return count;
}

/* Find the best alignment for a largest threshold, of points in random order that can be squared. The
   best one at another threshold is a start, if its scale is a number. The first of several thresholds
   only leads to the next. Return false without memory. */
EXPORTED
bool refine(size_t n, const double *gt, const double *est, int alignment,
            const similarity *hypotheses, size_t count, bool is_first_of_several, double threshold,
            similarity *best)
{
    double *squares = allocate(n, sizeof *squares);
    if (squares == NULL)
        return false;
    threshold = fmin(fmax(threshold, 1 / FARTHEST_SQUARABLE), FARTHEST_SQUARABLE);
    similarity chosen[4 * N_STARTS], starts[MAX_STARTS];
    const problem p = {{n, n, gt, est}, threshold, RESOLUTION * threshold, alignment, squares};
    problem small_sample = p, sample = p; /* the first cameras */
    small_sample.c.n = smaller(n, SMALL_SAMPLE);
    sample.c.n = smaller(n, SAMPLE);
    if (n > SMALL_SAMPLE) {
        count = choose(&small_sample, hypotheses, count, 4 * N_STARTS, chosen);
        hypotheses = chosen;
    }
    count = choose(&sample, hypotheses, count, is_first_of_several ? N_FINALISTS : N_STARTS, starts);
    count += fit_neighbourhoods(&sample, starts + count);
    count = refine_starts(&sample, starts, count, N_FINALISTS, INFINITY);
    if (!isnan(best->scale))
        starts[count++] = *best;
    double tolerance = n > SMALL_N ? TOLERANCE : FINE_TOLERANCE;
    refine_starts(&p, starts, count, 1, tolerance * threshold * (double)n);
    if (is_usable(starts))
        *best = starts[0];
    free(squares);
    return true;
}
