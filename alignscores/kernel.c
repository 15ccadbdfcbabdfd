/* The functions of hypotheses.py, compiled: same arguments, same results to the last bit. So every
   sum has the order that it has there, and no product is fused into a sum (-ffp-contract=off).

   Points are stored component first, (3, n). What is not finite loses every comparison. */

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0
#error "double precision must be rounded to double precision"
#endif

/* One version for each vector width: what is built on one machine is fast on another. For static
   functions, as clang gives others another name. */
#ifndef EVERY_WIDTH
#define EVERY_WIDTH
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__has_attribute)
#if __has_attribute(target_clones)
#undef EVERY_WIDTH
#define EVERY_WIDTH __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#endif
#endif
#endif

static inline double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross(const double *a, const double *b, double *product)
{
    product[0] = a[1] * b[2] - a[2] * b[1];
    product[1] = a[2] * b[0] - a[0] * b[2];
    product[2] = a[0] * b[1] - a[1] * b[0];
}

static inline void edge(const double *points, size_t n, size_t from, size_t to, double *difference)
{
    for (size_t axis = 0; axis < 3; axis++)
        difference[axis] = points[axis * n + to] - points[axis * n + from];
}

static inline double squared_ratio(const double *gt, const double *est, size_t n, size_t i, size_t j)
{
    double a[3], b[3];
    edge(gt, n, i, j, a);
    edge(est, n, i, j, b);
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

/* Without branches: no processor can tell beforehand which triplets pass. */
EVERY_WIDTH
static void mark_similar(const double *restrict gt, const double *restrict est, size_t n,
                         const ptrdiff_t *restrict first, const ptrdiff_t *restrict second,
                         const ptrdiff_t *restrict third, size_t n_triplets, double factor,
                         bool *restrict similar)
{
    for (size_t t = 0; t < n_triplets; t++) {
        double ij = squared_ratio(gt, est, n, first[t], second[t]);
        double ik = squared_ratio(gt, est, n, first[t], third[t]);
        double jk = squared_ratio(gt, est, n, second[t], third[t]);
        similar[t] = usable(ij) & usable(ik) & usable(jk) & alike(ij, ik, factor)
                     & alike(ij, jk, factor) & alike(ik, jk, factor);
    }
}

void similar_triplets(const double *gt, const double *est, size_t n, const ptrdiff_t *triplets,
                      size_t n_triplets, double factor, bool *similar)
{
    mark_similar(gt, est, n, triplets, triplets + n_triplets, triplets + 2 * n_triplets, n_triplets,
                 factor, similar);
}

/* An axis of the smallest rotation between unit vectors; any normal if they are parallel. */
static void common_normal(const double *a, const double *b, double parallel_sine, double *axis)
{
    cross(a, b, axis);
    if (dot(axis, axis) <= parallel_sine * parallel_sine) {
        double unit[3] = {0, 0, 0};
        size_t least = 0;
        for (size_t i = 1; i < 3; i++)
            if (fabs(a[i]) < fabs(a[least]))
                least = i;
        unit[least] = 1;
        cross(a, unit, axis);
    }
}

struct triangle {
    double edge_1[3], edge_2[3], centroid[3];
    double axes[3][3]; /* along the first edge, along the normal, and normal to both */
};

/* Measure a triangle, but for what its normal has to be known for; return whether it is flat. */
static bool measure(struct triangle *t, const double *points, size_t n, const size_t *corners,
                    double flat_sine)
{
    edge(points, n, corners[0], corners[1], t->edge_1);
    edge(points, n, corners[0], corners[2], t->edge_2);
    double length = sqrt(dot(t->edge_1, t->edge_1));
    for (size_t i = 0; i < 3; i++) {
        const double *component = points + i * n;
        t->axes[0][i] = t->edge_1[i] / length;
        t->centroid[i] = (component[corners[0]] + component[corners[1]] + component[corners[2]]) / 3;
    }
    cross(t->axes[0], t->edge_2, t->axes[1]);
    return dot(t->axes[1], t->axes[1]) <= flat_sine * flat_sine * dot(t->edge_2, t->edge_2);
}

/* Complete the frame; the normal is an approximate one until here. */
static void complete(struct triangle *t)
{
    double *first = t->axes[0], *normal = t->axes[1];
    double along = dot(normal, first);
    for (size_t i = 0; i < 3; i++)
        normal[i] -= along * first[i];
    double length = sqrt(dot(normal, normal));
    for (size_t i = 0; i < 3; i++)
        normal[i] /= length;
    cross(first, normal, t->axes[2]);
}

static void turn(const double *rotation, const double *vector, double *turned)
{
    for (size_t i = 0; i < 3; i++)
        turned[i] = dot(rotation + 3 * i, vector);
}

void three_point_similarities(const double *gt, const double *est, size_t n,
                              const ptrdiff_t *triplets, size_t n_triplets, double flat_sine,
                              double parallel_sine, double *scales, double *rotations,
                              double *translations, bool *flat)
{
    for (size_t h = 0; h < n_triplets; h++) {
        size_t corners[3] = {triplets[h], triplets[n_triplets + h], triplets[2 * n_triplets + h]};
        double *rotation = rotations + 9 * h, *translation = translations + 3 * h, turned[3];
        struct triangle a, b;
        bool flat_a = measure(&a, gt, n, corners, flat_sine);
        bool flat_b = measure(&b, est, n, corners, flat_sine);
        flat[h] = flat_a || flat_b;
        if (flat[h]) {
            common_normal(a.axes[0], b.axes[0], parallel_sine, a.axes[1]);
            for (size_t i = 0; i < 3; i++)
                b.axes[1][i] = a.axes[1][i];
        }
        complete(&a);
        complete(&b);
        for (size_t i = 0; i < 3; i++)
            for (size_t j = 0; j < 3; j++)
                rotation[3 * i + j] = b.axes[0][i] * a.axes[0][j] + b.axes[1][i] * a.axes[1][j]
                                      + b.axes[2][i] * a.axes[2][j];

        double a_1 = dot(a.edge_1, a.axes[0]), a_2 = dot(a.edge_2, a.axes[0]);
        double b_1 = dot(b.edge_1, b.axes[0]), b_2 = dot(b.edge_2, b.axes[0]);
        double a_22 = dot(a.edge_2, a.edge_2);
        turn(rotation, a.edge_2, turned);
        double b_22 = dot(b.edge_2, turned);
        scales[h] = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1)
                    / (2 * (a_1 * a_1 + a_22 - a_1 * a_2));
        turn(rotation, a.centroid, turned);
        for (size_t i = 0; i < 3; i++)
            translation[i] = b.centroid[i] - scales[h] * turned[i];
    }
}

static inline double squared_error(const double *gt, const double *est, size_t n, size_t i,
                                   double shrink, const double *r, const double *t)
{
    double x = gt[i], y = gt[n + i], z = gt[2 * n + i];
    double dx = (est[i] - t[0]) * shrink - (r[0] * x + r[1] * y + r[2] * z);
    double dy = (est[n + i] - t[1]) * shrink - (r[3] * x + r[4] * y + r[5] * z);
    double dz = (est[2 * n + i] - t[2]) * shrink - (r[6] * x + r[7] * y + r[8] * z);
    return dx * dx + dy * dy + dz * dz;
}

EVERY_WIDTH
static size_t count_below(double bound, const double *restrict gt, const double *restrict est,
                          size_t n, double shrink, const double *restrict rotation,
                          const double *restrict translation)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        count += squared_error(gt, est, n, i, shrink, rotation, translation) < bound;
    return count;
}

/* The value of this rank, from 0, by Hoare's Find. The values change their order. */
static double ranked(double *values, size_t n, size_t rank)
{
    ptrdiff_t low = 0, high = (ptrdiff_t)n - 1, k = (ptrdiff_t)rank;
    while (low < high) {
        ptrdiff_t i = low, j = high;
        double pivot = values[k];
        while (i <= j) {
            while (values[i] < pivot)
                i++;
            while (pivot < values[j])
                j--;
            if (i <= j) {
                double value = values[i];
                values[i++] = values[j];
                values[j--] = value;
            }
        }
        if (j < k)
            low = i;
        if (k < i)
            high = j;
    }
    return values[k];
}

/* `below` is room for n numbers. */
size_t cheapest(const double *gt, const double *est, size_t n, const double *scales,
                const double *rotations, const double *translations, const bool *flat,
                size_t n_hypotheses, size_t order, double tie, double *below)
{
    size_t best = 0;
    double best_cost = INFINITY;
    for (int group = 0; group < 2; group++) {
        for (size_t h = 0; h < n_hypotheses; h++) {
            double shrink = 1 / scales[h];
            const double *rotation = rotations + 9 * h, *translation = translations + 3 * h;
            if (flat[h] != group
                || count_below(best_cost, gt, est, n, shrink, rotation, translation) < order)
                continue;
            size_t count = 0;
            for (size_t i = 0; i < n; i++) {
                double error = squared_error(gt, est, n, i, shrink, rotation, translation);
                if (error < best_cost)
                    below[count++] = error;
            }
            best_cost = ranked(below, count, order - 1);
            best = h;
        }
        best_cost -= tie;
    }
    return best;
}
