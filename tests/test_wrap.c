/* The wrap: exact predicates against a second implementation, skins of soups that are closed, manifold, without a
 * self-intersection (by that second implementation) and near the input, whole runs. */
#include "faults.h"
#include "skin_check.h"
#include "soups.h"
#include "suite.h"
#include "geometry/bvh.h"
#include "products/measure/distance.h"
#include "products/wrap/predicates.h"
#include "products/wrap/point_cloud.h"
#include "products/wrap/visible.h"
#include "products/wrap/wrap.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>

/* ---- predicates */

/* Corners of two triangles on a tiny grid, where every degenerate case is common, or on a wide one; so many of the
 * first corners are the same. */
static void random_pair(uint64_t *state, int32_t most, int shared, int32_t at[6][3])
{
    for (int i = 0; i < 6; i++)
        for (int k = 0; k < 3; k++) at[i][k] = (int32_t)((random_step(state) >> 33) % (uint32_t)most);
    for (int i = 0; i < shared; i++) memcpy(at[3 + i], at[i], sizeof *at);
}

static bool has_area(int32_t at[3][3])
{
    whole3 n = whole_cross(whole_difference(at[1], at[0]), whole_difference(at[2], at[0]));
    return n.c[0] != 0 || n.c[1] != 0 || n.c[2] != 0;
}

static void test_triangles(void **unused)
{
    (void)unused;
    static const int32_t most[] = {3, 4, 6, 50, 1 << 20};
    uint64_t state = 5;
    int64_t met = 0, apart = 0;
    for (int i = 0; i < 300000; i++) {
        int32_t at[6][3];
        int shared = i % 3;
        random_pair(&state, most[i % 5], shared, at);
        if (!has_area(at) || !has_area(at + 3)) continue;
        static const uint32_t apart3[3][3] = {{3, 4, 5}, {0, 4, 5}, {0, 1, 5}}, first[3] = {0, 1, 2};
        bool expected = pair_meets(&at[0][0], first, apart3[shared]);
        bool found = qw_triangles_collide((const qw_wrap_lattice_point *)at, (const qw_wrap_lattice_point *)(at + 3),
                                          shared);
        if (found != expected) fail_msg("case %d: %d, not %d", i, found, expected);
        found ? met++ : apart++;
    }
    assert_true(met > 10000 && apart > 10000);
}

/* ---- skins */

typedef struct trial {
    qw_env *env;
    soup s;
    double share; /* of the diagonal */
    qw_wrapped w;
    uint64_t hash;
} trial;

static qw_clean_input input_of(qw_env *env, const soup *s)
{
    uint32_t *begin = QW_NEW(env, uint32_t, (size_t)s->face_count + 1);
    for (uint32_t f = 0; f <= s->face_count; f++) begin[f] = 3 * f;
    return (qw_clean_input){.vertex_count = s->vertex_count,
                            .face_count = s->face_count,
                            .position = s->position,
                            .face_begin = begin,
                            .corner = s->corner};
}

/* Vertices as whole numbers: int32_t[vertices][3]. */
static int32_t *whole_positions(qw_env *env, const qw_wrapped *w)
{
    int32_t *at = QW_NEW(env, int32_t, 3 * (size_t)w->skin.vertex_count);
    for (size_t i = 0; i < 3 * (size_t)w->skin.vertex_count; i++) {
        double u = (w->skin.position[i] - w->origin[i % 3]) / w->unit;
        at[i] = (int32_t)lround(u);
        assert_true(fabs(u - at[i]) < 0.01 && at[i] >= 0 && at[i] <= 1 << 24);
    }
    return at;
}

static qw_trimesh mesh_of(qw_env *env, const qw_clean_input *in)
{
    qw_trimesh m = {.vertex_count = in->vertex_count, .face_count = in->face_count, .corner = (uint32_t *)in->corner};
    m.position = QW_NEW(env, qw_vec3, in->vertex_count);
    for (uint32_t v = 0; v < in->vertex_count; v++) {
        const double *p = in->position + 3 * (size_t)v;
        m.position[v] = qw_v3((float)p[0], (float)p[1], (float)p[2]);
    }
    return m;
}

/* Closed, manifold, oriented, outward, as many components as clusters, and no two triangles intersect. */
static void check_skin(qw_env *env, const qw_wrapped *w)
{
    qw_trimesh m = mesh_of(env, &w->skin);
    qw_trimesh_link(env, &m);
    qw_trimesh_validate(env, &m);
    for (uint32_t h = 0; h < 3 * m.face_count; h++) assert_true(m.twin[h] != QW_NONE);
    assert_int_equal(qw_trimesh_census(env, &m).components, w->clusters);
    double volume = 0;
    for (uint32_t f = 0; f < m.face_count; f++) {
        const uint32_t *c = m.corner + 3 * (size_t)f;
        volume += (double)qw_dot(m.position[c[0]], qw_face_cross(&m, f));
    }
    assert_true(volume > 0);
    assert_int_equal(count_intersections(whole_positions(env, w), w->skin.corner, w->skin.face_count), 0);
}

/* No vertex of the skin is farther from the input than twice the distance. */
static void check_distance(qw_env *env, const qw_clean_input *in, const qw_wrapped *w)
{
    qw_trimesh m = mesh_of(env, in), skin = mesh_of(env, &w->skin);
    qw_bvh *bvh = qw_bvh_build(env, &m);
    for (uint32_t v = 0; v < skin.vertex_count; v++) {
        qw_hit hit = qw_bvh_nearest(bvh, skin.position[v], qw_v3(0, 0, 0), -1, 1e6f, QW_NONE);
        assert_true(sqrt(hit.distance2) <= 2 * w->distance);
    }
}

static void wrap_body(void *user)
{
    trial *t = user;
    qw_clean_input in = input_of(t->env, &t->s);
    t->w = qw_wrap(t->env, &in, t->share * qw_wrap_diagonal(&in));
    check_skin(t->env, &t->w);
    check_distance(t->env, &in, &t->w);
    t->hash = 1;
    for (size_t i = 0; i < 3 * (size_t)t->w.skin.vertex_count; i++) {
        uint64_t bits;
        memcpy(&bits, t->w.skin.position + i, sizeof bits);
        t->hash = (t->hash ^ bits) * 0x9e3779b97f4a7c15u;
    }
}

static trial wrap_of(soup s, double share, uint32_t threads)
{
    trial t = {.env = qw_env_create(NULL, threads), .s = s, .share = share};
    qw_status status = qw_protect(t.env, wrap_body, &t);
    if (status != QW_OK) fail_msg("%s", qw_env_message(t.env));
    qw_env_destroy(t.env);
    soup_free(&t.s);
    return t;
}

static void test_soups(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed <= 6; seed++) wrap_of(soup_random(seed, 2 + (int)seed * 2), seed % 2 ? 0.04 : 0.07, 1);
    wrap_of(soup_of_triangles(1, 200, 0.2), 0.06, 1);
    wrap_of(soup_of_triangles(2, 1000, 0.02), 0.04, 1);
}

static void test_threads(void **unused)
{
    (void)unused;
    uint64_t one = wrap_of(soup_random(9, 8), 0.08, 1).hash;
    assert_true(wrap_of(soup_random(9, 8), 0.08, 2).hash == one);
    assert_true(wrap_of(soup_random(9, 8), 0.08, 3).hash == one);
    one = wrap_of(soup_of_triangles(3, 400, 0.1), 0.04, 1).hash; /* gaps beside gaps: they are closed several times */
    assert_true(wrap_of(soup_of_triangles(3, 400, 0.1), 0.04, 3).hash == one);
}

/* A shell within a shell is swallowed, two boxes apart stay two, a fragment vanishes; a gap is closed when it is
 * narrower than the distance. */
static void test_clusters(void **unused)
{
    (void)unused;
    static const double here[3] = {0, 0, 0}, there[3] = {2, 0, 0}, fragment[3] = {0, 2, 0};
    soup s = {0};
    soup_box(&s, here, 0.5, 0.5, 0.5, 0, 63), soup_box(&s, here, 0.2, 0.2, 0.2, 1, 63);
    soup_box(&s, there, 0.5, 0.5, 0.5, 0.5, 63), soup_box(&s, fragment, 0.01, 0.01, 0.01, 0, 63);
    trial t = wrap_of(s, 0.02, 1);
    assert_int_equal(t.w.clusters, 2);
    assert_int_equal(t.w.fragments, 1);
    assert_true(t.w.hidden >= 12);
    s = (soup){0};
    soup_box(&s, here, 0.5, 0.5, 0.5, 0, 61); /* without a side: the inside is a second side of a sheet */
    t = wrap_of(s, 0.02, 1);
    assert_int_equal(t.w.clusters, 1);
    soup slit = {0};
    soup_box(&slit, here, 0.5, 0.5, 0.5, 0, 63);
    static const double beside[3] = {1.02, 0, 0};
    soup_box(&slit, beside, 0.5, 0.5, 0.5, 0, 63);
    assert_int_equal(wrap_of(slit, 0.03, 1).w.clusters, 1);
}

/* How many clusters two boxes are with such a gap between them, in distances; one is wider, so that the cells lie
 * elsewhere. */
static int64_t clusters_at_gap(double gap, double wider)
{
    const double distance = 0.1, here[3] = {0, 0, 0}, there[3] = {1 + wider + gap * distance, 0, 0};
    soup s = {0};
    soup_box(&s, here, 0.5 + wider, 0.5, 0.5, 0, 63), soup_box(&s, there, 0.5, 0.5, 0.5, 0, 63);
    double across = 2 + 2 * wider + gap * distance;
    return wrap_of(s, distance / sqrt(across * across + 2), 1).w.clusters;
}

/* Gaps narrower than one and a half distances are closed wherever the cells lie, those of twice as much stay open. */
static void test_gaps_close_evenly(void **unused)
{
    (void)unused;
    for (int i = 0; i < 6; i++) {
        assert_int_equal(clusters_at_gap(1.45, 0.018 * i), 1);
        assert_int_equal(clusters_at_gap(2.05, 0.018 * i), 2);
    }
}

/* Sharp edges of the skin: those whose triangles turn by more than 40 degrees, as a tree. */
static qw_curve_tree *sharp_edges(qw_env *env, const qw_clean_input *skin)
{
    qw_trimesh m = mesh_of(env, skin);
    qw_trimesh_link(env, &m);
    qw_vec3 *normal = qw_face_normals(env, &m), *from = QW_NEW(env, qw_vec3, 3 * (size_t)m.face_count),
            *to = QW_NEW(env, qw_vec3, 3 * (size_t)m.face_count);
    uint32_t count = 0;
    for (uint32_t h = 0; h < 3 * m.face_count; h++) {
        if (m.twin[h] < h || qw_dot(normal[h / 3], normal[m.twin[h] / 3]) > 0.766f) continue;
        from[count] = m.position[m.corner[h]], to[count++] = m.position[m.corner[qw_next(h)]];
    }
    return qw_curve_tree_build(env, from, to, count);
}

/* A box, and one that stands in its side: the edges of both, and the edge in which they meet, which neither has. */
static void edges_body(void *user)
{
    trial *t = user;
    static const double here[3] = {0, 0, 0}, there[3] = {0.5, 0, 0};
    soup_box(&t->s, here, 0.5, 0.4, 0.3, 0, 63), soup_box(&t->s, there, 0.3, 0.2, 0.1, 0, 63);
    double turn[9];
    soup_turn(0.4, turn);
    for (uint32_t v = 0; v < t->s.vertex_count; v++) { /* both as one, off the axes */
        double *p = t->s.position + 3 * (size_t)v, q[3] = {p[0], p[1], p[2]};
        for (int i = 0; i < 3; i++) p[i] = turn[3 * i] * q[0] + turn[3 * i + 1] * q[1] + turn[3 * i + 2] * q[2];
    }
    qw_clean_input in = input_of(t->env, &t->s);
    double diagonal = qw_wrap_diagonal(&in);
    t->w = qw_wrap(t->env, &in, diagonal / 100);
    check_skin(t->env, &t->w);
    qw_curve_tree *tree = sharp_edges(t->env, &t->w.skin);
    static const double ends[][6] = {{-.5, -.4, -.3, .5, -.4, -.3}, {.5, -.4, .3, .5, .4, .3},
                                     {.8, -.2, -.1, .8, .2, -.1},   {.8, .2, .1, .5, .2, .1},
                                     {.5, -.2, .1, .5, .2, .1},     {.5, .2, -.1, .5, .2, .1}};
    int far = 0;
    for (int e = 0; e < 6; e++)
        for (int i = 1; i < 20; i++) { /* corners may be a cell off */
            double q[3], p[3];
            for (int k = 0; k < 3; k++) q[k] = ends[e][k] + (ends[e][k + 3] - ends[e][k]) * i / 20;
            for (int k = 0; k < 3; k++) p[k] = turn[3 * k] * q[0] + turn[3 * k + 1] * q[1] + turn[3 * k + 2] * q[2];
            qw_curve_hit hit = qw_curve_nearest(tree, qw_v3((float)p[0], (float)p[1], (float)p[2]), 10);
            far += sqrt(hit.distance2) > 0.001 * diagonal;
        }
    assert_int_equal(far, 0);
}

static void test_edges(void **unused)
{
    (void)unused;
    trial t = {.env = qw_env_create(NULL, 1)};
    if (qw_protect(t.env, edges_body, &t) != QW_OK) fail_msg("%s", qw_env_message(t.env));
    qw_env_destroy(t.env);
    soup_free(&t.s);
}

static void failing_body(void *user)
{
    trial *t = user;
    qw_clean_input in = input_of(t->env, &t->s);
    qw_wrap(t->env, &in, t->share);
}

static void test_refusals(void **unused)
{
    (void)unused;
    trial t = {.env = qw_env_create(NULL, 1), .s = soup_random(1, 2), .share = 1e-6};
    assert_int_equal(qw_protect(t.env, failing_body, &t), QW_TOO_LARGE);
    soup_free(&t.s);
    t.s = (soup){0};
    for (int i = 0; i < 3; i++) soup_vertex(&t.s, 1, 1, 1);
    soup_triangle(&t.s, 0, 1, 2);
    assert_int_equal(qw_protect(t.env, failing_body, &t), QW_ONLY_DEGENERATE);
    t.share = 0; /* of the diagonal, which is 0 */
    assert_int_equal(qw_protect(t.env, failing_body, &t), QW_ONLY_DEGENERATE);
    soup_free(&t.s);
    t.share = 1;
    for (int axis = 0; axis < 3; axis++) { /* numbers lie 16 apart there, cells half a unit */
        t.s = soup_random(1, 20);
        for (size_t i = (size_t)axis; i < 3 * (size_t)t.s.vertex_count; i += 3) t.s.position[i] += 1e17;
        assert_int_equal(qw_protect(t.env, failing_body, &t), QW_TOO_LARGE);
        assert_non_null(strstr(qw_env_message(t.env), "so far from the origin"));
        soup_free(&t.s);
    }
    qw_env_destroy(t.env);
}

/* Memory refused at any place: nothing is left. */
static void test_memory(void **unused)
{
    (void)unused;
    qw_status status = QW_MEMORY;
    for (long n = 0; status == QW_MEMORY; n++) {
        faults f = {.allocations = n, .reports = FAULTS_NONE};
        qw_host host = faults_host(&f);
        trial t = {.env = qw_env_create(&host, 1), .s = soup_random(3, 2), .share = 0.2};
        if (t.env) {
            status = qw_protect(t.env, failing_body, &t);
            qw_env_destroy(t.env);
        }
        assert_int_equal(f.blocks, 0);
        soup_free(&t.s);
    }
    assert_int_equal(status, QW_OK);
}

/* ---- whole runs */

static qw_mesh_view view_of(const soup *s)
{
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = s->vertex_count,
                          .face_count = s->face_count,
                          .uniform_face_size = 3,
                          .positions = s->position,
                          .corners = s->corner};
}

static void test_runs(void **unused)
{
    (void)unused;
    soup s = soup_random(4, 6);
    qw_mesh_view view = view_of(&s);
    qw_options o;
    qw_result *result;
    qw_options_init(&o);
    o.wrap = 1, o.faces = 800;
    if (qw_remesh(&view, &o, NULL, &result) != QW_OK) fail_msg("%s", qw_result_message(result));
    const qw_report *r = qw_result_report(result);
    assert_int_equal(r->boundary_loops, 0);
    assert_int_equal(r->topology.boundary_edges, 0);
    assert_int_equal(r->topology.nonmanifold_edges, 0);
    assert_int_equal(r->topology.components, r->components);
    assert_int_equal(r->topology.euler, r->euler);
    assert_true(llabs(r->topology.faces - 800) <= 16);
    assert_true(r->wrap_distance > 0 && r->wrap_off < 0.003 && r->wrap_farthest < 0.1 && r->wrap_hidden > 0);
    qw_provenance p = {.size = sizeof p};
    assert_int_equal(qw_result_provenance(result, &p), QW_OK);
    assert_true(p.lost_vertices < p.vertex_count / 20);
    qw_result_destroy(result);
    soup_free(&s);
}

static bool advises_wrap(const qw_report *r)
{
    for (uint32_t i = 0; i < r->warning_count; i++)
        if (strstr(r->warnings[i], "with wrap")) return true;
    return false;
}

/* A soup is told that there is a wrap, parts that only lie beside one another are not, and a soup that is wrapped is
 * not. */
static void test_advice(void **unused)
{
    (void)unused;
    for (int i = 0; i < 3; i++) {
        soup s = {0};
        for (int k = 0; k < 9; k++) {
            double centre[3] = {(i == 1 ? 3.0 : 0.2) * k, 0, 0};
            soup_box(&s, centre, 0.5, 0.5, 0.5, 0.1 * k, 63);
        }
        qw_mesh_view view = view_of(&s);
        qw_options o;
        qw_result *result;
        qw_options_init(&o);
        o.wrap = i == 2, o.faces = 300;
        if (qw_remesh(&view, &o, NULL, &result) != QW_OK) fail_msg("%s", qw_result_message(result));
        assert_int_equal(advises_wrap(qw_result_report(result)), i == 0);
        if (i == 2) assert_true(qw_result_report(result)->wrap_hidden > 0.3);
        qw_result_destroy(result);
        soup_free(&s);
    }
}

/* What is inside of a box is gone, also the half of a bar that reaches out of it. */
static void test_visible(void **unused)
{
    (void)unused;
    static const double here[3] = {0, 0, 0}, out[3] = {0.5, 0, 0};
    soup s = {0};
    soup_box(&s, here, 0.5, 0.5, 0.5, 0, 63), soup_box(&s, here, 0.2, 0.2, 0.2, 1, 63);
    qw_mesh_view view = view_of(&s);
    qw_mesh *mesh;
    assert_int_equal(qw_mesh_wrap(&view, NULL, 0, NULL, NULL, NULL, &mesh), QW_OK);
    assert_int_equal(qw_mesh_visible(mesh, 0), QW_OK);
    assert_int_equal(qw_mesh_get(mesh).face_count, 12);
    assert_int_equal(qw_mesh_visible(mesh, 2), QW_ARGUMENT);
    qw_mesh_destroy(mesh);
    soup_free(&s);
    s = (soup){0};
    soup_box(&s, here, 0.5, 0.5, 0.5, 0, 63), soup_box(&s, out, 0.3, 0.1, 0.1, 0, 63);
    view = view_of(&s);
    assert_int_equal(qw_mesh_wrap(&view, NULL, 0, NULL, NULL, NULL, &mesh), QW_OK);
    assert_int_equal(qw_mesh_visible(mesh, 0.02), QW_OK);
    qw_mesh_view seen = qw_mesh_get(mesh);
    assert_true(seen.face_count > 24);
    double least = 1; /* of the corners of the bar's pieces, inside of the box */
    for (uint32_t c = 0; c < 3 * seen.face_count; c++) {
        const double *p = seen.positions + 3 * (size_t)seen.corners[c];
        if (fabs(p[1]) < 0.11 && fabs(p[2]) < 0.11 && p[0] > -0.4) least = fmin(least, p[0]);
    }
    assert_true(least > 0.3 && least < 0.55);
    qw_mesh_destroy(mesh);
    soup_free(&s);
}

/* A closed tube along z, of 16 corners around; its caps begin with thin triangles along the rim. */
static void closed_tube(soup *s, double low, double high, double radius, double above)
{
    uint32_t v[2][16];
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 16; i++) {
            double r = k ? above : radius, a = 6.283185307179586 * i / 16;
            v[k][i] = soup_vertex(s, r * cos(a), r * sin(a), k ? high : low);
        }
    for (int i = 0; i < 16; i++) soup_quad(s, v[0][i], v[0][(i + 1) % 16], v[1][(i + 1) % 16], v[1][i]);
    for (int step = 1; step < 8; step *= 2) /* ears, those of what is left, and so on */
        for (int i = 0; i < 16; i += 2 * step) {
            soup_triangle(s, v[0][i], v[0][(i + 2 * step) % 16], v[0][i + step]);
            soup_triangle(s, v[1][i], v[1][i + step], v[1][(i + 2 * step) % 16]);
        }
    soup_triangle(s, v[0][0], v[0][8], v[0][4]), soup_triangle(s, v[0][0], v[0][12], v[0][8]);
    soup_triangle(s, v[1][0], v[1][4], v[1][8]), soup_triangle(s, v[1][0], v[1][8], v[1][12]);
}

/* A tube and one on it that tapers slowly: the rims of both where they lie on one another turn by a right angle in the
 * file, but not for who sees them. */
static void rims_body(void *user)
{
    trial *t = user;
    closed_tube(&t->s, 0, 1, 0.5, 0.5), closed_tube(&t->s, 1, 3, 0.5, 0.3);
    qw_clean_input in = input_of(t->env, &t->s);
    uint8_t *seen;
    qw_clean_input part = qw_visible_part(t->env, &in, 0.08 * qw_wrap_diagonal(&in), &seen);
    qw_trimesh m = mesh_of(t->env, &part);
    qw_vec3 *normal = qw_face_normals(t->env, &m);
    double inside = 0, outside = 0; /* lengths of sharp edges with room beyond: where they meet, and at both ends */
    for (uint32_t h = 0; h < 3 * part.face_count; h++)
        for (uint32_t g = 0; g < h; g++) {
            uint32_t a = m.corner[h], b = m.corner[qw_next(h)];
            bool same = (a == m.corner[g] && b == m.corner[qw_next(g)]) ||
                        (b == m.corner[g] && a == m.corner[qw_next(g)]);
            if (!same || !(seen[h / 3] & QW_SEEN_BEYOND << h % 3) || !(seen[g / 3] & QW_SEEN_BEYOND << g % 3)) continue;
            if (qw_dot(normal[h / 3], normal[g / 3]) > 0.766f || m.position[a].z != m.position[b].z) continue;
            *(m.position[a].z == 1 ? &inside : &outside) += (double)qw_distance(m.position[a], m.position[b]);
        }
    double around = 16 * 0.3901806440322565; /* of a circle of radius 1 with 16 corners */
    assert_true(inside == 0 && fabs(outside - 0.8 * around) < 1e-5);
}

static void test_hidden_rims(void **unused)
{
    (void)unused;
    trial t = {.env = qw_env_create(NULL, 1)};
    if (qw_protect(t.env, rims_body, &t) != QW_OK) fail_msg("%s", qw_env_message(t.env));
    qw_env_destroy(t.env);
    soup_free(&t.s);
}

/* Quads of the wrapped soup. */
static qw_result *wrapped_quads(const soup *s, int64_t faces)
{
    qw_mesh_view view = view_of(s);
    qw_options o;
    qw_result *result;
    qw_options_init(&o);
    o.wrap = 1, o.faces = faces, o.adaptive = 0;
    if (qw_remesh(&view, &o, NULL, &result) != QW_OK) fail_msg("%s", qw_result_message(result));
    return result;
}

/* The quads lie on the input, not on the skin that lies off it and cuts its bends: those of a box in its planes, its
 * edges in the places where they are. */
static void test_box_is_met(void **unused)
{
    (void)unused;
    static const double here[3] = {0, 0, 0};
    soup s = {0};
    soup_box(&s, here, 0.5, 0.5, 0.5, 0, 63), soup_box(&s, here, 0.48, 0.48, 0.48, 0, 63);
    qw_result *result = wrapped_quads(&s, 600);
    qw_mesh_view quads = qw_result_mesh(result);
    uint32_t off = 0, on_edges = 0;
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        const double *p = quads.positions + 3 * (size_t)v;
        int planes = 0;
        for (int k = 0; k < 3; k++) planes += fabs(fabs(p[k]) - 0.5) < 3e-5;
        off += planes == 0, on_edges += planes > 1;
    }
    assert_int_equal(off, 0);
    assert_true(on_edges >= 80);
    qw_result_destroy(result);
    soup_free(&s);
}

/* A ball with a lining: the quads are as near to the ball as those of the ball alone. What is measured is its outside:
 * the lining, from which they are far, counts without. */
static void test_lining_does_not_attract(void **unused)
{
    (void)unused;
    double mean[2];
    for (int lined = 0; lined < 2; lined++) {
        soup s = {0};
        soup_ball(&s, 1, 64);
        if (lined) soup_ball(&s, 0.95, 64);
        qw_result *result = wrapped_quads(&s, 300);
        qw_mesh_view quads = qw_result_mesh(result), view = view_of(&s);
        qw_topology t;
        qw_quality q;
        double gap = qw_result_report(result)->wrap_distance;
        assert_int_equal(qw_measure_seen(&quads, &view, gap, NULL, &t, &q), QW_OK);
        mean[lined] = q.out_to_in_mean;
        assert_true(q.out_to_in_mean < 0.012);
        assert_int_equal(qw_measure_seen(&quads, &view, -1, NULL, &t, &q), QW_ARGUMENT);
        qw_result_destroy(result);
        soup_free(&s);
    }
    assert_true(fabs(mean[1] - mean[0]) < 0.2 * mean[0]);
}

/* Both sides of a sheet stay apart. */
static void test_sheets_keep_sides(void **unused)
{
    (void)unused;
    static const double here[3] = {0, 0, 0};
    soup s = {0};
    soup_sheet(&s, here, 1, 1, 0, 0, 6);
    qw_result *result = wrapped_quads(&s, 400);
    qw_mesh_view quads = qw_result_mesh(result);
    double off = qw_result_report(result)->wrap_distance / 512;
    uint32_t above = 0, below = 0;
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        double z = quads.positions[3 * (size_t)v + 2];
        above += z > 0.5 * off && z < 2.25 * off, below += z < -0.5 * off && z > -2.25 * off;
    }
    assert_true(above > 0.35 * quads.vertex_count && below > 0.35 * quads.vertex_count);
    qw_result_destroy(result);
    soup_free(&s);
}

/* Thin parts that cannot be made of their share of quads without flips do not get several times as many. */
static void test_scattered_triangles(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed < 3; seed++) {
        soup s = soup_of_triangles(seed, 20, 0.125);
        qw_result *result = wrapped_quads(&s, 150);
        uint32_t count = qw_result_mesh(result).face_count;
        assert_in_range(count, 143, 157);
        qw_result_destroy(result);
        soup_free(&s);
    }
}

/* How many pairs of triangles of the quads, each cut from its first corner, intersect. */
static int64_t crossings(const qw_mesh_view *quads)
{
    int32_t *at = malloc(3 * (size_t)quads->vertex_count * sizeof *at);
    uint32_t *corner = malloc(6 * (size_t)quads->face_count * sizeof *corner), n = 0;
    static const uint32_t halves[6] = {0, 1, 2, 0, 2, 3};
    for (size_t i = 0; i < 3 * (size_t)quads->vertex_count; i++) at[i] = (int32_t)lround(quads->positions[i] * 0x1p22);
    for (uint32_t f = 0; f < quads->face_count; f++)
        for (int i = 0; i < 6; i++) corner[n++] = quads->corners[4 * f + halves[i]];
    int64_t count = count_intersections(at, corner, n / 3);
    free(at), free(corner);
    return count;
}

/* The two sides of a bent sheet do not cross, though their quads are not the same: a tube without ends (1,700 pairs
 * each where each side is fitted for itself) and a ball that is open. */
static void test_sides_do_not_cross(void **unused)
{
    (void)unused;
    static const double here[3] = {0, 0, 0};
    for (int kind = 0; kind < 2; kind++) {
        soup s = {0};
        if (kind == 0) soup_tube(&s, here, 0.1, 0.5, 0.3, 32);
        else soup_ball(&s, 0.5, 48), s.face_count -= 14 * 48;
        qw_result *result = wrapped_quads(&s, 500);
        qw_mesh_view quads = qw_result_mesh(result);
        assert_in_range(crossings(&quads), 0, 100);
        qw_result_destroy(result);
        soup_free(&s);
    }
}

/* Which way the input's polygons face is no fault of the quads: a box of which half is inside out, and a sheet, whose
 * back has nothing that faces as it does. Quads that are inside out are. */
static void test_inverted_parts(void **unused)
{
    (void)unused;
    static const double box[3] = {0, 0, 0}, sheet[3] = {0, 0, 1.5};
    soup s = {0};
    soup_box(&s, box, 1, 1, 0.6, 0.3, 63), soup_sheet(&s, sheet, 1, 1, 0.2, 0, 6);
    for (uint32_t f = 0; f < 12; f += 4) {
        uint32_t *t = s.corner + 3 * (size_t)f, first = t[0];
        t[0] = t[1], t[1] = first;
    }
    qw_result *result = wrapped_quads(&s, 800);
    qw_mesh_view quads = qw_result_mesh(result), view = view_of(&s);
    qw_topology t;
    qw_quality q;
    double gap = qw_result_report(result)->wrap_distance;
    assert_int_equal(qw_measure_seen(&quads, &view, gap, NULL, &t, &q), QW_OK);
    assert_int_equal(q.flipped_faces, 0);
    uint32_t *turned = malloc(4 * (size_t)quads.face_count * sizeof *turned);
    for (uint32_t c = 0; c < 4 * quads.face_count; c++) turned[c] = quads.corners[4 * (c / 4) + 3 - c % 4];
    quads.corners = turned;
    assert_int_equal(qw_measure_seen(&quads, &view, gap, NULL, &t, &q), QW_OK);
    assert_true(q.flipped_faces > 300);
    free(turned);
    qw_result_destroy(result);
    soup_free(&s);
}

/* Too many quads for a wrap by their size: the sentence says so, and what would do does. */
static void test_too_many_quads(void **unused)
{
    (void)unused;
    static const double here[3] = {0, 0, 0};
    soup s = {0};
    soup_box(&s, here, 0.5, 0.5, 0.5, 0, 63);
    qw_mesh_view view = view_of(&s);
    qw_options o;
    qw_result *result;
    qw_options_init(&o);
    o.wrap = 1, o.faces = 20000000;
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_TOO_LARGE);
    const char *value = strstr(qw_result_message(result), "wrap=0.00");
    assert_non_null(strstr(qw_result_message(result), "so many quads"));
    assert_non_null(value);
    qw_result_destroy(result);
    soup_free(&s);
}

/* Another count in the same context gives the bytes of a fresh run: the skin depends on it. */
static void test_contexts(void **unused)
{
    (void)unused;
    soup s = soup_random(5, 3);
    qw_mesh_view view = view_of(&s), twice, fresh;
    qw_options o;
    qw_context *c;
    qw_result *result;
    qw_options_init(&o);
    o.wrap = 1, o.faces = 150;
    assert_int_equal(qw_create(NULL, &c), QW_OK);
    assert_int_equal(qw_set_mesh(c, &view), QW_OK);
    assert_int_equal(qw_run(c, &o), QW_OK);
    o.faces = 300;
    assert_int_equal(qw_run(c, &o), QW_OK);
    assert_int_equal(qw_get_mesh(c, &twice), QW_OK);
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
    fresh = qw_result_mesh(result);
    assert_int_equal(twice.vertex_count, fresh.vertex_count);
    assert_memory_equal(twice.positions, fresh.positions, 3 * (size_t)fresh.vertex_count * sizeof *fresh.positions);
    qw_result_destroy(result);
    qw_destroy(c);
    soup_free(&s);
}

/* ---- holes */

/* A ball of radius 1, of rings of 24 quads, without some of its triangles around two places: a large hole and a small
 * one. */
static soup ball_with_holes(void)
{
    enum { ROUND = 24, RINGS = 12 };
    soup s = {0};
    soup_vertex(&s, 0, 0, -1);
    for (int j = 1; j < RINGS; j++)
        for (int i = 0; i < ROUND; i++) {
            double a = 6.283185307179586 * i / ROUND, b = 3.141592653589793 * j / RINGS;
            soup_vertex(&s, sin(b) * cos(a), sin(b) * sin(a), -cos(b));
        }
    for (uint32_t j = 0; j + 1 < RINGS - 1; j++)
        for (uint32_t i = 0; i < ROUND; i++) {
            uint32_t a = 1 + j * ROUND + i, b = 1 + j * ROUND + (i + 1) % ROUND;
            if (j == 5 && i == 3) continue; /* a small hole; the large one is the cap at +z, above j = 8 */
            if (j < 9) soup_quad(&s, a, b, b + ROUND, a + ROUND);
        }
    for (uint32_t i = 0; i < ROUND; i++) soup_triangle(&s, 0, 1 + (i + 1) % ROUND, 1 + i);
    return s;
}

static void run_with_holes(int64_t most, int64_t filled, int64_t loops)
{
    soup s = ball_with_holes();
    qw_mesh_view view = view_of(&s);
    qw_options o;
    qw_result *result;
    qw_options_init(&o);
    o.faces = 600, o.fill_holes = most, o.sharp_angle = 180;
    if (qw_remesh(&view, &o, NULL, &result) != QW_OK) fail_msg("%s", qw_result_message(result));
    const qw_report *r = qw_result_report(result);
    assert_int_equal(r->filled_holes, filled);
    assert_int_equal(r->boundary_loops, loops);
    assert_int_equal(r->topology.boundary_loops, loops);
    assert_int_equal(r->topology.euler, 2 - loops);
    qw_mesh_view quads = qw_result_mesh(result);
    double least = 2, most_z = -1;
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        const double *p = quads.positions + 3 * (size_t)v;
        least = fmin(least, sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])), most_z = fmax(most_z, p[2]);
    }
    assert_true(least > 0.93);
    if (loops == 0) assert_true(most_z > 0.95); /* the cap bows as the ball does: a flat one would end at 0.87 */
    qw_result_destroy(result);
    soup_free(&s);
}

static void test_holes(void **unused)
{
    (void)unused;
    run_with_holes(0, 0, 2);
    run_with_holes(4, 1, 1);
    run_with_holes(24, 2, 0);
}

/* Faces in the cap of the ball that was cut off are told from others. */
static void test_filled_faces(void **unused)
{
    (void)unused;
    soup s = ball_with_holes();
    qw_mesh_view view = view_of(&s), quads;
    qw_options o;
    qw_options_init(&o);
    o.faces = 600, o.fill_holes = 24, o.sharp_angle = 180;
    qw_attribute filled;
    qw_context *c;
    assert_int_equal(qw_create(NULL, &c), QW_OK);
    assert_int_equal(qw_set_mesh(c, &view), QW_OK);
    assert_int_equal(qw_get_filled(c, &filled), QW_NOT_READY);
    assert_int_equal(qw_run(c, &o), QW_OK);
    assert_int_equal(qw_get_mesh(c, &quads), QW_OK);
    assert_int_equal(qw_get_filled(c, &filled), QW_OK);
    assert_int_equal(filled.count, quads.face_count);
    uint32_t on = 0;
    for (uint32_t f = 0; f < quads.face_count; f++) {
        double z = 0;
        for (uint32_t i = 0; i < 4; i++) z += quads.positions[3 * (size_t)quads.corners[4 * f + i] + 2] / 4;
        if (z > 0.93) assert_int_equal(filled.labels[f], 1);
        if (z > -0.5 && z < 0.8) on += filled.labels[f] == 1; /* the hole of four edges is somewhere there */
    }
    assert_true(on < 40);
    qw_destroy(c);
    soup_free(&s);
}

/* ---- points */

static void run_points(const char *name, bool has_colour)
{
    char path[256];
    qw_mesh *mesh;
    qw_options o;
    qw_result *result;
    snprintf(path, sizeof path, QW_TEST_DATA "/points/%s", name);
    qw_status status = qw_load_points(path, NULL, &mesh);
    if (status != QW_OK) fail_msg("%s", qw_mesh_message(mesh));
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_int_equal(view.vertex_count, 120);
    assert_true(view.face_count >= 230 && view.face_count < 280); /* 236 on a ball: few stars disagree */
    qw_options_init(&o);
    o.wrap = 1, o.wrap_distance = 0.05, o.faces = 200;
    if (qw_remesh(&view, &o, NULL, &result) != QW_OK) fail_msg("%s", qw_result_message(result));
    const qw_report *r = qw_result_report(result);
    assert_int_equal(r->topology.euler, 2);
    assert_int_equal(r->wrap_bridges, 0);
    qw_mesh_view quads = qw_result_mesh(result);
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        const double *p = quads.positions + 3 * (size_t)v;
        double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        assert_true(length > 0.9 && length < 1.1);
    }
    uint32_t count;
    const qw_attribute *a = qw_mesh_attributes(mesh, &count), *carried;
    assert_int_equal(count, has_colour);
    if (has_colour) {
        assert_int_equal(qw_result_transfer(result, a, count, 0, &carried, NULL), QW_OK);
        for (uint32_t v = 0; v < quads.vertex_count; v++)
            if (fabs(quads.positions[3 * (size_t)v + 2]) > 0.4)
                assert_true((carried->values[3 * (size_t)v] > carried->values[3 * (size_t)v + 2]) ==
                            (quads.positions[3 * (size_t)v + 2] > 0));
    }
    qw_result_destroy(result);
    qw_mesh_destroy(mesh);
}

static void test_points(void **unused)
{
    (void)unused;
    run_points("ball.xyz", false);
    run_points("ball.obj", false);
    run_points("ball.ply", true);
    run_points("ball_ascii.pcd", false);
    run_points("ball_binary.pcd", false);
    qw_mesh *mesh;
    assert_int_equal(qw_load(QW_TEST_DATA "/points/ball.ply", NULL, &mesh), QW_NO_FACES);
    qw_mesh_destroy(mesh);
    assert_int_equal(qw_load_points(QW_TEST_DATA "/points/none.ply", NULL, &mesh), QW_FILE_MISSING);
    qw_mesh_destroy(mesh);
}

static void note_field(void *user, qw_log_level level, const char *message)
{
    (void)level;
    *(bool *)user |= strstr(message, "the field intensity") != NULL;
}

/* A value of points that has no place is not lost without a word. */
static void left_out_fields_are_named(void **unused)
{
    (void)unused;
    bool is_named = false;
    const qw_host host = {.log = note_field, .log_user = &is_named};
    qw_mesh *mesh;
    assert_int_equal(qw_load_points(QW_TEST_DATA "/points/intensity.pcd", &host, &mesh), QW_OK);
    assert_int_equal(qw_mesh_get(mesh).vertex_count, 3);
    assert_true(is_named);
    qw_mesh_destroy(mesh);
}

/* The points of a file, as those of an array and of bytes: the same triangles, and attributes that are theirs. */
static void test_own_points(void **unused)
{
    (void)unused;
    qw_mesh *file, *own, *bytes;
    assert_int_equal(qw_load_points(QW_TEST_DATA "/points/ball.ply", NULL, &file), QW_OK);
    qw_mesh_view view = qw_mesh_get(file), again;
    uint32_t count;
    const qw_attribute *a = qw_mesh_attributes(file, &count);
    assert_int_equal(qw_mesh_of_points(view.positions, view.vertex_count, a, count, NULL, &own), QW_OK);
    again = qw_mesh_get(own);
    assert_int_equal(again.face_count, view.face_count);
    assert_memory_equal(again.corners, view.corners, 3 * (size_t)view.face_count * sizeof *view.corners);
    qw_mesh_destroy(own);
    assert_int_equal(qw_mesh_of_points(view.positions, view.vertex_count - 1, a, count, NULL, &own), QW_ARGUMENT);
    qw_mesh_destroy(own);
    assert_int_equal(qw_mesh_of_points(view.positions, 2, NULL, 0, NULL, &own), QW_NO_FACES);
    qw_mesh_destroy(own);
    qw_mesh_destroy(file);
    static const char text[] = "0 0 0\n1 0 0\n0 1 0\n1 1 0.5\n";
    assert_int_equal(qw_load_points_memory(text, sizeof text - 1, NULL, &bytes), QW_OK);
    assert_int_equal(qw_mesh_get(bytes).vertex_count, 4);
    qw_mesh_destroy(bytes);
    assert_int_equal(qw_load_points_memory(NULL, 0, NULL, &bytes), QW_ARGUMENT);
    qw_mesh_destroy(bytes);
}

/* Points that are there many times make the triangles of those that are there once. */
static void repeated_body(void *user)
{
    enum { TIMES = 30 };
    trial *t = user;
    uint32_t *corner, *again, n = t->s.vertex_count;
    double *many = QW_NEW(t->env, double, 3 * (size_t)n * TIMES);
    for (size_t i = 0; i < 3 * (size_t)n * TIMES; i++) many[i] = t->s.position[i % (3 * (size_t)n)];
    uint32_t faces = qw_triangles_of_points(t->env, t->s.position, n, &corner);
    assert_true(faces > n);
    assert_int_equal(qw_triangles_of_points(t->env, many, n * TIMES, &again), faces);
    assert_memory_equal(corner, again, 3 * (size_t)faces * sizeof *corner);
    for (size_t i = 0; i < 3 * (size_t)n; i++) many[i] *= 0x1p660; /* the square of a distance overflows */
    assert_int_equal(qw_triangles_of_points(t->env, many, n, &again), faces);
    assert_memory_equal(corner, again, 3 * (size_t)faces * sizeof *corner);
}

/* The two sides of a plate that is thinner than its points are apart become one sheet; those of a thicker one and the
   points of a ball stay. */
static void flattened_body(void *user)
{
    enum { SIDE = 20, COUNT = 2 * SIDE * SIDE };
    trial *t = user;
    double *points = QW_NEW(t->env, double, 3 * COUNT), most[2] = {0};
    for (int thick = 0; thick < 2; thick++) {
        for (int i = 0; i < COUNT; i++) {
            double *p = points + 3 * i, shift = i % 2 ? 0.4 : 0;
            p[0] = i / 2 % SIDE + shift, p[1] = i / 2 / SIDE + shift, p[2] = (i % 2 - 0.5) * (thick ? 6 : 0.5);
        }
        double *flat = qw_flatten_points(t->env, points, COUNT);
        for (int i = 0; i < COUNT; i++) most[thick] = fmax(most[thick], fabs(flat[3 * i + 2]));
    }
    assert_true(most[0] < 0.15 && most[1] == 3);
    for (int i = 0; i < COUNT; i++) {
        double z = (2 * i + 1.0) / COUNT - 1, around = 2.399963 * i, r = sqrt(1 - z * z);
        points[3 * i] = r * cos(around), points[3 * i + 1] = r * sin(around), points[3 * i + 2] = z;
    }
    double *same = qw_flatten_points(t->env, points, COUNT);
    assert_memory_equal(same, points, 3 * COUNT * sizeof *same);
}

/* Lists in all ways of writing them: coordinates, colours (as shares) and normals are those of the first. */
static void test_lists(void **unused)
{
    (void)unused;
    static const float colour[] = {1, 0.2f, 0};
    static const float normal[] = {0.6f, 0, 0.8f};
    static const struct {
        const char *text;
        bool has_colour, has_normal;
    } lists[] = {
        {"0,0.5,0\n1,0.5,0\n0,1.5,0\n", false, false},
        {"0, 0.5, 0\n1, 0.5, 0\n0, 1.5, 0\n", false, false},
        {"0;0,5;0\n1;0,5;0\n0;1,5;0\n", false, false},
        {"0,0|0,5|0\n1|0,5|0\n0|1,5|0\n", false, false},
        {"0,0\t0,5\t0,0\n1,0 0,5 0\n0 1,5  0,0\n", false, false},
        {"0;.5;0\r\n1;.5;0\r\n0;1.5;0\r\n", false, false},
        {"3\n0 0.5 0 255 51 0\n1 0.5 0 0 0 0\n0 1.5 0 0 0 9\n", true, false},
        {"3\n0 0.5 0 -7 255 51 0\n1 0.5 0 -8 0 0 0\n0 1.5 0 -6 0 0 9\n", true, false},
        {"0 0.5 0 255 51 0 255\n1 0.5 0 0 0 0 255\n0 1.5 0 0 0 9 255\n", true, false},
        {"0 0.5 0 1 0.2 0\n1 0.5 0 0 0 0\n0 1.5 0 0 0.5 0.5\n", true, false},
        {"0 0.5 0 0.6 0 0.8\n1 0.5 0 0 1 0\n0 1.5 0 0 0 -1\n", false, true},
        {"0 0.5 0 0.6 0 0.8 255 51 0\n1 0.5 0 0 1 0 1 2 3\n0 1.5 0 0 0 -1 4 5 6\n", true, true},
        {"x,y,z,red,green,blue\n0,0.5,0,255,51,0\n1,0.5,0,0,0,0\n0,1.5,0,0,0,9\n", true, false},
        {"id;x;y;z;nx;ny;nz;r;g;b\n7;0;0,5;0;0,6;0;0,8;255;51;0\n8;1;0,5;0;0;1;0;1;2;3\n9;0;1,5;0;0;0;1;4;5;6\n", true,
         true},
        {"\"X\",\"Y\",\"Z\",\"name\",\"NX\",\"NY\",\"NZ\"\n0,0.5,0,ab,0.6,0,0.8\n1,0.5,0,,0,1,0\n0,1.5,0,c,0,0,1\n",
         false, true},
        {"id,Easting,Northing,height\n7,0,0.5,0\n8,1,0.5,0\n9,0,1.5,0\n", false, false},
        {"//X Y Z R G B\n0 0.5 0 65535 13107 0\n1 0.5 0 0 0 0\n0 1.5 0 0 0 9\n", true, false},
        {"# made by hand\n0 0.5 0 0.6 0 0.8\n1 0.5 0\n0 1.5 0 0 0 -1\n", false, false},
        {"# x y z nx ny nz\n0 0.5 0 0.6 0 0.8\n1 0.5 0\n0 1.5 0 0 0 -1\n", false, true},
        {"v 0 0.5 0 1 0.2 0\nv 1 0.5 0 0 0 0\nv 0 1.5 0 0 0.5 0.5\nvn 0 0 1\n", true, false},
        {"VERSION 0.7\nFIELDS x y z rgb normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4 4\nTYPE F F F U F F F\n"
         "COUNT 1 1 1 1 1 1 1\nPOINTS 4\nDATA ascii\n0 0.5 0 16724736 0.6 0 0.8\nnan 0 0 1 0 0 1\n"
         "1 0.5 0 0 nan nan nan\n0 1.5 0 9 0 0 1\n",
         true, true},
    };
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        qw_mesh *mesh;
        qw_status status = qw_load_points_memory(lists[i].text, strlen(lists[i].text), NULL, &mesh);
        if (status != QW_OK) fail_msg("list %zu: %s", i, qw_mesh_message(mesh));
        uint32_t count;
        const double *p = qw_mesh_get(mesh).positions;
        assert_int_equal(qw_mesh_get(mesh).vertex_count, 3);
        assert_true(p[0] == 0 && p[1] == 0.5 && p[3] == 1 && p[7] == 1.5);
        const qw_attribute *a = qw_mesh_attributes(mesh, &count);
        if (count != (uint32_t)lists[i].has_colour + lists[i].has_normal) fail_msg("list %zu: %u attributes", i, count);
        for (uint32_t n = 0; n < count; n++) {
            bool is_normal = a[n].kind == QW_NORMALS;
            assert_true(is_normal ? lists[i].has_normal : lists[i].has_colour);
            for (int k = 0; k < 3; k++)
                assert_true(fabsf(a[n].values[k] - (is_normal ? normal[k] : colour[k])) < 1e-5f);
        }
        qw_mesh_destroy(mesh);
    }
}

/* Ten points of 16 bytes each: a colour in one word, whatever its type is. */
static void test_packed_colours(void **unused)
{
    (void)unused;
    char bytes[512];
    for (int type = 0; type < 2; type++) {
        int head = snprintf(bytes, sizeof bytes,
                            "VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F %c\nCOUNT 1 1 1 1\nPOINTS 10\n"
                            "DATA binary\n",
                            type ? 'U' : 'F');
        for (uint32_t i = 0; i < 10; i++) {
            const float p[3] = {(float)(i % 3), (float)(i / 3), (float)(i * i) / 50};
            const uint32_t word = 0xff0000 | i << 8 | 2 * i;
            memcpy(bytes + head + 16 * i, p, sizeof p), memcpy(bytes + head + 16 * i + 12, &word, sizeof word);
        }
        qw_mesh *mesh;
        uint32_t count;
        assert_int_equal(qw_load_points_memory(bytes, (size_t)head + 160, NULL, &mesh), QW_OK);
        const qw_attribute *a = qw_mesh_attributes(mesh, &count);
        assert_int_equal(count, 1);
        for (uint32_t i = 0; i < 10; i++) {
            assert_true(a->values[3 * i] == 1);
            assert_true(fabsf(a->values[3 * i + 1] - (float)i / 255) < 1e-6f);
            assert_true(fabsf(a->values[3 * i + 2] - (float)(2 * i) / 255) < 1e-6f);
        }
        qw_mesh_destroy(mesh);
    }
}

static void test_odd_points(void **unused)
{
    (void)unused;
    trial t = {.env = qw_env_create(NULL, 1), .s = soup_random(5, 40)};
    assert_int_equal(qw_protect(t.env, repeated_body, &t), QW_OK);
    assert_int_equal(qw_protect(t.env, flattened_body, &t), QW_OK);
    soup_free(&t.s);
    qw_env_destroy(t.env);
    static const struct {
        const char *path;
        qw_status status;
    } refused[] = {{QW_TEST_DATA "/points/fields_twice.pcd", QW_FORMAT_SYNTAX},
                   {QW_TEST_DATA "/io/tetrahedron.obj", QW_FORMAT_UNKNOWN},
                   {QW_TEST_DATA "/io/plain.off", QW_FORMAT_UNKNOWN},
                   {QW_TEST_DATA "/io/ascii.ply", QW_FORMAT_UNKNOWN},
                   {QW_TEST_DATA "/io/binary.stl", QW_FORMAT_UNKNOWN}};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        qw_mesh *mesh;
        assert_int_equal(qw_load_points(refused[i].path, NULL, &mesh), refused[i].status);
        qw_mesh_destroy(mesh);
    }
}

/* Squares of these lengths overflow or vanish. */
static void test_scales(void **unused)
{
    (void)unused;
    static const struct {
        double scale;
        qw_status status;
    } cases[] = {{1e200, QW_OK}, {1e-200, QW_OK}, {1e-310, QW_ONLY_DEGENERATE}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        soup s = soup_random(7, 6);
        qw_options o;
        qw_result *result;
        for (size_t k = 0; k < 3 * (size_t)s.vertex_count; k++) s.position[k] *= cases[i].scale;
        qw_mesh_view view = view_of(&s);
        qw_options_init(&o);
        o.wrap = 1, o.faces = 100;
        assert_int_equal(qw_remesh(&view, &o, NULL, &result), cases[i].status);
        qw_result_destroy(result);
        soup_free(&s);
    }
}

QW_TEST_SUITE(wrap)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_triangles),
        cmocka_unit_test(test_soups),
        cmocka_unit_test(test_clusters),
        cmocka_unit_test(test_gaps_close_evenly),
        cmocka_unit_test(test_edges),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_runs),
        cmocka_unit_test(test_advice),
        cmocka_unit_test(test_visible),
        cmocka_unit_test(test_hidden_rims),
        cmocka_unit_test(test_holes),
        cmocka_unit_test(test_filled_faces),
        cmocka_unit_test(test_points),
        cmocka_unit_test(left_out_fields_are_named),
        cmocka_unit_test(test_own_points),
        cmocka_unit_test(test_contexts),
        cmocka_unit_test(test_too_many_quads),
        cmocka_unit_test(test_box_is_met),
        cmocka_unit_test(test_lining_does_not_attract),
        cmocka_unit_test(test_sheets_keep_sides),
        cmocka_unit_test(test_scattered_triangles),
        cmocka_unit_test(test_sides_do_not_cross),
        cmocka_unit_test(test_inverted_parts),
        cmocka_unit_test(test_odd_points),
        cmocka_unit_test(test_lists),
        cmocka_unit_test(test_packed_colours),
        cmocka_unit_test(test_scales),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

QW_TEST_SUITE(wrap_threads)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_threads)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
