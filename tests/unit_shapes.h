/* Small surfaces of known topology, and the fields and offsets on them, for the tests of single stages. */
#ifndef QW_TEST_UNIT_SHAPES_H
#define QW_TEST_UNIT_SHAPES_H

#include "random.h"
#include "remesh/field/orientation.h"
#include "paper/multiresolution.h"
#include "paper/position.h"
#include "remesh/offsets/subdivide.h"
#include "remesh/offsets/inversions.h"
#include "geometry/quadmesh.h"
#include "geometry/quad_edit.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- fixed-seed randomness */

typedef struct unit_rng {
    uint64_t state;
} unit_rng;

static inline uint32_t unit_random(unit_rng *r, uint32_t below)
{
    random_step(&r->state);
    return (uint32_t)(((r->state >> 33) * below) >> 31);
}
static inline int32_t unit_between(unit_rng *r, int32_t low, int32_t high)
{
    return low + (int32_t)unit_random(r, (uint32_t)(high - low + 1));
}
static inline float unit_real(unit_rng *r) { return (float)unit_random(r, 1u << 24) / 8388608.0f - 1.0f; }
static inline qw_vec3 unit_direction(unit_rng *r)
{
    qw_vec3 v;
    do v = qw_v3(unit_real(r), unit_real(r), unit_real(r));
    while (qw_length2(v) > 1 || qw_length2(v) < 0.01f);
    return qw_normalize(v);
}

/* ---- meshes */

static inline qw_trimesh unit_mesh(qw_env *env, uint32_t vertices, uint32_t faces)
{
    return (qw_trimesh){.vertex_count = vertices,
                        .face_count = faces,
                        .position = QW_NEW_ZERO(env, qw_vec3, vertices),
                        .corner = QW_NEW(env, uint32_t, (size_t)3 * faces),
                        .mark = QW_NEW_ZERO(env, uint8_t, (size_t)3 * faces)};
}

static inline void unit_face(qw_trimesh *m, uint32_t f, uint32_t a, uint32_t b, uint32_t c)
{
    m->corner[3 * f] = a, m->corner[3 * f + 1] = b, m->corner[3 * f + 2] = c;
}

/* nu by nv cells over the unit square, cut along one diagonal; wrap_u and wrap_v close it to a cylinder or torus (>= 3
 * cells then). */
static inline qw_trimesh unit_grid(qw_env *env, uint32_t nu, uint32_t nv, bool wrap_u, bool wrap_v)
{
    uint32_t cu = nu + !wrap_u, cv = nv + !wrap_v, f = 0;
    qw_trimesh m = unit_mesh(env, cu * cv, 2 * nu * nv);
    for (uint32_t j = 0; j < cv; j++)
        for (uint32_t i = 0; i < cu; i++) m.position[j * cu + i] = qw_v3((float)i / (float)nu, (float)j / (float)nv, 0);
    for (uint32_t j = 0; j < nv; j++)
        for (uint32_t i = 0; i < nu; i++) {
            uint32_t i1 = (i + 1) % cu, j1 = (j + 1) % cv;
            uint32_t a = j * cu + i, b = j * cu + i1, c = j1 * cu + i1, d = j1 * cu + i;
            unit_face(&m, f++, a, b, c);
            unit_face(&m, f++, a, c, d);
        }
    qw_trimesh_link(env, &m);
    return m;
}

static inline qw_trimesh unit_torus(qw_env *env, uint32_t nu, uint32_t nv, float tube)
{
    qw_trimesh m = unit_grid(env, nu, nv, true, true);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        float a = m.position[v].x * 6.2831853f, b = m.position[v].y * 6.2831853f, r = 1 + tube * cosf(b);
        m.position[v] = qw_v3(r * cosf(a), r * sinf(a), tube * sinf(b));
    }
    return m;
}

static inline qw_trimesh unit_cylinder(qw_env *env, uint32_t nu, uint32_t nv, float height)
{
    qw_trimesh m = unit_grid(env, nu, nv, true, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        float a = m.position[v].x * 6.2831853f;
        m.position[v] = qw_v3(cosf(a), sinf(a), height * m.position[v].y);
    }
    return m;
}

/* A fan of n triangles around vertex 0; n >= 3. */
static inline qw_trimesh unit_fan(qw_env *env, uint32_t n)
{
    qw_trimesh m = unit_mesh(env, n + 1, n);
    for (uint32_t i = 0; i < n; i++) {
        float a = 6.2831853f * (float)i / (float)n;
        m.position[i + 1] = qw_v3(cosf(a), sinf(a), 0);
        unit_face(&m, i, 0, 1 + i, 1 + (i + 1) % n);
    }
    qw_trimesh_link(env, &m);
    return m;
}

static inline qw_trimesh unit_triangle(qw_env *env)
{
    qw_trimesh m = unit_mesh(env, 3, 1);
    m.position[1] = qw_v3(1, 0, 0), m.position[2] = qw_v3(0, 1, 0);
    unit_face(&m, 0, 0, 1, 2);
    qw_trimesh_link(env, &m);
    return m;
}

static inline qw_trimesh unit_tetrahedron(qw_env *env)
{
    qw_trimesh m = unit_mesh(env, 4, 4);
    m.position[0] = qw_v3(0, 0, 0), m.position[1] = qw_v3(1, 0, 0), m.position[2] = qw_v3(0, 1, 0),
    m.position[3] = qw_v3(0, 0, 1);
    unit_face(&m, 0, 0, 2, 1), unit_face(&m, 1, 0, 1, 3), unit_face(&m, 2, 1, 2, 3), unit_face(&m, 3, 2, 0, 3);
    qw_trimesh_link(env, &m);
    return m;
}

/* Every triangle into four; marks stay on the halves of marked edges. */
static inline qw_trimesh unit_quarter(qw_env *env, const qw_trimesh *from)
{
    uint32_t edges = 0, corners = 3 * from->face_count;
    uint32_t *middle = QW_NEW(env, uint32_t, corners);
    for (uint32_t h = 0; h < corners; h++)
        middle[h] = from->twin[h] < h ? middle[from->twin[h]] : from->vertex_count + edges++;
    qw_trimesh m = unit_mesh(env, from->vertex_count + edges, 4 * from->face_count);
    memcpy(m.position, from->position, from->vertex_count * sizeof *m.position);
    for (uint32_t h = 0; h < corners; h++)
        m.position[middle[h]] = qw_lerp(from->position[from->corner[h]], from->position[from->corner[qw_next(h)]],
                                        0.5f);
    for (uint32_t f = 0; f < from->face_count; f++) {
        const uint32_t *c = from->corner + 3 * f, *e = middle + 3 * f;
        for (uint32_t i = 0; i < 3; i++) {
            unit_face(&m, 4 * f + i, c[i], e[i], e[(i + 2) % 3]);
            m.mark[3 * (4 * f + i)] = from->mark[3 * f + i];
            m.mark[3 * (4 * f + i) + 2] = from->mark[3 * f + (i + 2) % 3];
        }
        unit_face(&m, 4 * f + 3, e[0], e[1], e[2]);
    }
    qw_trimesh_link(env, &m);
    return m;
}

static inline qw_trimesh unit_sphere(qw_env *env, int levels)
{
    static const uint8_t faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                         {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                         {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                         {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const float t = 1.6180340f;
    const float corner[12][3] = {{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                                 {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
    qw_trimesh m = unit_mesh(env, 12, 20);
    for (uint32_t v = 0; v < 12; v++) m.position[v] = qw_v3(corner[v][0], corner[v][1], corner[v][2]);
    for (uint32_t f = 0; f < 20; f++) unit_face(&m, f, faces[f][0], faces[f][1], faces[f][2]);
    qw_trimesh_link(env, &m);
    for (int l = 0; l <= levels; l++) {
        if (l > 0) m = unit_quarter(env, &m);
        for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v] = qw_normalize(m.position[v]);
    }
    return m;
}

/* The surface of the unit cubes named by `solid` ('#' in rows of nx, ny of them, one layer), with sharp edges marked.
 */
static inline qw_trimesh unit_slab(qw_env *env, uint32_t nx, uint32_t ny, const char *solid)
{
    static const int8_t side[6][4][3] = {
        {{0, 0, 0}, {0, 0, 1}, {0, 1, 1}, {0, 1, 0}}, {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}},
        {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, {{0, 1, 0}, {0, 1, 1}, {1, 1, 1}, {1, 1, 0}},
        {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}}, {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
    static const int8_t way[6][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {0, 0}, {0, 0}};
    uint32_t lattice = (nx + 1) * (ny + 1) * 2, vertices = 0, faces = 0;
    uint32_t *number = QW_NEW(env, uint32_t, lattice);
    memset(number, 0xff, lattice * sizeof *number);
    qw_trimesh m = unit_mesh(env, lattice, 12 * nx * ny);
    for (uint32_t cell = 0; cell < nx * ny; cell++) {
        if (solid[cell] != '#') continue;
        int x = (int)(cell % nx), y = (int)(cell / nx);
        for (int s = 0; s < 6; s++) {
            int ox = x + way[s][0], oy = y + way[s][1];
            bool inside = ox >= 0 && oy >= 0 && ox < (int)nx && oy < (int)ny;
            if (s < 4 && inside && solid[oy * (int)nx + ox] == '#') continue;
            uint32_t q[4];
            for (int i = 0; i < 4; i++) {
                int px = x + side[s][i][0], py = y + side[s][i][1], pz = side[s][i][2];
                uint32_t *n = &number[((uint32_t)pz * (ny + 1) + (uint32_t)py) * (nx + 1) + (uint32_t)px];
                if (*n == QW_NONE) m.position[ *n = vertices++] = qw_v3((float)px, (float)py, (float)pz);
                q[i] = *n;
            }
            unit_face(&m, faces++, q[0], q[1], q[2]);
            unit_face(&m, faces++, q[0], q[2], q[3]);
        }
    }
    m.vertex_count = vertices, m.face_count = faces;
    qw_trimesh_link(env, &m);
    for (uint32_t h = 0; h < 3 * faces; h++) {
        qw_vec3 a = qw_normalize(qw_face_cross(&m, h / 3)), b = qw_normalize(qw_face_cross(&m, m.twin[h] / 3));
        m.mark[h] = qw_dot(a, b) < 0.5f;
    }
    return m;
}

static inline qw_trimesh unit_cube(qw_env *env, int levels)
{
    qw_trimesh m = unit_slab(env, 1, 1, "#");
    for (int l = 0; l < levels; l++) m = unit_quarter(env, &m);
    return m;
}

/* Two holes: euler -2. Smoothed, unmarked. */
static inline qw_trimesh unit_double_torus(qw_env *env, int levels)
{
    qw_trimesh m = unit_slab(env, 5, 3, "######.#.######");
    for (int l = 0; l < levels; l++) m = unit_quarter(env, &m);
    memset(m.mark, 0, 3 * m.face_count);
    for (int pass = 0; pass < 12; pass++) {
        qw_vec3 *sum = QW_NEW_ZERO(env, qw_vec3, m.vertex_count);
        float *count = QW_NEW_ZERO(env, float, m.vertex_count);
        for (uint32_t h = 0; h < 3 * m.face_count; h++)
            sum[m.corner[h]] = qw_add(sum[m.corner[h]], m.position[m.corner[qw_next(h)]]), count[m.corner[h]] += 1;
        for (uint32_t v = 0; v < m.vertex_count; v++)
            m.position[v] = qw_lerp(m.position[v], qw_scale(sum[v], 1.0f / count[v]), 0.5f);
    }
    return m;
}

/* Both, side by side without touching. */
static inline qw_trimesh unit_both(qw_env *env, const qw_trimesh *a, const qw_trimesh *b)
{
    qw_trimesh m = unit_mesh(env, a->vertex_count + b->vertex_count, a->face_count + b->face_count);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        m.position[v] = v < a->vertex_count ? a->position[v] : qw_add(b->position[v - a->vertex_count], qw_v3(9, 0, 0));
    for (uint32_t h = 0; h < 3 * m.face_count; h++) {
        bool first = h < 3 * a->face_count;
        m.corner[h] = first ? a->corner[h] : b->corner[h - 3 * a->face_count] + a->vertex_count;
        m.mark[h] = first ? a->mark[h] : b->mark[h - 3 * a->face_count];
    }
    qw_trimesh_link(env, &m);
    return m;
}

/* ---- fields */

typedef struct unit_fields {
    qw_trimesh mesh;
    qw_vec3 *normal, *direction, *orientation, *lattice;
    uint8_t *constraint;
    float *size;
    qw_hierarchy *hierarchy;
    qw_offset_mesh offsets;
} unit_fields;

static inline unit_fields unit_solve(qw_env *env, qw_trimesh mesh, float rho, bool with_boundary)
{
    unit_fields u = {.mesh = mesh};
    u.normal = qw_vertex_normals(env, &mesh);
    qw_find_constraints(env, &mesh, with_boundary, 0.7, NULL, NULL, &u.constraint, &u.direction);
    u.hierarchy = QW_NEW(env, qw_hierarchy, 1);
    *u.hierarchy = qw_hierarchy_build(env, &mesh, u.normal, u.constraint, u.direction);
    u.orientation = qw_orientation_field(env, u.hierarchy, NULL, NULL, 0, NULL, 1);
    u.size = QW_NEW(env, float, mesh.vertex_count);
    for (uint32_t v = 0; v < mesh.vertex_count; v++) u.size[v] = rho;
    u.lattice = qw_position_field(env, u.hierarchy, u.orientation, u.size);
    qw_offset_input in = {&u.mesh,      u.normal,    u.lattice, u.orientation, u.size,
                          u.constraint, u.direction, NULL,      with_boundary, false};
    qw_offset_mesh offsets = qw_integer_offsets(env, &in);
    u.offsets = qw_offset_copy(env, &offsets); /* its triangles are split */
    return u;
}

static inline void unit_remove_inversions(qw_env *env, qw_offset_mesh *m, qw_inversion_counts *counts)
{
    qw_regular_counts regular = qw_make_regular(env, m, QW_FLOW_MCF, true);
    assert_int_equal(regular.irregular_after, 0);
    qw_subdivide_long_edges(env, m);
    qw_remove_inversions_greedy(env, m, counts);
    qw_remove_inversions_sat(env, m, QW_SAT_FAR, counts);
}

/* ---- offsets by hand */

/* The edges as if nothing had been rounded: real is what d is. For the caller that overwrites d. */
static inline void unit_real_of(qw_offset_mesh *m)
{
    for (uint32_t e = 0; e < m->edge_count; e++) m->real[e] = (qw_real2){(float)m->d[e].x, (float)m->d[e].y};
}

/* Offsets on the mesh from whole-number places of its vertices, every edge and triangle in a frame of its own turned at
   random (rng NULL: not turned). place: qw_int2[vertex_count]. The mesh must be a disc or the caller must overwrite d.
 */
static inline qw_offset_mesh unit_offsets(qw_env *env, const qw_trimesh *mesh, const qw_int2 *place, unit_rng *rng)
{
    uint32_t n = mesh->vertex_count, corners = 3 * mesh->face_count;
    qw_offset_mesh m = {.vertex_count = n,
                        .face_count = mesh->face_count,
                        .corner = mesh->corner,
                        .twin = mesh->twin,
                        .mark = mesh->mark};
    m.edge = QW_NEW(env, uint32_t, corners), m.rot = QW_NEW(env, uint8_t, corners),
    m.half = QW_NEW(env, uint32_t, corners);
    m.d = QW_NEW_ZERO(env, qw_int2, corners), m.fixed = QW_NEW_ZERO(env, uint8_t, corners);
    m.real = QW_NEW_ZERO(env, qw_real2, corners);
    m.axis = QW_NEW(env, qw_vec3, corners), m.side = QW_NEW(env, qw_vec3, corners);
    m.position = mesh->position, m.lattice = mesh->position;
    m.normal = QW_NEW(env, qw_vec3, n), m.size = QW_NEW(env, float, n), m.constraint = QW_NEW_ZERO(env, uint8_t, n);
    m.direction = QW_NEW_ZERO(env, qw_vec3, n), m.index = QW_NEW_ZERO(env, int8_t, n);
    for (uint32_t v = 0; v < n; v++) m.normal[v] = qw_v3(0, 0, 1), m.size[v] = 1;
    uint8_t *turned = QW_NEW_ZERO(env, uint8_t, corners);
    for (uint32_t h = 0; h < corners; h++) {
        uint32_t t = mesh->twin[h];
        if (t != QW_NONE && t < h) {
            m.edge[h] = m.edge[t];
            continue;
        }
        uint32_t e = m.edge[h] = m.edge_count++;
        uint32_t own = m.half[e] = t != QW_NONE && rng && unit_random(rng, 2) ? t : h;
        turned[e] = rng ? (uint8_t)unit_random(rng, 4)
                        : 0; /* the edge's x axis is the common x axis turned by so much */
        m.axis[e] = qw_axis(qw_v3(1, 0, 0), qw_v3(0, 0, 1), turned[e]),
        m.side[e] = qw_axis(qw_v3(0, 1, 0), qw_v3(0, 0, 1), turned[e]);
        if (place) m.d[e] = qw_turn(4u - turned[e], qw_int2_sub(place[m.corner[qw_next(own)]], place[m.corner[own]]));
    }
    for (uint32_t f = 0; f < m.face_count; f++) {
        uint32_t frame = rng ? unit_random(rng, 4) : 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            m.rot[h] = (uint8_t)((turned[m.edge[h]] + frame + (m.half[m.edge[h]] == h ? 0u : 2u)) & 3u);
    }
    unit_real_of(&m);
    return qw_offset_copy(env, &m);
}

/* Turns one side of some edges, so that there are cones; index becomes 1 wherever there is one. */
static inline void unit_add_cones(qw_env *env, qw_offset_mesh *m, unit_rng *rng, uint32_t count)
{
    qw_star star = {0};
    for (uint32_t i = 0; i < count; i++) {
        uint32_t h = unit_random(rng, 3 * m->face_count);
        if (m->twin[h] != QW_NONE) m->rot[h] = (m->rot[h] + 1 + unit_random(rng, 3)) & 3u;
    }
    uint32_t *out = qw_offset_outgoing(env, m);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        qw_star_at(env, m, out[v], &star);
        m->index[v] = !star.movable;
    }
}

static inline int64_t unit_inverted_area(const qw_offset_mesh *m)
{
    int64_t sum = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        int32_t det = qw_offset_det(m, f);
        if (det < 0) sum -= det;
    }
    return sum;
}

/* ---- quads */

/* nu by nv quads over the unit square, or closed to a tube or torus; vertices on the boundary lie on curves. */
static inline qw_quadmesh unit_quads(qw_env *env, uint32_t nu, uint32_t nv, bool wrap_u, bool wrap_v)
{
    uint32_t cu = nu + !wrap_u, cv = nv + !wrap_v;
    qw_quadmesh q = {.vertex_count = cu * cv, .face_count = nu * nv};
    q.position = QW_NEW_ZERO(env, qw_vec3, q.vertex_count), q.kind = QW_NEW_ZERO(env, uint8_t, q.vertex_count);
    q.corner = QW_NEW(env, uint32_t, 4 * q.face_count), q.twin = QW_NEW(env, uint32_t, 4 * q.face_count);
    q.mark = QW_NEW_ZERO(env, uint8_t, 4 * q.face_count), q.component = QW_NEW_ZERO(env, uint32_t, q.vertex_count);
    for (uint32_t v = 0; v < q.vertex_count; v++) {
        uint32_t i = v % cu, j = v / cu;
        bool side_u = !wrap_u && (i == 0 || i == nu), side_v = !wrap_v && (j == 0 || j == nv);
        q.kind[v] = side_u && side_v ? QW_VERTEX_CORNER : side_u || side_v ? QW_VERTEX_CURVE : QW_VERTEX_FREE;
        float a = 6.2831853f * (float)i / (float)cu, b = 6.2831853f * (float)j / (float)cv,
              tube = wrap_v ? 1.5f + 0.5f * cosf(b) : 1;
        q.position[v] = !wrap_u ? qw_v3((float)i, (float)j, 0)
                                : qw_v3(tube * cosf(a), tube * sinf(a), wrap_v ? 0.5f * sinf(b) : (float)j);
    }
    for (uint32_t f = 0; f < q.face_count; f++) {
        uint32_t i = f % nu, j = f / nu, *c = q.corner + 4 * f, *t = q.twin + 4 * f, i1 = (i + 1) % cu,
                 j1 = (j + 1) % cv;
        c[0] = j * cu + i, c[1] = j * cu + i1, c[2] = j1 * cu + i1, c[3] = j1 * cu + i;
        t[0] = j > 0 || wrap_v ? 4 * ((j + nv - 1) % nv * nu + i) + 2 : QW_NONE;
        t[1] = i + 1 < nu || wrap_u ? 4 * (j * nu + (i + 1) % nu) + 3 : QW_NONE;
        t[2] = j + 1 < nv || wrap_v ? 4 * ((j + 1) % nv * nu + i) : QW_NONE;
        t[3] = i > 0 || wrap_u ? 4 * (j * nu + (i + nu - 1) % nu) + 1 : QW_NONE;
    }
    qw_quadmesh_validate(env, &q);
    return q;
}

/* A sphere of so many quads, made of three from pole to pole by splitting vertices anywhere, so that many vertices have
 * two edges. */
static inline qw_quadmesh unit_quad_sphere(qw_env *env, unit_rng *r, uint32_t faces)
{
    enum { MOST_FACES = 64 };
    uint32_t corner[12] = {0, 2, 1, 3, 0, 3, 1, 4, 0, 4, 1, 2}, twin[12] = {0}, component[5] = {0};
    uint8_t kind[5] = {0}, mark[12] = {0};
    qw_vec3 position[5] = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-0.5f, 0.9f, 0}, {-0.5f, -0.9f, 0}};
    assert_true(faces <= MOST_FACES);
    for (uint32_t h = 0; h < 12; h++)
        for (uint32_t g = 0; g < 12; g++)
            if (corner[h] == corner[qw_quad_next(g)] && corner[g] == corner[qw_quad_next(h)]) twin[h] = g;
    const qw_quadmesh three = {5, 3, position, corner, twin, kind, mark, component};
    qw_quad_edit e = qw_quad_edit_open(env, &three);
    qw_quad_edit_reserve(&e, faces);
    while (e.mesh.face_count < faces) {
        uint32_t fan[MOST_FACES], n = 0, *out = qw_quadmesh_outgoing(env, &e.mesh),
                                  v = unit_random(r, e.mesh.vertex_count);
        for (uint32_t h = out[v]; n == 0 || h != out[v]; h = qw_quad_around(&e.mesh, h)) fan[n++] = h;
        uint32_t cut = unit_random(r, n), part = 1 + unit_random(r, n - 1);
        if (e.mesh.corner[qw_quad_next(fan[cut])] != e.mesh.corner[qw_quad_next(fan[(cut + part) % n])])
            qw_quad_split_vertex(&e.mesh, fan, n, cut, part);
    }
    return e.mesh;
}

static inline void unit_assert_kept(qw_env *env, const qw_quadmesh *before, const qw_quadmesh *after)
{
    qw_quadmesh_validate(env, after);
    qw_quad_census a = qw_quadmesh_census(env, before), b = qw_quadmesh_census(env, after);
    assert_int_equal(b.vertices, after->vertex_count);
    assert_int_equal(b.double_edges + b.degenerate_faces, 0);
    assert_int_equal(b.euler, a.euler);
    assert_int_equal(b.components, a.components);
    assert_int_equal(b.boundary_loops, a.boundary_loops);
    for (uint32_t v = 0; v < after->vertex_count; v++) {
        qw_vec3 p = after->position[v];
        assert_true(isfinite(p.x) && isfinite(p.y) && isfinite(p.z));
    }
}

/* nx by ny quads over the unit square, its border held. */
static inline qw_quadmesh unit_sheet(qw_env *env, uint32_t nx, uint32_t ny)
{
    uint32_t row = nx + 1, n = row * (ny + 1), faces = nx * ny;
    qw_quadmesh q = {n,
                     faces,
                     QW_NEW(env, qw_vec3, n),
                     QW_NEW(env, uint32_t, 4 * faces),
                     QW_NEW(env, uint32_t, 4 * faces),
                     QW_NEW_ZERO(env, uint8_t, n),
                     QW_NEW_ZERO(env, uint8_t, 4 * faces),
                     QW_NEW_ZERO(env, uint32_t, n)};
    for (uint32_t v = 0; v < n; v++) {
        uint32_t x = v % row, y = v / row;
        bool end_x = x == 0 || x == nx, end_y = y == 0 || y == ny;
        q.position[v] = qw_v3((float)x / (float)nx, (float)y / (float)ny, 0);
        q.kind[v] = end_x && end_y ? QW_VERTEX_CORNER : end_x || end_y ? QW_VERTEX_CURVE : QW_VERTEX_FREE;
    }
    for (uint32_t f = 0; f < faces; f++) {
        uint32_t x = f % nx, y = f / nx, v = y * row + x, *c = q.corner + 4 * f, *t = q.twin + 4 * f;
        c[0] = v, c[1] = v + 1, c[2] = v + row + 1, c[3] = v + row;
        t[0] = y > 0 ? 4 * (f - nx) + 2 : QW_NONE;
        t[1] = x + 1 < nx ? 4 * (f + 1) + 3 : QW_NONE;
        t[2] = y + 1 < ny ? 4 * (f + nx) : QW_NONE;
        t[3] = x > 0 ? 4 * (f - 1) + 1 : QW_NONE;
    }
    qw_quadmesh_validate(env, &q);
    return q;
}

#endif
