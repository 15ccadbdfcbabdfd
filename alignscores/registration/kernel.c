/* The functions of hypotheses.py and reweighting.py, compiled: same arguments, same results to the
   last bit. So every sum has the order that it has there, and no product is fused into a sum
   (-ffp-contract=off).

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

EXPORTED
void three_point_similarities(const double *gt, const double *est, size_t n,
                              const ptrdiff_t *triplets, size_t n_triplets, int alignment,
                              double flat_sine, double parallel_sine, double *scales, matrix *rotations,
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
        matrix rotation = rotation_between(&a, &b);

        if (alignment == YAW)
            flat[h] = turn_between(&a, &b, flat_sine, &rotation);

        double a_1 = dot(a.edge_1, a.first), a_2 = dot(a.edge_2, a.first);
        double b_1 = dot(b.edge_1, b.first), b_2 = dot(b.edge_2, b.first);
        double a_22 = dot(a.edge_2, a.edge_2), b_22 = dot(b.edge_2, rotated(rotation, a.edge_2));
        double scale = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1)
                       / (2 * (a_1 * a_1 + a_22 - a_1 * a_2));
        if (alignment != SIMILARITY)
            scale = 1;
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

typedef struct {
    double scale;
    matrix rotation;
    vector translation;
} similarity;

#define LANES 8 /* partial sums, so that a processor can add as many numbers at once */

typedef double lanes[LANES];

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

/* Turn two columns so that they become orthogonal, and their axes with them. */
static inline void orthogonalise(vector *a, vector *b, vector *axis_a, vector *axis_b)
{
    double product = dot(*a, *b);
    double ratio = (dot(*b, *b) - dot(*a, *a)) / (2 * product);
    double tangent = copysign(1, ratio) / (fabs(ratio) + sqrt(1 + ratio * ratio));
    if (product == 0)
        tangent = 0;
    double cosine = 1 / sqrt(1 + tangent * tangent), sine = cosine * tangent;
    vector column = *a, axis = *axis_a;
    *a = minus(times(cosine, column), times(sine, *b));
    *b = plus(times(sine, column), times(cosine, *b));
    *axis_a = minus(times(cosine, axis), times(sine, *axis_b));
    *axis_b = plus(times(sine, axis), times(cosine, *axis_b));
}

static inline void swap(vector *a, vector *b)
{
    vector other = *a;
    *a = *b;
    *b = other;
}

/* The rotation that correlates best with a matrix, given by its columns. */
static matrix best_rotation(vector columns[3], int sweeps, double line_ratio, double parallel_sine)
{
    vector axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < sweeps; sweep++)
        for (int i = 0; i < 2; i++)
            for (int j = i + 1; j < 3; j++)
                orthogonalise(&columns[i], &columns[j], &axes[i], &axes[j]);
    for (int pass = 0; pass < 3; pass++) { /* the longest first; equal ones keep their order */
        int i = pass % 2;
        if (sqrt(dot(columns[i], columns[i])) < sqrt(dot(columns[i + 1], columns[i + 1]))) {
            swap(&columns[i], &columns[i + 1]);
            swap(&axes[i], &axes[i + 1]);
        }
    }
    double largest = sqrt(dot(columns[0], columns[0])), middle = sqrt(dot(columns[1], columns[1]));
    triangle a = {.first = axes[0], .normal = axes[1]};
    triangle b = {.first = over(columns[0], largest), .normal = columns[1]};
    if (middle <= line_ratio * largest)
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

static similarity weighted_fit(const double *gt, const double *est, size_t n, const double *weights,
                               group alignment, double smallest, int sweeps, double line_ratio,
                               double parallel_sine)
{
    vector gt_mean, est_mean;
    double c[3][3], largest = 0;
    weighted_means(gt, est, n, weights, smallest, &gt_mean, &est_mean);
    double spread = cross_covariance(gt, est, n, weights, gt_mean, est_mean, c);
    for (size_t row = 0; row < 3; row++)
        for (size_t column = 0; column < 3; column++)
            largest = fabs(c[row][column]) > largest ? fabs(c[row][column]) : largest;
    vector rows[3], columns[3];
    for (size_t k = 0; k < 3; k++) {
        rows[k] = over((vector){c[k][0], c[k][1], c[k][2]}, largest);
        columns[k] = over((vector){c[0][k], c[1][k], c[2][k]}, largest);
    }
    matrix r = alignment == YAW ? turn(rows[0].x + rows[1].y, rows[1].x - rows[0].y, 0)
                                : best_rotation(columns, sweeps, line_ratio, parallel_sine);
    double scale = 1;
    if (alignment == SIMILARITY) {
        double correlation = dot(r.x, rows[0]) + dot(r.y, rows[1]) + dot(r.z, rows[2]);
        scale = spread / (correlation * largest);
    } else if (largest == 0) {
        r = identity;
    }
    return (similarity){scale, r, minus(est_mean, times(scale, rotated(r, gt_mean)))};
}

EXPORTED
void weighted_fits(const double *gt, const double *est, size_t n, const double *weights,
                   size_t n_fits, int alignment, double smallest, int sweeps, double line_ratio,
                   double parallel_sine, similarity *fits)
{
    for (size_t h = 0; h < n_fits; h++)
        fits[h] = weighted_fit(gt, est, n, weights + h * n, (group)alignment, smallest, sweeps,
                               line_ratio, parallel_sine);
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

/* Refine similarities in place; return how many are left. `weights` is room for n numbers, `costs`
   and `gains` for as many as there are similarities. */
EXPORTED
size_t refine(const double *gt, const double *est, size_t n, similarity *similarities,
              size_t n_similarities, double threshold, double resolution, size_t n_left,
              double least_gain, int alignment, double smallest, int sweeps, double line_ratio,
              double parallel_sine, double *weights, double *costs, double *gains)
{
    size_t count = n_similarities;
    double largest_gain = INFINITY;
    truncated_costs(gt, est, n, similarities, count, threshold, resolution, costs);
    while (count > n_left || largest_gain > least_gain) {
        for (size_t h = 0; h < count; h++) {
            reweight(gt, est, n, &similarities[h], threshold, resolution, weights);
            similarity step = weighted_fit(gt, est, n, weights, (group)alignment, smallest, sweeps,
                                           line_ratio, parallel_sine);
            double cost = truncated_cost(gt, est, n, &step, threshold, resolution);
            gains[h] = costs[h] - cost;
            if (gains[h] > 0) {
                similarities[h] = step;
                costs[h] = cost;
            }
            insert_last(similarities, costs, gains, h);
        }
        size_t half = count / 2, most = half > n_left ? half : n_left;
        count = most < count ? most : count;
        largest_gain = 0;
        for (size_t h = 0; h < count; h++)
            largest_gain = gains[h] > largest_gain ? gains[h] : largest_gain;
    }
    return count;
}
