/* Corners too sharp for a cross.
 *
 * Where two curves meet at an angle below 45 degrees on a face, the crosses that follow them match best without a turn:
 * both curves would lie on the same lattice line, and the face between them has nowhere to go but onto that line,
 * however wide it gets. At 45 degrees chance decides, and gussets and chamfers have many such corners. A corner of a
 * quad, drawn out, is what they need: a quarter turn. So the crosses along the two curves are tilted apart, most at the
 * corner and less and less along the way, until the nearest match is that quarter turn.
 *
 *          tilted by half of what is missing ->  /
 *                                               /__ sector          the curves themselves stay where they are
 *                                        corner ----
 *                                                   <- and the other half
 *
 * At 135 degrees chance decides too, between one corner of a quad and two, and there it must decide alike: where the
 * two gables of a house disagree, the eaves between them have no length. Two suit better (n corners in a sector of a
 * degrees are off by (a - 90 n)^2 / n in all, which is the same for one and two at 127 degrees), so there too the
 * crosses are tilted apart, until two are the nearest match. Let be is a face whose other corners have more quarters
 * than their angles, as those of 45 degrees in a trapezium: it wants one here. So is a corner at a short curve, as that
 * of a small chamfer, since both ends of it are one corner, which would be lost, and one between boundaries, which has
 * no other side to suit. Sectors that share a curve tilt it both ways: what one gains the other loses.
 *
 * Between sharp edges a sector below a quarter of a right angle is a sliver that tapers off: qw_drop_close_curves takes
 * one of its curves back. */
#include "remesh/field/hierarchy.h"

#include "base/mechanisms.h"
#include "base/sets.h"
#include "base/elementary.h"

#include <assert.h>
#include <string.h>

/* Directions are tilted along this share of the shorter curve, so that the cone that goes with the quarter turn
   comes to lie in the middle of the face and not in its corner; but along no fewer vertices than this, about four
   edges of the quads. */
static const float SHARE = 0.75f;
enum { REACH = 8 };

static const float RADIANS = 3.14159265f / 180;
/* Degrees. 45 is the tie; MOST leaves room for the corners of a coarse surface, WANTED is as far again beyond. No curve
 * of the boundary can be taken back. */
static const float LEAST = 22.5f, LEAST_AT_BOUNDARY = 4, MOST = 50, WANTED = 55;
/* The same for angles about 135 degrees, in degrees. Above the least, two quads fit better than one; it is no whole
   degree, as models have whole degrees. Curves of fewer vertices, about three edges of the quads, are short and left
   alone. */
static const float LEAST_WIDE = 127.5f, MOST_WIDE = 148, WANTED_WIDE = 155;
static const float TOO_MANY = 0.25f; /* quarters of the other corners of a face */
static const float TIE = 0.44f;      /* quarters: sectors so far from whole ones (225 degrees) are either */
enum { LEAST_LENGTH = 5 };

typedef struct sectors {
    const qw_trimesh *mesh;
    bool with_boundary;
    const uint8_t *constraint;
    const uint32_t *outgoing;
    float *tilt;      /* float[vertex_count], radians about the normal */
    uint32_t *region; /* uint32_t[face_count], sets of triangles that no curve parts */
    float *excess; /* float[face_count], by region: quarters of its corners over their angles, those about 135 and 225
                      degrees left out */
} sectors;

static bool is_curve(const sectors *s, uint32_t h) { return qw_is_curve_edge(s->mesh, h, s->with_boundary); }

/* The vertex after v on a curve that came from `from`; QW_NONE past its end. */
static uint32_t next_on_curve(const sectors *s, uint32_t from, uint32_t v)
{
    assert(v < s->mesh->vertex_count);
    uint32_t h = s->outgoing[v];
    do {
        uint32_t w = s->mesh->corner[qw_next(h)], back = qw_prev(h);
        if (is_curve(s, h) && w != from) return w;
        h = s->mesh->twin[back];
        if (h == QW_NONE && s->with_boundary && s->mesh->corner[back] != from) return s->mesh->corner[back];
    } while (h != QW_NONE && h != s->outgoing[v]);
    return QW_NONE;
}

/* Vertices of the curve from v to its end. */
static uint32_t curve_length(const sectors *s, uint32_t corner, uint32_t v)
{
    uint32_t count = 0;
    for (uint32_t from = corner; v != QW_NONE && s->constraint[v] == QW_VERTEX_CURVE; count++) {
        uint32_t next = next_on_curve(s, from, v);
        from = v, v = next;
    }
    return count;
}

static void tilt_curve(const sectors *s, uint32_t corner, uint32_t v, float angle, uint32_t reach)
{
    for (uint32_t from = corner, i = 0; i < reach && v != QW_NONE && s->constraint[v] == QW_VERTEX_CURVE; i++) {
        s->tilt[v] += angle * (float)(reach - i) / (float)reach;
        uint32_t next = next_on_curve(s, from, v);
        from = v, v = next;
    }
}

/* Tilts the directions along the curves that leave the corner to v and w, by this angle in all; only where both are
   long enough. */
static void tilt_apart(const sectors *s, uint32_t corner, uint32_t v, uint32_t w, float angle, uint32_t least_length)
{
    assert(v < s->mesh->vertex_count && w < s->mesh->vertex_count);
    uint32_t lengths[2] = {curve_length(s, corner, v), curve_length(s, corner, w)},
             shorter = lengths[lengths[1] < lengths[0]];
    if (shorter < least_length) return;
    uint32_t share = (uint32_t)(SHARE * (float)shorter), reach = share > REACH ? share : REACH;
    tilt_curve(s, corner, v, -angle / 2, reach);
    tilt_curve(s, corner, w, angle / 2, reach);
}

static bool is_between(float angle, float least, float most)
{
    return angle > least * RADIANS && angle < most * RADIANS;
}

/* A sector from the half-edge first, which leaves the corner, to back, which comes into it; both lie on curves. */
typedef void visit_sector(sectors *s, uint32_t corner, uint32_t first, uint32_t back, float angle);

static void count_sector(sectors *s, uint32_t corner, uint32_t first, uint32_t back, float angle)
{
    assert(corner < s->mesh->vertex_count);
    (void)corner, (void)back;
    assert(first < 3 * s->mesh->face_count);
    if (is_between(angle, LEAST_WIDE, MOST_WIDE)) return;
    float quarters = angle / (90 * RADIANS), whole = (float)qw_round_even(quarters);
    if (quarters > 1 && fabsf(quarters - whole) > TIE) return;
    s->excess[qw_set_of(s->region, first / 3)] += fmaxf(whole, 1) - quarters;
}

/* Tilts the crosses in a sector between two curves, so that its angle is met by a whole number of quads. */
static void tilt_sector(sectors *s, uint32_t corner, uint32_t first, uint32_t back, float angle)
{
    assert(corner < s->mesh->vertex_count);
    assert(first < 3 * s->mesh->face_count);
    const qw_trimesh *mesh = s->mesh;
    bool at_boundary = mesh->twin[first] == QW_NONE && mesh->twin[back] == QW_NONE;
    uint32_t v = mesh->corner[qw_next(first)], w = mesh->corner[back];
    if (is_between(angle, at_boundary ? LEAST_AT_BOUNDARY : LEAST, MOST))
        tilt_apart(s, corner, v, w, WANTED * RADIANS - angle, 0);
    if (!at_boundary && is_between(angle, LEAST_WIDE, MOST_WIDE) &&
        s->excess[qw_set_of(s->region, first / 3)] <= TOO_MANY)
        tilt_apart(s, corner, v, w, WANTED_WIDE * RADIANS - angle, LEAST_LENGTH);
}

/* Goes counter-clockwise around the corner from one curve to the next, the angle between them summed up. */
static void visit_sectors(sectors *s, uint32_t corner, visit_sector *visit)
{
    const qw_trimesh *mesh = s->mesh;
    uint32_t start = s->outgoing[corner], h = start;
    while (!is_curve(s, h)) {
        h = qw_around(mesh, h);
        if (h == QW_NONE || h == start) break;
    }
    if (h == QW_NONE || !is_curve(s, h)) return;
    uint32_t first = start = h;
    float sum = 0;
    do {
        sum += (float)qw_corner_angle(mesh->position, mesh->corner, h);
        uint32_t back = qw_prev(h);
        h = mesh->twin[back];
        if (!is_curve(s, back)) continue;
        visit(s, corner, first, back, sum);
        first = h, sum = 0;
    } while (h != QW_NONE && h != start);
}

static void find_regions(sectors *s)
{
    const qw_trimesh *mesh = s->mesh;
    qw_sets_begin(s->region, mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (mesh->twin[h] != QW_NONE && h < mesh->twin[h] && !is_curve(s, h))
            qw_join_sets(s->region, h / 3, mesh->twin[h] / 3);
}

void qw_open_sharp_corners(qw_env *env, const qw_trimesh *mesh, bool with_boundary, const uint8_t *constraint,
                           qw_vec3 *direction)
{
    assert(mesh->twin && constraint && direction);
    uint32_t n = mesh->vertex_count;
    if (!memchr(constraint, QW_VERTEX_CORNER, n)) return;
    qw_scope_begin(env);
    sectors s = {.mesh = mesh,
                 .with_boundary = with_boundary,
                 .constraint = constraint,
                 .outgoing = qw_trimesh_outgoing(env, mesh)};
    s.tilt = QW_NEW_ZERO(env, float, n), s.region = QW_NEW(env, uint32_t, mesh->face_count),
    s.excess = QW_NEW_ZERO(env, float, mesh->face_count);
    find_regions(&s);
    for (uint32_t v = 0; v < n; v++)
        if (constraint[v] == QW_VERTEX_CORNER) visit_sectors(&s, v, count_sector);
    for (uint32_t v = 0; v < n; v++)
        if (constraint[v] == QW_VERTEX_CORNER) visit_sectors(&s, v, tilt_sector);
    const qw_vec3 *normal = qw_vertex_normals(env, mesh);
    for (uint32_t v = 0; v < n; v++) {
        if (s.tilt[v] == 0) continue;
        qw_did(env, QW_MECH_OPEN_SECTORS, 1);
        qw_vec3 along = direction[v], across = qw_cross(normal[v], along);
        direction[v] =
            qw_normalize(qw_madd(qw_scale(along, (float)qw_cos(s.tilt[v])), (float)qw_sin(s.tilt[v]), across));
    }
    qw_scope_end(env);
}
