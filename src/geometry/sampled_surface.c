/* Triangles of a polygon mesh with their areas, and points spread over them. */
#include "geometry/sampled_surface.h"

#include "geometry/triangulate.h"

#include <assert.h>

/* Adds a triangle with its normal and the sum of areas up to it; not if it has none. */
static void add_triangle(qw_surface *s, const qw_mesh_view *view, double scale, uint32_t a, uint32_t b, uint32_t c)
{
    assert(a < view->vertex_count && b < view->vertex_count && c < view->vertex_count);
    qw_dvec3 p = qw_dpoint(view, a, scale);
    qw_dvec3 n = qw_dcross(qw_dsub(qw_dpoint(view, b, scale), p), qw_dsub(qw_dpoint(view, c, scale), p));
    double length = qw_dlength(n);
    if (!(length > 0)) return;
    uint32_t t = s->mesh.face_count++;
    s->used[a] = s->used[b] = s->used[c] = 1;
    s->mesh.corner[3 * (size_t)t] = a;
    s->mesh.corner[3 * (size_t)t + 1] = b;
    s->mesh.corner[3 * (size_t)t + 2] = c;
    s->area_end[t] = (t ? s->area_end[t - 1] : 0) + 0.5 * length;
    s->normal[t] = qw_v3((float)(n.x / length), (float)(n.y / length), (float)(n.z / length));
}

static bool has_polygons(const qw_mesh_view *view, const uint32_t *face_begin)
{
    for (uint32_t f = 0; f < view->face_count; f++)
        if (face_begin[f + 1] - face_begin[f] > 4) return true;
    return false;
}

static void cut_fans(qw_surface *s, const qw_mesh_view *view, const uint32_t *face_begin, double scale)
{
    for (uint32_t f = 0; f < view->face_count; f++) {
        const uint32_t *c = view->corners + face_begin[f];
        s->face_begin[f] = s->mesh.face_count;
        for (uint32_t k = 1; k + 1 < face_begin[f + 1] - face_begin[f]; k++)
            add_triangle(s, view, scale, c[0], c[k], c[k + 1]);
    }
}

/* A fan of a polygon that is not convex would cover what the polygon does not. */
static void cut_polygons(qw_env *env, qw_surface *s, const qw_mesh_view *view, const uint32_t *face_begin, double scale)
{
    assert(face_begin && view->corners);
    qw_triangles t = qw_triangulate(env, &(qw_clean_input){.vertex_count = view->vertex_count,
                                                           .face_count = view->face_count,
                                                           .position = view->positions,
                                                           .face_begin = face_begin,
                                                           .corner = view->corners});
    uint32_t i = 0;
    for (uint32_t f = 0; f < view->face_count; f++) {
        s->face_begin[f] = s->mesh.face_count;
        for (; i < t.count && t.source[i] == f; i++)
            add_triangle(s, view, scale, t.corner[3 * (size_t)i], t.corner[3 * (size_t)i + 1],
                         t.corner[3 * (size_t)i + 2]);
    }
    qw_free(env, t.corner), qw_free(env, t.source);
}

qw_surface qw_surface_make(qw_env *env, const qw_mesh_view *view, const uint32_t *face_begin, const qw_frame *frame)
{
    assert(face_begin && frame->scale > 0);
    size_t most = face_begin[view->face_count];
    if (most > UINT32_MAX / 3)
        qw_fail(env, QW_TOO_LARGE, -1, "%zu corners are too many to be cut into triangles", most);
    qw_surface s = {.mesh.vertex_count = view->vertex_count};
    s.mesh.position = QW_NEW(env, qw_vec3, view->vertex_count);
    s.mesh.corner = QW_NEW(env, uint32_t, 3 * most);
    s.face_begin = QW_NEW(env, uint32_t, (size_t)view->face_count + 1);
    s.area_end = QW_NEW(env, double, most);
    s.normal = QW_NEW(env, qw_vec3, most);
    s.used = QW_NEW_ZERO(env, uint8_t, view->vertex_count);
    for (uint32_t v = 0; v < view->vertex_count; v++) {
        const double *p = view->positions + 3 * (size_t)v, *c = frame->center;
        s.mesh.position[v] = qw_v3((float)((p[0] - c[0]) * frame->scale), (float)((p[1] - c[1]) * frame->scale),
                                   (float)((p[2] - c[2]) * frame->scale));
    }
    if (has_polygons(view, face_begin)) cut_polygons(env, &s, view, face_begin, frame->scale);
    else cut_fans(&s, view, face_begin, frame->scale);
    s.face_begin[view->face_count] = s.mesh.face_count;
    s.bvh = qw_bvh_build(env, &s.mesh);
    return s;
}

qw_polygon_edges qw_surface_edges(qw_env *env, const qw_surface *s, const qw_mesh_view *view)
{
    assert(s->mesh.corner);
    qw_mesh_view triangles = *view;
    triangles.face_count = s->mesh.face_count;
    triangles.uniform_face_size = 3;
    triangles.face_sizes = NULL;
    triangles.corners = s->mesh.corner;
    return qw_find_polygon_edges(env, &triangles);
}

uint32_t qw_find_in(const double *sums, uint32_t count, double x)
{
    assert(count > 0);
    uint32_t lo = 0, hi = count - 1;
    while (lo < hi) {
        uint32_t middle = lo + (hi - lo) / 2;
        if (sums[middle] > x) hi = middle;
        else lo = middle + 1;
    }
    return lo;
}

qw_vec3 qw_surface_point(const qw_surface *s, uint32_t triangle, float u, float v)
{
    assert(triangle < s->mesh.face_count);
    const uint32_t *c = s->mesh.corner + 3 * (size_t)triangle;
    qw_vec3 a = s->mesh.position[c[0]];
    a = qw_madd(a, u, qw_sub(s->mesh.position[c[1]], s->mesh.position[c[0]]));
    return qw_madd(a, v, qw_sub(s->mesh.position[c[2]], s->mesh.position[c[0]]));
}
