/* Normals for shading, kinds of edges, and the irregular vertices. */
#include "products/render/scene.h"

#include "geometry/triangulate.h"
#include "base/groups.h"

#include <float.h>
#include <math.h>

static const float crease_cosine = 0.766f; /* 40 degrees */
enum { MOST_SMOOTHED = 64 };               /* corners at a vertex; beyond it every face keeps its own normal */

bool scene_box(const qw_mesh_view *mesh, double lo[3], double hi[3])
{
    uint64_t corners = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++)
        corners += mesh->face_sizes ? mesh->face_sizes[f] : mesh->uniform_face_size;
    for (int k = 0; k < 3; k++) lo[k] = DBL_MAX, hi[k] = -DBL_MAX;
    for (uint64_t c = 0; c < corners; c++)
        for (int k = 0; k < 3; k++) {
            double x = mesh->positions[3 * (size_t)mesh->corners[c] + (size_t)k];
            lo[k] = fmin(lo[k], x);
            hi[k] = fmax(hi[k], x);
        }
    return corners > 0;
}

/* Twice the area vector of a polygon, by the fan from its first corner. */
static qw_vec3 area_vector(const scene *s, uint32_t face)
{
    const uint32_t *corner = s->mesh->corners;
    uint32_t begin = s->edges.face_begin[face], end = s->edges.face_begin[face + 1];
    qw_vec3 a = s->position[corner[begin]], sum = {0, 0, 0};
    for (uint32_t c = begin + 1; c + 1 < end; c++)
        sum = qw_add(sum, qw_cross(qw_sub(s->position[corner[c]], a), qw_sub(s->position[corner[c + 1]], a)));
    return sum;
}

/* A normal for each corner: the mean of the faces at its vertex that are not beyond a crease. */
static void find_normals(qw_env *env, scene *s)
{
    uint32_t *begin;
    qw_scope_begin(env);
    const uint32_t *grouped = qw_group(env, s->mesh->corners, s->edges.corner_count, s->mesh->vertex_count, &begin);
    qw_vec3 *area = QW_NEW(env, qw_vec3, s->mesh->face_count), *unit = QW_NEW(env, qw_vec3, s->mesh->face_count);
    for (uint32_t f = 0; f < s->mesh->face_count; f++) {
        area[f] = area_vector(s, f);
        unit[f] = qw_normalize(area[f]);
    }
    for (uint32_t v = 0; v < s->mesh->vertex_count; v++)
        for (uint32_t i = begin[v]; i < begin[v + 1]; i++) {
            uint32_t f = s->edges.face[grouped[i]];
            qw_vec3 sum = {0, 0, 0};
            for (uint32_t j = begin[v]; j < begin[v + 1] && begin[v + 1] - begin[v] <= MOST_SMOOTHED; j++) {
                uint32_t g = s->edges.face[grouped[j]];
                if (qw_dot(unit[f], unit[g]) > crease_cosine) sum = qw_add(sum, area[g]);
            }
            sum = qw_normalize(sum);
            s->normal[grouped[i]] = qw_length2(sum) > 0 ? sum : unit[f];
        }
    qw_scope_end(env);
}

/* What each edge is drawn as, by how many faces it has, and the mean length of edges. */
static void find_kinds(scene *s)
{
    const qw_polygon_edges *e = &s->edges;
    double length = 0;
    for (uint32_t i = 0; i < e->edge_count; i++) {
        uint32_t count = e->edge_begin[i + 1] - e->edge_begin[i], c = e->sorted[e->edge_begin[i]];
        for (uint32_t k = e->edge_begin[i]; k < e->edge_begin[i + 1]; k++)
            s->edge_kind[e->sorted[k]] = count == 1 ? SCENE_BOUNDARY : count == 2 ? SCENE_WIRE : SCENE_NONMANIFOLD;
        length += qw_distance(s->position[s->mesh->corners[c]], s->position[s->mesh->corners[qw_polygon_next(e, c)]]);
    }
    s->mean_edge = e->edge_count ? (float)(length / e->edge_count) : 0;
}

/* Dots at irregular vertices, in a mesh that is mostly quads, by their valence. */
static void find_dots(qw_env *env, scene *s)
{
    for (uint32_t f = 0; f < s->mesh->face_count; f++) {
        uint32_t size = s->edges.face_begin[f + 1] - s->edges.face_begin[f];
        s->quads += size == 4;
        s->triangles += size == 3;
    }
    if (2 * s->quads <= s->mesh->face_count) return;
    qw_valences v = qw_find_valences(env, s->mesh, &s->edges);
    size_t capacity = 0;
    for (uint32_t i = 0; i < s->mesh->vertex_count; i++) {
        uint32_t n = v.valence[i];
        if (n == 0 || n == 4 || v.on_boundary[i]) continue;
        render_kind kind = n < 3 ? RENDER_FEW : n == 3 ? RENDER_THREE : n == 5 ? RENDER_FIVE : RENDER_MANY;
        s->dots = qw_grow(env, s->dots, &capacity, (size_t)s->dot_count + 1, sizeof *s->dots);
        s->dots[s->dot_count++] = (scene_dot){i, kind};
        s->kind_counts[kind]++;
    }
    qw_free(env, v.valence);
    qw_free(env, v.on_boundary);
}

/* The corner of a face at a vertex. */
static uint32_t corner_at(const scene *s, uint32_t face, uint32_t vertex)
{
    uint32_t c = s->edges.face_begin[face];
    while (s->mesh->corners[c] != vertex) c++;
    return c;
}

/* Fans, but for polygons of more than four corners, which may be concave. */
static void find_triangles(qw_env *env, scene *s)
{
    const uint32_t *begin = s->edges.face_begin;
    s->triangle = QW_NEW(env, uint32_t, 3 * (size_t)s->edges.corner_count);
    bool has_polygons = false;
    for (uint32_t f = 0; f < s->mesh->face_count; f++) {
        has_polygons = has_polygons || begin[f + 1] - begin[f] > 4;
        for (uint32_t c = begin[f]; c < begin[f + 1]; c++)
            for (uint32_t k = 0; k < 3; k++) s->triangle[3 * (size_t)c + k] = k == 0 ? begin[f] : c + k - 1;
    }
    if (!has_polygons) return;
    qw_triangles t = qw_triangulate(env, &(qw_clean_input){.vertex_count = s->mesh->vertex_count,
                                                           .face_count = s->mesh->face_count,
                                                           .position = s->mesh->positions,
                                                           .face_begin = begin,
                                                           .corner = s->mesh->corners});
    for (uint32_t i = 0, c = 0; i < t.count; i++) {
        uint32_t f = t.source[i];
        c = i > 0 && t.source[i - 1] == f ? c + 1 : begin[f] + 1;
        if (begin[f + 1] - begin[f] <= 4) continue;
        for (uint32_t k = 0; k < 3; k++) s->triangle[3 * (size_t)c + k] = corner_at(s, f, t.corner[3 * (size_t)i + k]);
    }
    qw_free(env, t.corner), qw_free(env, t.source);
}

scene scene_make(qw_env *env, const qw_mesh_view *mesh, const qw_frame *frame)
{
    scene s = {.mesh = mesh, .follow = -1, .edges = qw_find_polygon_edges(env, mesh)};
    s.position = QW_NEW(env, qw_vec3, mesh->vertex_count);
    s.normal = QW_NEW(env, qw_vec3, s.edges.corner_count);
    s.edge_kind = QW_NEW(env, uint8_t, s.edges.corner_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const double *p = mesh->positions + 3 * (size_t)v, *c = frame->center;
        s.position[v] = qw_v3((float)((p[0] - c[0]) * frame->scale), (float)((p[1] - c[1]) * frame->scale),
                              (float)((p[2] - c[2]) * frame->scale));
    }
    find_triangles(env, &s);
    find_normals(env, &s);
    find_kinds(&s);
    find_dots(env, &s);
    return s;
}
