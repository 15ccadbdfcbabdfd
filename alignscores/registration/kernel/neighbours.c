/* Closest pairs of cameras, by a k-d tree. */

#include "kernel.h"

#define LEAF 32 /* positions at most, all of which are looked at */

/* Positions from `low` to `high` are split at the middle one, along an axis that is stored there with
   the coordinate; the halves are split alike. */
typedef struct {
    double *position[3];
    int *axes;
    double *splits;
} tree;

/* The axis along which positions extend most. */
static int widest(const tree *t, ptrdiff_t low, ptrdiff_t high)
{
    int axis = 0;
    double width = -1;
    for (int k = 0; k < 3; k++) {
        const double *x = t->position[k];
        double least = INFINITY, most = -INFINITY;
#pragma omp simd reduction(min : least) reduction(max : most)
        for (ptrdiff_t i = low; i < high; i++) {
            least = x[i] < least ? x[i] : least;
            most = x[i] > most ? x[i] : most;
        }
        axis = most - least > width ? k : axis;
        width = fmax(most - least, width);
    }
    return axis;
}

static void build(tree *t, ptrdiff_t low, ptrdiff_t high)
{
    if (high - low <= LEAF)
        return;
    ptrdiff_t middle = low + (high - low) / 2;
    int axis = widest(t, low, high);
    double *const rows[3] = {t->position[axis], t->position[(axis + 1) % 3],
                             t->position[(axis + 2) % 3]};
    split_rows(rows, low, high, middle);
    t->axes[middle] = axis;
    t->splits[middle] = rows[0][middle];
    build(t, low, middle);
    build(t, middle, high);
}

/* The squared distance of position `self` to the closest other one from `low` to `high`, if it is
   below that found so far. */
EVERY_WIDTH
static double closest_of(const double *restrict x, const double *restrict y,
                         const double *restrict z, ptrdiff_t low, ptrdiff_t high, ptrdiff_t self,
                         double least)
{
    const double a = x[self], b = y[self], c = z[self];
#pragma omp simd reduction(min : least)
    for (ptrdiff_t i = low; i < high; i++) {
        double u = x[i] - a, v = y[i] - b, w = z[i] - c;
        double square = i == self ? INFINITY : u * u + v * v + w * w;
        least = square < least ? square : least;
    }
    return least;
}

static double closest(const tree *t, ptrdiff_t low, ptrdiff_t high, ptrdiff_t self, double least)
{
    if (high - low <= LEAF)
        return closest_of(t->position[0], t->position[1], t->position[2], low, high, self, least);
    ptrdiff_t middle = low + (high - low) / 2;
    double off = t->position[t->axes[middle]][self] - t->splits[middle];
    if (off < 0) {
        least = closest(t, low, middle, self, least);
        return off * off < least ? closest(t, middle, high, self, least) : least;
    }
    least = closest(t, middle, high, self, least);
    return off * off < least ? closest(t, low, middle, self, least) : least;
}

/* The distances of positions, rows of coordinates, to the closest other one each, in some order. Return
   the largest distance from the median along an axis; -1 without memory. */
EXPORTED
double closest_distances(size_t n, const double *rows, double *distances)
{
    double frame[4] = {0, 0, 0, 1}, largest = 0;
    int exponent = 1;
    double *copy = allocate(n, 4 * sizeof *copy);
    int *axes = allocate(n, sizeof *axes);
    bool done = copy && axes && robust_frame(n, rows, frame);
    if (done) {
        tree t = {{copy, copy + n, copy + 2 * n}, axes, copy + 3 * n};
        for (size_t i = 0; i < 3 * n; i++)
            largest = fmax(largest, fabs(rows[i] - frame[i % 3]));
        if (0 < largest && largest < INFINITY) /* in a unit of the extent: no square overflows */
            frexp(largest, &exponent);
        frame[3] = ldexp(1, exponent - 1);
        to_frame(n, rows, frame, copy);
        build(&t, 0, (ptrdiff_t)n);
        for (ptrdiff_t i = 0; i < (ptrdiff_t)n; i++)
            distances[i] = frame[3] * sqrt(closest(&t, 0, (ptrdiff_t)n, i, INFINITY));
    }
    free(copy);
    free(axes);
    return done ? largest : -1;
}
