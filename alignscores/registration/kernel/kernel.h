/* What the files of the kernel share: vectors, similarities, and what each file offers the others.

   What Python calls is EXPORTED: closest_distances, normalise, pcr99, refined_hypotheses and refine,
   position_errors, medoid. Each allocates its memory first, and says so if there is none.

   Points are stored component first, (3, n). NaN and infinity fail every comparison, so triplets
   and hypotheses with such numbers never win. */

#ifndef KERNEL_H
#define KERNEL_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* One version of a function for each vector width, so that a wheel is fast on every processor. Only
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
#define EXPORTED __attribute__((visibility("default")))
#endif

typedef struct {
    double x, y, z;
} vector;

typedef struct {
    vector x, y, z;
} matrix; /* by rows */

/* From ground truth to estimate: s R c + t. Python has it as a row of 13 numbers. */
typedef struct {
    double scale;
    matrix rotation;
    vector translation;
} similarity;

/* The same cameras in both frames. */
typedef struct {
    size_t n, stride;
    const double *gt, *est; /* (3, stride), of which the first n columns are used */
} cameras;

/* Weighted sums, of which a least-squares fit is made. */
typedef struct {
    vector gt_mean, est_mean, covariance[3]; /* estimate by ground truth */
    double spread;                           /* of the estimate */
} moments;

/* Alignment groups, in the order of Python's names; "none" never gets here. */
enum { SIMILARITY, RIGID, YAW };

/* The beginning of NumPy's bitgen_t. */
typedef struct {
    void *state;
    uint64_t (*next_uint64)(void *);
    uint32_t (*next_uint32)(void *);
} bitgen;

typedef struct {
    uint32_t i, j, k;
} triplet;

/* memory.c */
void *allocate(size_t count, size_t size); /* NULL without memory */
double nth_smallest(double *values, size_t n, size_t rank); /* reorders them; ranks begin at 0 */
void split_rows(double *const rows[3], ptrdiff_t low, ptrdiff_t high, ptrdiff_t middle);

/* frames.c */
bool robust_frame(size_t n, const double *rows, double frame[4]);
void to_frame(size_t n, const double *rows, const double frame[4], double *points);

/* similarity.c */
void squared_errors(const cameras *c, const similarity *s, double *squares);
void fit_triplets(const cameras *c, const triplet *triplets, size_t count, int alignment,
                  similarity *fits, double *is_free);
moments weighted_moments(const cameras *c, const double *weights);
bool fit_moments(const moments *sums, int alignment, similarity *fit);

/* triplets.c */
size_t n_triplets(size_t n);
size_t max_prescreened(size_t n, size_t n_wanted);
ptrdiff_t prescreened_triplets(const cameras *c, size_t n_wanted, double prescreen, bitgen *random,
                               triplet *triplets);
void all_triplets(const cameras *c, triplet *triplets);

static inline vector point(const double *points, size_t stride, size_t i)
{
    return (vector){points[i], points[stride + i], points[2 * stride + i]};
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

static inline size_t smaller(size_t a, size_t b)
{
    return a < b ? a : b;
}

static inline size_t larger(size_t a, size_t b)
{
    return a > b ? a : b;
}

#endif
