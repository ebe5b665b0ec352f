#include "remesh/working/reshape.h"

#include "geometry/slide.h"

#include <assert.h>

/* Squared height over squared longest edge below which a face has no direction worth keeping. */
#define FLAT2          1e-6f
/* The same for a face that a collapse or a move may make, unless it was worse before. */
#define SLENDER2       (0.08f * 0.08f)
/* Cosines of the turn of a face: by a collapse, by a flip, by smoothing. */
#define COLLAPSE_TURN  0.5f
#define FLAT_MERIT     0.98f
#define FLIP_TURN      0.85f
#define SMOOTH_TURN    0.8f
/* In target lengths: how far a flip, a collapse, smoothing may move the surface, and a collapse the curve. */
#define FLIP_SHIFT     0.1f
#define COLLAPSE_SHIFT 0.15f
#define SMOOTH_SHIFT   0.05f
#define CREASE         25.0f
#define CURVE_SHIFT    0.08f
/* Cosine of the turn a curve may make at a vertex after a collapse: 50 degrees. */
#define CURVE_TURN     0.64f
/* An edge shorter than this, in target lengths, is collapsed even if that makes a chord between two curve vertices. */
#define TINY_EDGE      0.1f
/* Between points closer than this, in target lengths, a curve may turn by any angle. */
#define TINY_CURVE     0.3f

/* In target lengths, squared: a walk on the input ends as near to the wanted point as this. */
#define NEAR_ENOUGH2  1e-10f
/* Squared length of an edge made longer than allowed, over that of the old one, from which it is refused. */
#define GROWN2        1.2f
/* A slender face may arise where its squared height gets no less than this share of what it was. */
#define SLENDER_LOSS  0.9f
/* Squared sine of the sum of two opposite angles below which an edge counts as Delaunay, so that none flips for ever.
 */
#define DELAUNAY2     1e-6f
/* In target lengths: a vertex that would move less by smoothing stays. */
#define LEAST_STEP    0.02f
/* Shares of an edge within which the foot of a cap must lie. */
#define FOOT_FROM     0.01f
#define FOOT_TO       0.99f
/* Squared height over longest edge of a sliver. */
#define SLIVER2       (SLENDER2 * 0.25f)
/* In target lengths: a shorter edge of a sliver is collapsed, if no edge longer than LONGEST_AFTER targets arises. */
#define SHORT_SIDE    0.5f
#define LONGEST_AFTER 1.6f

/* Twice the area vector of a triangle, with the square of height / longest edge. */
typedef struct shape {
    qw_vec3 cross;
    float cross2, slender2;
} shape;

/* From a corner to another. */
typedef struct side {
    qw_vec3 d;
    float length2;
} side;

static inline side side_to(qw_vec3 from, qw_vec3 to)
{
    qw_vec3 d = qw_sub(to, from);
    return (side){d, qw_length2(d)};
}

/* across2: squared length of the third side. */
static inline shape shape_between(const side *b, const side *c, float across2)
{
    float l2 = b->length2 > c->length2 ? b->length2 : c->length2;
    l2 = l2 > across2 ? l2 : across2;
    shape s = {.cross = qw_cross(b->d, c->d)};
    s.cross2 = qw_length2(s.cross);
    s.slender2 = l2 > 0 ? s.cross2 / (l2 * l2) : 0;
    return s;
}

static shape shape_of(qw_vec3 a, qw_vec3 b, qw_vec3 c)
{
    side ab = side_to(a, b), ac = side_to(a, c);
    return shape_between(&ab, &ac, qw_length2(qw_sub(c, b)));
}

/* Whether the angle between two area vectors has at least this cosine (which is positive). */
static bool turned_less(qw_vec3 a, float a2, qw_vec3 b, float b2, float cosine)
{
    float d = qw_dot(a, b);
    return d > 0 && d * d >= cosine * cosine * a2 * b2;
}

static qw_vec3 position(const qw_edit *e, uint32_t v) { return e->vertex[v].position; }

/* ---- split */

/* The place on the input, or on its curve, that belongs to a point of an edge. */
static qw_surface_point point_on_edge(const qw_reshape *r, uint32_t h, qw_vec3 middle, float target)
{
    assert(h >> 2 < r->edit.face_count);
    const qw_edit *e = &r->edit;
    const qw_edit_vertex *a = &e->vertex[qw_edit_tail(e, h)], *b = &e->vertex[qw_edit_head(e, h)];
    if (qw_edit_on_curve(e, h)) {
        const qw_edit_vertex *from = a->kind == QW_VERTEX_CURVE ? a : b;
        if (from->kind == QW_VERTEX_CORNER)
            return qw_slide_from_corner(r->input, r->input_outgoing, r->input_stop, r->input->corner[from->home],
                                        middle);
        return qw_slide_on_curve(r->input, r->input_outgoing, r->input_stop, from->home, middle);
    }
    float enough2 = NEAR_ENOUGH2 * target * target;
    qw_surface_point at = qw_slide_on_surface(r->input, r->input_outgoing, a->home, middle, enough2);
    if (at.distance2 <= enough2) return at;
    qw_surface_point other = qw_slide_on_surface(r->input, r->input_outgoing, b->home, middle, enough2);
    return other.distance2 < at.distance2 ? other : at;
}

/* Neither half of the face on this side may turn over when the middle of its edge moves to p. */
static bool side_keeps(const qw_edit *e, uint32_t h, qw_vec3 p)
{
    qw_vec3 a = position(e, qw_edit_tail(e, h)), b = position(e, qw_edit_head(e, h)),
            c = position(e, qw_edit_apex(e, h));
    shape old = shape_of(a, b, c), first = shape_of(a, p, c), second = shape_of(p, b, c);
    return turned_less(old.cross, old.cross2, first.cross, first.cross2, SMOOTH_TURN) &&
           turned_less(old.cross, old.cross2, second.cross, second.cross2, SMOOTH_TURN);
}

static bool same(qw_vec3 a, qw_vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/* Target of a vertex put at p on the edge a-b. Between ends one of which lies in a spot of lower targets, the target is
   not in between but grows from the ends at a bounded rate to the base target there: edges of a machined part lead from
   hole to hole across wide faces. */
static float target_on_edge(const qw_reshape *r, uint32_t a, uint32_t b, qw_vec3 p, uint32_t home)
{
    const float growth = 0.5f; /* a unit of length: as much in two edges as a ring around a ring is longer */
    const qw_edit *e = &r->edit;
    float between = qw_edge_target(e, a, b);
    if (!r->base_target) return between;
    const uint32_t *c = r->input->corner + 3 * (size_t)(home / 3);
    float base_target = (r->base_target[c[0]] + r->base_target[c[1]] + r->base_target[c[2]]) / 3;
    float grown = fminf(e->vertex[a].target + growth * qw_distance(p, position(e, a)),
                        e->vertex[b].target + growth * qw_distance(p, position(e, b)));
    return fmaxf(between, fminf(grown, base_target));
}

static bool halves_are_shorter(const qw_edit *e, uint32_t h, qw_vec3 p)
{
    uint32_t a = qw_edit_tail(e, h), b = qw_edit_head(e, h);
    float whole = qw_edge_length2(e, a, b);
    return qw_length2(qw_sub(p, position(e, a))) < whole && qw_length2(qw_sub(p, position(e, b))) < whole;
}

bool qw_reshape_split(qw_reshape *r, uint32_t h)
{
    assert(h >> 2 < r->edit.face_count);
    qw_edit *e = &r->edit;
    uint32_t a = qw_edit_tail(e, h), b = qw_edit_head(e, h), g = qw_edit_twin(e, h);
    float target = qw_edge_target(e, a, b);
    qw_vec3 middle = qw_lerp(position(e, a), position(e, b), 0.5f);
    if (same(middle, position(e, a)) || same(middle, position(e, b))) return false;
    qw_surface_point at = point_on_edge(r, h, middle, target);
    bool moved = at.distance2 > 0 && at.distance2 < 0.25f * qw_edge_length2(e, a, b);
    bool safe = moved && side_keeps(e, h, at.point) && (g == QW_NONE || side_keeps(e, g, at.point));
    qw_vec3 p = safe && halves_are_shorter(e, h, at.point) ? at.point : middle;
    if (!halves_are_shorter(e, h, p)) return false; /* at the limit of precision, where splits would never end */
    qw_edit_split(e, h, p, target_on_edge(r, a, b, p, at.half_edge), at.half_edge);
    return true;
}

/* ---- collapse */

/* The curve edge at v other than h, as the vertex at its far end; v itself where there is none. */
static uint32_t curve_neighbour(const qw_edit *e, uint32_t v, uint32_t not_this)
{
    uint32_t start = e->vertex[v].out, h = start;
    do {
        uint32_t in = qw_edit_prev(h);
        if (qw_edit_on_curve(e, h) && qw_edit_head(e, h) != not_this) return qw_edit_head(e, h);
        if (qw_edit_on_curve(e, in) && qw_edit_tail(e, in) != not_this) return qw_edit_tail(e, in);
        h = qw_edit_twin(e, in);
    } while (h != QW_NONE && h != start);
    return v;
}

static float turn_cosine(qw_vec3 a, qw_vec3 b, qw_vec3 c)
{
    return qw_dot(qw_normalize(qw_sub(b, a)), qw_normalize(qw_sub(c, b)));
}

/* By so much may the cosine of a curve's turn fall where one of its vertices goes: rounding. */
static const float TURN_ROUNDING = 1e-4f;

/* The curve p - gone - keep becomes p - keep: it must stay near `gone`, and turn no more at its new ends than it did or
 * may. */
static bool curve_survives(const qw_edit *e, uint32_t gone, uint32_t keep)
{
    uint32_t p = curve_neighbour(e, gone, keep);
    if (p == gone) return false;
    qw_vec3 at = position(e, gone), from = position(e, p), to = position(e, keep), d = qw_sub(to, from);
    float length2 = qw_length2(d), along = length2 > 0 ? qw_dot(qw_sub(at, from), d) / length2 : 0;
    float t = along < 0 ? 0 : along > 1 ? 1 : along, limit = CURVE_SHIFT * e->vertex[gone].target;
    if (qw_length2(qw_sub(at, qw_madd(from, t, d))) > limit * limit) return false;
    float tiny = TINY_CURVE * e->vertex[gone].target;
    if (length2 < tiny * tiny) return true; /* the rim of a pinhole may become a triangle */
    float before = fminf(CURVE_TURN, turn_cosine(from, at, to));
    if (e->vertex[keep].kind == QW_VERTEX_CURVE) {
        uint32_t next = curve_neighbour(e, keep, gone);
        float was = turn_cosine(at, to, position(e, next));
        if (turn_cosine(from, to, position(e, next)) < fminf(before, was) - TURN_ROUNDING) return false;
    }
    if (e->vertex[p].kind == QW_VERTEX_CURVE) {
        uint32_t next = curve_neighbour(e, p, gone);
        float was = turn_cosine(position(e, next), from, at);
        if (turn_cosine(position(e, next), from, to) < fminf(before, was) - TURN_ROUNDING) return false;
    }
    return true;
}

/* No edge that arises when `gone` is drawn into `keep` is too long, or a chord. */
static bool new_edges_suit(const qw_reshape *r, uint32_t gone, uint32_t keep, float longest)
{
    const qw_edit *e = &r->edit;
    qw_vec3 from = position(e, gone), to = position(e, keep);
    float keep_target = e->vertex[keep].target, tiny = TINY_EDGE * keep_target;
    bool no_chords = r->avoid_chords && e->vertex[keep].kind != QW_VERTEX_FREE &&
                     e->vertex[gone].kind == QW_VERTEX_FREE && qw_length2(qw_sub(to, from)) >= tiny * tiny;
    uint32_t start = e->vertex[gone].out, h = start;
    do {
        uint32_t pv = qw_edit_head(e, h), qv = qw_edit_apex(e, h);
        h = qw_edit_around(e, h);
        if (pv == keep || qv == keep) continue;
        float limit = longest * 0.5f * (keep_target + e->vertex[pv].target),
              length2 = qw_length2(qw_sub(position(e, pv), to));
        if (length2 > limit * limit && length2 > GROWN2 * qw_length2(qw_sub(position(e, pv), from))) return false;
        if (no_chords && e->vertex[pv].kind != QW_VERTEX_FREE) return false;
    } while (h != QW_NONE && h != start);
    return true;
}

/* Faces without a direction must at least not come to face against the others. */
static bool flat_faces_agree(const qw_edit *e, uint32_t gone, uint32_t keep, qw_vec3 fan)
{
    uint32_t start = e->vertex[gone].out, h = start;
    do {
        uint32_t pv = qw_edit_head(e, h), qv = qw_edit_apex(e, h);
        h = qw_edit_around(e, h);
        if (pv == keep || qv == keep) continue;
        shape new = shape_of(position(e, keep), position(e, pv), position(e, qv));
        if (new.slender2 > FLAT2 && qw_length2(fan) > 0 && qw_dot(new.cross, fan) < 0) return false;
    } while (h != QW_NONE && h != start);
    return true;
}

/* What drawing `gone` into `keep` does to its faces: the least cosine of their turns, or -1 where it is not allowed. */
static float collapse_merit(const qw_reshape *r, uint32_t gone, uint32_t keep, float longest)
{
    if (!new_edges_suit(r, gone, keep, longest)) return -1;
    const qw_edit *e = &r->edit;
    qw_vec3 from = position(e, gone), to = position(e, keep), fan = {0, 0, 0};
    float merit = 1, keep_target = e->vertex[keep].target;
    bool flat = false;
    float shift2 = qw_length2(qw_sub(to, from)); /* squared distance of the old place from the new faces */
    float shift_limit2 = COLLAPSE_SHIFT * COLLAPSE_SHIFT * keep_target * keep_target;
    uint32_t start = e->vertex[gone].out, h = start, pv = qw_edit_head(e, h);
    qw_vec3 p = position(e, pv);
    side old_p = side_to(from, p), new_p = side_to(to, p);
    do {
        uint32_t qv = qw_edit_apex(e, h);
        qw_vec3 q = position(e, qv);
        side old_q = side_to(from, q), new_q = side_to(to, q);
        float across2 = qw_length2(qw_sub(q, p));
        shape old = shape_between(&old_p, &old_q, across2);
        fan = qw_add(fan, old.cross);
        if (pv != keep && qv != keep) {
            shape new = shape_between(&new_p, &new_q, across2);
            if (new.slender2 < SLENDER2 &&new.slender2 < SLENDER_LOSS * old.slender2) return -1;
            float cosine = old.slender2 > FLAT2 ? qw_dot(old.cross, new.cross) / sqrtf(old.cross2 * new.cross2) : 1;
            if (!(cosine >= COLLAPSE_TURN)) return -1;
            if (cosine < merit) merit = cosine;
            if (shift2 > shift_limit2) shift2 = fminf(shift2, qw_triangle_distance2(to, p, q, from));
            flat |= old.slender2 <= FLAT2;
        }
        pv = qv, p = q, old_p = old_q, new_p = new_q; /* the apex is the next one's head */
        h = qw_edit_around(e, h);
    } while (h != QW_NONE && h != start);
    if (shift2 > shift_limit2 || (flat && !flat_faces_agree(e, gone, keep, fan))) return -1;
    return merit;
}

static float allowed_merit(const qw_reshape *r, uint32_t h, uint32_t gone, uint32_t keep, float longest)
{
    const qw_edit *e = &r->edit;
    uint8_t kind = e->vertex[gone].kind;
    if (kind == QW_VERTEX_CORNER || kind > e->vertex[keep].kind) return -1;
    if (kind == QW_VERTEX_CURVE && (!qw_edit_on_curve(e, h) || !curve_survives(e, gone, keep))) return -1;
    return collapse_merit(r, gone, keep, longest);
}

bool qw_reshape_collapse(qw_reshape *r, uint32_t h, float longest)
{
    assert(h >> 2 < r->edit.face_count && longest > 0);
    qw_edit *e = &r->edit;
    uint32_t v = qw_edit_tail(e, h), w = qw_edit_head(e, h);
    float v_merit = allowed_merit(r, h, v, w, longest);
    float w_merit = v_merit >= FLAT_MERIT
                        ? -1
                        : allowed_merit(r, h, w, v, longest); /* where the ground is flat either way will do */
    if (v_merit < 0 && w_merit < 0) return false;
    if (!qw_edit_can_collapse(e, h)) return false;
    qw_edit_collapse(e, h, v_merit >= w_merit ? v : w);
    return true;
}

/* ---- flip */

/* Distance between the lines through the two diagonals of a - d - b - c: how far a flip moves the surface. */
static float diagonal_gap(qw_vec3 a, qw_vec3 b, qw_vec3 c, qw_vec3 d)
{
    qw_vec3 n = qw_cross(qw_sub(b, a), qw_sub(d, c));
    float n2 = qw_length2(n);
    return n2 > 0 ? fabsf(qw_dot(qw_sub(c, a), n)) / sqrtf(n2) : 0;
}

/* The pair of faces (c, a, d), (d, b, c) is right side up and fit to replace (a, b, c), (b, a, d). */
static bool flip_keeps_shape(const qw_reshape *r, uint32_t h, float turn)
{
    assert(qw_edit_twin(&r->edit, h) != QW_NONE);
    const qw_edit *e = &r->edit;
    uint32_t av = qw_edit_tail(e, h), bv = qw_edit_head(e, h);
    qw_vec3 a = position(e, av), b = position(e, bv), c = position(e, qw_edit_apex(e, h));
    qw_vec3 d = position(e, qw_edit_apex(e, qw_edit_twin(e, h)));
    if (diagonal_gap(a, b, c, d) > FLIP_SHIFT * qw_edge_target(e, av, bv)) return false;
    shape old1 = shape_of(a, b, c), old2 = shape_of(b, a, d), new1 = shape_of(c, a, d), new2 = shape_of(d, b, c);
    if (fminf(new1.slender2, new2.slender2) < fminf(SLENDER2, fminf(old1.slender2, old2.slender2))) return false;
    qw_vec3 sum = qw_add(old1.cross, old2.cross);
    float sum2 = qw_length2(sum);
    if (!turned_less(sum, sum2, new1.cross, new1.cross2, turn) ||
        !turned_less(sum, sum2, new2.cross, new2.cross2, turn))
        return false;
    /* A face of clear direction must not lose it, even where the other outweighs it. */
    bool first = old1.slender2 <= FLAT2 || qw_dot(old1.cross, sum) > 0,
         second = old2.slender2 <= FLAT2 || qw_dot(old2.cross, sum) > 0;
    return first && second;
}

static bool is_chord(const qw_edit *e, uint32_t a, uint32_t b)
{
    return e->vertex[a].kind != QW_VERTEX_FREE && e->vertex[b].kind != QW_VERTEX_FREE;
}

bool qw_reshape_flip(qw_reshape *r, uint32_t h)
{
    assert(h >> 2 < r->edit.face_count);
    qw_edit *e = &r->edit;
    if (qw_edit_on_curve(e, h)) return false;
    uint32_t av = qw_edit_tail(e, h), bv = qw_edit_head(e, h), cv = qw_edit_apex(e, h),
             dv = qw_edit_apex(e, qw_edit_twin(e, h));
    qw_vec3 a = position(e, av), b = position(e, bv), c = position(e, cv), d = position(e, dv);
    qw_vec3 ca = qw_sub(a, c), cb = qw_sub(b, c), da = qw_sub(a, d), db = qw_sub(b, d);
    /* Delaunay: the angles at c and d sum up to less than a half turn, sin(c + d) > 0. */
    float cos_c = qw_dot(ca, cb), cos_d = qw_dot(da, db);
    if (cos_c >= 0 && cos_d >= 0) return false;
    float sin_c = qw_length(qw_cross(ca, cb)), sin_d = qw_length(qw_cross(da, db));
    float sine = sin_c * cos_d + cos_c * sin_d,
          scale2 = qw_length2(ca) * qw_length2(cb) * qw_length2(da) * qw_length2(db);
    if (sine >= 0 || sine * sine <= DELAUNAY2 * scale2) return false;
    if (is_chord(e, cv, dv) && (r->avoid_chords || !is_chord(e, av, bv))) return false;
    if (!flip_keeps_shape(r, h, FLIP_TURN) || !qw_edit_can_flip(e, h)) return false;
    qw_edit_flip(e, h);
    return true;
}

/* ---- smooth */

/* Moving v to p turns no face by much, makes none slender and leaves the surface near the old place. */
static bool move_keeps_fan(const qw_edit *e, uint32_t v, qw_vec3 p)
{
    qw_vec3 from = position(e, v);
    float limit = SMOOTH_SHIFT * e->vertex[v].target, shift2 = qw_length2(qw_sub(p, from));
    uint32_t start = e->vertex[v].out, h = start;
    do {
        qw_vec3 a = position(e, qw_edit_head(e, h)), b = position(e, qw_edit_apex(e, h));
        shape old = shape_of(from, a, b), new = shape_of(p, a, b);
        if (new.slender2 < SLENDER2 &&new.slender2 < old.slender2) return false;
        if (old.slender2 > FLAT2 && !turned_less(old.cross, old.cross2, new.cross, new.cross2, SMOOTH_TURN))
            return false;
        if (shift2 > limit * limit) shift2 = fminf(shift2, qw_triangle_distance2(p, a, b, from));
        h = qw_edit_around(e, h);
    } while (h != QW_NONE && h != start);
    return shift2 <= limit * limit;
}

/* A symmetric matrix. */
typedef struct symmetric {
    float xx, xy, xz, yy, yz, zz;
} symmetric;

static void add_outer(symmetric *m, float s, qw_vec3 n)
{
    m->xx += s * n.x * n.x, m->xy += s * n.x * n.y, m->xz += s * n.x * n.z, m->yy += s * n.y * n.y,
        m->yz += s * n.y * n.z, m->zz += s * n.z * n.z;
}

/* Takes from the pull what would leave the planes of the faces: (I + c A)^-1 pull, where A is the mean of n n^T over
   their unit normals n, weighted by area. Nothing on flat ground, along a crease only what crosses it, on a tip nearly
   all. */
static qw_vec3 pull_along_creases(const symmetric *a, qw_vec3 pull, float c)
{
    qw_vec3 r0 = {1 + c * a->xx, c * a->xy, c * a->xz}, r1 = {r0.y, 1 + c * a->yy, c * a->yz},
            r2 = {r0.z, r1.z, 1 + c * a->zz};
    qw_vec3 c0 = qw_cross(r1, r2), c1 = qw_cross(r2, r0),
            c2 = qw_cross(r0, r1); /* symmetric: the cofactors are the inverse's columns */
    float det = qw_dot(r0, c0);
    return qw_scale(qw_madd(qw_madd(qw_scale(c0, pull.x), pull.y, c1), pull.z, c2), 1 / det);
}

bool qw_reshape_smooth(qw_reshape *r, uint32_t v)
{
    assert(v < r->edit.vertex_count);
    qw_edit *e = &r->edit;
    qw_edit_vertex *vertex = &e->vertex[v];
    if (vertex->out == QW_NONE || vertex->kind != QW_VERTEX_FREE) return false;
    qw_vec3 p = vertex->position, normal = {0, 0, 0}, pull = {0, 0, 0};
    symmetric planes = {0};
    float weight = 0;
    uint32_t h = vertex->out, start = h; /* free vertices are never on the boundary */
    qw_vec3 a = qw_sub(position(e, qw_edit_head(e, h)), p);
    do {
        qw_vec3 b = qw_sub(position(e, qw_edit_apex(e, h)), p), cross = qw_cross(a, b);
        float area = qw_length(cross);
        normal = qw_add(normal, cross);
        pull = qw_madd(pull, area, qw_add(a, b));
        weight += area;
        if (area > 0) add_outer(&planes, 1 / area, cross);
        h = qw_edit_around(e, h);
        a = b; /* the apex is the next one's head */
    } while (h != start);
    if (!(weight > 0)) return false;
    pull = qw_reject(qw_scale(pull, 1 / (3 * weight)), qw_normalize(normal));
    pull = pull_along_creases(&planes, pull, CREASE / weight);
    float target = vertex->target, step2 = qw_length2(pull);
    if (step2 < LEAST_STEP * LEAST_STEP * target * target) return false;
    qw_vec3 wanted = qw_add(p, pull);
    qw_surface_point at = qw_slide_on_surface(r->input, r->input_outgoing, vertex->home, wanted,
                                              NEAR_ENOUGH2 * target * target);
    if (qw_length2(qw_sub(at.point, p)) > 4 * step2 || !move_keeps_fan(e, v, at.point)) return false;
    vertex->position = at.point;
    vertex->home = at.half_edge;
    return true;
}

/* ---- slivers */

/* The longest or shortest half-edge of a face. */
static uint32_t extreme_edge(const qw_edit *e, uint32_t f, bool longest)
{
    assert(f < e->face_count);
    uint32_t best = 4 * f;
    float best2 = qw_edge_length2(e, qw_edit_tail(e, best), qw_edit_head(e, best));
    for (uint32_t h = 4 * f + 1; h < 4 * f + 3; h++) {
        float length2 = qw_edge_length2(e, qw_edit_tail(e, h), qw_edit_head(e, h));
        if (longest ? length2 > best2 : length2 < best2) best = h, best2 = length2;
    }
    return best;
}

/* The apex of a cap lies on (the curve of) its long edge but is not part of it: put a vertex on the edge there and draw
 * the apex in. */
static bool split_cap(qw_reshape *r, uint32_t h)
{
    assert(h >> 2 < r->edit.face_count);
    qw_edit *e = &r->edit;
    uint32_t a = qw_edit_tail(e, h), b = qw_edit_head(e, h), c = qw_edit_apex(e, h);
    if (e->vertex[c].kind != QW_VERTEX_FREE) return false;
    qw_vec3 from = position(e, a), d = qw_sub(position(e, b), from);
    float t = qw_dot(qw_sub(position(e, c), from), d) / qw_length2(d);
    if (!(t > FOOT_FROM && t < FOOT_TO)) return false;
    float target = qw_edge_target(e, a, b);
    qw_vec3 foot = qw_madd(from, t, d);
    uint32_t home = point_on_edge(r, h, foot, target).half_edge;
    qw_edit_split(e, h, foot, target_on_edge(r, a, b, foot, home), home);
    uint32_t spoke = qw_edit_next(h); /* from the new vertex to c */
    if (qw_edit_can_collapse(e, spoke) && collapse_merit(r, c, qw_edit_tail(e, spoke), 2) >= 0)
        qw_edit_collapse(e, spoke, c);
    return true;
}

static shape shape_of_face(const qw_edit *e, uint32_t f)
{
    const uint32_t *c = e->face[f].corner;
    return shape_of(position(e, c[0]), position(e, c[1]), position(e, c[2]));
}

bool qw_reshape_is_sliver(const qw_edit *e, uint32_t f) { return shape_of_face(e, f).slender2 < SLIVER2; }

bool qw_reshape_sliver(qw_reshape *r, uint32_t f)
{
    assert(f < r->edit.face_count);
    qw_edit *e = &r->edit;
    shape s = shape_of_face(e, f);
    if (s.slender2 >= SLIVER2) return false;
    uint32_t longest = extreme_edge(e, f, true), shortest = extreme_edge(e, f, false);
    uint32_t a = qw_edit_tail(e, shortest), b = qw_edit_head(e, shortest);
    float target = qw_edge_target(e, a, b);
    if (qw_edge_length2(e, a, b) < SHORT_SIDE * SHORT_SIDE * target * target &&
        qw_reshape_collapse(r, shortest, LONGEST_AFTER))
        return true;
    if (qw_edit_on_curve(e, longest)) return s.slender2 <= FLAT2 && split_cap(r, longest);
    if (!flip_keeps_shape(r, longest, COLLAPSE_TURN) || !qw_edit_can_flip(e, longest)) return false;
    qw_edit_flip(e, longest);
    return true;
}
