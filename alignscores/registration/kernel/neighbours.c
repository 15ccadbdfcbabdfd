/* Closest pairs of cameras, by a k-d tree. */

#include "kernel.h"

#define LEAF 32 /* positions at most, all of which are looked at */

/* Node k has the positions from `low` to `high`; its halves are nodes 2 k and 2 k + 1. */
typedef struct {
    double *position[3];
    int *axes;
    double *splits;
} tree;

static void swap(tree *t, ptrdiff_t i, ptrdiff_t j)
{
    for (size_t k = 0; k < 3; k++) {
        double x = t->position[k][i];
        t->position[k][i] = t->position[k][j];
        t->position[k][j] = x;
    }
}

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
        if (most - least > width) {
            width = most - least;
            axis = k;
        }
    }
    return axis;
}

static void build(tree *t, ptrdiff_t low, ptrdiff_t high, size_t node)
{
    if (high - low <= LEAF)
        return;
    int axis = widest(t, low, high);
    ptrdiff_t middle = low + (high - low) / 2, first = low, last = high - 1;
    double *x = t->position[axis];
    while (first < last) { /* Hoare's Find, as nth_smallest, but of rows */
        ptrdiff_t i = first, j = last;
        double pivot = x[middle];
        while (i <= j) {
            while (x[i] < pivot)
                i++;
            while (pivot < x[j])
                j--;
            if (i <= j)
                swap(t, i++, j--);
        }
        if (j < middle)
            first = i;
        if (middle < i)
            last = j;
    }
    t->axes[node] = axis;
    t->splits[node] = x[middle];
    build(t, low, middle, 2 * node);
    build(t, middle, high, 2 * node + 1);
}

/* The squared distance of position `self` to the closest other one from `low` to `high`, if it is
   below that found so far. */
EVERY_WIDTH
static double closest_of(const double *restrict x, const double *restrict y,
                         const double *restrict z, ptrdiff_t low, ptrdiff_t high, ptrdiff_t self,
                         double found)
{
    const double a = x[self], b = y[self], c = z[self];
#pragma omp simd reduction(min : found)
    for (ptrdiff_t i = low; i < high; i++) {
        double u = x[i] - a, v = y[i] - b, w = z[i] - c;
        double square = i == self ? INFINITY : u * u + v * v + w * w;
        found = square < found ? square : found;
    }
    return found;
}

static double closest(const tree *t, ptrdiff_t low, ptrdiff_t high, size_t node, ptrdiff_t self,
                      double found)
{
    if (high - low <= LEAF)
        return closest_of(t->position[0], t->position[1], t->position[2], low, high, self, found);
    ptrdiff_t middle = low + (high - low) / 2;
    double off = t->position[t->axes[node]][self] - t->splits[node];
    if (off < 0) {
        found = closest(t, low, middle, 2 * node, self, found);
        return off * off < found ? closest(t, middle, high, 2 * node + 1, self, found) : found;
    }
    found = closest(t, middle, high, 2 * node + 1, self, found);
    return off * off < found ? closest(t, low, middle, 2 * node, self, found) : found;
}

/* The distances of normalised positions (3, n) to the closest other one each, in some order. */
EXPORTED
bool closest_pairs(size_t n, const double *positions, double *distances)
{
    size_t n_nodes = 2;
    for (size_t size = n; size > LEAF; size = (size + 1) / 2)
        n_nodes *= 2;
    pool memory = {0};
    tree t = {{0}, allocate(&memory, n_nodes, sizeof *t.axes),
              allocate(&memory, n_nodes, sizeof *t.splits)};
    double *copy = allocate(&memory, n, 3 * sizeof *copy);
    bool done = t.axes && t.splits && copy;
    if (done) {
        memcpy(copy, positions, 3 * n * sizeof *copy);
        for (size_t k = 0; k < 3; k++)
            t.position[k] = copy + k * n;
        build(&t, 0, (ptrdiff_t)n, 1);
        for (ptrdiff_t i = 0; i < (ptrdiff_t)n; i++)
            distances[i] = sqrt(closest(&t, 0, (ptrdiff_t)n, 1, i, INFINITY));
    }
    release(&memory);
    return done;
}
