/* Fits of similarities: to three cameras, frame to frame, and by weighted least squares. */

#include "kernel.h"

#define PARALLEL_SINE 1e-6 /* of directions, also of two edges, that have no usable normal */
#define LINE_RATIO 1e-9    /* of singular values; the cameras are on a line */
#define AT_ONCE 64         /* triplets */
#define JACOBI_SWEEPS 4    /* after which the columns of a 3 x 3 matrix are orthogonal */

/* Loops that call these are vectorised. */
#define INLINED __attribute__((always_inline)) static inline

static const matrix identity = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* An axis of the smallest rotation between unit vectors; any normal if they are parallel. */
static vector common_normal(vector a, vector b)
{
    vector axis = cross(a, b);
    if (dot(axis, axis) <= PARALLEL_SINE * PARALLEL_SINE) {
        double x = fabs(a.x), y = fabs(a.y), z = fabs(a.z);
        vector shortest = x <= y && x <= z ? (vector){1, 0, 0}
                          : y <= z         ? (vector){0, 1, 0}
                                           : (vector){0, 0, 1};
        axis = cross(a, shortest);
    }
    return axis;
}

/* Orthonormal axes: along the first edge, the triangle's normal, and normal to both. */
typedef struct {
    vector first, normal, third;
} axes;

static inline void complete_axes(axes *a)
{
    vector normal = minus(a->normal, times(dot(a->normal, a->first), a->first));
    a->normal = over(normal, sqrt(dot(normal, normal)));
    a->third = cross(a->first, a->normal);
}

static inline vector combined(const axes *a, double first, double normal, double third)
{
    return plus(plus(times(first, a->first), times(normal, a->normal)), times(third, a->third));
}

/* The rotation that takes axes a to axes b. */
static inline matrix rotation_between(const axes *a, const axes *b)
{
    return (matrix){
        combined(a, b->first.x, b->normal.x, b->third.x),
        combined(a, b->first.y, b->normal.y, b->third.y),
        combined(a, b->first.z, b->normal.z, b->third.z),
    };
}

typedef struct {
    vector edge_1, edge_2, centroid;
    axes frame;
    int flat; /* then there is no normal */
} triangle;

EVERY_WIDTH
static void measure_errors(const double *restrict gt, const double *restrict est, size_t stride,
                           size_t n, similarity s, double *restrict squares)
{
    const double shrink = 1 / s.scale;
    for (size_t i = 0; i < n; i++) {
        vector aligned = times(shrink, minus(point(est, stride, i), s.translation));
        vector residual = minus(aligned, rotated(s.rotation, point(gt, stride, i)));
        squares[i] = dot(residual, residual);
    }
}

/* Squared errors of the cameras in the ground truth. */
void squared_errors(const cameras *c, const similarity *s, double *squares)
{
    measure_errors(c->gt, c->est, c->stride, c->n, *s, squares);
}

/* Errors of normalised points (3, n), in units of the ground truth; infinite where the difference of
   numbers that overflow is none. */
EXPORTED
void position_errors(size_t n, const double *gt, const double *est, const similarity *s, double unit,
                     double *errors)
{
    squared_errors(&(cameras){n, n, gt, est}, s, errors);
    for (size_t i = 0; i < n; i++)
        errors[i] = isnan(errors[i]) ? INFINITY : unit * sqrt(errors[i]);
}

INLINED triangle measured(const double *points, size_t n, triplet t)
{
    vector a = point(points, n, t.i), b = point(points, n, t.j), c = point(points, n, t.k);
    triangle m = {minus(b, a), minus(c, a), over(plus(plus(a, b), c), 3), {{0}}, 0};
    m.frame.first = over(m.edge_1, sqrt(dot(m.edge_1, m.edge_1)));
    m.frame.normal = cross(m.frame.first, m.edge_2);
    double square = dot(m.frame.normal, m.frame.normal);
    m.flat = square <= PARALLEL_SINE * PARALLEL_SINE * dot(m.edge_2, m.edge_2);
    return m;
}

/* The similarity or rigid motion of two triangles, frame to frame; the normals are complete. */
INLINED similarity between(triangle a, triangle b, int alignment)
{
    complete_axes(&a.frame);
    complete_axes(&b.frame);
    matrix rotation = rotation_between(&a.frame, &b.frame);
    /* Sum of b . (R a) over sum of a . a, about the centroids. R takes first axis to first axis, so
       three of the four products of edges follow from their lengths along these. */
    double a_1 = dot(a.edge_1, a.frame.first), a_2 = dot(a.edge_2, a.frame.first);
    double b_1 = dot(b.edge_1, b.frame.first), b_2 = dot(b.edge_2, b.frame.first);
    double a_22 = dot(a.edge_2, a.edge_2), b_22 = dot(b.edge_2, rotated(rotation, a.edge_2));
    double scale = (2 * (b_1 * a_1 + b_22) - b_1 * a_2 - b_2 * a_1)
                   / (2 * (a_1 * a_1 + a_22 - a_1 * a_2));
    scale = alignment == SIMILARITY ? scale : 1;
    vector translation = minus(b.centroid, times(scale, rotated(rotation, a.centroid)));
    return (similarity){scale, rotation, translation};
}

EVERY_WIDTH
static void measure_moments(const double *restrict gt, const double *restrict est, size_t stride,
                            size_t n, const double *restrict weights, moments *restrict m)
{
    double sum = 0, x = 0, y = 0, z = 0, u = 0, v = 0, w = 0;
#pragma omp simd reduction(+ : sum, x, y, z, u, v, w)
    for (size_t i = 0; i < n; i++) {
        sum += weights[i];
        x += weights[i] * gt[i];
        y += weights[i] * gt[stride + i];
        z += weights[i] * gt[2 * stride + i];
        u += weights[i] * est[i];
        v += weights[i] * est[stride + i];
        w += weights[i] * est[2 * stride + i];
    }
    sum = fmax(sum, DBL_MIN);
    const vector gt_mean = m->gt_mean = over((vector){x, y, z}, sum);
    const vector est_mean = m->est_mean = over((vector){u, v, w}, sum);
    double spread = 0, ux = 0, uy = 0, uz = 0, vx = 0, vy = 0, vz = 0, wx = 0, wy = 0, wz = 0;
#pragma omp simd reduction(+ : spread, ux, uy, uz, vx, vy, vz, wx, wy, wz)
    for (size_t i = 0; i < n; i++) {
        vector a = minus(point(gt, stride, i), gt_mean);
        vector b = minus(point(est, stride, i), est_mean);
        vector weighted = times(weights[i], b);
        spread += dot(weighted, b);
        ux += weighted.x * a.x;
        uy += weighted.x * a.y;
        uz += weighted.x * a.z;
        vx += weighted.y * a.x;
        vy += weighted.y * a.y;
        vz += weighted.y * a.z;
        wx += weighted.z * a.x;
        wy += weighted.z * a.y;
        wz += weighted.z * a.z;
    }
    m->covariance[0] = (vector){ux, uy, uz};
    m->covariance[1] = (vector){vx, vy, vz};
    m->covariance[2] = (vector){wx, wy, wz};
    m->spread = spread;
}

moments weighted_moments(const cameras *c, const double *weights)
{
    moments m;
    measure_moments(c->gt, c->est, c->stride, c->n, weights, &m);
    return m;
}

/* Rotate two columns of a matrix so that they become orthogonal, and their axes too. */
static void orthogonalise(vector *a, vector *b, vector *a_axis, vector *b_axis)
{
    const vector u = *a, v = *b, u_axis = *a_axis, v_axis = *b_axis;
    double product = dot(u, v), u_square = dot(u, u), v_square = dot(v, v);
    if (product * product <= DBL_EPSILON * DBL_EPSILON * u_square * v_square)
        return;
    double ratio = (v_square - u_square) / (2 * product);
    double tangent = copysign(1, ratio) / (fabs(ratio) + sqrt(1 + ratio * ratio));
    double cosine = 1 / sqrt(1 + tangent * tangent), sine = cosine * tangent;
    *a = minus(times(cosine, u), times(sine, v));
    *b = plus(times(sine, u), times(cosine, v));
    *a_axis = minus(times(cosine, u_axis), times(sine, v_axis));
    *b_axis = plus(times(sine, u_axis), times(cosine, v_axis));
}

/* The rotation that correlates best with a matrix, by its singular value decomposition (one-sided
   Jacobi rotations). On a line it is the smallest one. */
static matrix best_rotation(const vector m[3])
{
    vector c[3] = {{m[0].x, m[1].x, m[2].x}, {m[0].y, m[1].y, m[2].y}, {m[0].z, m[1].z, m[2].z}};
    vector v[3] = {identity.x, identity.y, identity.z};
    for (int sweep = 0; sweep < JACOBI_SWEEPS; sweep++) {
        orthogonalise(&c[0], &c[1], &v[0], &v[1]);
        orthogonalise(&c[0], &c[2], &v[0], &v[2]);
        orthogonalise(&c[1], &c[2], &v[1], &v[2]);
    }
    int first = 0, last = 0;
    for (int k = 1; k < 3; k++) {
        first = dot(c[k], c[k]) > dot(c[first], c[first]) ? k : first;
        last = dot(c[k], c[k]) <= dot(c[last], c[last]) ? k : last;
    }
    int middle = 3 - first - last;
    if (first == last) /* of numbers that are none, as where all cameras coincide */
        return identity;
    double largest = sqrt(dot(c[first], c[first]));
    axes a = {.first = v[first], .normal = v[middle]};
    axes b = {.first = over(c[first], largest), .normal = c[middle]};
    if (sqrt(dot(c[middle], c[middle])) <= LINE_RATIO * largest)
        a.normal = b.normal = common_normal(a.first, b.first);
    complete_axes(&a);
    complete_axes(&b);
    return rotation_between(&a, &b);
}

/* The rotation about the third axis that correlates best with a matrix of numbers up to 1; none where
   all do alike. Return whether that is so. */
static bool best_turn(const vector m[3], matrix *rotation)
{
    double cosine = m[0].x + m[1].y, sine = m[1].x - m[0].y;
    double length = sqrt(cosine * cosine + sine * sine);
    bool is_free = !(length > PARALLEL_SINE * PARALLEL_SINE);
    cosine = is_free ? 1 : cosine / length;
    sine = is_free ? 0 : sine / length;
    *rotation = (matrix){{cosine, -sine, 0}, {sine, cosine, 0}, {0, 0, 1}};
    return is_free;
}

/* The least-squares alignment, with errors in the ground truth: Umeyama's fit of the estimate to the
   ground truth, inverted. Not usable where none is the best. Return whether a turn was free. */
bool fit_moments(const moments *sums, int alignment, similarity *fit)
{
    const double *numbers = &sums->covariance[0].x;
    bool is_free = false;
    double largest = 0;
    vector m[3];
    for (size_t k = 0; k < 9; k++)
        largest = fabs(numbers[k]) > largest ? fabs(numbers[k]) : largest;
    for (size_t k = 0; k < 3; k++)
        m[k] = over(sums->covariance[k], largest);
    fit->scale = 1;
    if (alignment == YAW)
        is_free = best_turn(m, &fit->rotation);
    else
        fit->rotation = largest > 0 || alignment != RIGID ? best_rotation(m) : identity;
    if (alignment == SIMILARITY) {
        const matrix *r = &fit->rotation;
        fit->scale = sums->spread / ((dot(r->x, m[0]) + dot(r->y, m[1]) + dot(r->z, m[2])) * largest);
    }
    vector origin = times(fit->scale, rotated(fit->rotation, sums->gt_mean));
    fit->translation = minus(sums->est_mean, origin);
    return is_free;
}

static inline void store(vector v, double (*rows)[AT_ONCE], size_t t)
{
    rows[0][t] = v.x;
    rows[1][t] = v.y;
    rows[2][t] = v.z;
}

/* Fit triplets as if no triangle were flat, as rows of numbers; mark those that are. */
EVERY_WIDTH
static void fit_triangles(const double *restrict gt, const double *restrict est, size_t n,
                          const triplet *restrict triplets, size_t count, int alignment,
                          double (*restrict rows)[AT_ONCE], double *restrict flat)
{
#pragma omp simd
    for (size_t t = 0; t < count; t++) {
        triangle a = measured(gt, n, triplets[t]), b = measured(est, n, triplets[t]);
        similarity s = between(a, b, alignment);
        flat[t] = a.flat | b.flat;
        rows[0][t] = s.scale;
        store(s.rotation.x, rows + 1, t);
        store(s.rotation.y, rows + 4, t);
        store(s.rotation.z, rows + 7, t);
        store(s.translation, rows + 10, t);
    }
}

/* Fit a triplet whose triangle is flat: the spin about its line is that of the smallest rotation. */
static similarity fit_flat(const cameras *c, triplet t, int alignment)
{
    triangle a = measured(c->gt, c->n, t), b = measured(c->est, c->n, t);
    a.frame.normal = b.frame.normal = common_normal(a.frame.first, b.frame.first);
    return between(a, b, alignment);
}

/* Turn a triplet about the third axis; return whether the turn is free, as both stand upright. */
static bool fit_turn(const cameras *c, triplet t, similarity *fit)
{
    const uint32_t corners[3] = {t.i, t.j, t.k};
    const double weights[3] = {1, 1, 1};
    double gt[9], est[9];
    for (size_t k = 0; k < 9; k++) {
        gt[k] = c->gt[k / 3 * c->n + corners[k % 3]];
        est[k] = c->est[k / 3 * c->n + corners[k % 3]];
    }
    moments m = weighted_moments(&(cameras){3, 3, gt, est}, weights);
    return fit_moments(&m, YAW, fit);
}

/* Fit triplets; mark those with a free spin or turn. */
void fit_triplets(const cameras *c, const triplet *triplets, size_t count, int alignment,
                  similarity *fits, double *is_free)
{
    double rows[13][AT_ONCE];
    for (size_t t = 0; t < count; t++) {
        if (alignment == YAW) {
            is_free[t] = fit_turn(c, triplets[t], &fits[t]);
            continue;
        }
        if (t % AT_ONCE == 0)
            fit_triangles(c->gt, c->est, c->n, triplets + t, smaller(AT_ONCE, count - t), alignment,
                          rows, is_free + t);
        for (size_t k = 0; k < 13; k++)
            (&fits[t].scale)[k] = rows[k][t % AT_ONCE];
        if (is_free[t])
            fits[t] = fit_flat(c, triplets[t], alignment);
    }
}
