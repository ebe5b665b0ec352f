/* The working mesh and what it is made of: geometry/tri_edit.c against the invariants of any triangle surface under
 * random operations, geometry/slide.c against brute force, and remesh/working/working.c on surfaces whose right answer
 * is known. */
#include "faults.h"
#include "random.h"
#include "suite.h"
#include "geometry/tri_edit.h"
#include "geometry/slide.h"
#include "geometry/bvh.h"
#include "remesh/working/cluster.h"
#include "remesh/working/working.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- surfaces */

typedef struct builder {
    qw_env *env;
    qw_trimesh mesh;
    size_t vertex_capacity, face_capacity;
} builder;

static uint32_t point(builder *b, double x, double y, double z)
{
    b->mesh.position = qw_grow(b->env, b->mesh.position, &b->vertex_capacity, b->mesh.vertex_count + 1,
                               sizeof(qw_vec3));
    b->mesh.position[b->mesh.vertex_count] = qw_v3((float)x, (float)y, (float)z);
    return b->mesh.vertex_count++;
}

static void triangle(builder *b, uint32_t v0, uint32_t v1, uint32_t v2)
{
    b->mesh.corner = qw_grow(b->env, b->mesh.corner, &b->face_capacity, b->mesh.face_count + 1, 3 * sizeof(uint32_t));
    memcpy(b->mesh.corner + 3 * b->mesh.face_count++, (uint32_t[3]){v0, v1, v2}, 3 * sizeof(uint32_t));
}

static void quad(builder *b, uint32_t v0, uint32_t v1, uint32_t v2, uint32_t v3)
{
    triangle(b, v0, v1, v2);
    triangle(b, v0, v2, v3);
}

/* Links, and marks edges whose normals differ by more than the angle (degrees; 0: none). */
static qw_trimesh finish(builder *b, double sharp)
{
    qw_trimesh_link(b->env, &b->mesh);
    if (sharp > 0) {
        b->mesh.mark = QW_NEW_ZERO(b->env, uint8_t, 3 * b->mesh.face_count);
        qw_vec3 *normal = qw_face_normals(b->env, &b->mesh);
        for (uint32_t h = 0; h < 3 * b->mesh.face_count; h++)
            if (b->mesh.twin[h] != QW_NONE &&
                qw_dot(normal[h / 3], normal[b->mesh.twin[h] / 3]) < cos(sharp * 0.017453292519943295))
                b->mesh.mark[h] = QW_MARK_FEATURE;
    }
    qw_trimesh_validate(b->env, &b->mesh);
    return b->mesh;
}

static void add_box(builder *b, double x, double y, double z, double at)
{
    uint32_t v[8];
    for (int i = 0; i < 8; i++) v[i] = point(b, at + (i & 1 ? x : -x) / 2, (i & 2 ? y : -y) / 2, (i & 4 ? z : -z) / 2);
    quad(b, v[0], v[2], v[3], v[1]);
    quad(b, v[4], v[5], v[7], v[6]);
    quad(b, v[0], v[1], v[5], v[4]);
    quad(b, v[2], v[6], v[7], v[3]);
    quad(b, v[0], v[4], v[6], v[2]);
    quad(b, v[1], v[3], v[7], v[5]);
}

static void add_tetrahedron(builder *b, double size, double at)
{
    uint32_t v[4] = {point(b, at, 0, 0), point(b, at + size, 0, 0), point(b, at, size, 0), point(b, at, 0, size)};
    triangle(b, v[0], v[2], v[1]);
    triangle(b, v[0], v[1], v[3]);
    triangle(b, v[0], v[3], v[2]);
    triangle(b, v[1], v[2], v[3]);
}

static qw_trimesh make_torus(qw_env *env, uint32_t m, uint32_t n, double r)
{
    builder b = {.env = env};
    for (uint32_t i = 0; i < m; i++)
        for (uint32_t j = 0; j < n; j++) {
            double u = 6.283185307179586 * i / m, v = 6.283185307179586 * j / n, w = 0.35 + r * cos(v);
            point(&b, w * cos(u), w * sin(u), r * sin(v));
        }
    for (uint32_t i = 0; i < m; i++)
        for (uint32_t j = 0; j < n; j++) {
            uint32_t i1 = (i + 1) % m, j1 = (j + 1) % n;
            quad(&b, i * n + j, i1 * n + j, i1 * n + j1, i * n + j1);
        }
    return finish(&b, 0);
}

static qw_trimesh make_grid(qw_env *env, uint32_t n, double bend)
{
    builder b = {.env = env};
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j <= n; j++) {
            double x = (double)j / n - 0.5, y = (double)i / n - 0.5;
            point(&b, x, y, bend * (x * x - y * y));
        }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            quad(&b, i * (n + 1) + j, i * (n + 1) + j + 1, (i + 1) * (n + 1) + j + 1, (i + 1) * (n + 1) + j);
    return finish(&b, 0);
}

/* An octahedron, each face cut into n^2 and pushed onto the sphere of radius 0.5. */
static qw_trimesh make_sphere(qw_env *env, uint32_t n)
{
    builder b = {.env = env};
    uint32_t side = 2 * n + 1, *at = QW_NEW(env, uint32_t, (size_t)2 * side * side);
    for (int half = 0; half < 2; half++)
        for (uint32_t i = 0; i < side; i++)
            for (uint32_t j = 0; j < side; j++) {
                double x = (double)i - n, y = (double)j - n, z = n - fabs(x) - fabs(y);
                uint32_t k = (half * side + i) * side + j;
                at[k] = QW_NONE;
                if (z < 0 || (z == 0 && half)) {
                    if (z == 0) at[k] = at[i * side + j];
                    continue;
                }
                double l = 0.5 / sqrt(x * x + y * y + z * z);
                at[k] = point(&b, x * l, y * l, (half ? -z : z) * l);
            }
    for (int half = 0; half < 2; half++)
        for (uint32_t i = 0; i + 1 < side; i++)
            for (uint32_t j = 0; j + 1 < side; j++) {
                const uint32_t *row = at + (half * side + i) * side + j;
                uint32_t q[4] = {row[0], row[side], row[side + 1], row[1]}; /* counter-clockwise from above */
                bool rising = ((double)i + 0.5 - n) * ((double)j + 0.5 - n) > 0;
                uint32_t t[2][3] = {{q[0], q[1], q[3]}, {q[1], q[2], q[3]}};
                if (!rising) memcpy(t, (uint32_t[2][3]){{q[0], q[1], q[2]}, {q[0], q[2], q[3]}}, sizeof t);
                for (int k = 0; k < 2; k++) {
                    if (t[k][0] == QW_NONE || t[k][1] == QW_NONE || t[k][2] == QW_NONE) continue;
                    triangle(&b, t[k][0], t[k][half ? 2 : 1], t[k][half ? 1 : 2]);
                }
            }
    return finish(&b, 0);
}

/* A disc of radius 0.5 round a hole; n points on either. */
static qw_trimesh make_annulus(qw_env *env, uint32_t n, double hole)
{
    builder b = {.env = env};
    for (uint32_t i = 0; i < n; i++) {
        double u = 6.283185307179586 * i / n;
        point(&b, 0.5 * cos(u), 0.5 * sin(u), 0);
        point(&b, hole * cos(u), hole * sin(u), 0);
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t j = (i + 1) % n;
        quad(&b, 2 * i, 2 * j, 2 * j + 1, 2 * i + 1);
    }
    return finish(&b, 0);
}

static qw_trimesh make_disc(qw_env *env, uint32_t n)
{
    builder b = {.env = env};
    point(&b, 0, 0, 0);
    for (uint32_t i = 0; i < n; i++)
        point(&b, 0.5 * cos(6.283185307179586 * i / n), 0.5 * sin(6.283185307179586 * i / n), 0);
    for (uint32_t i = 0; i < n; i++) triangle(&b, 0, 1 + i, 1 + (i + 1) % n);
    return finish(&b, 0);
}

/* A square in which every horizontal line has 3 k points above and k below, so that a row of zero-area caps joins the
 * two. */
static qw_trimesh make_capped(qw_env *env)
{
    enum { ROWS = 6, K = 4 };
    builder b = {.env = env};
    uint32_t first[ROWS + 1][2];
    for (uint32_t i = 0; i <= ROWS; i++)
        for (uint32_t fine = 0; fine < 2; fine++) {
            first[i][fine] = b.mesh.vertex_count;
            uint32_t n = fine ? 3 * K : K;
            for (uint32_t j = 0; j <= n; j++)
                if (!fine || j % 3) point(&b, (double)j / n - 0.5, (double)i / ROWS - 0.5, 0);
        }
    for (uint32_t i = 0; i < ROWS; i++)
        for (uint32_t j = 0; j < K; j++) {
            uint32_t a = first[i][0] + j, c = first[i + 1][0] + j, f = first[i + 1][1] + 2 * j;
            quad(&b, a, a + 1, c + 1, f + 1);
            quad(&b, a, f + 1, f, c);
            if (i + 1 == ROWS) continue;
            triangle(&b, c, f, c + 1); /* the caps: c, f, f + 1 and c + 1 lie on one line */
            triangle(&b, f, f + 1, c + 1);
        }
    /* The fine points of the first line are not used. */
    for (uint32_t h = 0; h < 3 * b.mesh.face_count; h++)
        if (b.mesh.corner[h] >= first[0][1]) b.mesh.corner[h] -= first[1][0] - first[0][1];
    uint32_t unused = first[1][0] - first[0][1];
    memmove(b.mesh.position + first[0][1], b.mesh.position + first[1][0],
            (b.mesh.vertex_count - first[1][0]) * sizeof(qw_vec3));
    b.mesh.vertex_count -= unused;
    return finish(&b, 0);
}

/* ---- measures */

static bool on_curve(const qw_trimesh *mesh, uint32_t h)
{
    return mesh->twin[h] == QW_NONE || (mesh->mark && mesh->mark[h]);
}

static float edge_length(const qw_trimesh *mesh, uint32_t h)
{
    return qw_distance(mesh->position[mesh->corner[h]], mesh->position[mesh->corner[qw_next(h)]]);
}

static double curve_length(const qw_trimesh *mesh, bool boundary)
{
    double sum = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (boundary ? mesh->twin[h] == QW_NONE : mesh->twin[h] != QW_NONE && on_curve(mesh, h))
            sum += edge_length(mesh, h);
    return boundary ? sum : sum / 2;
}

static double volume(const qw_trimesh *mesh)
{
    double sum = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++)
        sum += qw_dot(mesh->position[mesh->corner[3 * f]], qw_face_cross(mesh, f));
    return sum / 6;
}

static double least_angle(const qw_trimesh *mesh)
{
    double least = 180;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        qw_vec3 p = mesh->position[mesh->corner[h]], a = qw_sub(mesh->position[mesh->corner[qw_next(h)]], p),
                b = qw_sub(mesh->position[mesh->corner[qw_prev(h)]], p);
        least = fmin(least, 57.29577951308232 * atan2(qw_length(qw_cross(a, b)), qw_dot(a, b)));
    }
    return least;
}

/* Share of edges within a range of lengths, in targets. */
static double share_between(const qw_working *w, double least, double most)
{
    double in = 0;
    for (uint32_t h = 0; h < 3 * w->mesh.face_count; h++) {
        double l = edge_length(&w->mesh, h) /
                   (0.5 * (w->target[w->mesh.corner[h]] + w->target[w->mesh.corner[qw_next(h)]]));
        in += l >= least && l <= most;
    }
    return in / (3.0 * w->mesh.face_count);
}

static qw_vec3 nearest_by_brute_force(const qw_trimesh *mesh, qw_vec3 p)
{
    qw_vec3 best = mesh->position[0];
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        qw_vec3 c[4], n = qw_face_cross(mesh, f);
        for (uint32_t i = 0; i < 4; i++) c[i] = mesh->position[mesh->corner[3 * f + i % 3]];
        float n2 = qw_length2(n);
        bool inside = n2 > 0;
        for (uint32_t i = 0; i < 3; i++) {
            qw_vec3 d = qw_sub(c[i + 1], c[i]);
            float t = fminf(fmaxf(qw_dot(qw_sub(p, c[i]), d) / fmaxf(qw_length2(d), 1e-30f), 0), 1);
            qw_vec3 q = qw_madd(c[i], t, d);
            if (qw_distance(p, q) < qw_distance(p, best)) best = q;
            inside = inside && qw_dot(qw_cross(d, qw_sub(p, c[i])), n) >= 0;
        }
        qw_vec3 q = inside ? qw_madd(p, -qw_dot(qw_sub(p, c[0]), n) / n2, n) : best;
        if (qw_distance(p, q) < qw_distance(p, best)) best = q;
    }
    return best;
}

/* The largest distance of the vertices of one mesh from the other. */
static double largest_distance(const qw_trimesh *from, const qw_trimesh *to)
{
    double worst = 0;
    for (uint32_t v = 0; v < from->vertex_count; v++)
        worst = fmax(worst, qw_distance(from->position[v], nearest_by_brute_force(to, from->position[v])));
    return worst;
}

static qw_working run_with(qw_env *env, const qw_trimesh *mesh, const float *target)
{
    qw_census census = qw_trimesh_census(env, mesh);
    qw_working w = qw_working_mesh(env, mesh, &census, target, NULL);
    qw_trimesh_validate(env, &w.mesh);
    qw_census before = qw_trimesh_census(env, mesh), after = qw_trimesh_census(env, &w.mesh);
    assert_int_equal(before.components, after.components);
    assert_int_equal(before.boundary_loops, after.boundary_loops);
    assert_int_equal(before.euler, after.euler);
    uint8_t *bound = QW_NEW_ZERO(env, uint8_t, w.mesh.vertex_count);
    for (uint32_t h = 0; h < 3 * w.mesh.face_count; h++)
        if (on_curve(&w.mesh, h)) bound[w.mesh.corner[h]] = bound[w.mesh.corner[qw_next(h)]] = 1;
    for (uint32_t f = 0; f < w.mesh.face_count; f++) {
        const uint32_t *c = w.mesh.corner + 3 * f;
        assert_true(on_curve(&w.mesh, 3 * f) + on_curve(&w.mesh, 3 * f + 1) + on_curve(&w.mesh, 3 * f + 2) <= 1);
        assert_false(bound[c[0]] && bound[c[1]] && bound[c[2]]);
    }
    return w;
}

static qw_working run(qw_env *env, const qw_trimesh *mesh, float length)
{
    float *target = QW_NEW(env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) target[v] = length;
    return run_with(env, mesh, target);
}

/* ---- environments */

/* Each test body runs protected, and must leave nothing behind. */
static void check(void (*body)(void *env))
{
    qw_env *env = qw_env_create(NULL, 2);
    qw_scope_begin(env);
    qw_status status = qw_protect(env, body, env);
    if (status != QW_OK) print_error("%s\n", qw_env_message(env));
    assert_int_equal(status, QW_OK);
    qw_scope_end(env);
    assert_int_equal(qw_env_bytes(env), 0);
    qw_env_destroy(env);
}
#define TEST(name)                                                      \
    static void name##_body(void *env);                                 \
    static void name(void **state) { (void)state, check(name##_body); } \
    static void name##_body(void *env)

/* ---- edit, slide */

static uint32_t random_below(uint64_t *state, uint32_t n)
{
    random_step(state);
    return (uint32_t)((*state >> 33) % n);
}

static void edit_at_random(qw_env *env, qw_trimesh *mesh, uint64_t seed)
{
    float *target = QW_NEW(env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) target[v] = 1;
    qw_census before = qw_trimesh_census(env, mesh);
    qw_edit e = qw_edit_open(env, mesh, target, qw_trimesh_outgoing(env, mesh));
    uint32_t collapses = 0, flips = 0;
    for (uint32_t round = 0; round < 40; round++) {
        for (uint32_t i = 0; i < 60; i++) {
            uint32_t f = random_below(&seed, e.face_count), h = 4 * f + random_below(&seed, 3),
                     what = random_below(&seed, 8);
            if (qw_edit_dead(&e, f)) continue;
            uint32_t a = qw_edit_tail(&e, h), b = qw_edit_head(&e, h);
            qw_vec3 middle = qw_lerp(e.vertex[a].position, e.vertex[b].position, 0.5f);
            if (what == 0 && e.live_faces < 300) qw_edit_split(&e, h, middle, 1, 0);
            else if (what == 1 && e.live_faces < 300) qw_edit_split_face(&e, f, middle, 1, 0);
            else if (what < 4 && qw_edit_twin(&e, h) != QW_NONE && !qw_edit_mark(&e, h) && qw_edit_can_flip(&e, h))
                qw_edit_flip(&e, h), flips++;
            else if (what >= 4 && e.live_faces > 1 && qw_edit_can_collapse(&e, h))
                qw_edit_collapse(&e, h, what & 1 ? a : b), collapses++;
        }
        qw_edit_pack(&e);
        float *lengths;
        qw_trimesh now = qw_edit_close(&e, &lengths);
        qw_trimesh_validate(env, &now);
        qw_census after = qw_trimesh_census(env, &now);
        assert_int_equal(before.components, after.components);
        assert_int_equal(before.boundary_loops, after.boundary_loops);
        assert_int_equal(before.euler, after.euler);
        const uint32_t *outgoing = qw_trimesh_outgoing(env, &now);
        for (uint32_t v = 0; v < now.vertex_count; v++) {
            uint32_t h = e.vertex[v].out;
            assert_int_equal(qw_edit_tail(&e, h), v);
            if (now.twin[outgoing[v]] == QW_NONE) assert_int_equal(qw_edit_twin(&e, h), QW_NONE);
        }
    }
    assert_true(collapses > 100 && flips > 50);
}

TEST(edits_keep_the_topology)
{
    builder small = {.env = env}, cube = {.env = env};
    add_tetrahedron(&small, 1, 0);
    add_tetrahedron(&small, 1, 3);
    qw_trimesh tetrahedra = finish(&small, 0), torus = make_torus(env, 5, 4, 0.1), grid = make_grid(env, 4, 0),
               disc = make_disc(env, 3);
    qw_trimesh annulus = make_annulus(env, 4, 0.1);
    add_box(&cube, 1, 1, 1, 0);
    qw_trimesh box = finish(&cube, 30);
    for (uint64_t seed = 1; seed <= 6; seed++) {
        edit_at_random(env, &tetrahedra, seed);
        edit_at_random(env, &torus, seed);
        edit_at_random(env, &grid, seed);
        edit_at_random(env, &disc, seed);
        edit_at_random(env, &annulus, seed);
        edit_at_random(env, &box, seed);
    }
}

TEST(edits_carry_marks)
{
    builder b = {.env = env};
    add_box(&b, 1, 1, 1, 0);
    qw_trimesh mesh = finish(&b, 30);
    float ones[8] = {1, 1, 1, 1, 1, 1, 1, 1}, *target;
    qw_edit e = qw_edit_open(env, &mesh, ones, qw_trimesh_outgoing(env, &mesh));
    uint32_t marked = 0;
    for (uint32_t f = 0; f < 12; f++)
        for (uint32_t h = 4 * f; h < 4 * f + 3; h++) {
            if (!qw_edit_mark(&e, h) || qw_edit_twin(&e, h) < h) continue;
            qw_vec3 a = e.vertex[qw_edit_tail(&e, h)].position, c = e.vertex[qw_edit_head(&e, h)].position;
            uint32_t m = qw_edit_split(&e, h, qw_lerp(a, c, 0.5f), 1, 0);
            assert_int_equal(qw_edit_head(&e, h), m);
            assert_int_equal(e.vertex[m].kind, QW_VERTEX_CURVE);
            marked++;
        }
    assert_in_range(marked, 8, 12); /* splitting moves some edges to faces already passed */
    qw_edit_pack(&e);
    qw_trimesh split = qw_edit_close(&e, &target);
    qw_trimesh_validate(env, &split);
    assert_float_equal(curve_length(&split, false), 12, 1e-5);
}

TEST(slides_find_the_nearest_point)
{
    qw_trimesh mesh = make_sphere(env, 12);
    const uint32_t *outgoing = qw_trimesh_outgoing(env, &mesh);
    uint64_t seed = 7;
    for (uint32_t i = 0; i < 300; i++) {
        uint32_t from = random_below(&seed, 3 * mesh.face_count);
        qw_vec3 p = mesh.position[mesh.corner[from]];
        float *c = &p.x;
        for (int k = 0; k < 3; k++)
            c[k] += ((float)random_below(&seed, 2001) - 1000) * 1e-4f; /* up to two edges away */
        if (qw_length(p) < 0.51f) continue; /* from inside, every face of a convex body is a local minimum */
        qw_surface_point at = qw_slide_on_surface(&mesh, outgoing, from, p, 0);
        qw_vec3 best = nearest_by_brute_force(&mesh, p);
        assert_float_equal(sqrtf(at.distance2), qw_distance(p, best), 1e-5);
    }
}

TEST(slides_follow_a_curve_up_to_its_end)
{
    qw_trimesh grid = make_grid(env, 10, 0);
    const uint32_t *outgoing = qw_trimesh_outgoing(env, &grid);
    uint8_t *stop = QW_NEW_ZERO(env, uint8_t, grid.vertex_count);
    stop[10] = 1; /* the corner at (0.5, -0.5) */
    uint32_t from = outgoing[3];
    assert_int_equal(grid.twin[from], QW_NONE);
    qw_surface_point at = qw_slide_on_curve(&grid, outgoing, stop, from, qw_v3(0.23f, -0.4f, 0.1f));
    assert_float_equal(at.point.x, 0.23, 1e-6);
    assert_float_equal(at.point.y, -0.5, 1e-6);
    at = qw_slide_on_curve(&grid, outgoing, stop, from, qw_v3(0.9f, 0.3f, 0));
    assert_float_equal(at.point.x, 0.5, 1e-6);
    assert_float_equal(at.point.y, -0.5, 1e-6);
    at = qw_slide_from_corner(&grid, outgoing, stop, 10, qw_v3(0.6f, 0.21f, 0)); /* the other side of the corner */
    assert_float_equal(at.point.x, 0.5, 1e-6);
    assert_float_equal(at.point.y, 0.21, 1e-6);
}

/* ---- working */

TEST(a_cube_keeps_corners_and_edges)
{
    builder b = {.env = env};
    add_box(&b, 1, 1, 1, 0);
    qw_trimesh mesh = finish(&b, 30);
    qw_working w = run(env, &mesh, 0.07f);
    assert_float_equal(curve_length(&w.mesh, false), 12, 1e-3);
    assert_float_equal(volume(&w.mesh), 1, 1e-5);
    assert_float_equal(qw_trimesh_area(&w.mesh), 6, 1e-4);
    assert_true(largest_distance(&w.mesh, &mesh) < 1e-6 && largest_distance(&mesh, &w.mesh) < 1e-6);
    assert_true(share_between(&w, 0.6, 1.5) > 0.995);
    assert_true(least_angle(&w.mesh) > 18);
}

TEST(a_long_thin_box_stays_one)
{
    builder b = {.env = env};
    add_box(&b, 1, 0.01, 0.002, 0);
    qw_trimesh mesh = finish(&b, 30);
    qw_working w = run(env, &mesh, 0.02f);
    assert_float_equal(curve_length(&w.mesh, false), 4 * 1.012, 1e-3);
    assert_float_equal(volume(&w.mesh), 2e-5, 1e-8);
    assert_true(largest_distance(&mesh, &w.mesh) < 1e-6);
}

TEST(a_dense_cube_is_coarsened_along_its_edges)
{
    builder b = {.env = env};
    add_box(&b, 1, 1, 1, 0);
    qw_trimesh mesh = finish(&b, 30);
    qw_working dense = run(env, &mesh, 0.02f), w = run(env, &dense.mesh, 0.1f);
    assert_true(w.mesh.face_count * 10 < dense.mesh.face_count);
    assert_float_equal(curve_length(&w.mesh, false), 12, 1e-3);
    assert_float_equal(volume(&w.mesh), 1, 1e-5);
    assert_true(share_between(&w, 0.6, 1.5) > 0.98);
}

static qw_trimesh condensed(qw_env *env, const qw_trimesh *mesh, float length)
{
    qw_census census = qw_trimesh_census(env, mesh);
    float *target = QW_NEW(env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) target[v] = length;
    qw_trimesh result = qw_condensed_mesh(env, mesh, &census, target);
    qw_trimesh_validate(env, &result);
    qw_census after = qw_trimesh_census(env, &result);
    assert_int_equal(after.components, census.components);
    assert_int_equal(after.euler, census.euler);
    assert_int_equal(after.boundary_loops, census.boundary_loops);
    return result;
}

/* Exactly on the surface, with its edges, corners and boundary; and a small component keeps its shape. */
TEST(dense_surfaces_are_condensed)
{
    builder b = {.env = env};
    add_box(&b, 1, 1, 1, 0);
    qw_trimesh box = finish(&b, 30), dense = run(env, &box, 0.01f).mesh, cube = condensed(env, &dense, 0.05f);
    assert_true(cube.face_count * 8 < dense.face_count);
    assert_float_equal(curve_length(&cube, false), 12, 1e-3);
    assert_float_equal(volume(&cube), 1, 1e-5);
    qw_trimesh grid = make_grid(env, 100, 0.5), bent = condensed(env, &grid, 0.04f);
    assert_true(bent.face_count * 6 < grid.face_count);
    assert_true(largest_distance(&bent, &grid) < 1e-6);
    assert_true(largest_distance(&grid, &bent) < 0.1 * 0.04);
    assert_float_equal(curve_length(&bent, true), curve_length(&grid, true), 0.01);
    qw_trimesh sphere = make_sphere(env, 40), small = condensed(env, &sphere, 10);
    assert_true(small.face_count < sphere.face_count / 2 && small.face_count > 1000);
    assert_float_equal(volume(&small), volume(&sphere), 0.01 * volume(&sphere));
}

static qw_clustered clustered(qw_env *env, const qw_trimesh *mesh, float size)
{
    qw_census census = qw_trimesh_census(env, mesh);
    float *cell = QW_NEW(env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) cell[v] = size;
    qw_clustered r;
    assert_true(qw_cluster(env, mesh, census.component, (uint32_t)census.components, cell, &r));
    qw_trimesh_validate(env, &r.mesh);
    qw_census after = qw_trimesh_census(env, &r.mesh);
    assert_int_equal(after.components, census.components);
    assert_int_equal(after.euler, census.euler);
    assert_int_equal(after.boundary_loops, census.boundary_loops);
    for (uint32_t f = 0; f < r.mesh.face_count; f++) assert_int_equal(r.component[f], after.component[f]);
    qw_bvh *tree = qw_bvh_build(env, &r.mesh);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        qw_hit hit = qw_bvh_nearest(tree, mesh->position[v], qw_v3(0, 0, 0), -1, 1, QW_NONE);
        assert_true(qw_distance(hit.point, mesh->position[v]) < 0.2f * size);
    }
    return r;
}

/* Of the same topology, near the surface, with its boundary and its edges; also where a cell holds a whole handle. */
TEST(dense_surfaces_are_clustered)
{
    qw_trimesh torus = make_torus(env, 300, 150, 0.15);
    qw_clustered round = clustered(env, &torus, 0.05f);
    assert_true(round.mesh.face_count * 8 < torus.face_count);
    for (uint32_t v = 0; v < round.mesh.vertex_count; v++)
        assert_memory_equal(&round.mesh.position[v], &torus.position[round.origin[v]], sizeof(qw_vec3));
    qw_trimesh wire = make_torus(env, 2000, 40, 0.01f), grid = make_grid(env, 200, 0.5);
    assert_true(clustered(env, &wire, 0.03f).mesh.face_count * 2 < wire.face_count);
    qw_clustered bent = clustered(env, &grid, 0.04f);
    assert_float_equal(curve_length(&bent.mesh, true), curve_length(&grid, true), 1e-6);
    builder b = {.env = env};
    add_box(&b, 1, 1, 1, 0);
    add_box(&b, 1, 1, 1, 2);
    qw_trimesh boxes = finish(&b, 30), dense = run(env, &boxes, 0.015f).mesh;
    qw_clustered box = clustered(env, &dense, 0.05f);
    assert_true(box.mesh.face_count * 3 < dense.face_count);
    assert_float_equal(curve_length(&box.mesh, false), 24, 1e-3);
    assert_float_equal(volume(&box.mesh), 2, 1e-5);
}

TEST(open_grids_keep_their_boundary)
{
    for (uint32_t n = 1; n <= 64; n *= 8) {
        qw_trimesh mesh = make_grid(env, n, 0);
        qw_working w = run(env, &mesh, 0.06f);
        assert_float_equal(curve_length(&w.mesh, true), 4, 1e-4);
        assert_float_equal(qw_trimesh_area(&w.mesh), 1, 1e-5);
        assert_true(share_between(&w, 0.6, 1.5) > 0.98);
    }
    qw_trimesh bent = make_grid(env, 80, 0.5);
    qw_working w = run(env, &bent, 0.05f);
    assert_true(largest_distance(&w.mesh, &bent) < 1e-6);
    assert_true(largest_distance(&bent, &w.mesh) < 0.1 * 0.05);
}

TEST(tori_and_spheres_are_followed)
{
    qw_trimesh coarse = make_torus(env, 12, 6, 0.15), dense = make_torus(env, 120, 60, 0.15),
               sphere = make_sphere(env, 40);
    qw_trimesh *mesh[3] = {&coarse, &dense, &sphere};
    for (int i = 0; i < 3; i++) {
        float target = 0.05f;
        qw_working w = run(env, mesh[i], target);
        assert_true(largest_distance(&w.mesh, mesh[i]) < 1e-6);
        assert_true(largest_distance(mesh[i], &w.mesh) < (i == 0 ? 0.3 : 0.15) * target);
        assert_true(share_between(&w, 0.6, 1.5) > 0.99);
        assert_true(least_angle(&w.mesh) > 25);
    }
}

TEST(tiny_components_and_coarse_targets_leave_room)
{
    builder b = {.env = env};
    add_box(&b, 1, 1, 1, 0);
    add_tetrahedron(&b, 1e-3, 2);
    add_tetrahedron(&b, 1e-5, 3);
    qw_trimesh mesh = finish(&b, 30);
    qw_working w = run(env, &mesh, 5);
    qw_census census = qw_trimesh_census(env, &w.mesh);
    uint32_t faces[3] = {0};
    for (uint32_t f = 0; f < w.mesh.face_count; f++) faces[census.component[f]]++;
    for (int i = 0; i < 3; i++) assert_in_range(faces[i], 24, 400);
    assert_float_equal(curve_length(&w.mesh, false), curve_length(&mesh, false), 1e-4);
    builder fragments = {.env = env}; /* a few units in the last place across */
    add_tetrahedron(&fragments, 2e-7, 0.4);
    add_tetrahedron(&fragments, 1e-6, 0.3);
    add_tetrahedron(&fragments, 0, 0.2);
    qw_trimesh tiny = finish(&fragments, 0);
    run(env, &tiny, 0.1f);
    qw_trimesh dense = make_sphere(env, 30);
    w = run(env, &dense, 3);
    assert_in_range(w.mesh.face_count, 24, 120);
}

TEST(small_discs_and_thin_holes_survive)
{
    for (uint32_t n = 3; n <= 6; n++) {
        qw_trimesh disc = make_disc(env, n);
        qw_working w = run(env, &disc, 0.1f);
        assert_float_equal(curve_length(&w.mesh, true), curve_length(&disc, true), 1e-4);
        assert_float_equal(qw_trimesh_area(&w.mesh), qw_trimesh_area(&disc), 1e-5);
        w = run(env, &disc, 9);
        assert_true(w.mesh.face_count >= 24);
    }
    const double holes[] = {0.45, 0.1, 0.01, 0.001};
    for (int i = 0; i < 4; i++) {
        qw_trimesh mesh = make_annulus(env, 128, holes[i]);
        qw_working w = run(env, &mesh, 0.08f);
        assert_true(fabs(qw_trimesh_area(&w.mesh) / qw_trimesh_area(&mesh) - 1) < 0.02);
    }
}

TEST(caps_of_no_area_vanish)
{
    qw_trimesh mesh = make_capped(env);
    assert_true(least_angle(&mesh) < 1e-3);
    const float targets[] = {0.3f, 0.1f, 0.03f};
    for (int i = 0; i < 3; i++) {
        qw_working w = run(env, &mesh, targets[i]);
        assert_true(least_angle(&w.mesh) > 10);
        assert_float_equal(qw_trimesh_area(&w.mesh), 1, 1e-5);
        assert_float_equal(curve_length(&w.mesh, true), 4, 1e-4);
    }
}

TEST(coarse_triangles_are_cut_without_slivers)
{
    builder b = {.env = env};
    point(&b, 0, 0, 0);
    point(&b, 1, 0, 0);
    point(&b, 0.1, 0.31, 0);
    triangle(&b, 0, 1, 2);
    qw_trimesh mesh = finish(&b, 0);
    for (float target = 0.3f; target > 0.005f; target *= 0.6f) {
        qw_working w = run(env, &mesh, target);
        assert_true(least_angle(&w.mesh) > 7); /* the corner of 19 degrees is halved */
        assert_float_equal(qw_trimesh_area(&w.mesh), 0.155, 1e-5);
    }
}

/* Cut each by itself, 600 slivers of up to 0.5 would make some 100,000 faces. */
TEST(slivers_of_a_fan_are_merged)
{
    enum { SLIVERS = 600 };
    for (int apex = 0; apex <= SLIVERS; apex += SLIVERS / 2) {
        builder b = {.env = env};
        for (int i = 0; i <= SLIVERS; i++) point(&b, (double)i / SLIVERS, 0, 0);
        point(&b, (double)apex / SLIVERS, 0.01, 0);
        for (uint32_t i = 0; i < SLIVERS; i++) triangle(&b, i, i + 1, SLIVERS + 1);
        qw_trimesh mesh = finish(&b, 0);
        qw_working w = run(env, &mesh, 0.002f);
        assert_true(w.mesh.face_count < 8000);
        assert_float_equal(qw_trimesh_area(&w.mesh), 0.005, 1e-6);
        assert_float_equal(curve_length(&w.mesh, true), curve_length(&mesh, true), 1e-4);
    }
}

TEST(thin_protrusions_lower_the_target)
{
    qw_trimesh mesh = make_torus(env, 1000, 12, 0.003);
    qw_working w = run(env, &mesh, 0.05f);
    assert_true(share_between(&w, 0.35, 1.5) > 0.95);
    double lowered = 0;
    for (uint32_t v = 0; v < w.mesh.vertex_count; v++) lowered += w.target[v] < 0.025f;
    assert_true(lowered > 0.5 * w.mesh.vertex_count);
    assert_true(least_angle(&w.mesh) > 5);
    assert_true(volume(&w.mesh) > 0.25 * volume(&mesh)); /* a triangle in a circle has 0.41 of it */
}

TEST(targets_may_vary)
{
    qw_trimesh mesh = make_grid(env, 20, 0.2);
    float *target = QW_NEW(env, float, mesh.vertex_count);
    for (uint32_t v = 0; v < mesh.vertex_count; v++) target[v] = 0.02f + 0.08f * (mesh.position[v].x + 0.5f);
    qw_working w = run_with(env, &mesh, target);
    assert_true(share_between(&w, 0.6, 1.5) > 0.97);
    for (uint32_t v = 0; v < w.mesh.vertex_count; v++)
        assert_float_equal(w.target[v], 0.02f + 0.08f * (w.mesh.position[v].x + 0.5f), 0.012);
}

/* ---- same bytes, failing calls */

static uint64_t hash_of(const qw_working *w)
{
    uint64_t hash = 1469598103934665603u;
    const void *part[3] = {w->mesh.position, w->mesh.corner, w->target};
    size_t n = w->mesh.vertex_count,
           size[3] = {n * sizeof(qw_vec3), w->mesh.face_count * 3 * sizeof(uint32_t), n * sizeof(float)};
    for (int i = 0; i < 3; i++)
        for (size_t k = 0; k < size[i]; k++) hash = (hash ^ ((const uint8_t *)part[i])[k]) * 1099511628211u;
    return hash;
}

typedef struct job {
    qw_env *env;
    uint64_t hash;
} job;

static void hash_torus(void *user)
{
    job *j = user;
    qw_trimesh mesh = make_torus(j->env, 60, 30, 0.15);
    qw_working w = run(j->env, &mesh, 0.03f);
    j->hash = hash_of(&w);
}

static void the_bytes_do_not_depend_on_threads(void **state)
{
    (void)state;
    uint64_t first = 0;
    for (uint32_t threads = 1; threads <= 4; threads++) {
        job j = {.env = qw_env_create(NULL, threads)};
        assert_int_equal(qw_protect(j.env, hash_torus, &j), QW_OK);
        if (threads == 1) first = j.hash;
        assert_true(j.hash == first);
        qw_env_destroy(j.env);
    }
}

static void small_run(void *user)
{
    builder b = {.env = user};
    add_box(&b, 1, 1, 1, 0);
    qw_trimesh mesh = finish(&b, 30);
    qw_trimesh dense = run(user, &mesh, 0.3f).mesh;
    condensed(user, &dense, 0.9f);
}

static qw_status run_in_trouble(long allocations, long reports)
{
    faults f = {.allocations = allocations, .reports = reports};
    qw_host host = faults_host(&f);
    qw_env *env = qw_env_create(&host, 1);
    if (!env) return QW_MEMORY;
    size_t before = f.held;
    qw_status status = qw_protect(env, small_run, env);
    if (status != QW_OK) assert_true(f.held == before);
    qw_env_destroy(env);
    assert_true(f.held == 0);
    return status;
}

static void failures_leave_nothing_behind(void **state)
{
    (void)state;
    qw_status status = QW_MEMORY;
    for (long n = 0; n < 2000 && status != QW_OK; n++) {
        status = run_in_trouble(n, FAULTS_NONE);
        assert_true(status == QW_OK || status == QW_MEMORY);
    }
    assert_int_equal(status, QW_OK);
    status = QW_CANCELLED;
    for (long n = 0; n < 2000 && status != QW_OK; n++) {
        status = run_in_trouble(FAULTS_NONE, n);
        assert_true(status == QW_OK || status == QW_CANCELLED);
    }
    assert_int_equal(status, QW_OK);
}

QW_TEST_SUITE(working)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edits_keep_the_topology),
        cmocka_unit_test(edits_carry_marks),
        cmocka_unit_test(slides_find_the_nearest_point),
        cmocka_unit_test(slides_follow_a_curve_up_to_its_end),
        cmocka_unit_test(a_cube_keeps_corners_and_edges),
        cmocka_unit_test(a_long_thin_box_stays_one),
        cmocka_unit_test(a_dense_cube_is_coarsened_along_its_edges),
        cmocka_unit_test(dense_surfaces_are_condensed),
        cmocka_unit_test(dense_surfaces_are_clustered),
        cmocka_unit_test(open_grids_keep_their_boundary),
        cmocka_unit_test(tori_and_spheres_are_followed),
        cmocka_unit_test(tiny_components_and_coarse_targets_leave_room),
        cmocka_unit_test(small_discs_and_thin_holes_survive),
        cmocka_unit_test(caps_of_no_area_vanish),
        cmocka_unit_test(coarse_triangles_are_cut_without_slivers),
        cmocka_unit_test(slivers_of_a_fan_are_merged),
        cmocka_unit_test(thin_protrusions_lower_the_target),
        cmocka_unit_test(targets_may_vary),
        cmocka_unit_test(the_bytes_do_not_depend_on_threads),
        cmocka_unit_test(failures_leave_nothing_behind),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
