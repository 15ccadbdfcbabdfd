/* Whole scenes: positions are normalised, d is measured, the estimate is registered, errors follow. */

#include "kernel.h"

/* Origin and unit of a world: the coordinate-wise median, and a power of two near the median distance
   from it along an axis, so that dividing by it rounds nothing. Neither a far origin nor squares of
   very large or small numbers then cost any digits, and an outlier moves neither. */
typedef struct {
    double centre[3], unit;
} frame;

static frame frame_of(const double *rows, size_t n, double *values)
{
    frame f = {{0}, 1};
    for (size_t k = 0; k < 3 && n > 0; k++) {
        for (size_t i = 0; i < n; i++)
            values[i] = rows[3 * i + k];
        f.centre[k] = nth_smallest(values, n, n / 2) + 0.0; /* the zero without a sign */
    }
    size_t n_moved = 0;
    for (size_t i = 0; i < 3 * n; i++) {
        double distance = fabs(rows[i] - f.centre[i % 3]);
        values[n_moved] = distance;
        n_moved += distance > 0;
    }
    int exponent = 1;
    if (n_moved > 0)
        frexp(nth_smallest(values, n_moved, n_moved / 2), &exponent);
    f.unit = ldexp(1, exponent - 1);
    return f;
}

/* Rows relative to a frame, component first; the axes in cyclic order so that `last` is the last. */
static void normalise(const double *rows, size_t n, frame f, size_t last, double *points)
{
    for (size_t k = 0; k < 3; k++) {
        size_t axis = (k + last + 1) % 3;
        for (size_t i = 0; i < n; i++)
            points[k * n + i] = (rows[3 * i + axis] - f.centre[axis]) / f.unit;
    }
}

/* A scene while it is registered at one or several thresholds. */
typedef struct {
    pool memory;
    bool is_open;
    size_t n, last_axis;
    double d;
    bool *is_estimated;
    frame gt_frame, est_frame;
    cameras estimated; /* normalised */
    search search;
} scene;

/* Copy the rows of estimated cameras; return how many there are. */
static size_t copy_estimated(scene *s, const double *gt, const double *est, double *gt_rows,
                             double *est_rows)
{
    size_t count = 0;
    for (size_t i = 0; i < s->n; i++) {
        const double *row = est + 3 * i;
        s->is_estimated[i] = isfinite(row[0]) && isfinite(row[1]) && isfinite(row[2]);
        if (s->is_estimated[i]) {
            memcpy(gt_rows + 3 * count, gt + 3 * i, 3 * sizeof *gt);
            memcpy(est_rows + 3 * count++, row, 3 * sizeof *est);
        }
    }
    return count;
}

/* Normalise both worlds; they have one unit where the scale is kept. */
static void open_scene(scene *s, const options *o, const double *gt, const double *est, size_t n,
                       bool needs_d)
{
    s->n = n;
    s->d = NAN;
    s->last_axis = o->alignment == YAW ? (size_t)o->vertical : 2;
    s->is_estimated = allocate(&s->memory, n, sizeof *s->is_estimated);
    double *gt_rows = allocate(&s->memory, n, 3 * sizeof *gt_rows);
    double *est_rows = allocate(&s->memory, n, 3 * sizeof *est_rows);
    double *gt_points = allocate(&s->memory, n, 3 * sizeof *gt_points);
    double *est_points = allocate(&s->memory, n, 3 * sizeof *est_points);
    s->gt_frame = frame_of(gt, n, gt_points);
    if (needs_d && n >= 4) {
        double *distances = est_points;
        normalise(gt, n, s->gt_frame, 2, gt_points);
        closest_distances(&s->memory, n, gt_points, distances);
        s->d = s->gt_frame.unit * nth_smallest(distances, n, (3 * n + 3) / 4 - 1);
    }
    size_t n_estimated = copy_estimated(s, gt, est, gt_rows, est_rows);
    if (o->alignment == NONE) {
        memset(s->gt_frame.centre, 0, sizeof s->gt_frame.centre);
        s->est_frame = s->gt_frame;
    } else {
        if (n_estimated < n)
            s->gt_frame = frame_of(gt_rows, n_estimated, est_points);
        s->est_frame = frame_of(est_rows, n_estimated, est_points);
        if (o->alignment != SIMILARITY)
            s->est_frame.unit = s->gt_frame.unit;
    }
    normalise(gt_rows, n_estimated, s->gt_frame, s->last_axis, gt_points);
    normalise(est_rows, n_estimated, s->est_frame, s->last_axis, est_points);
    s->estimated = (cameras){n_estimated, n_estimated, gt_points, est_points};
    s->is_open = true;
}

/* Register normalised positions; the scale is NaN where there is no alignment. */
static similarity registered(scene *s, const options *o, double threshold, bitgen *random,
                             bitgen *sampler, size_t *n_used)
{
    const cameras *c = &s->estimated;
    size_t rank = smaller(o->rank ? o->rank : larger(4, (s->n + 5) / 10), c->n);
    similarity alignment = {NAN, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0}};
    if (c->n < (o->alignment == SIMILARITY ? 3 : 1))
        return alignment;
    if (o->alignment == NONE) {
        alignment.scale = 1;
        *n_used = 1;
    } else if (o->registration == USER) {
        o->user(c->n, c->gt, c->est, rank, threshold, &alignment, n_used);
    } else if (o->registration == PCR99) {
        *n_used = pcr99(&s->memory, c, o, rank, random, &alignment);
    } else {
        if (s->search.hypotheses == NULL)
            begin_search(&s->memory, c, o, random, sampler, &s->search);
        refined(&s->search, o, threshold);
        *n_used = s->search.n_hypotheses;
        alignment = s->search.best;
    }
    return alignment;
}

/* The errors of all cameras, infinite where one was not estimated. */
static void write_errors(const scene *s, const similarity *alignment, double *errors)
{
    squared_errors(&s->estimated, alignment, errors);
    for (size_t i = s->n, next = s->estimated.n; i-- > 0;)
        errors[i] = s->is_estimated[i] ? s->gt_frame.unit * sqrt(errors[--next]) : INFINITY;
}

/* The alignment of normalised positions as that of the positions themselves. */
static void write_alignment(const scene *s, const similarity *alignment, double *row)
{
    const frame *gt = &s->gt_frame, *est = &s->est_frame;
    const double *rotation = &alignment->rotation.x.x, *translation = &alignment->translation.x;
    double scale = row[0] = alignment->scale * est->unit / gt->unit;
    for (size_t i = 0; i < 3; i++) {
        size_t axis = (i + s->last_axis + 1) % 3;
        double *turned = row + 1 + 3 * axis, origin = 0;
        for (size_t j = 0; j < 3; j++)
            turned[(j + s->last_axis + 1) % 3] = rotation[3 * i + j];
        for (size_t k = 0; k < 3; k++)
            origin += scale * turned[k] * gt->centre[k];
        row[10 + axis] = est->centre[axis] + est->unit * translation[i] - origin;
    }
}

/* Align a scene with a unit, which becomes d where it is not a number. Return false without memory. */
static bool align_scene(scene *s, const options *o, size_t n, const double *gt, const double *est,
                        bitgen *random, bitgen *sampler, double *row, double *errors,
                        double *unit, size_t *n_used)
{
    if (setjmp(s->memory.no_memory))
        return false;
    if (!s->is_open)
        open_scene(s, o, gt, est, n, isnan(*unit));
    *unit = isnan(*unit) ? s->d : *unit;
    similarity alignment = {.scale = NAN};
    if (0 < *unit && *unit < INFINITY)
        alignment = registered(s, o, o->max_threshold * *unit / s->gt_frame.unit, random, sampler,
                               n_used);
    if (!isnan(alignment.scale)) {
        write_errors(s, &alignment, errors);
        write_alignment(s, &alignment, row);
    }
    return true;
}

EXPORTED
scene *new_scene(void)
{
    return calloc(1, sizeof(scene));
}

EXPORTED
void delete_scene(scene *s)
{
    release(&s->memory);
    free(s);
}

/* Align scenes one behind the other: rows of coordinates, of scene s from starts[s] to starts[s + 1].
   Each has a random generator; behind these are those that draw the samples of `refined`. Where there
   is no alignment, as where the unit is not positive and finite, the row, the errors and n_used stay
   as they are. A single scene may be kept for the next threshold. Return false without memory. */
EXPORTED
bool align_scenes(const options *o, size_t n_scenes, const size_t *starts, const double *gt,
                  const double *est, bitgen *const *random, scene *kept, double *rows,
                  double *errors, double *units, size_t *n_used)
{
    bool done = true;
    for (size_t i = 0; i < n_scenes && done; i++) {
        size_t first = starts[i];
        scene local = {.n = 0}, *s = kept ? kept : &local;
        s->search.many_thresholds = kept != NULL;
        bitgen *sampler = o->registration == REFINED ? random[n_scenes + i] : NULL;
        done = align_scene(s, o, starts[i + 1] - first, gt + 3 * first, est + 3 * first, random[i],
                           sampler, rows + 13 * i, errors + first, &units[i], &n_used[i]);
        release(&local.memory);
    }
    return done;
}
