#include "remesh/meetings/layout.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A triangle has an area where the cross product of two sides is at least this share of their squares. */
static const double FLAT = 1e-4;
/* Triangles that a line crosses; edges without length one after the other to a cone. */
enum { MOST_CROSSED = 4096, MOST_HOPS = 8 };

/* ---- making and copying */

qw_layout qw_layout_make(qw_env *env, uint32_t faces)
{
    assert(faces > 0 && faces < QW_NONE / 3);
    uint32_t edges = 2 * faces, vertices = faces;
    qw_layout l = {.face_room = faces, .edge_room = edges, .vertex_room = vertices};
    qw_complex *c = &l.complex;
    c->edge = QW_NEW(env, uint32_t, 3 * (size_t)faces), c->rot = QW_NEW(env, uint8_t, 3 * (size_t)faces);
    c->side = QW_NEW(env, uint32_t, 2 * (size_t)edges), c->d = QW_NEW(env, qw_int2, edges);
    c->real = QW_NEW(env, qw_real2, edges), c->fixed = QW_NEW(env, uint8_t, edges);
    c->weight = QW_NEW(env, float, edges);
    l.corner = QW_NEW(env, uint32_t, 3 * (size_t)faces);
    l.number = QW_NEW_ZERO(env, uint32_t, 3 * (size_t)faces);
    l.valence = QW_NEW(env, uint32_t, vertices), l.held = QW_NEW(env, uint32_t, vertices);
    l.is_end = QW_NEW(env, uint8_t, vertices);
    l.crossing = QW_NEW(env, qw_crossing, 3 * (size_t)faces);
    return l;
}

static void make_step_room(qw_env *env, qw_layout *l, uint32_t count)
{
    if (count <= l->step_room) return;
    uint32_t room = 2 * count + 256;
    l->step = qw_resize(env, l->step, room, sizeof *l->step);
    l->step_room = room;
}

static void copy_complex(const qw_complex *from, qw_complex *to)
{
    size_t halves = 3 * (size_t)from->face_count, edges = from->edge_count;
    memcpy(to->edge, from->edge, halves * sizeof *to->edge), memcpy(to->rot, from->rot, halves);
    memcpy(to->side, from->side, 2 * edges * sizeof *to->side), memcpy(to->d, from->d, edges * sizeof *to->d);
    memcpy(to->real, from->real, edges * sizeof *to->real), memcpy(to->fixed, from->fixed, edges);
    memcpy(to->weight, from->weight, edges * sizeof *to->weight);
    to->face_count = from->face_count, to->edge_count = from->edge_count;
}

void qw_layout_copy(qw_env *env, const qw_layout *from, qw_layout *to)
{
    assert(from->complex.face_count <= to->face_room && from->complex.edge_count <= to->edge_room);
    copy_complex(&from->complex, &to->complex);
    memcpy(to->corner, from->corner, 3 * (size_t)from->complex.face_count * sizeof *to->corner);
    to->vertex_count = from->vertex_count, to->step_count = 0;
    make_step_room(env, to, from->step_count);
    if (from->step_count > 0) memcpy(to->step, from->step, from->step_count * sizeof *to->step);
    to->step_count = from->step_count;
}

void qw_layout_fill(qw_layout *l, const qw_component *component, const qw_real2 *real, const qw_int2 *d)
{
    const qw_complex *from = &component->decimated.complex;
    assert(from->face_count <= l->face_room && from->edge_count <= l->edge_room);
    assert(component->vertex_count <= l->vertex_room);
    copy_complex(from, &l->complex);
    memcpy(l->corner, component->decimated.corner, 3 * (size_t)from->face_count * sizeof *l->corner);
    memcpy(l->complex.d, d, from->edge_count * sizeof *d);
    memcpy(l->complex.real, real, from->edge_count * sizeof *real);
    l->vertex_count = component->vertex_count, l->step_count = 0;
}

void qw_layout_undo(const qw_layout *l, qw_int2 *d)
{
    assert(l->step_count == 0 || d);
    memcpy(d, l->complex.d, l->complex.edge_count * sizeof *d);
    qw_take_back(l->step, l->step_count, d);
}

/* ---- changes */

static void record(qw_env *env, qw_layout *l, qw_decimation_step step)
{
    make_step_room(env, l, l->step_count + 1);
    l->step[l->step_count++] = step;
}

/* Half-edge `to` takes the place of `from` on its edge. */
static void put_half(qw_layout *l, uint32_t from, uint32_t to, uint32_t edge, unsigned rot, uint32_t tail)
{
    assert(edge < l->complex.edge_count);
    uint32_t *side = l->complex.side + 2 * (size_t)edge;
    side[side[0] == from ? 0 : 1] = to;
    l->complex.edge[to] = edge, l->complex.rot[to] = (uint8_t)(rot & 3u), l->corner[to] = tail;
}

/* Edge a-b becomes c-d: triangles a b c and b a d become c d b and d c a. */
bool qw_layout_flip(qw_env *env, qw_layout *l, uint32_t h)
{
    assert(h < 3 * l->complex.face_count);
    qw_complex *c = &l->complex;
    uint32_t e = c->edge[h], t = qw_across(c, h);
    if (t == QW_NONE || c->fixed[e] || h / 3 == t / 3) return false;
    uint32_t hn = qw_next(h), hp = qw_prev(h), tn = qw_next(t), tp = qw_prev(t);
    uint32_t va = l->corner[h], vb = l->corner[hn], vc = l->corner[hp], vd = l->corner[tp];
    uint32_t bc = c->edge[hn], ca = c->edge[hp], ad = c->edge[tn], db = c->edge[tp];
    if (bc == ca || bc == ad || bc == db || ca == ad || ca == db || ad == db) return false;
    unsigned turn = qw_turn_across(c, 0, h, t), r_ab = c->rot[h], r_ad = c->rot[tn] + turn, r_db = c->rot[tp] + turn;
    qw_double2 to_d = qw_turned2(turn, qw_along(c, tn)), from_d = qw_turned2(turn, qw_along(c, tp));
    qw_double2 cd = qw_plus2(qw_along(c, hp), to_d);
    double least = FLAT * (qw_square2(qw_along(c, h)) + qw_square2(cd));
    if (fmin(qw_cross2(cd, from_d), qw_cross2(cd, to_d)) <= least) return false;
    qw_int2 steps = qw_int2_add(qw_steps_along(c, hp), qw_turn(turn, qw_steps_along(c, tn)));
    record(env, l,
           (qw_decimation_step){e, {ad, db}, {(uint8_t)((r_ad + 4u - r_ab) & 3u), (uint8_t)((r_db + 4u - r_ab) & 3u)}});
    unsigned r_bc = c->rot[hn], r_ca = c->rot[hp];
    put_half(l, tp, hn, db, r_db, vd), put_half(l, hn, hp, bc, r_bc, vb);
    put_half(l, hp, tn, ca, r_ca, vc), put_half(l, tn, tp, ad, r_ad, va);
    c->real[e] = (qw_real2){(float)cd.x, (float)cd.y}, c->d[e] = steps;
    c->rot[h] = 0, c->rot[t] = 2;
    l->corner[h] = vc, l->corner[t] = vd;
    return true;
}

/* The new edge e from the vertex on h's edge to the apex of h's triangle, whose other half is `far` in the new face. */
static void put_spoke(qw_layout *l, uint32_t e, uint32_t near, uint32_t far, uint32_t vertex, uint32_t apex,
                      qw_double2 real, qw_int2 steps)
{
    qw_complex *c = &l->complex;
    c->edge[near] = c->edge[far] = e;
    c->side[2 * e] = near, c->side[2 * e + 1] = far;
    c->real[e] = (qw_real2){(float)real.x, (float)real.y}, c->d[e] = steps, c->fixed[e] = 0;
    c->rot[near] = 0, c->rot[far] = 2;
    l->corner[near] = vertex, l->corner[far] = apex;
}

static qw_int2 negative(qw_int2 a) { return (qw_int2){-a.x, -a.y}; }

/* Triangles a b c and b a d become a p c, p b c, p a d and b p d. */
bool qw_layout_split(qw_env *env, qw_layout *l, uint32_t h, double share, qw_int2 steps)
{
    assert(h < 3 * l->complex.face_count && share > 0 && share < 1);
    qw_complex *c = &l->complex;
    uint32_t e = c->edge[h], t = qw_across(c, h), p = l->vertex_count, pb = c->edge_count;
    if (t == QW_NONE || h / 3 == t / 3 || p == l->vertex_room || c->face_count + 2 > l->face_room ||
        pb + 3 > l->edge_room)
        return false;
    uint32_t hn = qw_next(h), hp = qw_prev(h), tn = qw_next(t), tp = qw_prev(t);
    uint32_t h2 = 3 * c->face_count, t2 = h2 + 3, b = l->corner[hn];
    qw_int2 whole = c->d[e], first = qw_turn((4u - c->rot[h]) & 3u, steps);
    if (c->fixed[e] & QW_FIXED_X) first.x = 0;
    if (c->fixed[e] & QW_FIXED_Y) first.y = 0;
    qw_real2 real = c->real[e];
    record(env, l, (qw_decimation_step){e, {e, pb}, {0, 0}});
    c->face_count += 2, c->edge_count += 3, l->vertex_count++;
    c->d[e] = first, c->d[pb] = qw_int2_sub(whole, first), c->fixed[pb] = c->fixed[e];
    c->real[e] = (qw_real2){real.x * (float)share, real.y * (float)share};
    c->real[pb] = (qw_real2){real.x - c->real[e].x, real.y - c->real[e].y};
    put_half(l, hn, h2 + 1, c->edge[hn], c->rot[hn], b);
    put_half(l, tp, t2 + 2, c->edge[tp], c->rot[tp], l->corner[tp]);
    c->edge[h2] = c->edge[t2] = pb, c->side[2 * pb] = h2, c->side[2 * pb + 1] = t2;
    c->rot[h2] = c->rot[h], c->rot[t2] = c->rot[t];
    l->corner[h2] = l->corner[t] = p, l->corner[t2] = b;
    put_spoke(l, pb + 1, hn, h2 + 2, p, l->corner[hp], qw_turned2(2, qw_plus2(qw_along(c, h), qw_along(c, hp))),
              negative(qw_int2_add(qw_steps_along(c, h), qw_steps_along(c, hp))));
    put_spoke(l, pb + 2, t2 + 1, tp, p, l->corner[t2 + 2], qw_plus2(qw_along(c, t), qw_along(c, tn)),
              qw_int2_add(qw_steps_along(c, t), qw_steps_along(c, tn)));
    return true;
}

/* ---- lines */

/* Numbers the half-edges around v from `first` on. */
static void number_vertex(qw_layout *l, uint32_t v, uint32_t first)
{
    const qw_complex *c = &l->complex;
    uint32_t n = 0, h = first;
    l->valence[v] = l->held[v] = 0;
    do {
        l->number[h] = n;
        uint32_t in = qw_prev(h), t = qw_across(c, in);
        unsigned by = (qw_quarter_of(qw_turned2(2, qw_along(c, in))) - qw_quarter_of(qw_along(c, h))) & 3u;
        if (by == 3 || t == QW_NONE) return; /* an inverted triangle, or the boundary */
        n += by, h = t;
    } while (h != first && n < QW_MOST_LINES);
    if (h != first || n == 0 || n >= QW_MOST_LINES) return;
    do {
        if (c->fixed[c->edge[h]]) l->held[v] |= 1u << l->number[h] % n;
        h = qw_across(c, qw_prev(h));
    } while (h != first);
    if (n != 4) l->valence[v] = n;
}

void qw_layout_number(qw_layout *l)
{
    for (uint32_t v = 0; v < l->vertex_count; v++) l->valence[v] = QW_NONE;
    for (uint32_t h = 0; h < 3 * l->complex.face_count; h++)
        if (l->valence[l->corner[h]] == QW_NONE) number_vertex(l, l->corner[h], h);
}

static void note_crossings(qw_layout *l)
{
    const qw_complex *c = &l->complex;
    for (uint32_t h = 0; h < 3 * c->face_count; h++) {
        uint32_t t = qw_across(c, h);
        l->crossing[h] = (qw_crossing){qw_steps_along(c, h), t, t == QW_NONE ? 0 : qw_turn_across(c, 0, h, t)};
    }
}

/* Cones, and what edges without length join to them. */
static void find_ends(qw_layout *l)
{
    for (uint32_t v = 0; v < l->vertex_count; v++) l->is_end[v] = l->valence[v] > 0;
    bool more = true;
    for (int hops = 0; hops < MOST_HOPS && more; hops++) {
        more = false;
        for (uint32_t h = 0; h < 3 * l->complex.face_count; h++) {
            if (!qw_int2_is_zero(l->crossing[h].steps)) continue;
            uint32_t v = l->corner[h], w = l->corner[qw_next(h)];
            if (l->is_end[v] != l->is_end[w]) l->is_end[v] = l->is_end[w] = 1, more = true;
        }
    }
}

/* Length of the line that leaves the corner of `start` into its triangle by `quarter` of its frame. It passes a vertex
   that is no cone on the right. */
static int32_t line_length(const qw_layout *l, uint32_t start, unsigned quarter, int32_t most)
{
    const qw_crossing *crossing = l->crossing;
    unsigned turn = (4u - quarter) & 3u;
    qw_int2 right = qw_turn(turn, crossing[start].steps),
            left = qw_turn((turn + 2u) & 3u, crossing[qw_prev(start)].steps);
    if (right.y == 0 && right.x > 0 && l->is_end[l->corner[qw_next(start)]]) return right.x < most ? right.x : most;
    uint32_t h = qw_next(start);
    for (uint32_t crossed = 0; crossed < MOST_CROSSED && (right.x < most || left.x < most); crossed++) {
        uint32_t t = crossing[h].twin;
        if (t == QW_NONE) {
            int32_t x = right.x > left.x ? right.x : left.x;
            return x < 1 ? 1 : x < most ? x : most;
        }
        turn = (turn + crossing[h].turn) & 3u;
        qw_int2 apex = qw_int2_add(right, qw_turn(turn, crossing[qw_next(t)].steps));
        if (apex.y == 0 && apex.x > 0 && l->is_end[l->corner[qw_prev(t)]]) return apex.x < most ? apex.x : most;
        if (apex.y > 0) left = apex, h = qw_next(t);
        else right = apex, h = qw_prev(t);
    }
    return most;
}

/* Measures the lines that leave by the corner of h. In the real layout these are the quarter turns nearest to its sides
   and those between; `beyond` more on either side are tried, as integers turn short edges. length: of each line by its
   number around the vertex, `most` where it is longer; only those below 0, not found so far, are looked for, and a line
   is written where the integers have it within this corner. Returns the sum of what was written. */
static int64_t measure_corner(const qw_layout *l, uint32_t h, unsigned beyond, int32_t most, int32_t *length)
{
    int64_t sum = 0;
    const qw_complex *c = &l->complex;
    uint32_t valence = l->valence[l->corner[h]];
    unsigned first = qw_quarter_of(qw_along(c, h)),
             by = (qw_quarter_of(qw_turned2(2, qw_along(c, qw_prev(h)))) - first) & 3u;
    if (by == 3) return 0;
    for (unsigned i = 0; i <= by + 2 * beyond; i++) {
        unsigned quarter = (first + 4u + i - beyond) & 3u, turn = (4u - quarter) & 3u;
        int32_t *to = &length[(l->number[h] + valence + i - beyond) % valence];
        qw_int2 right = qw_turn(turn, l->crossing[h].steps),
                left = qw_turn((turn + 2u) & 3u, l->crossing[qw_prev(h)].steps);
        if (*to < 0 && right.y <= 0 && left.y > 0) sum += *to = line_length(l, h, quarter, most);
    }
    return sum;
}

int64_t qw_layout_measure(qw_layout *l, int32_t most, int64_t most_sum, int32_t *length)
{
    assert(most >= 0 && length);
    note_crossings(l);
    find_ends(l);
    for (size_t i = 0; i < QW_MOST_LINES * (size_t)l->vertex_count; i++) length[i] = -1;
    int64_t sum = 0;
    for (unsigned beyond = 0; beyond < 2; beyond++) /* integers turn short edges */
        for (uint32_t h = 0; h < 3 * l->complex.face_count && sum <= most_sum; h++)
            if (l->valence[l->corner[h]])
                sum += measure_corner(l, h, beyond, most, length + QW_MOST_LINES * (size_t)l->corner[h]);
    for (uint32_t v = 0; v < l->vertex_count && sum <= most_sum; v++)
        for (uint32_t i = 0; i < l->valence[v]; i++) {
            int32_t *x = &length[QW_MOST_LINES * (size_t)v + i];
            if (*x < 0) sum += *x = 1; /* all around it has no length: it is one with another cone */
        }
    return sum;
}
