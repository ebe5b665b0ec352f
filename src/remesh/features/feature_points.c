/* A tip is where the surface's total curvature, the angle that is missing around its vertices (360 degrees less the
 * angles of the triangles), lies close together: within an eighth of an edge of the quads, and not over the rest of an
 * edge around, as it does on a round end and in noise. */
#include "remesh/features/feature_points.h"

#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Half a quarter turn: from there on three quads around the tip suit its angle better than four. */
static const double LEAST_LACK = 0.25 * QW_PI;
static const float TIP = 0.125f, AROUND = 1.0f; /* radii, in edges of the quads */
static const double MOST_AROUND = 0.25;         /* curvature of either sign around, as a share of the tip's */
static const double MOST_PIECES = 4;            /* vertices that share a tip: the largest lacks so much of it */
/* The angle at one corner as rough_angle has it is off by less, in radians. What lacks too little even so is found
   exactly only where it is asked for. */
static const float ROUGH = 0.006f;
static const double UNKNOWN = -1e30;

typedef struct tips {
    const qw_trimesh *mesh;
    const uint32_t *outgoing;
    double *lack;    /* double[vertex_count], radians; 0 on curves; UNKNOWN where it was not asked for yet */
    uint32_t *stamp; /* uint32_t[vertex_count]: of the last search that came there */
    uint32_t *queue; /* uint32_t[vertex_count] */
    uint32_t round;
} tips;

/* The angle that the triangles around v lack of a full turn, radians; 0 on boundaries and curves. */
static double lack_at(const tips *t, uint32_t v)
{
    assert(v < t->mesh->vertex_count);
    const qw_trimesh *mesh = t->mesh;
    uint32_t h = t->outgoing[v];
    double sum = 0;
    do {
        if (mesh->twin[h] == QW_NONE || (mesh->mark && mesh->mark[h])) return 0;
        sum += qw_corner_angle(mesh->position, mesh->corner, h);
        h = qw_around(mesh, h);
    } while (h != t->outgoing[v]);
    return 2 * QW_PI - sum;
}

/* The angle of a vector to the x axis, y >= 0; its tangent's inverse as a cubic, off by 0.005 radians at most. */
static float rough_angle(float y, float x)
{
    float a = fabsf(x), low = y < a ? y : a, high = y < a ? a : y, t = high > 0 ? low / high : 0;
    float angle = t * (0.9724f - 0.1919f * t * t);
    if (y > a) angle = 1.5707963f - angle;
    return x < 0 ? 3.1415927f - angle : angle;
}

/* Whether the angles around v leave too little for a tip, by a margin; never on curves. */
static bool lacks_little(const tips *t, uint32_t v)
{
    assert(v < t->mesh->vertex_count);
    const qw_trimesh *mesh = t->mesh;
    uint32_t h = t->outgoing[v], corners = 0;
    qw_vec3 p = mesh->position[v];
    float sum = 0;
    do {
        if (mesh->twin[h] == QW_NONE || (mesh->mark && mesh->mark[h])) return false;
        qw_vec3 a = qw_sub(mesh->position[mesh->corner[qw_next(h)]], p),
                b = qw_sub(mesh->position[mesh->corner[qw_prev(h)]], p);
        sum += rough_angle(qw_length(qw_cross(a, b)), qw_dot(a, b)), corners++;
        h = qw_around(mesh, h);
    } while (h != t->outgoing[v]);
    return (float)(2 * QW_PI) - sum < (float)(LEAST_LACK / MOST_PIECES) - ROUGH * (float)corners;
}

static void fill_lacks(void *user, uint32_t begin, uint32_t end)
{
    const tips *t = user;
    for (uint32_t v = begin; v < end; v++) t->lack[v] = lacks_little(t, v) ? UNKNOWN : lack_at(t, v);
}

static double lack_of(const tips *t, uint32_t v)
{
    if (t->lack[v] == UNKNOWN) t->lack[v] = lack_at(t, v);
    return t->lack[v];
}

/* Collects in t->queue: v, the vertices connected to it by edges within the ball, and all neighbours of the first
 * `ringed` of them, also outside the ball. Returns their number; ends early once their curvature exceeds `most`. */
static uint32_t collect_ball(tips *t, uint32_t v, float radius, uint32_t ringed, double most)
{
    assert(v < t->mesh->vertex_count);
    const qw_trimesh *mesh = t->mesh;
    uint32_t count = 1;
    double sum = 0;
    t->round++;
    t->queue[0] = v, t->stamp[v] = t->round;
    for (uint32_t i = 0; i < count && sum <= most; i++) {
        uint32_t start = t->outgoing[t->queue[i]], h = start;
        do {
            uint32_t w = mesh->corner[qw_next(h)];
            bool is_near = i < ringed || qw_distance(mesh->position[v], mesh->position[w]) <= radius;
            if (t->stamp[w] != t->round && is_near) {
                t->stamp[w] = t->round, t->queue[count++] = w;
                sum += fabs(lack_of(t, w));
            }
            h = qw_around(mesh, h);
        } while (h != QW_NONE && h != start);
    }
    return count;
}

/* Whether v is the sharpest point of a tip: it and what is near it lack enough angle, and the surface around it is
 * otherwise flat. */
static bool is_tip(tips *t, uint32_t v, float size)
{
    assert(v < t->mesh->vertex_count && size > 0);
    uint32_t count = collect_ball(t, v, TIP * size, 0, INFINITY);
    double tip = 0, within = 0, all = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t w = t->queue[i];
        if (lack_of(t, w) > t->lack[v] || (lack_of(t, w) == t->lack[v] && w < v)) return false;
        tip += lack_of(t, w), within += fabs(lack_of(t, w));
    }
    if (tip < LEAST_LACK) return false;
    double most = within + MOST_AROUND * tip;
    count = collect_ball(t, v, AROUND * size, count, most);
    for (uint32_t i = 0; i < count; i++) all += fabs(lack_of(t, t->queue[i]));
    return all <= most;
}

uint32_t qw_find_points(qw_env *env, qw_trimesh *mesh, float size)
{
    assert(mesh->twin && size > 0);
    uint32_t n = mesh->vertex_count, count = 0;
    mesh->point = QW_NEW_ZERO(env, uint8_t, n);
    qw_scope_begin(env);
    tips t = {.mesh = mesh, .outgoing = qw_trimesh_outgoing(env, mesh)};
    t.lack = QW_NEW(env, double, n), t.stamp = QW_NEW_ZERO(env, uint32_t, n), t.queue = QW_NEW(env, uint32_t, n);
    qw_parallel(env, n, QW_GRAIN_LIGHT, fill_lacks, &t);
    for (uint32_t v = 0; v < n; v++)
        if (t.lack[v] >= LEAST_LACK / MOST_PIECES && is_tip(&t, v, size)) mesh->point[v] = 1, count++;
    qw_scope_end(env);
    if (count == 0) qw_free(env, mesh->point), mesh->point = NULL;
    return count;
}
