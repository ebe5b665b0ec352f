#include "remesh/quantise/acute_corners.h"

#include "remesh/features/verdict.h"
#include "remesh/offsets/inversions.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Between two curves that are nearer than this many wanted lengths no row of quads fits, however thin (see
   narrow_bands.h). */
static const float ROOM = 0.3f;
/* A sector between two curves that is at least this wide has room for a quarter turn. */
static const float WIDE = 1.3f; /* radians, about 75 degrees */
enum { LONGEST = 400 };         /* most edges along which a curve is followed */

static bool is_constrained(const qw_offset_mesh *m, uint32_t h) { return m->fixed[m->edge[h]] != 0; }

/* The axis (0 to 3: +x, +y, -x, -y) in the vertex's frame along which the constrained half-edge leaves; turn is its
 * corner's.
 */
static unsigned axis_of(const qw_offset_mesh *m, uint32_t h, unsigned turn)
{
    assert(h < 3 * m->face_count);
    unsigned to_vertex = (m->rot[h] + 4u - turn) & 3u;
    bool on_x = m->fixed[m->edge[h]] == QW_FIXED_Y;
    if (to_vertex & 1u) on_x = !on_x;
    qw_real2 x = qw_turn_real(to_vertex, m->real[m->edge[h]]);
    return on_x ? (x.x >= 0 ? 0u : 2u) : (x.y >= 0 ? 1u : 3u);
}

/* Follows the curve from h on as far as no other curve meets it; edges[i] leads to path[i + 1]. Returns how many
   vertices it has. */
static uint32_t follow(const qw_offset_mesh *m, const uint32_t *outgoing, qw_env *env, qw_star *star, uint32_t h,
                       uint32_t *path, uint32_t *edges)
{
    assert(h < 3 * m->face_count);
    uint32_t count = 0;
    path[count++] = m->corner[h];
    for (;;) {
        uint32_t e = m->edge[h], v = m->corner[qw_next(h)], next = QW_NONE;
        edges[count - 1] = e;
        path[count++] = v;
        if (count >= LONGEST || m->constraint[v] == QW_VERTEX_CORNER) return count;
        qw_star_at(env, m, outgoing[v], star);
        for (uint32_t i = 0; i < star->count; i++)
            if (is_constrained(m, star->out[i]) && m->edge[star->out[i]] != e) next = star->out[i];
        if (next == QW_NONE) return count; /* the end, or a boundary that comes in: far enough */
        h = next;
    }
}

/* Number of the path's edges, from its beginning, to which the other path is too near. */
static uint32_t length_of_narrow_side(const qw_offset_mesh *m, const uint32_t *path, uint32_t count,
                                      const uint32_t *other, uint32_t other_count)
{
    assert(count > 0 && other_count > 0);
    uint32_t near = 0;
    for (uint32_t i = 1, k = 0; i < count; i++) {
        qw_vec3 p = m->position[path[i]];
        while (k + 1 < other_count &&
               qw_distance(p, m->position[other[k + 1]]) <= qw_distance(p, m->position[other[k]]))
            k++;
        if (qw_distance(p, m->position[other[k]]) > ROOM * m->size[path[i]]) break;
        near = i;
    }
    return near < count - 1 ? near + 1 : near;
}

/* Lets these edges go from their curve. Returns how many were constrained. verdict: uint8_t[half-edges], or NULL.
 * */
static int64_t shorten(qw_offset_mesh *m, const uint32_t *edges, uint32_t count, uint8_t *verdict)
{
    assert(count <= m->edge_count);
    int64_t released = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t h = m->half[edges[i]], t = m->twin[h];
        released += m->fixed[edges[i]] != 0, m->fixed[edges[i]] = 0;
        if (verdict) verdict[h] = QW_CURVE_SHORTENED;
        if (verdict && t != QW_NONE) verdict[t] = QW_CURVE_SHORTENED;
    }
    return released;
}

/* The first acute corner of the star as two half-edges that leave its vertex; false where there is none. (An acute
   corner whose second side is the boundary's last edge is not found.) A star that goes round begins with a constrained
   half-edge. */
static bool find_acute_corner(const qw_offset_mesh *m, const qw_star *star, uint32_t *one, uint32_t *two)
{
    assert(star->count > 0);
    uint32_t last = QW_NONE, in = qw_prev(star->out[star->count - 1]), across = m->twin[in];
    unsigned last_axis = 0;
    float angle = 0;
    for (uint32_t i = 0; i < star->count + (across != QW_NONE); i++) {
        bool round = i == star->count; /* the first one again, as the star is closed */
        uint32_t h = star->out[round ? 0 : i];
        if (is_constrained(m, h)) {
            unsigned turn = round ? star->turn[i - 1] + m->rot[across] + 6u - m->rot[in] : star->turn[i],
                     axis = axis_of(m, h, turn & 3u);
            if (last != QW_NONE && axis == last_axis && angle < WIDE && h != last) {
                *one = last, *two = h;
                return true;
            }
            last = h, last_axis = axis, angle = 0;
        }
        angle += (float)qw_corner_angle(m->position, m->corner, h);
    }
    return false;
}

static bool star_from_constrained(qw_env *env, const qw_offset_mesh *m, uint32_t outgoing, qw_star *star)
{
    qw_star_at(env, m, outgoing, star);
    uint32_t first = 0;
    while (first < star->count && !is_constrained(m, star->out[first])) first++;
    if (first == star->count) return false;
    if (first > 0 && m->twin[qw_prev(star->out[star->count - 1])] != QW_NONE)
        qw_star_at(env, m, star->out[first], star);
    return true;
}

int64_t qw_release_acute_corners(qw_env *env, qw_offset_mesh *m, uint8_t *verdict)
{
    assert(m->fixed && m->constraint && m->direction);
    qw_scope_begin(env);
    uint32_t *outgoing = qw_offset_outgoing(env, m), *path[2], *edges[2], count[2];
    for (int i = 0; i < 2; i++)
        path[i] = QW_NEW(env, uint32_t, LONGEST + 1), edges[i] = QW_NEW(env, uint32_t, LONGEST + 1);
    uint8_t *was_constrained = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    qw_star star = {0}, walk = {0};
    int64_t released = 0;
    for (uint32_t e = 0; e < m->edge_count; e++)
        if (m->fixed[e]) was_constrained[m->corner[m->half[e]]] = was_constrained[m->corner[qw_next(m->half[e])]] = 1;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        if (!was_constrained[v] || m->constraint[v] != QW_VERTEX_CORNER) continue;
        uint32_t one, two;
        while (star_from_constrained(env, m, outgoing[v], &star) && find_acute_corner(m, &star, &one, &two)) {
            count[0] = follow(m, outgoing, env, &walk, one, path[0], edges[0]);
            count[1] = follow(m, outgoing, env, &walk, two, path[1], edges[1]);
            uint32_t narrow[2];
            for (int i = 0; i < 2; i++)
                narrow[i] = length_of_narrow_side(m, path[i], count[i], path[1 - i], count[1 - i]);
            int shorter = count[0] < count[1] ? 0 : 1;
            released += shorten(m, edges[shorter], narrow[shorter] > 0 ? narrow[shorter] : 1, verdict);
        }
    }
    uint8_t *constrained = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    for (uint32_t e = 0; e < m->edge_count; e++)
        if (m->fixed[e]) constrained[m->corner[m->half[e]]] = constrained[m->corner[qw_next(m->half[e])]] = 1;
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (was_constrained[v] && !constrained[v] && m->constraint[v] != QW_VERTEX_CORNER)
            m->constraint[v] = 0, m->direction[v] = qw_v3(0, 0, 0);
    qw_scope_end(env);
    return released;
}
