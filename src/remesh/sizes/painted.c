/* Cleaning renumbers vertices, parts some and joins others, but knows of each triangle from which polygon it comes: a
 * vertex takes the density of the nearest corner of those polygons. A surface that was made coarser, or of which
 * small components were taken out, takes it from where its vertices lie on the clean one. */
#include "remesh/sizes/painted.h"

#include "geometry/bvh.h"

#include <assert.h>
#include <math.h>

/* Of a polygon with more corners than this the mean is taken, as each triangle looks at all of them. */
enum { MOST_CORNERS = 64 };

static double distance2(const double a[3], const double b[3])
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* The density at a place in a polygon of the input: that of the nearest corner, or the mean of very many. */
static double density_in_polygon(const qw_clean_input *in, uint32_t polygon, const double place[3])
{
    uint32_t begin = in->face_begin[polygon], end = in->face_begin[polygon + 1], nearest = begin;
    double sum = 0, least = INFINITY;
    for (uint32_t c = begin; c < end; c++) {
        uint32_t v = in->corner[c];
        if (end - begin > MOST_CORNERS) {
            sum += (double)in->density[v];
            continue;
        }
        double d = distance2(in->position + 3 * (size_t)v, place);
        if (d < least) least = d, nearest = c;
    }
    return end - begin > MOST_CORNERS ? sum / (end - begin) : (double)in->density[in->corner[nearest]];
}

/* At the vertices of the clean surface: the mean over the triangles around each. */
qw_density *qw_painted_at_clean(qw_env *env, const qw_clean_input *input, const qw_clean *clean)
{
    assert(input->density);
    const qw_trimesh *m = &clean->mesh;
    qw_density *density = QW_NEW(env, qw_density, m->vertex_count);
    double *sum = QW_NEW_ZERO(env, double, m->vertex_count);
    uint32_t *count = QW_NEW_ZERO(env, uint32_t, m->vertex_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t v = m->corner[h];
        double place[3];
        qw_place_in_input(clean, m->position[v], place);
        sum[v] += density_in_polygon(input, clean->source_face[h / 3], place);
        count[v]++;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) density[v] = count[v] ? (qw_density)(sum[v] / count[v]) : 1;
    qw_free(env, sum), qw_free(env, count);
    return density;
}

typedef struct painting {
    const qw_trimesh *clean, *surface;
    const qw_bvh *tree; /* of the clean surface */
    const qw_density *at_clean;
    const qw_vec3 *normal; /* [surface vertices] */
    qw_density *density;   /* [surface vertices] */
} painting;

/* The painted density at each vertex, from the nearest place of the clean surface. */
static void paint_block(void *user, uint32_t begin, uint32_t end)
{
    const painting *a = user;
    uint32_t hint = QW_NONE;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 p = a->surface->position[v];
        qw_hit hit = qw_bvh_nearest(a->tree, p, a->normal[v], QW_SAME_SHEET, INFINITY, hint);
        if (hit.face == QW_NONE) hit = qw_bvh_nearest(a->tree, p, qw_v3(0, 0, 0), -1, INFINITY, hint);
        a->density[v] = 1;
        if (hit.face == QW_NONE) continue;
        const uint32_t *c = a->clean->corner + 3 * (size_t)hit.face;
        float sum = 0;
        for (int i = 0; i < 3; i++) sum += hit.weight[i] * a->at_clean[c[i]];
        a->density[v] = fminf(fmaxf(sum, QW_LEAST_DENSITY), QW_MOST_DENSITY);
        hint = hit.face;
    }
}

qw_density *qw_painted_density(qw_env *env, const qw_clean_input *input, const qw_clean *clean,
                               const qw_trimesh *surface)
{
    if (!input->density) return NULL;
    if (surface->position == clean->mesh.position) return qw_painted_at_clean(env, input, clean);
    qw_density *density = QW_NEW(env, qw_density, surface->vertex_count);
    qw_scope_begin(env);
    painting a = {&clean->mesh,
                  surface,
                  qw_bvh_build(env, &clean->mesh),
                  qw_painted_at_clean(env, input, clean),
                  qw_vertex_normals(env, surface),
                  density};
    qw_parallel(env, surface->vertex_count, QW_GRAIN, paint_block, &a);
    qw_scope_end(env);
    return density;
}
