/* The skin of a mesh, as --wrap makes it, and what a second implementation says of it: run by bench/paper, which builds
 * it with cc -std=c17 -O2 -Iinclude -Isrc -Itests bench/check_skin.c build/libquadwright.a ... check_skin MESH DISTANCE
 * [THREADS]        prints one line of JSON DISTANCE: a share of the diagonal, or with a q behind it of the quads' edges
 * and their number: 0.75q2000. */
#define _POSIX_C_SOURCE 200809L /* clock_gettime */
#include "quadwright/quadwright.h"

#include "geometry/trimesh.h"
#include "skin_check.h"
#include "products/wrap/wrap.h"

#include <math.h>
#include <stdio.h>
#include <time.h>

typedef struct check {
    qw_env *env;
    qw_mesh_view view;
    const char *distance;
    bool good; /* closed, manifold, one component a cluster, and no two triangles intersect */
} check;

static qw_clean_input input_of(qw_env *env, const qw_mesh_view *m)
{
    uint32_t *begin = QW_NEW(env, uint32_t, (size_t)m->face_count + 1);
    begin[0] = 0;
    for (uint32_t f = 0; f < m->face_count; f++)
        begin[f + 1] = begin[f] + (m->face_sizes ? m->face_sizes[f] : m->uniform_face_size);
    return (qw_clean_input){.vertex_count = m->vertex_count,
                            .face_count = m->face_count,
                            .position = m->positions,
                            .face_begin = begin,
                            .corner = m->corners};
}

static double distance_of(const check *c, const qw_clean_input *in)
{
    char *rest;
    double value = strtod(c->distance, &rest);
    if (*rest == 'q') return qw_wrap_distance_for(c->env, in, strtod(rest + 1, NULL), value);
    return value * qw_wrap_diagonal(in);
}

/* Vertices as whole numbers: int32_t[vertices][3]. */
static int32_t *whole_positions(qw_env *env, const qw_wrapped *w)
{
    int32_t *at = QW_NEW(env, int32_t, 3 * (size_t)w->skin.vertex_count);
    for (size_t i = 0; i < 3 * (size_t)w->skin.vertex_count; i++)
        at[i] = (int32_t)lround((w->skin.position[i] - w->origin[i % 3]) / w->unit);
    return at;
}

/* How many edges have not just two faces that run along them either way, sorted apart from src/geometry. */
static int by_edge(const void *a, const void *b) { return memcmp(a, b, sizeof(uint64_t[2])); }

static int64_t odd_edges(qw_env *env, const qw_clean_input *skin)
{
    uint32_t count = 3 * skin->face_count;
    uint64_t(*edge)[2] = qw_alloc(env, count, sizeof *edge);
    int64_t odd = 0;
    for (uint32_t h = 0; h < count; h++) {
        uint64_t a = skin->corner[h], b = skin->corner[h - h % 3 + (h + 1) % 3];
        edge[h][0] = (a < b ? a : b) << 32 | (a < b ? b : a), edge[h][1] = a < b;
    }
    qsort(edge, count, sizeof *edge, by_edge);
    for (uint32_t i = 0, j; i < count; i = j) {
        for (j = i; j < count && edge[j][0] == edge[i][0]; j++) {}
        odd += !(j - i == 2 && edge[i][1] != edge[i + 1][1]);
    }
    return odd;
}

/* Shares of the diagonal: of what of the input is seen the mean distance to the skin, and that of its sharp edges to
 * edges of the skin below which 95 % stay. */
static void measure(const check *c, const qw_wrapped *w, double diagonal, double *mean, double *sharp)
{
    qw_mesh_view skin = {.size = sizeof skin,
                         .vertex_count = w->skin.vertex_count,
                         .face_count = w->skin.face_count,
                         .uniform_face_size = 3,
                         .positions = w->skin.position,
                         .corners = w->skin.corner};
    qw_topology t;
    qw_quality q;
    *mean = *sharp = -1;
    if (qw_measure_seen(&skin, &c->view, w->distance, NULL, &t, &q) != QW_OK) return;
    *mean = q.in_to_out_mean * q.mean_edge / diagonal, *sharp = q.sharp_p95 * q.mean_edge / diagonal;
}

static void body(void *user)
{
    check *c = user;
    qw_env *env = c->env;
    qw_clean_input in = input_of(env, &c->view);
    double diagonal = qw_wrap_diagonal(&in), distance = distance_of(c, &in);
    struct timespec from, to;
    clock_t begun = clock();
    clock_gettime(CLOCK_MONOTONIC, &from);
    qw_env_reset_peak(env);
    qw_wrapped w = qw_wrap(env, &in, distance);
    double bytes = (double)qw_env_peak(env), processor = (double)(clock() - begun) / CLOCKS_PER_SEC;
    clock_gettime(CLOCK_MONOTONIC, &to);
    qw_trimesh m = {
        .vertex_count = w.skin.vertex_count, .face_count = w.skin.face_count, .corner = (uint32_t *)w.skin.corner};
    m.position = QW_NEW_ZERO(env, qw_vec3, m.vertex_count);
    int64_t odd = odd_edges(env, &w.skin), components = -1;
    if (odd == 0) {
        qw_trimesh_link(env, &m), qw_trimesh_validate(env, &m); /* one fan at each vertex */
        components = qw_trimesh_census(env, &m).components;
    }
    int64_t pairs = count_intersections(whole_positions(env, &w), w.skin.corner, w.skin.face_count);
    double mean, sharp;
    measure(c, &w, diagonal, &mean, &sharp);
    c->good = odd == 0 && components == w.clusters && pairs == 0;
    printf("{\"skin\": %s, \"triangles\": %lld, \"skin_triangles\": %u, \"odd_edges\": %lld, \"components\": %lld, "
           "\"clusters\": %lld, "
           "\"intersections\": %lld, \"distance\": %.6g, \"seen_off\": %.6g, \"measured\": %.6g, \"sharp_p95\": %.6g, "
           "\"farthest\": %.4g, \"hidden\": %.4f, "
           "\"processor\": %.3f, "
           "\"wall\": %.3f, \"megabytes\": %.1f}\n",
           c->good ? "true" : "false", (long long)w.triangles, w.skin.face_count, (long long)odd, (long long)components,
           (long long)w.clusters, (long long)pairs, distance / diagonal, w.stats.seen_off * w.unit / diagonal, mean,
           sharp, w.stats.skin_off * w.unit / distance, w.stats.hidden_area, processor,
           (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec), bytes / (1 << 20));
}

int main(int argc, char **argv)
{
    qw_mesh *mesh;
    check c = {.distance = argc > 2 ? argv[2] : ""};
    if (argc < 3) return fprintf(stderr, "check_skin MESH DISTANCE [THREADS]\n"), 2;
    if (qw_load(argv[1], NULL, &mesh) != QW_OK) return fprintf(stderr, "%s\n", qw_mesh_message(mesh)), 1;
    c.view = qw_mesh_get(mesh);
    c.env = qw_env_create(NULL, argc > 3 ? (uint32_t)atoi(argv[3]) : 1);
    qw_status status = qw_protect(c.env, body, &c);
    if (status != QW_OK) fprintf(stderr, "%s\n", qw_env_message(c.env));
    qw_env_destroy(c.env);
    qw_mesh_destroy(mesh);
    return status != QW_OK || !c.good;
}
