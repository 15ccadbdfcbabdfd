/* The functions of hypotheses.py and reweighting.py, compiled: same arguments, same results to the
   last bit. So every sum has the order that it has there, and no product is fused into a sum
   (-ffp-contract=off).

   Points are stored component first, (3, n). NaN and infinity fail every
   comparison, so triplets and hypotheses with such numbers never win. */

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#ifndef _WIN32
#include <pthread.h>
#endif

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

static const matrix identity = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

typedef enum { SIMILARITY, RIGID, YAW } group; /* in the order of reweighting.GROUPS */

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

/* The squared ratios of all pairs; those that are of no use are not a number. */
EVERY_WIDTH
static void tabulate(const double *restrict gt, const double *restrict est, size_t n,
                     double *restrict ratios)
{
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double ratio = squared_ratio(gt, est, n, i, j);
            ratios[i * n + j] = usable(ratio) ? ratio : NAN;
        }
}

EVERY_WIDTH
static void mark_alike(const double *restrict ratios, size_t n, const ptrdiff_t *restrict first,
                       const ptrdiff_t *restrict second, const ptrdiff_t *restrict third,
                       size_t n_triplets, double factor, ptrdiff_t *restrict similar)
{
    ptrdiff_t width = (ptrdiff_t)n;
    for (size_t t = 0; t < n_triplets; t++) {
        double ij = ratios[first[t] * width + second[t]];
        double ik = ratios[first[t] * width + third[t]];
        double jk = ratios[second[t] * width + third[t]];
        similar[t] = alike(ij, ik, factor) & alike(ij, jk, factor) & alike(ik, jk, factor);
    }
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

/* The rotation that takes the axes of a to those of b. */
static inline matrix rotation_between(const triangle *a, const triangle *b)
{
    return (matrix){
        combined(a, b->first.x, b->normal.x, b->third.x),
        combined(a, b->first.y, b->normal.y, b->third.y),
        combined(a, b->first.z, b->normal.z, b->third.z),
    };
}

/* A rotation about the third axis, given by its direction; none where that is too short. */
static inline matrix turn(double cosine, double sine, double shortest)
{
    double length = sqrt(cosine * cosine + sine * sine);
    bool turned = length > shortest;
    cosine = turned ? cosine / length : 1;
    sine = turned ? sine / length : 0;
    return (matrix){{cosine, -sine, 0}, {sine, cosine, 0}, {0, 0, 1}};
}

/* Sum over three cameras, relative to their centroid, of a product that is given for their edges. */
static inline double centred(double p_11, double p_12, double p_21, double p_22)
{
    return 2 * (p_11 + p_22) - p_12 - p_21;
}

static inline double extent(const triangle *t)
{
    double product = dot(t->edge_1, t->edge_2);
    return centred(dot(t->edge_1, t->edge_1), product, product, dot(t->edge_2, t->edge_2));
}

static inline double level_dot(vector a, vector b)
{
    return a.x * b.x + a.y * b.y;
}

static inline double level_cross(vector a, vector b)
{
    return a.x * b.y - a.y * b.x;
}

/* The best rotation about the third axis; return whether it is free, as both stand upright. */
static inline bool turn_between(const triangle *a, const triangle *b, double flat_sine,
                                matrix *rotation)
{
    double cosine = centred(level_dot(a->edge_1, b->edge_1), level_dot(a->edge_1, b->edge_2),
                            level_dot(a->edge_2, b->edge_1), level_dot(a->edge_2, b->edge_2));
    double sine = centred(level_cross(a->edge_1, b->edge_1), level_cross(a->edge_1, b->edge_2),
                          level_cross(a->edge_2, b->edge_1), level_cross(a->edge_2, b->edge_2));
    double shortest = flat_sine * flat_sine * sqrt(extent(a) * extent(b));
    *rotation = turn(cosine, sine, shortest);
    return !(sqrt(cosine * cosine + sine * sine) > shortest);
}

typedef struct {
    double scale;
    matrix rotation;
    vector translation;
} similarity;

/* Scale, where it is free, and translation by least squares, given the rotation. */
static inline similarity completed(const triangle *a, const triangle *b, matrix rotation,
                                   int alignment)
{
    double a_1 = dot(a->edge_1, a->first), a_2 = dot(a->edge_2, a->first);
    double b_1 = dot(b->edge_1, b->first), b_2 = dot(b->edge_2, b->first);
    double a_22 = dot(a->edge_2, a->edge_2), b_22 = dot(b->edge_2, rotated(rotation, a->edge_2));
    double scale = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1)
                   / (2 * (a_1 * a_1 + a_22 - a_1 * a_2));
    scale = alignment == SIMILARITY ? scale : 1;
    vector translation = minus(b->centroid, times(scale, rotated(rotation, a->centroid)));
    return (similarity){scale, rotation, translation};
}

/* Align one triplet of any kind; return whether it is flat. */
static bool align_triplet(const vector *gt, const vector *est, int alignment, double flat_sine,
                          double parallel_sine, similarity *found)
{
    triangle a, b;
    bool flat_a = measure(&a, gt[0], gt[1], gt[2], flat_sine);
    bool flat_b = measure(&b, est[0], est[1], est[2], flat_sine);
    bool flat = flat_a || flat_b;
    if (flat)
        a.normal = b.normal = common_normal(a.first, b.first, parallel_sine);
    complete_axes(&a);
    complete_axes(&b);
    matrix rotation = rotation_between(&a, &b);
    if (alignment == YAW)
        flat = turn_between(&a, &b, flat_sine, &rotation);
    *found = completed(&a, &b, rotation, alignment);
    return flat;
}

#define LANES 8 /* numbers that a processor can compute at once, if it is wide enough */

/* Align as many triplets, as if none were flat; mark those that are. */
EVERY_WIDTH
static void align_at_once(double (*restrict gt)[3][LANES], double (*restrict est)[3][LANES],
                          int alignment, double flat_sine, double (*restrict found)[LANES],
                          double *restrict flat)
{
    for (size_t l = 0; l < LANES; l++) {
        vector p[3], q[3];
        for (size_t k = 0; k < 3; k++) {
            p[k] = (vector){gt[k][0][l], gt[k][1][l], gt[k][2][l]};
            q[k] = (vector){est[k][0][l], est[k][1][l], est[k][2][l]};
        }
        triangle a, b;
        double flat_a = measure(&a, p[0], p[1], p[2], flat_sine) ? 1 : 0;
        double flat_b = measure(&b, q[0], q[1], q[2], flat_sine) ? 1 : 0;
        flat[l] = flat_a + flat_b;
        complete_axes(&a);
        complete_axes(&b);
        matrix rotation = rotation_between(&a, &b);
        if (alignment == YAW)
            flat[l] = turn_between(&a, &b, flat_sine, &rotation) ? 1 : 0;
        similarity s = completed(&a, &b, rotation, alignment);
        const vector parts[4] = {s.rotation.x, s.rotation.y, s.rotation.z, s.translation};
        found[0][l] = s.scale;
        for (size_t k = 0; k < 4; k++) {
            found[3 * k + 1][l] = parts[k].x;
            found[3 * k + 2][l] = parts[k].y;
            found[3 * k + 3][l] = parts[k].z;
        }
    }
}

static void align_triplets(const double *gt, const double *est, size_t n,
                           const ptrdiff_t *const corners[3], size_t n_triplets, int alignment,
                           double flat_sine, double parallel_sine, double *scales,
                           matrix *rotations, vector *translations, bool *flat)
{
    double gt_lanes[3][3][LANES], est_lanes[3][3][LANES], rows[13][LANES], is_flat[LANES];
    for (size_t h = 0; h < n_triplets; h++) {
        size_t l = h % LANES;
        if (l == 0) {
            for (size_t next = 0; next < LANES; next++)
                for (size_t k = 0; k < 3; k++) {
                    size_t i = (size_t)corners[k][h + next < n_triplets ? h + next : h];
                    for (size_t x = 0; x < 3; x++) {
                        gt_lanes[k][x][next] = gt[x * n + i];
                        est_lanes[k][x][next] = est[x * n + i];
                    }
                }
            align_at_once(gt_lanes, est_lanes, alignment, flat_sine, rows, is_flat);
        }
        similarity found;
        flat[h] = is_flat[l] > 0;
        if (flat[h]) {
            vector a[3], b[3];
            for (size_t k = 0; k < 3; k++) {
                a[k] = point(gt, n, (size_t)corners[k][h]);
                b[k] = point(est, n, (size_t)corners[k][h]);
            }
            flat[h] = align_triplet(a, b, alignment, flat_sine, parallel_sine, &found);
        } else {
            double *numbers = (double *)&found;
            for (size_t k = 0; k < 13; k++)
                numbers[k] = rows[k][l];
        }
        scales[h] = found.scale;
        rotations[h] = found.rotation;
        translations[h] = found.translation;
    }
}

EXPORTED
void three_point_similarities(const double *gt, const double *est, size_t n,
                              const ptrdiff_t *triplets, size_t n_triplets, int alignment,
                              double flat_sine, double parallel_sine, double *scales, matrix *rotations,
                              vector *translations, bool *flat)
{
    const ptrdiff_t *const corners[3] = {triplets, triplets + n_triplets, triplets + 2 * n_triplets};
    align_triplets(gt, est, n, corners, n_triplets, alignment, flat_sine, parallel_sine, scales,
                   rotations, translations, flat);
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
                size_t n_hypotheses, size_t rank, double margin, double *below)
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
        best_cost -= margin; /* the flat triangles must be cheaper by more */
    }
    return best;
}

typedef double lanes[LANES]; /* partial sums, so that a processor can add as many numbers at once */

/* Fold the lanes in halves. */
static inline double folded(lanes sums)
{
    for (size_t half = LANES / 2; half > 0; half /= 2)
        for (size_t l = 0; l < half; l++)
            sums[l] += sums[l + half];
    return sums[0];
}

static inline double smoothed_error(const double *gt, const double *est, size_t n, size_t i,
                                    double shrink, const similarity *s, double resolution)
{
    double square = squared_error(gt, est, n, i, shrink, s->rotation, s->translation);
    return sqrt(square + resolution * resolution);
}

EVERY_WIDTH
static double truncated_cost(const double *restrict gt, const double *restrict est, size_t n,
                             const similarity *restrict s, double threshold, double resolution)
{
    const similarity copy = *s;
    double shrink = 1 / s->scale;
    lanes sums = {0};
    size_t whole = n - n % LANES;
    for (size_t i = 0; i < whole; i += LANES)
        for (size_t l = 0; l < LANES; l++) {
            double error = smoothed_error(gt, est, n, i + l, shrink, &copy, resolution);
            sums[l] += error < threshold ? error : threshold;
        }
    for (size_t i = whole; i < n; i++) {
        double error = smoothed_error(gt, est, n, i, shrink, &copy, resolution);
        sums[i - whole] += error < threshold ? error : threshold;
    }
    return folded(sums);
}

EXPORTED
void truncated_costs(const double *gt, const double *est, size_t n, const similarity *similarities,
                     size_t n_similarities, double threshold, double resolution, double *costs)
{
    for (size_t h = 0; h < n_similarities; h++)
        costs[h] = truncated_cost(gt, est, n, &similarities[h], threshold, resolution);
}

EVERY_WIDTH
static void reweight(const double *restrict gt, const double *restrict est, size_t n,
                     const similarity *restrict s, double threshold, double resolution,
                     double *restrict weights)
{
    const similarity copy = *s;
    double shrink = 1 / s->scale;
    for (size_t i = 0; i < n; i++) {
        double error = smoothed_error(gt, est, n, i, shrink, &copy, resolution);
        weights[i] = error < threshold ? 1 / error : 0;
    }
}

/* Matrices side by side, by columns, so that a processor can turn as many at once. */
typedef double matrices[3][3][LANES];

static inline vector column(matrices m, size_t k, size_t l)
{
    return (vector){m[k][0][l], m[k][1][l], m[k][2][l]};
}

static inline void set_column(matrices m, size_t k, size_t l, vector v)
{
    m[k][0][l] = v.x;
    m[k][1][l] = v.y;
    m[k][2][l] = v.z;
}

static inline vector chosen(bool first, vector a, vector b)
{
    return (vector){first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z};
}

/* Turn two columns so that they become orthogonal, and their axes with them. */
static inline void orthogonalise(matrices columns, matrices axes, size_t i, size_t j)
{
    for (size_t l = 0; l < LANES; l++) {
        vector a = column(columns, i, l), b = column(columns, j, l);
        vector axis_a = column(axes, i, l), axis_b = column(axes, j, l);
        double product = dot(a, b);
        double ratio = (dot(b, b) - dot(a, a)) / (2 * product);
        double tangent = copysign(1, ratio) / (fabs(ratio) + sqrt(1 + ratio * ratio));
        tangent = product == 0 ? 0 : tangent;
        double cosine = 1 / sqrt(1 + tangent * tangent), sine = cosine * tangent;
        set_column(columns, i, l, minus(times(cosine, a), times(sine, b)));
        set_column(columns, j, l, plus(times(sine, a), times(cosine, b)));
        set_column(axes, i, l, minus(times(cosine, axis_a), times(sine, axis_b)));
        set_column(axes, j, l, plus(times(sine, axis_a), times(cosine, axis_b)));
    }
}

/* Put the longer of two neighbouring columns first; equal ones keep their order. */
static inline void sort_columns(matrices columns, matrices axes, size_t i)
{
    for (size_t l = 0; l < LANES; l++) {
        vector a = column(columns, i, l), b = column(columns, i + 1, l);
        vector axis_a = column(axes, i, l), axis_b = column(axes, i + 1, l);
        bool shorter = sqrt(dot(a, a)) < sqrt(dot(b, b));
        set_column(columns, i, l, chosen(shorter, b, a));
        set_column(columns, i + 1, l, chosen(shorter, a, b));
        set_column(axes, i, l, chosen(shorter, axis_b, axis_a));
        set_column(axes, i + 1, l, chosen(shorter, axis_a, axis_b));
    }
}

/* Of matrices, as products with orthogonal columns, the longest first, and their axes. */
EVERY_WIDTH
static void orthogonal_columns(matrices columns, matrices axes, int sweeps)
{
    for (size_t i = 0; i < 3; i++)
        for (size_t l = 0; l < LANES; l++)
            set_column(axes, i, l, (vector){i == 0, i == 1, i == 2});
    for (int sweep = 0; sweep < sweeps; sweep++) {
        orthogonalise(columns, axes, 0, 1);
        orthogonalise(columns, axes, 0, 2);
        orthogonalise(columns, axes, 1, 2);
    }
    sort_columns(columns, axes, 0);
    sort_columns(columns, axes, 1);
    sort_columns(columns, axes, 0);
}

/* The rotation that correlates best with a matrix, given by its two longest orthogonal columns. */
static matrix best_rotation(vector longest, vector middle, vector axis_1, vector axis_2,
                            double line_ratio, double parallel_sine)
{
    double largest = sqrt(dot(longest, longest));
    triangle a = {.first = axis_1, .normal = axis_2};
    triangle b = {.first = over(longest, largest), .normal = middle};
    if (sqrt(dot(middle, middle)) <= line_ratio * largest)
        a.normal = b.normal = common_normal(a.first, b.first, parallel_sine);
    complete_axes(&a);
    complete_axes(&b);
    return rotation_between(&a, &b);
}

typedef struct {
    lanes weight, a[3], b[3];
} first_sums;

static inline void add_first(first_sums *sums, size_t l, double weight, vector a, vector b)
{
    sums->weight[l] += weight;
    sums->a[0][l] += weight * a.x;
    sums->a[1][l] += weight * a.y;
    sums->a[2][l] += weight * a.z;
    sums->b[0][l] += weight * b.x;
    sums->b[1][l] += weight * b.y;
    sums->b[2][l] += weight * b.z;
}

/* Weighted means of both worlds. */
EVERY_WIDTH
static void weighted_means(const double *restrict gt, const double *restrict est, size_t n,
                           const double *restrict weights, double smallest, vector *restrict gt_mean,
                           vector *restrict est_mean)
{
    first_sums sums = {{0}};
    size_t whole = n - n % LANES;
    for (size_t i = 0; i < whole; i += LANES)
        for (size_t l = 0; l < LANES; l++)
            add_first(&sums, l, weights[i + l], point(gt, n, i + l), point(est, n, i + l));
    for (size_t i = whole; i < n; i++)
        add_first(&sums, i - whole, weights[i], point(gt, n, i), point(est, n, i));
    double total = folded(sums.weight);
    total = total > smallest ? total : smallest;
    *gt_mean = over((vector){folded(sums.a[0]), folded(sums.a[1]), folded(sums.a[2])}, total);
    *est_mean = over((vector){folded(sums.b[0]), folded(sums.b[1]), folded(sums.b[2])}, total);
}

typedef struct {
    lanes spread, products[3][3];
} second_sums;

static inline void add_second(second_sums *sums, size_t l, double weight, vector a, vector b)
{
    vector weighted = times(weight, b);
    sums->spread[l] += weight * dot(b, b);
    sums->products[0][0][l] += weighted.x * a.x;
    sums->products[0][1][l] += weighted.x * a.y;
    sums->products[0][2][l] += weighted.x * a.z;
    sums->products[1][0][l] += weighted.y * a.x;
    sums->products[1][1][l] += weighted.y * a.y;
    sums->products[1][2][l] += weighted.y * a.z;
    sums->products[2][0][l] += weighted.z * a.x;
    sums->products[2][1][l] += weighted.z * a.y;
    sums->products[2][2][l] += weighted.z * a.z;
}

/* Weighted cross-covariance about the means; return the spread of the estimate. */
EVERY_WIDTH
static double cross_covariance(const double *restrict gt, const double *restrict est, size_t n,
                               const double *restrict weights, vector gt_mean, vector est_mean,
                               double (*restrict covariance)[3])
{
    second_sums sums = {{0}};
    size_t whole = n - n % LANES;
    for (size_t i = 0; i < whole; i += LANES)
        for (size_t l = 0; l < LANES; l++)
            add_second(&sums, l, weights[i + l], minus(point(gt, n, i + l), gt_mean),
                       minus(point(est, n, i + l), est_mean));
    for (size_t i = whole; i < n; i++)
        add_second(&sums, i - whole, weights[i], minus(point(gt, n, i), gt_mean),
                   minus(point(est, n, i), est_mean));
    for (size_t row = 0; row < 3; row++)
        for (size_t column = 0; column < 3; column++)
            covariance[row][column] = folded(sums.products[row][column]);
    return folded(sums.spread);
}

typedef struct {
    vector gt_mean, est_mean;
    double covariance[3][3], spread;
} moments;

static moments weighted_moments(const double *gt, const double *est, size_t n, const double *weights,
                                double smallest)
{
    moments m;
    weighted_means(gt, est, n, weights, smallest, &m.gt_mean, &m.est_mean);
    m.spread = cross_covariance(gt, est, n, weights, m.gt_mean, m.est_mean, m.covariance);
    return m;
}

/* How fits are made. */
typedef struct {
    group alignment;
    double smallest;
    int sweeps;
    double line_ratio, parallel_sine;
} solver;

/* The least-squares alignments of as many moments as there are lanes, or fewer. */
static void fits_of_moments(const moments *m, size_t count, const solver *how, similarity *fits)
{
    matrices columns = {{{0}}}, axes;
    double largest[LANES];
    vector rows[LANES][3];
    for (size_t l = 0; l < count; l++) {
        largest[l] = 0;
        for (size_t row = 0; row < 3; row++)
            for (size_t k = 0; k < 3; k++) {
                double entry = fabs(m[l].covariance[row][k]);
                largest[l] = entry > largest[l] ? entry : largest[l];
            }
        for (size_t row = 0; row < 3; row++) {
            const double *c = m[l].covariance[row];
            rows[l][row] = over((vector){c[0], c[1], c[2]}, largest[l]);
            columns[0][row][l] = rows[l][row].x;
            columns[1][row][l] = rows[l][row].y;
            columns[2][row][l] = rows[l][row].z;
        }
    }
    if (how->alignment != YAW)
        orthogonal_columns(columns, axes, how->sweeps);
    for (size_t l = 0; l < count; l++) {
        vector *c = rows[l];
        double scale = 1;
        matrix r = how->alignment == YAW
                       ? turn(c[0].x + c[1].y, c[1].x - c[0].y, 0)
                       : best_rotation(column(columns, 0, l), column(columns, 1, l),
                                       column(axes, 0, l), column(axes, 1, l), how->line_ratio,
                                       how->parallel_sine);
        if (how->alignment == SIMILARITY) {
            double correlation = dot(r.x, c[0]) + dot(r.y, c[1]) + dot(r.z, c[2]);
            scale = m[l].spread / (correlation * largest[l]);
        } else if (largest[l] == 0) {
            r = identity;
        }
        vector translation = minus(m[l].est_mean, times(scale, rotated(r, m[l].gt_mean)));
        fits[l] = (similarity){scale, r, translation};
    }
}

static size_t min(size_t a, size_t b)
{
    return a < b ? a : b;
}

EXPORTED
void weighted_fits(const double *gt, const double *est, size_t n, const double *weights,
                   size_t n_fits, int alignment, double smallest, int sweeps, double line_ratio,
                   double parallel_sine, similarity *fits)
{
    const solver how = {(group)alignment, smallest, sweeps, line_ratio, parallel_sine};
    for (size_t first = 0; first < n_fits; first += LANES) {
        size_t count = min(LANES, n_fits - first);
        moments some[LANES];
        for (size_t l = 0; l < count; l++)
            some[l] = weighted_moments(gt, est, n, weights + (first + l) * n, smallest);
        fits_of_moments(some, count, &how, fits + first);
    }
}

/* Put the last of some similarities in its place; the others are in order, the cheapest first. */
static void insert_last(similarity *similarities, double *costs, double *gains, size_t last)
{
    similarity moved = similarities[last];
    double cost = costs[last], gain = gains[last];
    size_t place = last;
    for (; place > 0 && costs[place - 1] > cost; place--) {
        similarities[place] = similarities[place - 1];
        costs[place] = costs[place - 1];
        gains[place] = gains[place - 1];
    }
    similarities[place] = moved;
    costs[place] = cost;
    gains[place] = gain;
}

/* Take a step from each of some similarities where it gains, and keep them in order. */
static void step(const double *gt, const double *est, size_t n, similarity *similarities,
                 size_t first, size_t n_steps, double threshold, double resolution,
                 const solver *how, double *weights, double *costs, double *gains)
{
    moments some[LANES];
    similarity steps[LANES];
    for (size_t l = 0; l < n_steps; l++) {
        reweight(gt, est, n, &similarities[first + l], threshold, resolution, weights);
        some[l] = weighted_moments(gt, est, n, weights, how->smallest);
    }
    fits_of_moments(some, n_steps, how, steps);
    for (size_t l = 0; l < n_steps; l++) {
        size_t h = first + l;
        double cost = truncated_cost(gt, est, n, &steps[l], threshold, resolution);
        gains[h] = costs[h] - cost;
        if (gains[h] > 0) {
            similarities[h] = steps[l];
            costs[h] = cost;
        }
        insert_last(similarities, costs, gains, h);
    }
}

/* Refine similarities in place; return how many are left. `weights` is room for n numbers, `costs`
   and `gains` for as many as there are similarities. */
EXPORTED
size_t refine(const double *gt, const double *est, size_t n, similarity *similarities,
              size_t n_similarities, double threshold, double resolution, size_t n_left,
              double least_gain, int alignment, double smallest, int sweeps, double line_ratio,
              double parallel_sine, double *weights, double *costs, double *gains)
{
    const solver how = {(group)alignment, smallest, sweeps, line_ratio, parallel_sine};
    size_t count = n_similarities;
    double largest_gain = INFINITY;
    truncated_costs(gt, est, n, similarities, count, threshold, resolution, costs);
    while (count > n_left || largest_gain > least_gain) {
        for (size_t first = 0; first < count; first += LANES)
            step(gt, est, n, similarities, first, min(LANES, count - first), threshold, resolution,
                 &how, weights, costs, gains);
        size_t half = count / 2, most = half > n_left ? half : n_left;
        count = min(most, count);
        largest_gain = 0;
        for (size_t h = 0; h < count; h++)
            largest_gain = gains[h] > largest_gain ? gains[h] : largest_gain;
    }
    return count;
}

/* As aligner.normalise, of scenes one behind the other; `values` is room for the largest. Return
   whether no coordinate is beyond the farthest; else nothing is normalised. */
EXPORTED
bool normalise_scenes(size_t n_scenes, const size_t *starts, const double *positions, double farthest,
                      double *normalised, double *centres, double *units, double *values)
{
    double largest = 0;
    for (size_t i = 3 * starts[0]; i < 3 * starts[n_scenes]; i++)
        largest = fabs(positions[i]) > largest ? fabs(positions[i]) : largest;
    if (largest > farthest)
        return false;
    for (size_t s = 0; s < n_scenes; s++) {
        size_t n = starts[s + 1] - starts[s], n_moved = 0;
        const double *rows = positions + 3 * starts[s];
        double *local = normalised + 3 * starts[s], *centre = centres + 3 * s;
        for (size_t k = 0; k < 3 && n > 0; k++) {
            for (size_t i = 0; i < n; i++)
                values[i] = rows[3 * i + k];
            centre[k] = nth_smallest(values, n, n / 2) + 0.0; /* the zero without a sign */
        }
        for (size_t i = 0; i < 3 * n; i++) {
            local[i] = rows[i] - centre[i % 3];
            if (fabs(local[i]) > 0)
                values[n_moved++] = fabs(local[i]);
        }
        int exponent = 1;
        if (n_moved > 0)
            frexp(nth_smallest(values, n_moved, n_moved / 2), &exponent);
        units[s] = ldexp(1, exponent - 1);
        for (size_t i = 0; i < 3 * n; i++)
            local[i] /= units[s];
    }
    return true;
}

/* As translation.closest_pair_quartile, of normalised scenes of 4 to `most` cameras; NaN of others. */
EXPORTED
void closest_pair_quartiles(size_t n_scenes, const size_t *starts, const double *normalised,
                            const double *units, size_t most, double *quartiles, double *values)
{
    for (size_t s = 0; s < n_scenes; s++) {
        size_t n = starts[s + 1] - starts[s];
        quartiles[s] = NAN;
        if (n < 4 || n > most)
            continue;
        const vector *positions = (const vector *)normalised + starts[s];
        for (size_t i = 0; i < n; i++) {
            double least = INFINITY;
            for (size_t j = 0; j < i; j++) {
                vector difference = minus(positions[i], positions[j]);
                double square = dot(difference, difference);
                least = square < least ? square : least;
                values[j] = square < values[j] ? square : values[j];
            }
            values[i] = least;
        }
        for (size_t i = 0; i < n; i++)
            values[i] = units[s] * sqrt(values[i]);
        quartiles[s] = nth_smallest(values, n, (3 * n + 3) / 4 - 1);
    }
}

/* From here on: whole scenes, so that nothing else need be done for each. */

typedef unsigned __int128 wide;

/* PCG64 as NumPy has it: "PCG: a family of simple fast space-efficient statistically good algorithms
   for random number generation" (O'Neill 2014), XSL-RR 128/64. A half is what is left of the last
   64 bits. */
typedef struct {
    uint64_t state[2], increment[2], has_half, half; /* high words first */
} generator;

static inline uint32_t next_half(wide *state, wide increment, generator *g)
{
    if (g->has_half) {
        g->has_half = 0;
        return (uint32_t)g->half;
    }
    *state = *state * (((wide)2549297995355413924u << 64) | 4865540595714422341u) + increment;
    uint64_t folded = (uint64_t)(*state >> 64) ^ (uint64_t)*state;
    unsigned turn = (unsigned)(*state >> 122);
    uint64_t bits = folded >> turn | folded << (-turn & 63);
    g->has_half = 1;
    g->half = bits >> 32;
    return (uint32_t)bits;
}

/* What Generator.integers(n) gives: Lemire, "Fast random integer generation in an interval", 2019. */
static void draw_below(generator *g, size_t n, ptrdiff_t *numbers, size_t count)
{
    wide state = (wide)g->state[0] << 64 | g->state[1];
    wide increment = (wide)g->increment[0] << 64 | g->increment[1];
    generator rest = *g;
    uint32_t biased = (uint32_t)((UINT64_C(1) << 32) % n);
    for (size_t i = 0; i < count; i++) {
        uint64_t product = 0;
        if (n > 1)
            do
                product = (uint64_t)next_half(&state, increment, &rest) * n;
            while ((uint32_t)product < biased);
        numbers[i] = (ptrdiff_t)(product >> 32);
    }
    g->state[0] = (uint64_t)(state >> 64);
    g->state[1] = (uint64_t)state;
    g->has_half = rest.has_half;
    g->half = rest.half;
}

#define KEPT ((size_t)1 << 16) /* numbers that are kept for the next scene */

/* Numbers below n from a state. Scenes of the same size often begin with the same state. */
typedef struct {
    generator start, kept_end, end; /* where it began, and is behind what it keeps and has read */
    size_t n, n_kept, n_read;
    ptrdiff_t *kept, *others;
} stream;

static void begin(stream *s, const generator *start, size_t n, bool from_anew)
{
    if (from_anew || s->n != n || memcmp(&s->start, start, sizeof *start) != 0) {
        s->start = s->kept_end = *start;
        s->n = n;
        s->n_kept = 0;
    }
    s->end = s->start;
    s->n_read = 0;
}

/* The next numbers; they are there until the next are asked for. */
static const ptrdiff_t *next_numbers(stream *s, size_t count)
{
    size_t first = s->n_read, after = first + count;
    s->n_read = after;
    if (after <= KEPT) {
        if (after > s->n_kept) {
            draw_below(&s->kept_end, s->n, s->kept + s->n_kept, after - s->n_kept);
            s->n_kept = after;
        }
        s->end = s->kept_end;
        return s->kept + first;
    }
    size_t n_left = 0;
    if (first <= s->n_kept) {
        n_left = s->n_kept - first;
        memcpy(s->others, s->kept + first, n_left * sizeof *s->others);
        s->end = s->kept_end;
    }
    draw_below(&s->end, s->n, s->others + n_left, count - n_left);
    return s->others;
}

/* What is the same for all scenes. */
typedef struct {
    size_t n_hypotheses, draws_per_hypothesis, most_at_once;
    double factor, margin; /* of the prescreening, and of a squared error */
    double flat_sine, parallel_sine, line_ratio, smallest, farthest;
    double resolution, tolerance, fine_tolerance; /* of the largest threshold */
    double more; /* weight of one camera of a subset */
    ptrdiff_t alignment, sweeps;
    size_t n_starts, few, several, n_subsets, n_neighbourhoods, n_finalists, sample, small_sample;
} settings;

/* Scenes one behind the other: rows of coordinates, of scene s from starts[s] to starts[s + 1]. */
typedef struct {
    size_t n_scenes;
    const size_t *which, *starts, *ranks; /* the scenes to register; ranks for PCR-99 alone */
    const double *gt, *est, *thresholds;
    const ptrdiff_t *orders; /* in which the cameras are refined */
    generator *generator;    /* with which each scene begins */
    bool advance;            /* whether it begins where the scene before ended */
    similarity *hypotheses;  /* room for `most_hypotheses` of each scene, if they are kept */
    size_t *n_hypotheses;    /* SIZE_MAX where they are not drawn yet */
    size_t most_hypotheses;
    similarity *last; /* if hypotheses are kept, the one found at another threshold */
    bool *has_last;
    similarity *found;
    bool *is_found;
    size_t *n_used;
} scenes;

#define TABLE 128 /* cameras up to which the ratios of all pairs are computed first */
#define MOST_THREADS 256

/* Room for what is computed of a scene. */
typedef struct {
    stream numbers;
    double *gt, *est, *shuffled, *first_cameras, *ratios, *errors, *weights;
    ptrdiff_t *similar, *triplets;
    size_t most_triplets;
    double *scales;
    matrix *rotations;
    vector *translations;
    bool *flat;
    similarity *rows, *chosen, *starts;
    size_t *order;
    double *costs, *gains;
} room;

static size_t all_triplets(size_t n)
{
    double product = (double)n * ((double)n - 1) * ((double)n - 2); /* 0 of fewer than 3 */
    return product / 6 < (double)(SIZE_MAX >> 8) ? (size_t)(product / 6) : SIZE_MAX >> 8;
}

/* The most triplets that are kept. */
static size_t most_kept(size_t n, size_t n_wanted)
{
    return all_triplets(n) <= n_wanted ? 3 * all_triplets(n) : n_wanted;
}


/* Append those triplets of a batch, (3, count), that pass, until there are `most`. */
static size_t keep_similar(room *r, size_t n, const ptrdiff_t *batch, size_t count, double factor,
                           size_t n_kept, size_t most)
{
    const ptrdiff_t *first = batch, *second = batch + count, *third = second + count;
    if (n <= TABLE)
        mark_alike(r->ratios, n, first, second, third, count, factor, r->similar);
    else
        mark_similar(r->gt, r->est, n, first, second, third, count, factor, r->similar);
    for (size_t t = 0; t < count && n_kept < most; t++)
        if (r->similar[t]) {
            r->triplets[n_kept] = first[t];
            r->triplets[r->most_triplets + n_kept] = second[t];
            r->triplets[2 * r->most_triplets + n_kept++] = third[t];
        }
    return n_kept;
}

/* All triplets, each three times: every edge is the first edge once. */
static size_t enumerate(ptrdiff_t n, ptrdiff_t *triplets)
{
    size_t count = all_triplets((size_t)n), t = 0;
    for (ptrdiff_t i = 0; i < n; i++)
        for (ptrdiff_t j = i + 1; j < n; j++)
            for (ptrdiff_t k = j + 1; k < n; k++, t++)
                for (size_t turn = 0; turn < 3; turn++) {
                    const ptrdiff_t corners[3] = {i, j, k};
                    for (size_t row = 0; row < 3; row++)
                        triplets[(3 * row + turn) * count + t] = corners[(row + turn) % 3];
                }
    return 3 * count;
}

/* As pcr99.prescreened_triplets. */
static size_t prescreen(room *r, const settings *set, size_t n, size_t n_wanted)
{
    if (n <= TABLE)
        tabulate(r->gt, r->est, n, r->ratios);
    if (all_triplets(n) <= n_wanted) {
        size_t count = enumerate((ptrdiff_t)n, r->numbers.others);
        return keep_similar(r, n, r->numbers.others, count, set->factor, 0, count);
    }
    size_t n_kept = 0, n_drawn = 0, batch = 2 * n_wanted;
    while (n_kept < n_wanted && n_drawn < set->draws_per_hypothesis * n_wanted) {
        const ptrdiff_t *drawn = next_numbers(&r->numbers, 3 * batch);
        n_kept = keep_similar(r, n, drawn, batch, set->factor, n_kept, n_wanted);
        n_drawn += batch;
        double more = 1.1 * (double)(n_wanted - n_kept) * (double)n_drawn / (n_kept ? (double)n_kept : 1);
        batch = more < (double)set->most_at_once ? 64 + (size_t)more : set->most_at_once;
        batch = batch < set->most_at_once ? batch : set->most_at_once;
    }
    return n_kept;
}

static void align_kept(room *r, const settings *set, size_t n, size_t n_triplets)
{
    const ptrdiff_t *const corners[3] = {r->triplets, r->triplets + r->most_triplets,
                                         r->triplets + 2 * r->most_triplets};
    align_triplets(r->gt, r->est, n, corners, n_triplets, (int)set->alignment, set->flat_sine,
                   set->parallel_sine, r->scales, r->rotations, r->translations, r->flat);
}

static void component_first(const double *rows, size_t n, double *points)
{
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++)
            points[k * n + i] = rows[3 * i + k];
}

/* As pcr99.pcr99. */
static void pcr99_scene(room *r, const settings *set, const scenes *all, size_t s, size_t n)
{
    size_t n_used = all->n_used[s] = prescreen(r, set, n, set->n_hypotheses);
    all->is_found[s] = n_used > 0;
    if (n_used == 0)
        return;
    align_kept(r, set, n, n_used);
    double largest = 0;
    for (size_t i = 0; i < n; i++) {
        double square = dot(point(r->gt, n, i), point(r->gt, n, i));
        largest = square > largest ? square : largest;
    }
    double margin = set->margin * largest < DBL_MAX ? set->margin * largest : DBL_MAX;
    size_t best = cheapest(r->gt, r->est, n, r->scales, r->rotations, r->translations, r->flat, n_used,
                           all->ranks[s], margin, r->errors);
    all->found[s] = (similarity){r->scales[best], r->rotations[best], r->translations[best]};
}

/* The cameras in another order, none farther than can be squared. */
static void shuffle(const double *points, size_t n, const ptrdiff_t *order, double farthest,
                    double *shuffled)
{
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < n; i++) {
            double x = points[k * n + (size_t)order[i]];
            x = x < -farthest ? -farthest : x;
            shuffled[k * n + i] = x > farthest ? farthest : x;
        }
}

static void take_first(const double *points, size_t n, size_t n_taken, double *taken)
{
    for (size_t k = 0; k < 3; k++)
        memcpy(taken + k * n_taken, points + k * n, n_taken * sizeof *taken);
}

/* Fit to as many weights. */
static void fit(const room *r, const settings *set, const double *gt, const double *est, size_t n,
                size_t n_fits, similarity *fits)
{
    weighted_fits(gt, est, n, r->weights, n_fits, (int)set->alignment, set->smallest,
                  (int)set->sweeps, set->line_ratio, set->parallel_sine, fits);
}

/* The next subset of this size in the order of combinations; whether there is one. */
static bool next_subset(size_t n, size_t size, size_t *members)
{
    size_t last = size;
    while (last > 0 && members[last - 1] == n - size + last - 1)
        last--;
    if (last == 0)
        return false;
    members[last - 1]++;
    for (size_t i = last; i < size; i++)
        members[i] = members[i - 1] + 1;
    return true;
}

/* As Cameras.subset_fits; return how many there are. With nothing to fit to they are only counted. */
static size_t fit_subsets(room *r, const settings *set, size_t n, similarity *fits)
{
    size_t count = 0, least = set->alignment == SIMILARITY ? 3 : 2;
    size_t n_sizes = n <= set->few && n >= least ? n - least + 1 : 0;
    for (size_t s = 0; s < 2 * n_sizes; s++) {
        bool one_counts_more = s >= n_sizes;
        size_t size = n - s % n_sizes, n_each = one_counts_more ? size : 1;
        double n_fits = (double)n_each;
        for (size_t i = 0; i < size; i++)
            n_fits = n_fits * (double)(n - i) / (double)(i + 1);
        if ((double)count + n_fits > (double)set->n_subsets)
            continue;
        if (fits == NULL) {
            count += (size_t)(n_fits + 0.5);
            continue;
        }
        for (size_t i = 0; i < size; i++)
            r->order[i] = i;
        do {
            for (size_t k = 0; k < n_each; k++) {
                double *weights = r->weights + count++ % LANES * n;
                memset(weights, 0, n * sizeof *weights);
                for (size_t i = 0; i < size; i++)
                    weights[r->order[i]] = one_counts_more && i == k ? set->more : 1;
                if (count % LANES == 0)
                    fit(r, set, r->shuffled, r->shuffled + 3 * n, n, LANES, fits + count - LANES);
            }
        } while (next_subset(n, size, r->order));
    }
    if (fits && count % LANES)
        fit(r, set, r->shuffled, r->shuffled + 3 * n, n, count % LANES, fits + count - count % LANES);
    return count;
}

/* All triplets, the longest edge first. */
static size_t keep_all(room *r, size_t n)
{
    size_t count = 0;
    ptrdiff_t *corners[3] = {r->triplets, r->triplets + r->most_triplets,
                             r->triplets + 2 * r->most_triplets};
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 1; j < n; j++)
            for (size_t k = j + 1; k < n; k++, count++) {
                const size_t turned[5] = {i, j, k, i, j};
                size_t first = 0;
                double longest = 0;
                for (size_t turn = 0; turn < 3; turn++) {
                    vector edge = minus(point(r->gt, n, turned[turn]), point(r->gt, n, turned[turn + 1]));
                    double square = dot(edge, edge);
                    if (square > longest) {
                        longest = square;
                        first = turn;
                    }
                }
                for (size_t corner = 0; corner < 3; corner++)
                    corners[corner][count] = (ptrdiff_t)turned[first + corner];
            }
    return count;
}

/* Append any triplets of distinct cameras. */
static size_t keep_any(room *r, size_t n, size_t n_kept, size_t count)
{
    for (size_t row = 0; row < 3; row++)
        draw_below(&r->numbers.end, n - row, r->triplets + row * r->most_triplets + n_kept, count);
    for (size_t t = n_kept; t < n_kept + count; t++) {
        ptrdiff_t i = r->triplets[t], j = r->triplets[r->most_triplets + t];
        ptrdiff_t k = r->triplets[2 * r->most_triplets + t];
        j += j >= i; /* one of the others */
        k += k >= (i < j ? i : j);
        k += k >= (i < j ? j : i);
        r->triplets[r->most_triplets + t] = j;
        r->triplets[2 * r->most_triplets + t] = k;
    }
    return n_kept + count;
}

static bool is_screened(const settings *set, size_t n)
{
    return set->alignment == SIMILARITY && n > set->several;
}

/* How many triplets are drawn without prescreening. */
static size_t n_any(const settings *set, size_t n)
{
    size_t half = (set->n_hypotheses + 1) / 2;
    if (n <= set->few || is_screened(set, n))
        return 0;
    return n > set->several ? half : 3 * half;
}

static size_t n_screened(const settings *set, size_t n)
{
    return is_screened(set, n) ? set->n_hypotheses : (set->n_hypotheses + 1) / 2;
}

static bool is_usable(const similarity *s)
{
    const double *numbers = (const double *)s;
    for (size_t i = 0; i < sizeof *s / sizeof *numbers; i++)
        if (!(fabs(numbers[i]) < INFINITY))
            return false;
    return s->scale > 0;
}

/* As the hypotheses of Search; return how many there are. */
static size_t draw_hypotheses(room *r, const settings *set, size_t n, similarity *rows)
{
    size_t count = 0, n_triplets;
    if (n <= set->few)
        n_triplets = keep_all(r, n);
    else
        n_triplets = keep_any(r, n, prescreen(r, set, n, n_screened(set, n)), n_any(set, n));
    align_kept(r, set, n, n_triplets);
    for (size_t h = 0; h < n_triplets; h++)
        rows[h] = (similarity){r->scales[h], r->rotations[h], r->translations[h]};
    size_t n_rows = n_triplets + fit_subsets(r, set, n, rows + n_triplets);
    for (size_t h = 0; h < n_rows; h++)
        if (is_usable(&rows[h]))
            rows[count++] = rows[h];
    return count;
}

/* Put a cost and what it is of among the `most` lowest; return how many there are. */
static size_t insert(room *r, size_t count, size_t most, double cost, size_t index)
{
    if (count == most && !(cost < r->costs[most - 1]))
        return count;
    count += count < most;
    size_t place = count - 1;
    for (; place > 0 && r->costs[place - 1] > cost; place--) {
        r->costs[place] = r->costs[place - 1];
        r->order[place] = r->order[place - 1];
    }
    r->costs[place] = cost;
    r->order[place] = index;
    return count;
}

/* Choose the cheapest, the cheapest first; return how many there are. */
static size_t choose(room *r, const double *gt, const double *est, size_t n, double threshold,
                     double resolution, const similarity *rows, size_t n_rows, size_t most,
                     similarity *chosen)
{
    size_t count = 0;
    for (size_t h = 0; h < n_rows; h++) {
        double cost = truncated_cost(gt, est, n, &rows[h], threshold, resolution);
        count = insert(r, count, most, cost, h);
    }
    for (size_t i = 0; i < count; i++)
        chosen[i] = rows[r->order[i]];
    return count;
}

static double distance(vector a, vector b)
{
    vector difference = minus(a, b);
    return sqrt(dot(difference, difference));
}

/* As Cameras.neighbourhood_fits. */
static size_t fit_neighbourhoods(room *r, const settings *set, const double *gt, const double *est,
                                 size_t n, double threshold, similarity *fits)
{
    size_t n_candidates = n < set->small_sample ? n : set->small_sample, count = 0;
    for (size_t i = 0; i < n_candidates; i++) {
        lanes sums = {0};
        for (size_t j = 0; j < n_candidates; j++) {
            double d = distance(point(gt, n, i), point(gt, n, j));
            sums[j % LANES] += d < threshold ? d : threshold;
        }
        count = insert(r, count, set->n_neighbourhoods, folded(sums), i);
    }
    for (size_t k = 0; k <= count; k++) {
        double *weights = r->weights + k * n;
        for (size_t i = 0; i < n; i++)
            weights[i] = k == count || distance(point(gt, n, r->order[k]), point(gt, n, i)) < threshold;
    }
    fit(r, set, gt, est, n, count + 1, fits);
    return count + 1;
}

static size_t refine_some(room *r, const settings *set, const double *gt, const double *est, size_t n,
                          similarity *rows, size_t n_rows, double threshold, size_t n_left,
                          double tolerance)
{
    return refine(gt, est, n, rows, n_rows, threshold, set->resolution * threshold, n_left,
                  tolerance * threshold * (double)n, (int)set->alignment, set->smallest,
                  (int)set->sweeps, set->line_ratio, set->parallel_sine, r->errors, r->costs, r->gains);
}

/* As refined.Search. */
static void refined_scene(room *r, const settings *set, const scenes *all, size_t s, size_t n)
{
    double *gt = r->shuffled, *est = gt + 3 * n;
    const ptrdiff_t *order = all->orders + all->starts[s];
    shuffle(r->gt, n, order, set->farthest, gt);
    shuffle(r->est, n, order, set->farthest, est);
    similarity *rows = all->hypotheses ? all->hypotheses + s * all->most_hypotheses : r->rows;
    size_t drawn_now, *n_rows = all->hypotheses ? &all->n_hypotheses[s] : &drawn_now;
    if (!all->hypotheses || *n_rows == SIZE_MAX)
        all->n_used[s] = *n_rows = draw_hypotheses(r, set, n, rows);

    double threshold = all->thresholds[s], resolution;
    threshold = threshold > 1 / set->farthest ? threshold : 1 / set->farthest;
    threshold = threshold < set->farthest ? threshold : set->farthest;
    resolution = set->resolution * threshold;
    const similarity *starts = rows;
    size_t n_starts = *n_rows, n_sample = n < set->sample ? n : set->sample;
    if (n > set->small_sample) {
        size_t n_small = set->small_sample;
        double *small_est = r->first_cameras + 3 * n_small;
        take_first(gt, n, n_small, r->first_cameras);
        take_first(est, n, n_small, small_est);
        n_starts = choose(r, r->first_cameras, small_est, n_small, threshold, resolution, starts, n_starts,
                          4 * set->n_starts, r->chosen);
        starts = r->chosen;
    }
    double *sample_est = r->first_cameras + 3 * n_sample;
    take_first(gt, n, n_sample, r->first_cameras);
    take_first(est, n, n_sample, sample_est);
    size_t most_starts = n > set->several ? set->n_starts : 2 * set->n_starts;
    if (all->has_last && !all->has_last[s])
        most_starts = set->n_finalists; /* only leads to the next threshold */
    n_starts = choose(r, r->first_cameras, sample_est, n_sample, threshold, resolution, starts, n_starts,
                      most_starts, r->starts);
    n_starts += fit_neighbourhoods(r, set, r->first_cameras, sample_est, n_sample, threshold,
                                   r->starts + n_starts);
    n_starts = refine_some(r, set, r->first_cameras, sample_est, n_sample, r->starts, n_starts, threshold,
                           set->n_finalists, INFINITY);
    if (all->has_last && all->has_last[s])
        r->starts[n_starts++] = all->last[s];
    refine_some(r, set, gt, est, n, r->starts, n_starts, threshold, 1,
                n > set->several ? set->tolerance : set->fine_tolerance);
    all->found[s] = r->starts[0];
    all->is_found[s] = is_usable(r->starts);
    if (all->has_last && all->is_found[s]) {
        all->last[s] = r->starts[0];
        all->has_last[s] = true;
    }
}

/* Divide memory, which is counted first, where there is none yet. */
static void *take(char **memory, size_t *size, size_t count, size_t width)
{
    size_t bytes = count < SIZE_MAX / 4 / width ? (count * width + 63) & ~(size_t)63 : SIZE_MAX / 4;
    void *taken = *memory;
    *memory += *memory ? bytes : 0;
    *size = *size < SIZE_MAX / 4 ? *size + bytes : *size;
    return taken;
}

static size_t max(size_t a, size_t b)
{
    return a > b ? a : b;
}

/* The most triplets of n cameras that are refined. */
static size_t most_refined(const settings *set, size_t n)
{
    return n <= set->few ? all_triplets(n) : most_kept(n, n_screened(set, n)) + n_any(set, n);
}

/* The most hypotheses of n cameras that are refined. */
EXPORTED
size_t most_rows(const settings *set, size_t n)
{
    return most_refined(set, n) + fit_subsets(NULL, set, n, NULL);
}

/* The most triplets of n cameras that are looked at at once. */
static size_t most_at_once(const settings *set, size_t n)
{
    size_t all = all_triplets(n), wanted = set->n_hypotheses;
    size_t drawn = all <= n_screened(set, n) ? 0 : max(2 * wanted, set->most_at_once);
    return max(drawn, all <= wanted ? 3 * all : 0);
}

static size_t n_cameras(const scenes *all, size_t s)
{
    return all->starts[s + 1] - all->starts[s];
}

/* Lay out room for the largest of the scenes; return its size in bytes. */
static size_t lay_out(room *r, const settings *set, const scenes *all, char *memory)
{
    size_t n = 0, kept = 0, rows = 0, batch = 0, size = 0;
    for (size_t i = 0; i < all->n_scenes; i++) {
        size_t n_s = n_cameras(all, all->which[i]);
        n = max(n, n_s);
        kept = max(kept, max(most_kept(n_s, set->n_hypotheses), most_refined(set, n_s)));
        rows = max(rows, most_rows(set, n_s));
        batch = max(batch, most_at_once(set, n_s));
    }
    size_t starts = 2 * set->n_starts + set->n_neighbourhoods + 2;
    size_t costs = max(max(4 * set->n_starts, starts), set->few);
    r->numbers.kept = take(&memory, &size, KEPT, sizeof(ptrdiff_t));
    r->numbers.others = take(&memory, &size, 3 * batch, sizeof(ptrdiff_t));
    r->similar = take(&memory, &size, batch, sizeof(ptrdiff_t));
    r->most_triplets = kept;
    r->triplets = take(&memory, &size, 3 * kept, sizeof(ptrdiff_t));
    r->gt = take(&memory, &size, 3 * n, sizeof(double));
    r->est = take(&memory, &size, 3 * n, sizeof(double));
    r->shuffled = take(&memory, &size, 6 * n, sizeof(double));
    r->first_cameras = take(&memory, &size, 6 * set->sample, sizeof(double));
    r->ratios = take(&memory, &size, TABLE * TABLE, sizeof(double));
    r->errors = take(&memory, &size, n, sizeof(double));
    size_t n_weights = max(LANES, set->n_neighbourhoods + 1);
    r->weights = take(&memory, &size, n_weights * min(n, set->sample), sizeof(double));
    r->scales = take(&memory, &size, kept, sizeof(double));
    r->rotations = take(&memory, &size, kept, sizeof(matrix));
    r->translations = take(&memory, &size, kept, sizeof(vector));
    r->flat = take(&memory, &size, kept, sizeof(bool));
    r->rows = take(&memory, &size, all->hypotheses ? 0 : rows, sizeof(similarity));
    r->chosen = take(&memory, &size, 4 * set->n_starts, sizeof(similarity));
    r->starts = take(&memory, &size, starts, sizeof(similarity));
    r->order = take(&memory, &size, costs, sizeof(size_t));
    r->costs = take(&memory, &size, costs, sizeof(double));
    r->gains = take(&memory, &size, costs, sizeof(double));
    return size;
}

typedef struct {
    const settings *set;
    const scenes *all;
    size_t next; /* scene that no thread has begun */
    int failed;
} work;

static void *do_work(void *argument)
{
    work *job = argument;
    const scenes *all = job->all;
    room r = {0};
    char *memory = malloc(lay_out(&r, job->set, all, NULL));
    if (memory == NULL) {
        __atomic_store_n(&job->failed, 1, __ATOMIC_RELAXED);
        return NULL;
    }
    lay_out(&r, job->set, all, memory);
    for (;;) {
        size_t turn = __atomic_fetch_add(&job->next, 1, __ATOMIC_RELAXED);
        if (turn >= all->n_scenes)
            break;
        size_t s = all->which[turn], n = n_cameras(all, s);
        component_first(all->gt + 3 * all->starts[s], n, r.gt);
        component_first(all->est + 3 * all->starts[s], n, r.est);
        begin(&r.numbers, all->generator, n, !all->ranks && n_any(job->set, n) > 0);
        if (all->ranks)
            pcr99_scene(&r, job->set, all, s, n);
        else
            refined_scene(&r, job->set, all, s, n);
        if (all->advance)
            *all->generator = r.numbers.end;
    }
    free(memory);
    return NULL;
}

/* Register all scenes, on so many threads; return whether there was enough memory. */
EXPORTED
int register_scenes(const settings *set, const scenes *all, size_t n_threads)
{
    work job = {set, all, 0, 0};
#ifndef _WIN32
    pthread_t threads[MOST_THREADS];
    size_t n_others = 0;
    n_threads = n_threads < all->n_scenes ? n_threads : all->n_scenes;
    while (n_others + 1 < n_threads && n_others < MOST_THREADS
           && pthread_create(&threads[n_others], NULL, do_work, &job) == 0)
        n_others++;
    do_work(&job);
    while (n_others > 0)
        pthread_join(threads[--n_others], NULL);
#else
    do_work(&job);
#endif
    return !job.failed;
}
