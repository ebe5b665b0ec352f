#include "remesh/offsets/frames.h"

#include "base/mechanisms.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Costs of a sector: for each quarter turn too many or too few, and for having none. A quarter turn that is left on
   a vertex beside costs 1. */
static const float OFF = 0.75f, LOST = 2;
/* A sector that is off by no more quarters is left alone: at 135 degrees one quarter and two are equally good, and
   other corners of the same chamfer may decide. */
static const float ENOUGH = 0.7f;

typedef struct framing {
    qw_offset_mesh *m;
    const uint8_t *turn; /* uint8_t[edge_count] */
    int8_t *index_of;    /* int8_t[face_count]: index of each triangle, the quarter turns that its cone lacks */
    uint8_t *cone;       /* uint8_t[face_count]: corner on which they are laid */
} framing;

/* Quarter turns from the frame of the head of h to its tail's. */
static unsigned turn_back(const framing *g, uint32_t h)
{
    assert(h < 3 * g->m->face_count);
    uint32_t e = g->m->edge[h];
    return g->m->half[e] == h ? g->turn[e] : (4u - g->turn[e]) & 3u;
}

/* A loop around a cone of four quarter turns has length 0, however wide the surface is there, and around one of
   three next to that: each quarter turn beyond MOST_STACKED costs more than all else. */
enum { MOST_STACKED = 2, QUARTER_TOO_MANY = 30 };

/* The corner of a singular triangle on which its turn is laid: preferably a free vertex where it cancels another
   turn; beyond MOST_STACKED quarters only where there is no other. */
static uint32_t choose_cone(const qw_offset_mesh *m, uint32_t f, int turn)
{
    assert(f < m->face_count);
    uint32_t best = 0;
    int best_score = -1000;
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t v = m->corner[3 * f + i];
        int there = m->index[v], after = there + turn;
        int score = -10 * ((after < 0 ? -after : after) - (there < 0 ? -there : there));
        if (m->constraint[v]) score -= 5 * m->constraint[v];
        if (after > MOST_STACKED) score -= QUARTER_TOO_MANY * (after - MOST_STACKED);
        if (score > best_score) best_score = score, best = i;
    }
    return best;
}

/* Frames of one triangle with all of its turn at corner c: a = c + 1 has the triangle's frame, b = c + 2 is one step
 * from a. */
static void lay_turn(framing *g, uint32_t f, uint32_t c)
{
    assert(f < g->m->face_count && c < 3);
    qw_offset_mesh *m = g->m;
    uint32_t hc = 3 * f + c, ha = qw_next(hc), hb = qw_next(ha);
    unsigned b_to_a = turn_back(g, ha), c_to_a = 4u - turn_back(g, hc), c_to_b = turn_back(g, hb);
    struct {
        uint32_t h;
        unsigned tail_turn, head_turn; /* from the frame of the tail / head of h to the triangle's, along this edge */
    } row[3] = {{hc, c_to_a, 0}, {ha, 0, b_to_a}, {hb, b_to_a, c_to_b + b_to_a}};
    for (int i = 0; i < 3; i++) {
        uint32_t h = row[i].h;
        bool forward = m->half[m->edge[h]] == h;
        m->rot[h] = (uint8_t)((forward ? row[i].tail_turn : row[i].head_turn + 2) & 3u);
    }
    g->cone[f] = (uint8_t)c;
    m->index[m->corner[hc]] = (int8_t)(m->index[m->corner[hc]] + g->index_of[f]);
}

/* Takes the turn of triangle f off the vertex that has it, and lays it on corner c. */
static void move_turn_to(framing *g, uint32_t f, uint32_t c)
{
    uint32_t v = g->m->corner[3 * f + g->cone[f]];
    g->m->index[v] = (int8_t)(g->m->index[v] - g->index_of[f]);
    lay_turn(g, f, c);
}

/* ---- corners of the curves */

/* The direction along h, which is constrained to a lattice line, in the frame of its triangle: quarter turns from the x
 * axis.
 */
static unsigned direction_of(const qw_offset_mesh *m, uint32_t h)
{
    assert(h < 3 * m->face_count);
    uint32_t e = m->edge[h];
    qw_real2 x = m->real[e];
    unsigned own = m->fixed[e] & QW_FIXED_Y ? (x.x < 0 ? 2 : 0) : (x.y < 0 ? 3 : 1);
    return own + m->rot[h];
}

/* Quarter turns, less whole ones, from the curve at `first` to the one at the end of its sector. */
static unsigned sector_quarters(const qw_offset_mesh *m, uint32_t first, uint32_t last)
{
    assert(first < 3 * m->face_count && last < 3 * m->face_count);
    unsigned from = direction_of(m, first);
    for (uint32_t h = first; h != last;) {
        uint32_t back = qw_prev(h), t = m->twin[back];
        from += m->rot[t] + 4u - ((m->rot[back] + 2u) & 3u); /* into the frame of the next triangle */
        h = t;
    }
    return (direction_of(m, qw_prev(last)) + 2u + 16u - (from & 3u)) & 3u;
}

/* Singular triangles of a sector whose turns may be laid on its corner. */
enum { MOST_MOVED = 4 };
typedef struct sector {
    uint32_t first, last; /* half-edges that leave the corner, in its first and last triangle counter-clockwise */
    float angle;          /* in quarters */
    uint32_t count, out[MOST_MOVED], cone[MOST_MOVED]; /* the half-edges that leave the corner in such triangles, and
                                                          the vertex that has the turn now */
} sector;

/* Number of quarters of a sector, known up to multiples of 4: the number nearest to its angle. */
static int quarters_of(const qw_offset_mesh *m, const sector *s)
{
    int quarters = (int)sector_quarters(m, s->first, s->last);
    return quarters + 4 * (int)qw_round_even((s->angle - (float)quarters) / 4);
}

/* Cost of a sector: how far its quarters are from its angle, plus the quarter turns left on vertices beside. A
   sector without a quarter is drawn to a line, which is worse than a pair of cones; a pair is worse than a quarter
   too many. */
static float cost_of(const qw_offset_mesh *m, const sector *s)
{
    int quarters = quarters_of(m, s);
    float cost = OFF * fabsf((float)quarters - s->angle) + (quarters <= 0 ? LOST : 0);
    for (uint32_t i = 0; i < s->count; i++) {
        bool counted = false;
        for (uint32_t k = 0; k < i; k++) counted |= s->cone[k] == s->cone[i];
        if (!counted) cost += fabsf((float)m->index[s->cone[i]]);
    }
    return cost;
}

/* Lays those turns of the sector that are in `chosen` on its corner, the others where they were. */
static void lay_chosen(framing *g, const sector *s, const uint8_t *before, unsigned chosen)
{
    for (uint32_t i = 0; i < s->count; i++)
        move_turn_to(g, s->out[i] / 3, chosen >> i & 1u ? s->out[i] % 3 : before[i]);
}

/* Lays the missing quarter turns of a sector on those of its triangles' vertices with which the sector between two
 * curves has the angle that is nearest to a whole number of quarters. All choices among MOST_MOVED triangles are
 * tried. */
static void repair_sector(framing *g, uint32_t first, uint32_t last, float angle)
{
    assert(first < 3 * g->m->face_count && last < 3 * g->m->face_count);
    const qw_offset_mesh *m = g->m;
    sector s = {.first = first, .last = last, .angle = angle};
    uint8_t before[MOST_MOVED];
    int quarters = quarters_of(m, &s);
    if (quarters > 0 && fabsf((float)quarters - angle) <= ENOUGH) return;
    for (uint32_t h = first;; h = m->twin[qw_prev(h)]) {
        uint32_t f = h / 3, v = m->corner[3 * f + g->cone[f]];
        if (g->index_of[f] && m->constraint[v] != QW_VERTEX_CORNER &&
            s.count < MOST_MOVED) { /* turns on another corner stay there */
            s.out[s.count] = h, s.cone[s.count] = v, before[s.count] = g->cone[f];
            s.count++;
        }
        if (h == last) break;
    }
    if (s.count == 0) return;
    unsigned best = 0;
    float least = cost_of(m, &s);
    for (unsigned chosen = 1; chosen < 1u << s.count; chosen++) {
        lay_chosen(g, &s, before, chosen);
        float cost = cost_of(m, &s);
        if (cost < least) least = cost, best = chosen;
    }
    lay_chosen(g, &s, before, best);
}

/* The first half-edge along a curve counter-clockwise from the boundary, where there is one in the fan of start. */
static uint32_t first_curve(const qw_offset_mesh *m, uint32_t start)
{
    assert(start < 3 * m->face_count);
    uint32_t first = start;
    for (uint32_t t = m->twin[start]; t != QW_NONE;) {
        uint32_t h = qw_next(t);
        if (h == start) return start;
        if (m->fixed[m->edge[h]]) first = h;
        t = m->twin[h];
    }
    return first;
}

/* Repairs every sector between two curves at the corner. */
static void repair_corner(framing *g, uint32_t start)
{
    assert(start < 3 * g->m->face_count);
    const qw_offset_mesh *m = g->m;
    start = first_curve(m, start);
    uint32_t first = start, h = start, sectors = 0;
    float angle = 0;
    do {
        angle += (float)qw_corner_angle(m->position, m->corner, h);
        uint32_t back = qw_prev(h), next = m->twin[back];
        if (m->fixed[m->edge[back]]) {
            if (first == start && next == start) return; /* a curve that ends here: there is but one sector */
            repair_sector(g, first, h, angle / (float)(QW_PI / 2));
            first = next, angle = 0, sectors++;
        }
        h = next;
    } while (h != QW_NONE && h != start);
}

/* ---- corners beside corners */

/* The sector of the tail of h, a corner, in which the triangle of h lies; false where it has no two curves. */
static bool find_sector(const qw_offset_mesh *m, uint32_t h, sector *s)
{
    assert(h < 3 * m->face_count);
    *s = (sector){.first = h};
    while (!m->fixed[m->edge[s->first]]) {
        uint32_t t = m->twin[s->first];
        if (t == QW_NONE || (s->first = qw_next(t)) == h) return false;
    }
    for (s->last = s->first;; s->last = m->twin[qw_prev(s->last)]) {
        s->angle += (float)qw_corner_angle(m->position, m->corner, s->last) / (float)(QW_PI / 2);
        uint32_t back = qw_prev(s->last);
        if (m->fixed[m->edge[back]]) break;
        if (m->twin[back] == QW_NONE || m->twin[back] == s->first) return false;
    }
    return m->edge[qw_prev(s->last)] != m->edge[s->first];
}

/* Quarters that a sector has beyond those that its angle wants; 0 where it is left alone. */
static int surplus_of(const qw_offset_mesh *m, const sector *s)
{
    int quarters = quarters_of(m, s), wanted = (int)qw_round_even(s->angle);
    if (quarters > 0 && fabsf((float)quarters - s->angle) <= ENOUGH) return 0;
    return quarters - (wanted > 1 ? wanted : 1);
}

/* Between two corners that one edge of a curve joins there is no other vertex to take the quarter turn that one has and
   the other lacks, as both ends of a narrow ledge may. It goes from one to the other by way of the edge, which lies
   along the other axis of the triangle then. */
static bool exchange_quarter(framing *g, uint32_t h)
{
    assert(h < 3 * g->m->face_count);
    qw_offset_mesh *m = g->m;
    sector one, two;
    if (!find_sector(m, h, &one) || !find_sector(m, qw_next(h), &two)) return false;
    int surplus = surplus_of(m, &one);
    if (surplus == 0 || surplus + surplus_of(m, &two) != 0) return false;
    uint8_t had = m->rot[h];
    for (int by = 1; by < 4; by++) {
        m->rot[h] = (uint8_t)((had + by) & 3);
        if (surplus_of(m, &one) != 0 || surplus_of(m, &two) != 0) continue;
        m->index[m->corner[h]] = (int8_t)(m->index[m->corner[h]] + surplus);
        m->index[m->corner[qw_next(h)]] = (int8_t)(m->index[m->corner[qw_next(h)]] - surplus);
        return true;
    }
    m->rot[h] = had;
    return false;
}

/* A half-edge that leaves each vertex along a curve, or QW_NONE. */
static uint32_t *curve_starts(qw_env *env, const qw_offset_mesh *m)
{
    uint32_t *start = QW_NEW(env, uint32_t, m->vertex_count);
    memset(start, 0xff, m->vertex_count * sizeof *start);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (m->fixed[m->edge[h]]) start[m->corner[h]] = h;
    }
    return start;
}

void qw_set_frames(qw_env *env, qw_offset_mesh *m, const uint8_t *turn, bool at_corners)
{
    assert(m->twin && m->constraint && turn);
    m->rot = QW_NEW_ZERO(env, uint8_t, (size_t)3 * m->face_count);
    m->index = QW_NEW_ZERO(env, int8_t, m->vertex_count);
    framing g = {m, turn, QW_NEW(env, int8_t, m->face_count), QW_NEW(env, uint8_t, m->face_count)};
    for (uint32_t f = 0; f < m->face_count; f++) {
        unsigned around = (12u - turn_back(&g, 3 * f) - turn_back(&g, 3 * f + 1) - turn_back(&g, 3 * f + 2)) & 3u;
        /* around the triangle, counter-clockwise, the frame comes back turned by this: the cone lacks as many
           quarter turns */
        g.index_of[f] = (int8_t)(around == 3 ? -1 : (int)around);
        lay_turn(&g, f, around ? choose_cone(m, f, g.index_of[f]) : 0);
    }
    uint32_t *start = curve_starts(env, m);
    at_corners = at_corners && qw_uses(env, QW_MECH_CORNER_FRAMES);
    for (uint32_t v = 0; v < m->vertex_count && at_corners; v++)
        if (m->constraint[v] == QW_VERTEX_CORNER && start[v] != QW_NONE)
            repair_corner(&g, start[v]), qw_did(env, QW_MECH_CORNER_FRAMES, 1);
    at_corners = at_corners && qw_uses(env, QW_MECH_QUARTERS_EXCHANGED);
    for (uint32_t h = 0; h < 3 * m->face_count && at_corners; h++)
        if (m->fixed[m->edge[h]] && m->constraint[m->corner[h]] == QW_VERTEX_CORNER &&
            m->constraint[m->corner[qw_next(h)]] == QW_VERTEX_CORNER)
            qw_did(env, QW_MECH_QUARTERS_EXCHANGED, exchange_quarter(&g, h));
    qw_free(env, start), qw_free(env, g.index_of), qw_free(env, g.cone);
}
