#include "remesh/relax/diagonals.h"

#include "base/constants.h"
#include "geometry/slide.h"

#include <assert.h>

/* A corner whose triangle has less than this share of the quad's area is nearly straight or points inward: a cut
   that does not go through it makes a triangle of no or of negative area. */
static const float LEAST_CORNER = 0.02f;

typedef struct diagonals {
    const qw_quadmesh *quads;
    const qw_trimesh *surface;
    const uint32_t *outgoing, *place;
    const qw_bvh *tree;
    uint8_t *turn;
} diagonals;

/* Squared, of the point p near the vertex v. */
static float distance2(const diagonals *s, uint32_t v, qw_vec3 p)
{
    if (s->place[v] != QW_NONE) return qw_slide_on_surface(s->surface, s->outgoing, 3 * s->place[v], p, 0).distance2;
    uint32_t part = s->quads->component ? s->quads->component[v] : QW_NONE;
    return qw_bvh_nearest_of(s->tree, part, p, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE).distance2;
}

/* Bit i: corner i needs the cut. area: the cross product of the diagonals. */
static unsigned poor_corners(const qw_vec3 p[4], qw_vec3 area)
{
    unsigned bits = 0;
    float least = LEAST_CORNER * qw_length2(area);
    for (unsigned i = 0; i < 4; i++)
        if (qw_dot(qw_cross(qw_sub(p[(i + 1) & 3], p[i]), qw_sub(p[(i + 3) & 3], p[i])), area) < least) bits |= 1u << i;
    return bits;
}

/* Whether quad f is better cut along its other diagonal: one that leaves no poor corner, else that which lies
 * nearer to the surface. */
static bool should_turn(const diagonals *s, uint32_t f)
{
    assert(f < s->quads->face_count);
    const uint32_t *c = s->quads->corner + 4 * (size_t)f;
    qw_vec3 p[4];
    for (int i = 0; i < 4; i++) p[i] = s->quads->position[c[i]];
    qw_vec3 area = qw_quad_cross(s->quads->position, c);
    qw_vec3 middle = qw_lerp(p[0], p[2], 0.5f), other_middle = qw_lerp(p[1], p[3], 0.5f);
    unsigned poor = poor_corners(p, area);
    bool first = poor & 5u, second = poor & 10u;
    if (first != second) return second;
    float gap = qw_dot(qw_sub(middle, other_middle), qw_normalize(area)); /* along the normal */
    if (!(gap * gap > (float)QW_ONE_PLANE * (float)QW_ONE_PLANE * qw_length(area)))
        return false; /* either may be the fold */
    return distance2(s, c[1], other_middle) < distance2(s, c[0], middle);
}

static void choose_block(void *user, uint32_t begin, uint32_t end)
{
    const diagonals *s = user;
    for (uint32_t f = begin; f < end; f++) s->turn[f] = should_turn(s, f);
}

void qw_choose_diagonals(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const uint32_t *outgoing,
                         const qw_bvh *tree, const uint32_t *place, uint8_t *turn)
{
    assert(quads->position && tree && place && turn);
    diagonals s = {quads, surface, outgoing, place, tree, turn};
    qw_parallel(env, quads->face_count, QW_GRAIN_HEAVY, choose_block, &s);
}

/* Where a half-edge comes to lie. */
static uint32_t turned(uint32_t h, const uint8_t *turn) { return turn[h / 4] ? qw_quad_prev(h) : h; }

qw_quadmesh qw_turn_quads(qw_env *env, const qw_quadmesh *quads, const uint8_t *turn)
{
    assert(quads->twin && turn);
    uint32_t sides = 4 * quads->face_count;
    qw_quadmesh m = *quads;
    m.corner = QW_NEW(env, uint32_t, sides);
    m.twin = quads->twin ? QW_NEW(env, uint32_t, sides) : NULL;
    m.mark = quads->mark ? QW_NEW(env, uint8_t, sides) : NULL;
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t to = turned(h, turn);
        m.corner[to] = quads->corner[h];
        if (m.twin) m.twin[to] = quads->twin[h] == QW_NONE ? QW_NONE : turned(quads->twin[h], turn);
        if (m.mark) m.mark[to] = quads->mark[h];
    }
    return m;
}
