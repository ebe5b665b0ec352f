#include "products/wrap/fill.h"

#include "geometry/loops.h"
#include "products/wrap/hole_fill.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Of the area of its component: a larger fill would lie on the surface itself, as that of the rim of a disc. */
static const double MOST_AREA = 0.8;

typedef struct filling {
    qw_env *env;
    qw_clean *clean;
    const uint32_t *outgoing; /* uint32_t[vertices], of the surface before anything was closed */
    qw_vec3 *position;
    uint32_t *corner, *source, *component;
    size_t position_capacity, corner_capacity, source_capacity, component_capacity;
    uint32_t vertices, faces;
} filling;

typedef struct loop {
    const filling *filling;
    const uint32_t *half; /* the boundary half-edges, so that the surface lies to their left */
    uint32_t count;
} loop;

/* The fill sees the loop the other way around: vertex i of it is the tail of half[count - 1 - i]. */
static uint32_t vertex_of(const loop *l, uint32_t i)
{
    return l->filling->clean->mesh.corner[l->half[l->count - 1 - i]];
}

/* Whether two vertices of a loop have an edge on the surface already. */
static bool is_joined(const void *user, uint32_t a, uint32_t b)
{
    const loop *l = user;
    const qw_trimesh *m = &l->filling->clean->mesh;
    uint32_t v = vertex_of(l, a), w = vertex_of(l, b);
    for (uint32_t h = l->filling->outgoing[v]; h != QW_NONE;) {
        if (m->corner[qw_next(h)] == w || m->corner[qw_prev(h)] == w) return true;
        h = qw_around(m, h);
        if (h == l->filling->outgoing[v]) break;
    }
    return false;
}

/* Sum and number of the neighbours of a boundary vertex that are not its neighbours on the boundary. */
static void look_beside(const qw_trimesh *m, uint32_t first, qw_vec3 *sum, uint32_t *count)
{
    *sum = qw_v3(0, 0, 0), *count = 0;
    for (uint32_t h = qw_around(m, first); h != QW_NONE; h = qw_around(m, h))
        *sum = qw_add(*sum, m->position[m->corner[qw_next(h)]]), ++*count;
}

/* Adds the triangles that fill a loop, and the vertices within, with the source and component of its surroundings. */
static void append(filling *f, const loop *l, const qw_hole_fill *p, uint32_t source, uint32_t component)
{
    qw_env *env = f->env;
    uint32_t first = f->vertices;
    size_t vertices = (size_t)f->vertices + p->vertex_count - l->count, faces = (size_t)f->faces + p->face_count;
    if (vertices >= QW_NONE / 4 || faces >= QW_NONE / 4)
        qw_fail(env, QW_TOO_LARGE, -1, "the surface is too large once its holes are closed");
    f->position = qw_grow(env, f->position, &f->position_capacity, vertices, sizeof *f->position);
    f->corner = qw_grow(env, f->corner, &f->corner_capacity, 3 * faces, sizeof *f->corner);
    f->source = qw_grow(env, f->source, &f->source_capacity, faces, sizeof *f->source);
    f->component = qw_grow(env, f->component, &f->component_capacity, faces, sizeof *f->component);
    for (uint32_t v = l->count; v < p->vertex_count; v++) f->position[f->vertices++] = p->position[v];
    for (uint32_t h = 0; h < 3 * p->face_count; h++) {
        uint32_t v = p->corner[h];
        f->corner[3 * (size_t)f->faces + h] = v < l->count ? vertex_of(l, v) : first + v - l->count;
    }
    for (uint32_t t = 0; t < p->face_count; t++) f->source[f->faces] = source, f->component[f->faces++] = component;
    assert(f->vertices == vertices && f->faces == faces);
}

/* Whether it was closed. */
static bool close_loop(filling *f, const loop *l, const double *area)
{
    qw_env *env = f->env;
    const qw_trimesh *m = &f->clean->mesh;
    uint32_t n = l->count, component = f->clean->component[l->half[0] / 3];
    assert(n >= 3);
    qw_scope_begin(env);
    qw_vec3 *position = QW_NEW(env, qw_vec3, n), *beside = QW_NEW(env, qw_vec3, n);
    uint32_t *degree = QW_NEW(env, uint32_t, n);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t v = vertex_of(l, i);
        position[i] = m->position[v];
        look_beside(m, f->outgoing[v], &beside[i], &degree[i]);
    }
    const qw_hole_rim rim = {n, position, beside, degree, is_joined, l};
    qw_hole_fill p = qw_make_hole_fill(env, &rim);
    bool closes = p.area <= MOST_AREA * area[component];
    if (closes) append(f, l, &p, f->clean->source_face[l->half[0] / 3], component);
    qw_scope_end(env);
    return closes;
}

/* Begins with the surface as it is, in arrays that grow. */
static void copy_surface(filling *f)
{
    const qw_trimesh *m = &f->clean->mesh;
    qw_env *env = f->env;
    f->vertices = m->vertex_count, f->faces = m->face_count;
    f->position = qw_grow(env, NULL, &f->position_capacity, f->vertices, sizeof *f->position);
    f->corner = qw_grow(env, NULL, &f->corner_capacity, 3 * (size_t)f->faces, sizeof *f->corner);
    f->source = qw_grow(env, NULL, &f->source_capacity, f->faces, sizeof *f->source);
    f->component = qw_grow(env, NULL, &f->component_capacity, f->faces, sizeof *f->component);
    memcpy(f->position, m->position, f->vertices * sizeof *f->position);
    memcpy(f->corner, m->corner, 3 * (size_t)f->faces * sizeof *f->corner);
    memcpy(f->source, f->clean->source_face, f->faces * sizeof *f->source);
    memcpy(f->component, f->clean->component, f->faces * sizeof *f->component);
}

/* double[components]. */
static double *component_areas(qw_env *env, const qw_clean *clean)
{
    double *area = QW_NEW_ZERO(env, double, clean->components);
    for (uint32_t f = 0; f < clean->mesh.face_count; f++)
        area[clean->component[f]] += 0.5 * (double)qw_length(qw_face_cross(&clean->mesh, f));
    return area;
}

qw_fill_counts qw_fill_holes(qw_env *env, qw_clean *clean, int64_t edges)
{
    qw_fill_counts counts = {0};
    qw_rims rims = qw_find_rims(env, 3, clean->mesh.twin, clean->mesh.face_count);
    filling f = {.env = env, .clean = clean, .outgoing = qw_trimesh_outgoing(env, &clean->mesh)};
    double *area = component_areas(env, clean);
    copy_surface(&f);
    for (uint32_t i = 0; i < rims.count; i++) {
        const loop l = {&f, rims.half + rims.begin[i], rims.begin[i + 1] - rims.begin[i]};
        uint32_t before = f.faces;
        bool closed = (int64_t)l.count <= edges && close_loop(&f, &l, area);
        counts.holes += closed, counts.left += !closed, counts.triangles += f.faces - before;
        qw_heartbeat(env);
    }
    if (counts.holes > 0) {
        clean->mesh =
            (qw_trimesh){.vertex_count = f.vertices, .face_count = f.faces, .position = f.position, .corner = f.corner};
        clean->source_face = f.source, clean->component = f.component;
        qw_trimesh_link(env, &clean->mesh);
    }
    return counts;
}
