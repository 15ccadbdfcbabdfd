/* Memory that is freed at once, and selection. */

#include "kernel.h"

#define ALIGNMENT 64 /* a cache line */

struct block {
    block *before;
};

void *allocate(pool *memory, size_t count, size_t size)
{
    if (count > (SIZE_MAX / 2 - 2 * ALIGNMENT) / size)
        return NULL;
    block *allocated = malloc(sizeof(block) + ALIGNMENT + count * size);
    if (allocated == NULL)
        return NULL;
    allocated->before = memory->last;
    memory->last = allocated;
    char *start = (char *)(allocated + 1);
    return start + (-(uintptr_t)start & (ALIGNMENT - 1));
}

void release(pool *memory)
{
    while (memory->last) {
        block *before = memory->last->before;
        free(memory->last);
        memory->last = before;
    }
}

/* Hoare's Find. */
double nth_smallest(double *values, size_t n, size_t rank)
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
