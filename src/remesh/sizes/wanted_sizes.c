#include "remesh/sizes/wanted_sizes.h"

#include "base/constants.h"
#include "remesh/sizes/around.h"
#include "remesh/sizes/density.h"
#include "remesh/sizes/needs.h"
#include "remesh/sizes/scale.h"
#include "remesh/sizes/small_loops.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* No wanted edge length is less: single precision resolves no less in the centred frame. */
static const double LEAST_EDGE = 1e-9;

/* Edge length of so many quads on an area: that of squares, but at least the extent over their number, so that a
   component of hardly any area gets no more quads along it than there are in all. At four times as many, boxes and
   fans of 1 : 10,000 took ten times as long. */
double qw_edge_of(double area, double extent, double quads) { return fmax(sqrt(area / quads), extent / quads); }

static float lesser(float a, float b) { return b < a ? b : a; }
static float greater(float a, float b) { return b > a ? b : a; }

/* ---- around what was found too thin */

typedef struct refining {
    const qw_size_request *request;
    float least; /* no refined size is less */
    float *size;
} refining;

static bool may_touch(const qw_refinement *r, qw_vec3 low, qw_vec3 high)
{
    qw_vec3 c = r->center, to = qw_v3(fmaxf(low.x - c.x, c.x - high.x), fmaxf(low.y - c.y, c.y - high.y),
                                      fmaxf(low.z - c.z, c.z - high.z));
    return fmaxf(fmaxf(to.x, to.y), to.z) < r->radius;
}

/* A vertex becomes smaller once a round, however many balls it lies in; refinements are sorted by round. */
static void refine_block(void *user, uint32_t begin, uint32_t end)
{
    const refining *a = user;
    const qw_vec3 *position = a->request->surface->position;
    uint8_t refined[QW_GRAIN_LIGHT] = {0}; /* the last round that made it smaller */
    qw_vec3 low = position[begin], high = low;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 p = position[v];
        low = qw_v3(lesser(low.x, p.x), lesser(low.y, p.y), lesser(low.z, p.z));
        high = qw_v3(greater(high.x, p.x), greater(high.y, p.y), greater(high.z, p.z));
    }
    for (uint32_t i = 0; i < a->request->refinements; i++) {
        const qw_refinement *r = &a->request->refinement[i];
        if (!may_touch(r, low, high)) continue;
        for (uint32_t v = begin; v < end; v++) {
            if (refined[v - begin] == r->round || qw_distance(position[v], r->center) >= r->radius) continue;
            refined[v - begin] = r->round;
            a->size[v] = fmaxf(a->size[v] * (float)QW_REFINED_SIZE, fminf(a->size[v], a->least));
        }
    }
}

/* ---- by the shape, and by components */

/* Factors of the wanted size at the vertices of the surface; NULL: 1 everywhere. *tips: of qw_shared_sizes. */
static float *density_factors(qw_env *env, const qw_size_request *w, qw_tip_list *tips)
{
    bool has_density = w->adaptive > 0 || w->painted;
    if (!has_density && !tips) return NULL;
    float *factor = NULL;
    qw_scope_begin(env);
    qw_surface_cells cells = qw_cells_of_surface(env, w->surface, w->rho);
    if (tips) *tips = qw_find_tips(env, &cells, (float)w->rho, (float)QW_SEEN_IN_OUTLINE);
    if (has_density) {
        qw_density_request request = {.edge = w->rho,
                                      .strength = w->adaptive,
                                      .painted = w->painted,
                                      .with_boundary = w->with_boundary,
                                      .cells = &cells,
                                      .tree = w->tree};
        factor = qw_size_factors(env, w->surface, &request);
        qw_keep(env, factor);
    }
    if (tips) qw_keep(env, tips->tip);
    qw_scope_end(env);
    return factor;
}

/* The longest edge with which a component has so many quads. */
static double longest_of(const qw_part *part, double quads)
{
    return fmax(qw_edge_of(part->area, part->extent, quads), LEAST_EDGE);
}

/* No component gets edges so long that fewer quads are left than it needs. */
static void limit_sizes(const qw_part *part, const uint32_t *component, uint32_t count, float *size)
{
    for (uint32_t v = 0; v < count; v++) {
        uint32_t c = component[v];
        size[v] = (float)fmin((double)size[v], longest_of(&part[c], part[c].least));
    }
}

/* Each component gets its share of the quads of this mean edge: its sizes are multiplied by a factor. */
static void share_quads(qw_env *env, const qw_size_request *w, const qw_part *part, const uint32_t *component,
                        float *size)
{
    const qw_trimesh *s = w->surface;
    uint32_t count = (uint32_t)w->census->components;
    double *factor = QW_NEW_ZERO(env, double, count), *share = QW_NEW(env, double, count), quads = 0;
    for (uint32_t c = 0; c < count; c++) quads += part[c].area / (w->rho * w->rho);
    qw_share_quads(part, count, quads, share);
    for (uint32_t f = 0; f < s->face_count; f++) {
        const uint32_t *corner = s->corner + 3 * (size_t)f;
        double l = ((double)size[corner[0]] + (double)size[corner[1]] + (double)size[corner[2]]) / 3;
        factor[w->census->component[f]] += 0.5 * (double)qw_length(qw_face_cross(s, f)) / (l * l);
    }
    for (uint32_t c = 0; c < count; c++) {
        double edge = longest_of(&part[c], share[c]);
        factor[c] = factor[c] > 0 && part[c].area > 0 ? edge * sqrt(factor[c] / part[c].area) : 1;
    }
    for (uint32_t v = 0; v < s->vertex_count; v++) size[v] *= (float)factor[component[v]];
    qw_free(env, factor), qw_free(env, share);
}

float *qw_shared_sizes(qw_env *env, const qw_size_request *w, qw_tip_list *tips)
{
    assert(w->rho > 0 && w->surface->vertex_count > 0);
    const qw_trimesh *s = w->surface;
    qw_part *part = qw_list_parts(env, s, w->census);
    float *size = QW_NEW(env, float, s->vertex_count), *factor = density_factors(env, w, tips);
    uint32_t *component = qw_vertex_components(env, s, w->census);
    for (uint32_t v = 0; v < s->vertex_count; v++)
        size[v] = (float)(factor ? fmax(w->rho * (double)factor[v], LEAST_EDGE) : w->rho);
    qw_free(env, factor);
    bool is_shared = w->census->components > 1 && !w->painted; /* what is painted says which part is finer */
    if (is_shared) share_quads(env, w, part, component, size);
    else limit_sizes(part, component, s->vertex_count, size);
    qw_free(env, part), qw_free(env, component);
    if (w->circles) qw_fit_around(env, s, w->circles, w->turn, size);
    return size;
}

void qw_refine_sizes(qw_env *env, const qw_size_request *w, float *size)
{
    assert(size && (w->refinements == 0 || w->refinement));
    qw_fit_loops(env, w->surface, w->with_boundary, size);
    refining a = {w, (float)w->rho * (float)QW_LEAST_REFINED_SIZE, size};
    if (w->refinements) qw_parallel(env, w->surface->vertex_count, QW_GRAIN_LIGHT, refine_block, &a);
    qw_limit_gradation(env, w->surface, size, 1.0f);
}
