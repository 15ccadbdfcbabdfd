/* The functions of hypotheses.py, compiled: same arguments, same results to the last bit. So every
   sum has the order that it has there, and no product is fused into a sum (-ffp-contract=off).

   Points are stored component first, (3, n). NaN and infinity fail every
   comparison, so triplets and hypotheses with such numbers never win. */

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0
#error "double precision must be rounded to double precision"
#endif

/* One version for each vector width, so that what is built on one machine is fast on another. Only
   for static functions: clang renames the versions of others. */
#ifndef EVERY_WIDTH
#define EVERY_WIDTH
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__has_attribute)
#if __has_attribute(target_clones)
#undef EVERY_WIDTH
#define EVERY_WIDTH __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
#endif
#endif

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED
#endif

typedef struct {
    double x, y, z;
} vector;

typedef struct {
    vector x, y, z;
} matrix; /* by rows */

static inline vector point(const double *points, size_t n, size_t i)
{
    return (vector){points[i], points[n + i], points[2 * n + i]};
}

static inline vector plus(vector a, vector b)
{
    return (vector){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline vector minus(vector a, vector b)
{
    return (vector){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline vector times(double factor, vector a)
{
    return (vector){factor * a.x, factor * a.y, factor * a.z};
}

static inline vector over(vector a, double divisor)
{
    return (vector){a.x / divisor, a.y / divisor, a.z / divisor};
}

static inline double dot(vector a, vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline vector cross(vector a, vector b)
{
    return (vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline vector rotated(matrix rotation, vector a)
{
    return (vector){dot(rotation.x, a), dot(rotation.y, a), dot(rotation.z, a)};
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

/* Without branches, since a processor cannot predict which triplets pass. The results are as wide
   as the numbers they are computed from, so that the loop is vectorised. */
EVERY_WIDTH
static void mark_similar(const double *restrict gt, const double *restrict est, size_t n,
                         const ptrdiff_t *restrict first, const ptrdiff_t *restrict second,
                         const ptrdiff_t *restrict third, size_t n_triplets, double factor,
                         ptrdiff_t *restrict similar)
{
    for (size_t t = 0; t < n_triplets; t++) {
        double ij = squared_ratio(gt, est, n, first[t], second[t]);
        double ik = squared_ratio(gt, est, n, first[t], third[t]);
        double jk = squared_ratio(gt, est, n, second[t], third[t]);
        similar[t] = usable(ij) & usable(ik) & usable(jk) & alike(ij, ik, factor)
                     & alike(ij, jk, factor) & alike(ik, jk, factor);
    }
}

EXPORTED
void similar_triplets(const double *gt, const double *est, size_t n, const ptrdiff_t *triplets,
                      size_t n_triplets, double factor, ptrdiff_t *similar)
{
    mark_similar(gt, est, n, triplets, triplets + n_triplets, triplets + 2 * n_triplets, n_triplets,
                 factor, similar);
}

/* An axis of the smallest rotation between unit vectors; any normal if they are parallel. */
static vector common_normal(vector a, vector b, double parallel_sine)
{
    vector axis = cross(a, b);
    if (dot(axis, axis) <= parallel_sine * parallel_sine) {
        double x = fabs(a.x), y = fabs(a.y), z = fabs(a.z);
        vector least = x <= y && x <= z ? (vector){1, 0, 0} : y <= z ? (vector){0, 1, 0}
                                                                     : (vector){0, 0, 1};
        axis = cross(a, least);
    }
    return axis;
}

typedef struct {
    vector edge_1, edge_2, centroid;
    vector first, normal, third; /* axes: along the first edge, normal, and normal to both */
} triangle;

/* Measure a triangle, its normal roughly; return whether it is too flat to have one. */
static inline bool measure(triangle *t, vector a, vector b, vector c, double flat_sine)
{
    t->edge_1 = minus(b, a);
    t->edge_2 = minus(c, a);
    t->centroid = over(plus(plus(a, b), c), 3);
    t->first = over(t->edge_1, sqrt(dot(t->edge_1, t->edge_1)));
    t->normal = cross(t->first, t->edge_2);
    return dot(t->normal, t->normal) <= flat_sine * flat_sine * dot(t->edge_2, t->edge_2);
}

static inline void complete_axes(triangle *t)
{
    vector normal = minus(t->normal, times(dot(t->normal, t->first), t->first));
    t->normal = over(normal, sqrt(dot(normal, normal)));
    t->third = cross(t->first, t->normal);
}

static inline vector combined(const triangle *t, double first, double normal, double third)
{
    return plus(plus(times(first, t->first), times(normal, t->normal)), times(third, t->third));
}

EXPORTED
void three_point_similarities(const double *gt, const double *est, size_t n,
                              const ptrdiff_t *triplets, size_t n_triplets, double flat_sine,
                              double parallel_sine, double *scales, matrix *rotations,
                              vector *translations, bool *flat)
{
    for (size_t h = 0; h < n_triplets; h++) {
        size_t i = triplets[h], j = triplets[n_triplets + h], k = triplets[2 * n_triplets + h];
        triangle a, b;
        bool flat_a = measure(&a, point(gt, n, i), point(gt, n, j), point(gt, n, k), flat_sine);
        bool flat_b = measure(&b, point(est, n, i), point(est, n, j), point(est, n, k), flat_sine);
        flat[h] = flat_a || flat_b;
        if (flat[h])
            a.normal = b.normal = common_normal(a.first, b.first, parallel_sine);
        complete_axes(&a);
        complete_axes(&b);
        matrix rotation = {
            combined(&a, b.first.x, b.normal.x, b.third.x),
            combined(&a, b.first.y, b.normal.y, b.third.y),
            combined(&a, b.first.z, b.normal.z, b.third.z),
        };

        double a_1 = dot(a.edge_1, a.first), a_2 = dot(a.edge_2, a.first);
        double b_1 = dot(b.edge_1, b.first), b_2 = dot(b.edge_2, b.first);
        double a_22 = dot(a.edge_2, a.edge_2), b_22 = dot(b.edge_2, rotated(rotation, a.edge_2));
        double scale = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1)
                       / (2 * (a_1 * a_1 + a_22 - a_1 * a_2));
        scales[h] = scale;
        rotations[h] = rotation;
        translations[h] = minus(b.centroid, times(scale, rotated(rotation, a.centroid)));
    }
}

static inline double squared_error(const double *gt, const double *est, size_t n, size_t i,
                                   double shrink, matrix rotation, vector translation)
{
    vector aligned = times(shrink, minus(point(est, n, i), translation));
    vector residual = minus(aligned, rotated(rotation, point(gt, n, i)));
    return dot(residual, residual);
}

EVERY_WIDTH
static size_t count_below(double bound, const double *restrict gt, const double *restrict est,
                          size_t n, double shrink, const matrix *restrict rotation,
                          const vector *restrict translation)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        count += squared_error(gt, est, n, i, shrink, *rotation, *translation) < bound;
    return count;
}

/* The value of this rank, counted from 0, by Hoare's Find, which reorders the values. */
static double nth_smallest(double *values, size_t n, size_t rank)
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
EXPORTED
size_t cheapest(const double *gt, const double *est, size_t n, const double *scales,
                const matrix *rotations, const vector *translations, const bool *flat,
                size_t n_hypotheses, size_t rank, double tie, double *below)
{
    size_t best = 0;
    double best_cost = INFINITY;
    for (int group = 0; group < 2; group++) {
        for (size_t h = 0; h < n_hypotheses; h++) {
            const matrix *rotation = &rotations[h];
            const vector *translation = &translations[h];
            double shrink = 1 / scales[h];
            if (flat[h] != group
                || count_below(best_cost, gt, est, n, shrink, rotation, translation) < rank)
                continue;
            size_t count = 0;
            for (size_t i = 0; i < n; i++) {
                double error = squared_error(gt, est, n, i, shrink, *rotation, *translation);
                if (error < best_cost)
                    below[count++] = error;
            }
            best_cost = nth_smallest(below, count, rank - 1);
            best = h;
        }
        best_cost -= tie; /* the flat triangles must be cheaper by more */
    }
    return best;
}
