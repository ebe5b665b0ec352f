#include "remesh/quads/simplify.h"

#include "base/mechanisms.h"
#include "base/sort.h"
#include "base/elementary.h"
#include "geometry/chords.h"
#include "geometry/quad_moves.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Shapes (least scaled Jacobian of a quad) from here on are good enough that a move may make them worse: relaxation
 * does the rest. */
static const float GOOD_SHAPE = 0.35f;
/* Where all shapes around are bad, a move that improves their mean may worsen the worst by this. */
static const float WORST_LOSS = 0.2f;
/* At the tip of a protrusion normals have no meaningful mean. A doublet goes from there if no shape gets worse than
   this; no other move has that exception. */
static const float TIP_SHAPE = 0.25f;
enum { DOUBLET_GAIN = 8 };
/* How far normals about a move may turn from their mean, by cosine, unless they did before. */
static const float LEAST_FACING = 0.3f;

enum {
    MAX_SWEEPS = 8,
    MAX_AROUND = 64, /* vertices near a move */
    FACES_AROUND = 256,
    SMOOTHING = 4,    /* rounds of the vertices near a move before its shape is judged */
    LOOKS = 200,      /* at all lines, so that the time is bounded by the mesh, */
    LOOKED = 10000000 /* and quads in all of them */
};

/* A cost that has to be counted anew. */
enum { UNKNOWN = -1 };
/* Added to the cost of an inner vertex of two edges. */
enum { ALONE = 16 };
/* Even at the least count a hundredth of the quads may go with doublets; without a bound, where each leaves another,
   the whole mesh would go. */
enum { DOUBLETS = 100 };
/* A collapse that is needed for the count may let the measure rise by less than this. */
enum { WORST_RISE = 32 };

typedef struct simplifier {
    qw_quad_edit e;
    const qw_wanted *wanted;
    int64_t least;
    uint32_t *stamp, *face_stamp, round; /* [vertices], [faces] */
    int32_t *cost;                       /* [vertices] excess where no move is being tried, or UNKNOWN */
    bool *fresh;                         /* [vertices] moves are not yet tried there since something near it changed */
    /* while quads are thinned out, told NULL otherwise */
    uint32_t kept;       /* moves that were kept */
    uint32_t *kept_near; /* [vertices] `kept` when a move near the vertex was last kept */
    uint32_t *failed;    /* [sides] `kept` + 1 when the collapse that begins here last lost too much shape; 0: never */
    uint32_t *told;      /* [vertices], to work in */
    uint32_t *chord;     /* [2 quads], to work in */
    uint32_t crossing;   /* quads of chords that cross themselves, */
    uint32_t would;      /* and with the moves at hand */
    int looks;           /* at all of them, left */
    bool shapeless;      /* shapes may get worse for the sake of the count; no quad may flip */
    bool curveless;      /* sharp edges may be lost, too: vertices on two of them may become one */
} simplifier;

typedef struct vertices {
    uint32_t count, list[MAX_AROUND];
} vertices;

static void add(simplifier *s, vertices *set, uint32_t v)
{
    if (s->stamp[v] == s->round || set->count == MAX_AROUND) return;
    s->stamp[v] = s->round;
    set->list[set->count++] = v;
}

/* ---- the measure */

static bool on_curve(const qw_quadmesh *m, uint32_t h) { return m->twin[h] == QW_NONE || m->mark[h]; }

/* Radians: a corner with more surface around it than this is as good as flat. */
static const float NEARLY_ROUND = 5.5f;

/* How many quads a sector around v should have: between two curves, or `whole`, all around. angle: its, in radians. */
static int32_t ideal_of(const qw_quadmesh *m, uint32_t v, bool whole, float angle)
{
    assert(v < m->vertex_count);
    if (whole)
        return m->kind[v] == QW_VERTEX_CORNER && angle < NEARLY_ROUND
                   ? (int32_t)fmaxf(3, (float)qw_round_away(angle / (float)(QW_PI / 2)))
                   : 4;
    if (m->kind[v] != QW_VERTEX_CORNER) return 2;
    return (int32_t)fmaxf(1, (float)qw_round_away(angle / (float)(QW_PI / 2)));
}

/* Cost of a sector with `off` quads too many, or too few where it is below 0. Two vertices that are off by one cost
   as much as one that is off by two, so that moves turn neither into the other: the former is smoother, the latter
   has fewer irregular vertices. */
static int32_t cost_of(int32_t off)
{
    int32_t n = off < 0 ? -off : off;
    return n <= 2 ? 2 * n : n * n - n + 1;
}

/* The cost of vertex v, summed over its sectors. An inner vertex of two edges costs most: its two quads share 360
   degrees, or a crease. */
static int32_t excess(const qw_quadmesh *m, const uint32_t *out, uint32_t v)
{
    assert(v < m->vertex_count);
    uint32_t first = out[v], h = first, n = 0, curves = 0;
    do {
        if (on_curve(m, h)) curves++, first = h; /* begin at a curve if there is one */
        h = qw_quad_around(m, h);
        n++;
    } while (h != QW_NONE && h != out[v]);
    bool open = h == QW_NONE;
    if (open) first = out[v];
    int32_t sum = 0, quads = 0;
    float angle = 0;
    bool whole = !open && curves < 2;
    h = first;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t next = qw_quad_around(m, h);
        quads++;
        if (m->kind[v] == QW_VERTEX_CORNER) angle += qw_quad_angle(m, h);
        if (i + 1 == n || (!whole && on_curve(m, next))) {
            sum += cost_of(quads - ideal_of(m, v, whole, angle));
            quads = 0, angle = 0;
        }
        h = next;
    }
    if (!open && n < 3) sum += ALONE;
    return sum;
}

static int32_t cost_at(const simplifier *s, uint32_t v)
{
    assert(v < s->e.mesh.vertex_count);
    if (s->e.writes > 0) return excess(&s->e.mesh, s->e.out, v);
    if (s->cost[v] == UNKNOWN) s->cost[v] = excess(&s->e.mesh, s->e.out, v);
    return s->cost[v];
}

/* Neighbours of v into the set, as far as there is room; QW_MAX_VALENCE of one vertex always fit. */
static void add_neighbours(simplifier *s, vertices *set, uint32_t v)
{
    assert(v < s->e.mesh.vertex_count);
    const qw_quadmesh *m = &s->e.mesh;
    uint32_t h = s->e.out[v], prev;
    do {
        prev = qw_quad_prev(h);
        add(s, set, m->corner[qw_quad_next(h)]);
        add(s, set, m->corner[prev]);
        h = m->twin[prev];
    } while (h != QW_NONE && h != s->e.out[v] && set->count < MAX_AROUND);
}

/* ---- moves */

/* Whether the count leaves room to collapse the quad of h. Doublets have more room (DOUBLETS). */
static bool may_collapse(const simplifier *s, uint32_t h)
{
    const qw_quad_edit *e = &s->e;
    bool a_open, c_open;
    uint32_t a = qw_valence_at(e, e->mesh.corner[h], &a_open),
             c = qw_valence_at(e, e->mesh.corner[qw_quad_next(qw_quad_next(h))], &c_open);
    bool doublet = (a == 2 && !a_open) || (c == 2 && !c_open);
    return (int64_t)e->live_faces > s->least - (doublet ? s->least / DOUBLETS : 0);
}

static bool make(simplifier *s, qw_quad_move mv)
{
    return (mv.kind != QW_COLLAPSE || may_collapse(s, mv.half)) && qw_make_quad_move(&s->e, mv, s->curveless);
}

/* The quads around v where that is all that its cost depends on: it lies inside and on no curve. Else 0, and where they
   are so many that counting them anew takes long. */
static uint32_t quads_at_plain(const qw_quadmesh *m, const uint32_t *out, uint32_t v)
{
    assert(v < m->vertex_count);
    uint32_t h = out[v], n = 0;
    if (m->kind[v] == QW_VERTEX_CORNER) return 0;
    do {
        if (on_curve(m, h)) return 0;
        h = qw_quad_around(m, h), n++;
    } while (h != QW_NONE && h != out[v] && n <= QW_MAX_VALENCE);
    return h == out[v] ? n : 0;
}

static int32_t cost_of_plain(uint32_t quads) { return cost_of((int32_t)quads - 4) + (quads < 3 ? ALONE : 0); }

/* By how much the move would change the sum of costs, if it is legal: known without making it where all vertices that
   get or lose quads are plain, as most often. v: of qw_changed_by_move. */
static bool foresee(const simplifier *s, qw_quad_move mv, const uint32_t v[6], int32_t *change)
{
    uint32_t n[4], first = mv.kind == QW_ROTATE_BACK ? 2 : 1;
    const uint32_t turned[4] = {v[0], v[3], v[first], v[first + 3]}, *at = mv.kind == QW_COLLAPSE ? v : turned;
    for (int i = 0; i < 4; i++) {
        n[i] = quads_at_plain(&s->e.mesh, s->e.out, at[i]);
        if (n[i] == 0) return false;
    }
    *change = 0;
    for (int i = 0; i < 4; i++) *change -= cost_of_plain(n[i]);
    if (mv.kind == QW_COLLAPSE)
        *change += cost_of_plain(n[0] + n[2] - 2) + cost_of_plain(n[1] - 1) + cost_of_plain(n[3] - 1);
    else
        *change += cost_of_plain(n[0] - 1) + cost_of_plain(n[1] - 1) + cost_of_plain(n[2] + 1) +
                   cost_of_plain(n[3] + 1);
    return v[0] != v[2] && v[1] != v[3];
}

/* Makes the move if it changes the sum of costs by less than `limit`, and returns whether it did. *change: by how
   much; changed, *count: the vertices whose costs may have changed. */
static bool make_if(simplifier *s, qw_quad_move mv, int32_t limit, int32_t *change, uint32_t changed[6],
                    uint32_t *count)
{
    assert(s->e.keeps_journal && change && count);
    const qw_quadmesh *m = &s->e.mesh;
    size_t writes = s->e.writes;
    int32_t before = 0, after = 0;
    *count = qw_changed_by_move(m, mv, changed);
    if (*count == 0 || (foresee(s, mv, changed, change) && *change >= limit)) return false;
    /* of the hexagon of a rotation, the corners that the edge is at neither before nor after keep their costs */
    uint32_t kept = mv.kind == QW_ROTATE_ON ? 2 : mv.kind == QW_ROTATE_BACK ? 1 : 3;
    for (uint32_t i = 0; i < *count; i++)
        if (i % 3 != kept) before += cost_at(s, changed[i]);
    if (!make(s, mv)) return false;
    for (uint32_t i = 0; i < *count; i++)
        if (mv.kind == QW_COLLAPSE ? i != 2 : i % 3 != kept) after += excess(m, s->e.out, changed[i]);
    *change = after - before;
    if (*change < limit) {
        if (mv.kind == QW_COLLAPSE) changed[2] = changed[--*count];
        return true;
    }
    qw_quad_edit_undo(&s->e, writes);
    return false;
}

/* ---- shape */

/* Least scaled Jacobian at the corners, about the quad's own normal. */
static float shape_of(const qw_quadmesh *m, uint32_t f, qw_vec3 *normal)
{
    assert(f < m->face_count);
    const uint32_t *c = m->corner + 4 * (size_t)f;
    qw_vec3 p[4];
    for (int i = 0; i < 4; i++) p[i] = m->position[c[i]];
    *normal = qw_normalize(qw_quad_cross(m->position, c));
    float least = 1;
    for (int i = 0; i < 4; i++) {
        qw_vec3 a = qw_normalize(qw_sub(p[(i + 1) & 3], p[i])), b = qw_normalize(qw_sub(p[(i + 3) & 3], p[i]));
        least = fminf(least, qw_dot(qw_cross(a, b), *normal));
    }
    return least;
}

/* Shape of the quads around some vertices: the worst, the mean square of what they lack of 1, and the least cosine
   between a normal and their mean. */
typedef struct shape {
    float worst, facing, penalty;
} shape;

/* Half-edges at the vertices, one a quad. */
static uint32_t quads_around(simplifier *s, const vertices *set, uint32_t list[FACES_AROUND])
{
    uint32_t count = 0;
    s->round++;
    for (uint32_t i = 0; i < set->count; i++) {
        uint32_t first = s->e.out[set->list[i]], h = first;
        do {
            if (s->face_stamp[h / 4] != s->round && count < FACES_AROUND) list[count++] = h;
            s->face_stamp[h / 4] = s->round;
            h = qw_quad_around(&s->e.mesh, h);
        } while (h != QW_NONE && h != first && count < FACES_AROUND);
    }
    return count;
}

/* How square the quads around a set of vertices are, and whether they face one way. */
static shape shape_around(simplifier *s, const vertices *set)
{
    const qw_quadmesh *m = &s->e.mesh;
    shape r = {1, 1, 0};
    uint32_t list[FACES_AROUND], count = quads_around(s, set, list);
    qw_vec3 mean = {0, 0, 0}, normal;
    for (uint32_t i = 0; i < count; i++) mean = qw_add(mean, qw_quad_cross(m->position, m->corner + (list[i] & ~3u)));
    mean = qw_normalize(mean);
    for (uint32_t i = 0; i < count; i++) {
        float q = shape_of(m, list[i] / 4, &normal);
        r.worst = fminf(r.worst, q);
        r.penalty += (1 - q) * (1 - q) / (float)count;
        r.facing = fminf(r.facing, qw_dot(normal, mean));
    }
    return r;
}

/* Free vertices go to the middle of their neighbours, along the surface. */
static void smooth(simplifier *s, const vertices *set)
{
    qw_quadmesh *m = &s->e.mesh;
    for (int round = 0; round < SMOOTHING; round++)
        for (uint32_t i = 0; i < set->count; i++) {
            uint32_t v = set->list[i], first = s->e.out[v], h = first;
            qw_vec3 sum = {0, 0, 0}, normal = {0, 0, 0};
            float n = 0;
            if (m->kind[v] || m->twin[first] == QW_NONE) continue;
            do {
                const uint32_t *c = m->corner + (h & ~3u);
                sum = qw_add(sum, m->position[m->corner[qw_quad_next(h)]]), n += 1;
                normal = qw_add(normal, qw_quad_cross(m->position, c));
                h = qw_quad_around(m, h);
            } while (h != first);
            qw_vec3 step = qw_reject(qw_sub(qw_scale(sum, 1 / n), m->position[v]), qw_normalize(normal));
            qw_quad_edit_place(&s->e, v, qw_add(m->position[v], step));
        }
}

/* What rotations and collapses at v and beside it would cost has to be asked anew. */
static void forget_costs_around(simplifier *s, uint32_t v)
{
    const qw_quadmesh *m = &s->e.mesh;
    uint32_t h = s->e.out[v], prev;
    s->cost[v] = UNKNOWN;
    do {
        prev = qw_quad_prev(h);
        s->cost[m->corner[qw_quad_next(h)]] = s->cost[m->corner[prev]] = UNKNOWN;
        h = m->twin[prev];
    } while (h != QW_NONE && h != s->e.out[v]);
}

/* Notes at all vertices that a quad or two lead to from those near that a move was kept: what a collapse is judged by
   lies no farther away. */
static void tell_around(simplifier *s, const vertices *near)
{
    const qw_quadmesh *m = &s->e.mesh;
    uint32_t count = 0, done = 0;
    s->round++;
    for (uint32_t i = 0; i < near->count; i++) s->told[count++] = near->list[i], s->stamp[near->list[i]] = s->round;
    for (int ring = 0; ring < 2; ring++)
        for (uint32_t end = count; done < end; done++) {
            uint32_t first = s->e.out[s->told[done]], h = first;
            do {
                for (uint32_t k = h & ~3u; k < (h & ~3u) + 4; k++) {
                    if (s->stamp[m->corner[k]] == s->round) continue;
                    s->stamp[m->corner[k]] = s->round, s->told[count++] = m->corner[k];
                }
                h = qw_quad_around(m, h);
            } while (h != QW_NONE && h != first);
        }
    for (uint32_t i = 0; i < count; i++) s->kept_near[s->told[i]] = s->kept;
}

/* The vertices near may have moved, and the angles at their neighbours with them. */
static bool refresh(simplifier *s, const vertices *near)
{
    if (s->told) s->kept++, tell_around(s, near);
    s->crossing = s->would;
    for (uint32_t i = 0; i < near->count; i++) {
        s->fresh[near->list[i]] = true;
        forget_costs_around(s, near->list[i]);
    }
    return true;
}

/* Whether the moves made leave no more quads in chords that cross themselves: one irregular pair less may join most of
   the chords to one. A doublet goes all the same. */
static bool keeps_lines(simplifier *s, int32_t gain)
{
    assert(s->crossing <= 2 * s->e.mesh.face_count);
    if (s->told || s->looks == 0 || !qw_uses(s->e.env, QW_MECH_PAIRS_STAY)) return true;
    s->looks--;
    qw_heartbeat(s->e.env);
    s->would = qw_crossing_quads(&s->e.mesh, s->e.gone, s->chord);
    bool keeps = s->would <= s->crossing || gain <= -DOUBLET_GAIN;
    qw_acted(s->e.env, QW_MECH_PAIRS_STAY, 1), qw_kept(s->e.env, QW_MECH_PAIRS_STAY, !keeps);
    return keeps;
}

/* Keeps, smoothed, the move that was made if lines and the shape allow it; otherwise undoes it. */
static bool keep_or_undo(simplifier *s, qw_quad_move mv, int32_t gain, const uint32_t *changed, uint32_t count)
{
    assert(s->e.keeps_journal);
    vertices core = {0};
    if (!keeps_lines(s, gain)) {
        qw_quad_edit_undo(&s->e, 0);
        return false;
    }
    s->round++;
    for (uint32_t i = 0; i < count; i++) add(s, &core, changed[i]);
    for (uint32_t i = 0, n = core.count; i < n; i++) add_neighbours(s, &core, core.list[i]);
    smooth(s, &core);
    shape after = shape_around(s, &core);
    if (after.worst >= GOOD_SHAPE && after.facing >= LEAST_FACING) return refresh(s, &core);
    qw_quad_edit_undo(&s->e, 0);
    shape before = shape_around(s, &core);
    bool at_tip = gain <= -DOUBLET_GAIN && before.facing < 0 && after.worst >= TIP_SHAPE;
    bool shape_lost = !s->shapeless && after.worst < GOOD_SHAPE &&
                      (after.worst < before.worst - WORST_LOSS || after.penalty > before.penalty);
    if (!at_tip && (shape_lost || after.facing < fminf(LEAST_FACING, before.facing))) return false;
    make(s, mv);
    smooth(s, &core);
    return refresh(s, &core);
}

/* Tries every single move at v; the best that can be kept is. */
static bool improve(simplifier *s, uint32_t v, qw_simplify_counts *counts)
{
    assert(v < s->e.mesh.vertex_count);
    qw_quad_move list[QW_MOVES_AT];
    uint32_t n = qw_quad_moves_at(&s->e, v, list), changed[6], count;
    int32_t gain[QW_MOVES_AT], best = 0;
    for (uint32_t i = 0; i < n; i++) {
        gain[i] = 0;
        if (!make_if(s, list[i], 0, &gain[i], changed, &count)) {
            gain[i] = 0;
            continue;
        }
        qw_quad_edit_undo(&s->e, 0);
        if (gain[i] < best) best = gain[i];
    }
    for (; best < 0; best++) /* the greatest gain first; gains are small integers, so all values are gone through */
        for (uint32_t i = 0; i < n; i++) {
            if (gain[i] != best) continue;
            int32_t change;
            if (!make_if(s, list[i], 0, &change, changed, &count) || !keep_or_undo(s, list[i], change, changed, count))
                continue;
            if (list[i].kind == QW_COLLAPSE) counts->collapses++;
            else counts->rotations++;
            s->e.writes = 0;
            return true;
        }
    return false;
}

/* ---- all of it */

/* Whether v has costs, and moves have not been tried there since something near it changed. */
static bool worth_a_try(simplifier *s, uint32_t v)
{
    bool open;
    if (!s->fresh[v]) return false;
    s->fresh[v] = false;
    if (s->e.out[v] == QW_NONE || s->e.gone[s->e.out[v] / 4] || s->e.mesh.corner[s->e.out[v]] != v) return false;
    return qw_valence_at(&s->e, v, &open) <= QW_MAX_VALENCE && cost_at(s, v) > 0;
}

/* Makes improving moves until there are none or MAX_SWEEPS have gone over the mesh. */
static void simplify(simplifier *s, qw_simplify_counts *counts)
{
    bool any = true;
    s->crossing = s->would = qw_crossing_quads(&s->e.mesh, s->e.gone, s->chord);
    for (int sweep = 0; sweep < MAX_SWEEPS && any; sweep++) {
        any = false;
        for (uint32_t v = 0; v < s->e.mesh.vertex_count; v++)
            if (worth_a_try(s, v)) any |= improve(s, v, counts);
        qw_heartbeat(s->e.env);
    }
}

/* ---- fewer quads than simplification leaves */

/* Live quads with their keys, the smallest, over what is wanted there, first. */
static uint32_t list_smallest(const simplifier *s, uint64_t *keys)
{
    uint32_t count = 0;
    float *wanted = qw_areas_wanted_of(s->e.env, &s->e.mesh, s->wanted);
    for (uint32_t f = 0; f < s->e.mesh.face_count; f++) {
        if (s->e.gone[f]) continue;
        float area = qw_length(qw_quad_cross(s->e.mesh.position, s->e.mesh.corner + 4 * (size_t)f)) / wanted[f];
        keys[count++] = (uint64_t)qw_float_key(area) << 32 | f;
    }
    qw_sort_u64(keys, count);
    qw_free(s->e.env, wanted);
    return count;
}

/* Whether the collapse of h lost too much shape when it was last tried, and no move near it was kept since. */
static bool fails_again(const simplifier *s, uint32_t h)
{
    uint32_t failed = s->failed[h];
    for (uint32_t k = h & ~3u; failed > 0 && k < (h & ~3u) + 4; k++)
        if (s->kept_near[s->e.mesh.corner[k]] >= failed) failed = 0;
    return failed > 0;
}

/* Collapses quads, the smallest first, where the measure rises by less than `limit`, until there are no more than
 * `most`. */
static bool thin_out(simplifier *s, int64_t most, int32_t limit, uint64_t *keys, qw_simplify_counts *counts)
{
    bool any = false;
    uint32_t count = list_smallest(s, keys), changed[6], n;
    for (uint32_t i = 0; i < count && (int64_t)s->e.live_faces > most; i++) {
        uint32_t f = (uint32_t)keys[i];
        for (uint32_t k = 0; k < 4 && !s->e.gone[f]; k++) {
            const qw_quad_move mv = {4 * f + k, QW_COLLAPSE};
            int32_t change;
            if (fails_again(s, 4 * f + k) || !make_if(s, mv, limit, &change, changed, &n)) continue;
            if (!keep_or_undo(s, mv, change, changed, n)) {
                s->failed[4 * f + k] = s->kept + 1;
                continue;
            }
            s->e.writes = 0;
            counts->collapses++;
            any = true;
        }
    }
    return any;
}

/* Collapses quads at rising cost until the count is reached; first without loss of shape, then, unless `gently`,
   with it. */
static void reach_count(simplifier *s, int64_t most, bool gently, qw_simplify_counts *counts)
{
    assert(s->e.keeps_journal && counts);
    qw_env *env = s->e.env;
    size_t n = s->e.mesh.vertex_count, sides = 4 * (size_t)s->e.mesh.face_count;
    uint64_t *keys = QW_NEW(env, uint64_t, s->e.mesh.face_count);
    s->kept = 0, s->kept_near = QW_NEW_ZERO(env, uint32_t, n);
    s->failed = QW_NEW(env, uint32_t, sides), s->told = QW_NEW(env, uint32_t, n);
    for (int pass = 0; pass < (gently ? 1 : 2); pass++) {
        qw_mechanism m = s->curveless ? QW_MECH_THINNED_CURVELESS : pass ? QW_MECH_THINNED_SHAPELESS : QW_MECH_THINNED;
        if ((int64_t)s->e.live_faces <= most || !qw_uses(env, m)) continue;
        int64_t had = (int64_t)s->e.live_faces;
        s->shapeless = pass == 1;
        memset(s->failed, 0, sides * sizeof *s->failed);
        for (int32_t limit = 1; limit <= WORST_RISE && (int64_t)s->e.live_faces > most;)
            if (!thin_out(s, most, limit, keys, counts)) limit *= 2;
        qw_did(env, m, had - (int64_t)s->e.live_faces);
    }
    s->shapeless = false;
    qw_free(env, keys), qw_free(env, s->kept_near), qw_free(env, s->failed), qw_free(env, s->told);
    s->told = NULL;
}

/* In the current scope. least: so many quads must be left. */
static simplifier make_simplifier(qw_env *env, const qw_quadmesh *mesh, const qw_wanted *wanted, int64_t least)
{
    assert(least >= 0);
    simplifier s = {.e = qw_quad_edit_open(env, mesh), .wanted = wanted, .least = least};
    s.e.keeps_journal = true;
    s.stamp = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count),
    s.face_stamp = QW_NEW_ZERO(env, uint32_t, mesh->face_count);
    s.cost = QW_NEW(env, int32_t, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) s.cost[v] = UNKNOWN;
    s.fresh = QW_NEW(env, bool, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) s.fresh[v] = true;
    s.chord = QW_NEW(env, uint32_t, 2 * (size_t)mesh->face_count),
    s.looks = (int)fmin(LOOKS, LOOKED / fmax(mesh->face_count, 1));
    return s;
}

qw_quadmesh qw_simplify_quads(qw_env *env, const qw_quadmesh *mesh, const qw_wanted *wanted, int64_t least,
                              int64_t most, bool gently, qw_simplify_counts *counts)
{
    assert(mesh->twin && mesh->kind && mesh->mark && least <= most);
    qw_scope_begin(env);
    simplifier s = make_simplifier(env, mesh, wanted, least);
    simplify(&s, counts);
    if ((int64_t)s.e.live_faces > most) {
        reach_count(&s, most, gently, counts);
        if ((int64_t)s.e.live_faces > most && !gently) { /* sharp edges go, but only where that is what it takes */
            qw_quad_edit_pack(&s.e);
            simplifier t = make_simplifier(env, &s.e.mesh, wanted, least);
            t.curveless = true;
            reach_count(&t, most, false, counts);
            t.curveless = false;
            s = (int64_t)t.e.live_faces > most ? make_simplifier(env, &s.e.mesh, wanted, least) : t;
        }
        simplify(&s, counts);
    }
    qw_quad_edit_pack(&s.e);
    qw_quad_edit_keep(&s.e);
    qw_scope_end(env);
    return s.e.mesh;
}
