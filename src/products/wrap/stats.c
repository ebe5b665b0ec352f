#include "products/wrap/stats.h"

#include "base/elementary.h"
#include "base/sets.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { SAMPLES = 20000 }; /* of the input, evenly by area, at most: one a cell where there are fewer cells */

static double area_of(const qw_wrap_triangles *t, uint32_t i)
{
    double u[3], v[3], n[3];
    const uint32_t *c = t->corner + 3 * (size_t)i;
    for (int k = 0; k < 3; k++) {
        double a = t->position[3 * (size_t)c[0] + (size_t)k];
        u[k] = t->position[3 * (size_t)c[1] + (size_t)k] - a, v[k] = t->position[3 * (size_t)c[2] + (size_t)k] - a;
    }
    qw_cross_doubles(u, v, n);
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
}

/* Walks over samples of the triangles, one after another. */
typedef struct sampling {
    const qw_wrap_triangles *triangles;
    double step, passed; /* areas */
    uint32_t triangle, number, count;
} sampling;

static sampling begin_sampling(const qw_wrap_lattice *l, const qw_wrap_triangles *t)
{
    double area = 0;
    for (uint32_t i = 0; i < t->count; i++) area += area_of(t, i);
    sampling s = {.triangles = t, .count = l->count < SAMPLES ? (uint32_t)l->count : SAMPLES};
    s.step = area / s.count;
    s.passed = t->count ? area_of(t, 0) : 0;
    return s;
}

/* The next of the samples, which are spread evenly over the area; false: there are no more. */
static bool next_sample(sampling *s, double p[3])
{
    const qw_wrap_triangles *t = s->triangles;
    if (s->number == s->count || !(s->step > 0)) return false;
    double wanted = (s->number + 0.5) * s->step;
    while (s->passed < wanted && s->triangle + 1 < t->count) s->passed += area_of(t, ++s->triangle);
    s->number++;
    double u, v;
    qw_spread_in_triangle(s->number, &u, &v);
    assert(s->triangle < t->count);
    const uint32_t *c = t->corner + 3 * (size_t)s->triangle;
    for (size_t k = 0; k < 3; k++)
        p[k] = (1 - u - v) * t->position[3 * (size_t)c[0] + k] + u * t->position[3 * (size_t)c[1] + k] +
               v * t->position[3 * (size_t)c[2] + k];
    return true;
}

double qw_hidden_area(const qw_wrap_lattice *lattice, const qw_wrap_triangles *triangles)
{
    sampling s = begin_sampling(lattice, triangles);
    int64_t hidden = 0, all = 0;
    for (double p[3]; next_sample(&s, p); all++) hidden += !qw_point_is_seen(lattice, p);
    return all ? (double)hidden / (double)all : 0;
}

/* ---- distances */

static qw_bvh *tree_of_skin(qw_env *env, const qw_skin *s, qw_trimesh *mesh)
{
    *mesh = (qw_trimesh){.vertex_count = s->vertex_count, .face_count = s->face_count, .corner = s->corner};
    mesh->position = QW_NEW(env, qw_vec3, s->vertex_count);
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        double p[3] = {s->position[v].at[0], s->position[v].at[1], s->position[v].at[2]};
        mesh->position[v] = qw_in_tree(p);
    }
    return qw_bvh_build(env, mesh);
}

/* The mean distance from what can be seen of the input to the skin, in units of the lattice. */
static double mean_to_skin(qw_env *env, const qw_wrap_lattice *lattice, const qw_wrap_triangles *triangles,
                           const qw_skin *skin)
{
    qw_trimesh mesh;
    qw_bvh *tree = tree_of_skin(env, skin, &mesh);
    sampling s = begin_sampling(lattice, triangles);
    double sum = 0;
    int64_t seen = 0;
    uint32_t hint = QW_NONE;
    for (double p[3]; next_sample(&s, p);) {
        if (!qw_point_is_seen(lattice, p)) continue;
        qw_hit hit = qw_bvh_nearest(tree, qw_in_tree(p), qw_v3(0, 0, 0), -1, 4, hint);
        hint = hit.face, seen++, sum += sqrt((double)hit.distance2) * (1 << QW_LATTICE_BITS);
    }
    return seen ? sum / (double)seen : 0;
}

/* ---- components */

/* Components of the input of which no triangle can be seen. */
static int64_t count_hidden_shells(qw_env *env, const qw_wrap_triangles *t, uint32_t vertex_count,
                                   const uint8_t *visible)
{
    uint32_t *parent = QW_NEW(env, uint32_t, vertex_count);
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, vertex_count); /* of a root: 1: has a triangle; 2: one that is seen */
    int64_t count = 0;
    qw_sets_begin(parent, vertex_count);
    for (uint32_t i = 0; i < t->count; i++)
        for (int k = 1; k < 3; k++)
            qw_join_sets(parent, t->corner[3 * (size_t)i], t->corner[3 * (size_t)i + (size_t)k]);
    for (uint32_t i = 0; i < t->count; i++) seen[qw_set_of(parent, t->corner[3 * (size_t)i])] |= visible[i] ? 3 : 1;
    for (uint32_t v = 0; v < vertex_count; v++) count += seen[v] == 1;
    return count;
}

/* Patches of the skin that touch no input: gaps that it closes. */
static int64_t count_bridges(qw_env *env, const qw_skin *s, const float *touch)
{
    uint32_t *parent = QW_NEW(env, uint32_t, s->face_count);
    double far = QW_WRAP_NEAR * s->frame.side;
    int64_t count = 0;
    for (uint32_t f = 0; f < s->face_count; f++) parent[f] = f;
    for (uint32_t h = 0; h < 3 * s->face_count; h++)
        if ((double)touch[h / 3] > far && (double)touch[s->twin[h] / 3] > far)
            qw_join_sets(parent, h / 3, s->twin[h] / 3);
    for (uint32_t f = 0; f < s->face_count; f++) count += (double)touch[f] > far && parent[f] == f;
    return count;
}

qw_wrap_stats qw_wrap_stats_of(qw_env *env, const qw_wrap_lattice *lattice, const qw_wrap_triangles *triangles,
                               uint32_t vertex_count, const qw_skin *skin, const qw_wrap_target *target,
                               const float *touch)
{
    qw_scope_begin(env);
    qw_wrap_stats s = {.seen_off = mean_to_skin(env, lattice, triangles, skin),
                       .hidden_area = qw_hidden_area(lattice, triangles),
                       .shells = count_hidden_shells(env, triangles, vertex_count, target->visible),
                       .bridges = count_bridges(env, skin, touch)};
    for (uint32_t f = 0; f < skin->face_count; f++) s.skin_off = fmax(s.skin_off, (double)touch[f]);
    qw_scope_end(env);
    return s;
}
