#include "remesh/sizes/needs.h"

#include "base/constants.h"
#include "base/promise.h"
#include "geometry/quadmesh.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The working mesh is made for at least this many quads a component, so that a component of any topology has something
 * to be cut from. */
static const double LEAST_QUADS_OPEN = 4, LEAST_QUADS_CLOSED = 24, LEAST_QUADS_RING = 16;

/* A triangle is a needle where its longest side is so many times as long as it is high. A bar has RIDGES such edges
   that are sharp, and is as long as one of them: so are components made of many needles. */
static const double NEEDLE = 1000, RIDGES = 4;

double qw_marked_length(const qw_trimesh *s)
{
    double sum = 0;
    for (uint32_t h = 0; s->mark && h < 3 * s->face_count; h++)
        if (s->mark[h]) sum += (double)qw_edge_length(s, h) / 2;
    return sum;
}

/* uint8_t[census->components]: whether it has a boundary. */
static uint8_t *find_open(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    uint8_t *open = QW_NEW_ZERO(env, uint8_t, (size_t)census->components);
    for (uint32_t h = 0; census->boundary_loops > 0 && h < 3 * s->face_count; h++)
        if (s->twin[h] == QW_NONE) open[census->component[h / 3]] = 1;
    return open;
}

static uint32_t open_components(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    uint8_t *open = find_open(env, mesh, census);
    uint32_t count = 0;
    for (int64_t c = 0; c < census->components; c++) count += open[c];
    qw_free(env, open);
    return count;
}

double qw_needed_loops(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    int64_t handles = census->components - (census->euler + census->boundary_loops) / 2;
    double holes = census->boundary_loops > 0 ? (double)census->boundary_loops - open_components(env, mesh, census) : 0;
    return 2 * fmax((double)handles, 0) + holes;
}

uint32_t *qw_vertex_components(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    uint32_t *component = QW_NEW(env, uint32_t, s->vertex_count);
    if (census->components == 1) memset(component, 0, s->vertex_count * sizeof *component);
    else
        for (uint32_t h = 0; h < 3 * s->face_count; h++) component[s->corner[h]] = census->component[h / 3];
    return component;
}

static float lesser(float a, float b) { return b < a ? b : a; }
static float greater(float a, float b) { return b > a ? b : a; }

/* The diagonal of each component's box: double[census->components]. */
static double *extents(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    qw_vec3 *low = QW_NEW(env, qw_vec3, (size_t)census->components),
            *high = QW_NEW(env, qw_vec3, (size_t)census->components);
    double *extent = QW_NEW(env, double, (size_t)census->components);
    uint32_t *component = qw_vertex_components(env, s, census);
    for (int64_t c = 0; c < census->components; c++)
        low[c] = qw_v3(INFINITY, INFINITY, INFINITY), high[c] = qw_scale(low[c], -1);
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        uint32_t c = component[v];
        qw_vec3 p = s->position[v];
        low[c] = qw_v3(lesser(low[c].x, p.x), lesser(low[c].y, p.y), lesser(low[c].z, p.z));
        high[c] = qw_v3(greater(high[c].x, p.x), greater(high[c].y, p.y), greater(high[c].z, p.z));
    }
    for (int64_t c = 0; c < census->components; c++) extent[c] = qw_distance(low[c], high[c]);
    qw_free(env, low), qw_free(env, high), qw_free(env, component);
    return extent;
}

/* Whether a triangle is that much longer than high, or has no area. */
static bool is_needle(const qw_trimesh *s, uint32_t f)
{
    assert(f < s->face_count);
    double longest2 = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        double length2 = (double)qw_length2(qw_edge_way(s, h));
        if (length2 > longest2) longest2 = length2;
    }
    return !((double)qw_length(qw_face_cross(s, f)) * NEEDLE >= longest2);
}

typedef struct needle_task {
    const qw_trimesh *surface;
    uint8_t *needle; /* uint8_t[faces]: whether each is one */
} needle_task;

static void find_needles(void *user, uint32_t begin, uint32_t end)
{
    const needle_task *t = user;
    for (uint32_t f = begin; f < end; f++) t->needle[f] = is_needle(t->surface, f);
}

/* Whether the edge of h is a ridge, with needles on either side, which nothing merges. */
static bool is_ridge(const qw_trimesh *s, const uint8_t *needle, uint32_t h)
{
    uint32_t t = s->twin[h];
    if (!needle[h / 3] || t == QW_NONE || t < h || !needle[t / 3]) return false;
    qw_vec3 n = qw_normalize(qw_face_cross(s, h / 3)), m = qw_normalize(qw_face_cross(s, t / 3));
    return !((double)qw_dot(n, m) > QW_SHARP_COSINE);
}

double qw_total_extent(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    double *extent = extents(env, s, census), sum = 0;
    double *ridges = QW_NEW_ZERO(env, double, (size_t)census->components);
    uint8_t *needle = QW_NEW(env, uint8_t, s->face_count);
    qw_parallel(env, s->face_count, QW_GRAIN_LIGHT, find_needles, &(needle_task){s, needle});
    for (uint32_t h = 0; h < 3 * s->face_count; h++)
        if (is_ridge(s, needle, h)) ridges[census->component[h / 3]] += (double)qw_edge_length(s, h);
    for (int64_t c = 0; c < census->components; c++) sum += fmax(extent[c], ridges[c] / RIDGES);
    qw_free(env, extent), qw_free(env, ridges), qw_free(env, needle);
    return sum;
}

/* Boundary loops of each component, int64_t[census->components]. */
static int64_t *count_loops(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    int64_t *loops = QW_NEW_ZERO(env, int64_t, (size_t)census->components);
    if (census->boundary_loops == 0) return loops;
    uint8_t *passed = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)s->face_count);
    for (uint32_t h = 0; h < 3 * s->face_count; h++) {
        if (s->twin[h] != QW_NONE || passed[h]) continue;
        loops[census->component[h / 3]]++;
        for (uint32_t g = h; !passed[g]; g = qw_next_on_boundary(s, g)) passed[g] = 1;
    }
    qw_free(env, passed);
    return loops;
}

/* Twice the Euler number of each component, int64_t[census->components]. */
static int64_t *count_euler(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    int64_t *twice = QW_NEW_ZERO(env, int64_t, (size_t)census->components);
    uint32_t *component = qw_vertex_components(env, s, census);
    for (uint32_t v = 0; v < s->vertex_count; v++) twice[component[v]] += 2;
    for (uint32_t f = 0; f < s->face_count; f++) twice[census->component[f]] += 2;
    for (uint32_t h = 0; h < 3 * s->face_count; h++) twice[census->component[h / 3]] -= s->twin[h] == QW_NONE ? 2 : 1;
    qw_free(env, component);
    return twice;
}

/* The fewest quads of a component of which no edge is double. V vertices, B of them on the boundary, have
   F = V - B / 2 - euler quads: V >= B >= 3 loops, and without a boundary the 2 F edges join V (V - 1) / 2 pairs. */
static int64_t least_quads(int64_t loops, int64_t twice_euler)
{
    if (loops > 0) {
        int64_t twice = 3 * loops - twice_euler;
        return twice > 2 * QW_LEAST_OPEN ? (twice + 1) / 2 : QW_LEAST_OPEN;
    }
    int64_t vertices = 4, euler = twice_euler / 2;
    if (euler > 0) return QW_LEAST_SHELL;
    while (vertices * (vertices - 1) < 4 * (vertices - euler)) vertices++;
    return vertices - euler;
}

double qw_faces_needed(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    int64_t *loops = count_loops(env, s, census), *twice_euler = count_euler(env, s, census);
    double sum = 0;
    for (int64_t c = 0; c < census->components; c++) sum += (double)least_quads(loops[c], twice_euler[c]);
    qw_free(env, loops), qw_free(env, twice_euler);
    return sum;
}

qw_part *qw_list_parts(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    qw_part *part = QW_NEW_ZERO(env, qw_part, (size_t)census->components);
    int64_t *loops = count_loops(env, s, census), *twice_euler = count_euler(env, s, census);
    double *bend = census->components > 1 ? qw_component_bends(env, s, census) : NULL,
           *extent = extents(env, s, census);
    for (int64_t c = 0; c < census->components; c++) {
        part[c].least = loops[c] > 0 ? LEAST_QUADS_OPEN : LEAST_QUADS_CLOSED;
        part[c].is_closed = loops[c] == 0;
        bool is_shell = part[c].is_closed && twice_euler[c] == 4, is_ring = part[c].is_closed && twice_euler[c] == 0;
        /* fields lose other handles and holes sooner */
        part[c].bare = is_shell ? QW_LEAST_SHELL : is_ring ? LEAST_QUADS_RING : part[c].least;
        part[c].bend = bend ? bend[c] : 0, part[c].extent = extent[c]; /* in the centred frame */
    }
    for (uint32_t f = 0; f < s->face_count; f++)
        part[census->component[f]].area += 0.5 * qw_length(qw_face_cross(s, f));
    qw_free(env, bend), qw_free(env, extent), qw_free(env, loops), qw_free(env, twice_euler);
    return part;
}

double *qw_component_shares(qw_env *env, const qw_trimesh *s, const qw_census *census, double quads, qw_part **part)
{
    assert(quads > 0 && census->components > 0);
    double *share = QW_NEW(env, double, (size_t)census->components);
    qw_part *parts = qw_list_parts(env, s, census);
    qw_share_quads(parts, (uint32_t)census->components, quads, share);
    if (part) *part = parts;
    else qw_free(env, parts);
    return share;
}
