#include "products/wrap/visible.h"

#include "products/measure/distance.h"
#include "geometry/triangulate.h"
#include "base/vec.h"
#include "products/wrap/wrap.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    LISTEN = 256,
    MOST_HALVINGS = 64, /* each bisection halves an area: a stack of so many holds all that are open */
    ROOM = 3            /* cells: an edge with so much room beyond it is one that can be seen */
};

typedef struct piece {
    uint32_t corner[3];
} piece;

typedef struct cutting {
    qw_env *env;
    const qw_wrap_lattice *lattice;
    double *unit, *position; /* double[vertices][3]: in units of the lattice, and in the coordinates of the input */
    uint32_t *corner;
    uint8_t *seen; /* uint8_t[faces]: QW_SEEN_ flags */
    size_t unit_capacity, position_capacity, corner_capacity, seen_capacity;
    uint32_t vertices, faces;
} cutting;

/* A new vertex in the middle between two. */
static uint32_t middle_of(cutting *c, uint32_t a, uint32_t b)
{
    uint32_t v = c->vertices++;
    if (v >= QW_NONE / 4) qw_fail(c->env, QW_TOO_LARGE, -1, "the visible part has too many vertices");
    c->unit = qw_grow(c->env, c->unit, &c->unit_capacity, 3 * ((size_t)v + 1), sizeof *c->unit);
    c->position = qw_grow(c->env, c->position, &c->position_capacity, 3 * ((size_t)v + 1), sizeof *c->position);
    for (size_t k = 0; k < 3; k++) {
        c->unit[3 * (size_t)v + k] = (c->unit[3 * (size_t)a + k] + c->unit[3 * (size_t)b + k]) / 2;
        c->position[3 * (size_t)v + k] = c->position[3 * (size_t)a + k] / 2 + c->position[3 * (size_t)b + k] / 2;
    }
    return v;
}

/* The corner from which the longest side runs, and its length. */
static uint32_t longest_side(const cutting *c, const piece *p, double *length)
{
    uint32_t longest = 0;
    *length = -1;
    for (uint32_t i = 0; i < 3; i++) {
        const double *a = c->unit + 3 * (size_t)p->corner[i], *b = c->unit + 3 * (size_t)p->corner[(i + 1) % 3];
        double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]}, l = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        if (l > *length) *length = l, longest = i;
    }
    return longest;
}

static bool middle_is_seen(const cutting *c, const piece *p)
{
    double middle[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) middle[k] += c->unit[3 * (size_t)p->corner[i] + k] / 3;
    return qw_point_is_seen(c->lattice, middle);
}

static bool is_outside(const qw_wrap_lattice *l, const double at[3])
{
    uint32_t cell[3];
    for (int k = 0; k < 3; k++) {
        if (!(at[k] >= 0 && at[k] < (double)l->frame.side * l->frame.cells[k])) return true;
        cell[k] = (uint32_t)(at[k] / l->frame.side);
    }
    return qw_cell_set_has(&l->outside, cell[0], cell[1], cell[2]);
}

/* Whether the outside is met within two cells of some place of a piece, along its normal (0) and against it (1). */
static void find_sides(const cutting *c, const piece *p, bool side[2])
{
    const double *a[3] = {c->unit + 3 * (size_t)p->corner[0], c->unit + 3 * (size_t)p->corner[1],
                          c->unit + 3 * (size_t)p->corner[2]};
    double u[3], v[3], n[3];
    for (int k = 0; k < 3; k++) u[k] = a[1][k] - a[0][k], v[k] = a[2][k] - a[0][k];
    qw_cross_doubles(u, v, n);
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    side[0] = side[1] = false;
    if (!(length > 0)) return;
    for (int half = 1; half <= 4; half++)       /* cells */
        for (int place = 0; place < 4; place++) /* half way to each corner, and the middle */
            for (int back = 0; back < 2; back++) {
                double at[3], far = (back ? -0.5 : 0.5) * half * c->lattice->frame.side / length;
                for (int k = 0; k < 3; k++) {
                    double middle = (a[0][k] + a[1][k] + a[2][k]) / 3;
                    at[k] = (place < 3 ? (middle + a[place][k]) / 2 : middle) + far * n[k];
                }
                side[back] |= is_outside(c->lattice, at);
            }
}

/* Whether the outside is met beyond the edge from corner i of a piece, as far up from the piece, or on either side, as
 * sideways over it. Where the piece goes on inside of other parts, or ends in them, it is not. */
static bool has_room(const cutting *c, const piece *p, uint32_t i, bool either)
{
    const double *a = c->unit + 3 * (size_t)p->corner[i], *b = c->unit + 3 * (size_t)p->corner[(i + 1) % 3],
                 *o = c->unit + 3 * (size_t)p->corner[(i + 2) % 3];
    double u[3], v[3], n[3], in[3], far = ROOM / sqrt(2) * c->lattice->frame.side;
    for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = o[k] - a[k];
    qw_cross_doubles(u, v, n), qw_cross_doubles(n, u, in);
    double height = sqrt(qw_dot_doubles(n, n)), width = sqrt(qw_dot_doubles(in, in));
    if (!(height > 0 && width > 0)) return false;
    for (int back = 0; back < 2; back++) {
        double at[3];
        for (int k = 0; k < 3; k++) at[k] = (a[k] + b[k]) / 2 + far * ((back ? -n[k] : n[k]) / height + in[k] / width);
        if ((either || !back) && is_outside(c->lattice, at)) return true;
    }
    return false;
}

/* Keeps a piece that is seen, turned to the side it is seen from, with what is seen beyond its sides. */
static void keep(cutting *c, const piece *p)
{
    bool side[2];
    uint32_t f = c->faces++, *to;
    find_sides(c, p, side);
    c->corner = qw_grow(c->env, c->corner, &c->corner_capacity, 3 * ((size_t)f + 1), sizeof *c->corner);
    c->seen = qw_grow(c->env, c->seen, &c->seen_capacity, (size_t)f + 1, sizeof *c->seen);
    to = c->corner + 3 * (size_t)f;
    memcpy(to, p->corner, sizeof p->corner);
    if (side[1] && !side[0]) to[1] = p->corner[2], to[2] = p->corner[1];
    c->seen[f] = side[0] && side[1] ? QW_SEEN_BOTH : 0;
    piece kept = {{to[0], to[1], to[2]}};
    for (uint32_t i = 0; i < 3; i++)
        if (has_room(c, &kept, i, side[0] == side[1])) c->seen[f] |= QW_SEEN_BEYOND << i;
}

/* Bisects a triangle until its pieces are seen as a whole, or not at all, or are no longer than a cell. */
static void cut(cutting *c, piece whole)
{
    piece stack[MOST_HALVINGS];
    int count = 0;
    stack[count++] = whole;
    while (count > 0) {
        piece p = stack[--count];
        double at[3][3], length;
        uint32_t from = longest_side(c, &p, &length);
        for (int i = 0; i < 3; i++) memcpy(at[i], c->unit + 3 * (size_t)p.corner[i], sizeof at[i]);
        assert(count < MOST_HALVINGS);
        int seen = qw_triangle_is_seen(c->lattice, (const double(*)[3])at);
        if (seen == QW_SEEN_PARTLY && length > c->lattice->frame.side && count + 2 <= MOST_HALVINGS) {
            uint32_t a = p.corner[from], b = p.corner[(from + 1) % 3], o = p.corner[(from + 2) % 3];
            uint32_t m = middle_of(c, a, b);
            stack[count++] = (piece){{m, b, o}}, stack[count++] = (piece){{a, m, o}};
        } else if (seen == QW_SEEN || (seen == QW_SEEN_PARTLY && middle_is_seen(c, &p))) {
            keep(c, &p);
        }
    }
}

qw_clean_input qw_visible_part(qw_env *env, const qw_clean_input *input, double distance, uint8_t **seen)
{
    qw_scope_begin(env);
    qw_filled f = qw_wrap_fill(env, input, distance);
    uint32_t n = input->vertex_count;
    cutting c = {.env = env, .lattice = &f.lattice, .vertices = n};
    c.unit = qw_grow(env, NULL, &c.unit_capacity, 3 * (size_t)n, sizeof *c.unit);
    c.position = qw_grow(env, NULL, &c.position_capacity, 3 * (size_t)n, sizeof *c.position);
    memcpy(c.unit, f.triangles.position, 3 * (size_t)n * sizeof *c.unit);
    memcpy(c.position, input->position, 3 * (size_t)n * sizeof *c.position);
    for (uint32_t t = 0; t < f.triangles.count; t++) {
        piece p;
        if (t % LISTEN == 0) qw_heartbeat(env);
        memcpy(p.corner, f.triangles.corner + 3 * (size_t)t, sizeof p.corner);
        cut(&c, p);
    }
    uint32_t *begin = QW_NEW(env, uint32_t, (size_t)c.faces + 1);
    for (uint32_t i = 0; i <= c.faces; i++) begin[i] = 3 * i;
    qw_keep(env, c.position), qw_keep(env, c.corner), qw_keep(env, begin);
    qw_keep(env, c.seen);
    if (seen) *seen = c.seen;
    qw_scope_end(env);
    return (qw_clean_input){.vertex_count = c.vertices,
                            .face_count = c.faces,
                            .position = c.position,
                            .face_begin = begin,
                            .corner = c.corner};
}
