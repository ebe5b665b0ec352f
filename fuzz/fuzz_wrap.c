/* Soups of triangles and boxes on a small lattice, now and then with a little added to their coordinates, into the
 * wrap: the skin is closed, manifold and outward, has one component a cluster, and a second implementation finds no two
 * triangles that intersect. */
#include "skin_check.h"
#include "products/wrap/wrap.h"

#include <math.h>
#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_VERTICES = 96, MOST_FACES = 96, HEADER = 3, GRID = 16 };

typedef struct trial {
    qw_env *env;
    uint32_t vertex_count, face_count;
    double position[3 * MOST_VERTICES];
    uint32_t corner[3 * MOST_FACES], begin[MOST_FACES + 1];
    double share; /* of the diagonal */
} trial;

#define REQUIRE(condition, what) \
    if (!(condition)) fprintf(stderr, "%s\n", what), abort()

static void check(const trial *t, const qw_wrapped *w)
{
    qw_env *env = t->env;
    uint32_t n = w->skin.vertex_count;
    qw_trimesh m = {.vertex_count = n, .face_count = w->skin.face_count, .corner = (uint32_t *)w->skin.corner};
    int32_t *at = QW_NEW(env, int32_t, 3 * (size_t)n);
    m.position = QW_NEW(env, qw_vec3, n);
    for (uint32_t v = 0; v < n; v++) {
        for (size_t k = 0; k < 3; k++)
            at[3 * (size_t)v + k] = (int32_t)lround((w->skin.position[3 * (size_t)v + k] - w->origin[k]) / w->unit);
        const double *p = w->skin.position + 3 * (size_t)v;
        m.position[v] = qw_v3((float)p[0], (float)p[1], (float)p[2]);
    }
    qw_trimesh_link(env, &m);
    qw_trimesh_validate(env, &m);
    for (uint32_t h = 0; h < 3 * m.face_count; h++) REQUIRE(m.twin[h] != QW_NONE, "the skin is open");
    REQUIRE(qw_trimesh_census(env, &m).components == w->clusters, "a cluster has not one component");
    REQUIRE(count_intersections(at, w->skin.corner, m.face_count) == 0, "the skin intersects itself");
}

static void body(void *user)
{
    trial *t = user;
    const qw_clean_input in = {.vertex_count = t->vertex_count,
                               .face_count = t->face_count,
                               .position = t->position,
                               .face_begin = t->begin,
                               .corner = t->corner};
    double diagonal = qw_wrap_diagonal(&in);
    if (!(diagonal > 0)) return;
    qw_wrapped w = qw_wrap(t->env, &in, t->share * diagonal);
    check(t, &w);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    trial t = {.vertex_count = 0};
    if (size < HEADER + 12) return 0;
    /* few cells across are quick, and as good at meeting each other's planes, edges and corners */
    t.share = data[0] < 4 ? 0.08 : data[0] < 32 ? 0.2 : data[0] < 128 ? 0.3 + data[0] / 512.0 : (data[0] - 64) / 64.0;
    double shift = data[1] < 128 ? 0 : data[1] / 4096.0, squeeze = data[2] < 200 ? 1 : (data[2] - 199) / 64.0;
    const uint8_t *at = data + HEADER, *end = data + size;
    for (; end - at >= 4 && t.vertex_count < MOST_VERTICES; at += 4) {
        double *p = t.position + 3 * (size_t)t.vertex_count++;
        for (int k = 0; k < 3; k++) p[k] = at[k] % GRID + shift * (at[3] >> (2 * k) & 3);
        p[2] *= squeeze;
    }
    for (uint32_t f = 0; 3 * f + 2 < t.vertex_count;
         f++) { /* corners follow one another, or go back by the last bits */
        uint8_t back = data[HEADER + 12 * f + 3] >> 6;
        for (uint32_t i = 0; i < 3; i++) t.corner[3 * f + i] = 3 * f + i >= back ? 3 * f + i - back : 3 * f + i;
        t.face_count++;
    }
    if (t.face_count == 0) return 0;
    for (uint32_t f = 0; f <= t.face_count; f++) t.begin[f] = 3 * f;
    t.env = qw_env_create(NULL, 1);
    qw_status status = qw_protect(t.env, body, &t);
    if (status != QW_OK && status != QW_ONLY_DEGENERATE && status != QW_TOO_LARGE)
        fprintf(stderr, "%s\n", qw_env_message(t.env)), abort();
    qw_env_destroy(t.env);
    return 0;
}
