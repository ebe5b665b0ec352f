#include "remesh/sizes/shares.h"

#include "base/elementary.h"

#include <assert.h>
#include <math.h>

/* Of all quads: shared by bow, where so many are needed for it; and the most that are raised to the least of parts. */
static const double BY_BOW = 0.5, FOR_LEAST = 0.2;
/* The bow, times eight, that is none any more: this share of a part's radius, or of the mean edge where that is less.
 */
static const double NO_BOW = 0.04;
/* A part smaller than this, in diagonals of the whole, is seen by the square of its size less. */
static const double SEEN = 0.05;
enum { HALVINGS = 48 };

/* All parts, and the mean edge. */
typedef struct parts {
    const qw_part *part;
    uint32_t count;
    double edge;
} parts;

/* Quads of edge s on a part of radius r bow by s^2 / 8 r. So many of them bow by `bow` / 8; a part that is thinner
   itself needs no more than that its quads are as small. */
static double quads_for_bow(const parts *all, uint32_t i, double bow)
{
    const qw_part *p = &all->part[i];
    double radius = p->bend > 0 ? p->area / p->bend : INFINITY;
    return p->area / fmax(bow * fmax(radius, bow), NO_BOW * radius * fmin(radius, all->edge));
}

static double sum_for_bow(const parts *all, double bow)
{
    double sum = 0;
    for (uint32_t i = 0; i < all->count; i++) sum += quads_for_bow(all, i, bow);
    return sum;
}

/* The bow, times eight, with which all parts together have `quads`, or fewer where none bows any more then. */
static double bow_of(const parts *all, double quads)
{
    double low = all->edge, high = all->edge;
    for (int i = 0; i < HALVINGS && sum_for_bow(all, low) < quads; i++) high = low, low /= 2;
    while (sum_for_bow(all, high) > quads) low = high, high *= 2;
    for (int i = 0; i < HALVINGS; i++) {
        double middle = (low + high) / 2;
        if (sum_for_bow(all, middle) > quads) low = middle;
        else high = middle;
    }
    return high;
}

/* Raises shares to the least, or to less of it where that would take more than FOR_LEAST of all, and lowers the others
   so that there are as many. */
static void raise_to_least(const qw_part *part, uint32_t count, double quads, double *share)
{
    double raised = 0, scale = 1;
    for (uint32_t i = 0; i < count; i++)
        if (share[i] < part[i].least) raised += part[i].least;
    if (raised > FOR_LEAST * quads) scale = FOR_LEAST * quads / raised;
    double held = 0, rest = 0;
    for (uint32_t i = 0; i < count; i++) {
        double least = fmax(part[i].least * scale, part[i].bare);
        if (share[i] <= least) held += share[i] = least;
        else rest += share[i];
    }
    double left = fmax(quads - held, 0);
    for (uint32_t i = 0; i < count && rest > 0; i++) {
        double least = fmax(part[i].least * scale, part[i].bare);
        if (share[i] > least) share[i] = fmax(share[i] * left / rest, least);
    }
}

void qw_share_quads(const qw_part *part, uint32_t count, double quads, double *share)
{
    assert(count > 0 && quads > 0);
    double area = 0;
    for (uint32_t i = 0; i < count; i++) area += part[i].area;
    parts all = {part, count, sqrt(area / quads)};
    double bow = bow_of(&all, BY_BOW * quads), by_bow = 0;
    for (uint32_t i = 0; i < count; i++) {
        double seen = fmin(part[i].extent / SEEN, 1);
        double most = part[i].area / (BY_BOW * NO_BOW * all.edge * all.edge);
        by_bow += share[i] = fmin(quads_for_bow(&all, i, bow) * seen * seen, most);
    }
    for (uint32_t i = 0; i < count; i++) share[i] += (quads - by_bow) * part[i].area / area;
    raise_to_least(part, count, quads, share);
}

/* ---- how much components bend */

/* Rounds in which vertices give half of what they hold to their neighbours. */
enum { SPREADS = 3 };
static const double SHARP = 1.3; /* radians */

/* Symmetric: xx, yy, zz, xy, xz, yz. */
typedef struct tensor {
    float of[6];
} tensor;

/* Of the edge of h: its length times the angle by which the surface turns there, positive where it is convex; 0 where
   it turns by more than any tube of five sides: that is an edge, which quads keep at any size. */
static float turn_at(const qw_trimesh *m, uint32_t h)
{
    assert(h < 3 * m->face_count);
    uint32_t t = m->twin[h];
    qw_vec3 one = qw_normalize(qw_face_cross(m, h / 3)), other = qw_normalize(qw_face_cross(m, t / 3)),
            along = qw_edge_way(m, h), c = qw_cross(one, other);
    double angle = qw_atan2(qw_length(c), qw_dot(one, other));
    if (angle > SHARP) return 0;
    return (float)angle * (qw_dot(c, along) < 0 ? -qw_length(along) : qw_length(along));
}

/* Each edge gives half of the curvature across it to either end. */
static void gather(const qw_trimesh *m, tensor *at)
{
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (m->twin[h] == QW_NONE || h > m->twin[h]) continue;
        uint32_t ends[2] = {m->corner[h], m->corner[qw_next(h)]};
        qw_vec3 e = qw_normalize(qw_sub(m->position[ends[1]], m->position[ends[0]]));
        float turn = 0.5f * turn_at(m, h);
        const float product[6] = {e.x * e.x, e.y * e.y, e.z * e.z, e.x * e.y, e.x * e.z, e.y * e.z};
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < 6; i++) at[ends[k]].of[i] += turn * product[i];
    }
}

/* One step of smoothing: half of each tensor goes to its neighbours. degree: float[vertices], edges at each. */
static void spread(const qw_trimesh *m, const float *degree, const tensor *from, tensor *to)
{
    for (uint32_t v = 0; v < m->vertex_count; v++)
        for (int i = 0; i < 6; i++) to[v].of[i] = 0.5f * from[v].of[i];
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (m->twin[h] != QW_NONE && h > m->twin[h]) continue;
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        for (int i = 0; i < 6; i++) {
            to[a].of[i] += 0.5f * from[b].of[i] / degree[b];
            to[b].of[i] += 0.5f * from[a].of[i] / degree[a];
        }
    }
}

static double norm_of(const tensor *t)
{
    const float *k = t->of;
    double sum = 0;
    for (int i = 0; i < 6; i++) sum += (double)k[i] * (double)k[i] * (i < 3 ? 1 : 2);
    return sqrt(sum);
}

double *qw_component_bends(qw_env *env, const qw_trimesh *m, const qw_census *census)
{
    assert(m->twin && census->component);
    double *bend = QW_NEW_ZERO(env, double, (size_t)census->components);
    qw_scope_begin(env);
    tensor *at = QW_NEW_ZERO(env, tensor, m->vertex_count), *next = QW_NEW(env, tensor, m->vertex_count);
    float *degree = QW_NEW_ZERO(env, float, m->vertex_count);
    uint32_t *component = QW_NEW(env, uint32_t, m->vertex_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        component[m->corner[h]] = census->component[h / 3];
        if (m->twin[h] == QW_NONE || h < m->twin[h]) degree[m->corner[h]]++, degree[m->corner[qw_next(h)]]++;
    }
    gather(m, at);
    for (int round = 0; round < SPREADS; round++) {
        qw_heartbeat(env);
        spread(m, degree, at, next);
        tensor *swap = at;
        at = next, next = swap;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) bend[component[v]] += norm_of(&at[v]);
    qw_scope_end(env);
    return bend;
}
