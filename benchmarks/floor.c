/* The floor of a registration: one fused loop over hypotheses and cameras. Each hypothesis is a
   3 x 4 matrix (row by row) from ground truth to estimate, points are stored component first; the
   cameras whose squared error lies below the bound are counted. */

#include <stddef.h>

void count_inliers(const double *hypotheses, size_t n_hypotheses, const double *gt,
                   const double *est, size_t n, double bound, int *counts)
{
    for (size_t h = 0; h < n_hypotheses; h++) {
        const double *a = hypotheses + 12 * h;
        int count = 0;
        for (size_t i = 0; i < n; i++) {
            double x = gt[i], y = gt[n + i], z = gt[2 * n + i];
            double dx = a[0] * x + a[1] * y + a[2] * z + a[3] - est[i];
            double dy = a[4] * x + a[5] * y + a[6] * z + a[7] - est[n + i];
            double dz = a[8] * x + a[9] * y + a[10] * z + a[11] - est[2 * n + i];
            count += dx * dx + dy * dy + dz * dz < bound;
        }
        counts[h] = count;
    }
}
