/* Positions relative to the origin and in the unit of their own frame. */

#include "kernel.h"

/* Origin and unit of positions: the coordinate-wise median, and a power of two near the median distance
   from it along an axis, so that dividing by it rounds nothing. Neither a far origin nor squares of
   very large or small numbers then cost any digits, and an outlier moves neither. A unit that is given
   stays. Return false without memory. */
bool robust_frame(size_t n, const double *rows, double frame[4])
{
    double *values = allocate(n, 3 * sizeof *values);
    if (values == NULL)
        return false;
    for (size_t k = 0; k < 3 && n > 0; k++) {
        for (size_t i = 0; i < n; i++)
            values[i] = rows[3 * i + k];
        frame[k] = nth_smallest(values, n, n / 2) + 0.0; /* the zero without a sign */
    }
    size_t n_moved = 0;
    for (size_t i = 0; i < 3 * n && isnan(frame[3]); i++) {
        double distance = fabs(rows[i] - frame[i % 3]);
        values[n_moved] = distance;
        n_moved += distance > 0;
    }
    int exponent = 1;
    if (n_moved > 0)
        frexp(nth_smallest(values, n_moved, n_moved / 2), &exponent);
    frame[3] = isnan(frame[3]) ? ldexp(1, exponent - 1) : frame[3];
    free(values);
    return true;
}

void to_frame(size_t n, const double *rows, const double frame[4], double *points)
{
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < n; i++)
            points[k * n + i] = (rows[3 * i + k] - frame[k]) / frame[3];
}

/* Centre and scale rows of coordinates: points (3, n), and the frame, centre and unit, in which they
   are. The unit is given or NaN. Return false without memory. */
EXPORTED
bool normalise(size_t n, const double *rows, double *frame, double *points)
{
    if (!robust_frame(n, rows, frame))
        return false;
    to_frame(n, rows, frame, points);
    return true;
}
