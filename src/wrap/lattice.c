#include "wrap/lattice.h"

#include "math/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    MARGIN = 4,       /* cells about the box */
    SLAB = 4,         /* layers that one task marks */
    CRUMB = 5,        /* cells: a cluster no larger than that in any direction is a crumb */
    LISTEN = 1 << 16, /* cells between two words to the host */
    MOST_SLABS = 8    /* that triangles meet in the mean: where they meet more, they are not listed */
};
/* Of a cell: a triangle so near is taken to meet it, as its coordinates are rounded. */
static const double SLACK = 1e-6;

double qw_cells_across(double side, double cell) { return qw_ceil(side / cell) + 2 * MARGIN; }

qw_wrap_frame qw_wrap_frame_of(qw_env *env, const double low[3], const double high[3], double cell)
{
    double longest = 0, cells = 1;
    for (int k = 0; k < 3; k++) longest = fmax(longest, high[k] - low[k]);
    assert(cell > 0 && longest > 0);
    double across = qw_cells_across(longest, cell);
    for (int k = 0; k < 3; k++) cells *= qw_cells_across(high[k] - low[k], cell);
    if (!(cells <= (double)QW_MOST_CELLS))
        qw_fail(env, QW_TOO_LARGE, -1,
                "the distance of the wrap is too small: it would take %.3g cells, and the most is %d", cells,
                QW_MOST_CELLS);
    qw_wrap_frame f = {.side = (int32_t)qw_floor(((1 << QW_LATTICE_BITS) - 2) / across)};
    f.unit = cell / f.side;
    for (int k = 0; k < 3; k++) {
        f.cells[k] = (uint32_t)qw_cells_across(high[k] - low[k], cell);
        f.origin[k] = (low[k] + high[k]) / 2 - f.cells[k] * 0.5 * cell;
    }
    return f;
}

/* ---- cells that a triangle meets */

/* Of numbers that are none but numbers, without a call. */
static inline double less(double a, double b) { return a < b ? a : b; }
static inline double more(double a, double b) { return a > b ? a : b; }

static inline bool axis_parts(const double p[3][3], const double axis[3], const double half[3])
{
    double reach = half[0] * fabs(axis[0]) + half[1] * fabs(axis[1]) + half[2] * fabs(axis[2]), at[3];
    for (int i = 0; i < 3; i++) at[i] = p[i][0] * axis[0] + p[i][1] * axis[1] + p[i][2] * axis[2];
    return less(at[0], less(at[1], at[2])) > reach || more(at[0], more(at[1], at[2])) < -reach;
}

static void cross(const double a[3], const double b[3], double to[3])
{
    for (int k = 0; k < 3; k++) to[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* By separating axes: those of the box, the triangle's normal, and their products with its edges. */
bool qw_triangle_meets_box(const double p[3][3], const double centre[3], const double half[3], double slack)
{
    double q[3][3], edge[3][3], h[3], axis[3];
    for (int k = 0; k < 3; k++) h[k] = half[k] + slack;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) q[i][k] = p[i][k] - centre[k];
    for (int k = 0; k < 3; k++) {
        double low = less(q[0][k], less(q[1][k], q[2][k])), high = more(q[0][k], more(q[1][k], q[2][k]));
        if (low > h[k] || high < -h[k]) return false;
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) edge[i][k] = q[(i + 1) % 3][k] - q[i][k];
    cross(edge[0], edge[1], axis);
    if (axis_parts(q, axis, h)) return false;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double along[3] = {k == 0, k == 1, k == 2};
            cross(along, edge[i], axis);
            if (axis_parts(q, axis, h)) return false;
        }
    return true;
}

typedef struct marking {
    qw_env *env;
    qw_wrap_lattice *lattice;
    const qw_wrap_triangles *triangles;
    /* the triangles whose boxes meet a slab: uint32_t[slabs + 1], uint32_t[begin[slabs]]; list NULL: all may */
    uint32_t *begin, *list;
} marking;

/* What is done with cells. */
typedef struct each {
    bool (*on)(void *user, const uint32_t at[3]);
    void *user;
    const uint8_t *cell; /* of the lattice: those that are QW_CELL_MET are passed over; NULL: none */
} each;

/* Calls on(user, cell) for each of the cells low <= at < high that the triangle meets: they are halved until they are
 * one. False once `on` was. */
static bool each_cell(const qw_wrap_frame *f, const double p[3][3], const uint32_t low[3], const uint32_t high[3],
                      const each *e)
{
    double centre[3], half[3];
    int longest = 0;
    for (int k = 0; k < 3; k++) {
        centre[k] = 0.5 * ((double)low[k] + high[k]) * f->side, half[k] = 0.5 * ((double)high[k] - low[k]) * f->side;
        if (high[k] - low[k] > high[longest] - low[longest]) longest = k;
    }
    bool is_one = high[longest] - low[longest] == 1;
    if (is_one && e->cell && e->cell[qw_cell_index(f, low[0], low[1], low[2])] == QW_CELL_MET) return true;
    if (!qw_triangle_meets_box(p, centre, half, SLACK * f->side)) return true;
    if (is_one) return e->on(e->user, low);
    uint32_t middle = (low[longest] + high[longest]) / 2, end[3], begin[3];
    memcpy(end, high, sizeof end), memcpy(begin, low, sizeof begin);
    end[longest] = begin[longest] = middle;
    /* depth: the logarithm of the cells of the box */
    return each_cell(f, p, low, end, e) && each_cell(f, p, begin, high, e);
}

static bool mark(void *user, const uint32_t at[3])
{
    qw_wrap_lattice *l = user;
    l->cell[qw_cell_index(&l->frame, at[0], at[1], at[2])] = QW_CELL_MET;
    return true;
}

/* The cells in the box of a triangle: low <= at < high. */
static void cells_of(const qw_wrap_frame *f, const double p[3][3], uint32_t low[3], uint32_t high[3])
{
    for (int k = 0; k < 3; k++) {
        double lowest = fmin(p[0][k], fmin(p[1][k], p[2][k])), highest = fmax(p[0][k], fmax(p[1][k], p[2][k]));
        low[k] = (uint32_t)fmax(0, qw_floor(lowest / f->side - SLACK));
        high[k] = (uint32_t)fmin(f->cells[k], qw_floor(highest / f->side + SLACK) + 1);
    }
}

static void triangle_at(const marking *m, uint32_t t, double p[3][3])
{
    for (int i = 0; i < 3; i++)
        memcpy(p[i], m->triangles->position + 3 * (size_t)m->triangles->corner[3 * (size_t)t + (size_t)i], sizeof p[i]);
}

/* Counts the triangles of each slab, or lists them where there is a list. */
static uint64_t sort_into_slabs(const marking *m)
{
    uint64_t all = 0;
    for (uint32_t t = 0; t < m->triangles->count; t++) {
        double p[3][3];
        uint32_t low[3], high[3];
        if (t % LISTEN == 0) qw_break_silence(m->env);
        triangle_at(m, t, p);
        cells_of(&m->lattice->frame, (const double(*)[3])p, low, high);
        for (uint32_t s = low[2] / SLAB; low[2] < high[2] && s <= (high[2] - 1) / SLAB; s++, all++) {
            if (m->list) m->list[m->begin[s]] = t;
            m->begin[s]++;
        }
    }
    return all;
}

/* Sets begin and list. */
static void list_triangles(marking *m)
{
    uint32_t slabs = qw_block_count(m->lattice->frame.cells[2], SLAB), all = 0;
    m->begin = QW_NEW_ZERO(m->env, uint32_t, (size_t)slabs + 1);
    if (sort_into_slabs(m) > MOST_SLABS * (uint64_t)m->triangles->count) return;
    for (uint32_t s = 0; s <= slabs; s++) {
        uint32_t count = m->begin[s];
        m->begin[s] = all, all += count;
    }
    m->list = QW_NEW(m->env, uint32_t, all);
    sort_into_slabs(m);
    memmove(m->begin + 1, m->begin, slabs * sizeof *m->begin); /* each has become the next one's */
    m->begin[0] = 0;
}

static void mark_slab(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const marking *m = user;
    const qw_wrap_frame *f = &m->lattice->frame;
    const each marks = {mark, m->lattice, m->lattice->cell};
    uint32_t first = m->list ? m->begin[block] : 0, last = m->list ? m->begin[block + 1] : m->triangles->count;
    for (uint32_t i = first; i < last; i++) {
        double p[3][3];
        uint32_t low[3], high[3];
        if (i % 4096 == 0 && !qw_listen(m->env)) return;
        triangle_at(m, m->list ? m->list[i] : i, p);
        cells_of(f, (const double(*)[3])p, low, high);
        if (low[2] < begin) low[2] = begin;
        if (high[2] > end) high[2] = end;
        if (low[2] < high[2]) each_cell(f, (const double(*)[3])p, low, high, &marks);
    }
}

/* ---- floods */

typedef struct flood {
    qw_env *env;
    qw_wrap_lattice *lattice;
    uint32_t *stack;
    size_t capacity, count, done;
} flood;

static void push(flood *f, size_t cell)
{
    f->stack = qw_grow(f->env, f->stack, &f->capacity, f->count + 1, sizeof *f->stack);
    f->stack[f->count++] = (uint32_t)cell;
}

/* The steps to the six neighbours of a cell, in the order -x, x, -y, y, -z, z. */
static void steps_of(const qw_wrap_frame *f, ptrdiff_t step[6])
{
    step[1] = 1, step[3] = f->cells[0], step[5] = (ptrdiff_t)f->cells[0] * f->cells[1];
    for (int i = 0; i < 6; i += 2) step[i] = -step[i + 1];
}

static void place_of(const qw_wrap_frame *f, size_t cell, uint32_t at[3])
{
    at[0] = (uint32_t)(cell % f->cells[0]), cell /= f->cells[0];
    at[1] = (uint32_t)(cell % f->cells[1]), at[2] = (uint32_t)(cell / f->cells[1]);
}

/* Makes all that is joined across faces to a cell of kind `from` one of `to`; the cells and their extent. */
static size_t flood_from(flood *f, size_t first, uint8_t from, uint8_t to, uint32_t extent[3])
{
    const qw_wrap_frame *frame = &f->lattice->frame;
    uint8_t *cell = f->lattice->cell;
    ptrdiff_t step[6];
    uint32_t low[3], high[3], at[3];
    size_t count = 0;
    steps_of(frame, step);
    place_of(frame, first, low), place_of(frame, first, high);
    cell[first] = to, push(f, first);
    while (f->count > 0) {
        size_t c = f->stack[--f->count];
        place_of(frame, c, at);
        count++;
        if (++f->done % LISTEN == 0) qw_break_silence(f->env);
        for (int k = 0; k < 3; k++) {
            if (at[k] < low[k]) low[k] = at[k];
            if (at[k] > high[k]) high[k] = at[k];
        }
        for (int i = 0; i < 6; i++) {
            if (i % 2 ? at[i / 2] + 1 == frame->cells[i / 2] : at[i / 2] == 0) continue;
            size_t next = (size_t)((ptrdiff_t)c + step[i]);
            if (cell[next] == from) cell[next] = to, push(f, next);
        }
    }
    for (int k = 0; k < 3; k++) extent[k] = high[k] - low[k] + 1;
    return count;
}

/* ---- no two cells that touch at an edge or a corner alone */

/* Whether those of the eight cells around a corner whose bits are set are joined across faces. Bit i of the number of a
 * cell: it is the upper one along axis i. */
static bool is_joined(uint32_t set)
{
    uint32_t reached = set & (~set + 1), before = 0;
    while (reached != before) {
        before = reached;
        for (int i = 0; i < 8; i++)
            if (reached >> i & 1) reached |= set & (1u << (i ^ 1) | 1u << (i ^ 2) | 1u << (i ^ 4));
    }
    return reached == set;
}

typedef struct joining {
    flood *flood;
    bool good[256]; /* by the bits of the cells that are inside: the surface is a disc at their corner */
} joining;

/* The eight cells around the lower corner of a cell that has neighbours below it. */
static size_t around(const qw_wrap_frame *f, size_t cell, int i)
{
    size_t back = (i & 1 ? 0 : 1) + (i & 2 ? 0 : f->cells[0]) + (i & 4 ? 0 : (size_t)f->cells[0] * f->cells[1]);
    return cell - back;
}

static uint32_t bits_at(const qw_wrap_lattice *l, size_t cell)
{
    uint32_t bits = 0;
    for (int i = 0; i < 8; i++) bits |= (uint32_t)(l->cell[around(&l->frame, cell, i)] != QW_CELL_OUTSIDE) << i;
    return bits;
}

static bool has_eight(const qw_wrap_frame *f, size_t cell)
{
    uint32_t at[3];
    place_of(f, cell, at);
    return at[0] > 0 && at[1] > 0 && at[2] > 0;
}

/* Fills one outside cell at a corner that is no disc: one that makes it a disc, or else the first. */
static void fill_at(joining *j, size_t cell)
{
    qw_wrap_lattice *l = j->flood->lattice;
    uint32_t bits = bits_at(l, cell);
    int which = -1;
    if (j->good[bits]) return;
    for (int i = 7; i >= 0; i--)
        if (!(bits >> i & 1) && (which < 0 || j->good[bits | 1u << i] || !j->good[bits | 1u << which])) which = i;
    assert(which >= 0);
    size_t filled = around(&l->frame, cell, which);
    uint32_t at[3];
    place_of(&l->frame, filled, at);
    for (int k = 0; k < 3; k++) assert(at[k] > 0 && at[k] + 1 < l->frame.cells[k]);
    l->cell[filled] = QW_CELL_FREE;
    for (int i = 0; i < 8; i++) { /* the corners of that cell, this one among them */
        size_t corner = filled + (i & 1) + (i & 2 ? l->frame.cells[0] : 0) +
                        (i & 4 ? (size_t)l->frame.cells[0] * l->frame.cells[1] : 0);
        push(j->flood, corner);
    }
}

static void fill_until_manifold(flood *f)
{
    joining j = {.flood = f};
    for (uint32_t bits = 0; bits < 256; bits++) j.good[bits] = is_joined(bits) && is_joined(~bits & 255);
    for (size_t c = 0; c < f->lattice->count; c++) {
        if (c % LISTEN == 0) qw_break_silence(f->env);
        if (!has_eight(&f->lattice->frame, c)) continue;
        fill_at(&j, c);
        while (f->count > 0) fill_at(&j, f->stack[--f->count]);
    }
}

/* ---- what is outside, and clusters */

enum { CELL_REACHED = 3, CELL_COUNTED = 4 }; /* for a while, in the place of outside and of inside */

/* Whether there were any. */
static bool turn_cells(qw_wrap_lattice *l, uint8_t from, uint8_t to)
{
    bool any = false;
    for (size_t c = 0; c < l->count; c++)
        if (l->cell[c] == from) l->cell[c] = to, any = true;
    return any;
}

/* The steps to the cells of a ball of three across: a cube without its corners. */
static int ball_about(const qw_wrap_frame *f, ptrdiff_t ball[19])
{
    ptrdiff_t y = f->cells[0], z = y * (ptrdiff_t)f->cells[1];
    int count = 0;
    for (int i = 0; i < 27; i++) {
        int x[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        if (x[0] * x[1] * x[2] == 0) ball[count++] = x[0] + x[1] * y + x[2] * z;
    }
    return count;
}

/* Outside cells that are in no ball of them lie in gaps: they are inside, but for the rim of the lattice. Whether there
 * were any. */
static bool close_gaps(qw_env *env, qw_wrap_lattice *l)
{
    const uint32_t *across = l->frame.cells;
    ptrdiff_t ball[19];
    int count = ball_about(&l->frame, ball);
    for (uint32_t k = 0; k < across[2]; k++) {
        qw_break_silence(env);
        for (uint32_t j = 0; j < across[1]; j++)
            for (uint32_t i = 0; i < across[0]; i++) {
                uint8_t *c = l->cell + qw_cell_index(&l->frame, i, j, k);
                bool is_wide = i > 0 && j > 0 && k > 0 && i + 1 < across[0] && j + 1 < across[1] && k + 1 < across[2];
                if (!is_wide) *c = CELL_REACHED;
                for (int n = 0; n < count && is_wide; n++)
                    is_wide = c[ball[n]] == QW_CELL_OUTSIDE || c[ball[n]] == CELL_REACHED;
                for (int n = 0; n < count && is_wide; n++) c[ball[n]] = CELL_REACHED;
            }
    }
    bool any = turn_cells(l, QW_CELL_OUTSIDE, QW_CELL_FREE);
    turn_cells(l, CELL_REACHED, QW_CELL_OUTSIDE);
    return any;
}

/* Outside cells that filling has cut off are inside. */
static void reach_again(flood *f)
{
    uint32_t extent[3];
    flood_from(f, 0, QW_CELL_OUTSIDE, CELL_REACHED, extent);
    turn_cells(f->lattice, QW_CELL_OUTSIDE, QW_CELL_FREE);
    turn_cells(f->lattice, CELL_REACHED, QW_CELL_OUTSIDE);
}

/* Drops the clusters that are crumbs, unless all are. What is inside is QW_CELL_FREE from here on. */
static void drop_crumbs(flood *f)
{
    qw_wrap_lattice *l = f->lattice;
    uint32_t extent[3];
    uint32_t *crumb = NULL;
    size_t capacity = 0;
    turn_cells(l, QW_CELL_MET, QW_CELL_FREE);
    for (size_t c = 0; c < l->count; c++) {
        if (l->cell[c] != QW_CELL_FREE) continue;
        flood_from(f, c, QW_CELL_FREE, CELL_COUNTED, extent);
        if (extent[0] > CRUMB || extent[1] > CRUMB || extent[2] > CRUMB) {
            l->clusters++;
            continue;
        }
        crumb = qw_grow(f->env, crumb, &capacity, (size_t)l->crumbs + 1, sizeof *crumb);
        crumb[l->crumbs++] = (uint32_t)c;
    }
    turn_cells(l, CELL_COUNTED, QW_CELL_FREE);
    if (l->clusters == 0) l->clusters = l->crumbs, l->crumbs = 0;
    for (int64_t i = 0; i < l->crumbs; i++) flood_from(f, crumb[i], QW_CELL_FREE, QW_CELL_OUTSIDE, extent);
    qw_free(f->env, crumb);
}

qw_wrap_lattice qw_wrap_lattice_fill(qw_env *env, const qw_wrap_frame *frame, const qw_wrap_triangles *triangles,
                                     bool closes)
{
    qw_wrap_lattice l = {.frame = *frame, .count = (size_t)frame->cells[0] * frame->cells[1] * frame->cells[2]};
    uint32_t extent[3];
    l.cell = QW_NEW_ZERO(env, uint8_t, l.count);
    marking m = {env, &l, triangles, NULL, NULL};
    list_triangles(&m);
    qw_parallel(env, frame->cells[2], SLAB, mark_slab, &m);
    qw_free(env, m.begin), qw_free(env, m.list);
    qw_break_silence(env);
    flood f = {.env = env, .lattice = &l};
    flood_from(&f, 0, QW_CELL_FREE, QW_CELL_OUTSIDE, extent);
    if (closes) close_gaps(env, &l);
    do { /* ends: outside cells only become fewer */
        fill_until_manifold(&f);
        reach_again(&f);
    } while (closes && close_gaps(env, &l));
    drop_crumbs(&f);
    qw_free(env, f.stack);
    return l;
}

/* ---- what can be seen */

bool qw_cell_is_seen(const qw_wrap_lattice *l, const uint32_t at[3])
{
    const qw_wrap_frame *f = &l->frame;
    if (l->cell[qw_cell_index(f, at[0], at[1], at[2])] == QW_CELL_OUTSIDE) return false;
    uint32_t low[3], high[3];
    for (int k = 0; k < 3; k++)
        low[k] = at[k] > 0 ? at[k] - 1 : 0, high[k] = at[k] + 1 < f->cells[k] ? at[k] + 1 : at[k];
    for (uint32_t z = low[2]; z <= high[2]; z++)
        for (uint32_t y = low[1]; y <= high[1]; y++)
            for (uint32_t x = low[0]; x <= high[0]; x++)
                if (l->cell[qw_cell_index(f, x, y, z)] == QW_CELL_OUTSIDE) return true;
    return false;
}

bool qw_point_is_seen(const qw_wrap_lattice *l, const double point[3])
{
    uint32_t at[3];
    for (int k = 0; k < 3; k++) {
        double cell = qw_floor(point[k] / l->frame.side);
        if (!(cell >= 0 && cell < l->frame.cells[k])) return false;
        at[k] = (uint32_t)cell;
    }
    return qw_cell_is_seen(l, at);
}

typedef struct looking {
    const qw_wrap_lattice *lattice;
    int seen, hidden; /* flags: of the cells so far */
} looking;

static bool look(void *user, const uint32_t at[3])
{
    looking *l = user;
    if (qw_cell_is_seen(l->lattice, at)) l->seen = 1;
    else l->hidden = 1;
    return !(l->seen && l->hidden);
}

int qw_triangle_is_seen(const qw_wrap_lattice *l, const double p[3][3])
{
    uint32_t low[3], high[3];
    looking looks = {.lattice = l};
    cells_of(&l->frame, p, low, high);
    each_cell(&l->frame, p, low, high, &(each){look, &looks, NULL});
    return looks.seen && looks.hidden ? QW_SEEN_PARTLY : looks.seen ? QW_SEEN : QW_HIDDEN;
}
