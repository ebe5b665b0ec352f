#include "sizes.h"

#include "field/loops.h"
#include "field/scale.h"
#include "math/elementary.h"

#include <math.h>
#include <string.h>

/* The working mesh is made for at least this many quads a component, so that a component of any topology has something
 * to be cut from. */
static const double LEAST_QUADS_OPEN = 4, LEAST_QUADS_CLOSED = 24;
/* Fewer have no topology to keep: one quad, and the six of a cube. */
enum { FEWEST_QUADS_OPEN = 1, FEWEST_QUADS_CLOSED = 6 };
/* Where a component has hardly any area, squares of it would be without number along its length: a quad may be so many
 * times narrower than long there. */
static const double NARROW = 4;

/* Where something was found too thin the size is made smaller by this factor, down to this share of rho. */
static const float REFINEMENT = 0.6f, LEAST_SIZE = 0.3f;
enum { REFINE_GRAIN = 4096 };

static double faces_asked(const qw_run_state *run, const qw_options *o)
{
    double triangles = (double)run->clean.counts.triangles;
    if (o->faces > 0) return (double)o->faces;
    if (o->vertices > 0) return (double)o->vertices; /* on a closed quad mesh V = F + 2 - 2 genus */
    if (o->edge_length > 0)
        return run->area / (o->edge_length * run->clean.frame.scale * o->edge_length * run->clean.frame.scale);
    if (o->ratio > 0) return o->ratio * triangles;
    return fmin(fmax(triangles / 4, 100), 20000);
}

double qw_faces_wanted(const qw_run_state *run, const qw_options *options)
{
    return fmin(fmax(qw_floor(faces_asked(run, options) + 0.5), 1), 2e7);
}

double qw_edge_wanted(const qw_run_state *run, double faces)
{
    return fmax(sqrt(run->apart.area / faces), run->apart.extent / (NARROW * faces));
}

/* uint32_t[s->vertex_count]. */
static uint32_t *vertex_components(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    uint32_t *component = QW_NEW(env, uint32_t, s->vertex_count);
    if (census->components == 1) memset(component, 0, s->vertex_count * sizeof *component);
    else
        for (uint32_t h = 0; h < 3 * s->face_count; h++) component[s->corner[h]] = census->component[h / 3];
    return component;
}

static float lesser(float a, float b) { return b < a ? b : a; }
static float greater(float a, float b) { return b > a ? b : a; }

/* Diagonals of the boxes about the components of the surface, double[census->components]. */
static double *extents(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    qw_vec3 *low = QW_NEW(env, qw_vec3, (size_t)census->components),
            *high = QW_NEW(env, qw_vec3, (size_t)census->components);
    double *extent = QW_NEW(env, double, (size_t)census->components);
    uint32_t *component = vertex_components(env, s, census);
    for (int64_t c = 0; c < census->components; c++)
        low[c] = qw_v3(INFINITY, INFINITY, INFINITY), high[c] = qw_scale(low[c], -1);
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        uint32_t c = component[v];
        qw_vec3 p = s->position[v];
        low[c] = qw_v3(lesser(low[c].x, p.x), lesser(low[c].y, p.y), lesser(low[c].z, p.z));
        high[c] = qw_v3(greater(high[c].x, p.x), greater(high[c].y, p.y), greater(high[c].z, p.z));
    }
    for (int64_t c = 0; c < census->components; c++) extent[c] = qw_distance(low[c], high[c]);
    qw_free(env, low), qw_free(env, high), qw_free(env, component);
    return extent;
}

double qw_total_extent(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    double *extent = extents(env, s, census), sum = 0;
    for (int64_t c = 0; c < census->components; c++) sum += extent[c];
    qw_free(env, extent);
    return sum;
}

/* [census->components]: whether it has a boundary. */
static uint8_t *find_open(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    uint8_t *open = QW_NEW_ZERO(env, uint8_t, (size_t)census->components);
    for (uint32_t h = 0; census->boundary_loops > 0 && h < 3 * s->face_count; h++)
        if (s->twin[h] == QW_NONE) open[census->component[h / 3]] = 1;
    return open;
}

double qw_faces_needed(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    uint8_t *open = find_open(env, s, census);
    double sum = 0;
    for (int64_t c = 0; c < census->components; c++) sum += open[c] ? FEWEST_QUADS_OPEN : FEWEST_QUADS_CLOSED;
    qw_free(env, open);
    return sum;
}

/* ---- around what was found too thin */

typedef struct refining {
    const qw_run_state *run;
    float least; /* of the sizes made here */
    float *size;
} refining;

static bool may_touch(const qw_refinement *r, qw_vec3 low, qw_vec3 high)
{
    qw_vec3 c = r->center, to = qw_v3(fmaxf(low.x - c.x, c.x - high.x), fmaxf(low.y - c.y, c.y - high.y),
                                      fmaxf(low.z - c.z, c.z - high.z));
    return fmaxf(fmaxf(to.x, to.y), to.z) < r->radius;
}

/* Once an attempt is enough: attempts follow one another in run->refine. */
static void refine_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const refining *a = user;
    const qw_vec3 *position = a->run->surface.position;
    uint8_t refined[REFINE_GRAIN] = {0}; /* the last attempt that made it smaller */
    qw_vec3 low = position[begin], high = low;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 p = position[v];
        low = qw_v3(lesser(low.x, p.x), lesser(low.y, p.y), lesser(low.z, p.z));
        high = qw_v3(greater(high.x, p.x), greater(high.y, p.y), greater(high.z, p.z));
    }
    for (uint32_t i = 0; i < a->run->refine_count; i++) {
        const qw_refinement *r = &a->run->refine[i];
        if (!may_touch(r, low, high)) continue;
        for (uint32_t v = begin; v < end; v++) {
            if (refined[v - begin] == r->attempt || qw_distance(position[v], r->center) >= r->radius) continue;
            refined[v - begin] = r->attempt;
            a->size[v] = fmaxf(a->size[v] * REFINEMENT, fminf(a->size[v], a->least));
        }
    }
}

float *qw_wanted_size(const qw_run_state *run, double rho, float **plain)
{
    const qw_trimesh *s = &run->surface;
    const qw_census *census = &run->surface_census;
    qw_env *env = run->env;
    double *area = QW_NEW_ZERO(env, double, (size_t)census->components), *extent = extents(env, s, census);
    uint8_t *open = find_open(env, s, census);
    float *size = QW_NEW(env, float, s->vertex_count), *most = QW_NEW(env, float, (size_t)census->components);
    uint32_t *component = vertex_components(env, s, census);
    for (uint32_t f = 0; f < s->face_count; f++) area[census->component[f]] += 0.5 * qw_length(qw_face_cross(s, f));
    for (int64_t c = 0; c < census->components; c++) {
        double quads = open[c] ? LEAST_QUADS_OPEN : LEAST_QUADS_CLOSED,
               whole = fmax(sqrt(area[c] / quads), extent[c] / (NARROW * quads));
        most[c] = (float)fmin(rho, fmax(whole, 1e-9));
    }
    for (uint32_t v = 0; v < s->vertex_count; v++) size[v] = most[component[v]];
    *plain = QW_NEW(env, float, s->vertex_count);
    memcpy(*plain, size, s->vertex_count * sizeof *size);
    qw_fit_loops(env, s, run->options.align_boundary != 0, size);
    refining a = {run, (float)rho * LEAST_SIZE, size};
    if (run->refine_count) qw_parallel(env, s->vertex_count, REFINE_GRAIN, refine_block, &a);
    qw_limit_gradation(env, s, size, 1.0f);
    qw_free(env, area), qw_free(env, open), qw_free(env, extent), qw_free(env, most), qw_free(env, component);
    return size;
}
