/* Bounding volume trees against brute force in double precision. */
#include "random.h"
#include "suite.h"
#include "geometry/bvh.h"

#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <string.h>

static uint64_t state;
static double uniform(void)
{
    random_step(&state);
    return (double)(state >> 11) / 9007199254740992.0;
}
static float between(double lo, double hi) { return (float)(lo + (hi - lo) * uniform()); }
static qw_vec3 random_point(double r) { return qw_v3(between(-r, r), between(-r, r), between(-r, r)); }

enum { MOST = 3000 };
static qw_vec3 positions[3 * MOST];
static uint32_t corners[3 * MOST];

/* kind 0: small triangles in a cube; 1: large ones; 2: many degenerate; 3: all in one place; 4: sizes over many orders
 */
static qw_trimesh random_mesh(int kind, uint32_t count)
{
    for (uint32_t f = 0; f < count; f++) {
        double size = kind == 1 ? 0.5 : kind == 4 ? pow(10, -7 * uniform()) : 0.05;
        qw_vec3 at = kind == 3   ? qw_v3(0.1f, 0.1f, 0.1f)
                     : kind == 4 ? qw_scale(random_point(0.5), (float)size)
                                 : random_point(0.5);
        for (int k = 0; k < 3; k++) positions[3 * f + k] = kind == 3 ? at : qw_add(at, random_point(size));
        if (kind == 2 && f % 3 == 0) positions[3 * f + 1] = positions[3 * f];
        if (kind == 2 && f % 6 == 1)
            positions[3 * f + 2] = qw_lerp(positions[3 * f], positions[3 * f + 1], between(-1, 2));
        for (uint32_t k = 0; k < 3; k++) corners[3 * f + k] = 3 * f + k;
    }
    return (qw_trimesh){.vertex_count = 3 * count, .face_count = count, .position = positions, .corner = corners};
}

static void load(double out[3], qw_vec3 v) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }
static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double segment_distance2(const double *a, const double *b, const double *p)
{
    double ab[3], ap[3], d[3];
    for (int k = 0; k < 3; k++) ab[k] = b[k] - a[k], ap[k] = p[k] - a[k];
    double l = dot3(ab, ab), t = l > 0 ? dot3(ab, ap) / l : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    for (int k = 0; k < 3; k++) d[k] = ap[k] - t * ab[k];
    return dot3(d, d);
}

/* Another way than the one under test: the plane where the foot is inside, else the three sides. */
static double triangle_distance2(const qw_trimesh *m, uint32_t f, qw_vec3 point)
{
    double p[3], c[3][3], e[3], g[3], n[3], q[3];
    load(p, point);
    for (int k = 0; k < 3; k++) load(c[k], m->position[m->corner[3 * f + k]]);
    for (int k = 0; k < 3; k++) e[k] = c[1][k] - c[0][k], g[k] = c[2][k] - c[0][k], q[k] = p[k] - c[0][k];
    n[0] = e[1] * g[2] - e[2] * g[1], n[1] = e[2] * g[0] - e[0] * g[2], n[2] = e[0] * g[1] - e[1] * g[0];
    double best = fmin(fmin(segment_distance2(c[0], c[1], p), segment_distance2(c[1], c[2], p)),
                       segment_distance2(c[2], c[0], p));
    double nn = dot3(n, n), h = dot3(n, q);
    if (nn <= 1e-18 * dot3(e, e) * dot3(g, g)) return best;
    for (int k = 0; k < 3; k++) {
        const double *a = c[k], *b = c[(k + 1) % 3];
        double s[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, r[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
        double x[3] = {s[1] * r[2] - s[2] * r[1], s[2] * r[0] - s[0] * r[2], s[0] * r[1] - s[1] * r[0]};
        if (dot3(x, n) < 0) return best;
    }
    return fmin(best, h * h / nn);
}

static bool passes(const qw_trimesh *m, uint32_t f, qw_vec3 normal, float least)
{
    return qw_dot(qw_normalize(qw_face_cross(m, f)), normal) >= least;
}

static void check_hit(const qw_trimesh *m, qw_hit hit, qw_vec3 p)
{
    const uint32_t *c = m->corner + 3 * hit.face;
    float sum = hit.weight[0] + hit.weight[1] + hit.weight[2];
    assert_true(fabsf(sum - 1) < 1e-5f);
    qw_vec3 q = qw_scale(m->position[c[0]], hit.weight[0]);
    q = qw_madd(q, hit.weight[1], m->position[c[1]]);
    q = qw_madd(q, hit.weight[2], m->position[c[2]]);
    for (int k = 0; k < 3; k++) assert_true(hit.weight[k] > -1e-6f);
    assert_true(qw_distance(q, hit.point) < 2e-6f);
    assert_true(fabsf(qw_distance(p, hit.point) - sqrtf(hit.distance2)) < 2e-6f);
}

static void nearest_body(void *user)
{
    qw_env *env = user;
    for (int kind = 0; kind < 5; kind++)
        for (int size = 0; size < 4; size++) {
            state = (uint64_t)(17 * kind + size);
            const uint32_t sizes[4] = {1, 5, 200, MOST};
            qw_trimesh m = random_mesh(kind, sizes[size]);
            qw_scope_begin(env);
            qw_bvh *bvh = qw_bvh_build(env, &m);
            for (int i = 0; i < 150; i++) {
                qw_vec3 p = i % 3 == 0 ? m.position[(uint32_t)(uniform() * m.vertex_count)]
                                       : random_point(i % 3 == 1 ? 0.6 : 3.0);
                double best = FLT_MAX;
                for (uint32_t f = 0; f < m.face_count; f++) best = fmin(best, triangle_distance2(&m, f, p));
                qw_hit hit = qw_bvh_nearest(bvh, p, qw_v3(0, 0, 0), 0, FLT_MAX, QW_NONE);
                assert_int_not_equal(hit.face, QW_NONE);
                assert_true(fabs(sqrt(hit.distance2) - sqrt(best)) < 1e-7 + 1e-5 * sqrt(best));
                check_hit(&m, hit, p);
                uint32_t hint = (uint32_t)(uniform() * m.face_count);
                qw_hit hinted = qw_bvh_nearest(bvh, p, qw_v3(0, 0, 0), 0, FLT_MAX, hint);
                assert_memory_equal(&hinted, &hit, offsetof(qw_hit, looked)); /* a hint saves looking */
                hinted = qw_bvh_nearest(bvh, p, qw_v3(1, 0, 0), -1, FLT_MAX, hit.face);
                assert_memory_equal(&hinted, &hit, offsetof(qw_hit, looked)); /* a hint saves looking */
                if (best > 1e-6) {
                    hit = qw_bvh_nearest(bvh, p, qw_v3(0, 0, 0), 0, (float)sqrt(best) * 0.999f, hint);
                    assert_int_equal(hit.face, QW_NONE);
                }
            }
            qw_scope_end(env);
        }
}

/* Of one part among those of a mesh in stripes, one part of which is everywhere. */
static void part_body(void *user)
{
    enum { PARTS = 5 };
    qw_env *env = user;
    qw_trimesh m = random_mesh(0, MOST);
    uint32_t *component = QW_NEW(env, uint32_t, m.face_count);
    for (uint32_t f = 0; f < m.face_count; f++) {
        float x = m.position[m.corner[3 * f]].x;
        component[f] = f % 7 == 0 ? 0 : 1 + (uint32_t)((x + 1) * 2) % (PARTS - 1);
    }
    m.component = component;
    qw_bvh *bvh = qw_bvh_build(env, &m);
    for (int i = 0; i < 500; i++) {
        qw_vec3 p = random_point(i % 2 ? 0.6 : 3.0);
        uint32_t part = (uint32_t)(uniform() * PARTS);
        double best = FLT_MAX;
        for (uint32_t f = 0; f < m.face_count; f++)
            if (component[f] == part) best = fmin(best, triangle_distance2(&m, f, p));
        qw_hit hit = qw_bvh_nearest_of(bvh, part, p, qw_v3(0, 0, 0), -1, FLT_MAX, QW_NONE);
        assert_true((hit.face == QW_NONE) == (best == FLT_MAX));
        if (hit.face == QW_NONE) continue;
        check_hit(&m, hit, p);
        assert_int_equal(component[hit.face], part);
        assert_true(fabs(sqrt((double)hit.distance2) - sqrt(best)) < 2e-6);
    }
}

static void normal_body(void *user)
{
    qw_env *env = user;
    state = 5;
    qw_trimesh m = random_mesh(0, 1000);
    qw_bvh *bvh = qw_bvh_build(env, &m);
    for (int i = 0; i < 300; i++) {
        qw_vec3 p = random_point(0.6), n = qw_normalize(random_point(1));
        float least = between(-0.9, 0.999);
        double best = FLT_MAX;
        for (uint32_t f = 0; f < m.face_count; f++)
            if (passes(&m, f, n, least)) best = fmin(best, triangle_distance2(&m, f, p));
        qw_hit hit = qw_bvh_nearest(bvh, p, n, least, FLT_MAX, (uint32_t)(uniform() * m.face_count));
        if (best == FLT_MAX) {
            assert_int_equal(hit.face, QW_NONE);
            continue;
        }
        assert_true(qw_dot(qw_normalize(qw_face_cross(&m, hit.face)), n) >= least - 1e-5f);
        assert_true(fabs(sqrt(hit.distance2) - sqrt(best)) < 1e-5);
    }
}

/* Rays that are looked for together, near one another and not, meet what each meets by itself. */
static void rays_together(const qw_bvh *bvh, const qw_bvh_cache *cache, qw_vec3 centre, double radius)
{
    qw_vec3 o[QW_MOST_RAYS], d[QW_MOST_RAYS];
    float most[QW_MOST_RAYS];
    qw_hit quick[QW_MOST_RAYS];
    for (uint32_t k = 0; k < 12; k++) {
        uint32_t count = k % QW_MOST_RAYS + 1;
        double spread = k % 3 ? 0.03 : 0.8;
        qw_vec3 middle = qw_add(centre, random_point((0.8 - spread) * radius)), toward = random_point(1);
        for (uint32_t i = 0; i < count; i++) {
            o[i] = qw_add(middle, random_point(spread * radius));
            d[i] = qw_normalize(qw_add(toward, random_point(spread))), most[i] = between(0, 1) * (float)radius;
        }
        qw_bvh_rays_near(bvh, cache, o, d, most, count, quick);
        for (uint32_t i = 0; i < count; i++) {
            qw_hit plain = qw_bvh_ray(bvh, o[i], d[i], most[i], QW_NONE);
            assert_memory_equal(&plain, &quick[i], sizeof plain);
        }
        qw_vec3 from = o[0];
        for (int i = 0; i < 4; i++) d[i] = qw_normalize(random_point(1));
        uint32_t skip = k % 2 ? QW_NONE : quick[0].face,
                 blocked = qw_bvh_blocked(bvh, from, d, k % 4 ? most[0] : INFINITY, skip);
        for (uint32_t i = 0; i < 4; i++) {
            qw_hit plain = qw_bvh_ray(bvh, from, d[i], k % 4 ? most[0] : INFINITY, skip);
            assert_int_equal(blocked >> i & 1, plain.face != QW_NONE);
        }
    }
}

/* A cache never changes an answer, and of all faces that meet its ball none is missing. */
static void cache_body(void *user)
{
    qw_env *env = user;
    uint32_t overflows = 0, met = 0, label[MOST];
    for (int kind = 0; kind < 5; kind++) {
        state = (uint64_t)(23 * kind);
        qw_trimesh m = random_mesh(kind, 2000);
        for (uint32_t f = 0; f < m.face_count; f++) label[f] = f % 3;
        qw_scope_begin(env);
        qw_bvh *bvh = qw_bvh_build(env, &m);
        for (int i = 0; i < 100; i++) {
            qw_bvh_cache cache;
            qw_vec3 centre = random_point(0.5);
            float radius = between(0, i % 2 ? 0.1 : 0.5);
            uint32_t meet = 0;
            qw_bvh_fill_cache(bvh, centre, radius, &cache);
            overflows += cache.radius == 0;
            for (uint32_t f = 0; f < m.face_count; f++)
                meet += triangle_distance2(&m, f, centre) < 0.999 * (double)radius * (double)radius;
            assert_true(cache.count >= meet || cache.radius == 0);
            for (int k = 0; k < 20; k++) {
                qw_bvh_query q = {.point = qw_add(centre, random_point(1.5 * (double)radius)),
                                  .normal = random_point(1),
                                  .least_dot = k % 2 ? 0.2f : -1,
                                  .max_distance = between(0, 1),
                                  .hint = k % 3 ? QW_NONE : (uint32_t)k,
                                  .label = k % 5 ? NULL : label,
                                  .wanted = 1};
                qw_hit plain = qw_bvh_find(bvh, &q, NULL), quick = qw_bvh_find(bvh, &q, &cache);
                quick.looked = plain.looked; /* that is what a cache saves */
                assert_memory_equal(&plain, &quick, sizeof plain);
                assert_true(!q.label || plain.face == QW_NONE || label[plain.face] == 1);
            }
            for (int k = 0; k < 20; k++) {
                qw_vec3 o = qw_add(centre, random_point(0.8 * (double)radius)), d = qw_normalize(random_point(1));
                float most = between(0, 1) * radius;
                qw_hit plain = qw_bvh_ray(bvh, o, d, most, QW_NONE);
                qw_hit quick = qw_bvh_ray_near(bvh, &cache, o, d, most, QW_NONE);
                assert_memory_equal(&plain, &quick, sizeof plain);
                met += plain.face != QW_NONE && cache.radius > 0;
            }
            rays_together(bvh, &cache, centre, (double)radius);
        }
        qw_scope_end(env);
    }
    assert_true(overflows > 20 && overflows < 450);
    assert_true(met > 200);
}

/* Two sides of a wall thinner than the distance between them and the point: the normal decides. And ties: the lower
 * face. */
static void wall_body(void *user)
{
    qw_env *env = user;
    qw_vec3 p[8];
    for (int i = 0; i < 4; i++) {
        p[i] = qw_v3((float)(i & 1), (float)(i >> 1), 0.001f);
        p[4 + i] = qw_v3((float)(i & 1), (float)(i >> 1), 0);
    }
    uint32_t c[18] = {4, 6, 5, 5, 6, 7, 0, 1, 2, 1, 3, 2, 0, 1, 2, 1, 3, 2};
    qw_trimesh m = {.vertex_count = 8, .face_count = 6, .position = p, .corner = c};
    qw_bvh *bvh = qw_bvh_build(env, &m);
    qw_hit up = qw_bvh_nearest(bvh, qw_v3(0.2f, 0.2f, -0.1f), qw_v3(0, 0, 1), 0.5f, 1, 0);
    qw_hit down = qw_bvh_nearest(bvh, qw_v3(0.2f, 0.2f, 0.1f), qw_v3(0, 0, -1), 0.5f, 1, 2);
    assert_int_equal(up.face, 2);
    assert_int_equal(down.face, 0);
    qw_hit tie = qw_bvh_nearest(bvh, qw_v3(0.5f, 0.5f, 0.1f), qw_v3(0, 0, 0), 0, 1, 5);
    assert_int_equal(tie.face, 2);
    assert_true(fabsf(tie.distance2 - 0.099f * 0.099f) < 1e-8f);
}

static double ray_hit(const qw_trimesh *m, uint32_t f, qw_vec3 o, qw_vec3 d)
{
    double a[3], b[3], c[3], origin[3], dir[3], n[3], e[3], g[3];
    load(a, m->position[m->corner[3 * f]]), load(b, m->position[m->corner[3 * f + 1]]),
        load(c, m->position[m->corner[3 * f + 2]]);
    load(origin, o), load(dir, d);
    for (int k = 0; k < 3; k++) e[k] = b[k] - a[k], g[k] = c[k] - a[k];
    n[0] = e[1] * g[2] - e[2] * g[1], n[1] = e[2] * g[0] - e[0] * g[2], n[2] = e[0] * g[1] - e[1] * g[0];
    double slope = dot3(n, dir);
    if (slope == 0) return DBL_MAX;
    double q[3], t = (dot3(n, a) - dot3(n, origin)) / slope;
    for (int k = 0; k < 3; k++) q[k] = origin[k] + t * dir[k];
    const double *corner[3] = {a, b, c};
    for (int i = 0; i < 3; i++) {
        const double *u = corner[i], *v = corner[(i + 1) % 3];
        double s[3] = {v[0] - u[0], v[1] - u[1], v[2] - u[2]}, r[3] = {q[0] - u[0], q[1] - u[1], q[2] - u[2]};
        double x[3] = {s[1] * r[2] - s[2] * r[1], s[2] * r[0] - s[0] * r[2], s[0] * r[1] - s[1] * r[0]};
        if (dot3(x, n) < 0) return DBL_MAX;
    }
    return t >= 0 ? t : DBL_MAX;
}

static void ray_body(void *user)
{
    qw_env *env = user;
    for (int kind = 0; kind < 3; kind++) {
        state = 91 + (uint64_t)kind;
        qw_trimesh m = random_mesh(kind, 1200);
        qw_scope_begin(env);
        qw_bvh *bvh = qw_bvh_build(env, &m);
        for (int i = 0; i < 400; i++) {
            qw_vec3 o = random_point(1), d = qw_normalize(random_point(1));
            if (i % 4 == 0) d = qw_v3(i % 8 ? 1 : 0, 0, i % 8 ? 0 : -1);
            uint32_t skip = QW_NONE;
            for (int round = 0; round < 2; round++) {
                double best = DBL_MAX;
                for (uint32_t f = 0; f < m.face_count; f++)
                    if (f != skip) best = fmin(best, ray_hit(&m, f, o, d));
                qw_hit hit = qw_bvh_ray(bvh, o, d, FLT_MAX, skip);
                if (best == DBL_MAX) {
                    assert_int_equal(hit.face, QW_NONE);
                    break;
                }
                assert_int_not_equal(hit.face, QW_NONE);
                assert_true(fabs(sqrt(hit.distance2) - best) < 1e-5);
                assert_int_equal(qw_bvh_ray(bvh, o, d, (float)best * 0.99f, skip).face, QW_NONE);
                skip = hit.face;
            }
        }
        qw_scope_end(env);
    }
}

/* A closed surface has no gaps for rays from inside, even along its edges and through its vertices. */
static void watertight_body(void *user)
{
    qw_env *env = user;
    const qw_vec3 p[6] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    uint32_t c[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    qw_trimesh m = {.vertex_count = 6, .face_count = 8, .position = (qw_vec3 *)p, .corner = c};
    qw_bvh *bvh = qw_bvh_build(env, &m);
    state = 3;
    for (int i = 0; i < 3000; i++) {
        qw_vec3 d = i < 6 ? p[i] : qw_lerp(p[i % 6], p[(i % 6 + 2) % 6], between(0, 1));
        assert_int_not_equal(qw_bvh_ray(bvh, qw_v3(0, 0, 0), qw_normalize(d), 10, QW_NONE).face, QW_NONE);
    }
}

static void curve_body(void *user)
{
    qw_env *env = user;
    enum { COUNT = 2000 };
    static qw_vec3 from[COUNT], to[COUNT];
    const uint32_t counts[5] = {0, 1, 4, 37, COUNT};
    for (int size = 0; size < 5; size++) {
        state = 7 + (uint64_t)size;
        uint32_t n = counts[size];
        for (uint32_t i = 0; i < n; i++) {
            from[i] = random_point(0.5);
            to[i] = i % 7 == 0 ? from[i] : qw_add(from[i], random_point(i % 5 == 0 ? 0.5 : 0.02));
        }
        qw_scope_begin(env);
        qw_curve_tree *tree = qw_curve_tree_build(env, from, to, n);
        for (int i = 0; i < 300; i++) {
            qw_vec3 p = random_point(0.7);
            double best = DBL_MAX, a[3], b[3], q[3];
            load(q, p);
            for (uint32_t k = 0; k < n; k++)
                load(a, from[k]), load(b, to[k]), best = fmin(best, segment_distance2(a, b, q));
            qw_curve_hit hit = qw_curve_nearest(tree, p, 10);
            if (n == 0) {
                assert_int_equal(hit.segment, QW_NONE);
                continue;
            }
            assert_true(fabs(sqrt(hit.distance2) - sqrt(best)) < 1e-6);
            assert_true(qw_distance(hit.point, qw_lerp(from[hit.segment], to[hit.segment], hit.t)) < 1e-6f);
            assert_int_equal(qw_curve_nearest(tree, p, (float)sqrt(best) * 0.99f).segment, QW_NONE);
        }
        qw_scope_end(env);
    }
}

/* The same answers and the same layout for any number of threads, with more faces than one subtree holds. */
static void threads_body(void *user)
{
    qw_env *env = user;
    enum { SIDE = 150 };
    qw_vec3 *p = QW_NEW(env, qw_vec3, (SIDE + 1) * (SIDE + 1));
    uint32_t *c = QW_NEW(env, uint32_t, 6 * SIDE * SIDE), n = 0;
    for (uint32_t i = 0; i <= SIDE; i++)
        for (uint32_t j = 0; j <= SIDE; j++) {
            float x = (float)i / SIDE, y = (float)j / SIDE;
            p[i * (SIDE + 1) + j] = qw_v3(x, y, 0.1f * sinf(9 * x) * cosf(7 * y));
        }
    for (uint32_t i = 0; i < SIDE; i++)
        for (uint32_t j = 0; j < SIDE; j++) {
            uint32_t v = i * (SIDE + 1) + j, quad[6] = {v, v + SIDE + 1, v + SIDE + 2, v, v + SIDE + 2, v + 1};
            memcpy(c + n, quad, sizeof quad);
            n += 6;
        }
    qw_trimesh m = {.vertex_count = (SIDE + 1) * (SIDE + 1), .face_count = n / 3, .position = p, .corner = c};
    enum { QUERIES = 1000 };
    static qw_hit first[QUERIES];
    for (uint32_t threads = 1; threads <= 3; threads++) {
        qw_env_set_threads(env, threads);
        qw_scope_begin(env);
        qw_bvh *bvh = qw_bvh_build(env, &m);
        state = 1;
        for (int i = 0; i < QUERIES; i++) {
            qw_hit hit = qw_bvh_nearest(bvh, random_point(1), qw_v3(0, 0, 0), -1, FLT_MAX, QW_NONE);
            if (threads == 1) first[i] = hit;
            else assert_memory_equal(&hit, &first[i], sizeof hit);
        }
        qw_scope_end(env);
    }
    state = 2;
    for (int i = 0; i < 20; i++) { /* large enough for the serial part of the build: against brute force too */
        qw_vec3 q = random_point(1);
        double best = DBL_MAX;
        for (uint32_t f = 0; f < m.face_count; f++) best = fmin(best, triangle_distance2(&m, f, q));
        qw_hit hit = qw_bvh_nearest(qw_bvh_build(env, &m), q, qw_v3(0, 0, 0), -1, FLT_MAX, QW_NONE);
        assert_true(fabs(sqrt(hit.distance2) - sqrt(best)) < 1e-6);
    }
}

static void empty_body(void *user)
{
    qw_env *env = user;
    qw_trimesh m = {.face_count = 0};
    qw_bvh *bvh = qw_bvh_build(env, &m);
    assert_int_equal(qw_bvh_nearest(bvh, qw_v3(0, 0, 0), qw_v3(0, 0, 0), -1, 1, 0).face, QW_NONE);
    assert_int_equal(qw_bvh_ray(bvh, qw_v3(0, 0, 0), qw_v3(1, 0, 0), 1, QW_NONE).face, QW_NONE);
}

static void run(void (*body)(void *))
{
    qw_env *env = qw_env_create(NULL, 2);
    assert_int_equal(qw_protect(env, body, env), QW_OK);
    qw_env_destroy(env);
}

static void test_nearest(void **s) { (void)s, run(nearest_body); }
static void test_parts(void **s) { (void)s, run(part_body); }
static void test_normals(void **s) { (void)s, run(normal_body); }
static void test_caches(void **s) { (void)s, run(cache_body); }
static void test_wall(void **s) { (void)s, run(wall_body); }
static void test_rays(void **s) { (void)s, run(ray_body); }
static void test_watertight(void **s) { (void)s, run(watertight_body); }
static void test_curves(void **s) { (void)s, run(curve_body); }
static void test_threads(void **s) { (void)s, run(threads_body); }
static void test_empty(void **s) { (void)s, run(empty_body); }

QW_TEST_SUITE(bvh)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nearest), cmocka_unit_test(test_parts),   cmocka_unit_test(test_normals),
        cmocka_unit_test(test_wall),    cmocka_unit_test(test_rays),    cmocka_unit_test(test_watertight),
        cmocka_unit_test(test_curves),  cmocka_unit_test(test_threads), cmocka_unit_test(test_empty),
        cmocka_unit_test(test_caches),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
