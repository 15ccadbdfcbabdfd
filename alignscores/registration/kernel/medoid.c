/* The medoid of points: the one with the smallest sum of truncated distances to all others. */

#include "kernel.h"

#define DIMENSIONS 9 /* of rotation matrices */

/* Add the truncated distances between point i and those behind it to the sums of both. */
EVERY_WIDTH
static void add_distances(const double *restrict points, size_t n, size_t i, double threshold,
                          double *restrict sums)
{
    const double *p = points, *q = points + i, largest = threshold * threshold;
    const double a = q[0], b = q[n], c = q[2 * n], d = q[3 * n], e = q[4 * n], f = q[5 * n];
    const double g = q[6 * n], h = q[7 * n], k = q[8 * n];
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t j = i + 1; j < n; j++) {
        double u = p[j] - a, v = p[n + j] - b, w = p[2 * n + j] - c;
        double square = u * u + v * v + w * w;
        u = p[3 * n + j] - d, v = p[4 * n + j] - e, w = p[5 * n + j] - f;
        square += u * u + v * v + w * w;
        u = p[6 * n + j] - g, v = p[7 * n + j] - h, w = p[8 * n + j] - k;
        square += u * u + v * v + w * w;
        double distance = sqrt(square < largest ? square : largest);
        sums[j] += distance;
        sum += distance;
    }
    sums[i] += sum;
}

/* The index of the medoid of n rows of 9 numbers, the first one of equals; -1 without memory. */
EXPORTED
ptrdiff_t medoid(size_t n, const double *rows, double threshold)
{
    double *points = allocate(n, (DIMENSIONS + 1) * sizeof *points);
    if (points == NULL)
        return -1;
    double *sums = points + DIMENSIONS * n;
    for (size_t k = 0; k < DIMENSIONS; k++)
        for (size_t i = 0; i < n; i++)
            points[k * n + i] = rows[DIMENSIONS * i + k];
    memset(sums, 0, n * sizeof *sums);
    for (size_t i = 0; i < n; i++)
        add_distances(points, n, i, threshold, sums);
    size_t best = 0;
    for (size_t i = 1; i < n; i++)
        best = sums[i] < sums[best] ? i : best;
    free(points);
    return (ptrdiff_t)best;
}
