/* Memory that is freed at once, and selection. */

#include "kernel.h"

struct block {
    block *before;
    max_align_t start[];
};

/* Memory until the pool is released; without it the call ends where `no_memory` was set. */
void *allocate(pool *memory, size_t count, size_t size)
{
    block *allocated = NULL;
    if (count < (SIZE_MAX / 2 - sizeof(block)) / size)
        allocated = malloc(sizeof(block) + count * size);
    if (allocated == NULL)
        longjmp(memory->no_memory, 1);
    allocated->before = memory->last;
    memory->last = allocated;
    return allocated->start;
}

void release(pool *memory)
{
    while (memory->last) {
        block *before = memory->last->before;
        free(memory->last);
        memory->last = before;
    }
}

/* Reorder rows of numbers so that the one of rank k in the first row is where it is in order, and none
   before it is larger (Hoare's Find). */
static inline void find(double *const *rows, size_t n_rows, ptrdiff_t low, ptrdiff_t high,
                        ptrdiff_t k)
{
    while (low < high) {
        ptrdiff_t i = low, j = high;
        double pivot = rows[0][k];
        while (i <= j) {
            while (rows[0][i] < pivot)
                i++;
            while (pivot < rows[0][j])
                j--;
            if (i > j)
                break;
            for (size_t row = 0; row < n_rows; row++) {
                double value = rows[row][i];
                rows[row][i] = rows[row][j];
                rows[row][j] = value;
            }
            i++;
            j--;
        }
        if (j < k)
            low = i;
        if (k < i)
            high = j;
    }
}

double nth_smallest(double *values, size_t n, size_t rank)
{
    find(&values, 1, 0, (ptrdiff_t)n - 1, (ptrdiff_t)rank);
    return values[rank];
}

void split_positions(double *const position[3], ptrdiff_t low, ptrdiff_t high, ptrdiff_t middle)
{
    find(position, 3, low, high - 1, middle);
}
