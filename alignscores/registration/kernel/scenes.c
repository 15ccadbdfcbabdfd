/* Whole scenes: positions are normalised, d is measured, the estimate is registered, errors follow. */

#include "kernel.h"

#define FARTHEST_SUMMABLE 1e300 /* sums and differences of coordinates beyond may overflow */
#define SHRINK 0x1p-40          /* of such coordinates; it rounds nothing */

enum { DONE, NO_MEMORY, REGISTRATION_FAILED };

/* Origin and unit of a world: the coordinate-wise median, and a power of two near the median distance
   from it along an axis, so that dividing by it rounds nothing. Neither a far origin nor squares of
   very large or small numbers then cost any digits, and an outlier moves neither. */
typedef struct {
    double shrink; /* by which all coordinates are multiplied first */
    double centre[3], unit;
} frame;

static frame frame_of(const double *rows, size_t n, double *values)
{
    frame f = {1, {0}, 1};
    for (size_t i = 0; i < 3 * n; i++)
        f.shrink = fabs(rows[i]) > FARTHEST_SUMMABLE ? SHRINK : f.shrink;
    for (size_t k = 0; k < 3 && n > 0; k++) {
        for (size_t i = 0; i < n; i++)
            values[i] = f.shrink * rows[3 * i + k];
        f.centre[k] = nth_smallest(values, n, n / 2) + 0.0; /* the zero without a sign */
    }
    size_t n_moved = 0;
    for (size_t i = 0; i < 3 * n; i++) {
        double distance = fabs(f.shrink * rows[i] - f.centre[i % 3]);
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
            points[k * n + i] = (f.shrink * rows[3 * i + axis] - f.centre[axis]) / f.unit;
    }
}

/* A scene while it is registered at one or several thresholds. */
typedef struct {
    pool memory;
    size_t n, n_estimated, last_axis;
    double d;
    bool *is_estimated;
    frame gt_frame, est_frame;
    double unit; /* of gt_frame, of the ground truth */
    cameras estimated;
    search refined;
    similarity found;
    size_t n_used;
    bool is_drawn;
} scene;

static bool measure_d(scene *s, const double *points)
{
    if (s->n < 4)
        return true;
    double *distances = allocate(&s->memory, s->n, sizeof *distances);
    if (distances == NULL || !closest_pairs(s->n, points, distances))
        return false;
    s->d = s->unit * nth_smallest(distances, s->n, (3 * s->n + 3) / 4 - 1);
    return true;
}

/* Copy the rows of estimated cameras; return how many there are. */
static size_t keep_estimated(scene *s, const double *gt, const double *est, double *gt_rows,
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
static bool open_scene(scene *s, const options *o, const double *gt, const double *est, size_t n,
                       double unit)
{
    s->n = n;
    s->d = NAN;
    s->is_estimated = allocate(&s->memory, n, sizeof *s->is_estimated);
    double *gt_rows = allocate(&s->memory, n, 3 * sizeof *gt_rows);
    double *est_rows = allocate(&s->memory, n, 3 * sizeof *est_rows);
    double *gt_points = allocate(&s->memory, n, 3 * sizeof *gt_points);
    double *est_points = allocate(&s->memory, n, 3 * sizeof *est_points);
    if (!s->is_estimated || !gt_rows || !est_rows || !gt_points || !est_points)
        return false;
    s->last_axis = o->alignment == YAW ? (size_t)o->vertical : 2;
    s->gt_frame = frame_of(gt, n, gt_points);
    normalise(gt, n, s->gt_frame, 2, gt_points);
    s->unit = s->gt_frame.unit / s->gt_frame.shrink;
    if (isnan(unit) && !measure_d(s, gt_points))
        return false;
    s->n_estimated = keep_estimated(s, gt, est, gt_rows, est_rows);
    if (o->alignment == NONE) {
        memset(s->gt_frame.centre, 0, sizeof s->gt_frame.centre);
        s->est_frame = s->gt_frame;
    } else {
        if (s->n_estimated < n)
            s->gt_frame = frame_of(gt_rows, s->n_estimated, est_points);
        s->est_frame = frame_of(est_rows, s->n_estimated, est_points);
        if (o->alignment != SIMILARITY)
            s->est_frame.unit = s->gt_frame.unit / s->gt_frame.shrink * s->est_frame.shrink;
    }
    s->unit = s->gt_frame.unit / s->gt_frame.shrink;
    normalise(gt_rows, s->n_estimated, s->gt_frame, s->last_axis, gt_points);
    normalise(est_rows, s->n_estimated, s->est_frame, s->last_axis, est_points);
    s->estimated = (cameras){s->n_estimated, gt_points, est_points};
    return true;
}

/* Register normalised positions; `s->found` has a scale that is not a number where nothing is found. */
static int align_scene(scene *s, const options *o, double threshold, pcg64 *random)
{
    const cameras *c = &s->estimated;
    size_t rank = smaller(o->rank ? o->rank : larger(4, (s->n + 5) / 10), c->n);
    bool done = true;
    s->found = (similarity){NAN, {{0}}, {0}};
    if (c->n < (o->alignment == SIMILARITY ? 3 : 1))
        return DONE;
    if (o->alignment == NONE) {
        s->found = (similarity){1, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0}};
        s->n_used = 1;
    } else if (o->registration == USER) {
        int outcome = o->user(c->n, c->gt, c->est, rank, threshold, &s->found, &s->n_used);
        return outcome < 0 ? REGISTRATION_FAILED : DONE;
    } else if (o->registration == PCR99) {
        done = pcr99(c, o, rank, random, &s->found, &s->n_used);
    } else {
        if (!s->is_drawn)
            done = begin_search(&s->memory, c, o, random, &s->refined);
        s->is_drawn = true;
        done = done && refined(&s->refined, o, threshold);
        s->n_used = s->refined.n_hypotheses;
        if (s->refined.is_found)
            s->found = s->refined.found;
    }
    return done ? DONE : NO_MEMORY;
}

/* Errors in the ground truth, of normalised positions. */
EVERY_WIDTH
static void position_errors(const double *restrict gt, const double *restrict est, size_t n,
                            const similarity *restrict s, double unit, double *restrict errors)
{
    const similarity copy = *s;
    for (size_t i = 0; i < n; i++) {
        vector aligned = over(minus(point(est, n, i), copy.translation), copy.scale);
        vector residual = minus(aligned, rotated(copy.rotation, point(gt, n, i)));
        errors[i] = unit * sqrt(dot(residual, residual));
    }
}

/* The errors of all cameras, infinite where one was not estimated. */
static void write_errors(const scene *s, double *errors)
{
    const cameras *c = &s->estimated;
    position_errors(c->gt, c->est, c->n, &s->found, s->unit, errors);
    for (size_t i = s->n, next = c->n; i-- > 0;)
        errors[i] = s->is_estimated[i] ? errors[--next] : INFINITY;
}

/* The alignment of normalised positions as that of the positions themselves. */
static void write_alignment(const scene *s, double *row)
{
    const similarity *f = &s->found;
    const frame *gt = &s->gt_frame, *est = &s->est_frame;
    const double *rotation = &f->rotation.x.x, *translation = &f->translation.x;
    double unit = est->unit / est->shrink, scale = f->scale * unit / s->unit;
    row[0] = scale;
    for (size_t i = 0; i < 3; i++) {
        size_t axis = (i + s->last_axis + 1) % 3;
        double *turned = row + 1 + 3 * axis, origin = 0;
        for (size_t j = 0; j < 3; j++)
            turned[(j + s->last_axis + 1) % 3] = rotation[3 * i + j];
        for (size_t k = 0; k < 3; k++)
            origin += scale * turned[k] * (gt->centre[k] / gt->shrink);
        row[10 + axis] = est->centre[axis] / est->shrink + unit * translation[i] - origin;
    }
}

EXPORTED
const size_t options_size = sizeof(options); /* which Python declares, too */

EXPORTED
void close_scenes(size_t n_scenes, scene **kept)
{
    for (size_t i = 0; i < n_scenes; i++)
        if (kept[i]) {
            release(&kept[i]->memory);
            free(kept[i]);
            kept[i] = NULL;
        }
}

/* Align scenes one behind the other: rows of coordinates, of scene s from starts[s] to starts[s + 1].
   A random generator goes on from scene to scene, or begins anew with each.
   A unit that is not a number becomes d; a scene whose unit is not positive and finite is left. An
   alignment is a row of 13 numbers, which are none where there is none. With `kept` the scenes are
   kept for the next threshold, until they are closed. */
EXPORTED
int align_scenes(const options *o, size_t n_scenes, const size_t *starts, const double *gt,
                 const double *est, pcg64 *random, bool goes_on, scene **kept, double *rows,
                 double *errors, double *units, size_t *n_used)
{
    int outcome = DONE;
    for (size_t i = 0; i < n_scenes && outcome == DONE; i++) {
        size_t first = starts[i], n = starts[i + 1] - first;
        scene local = {.n = 0}, *s = &local;
        pcg64 anew = *random;
        bool is_open = kept && kept[i];
        if (kept && !is_open)
            kept[i] = calloc(1, sizeof *s);
        if (kept)
            s = kept[i];
        if (!s || (!is_open && !open_scene(s, o, gt + 3 * first, est + 3 * first, n, units[i]))) {
            outcome = NO_MEMORY;
        } else {
            units[i] = isnan(units[i]) ? s->d : units[i];
            s->refined.many_thresholds = kept != NULL;
            s->found.scale = NAN;
            if (0 < units[i] && units[i] < INFINITY)
                outcome = align_scene(s, o, o->max_threshold * units[i] / s->unit,
                                      goes_on ? random : &anew);
            n_used[i] = s->n_used;
            for (size_t k = 0; k < 13; k++)
                rows[13 * i + k] = NAN;
            for (size_t k = 0; k < n; k++)
                errors[first + k] = INFINITY;
            if (!isnan(s->found.scale)) {
                write_errors(s, errors + first);
                write_alignment(s, rows + 13 * i);
            }
        }
        release(&local.memory);
        if (kept && outcome != DONE)
            close_scenes(1, &kept[i]);
    }
    return outcome;
}

/* Normalise rows of positions, component first; the origin and the unit are those of the rows. */
EXPORTED
void normalise_positions(size_t n, const double *rows, double *points, double *centre, double *unit)
{
    frame f = frame_of(rows, n, points);
    normalise(rows, n, f, 2, points);
    for (size_t k = 0; k < 3; k++)
        centre[k] = f.centre[k] / f.shrink;
    *unit = f.unit / f.shrink;
}
