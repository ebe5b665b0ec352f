#include "products/wrap/wrap_lattice.h"

#include "base/elementary.h"
#include "base/vec.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    MARGIN = 4,       /* cells about the box */
    SLAB = 4,         /* layers that one task marks */
    FRAGMENT = 5,     /* cells: a cluster no larger than that in any direction is a fragment */
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

/* By separating axes: those of the box, the triangle's normal, and their products with its edges. */
static bool triangle_meets_box(const double p[3][3], const double centre[3], const double half[3], double slack)
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
    qw_cross_doubles(edge[0], edge[1], axis);
    if (axis_parts(q, axis, h)) return false;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double along[3] = {k == 0, k == 1, k == 2};
            qw_cross_doubles(along, edge[i], axis);
            if (axis_parts(q, axis, h)) return false;
        }
    return true;
}

typedef struct marking {
    qw_env *env;
    const qw_wrap_frame *frame;
    const qw_wrap_triangles *triangles;
    qw_cell_set met;
    /* the triangles whose boxes meet a slab: uint32_t[slabs + 1], uint32_t[begin[slabs]]; list NULL: all may */
    uint32_t *begin, *list;
} marking;

/* What is done with cells. */
typedef struct each {
    bool (*on)(void *user, const uint32_t at[3]);
    void *user;
    const qw_cell_set *met; /* those are passed over; NULL: none */
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
    if (is_one && e->met && qw_cell_set_has(e->met, low[0], low[1], low[2])) return true;
    if (!triangle_meets_box(p, centre, half, SLACK * f->side)) return true;
    if (is_one) return e->on(e->user, low);
    uint32_t middle = (low[longest] + high[longest]) / 2, end[3], begin[3];
    memcpy(end, high, sizeof end), memcpy(begin, low, sizeof begin);
    end[longest] = begin[longest] = middle;
    /* depth: the logarithm of the cells of the box */
    return each_cell(f, p, low, end, e) && each_cell(f, p, begin, high, e);
}

static bool mark(void *user, const uint32_t at[3])
{
    qw_cell_set_add(user, at[0], at[1], at[2]);
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
        if (t % LISTEN == 0) qw_heartbeat(m->env);
        triangle_at(m, t, p);
        cells_of(m->frame, (const double(*)[3])p, low, high);
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
    uint32_t slabs = qw_block_count(m->frame->cells[2], SLAB), all = 0;
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

/* Marks the cells of layers begin .. end that triangles meet. */
static void mark_slab(void *user, uint32_t begin, uint32_t end)
{
    marking *m = user;
    const qw_wrap_frame *f = m->frame;
    const each marks = {mark, &m->met, &m->met};
    uint32_t slab = begin / SLAB, first = m->list ? m->begin[slab] : 0,
             last = m->list ? m->begin[slab + 1] : m->triangles->count;
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

/* Those that a triangle meets. A slab is a row of words, so that no two tasks write into one. */
static qw_cell_set met_cells(qw_env *env, const qw_wrap_frame *frame, const qw_wrap_triangles *triangles)
{
    marking m = {env, frame, triangles, qw_cell_set_new(env, frame->cells), NULL, NULL};
    list_triangles(&m);
    qw_parallel(env, frame->cells[2], SLAB, mark_slab, &m);
    qw_heartbeat(env);
    qw_free(env, m.begin), qw_free(env, m.list);
    return m.met;
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

typedef struct corner {
    uint32_t at[3]; /* the cell whose lower corner it is: none of these is 0 */
} corner;

typedef struct joining {
    qw_env *env;
    qw_cell_set *outside;
    bool good[256]; /* by the bits of the cells that are inside: the surface is a disc at their corner */
    corner *stack;  /* that have to be looked at again */
    size_t capacity, count;
} joining;

static uint32_t bits_at(const qw_cell_set *outside, const corner *c)
{
    uint32_t bits = 0, x = c->at[0] - 1, y = c->at[1] - 1, z = c->at[2] - 1;
    for (uint32_t i = 0; i < 8; i++)
        bits |= (uint32_t)!qw_cell_set_has(outside, x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)) << i;
    return bits;
}

/* Fills one outside cell at a corner that is no disc: one that makes it a disc, or else the first. */
static void fill_at(joining *j, const corner *c)
{
    uint32_t bits = bits_at(j->outside, c);
    int which = -1;
    if (j->good[bits]) return;
    for (int i = 7; i >= 0; i--)
        if (!(bits >> i & 1) && (which < 0 || j->good[bits | 1u << i] || !j->good[bits | 1u << which])) which = i;
    assert(which >= 0);
    uint32_t filled[3];
    for (int k = 0; k < 3; k++) {
        filled[k] = c->at[k] - 1 + ((uint32_t)which >> k & 1);
        assert(filled[k] > 0 && filled[k] + 1 < j->outside->across[k]);
    }
    qw_cell_set_remove(j->outside, filled[0], filled[1], filled[2]);
    j->stack = qw_grow(j->env, j->stack, &j->capacity, j->count + 8, sizeof *j->stack);
    for (uint32_t i = 0; i < 8; i++) /* the corners of that cell, this one among them */
        j->stack[j->count++] = (corner){{filled[0] + (i & 1), filled[1] + (i >> 1 & 1), filled[2] + (i >> 2)}};
}

/* The lower corners of a word's cells around which not all of the eight are alike. */
static uint64_t mixed_corners(const qw_cell_set *c, uint32_t w, uint32_t y, uint32_t z)
{
    uint64_t any = 0, all = ~any;
    for (uint32_t i = 0; i < 4; i++) {
        const uint64_t *row = qw_cell_set_row(c, y - (i & 1), z - (i >> 1));
        uint64_t below = row[w] << 1 | (w > 0 ? row[w - 1] >> 63 : 0);
        any |= row[w] | below, all &= row[w] & below;
    }
    return w > 0 ? any & ~all : any & ~all & ~(uint64_t)1;
}

/* Corners that fill others become good with these, so only those that are mixed to begin with are asked. */
static void fill_until_manifold(qw_env *env, qw_cell_set *outside)
{
    joining j = {.env = env, .outside = outside};
    for (uint32_t bits = 0; bits < 256; bits++) j.good[bits] = is_joined(bits) && is_joined(~bits & 255);
    for (uint32_t z = 1; z < outside->across[2]; z++) {
        qw_heartbeat(env);
        for (uint32_t y = 1; y < outside->across[1]; y++)
            for (uint32_t w = 0; w < outside->words; w++)
                for (uint64_t rest = mixed_corners(outside, w, y, z); rest; rest &= rest - 1) {
                    uint32_t x = w * 64 + (uint32_t)__builtin_ctzll(rest);
                    if (x >= outside->across[0]) break;
                    fill_at(&j, &(corner){{x, y, z}});
                    while (j.count > 0) {
                        corner c = j.stack[--j.count]; /* as the stack may move */
                        fill_at(&j, &c);
                    }
                }
    }
    qw_free(env, j.stack);
}

/* ---- what is outside, and clusters */

/* Outside cells that filling has cut off are inside. */
static void reach_again(qw_flood *f, qw_cell_set *outside)
{
    const uint32_t rim[3] = {0, 0, 0};
    uint32_t extent[3];
    qw_cell_set reached = qw_cell_set_new(f->env, outside->across);
    qw_flood_from(f, outside, rim, &reached, extent);
    qw_free(f->env, outside->row);
    *outside = reached;
}

/* Drops the clusters that are fragments, unless all are. */
static void drop_fragments(qw_flood *f, qw_wrap_lattice *l)
{
    qw_cell_set inside = qw_cell_set_others(f->env, &l->outside), counted = qw_cell_set_new(f->env, inside.across);
    corner *fragment = NULL;
    size_t capacity = 0;
    uint32_t extent[3];
    for (uint32_t z = 0; z < inside.across[2]; z++)
        for (uint32_t y = 0; y < inside.across[1]; y++)
            for (uint32_t w = 0; w < inside.words; w++)
                for (uint64_t rest; (rest = qw_cell_set_row(&inside, y, z)[w]);) {
                    corner first = {{w * 64 + (uint32_t)__builtin_ctzll(rest), y, z}};
                    qw_flood_from(f, &inside, first.at, &counted, extent);
                    if (extent[0] > FRAGMENT || extent[1] > FRAGMENT || extent[2] > FRAGMENT) {
                        l->clusters++;
                        continue;
                    }
                    fragment = qw_grow(f->env, fragment, &capacity, (size_t)l->fragments + 1, sizeof *fragment);
                    fragment[l->fragments++] = first;
                }
    if (l->clusters == 0) l->clusters = l->fragments, l->fragments = 0;
    for (int64_t i = 0; i < l->fragments; i++) qw_flood_from(f, &counted, fragment[i].at, &l->outside, extent);
    assert(l->fragments == 0 || l->clusters > 0);
    qw_free(f->env, fragment), qw_free(f->env, inside.row), qw_free(f->env, counted.row);
}

qw_wrap_lattice qw_wrap_lattice_fill(qw_env *env, const qw_wrap_frame *frame, const qw_wrap_triangles *triangles,
                                     bool closes)
{
    const uint32_t rim[3] = {0, 0, 0};
    qw_wrap_lattice l = {.frame = *frame, .count = (size_t)frame->cells[0] * frame->cells[1] * frame->cells[2]};
    uint32_t extent[3];
    l.outside = qw_cell_set_new(env, frame->cells);
    qw_cell_set met = met_cells(env, frame, triangles), free_cells = qw_cell_set_others(env, &met);
    qw_flood f = qw_flood_begin(env, &met);
    qw_flood_from(&f, &free_cells, rim, &l.outside, extent);
    qw_free(env, met.row), qw_free(env, free_cells.row);
    if (closes) qw_cell_set_open(env, &l.outside);
    do { /* ends: outside cells only become fewer */
        fill_until_manifold(env, &l.outside);
        reach_again(&f, &l.outside);
    } while (closes && qw_cell_set_open(env, &l.outside));
    drop_fragments(&f, &l);
    qw_flood_end(&f);
    return l;
}

/* ---- what can be seen */

/* Whether a cell is not outside, but touches one that is. */
static bool cell_is_seen(const qw_wrap_lattice *l, const uint32_t at[3])
{
    const qw_wrap_frame *f = &l->frame;
    if (qw_cell_set_has(&l->outside, at[0], at[1], at[2])) return false;
    uint32_t low[3], high[3];
    for (int k = 0; k < 3; k++)
        low[k] = at[k] > 0 ? at[k] - 1 : 0, high[k] = at[k] + 1 < f->cells[k] ? at[k] + 1 : at[k];
    for (uint32_t z = low[2]; z <= high[2]; z++)
        for (uint32_t y = low[1]; y <= high[1]; y++)
            for (uint32_t x = low[0]; x <= high[0]; x++)
                if (qw_cell_set_has(&l->outside, x, y, z)) return true;
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
    return cell_is_seen(l, at);
}

typedef struct looking {
    const qw_wrap_lattice *lattice;
    int seen, hidden; /* flags: of the cells so far */
} looking;

static bool look(void *user, const uint32_t at[3])
{
    looking *l = user;
    if (cell_is_seen(l->lattice, at)) l->seen = 1;
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
