#include "remesh/quantise/quantise.h"

#include "base/mechanisms.h"
#include "base/constants.h"
#include "remesh/quantise/closed.h"
#include "remesh/quantise/closed_curves.h"
#include "remesh/quantise/flatten.h"
#include "remesh/quantise/search.h"
#include "remesh/quantise/narrow_bands.h"
#include "remesh/quantise/acute_corners.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A component whose closed offsets have less than this share of the area by its edges has collapsed (around a
   protrusion thinner than a quad): no size gives it its count, and a large size only makes offsets long. */
static const double LEAST_AREA = 0.25;
/* The largest weight that qw_complex_weigh gives. */
static const float LOOP_WEIGHT = 3;

static double twice_area(unsigned rot_a, qw_real2 a, unsigned rot_b, qw_real2 b)
{
    a = qw_turn_real(rot_a, a), b = qw_turn_real(rot_b, b);
    return (double)a.x * (double)b.y - (double)a.y * (double)b.x;
}

static double area_on(const qw_offset_mesh *m, const qw_real2 *closed)
{
    double sum = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h += 3)
        sum += twice_area(m->rot[h], closed[m->edge[h]], m->rot[h + 1], closed[m->edge[h + 1]]);
    return sum / 2;
}

/* Of each component: the area of the surface, less that of its decimated complex. */
static double *cut_areas(qw_env *env, const qw_offset_mesh *m, const qw_real2 *closed, const qw_components *components)
{
    assert(closed && components->of_vertex);
    double *cut = QW_NEW_ZERO(env, double, components->count);
    for (uint32_t h = 0; h < 3 * m->face_count; h += 3)
        cut[components->of_vertex[m->corner[h]]] +=
            twice_area(m->rot[h], closed[m->edge[h]], m->rot[h + 1], closed[m->edge[h + 1]]) / 2;
    for (uint32_t p = 0; p < components->count; p++) {
        const qw_complex *c = &components->component[p].decimated.complex;
        double sum = 0;
        for (uint32_t h = 0; h < 3 * c->face_count; h += 3)
            sum += twice_area(c->rot[h], c->real[c->edge[h]], c->rot[h + 1], c->real[c->edge[h + 1]]);
        cut[p] -= sum / 2;
    }
    return cut;
}

/* Frees curve edges on the surface whose constrained component the integers have changed, as the flow on the complex
   had to free them. */
static void release_moved(qw_offset_mesh *m)
{
    for (uint32_t e = 0; e < m->edge_count; e++) {
        if (m->d[e].x) m->fixed[e] &= (uint8_t)~QW_FIXED_X;
        if (m->d[e].y) m->fixed[e] &= (uint8_t)~QW_FIXED_Y;
    }
}

/* Makes constrained loops that meet no other curve, the rims of holes, QW_HOLE_EDGES long and stiff where `scale`
   leaves them shorter: a hole with fewer edges around would close. */
static void keep_loops_open(qw_env *env, qw_component *component, double scale)
{
    assert(scale > 0);
    const qw_complex *c = &component->decimated.complex;
    qw_scope_begin(env);
    qw_closed_curves curves = qw_find_closed_curves(env, component);
    for (uint32_t i = 0; i < curves.count; i++) {
        const uint32_t *edge = curves.edge + curves.begin[i], count = curves.begin[i + 1] - curves.begin[i];
        double length = 0;
        for (uint32_t k = 0; k < count; k++)
            length += fabs((double)c->real[edge[k]].x) + fabs((double)c->real[edge[k]].y);
        length *= scale;
        qw_did(env, QW_MECH_LOOPS_OPEN, length > 0 && length < QW_HOLE_EDGES);
        for (uint32_t k = 0; k < count && length > 0 && length < QW_HOLE_EDGES; k++) {
            c->real[edge[k]].x *= (float)(QW_HOLE_EDGES / length),
                c->real[edge[k]].y *= (float)(QW_HOLE_EDGES / length);
            c->weight[edge[k]] = LOOP_WEIGHT;
        }
    }
    qw_scope_end(env);
}

static void take_sizes(qw_offset_mesh *m, const qw_components *components, const double *scale)
{
    assert(components->of_vertex && scale);
    for (uint32_t e = 0; e < m->edge_count; e++) {
        float by = (float)scale[components->of_vertex[m->corner[m->half[e]]]];
        m->real[e].x *= by, m->real[e].y *= by;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) m->size[v] /= (float)scale[components->of_vertex[v]];
}

/* A complex with the closed offsets, and what is asked of its integers. All in the current scope. */
typedef struct reduced {
    qw_decimated whole;
    qw_components components;
    qw_search_request request;
} reduced;

/* Decimates the surface, weighs its edges and splits it into components. In the current scope. */
static reduced reduce(qw_env *env, const qw_offset_mesh *m, const qw_real2 *closed, const qw_quantise_request *asked)
{
    assert(closed && asked->quads > 0);
    reduced r = {.whole = qw_decimate(env, m, closed)};
    r.whole.complex.weight = QW_NEW(env, float, r.whole.complex.edge_count);
    qw_complex_weigh(&r.whole.complex);
    r.components = qw_split_components(env, &r.whole, m);
    double area = area_on(m, closed), least = LEAST_AREA * area_on(m, m->real);
    r.request = (qw_search_request){.quads = asked->quads,
                                    .times = asked->times,
                                    .size = sqrt(asked->quads / fmax(fmax(area, least), 1)),
                                    .cut = cut_areas(env, m, closed, &r.components),
                                    .loops = asked->loops,
                                    .effort = fmin(1, asked->quads / fmax(r.whole.complex.face_count, 1)),
                                    .apart = true};
    for (uint32_t p = 0; p < r.components.count && qw_uses(env, QW_MECH_LOOPS_OPEN); p++)
        keep_loops_open(env, &r.components.component[p], r.request.size);
    return r;
}

static void count(qw_quantise_counts *counts, const qw_offset_mesh *m, const reduced *r, const qw_search_result *found,
                  const qw_closed_counts *closing, const qw_flatten_counts *flattening)
{
    counts->decimated_faces = r->whole.complex.face_count, counts->decimated_edges = r->whole.complex.edge_count;
    counts->regular = found->regular, counts->tries = found->tries;
    counts->inverted = found->inverted, counts->rounding_cost = found->rounding_cost;
    counts->squeezed = (double)closing->squeezed / fmax(m->face_count, 1);
    counts->energy = flattening->energy;
    counts->iterations = closing->iterations + flattening->iterations;
}

/* What the search and the two solves came to, for the log. */
static void log_counts(qw_env *env, const reduced *r, const qw_search_result *found, const qw_closed_counts *closing,
                       const qw_flatten_counts *flattening)
{
    qw_log(env, QW_LOG_DEBUG,
           "closed: %u squeezed; decimated complex: %u triangles in %u components; cost %.3f, %u inverted, "
           "%u vanish",
           closing->squeezed, r->whole.complex.face_count, r->components.count, found->rounding_cost, found->inverted,
           found->collapsed);
    qw_log(env, QW_LOG_DEBUG, "lines that meet: %u of %u tried; length of all %lld, was %lld", found->meetings.kept,
           found->meetings.tried, (long long)found->meetings.length_after, (long long)found->meetings.length_before);
    qw_log(env, QW_LOG_DEBUG, "flat: energy %.4f", flattening->energy);
}

qw_quantise_counts qw_quantise(qw_env *env, qw_offset_mesh *m, const qw_quantise_request *asked)
{
    assert(asked->quads > 0 && m->real && m->fixed && m->constraint && m->direction);
    qw_quantise_counts counts = {0};
    qw_closed_counts closing;
    qw_flatten_counts flattening;
    qw_scope_begin(env);
    if (qw_uses(env, QW_MECH_ACUTE_CORNERS)) counts.released_edges = qw_release_acute_corners(env, m, asked->verdict);
    qw_did(env, QW_MECH_ACUTE_CORNERS, counts.released_edges);
    if (qw_uses(env, QW_MECH_NARROW_BANDS)) counts.band_triangles = qw_stretch_narrow_bands(env, m, asked->quads);
    qw_did(env, QW_MECH_NARROW_BANDS, counts.band_triangles);
    qw_log(env, QW_LOG_DEBUG, "%lld triangles in narrow bands", (long long)counts.band_triangles);
    float *stiffness = QW_NEW(env, float, m->edge_count);
    qw_real2 *closed = qw_closed_offsets(env, m, (float)fmin(asked->follow / QW_USUAL_FOLLOW, 1), stiffness, &closing);
    qw_progress(env, 0.4);
    reduced r = reduce(env, m, closed, asked);
    qw_int2 *d = QW_NEW(env, qw_int2, r.whole.complex.edge_count);
    qw_search_result found = qw_search_integers(env, &r.components, &r.request, d);
    qw_progress(env, 0.6);
    qw_decimated_expand(&r.whole, d, m->d);
    release_moved(m);
    take_sizes(m, &r.components, found.scale);
    qw_flatten(env, m, stiffness, &flattening);
    count(&counts, m, &r, &found, &closing, &flattening);
    log_counts(env, &r, &found, &closing, &flattening);
    qw_scope_end(env);
    return counts;
}
