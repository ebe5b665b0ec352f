#include "whole/sizes.h"

#include "whole/kept_rims.h"

#include "remesh/sizes/density.h"
#include "remesh/sizes/small_loops.h"
#include "base/constants.h"
#include "whole/fast.h"
#include "remesh/sizes/scale.h"
#include "base/elementary.h"
#include "whole/painted.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The working mesh is made for at least this many quads a component, so that a component of any topology has something
 * to be cut from. */
static const double LEAST_QUADS_OPEN = 4, LEAST_QUADS_CLOSED = 24;

/* Edges of the working mesh an edge of the quads: see docs/dev/decisions/working-mesh.md. */
static const double WORKING_EDGES_FEW = 2.5, WORKING_EDGES_SHARP = 1.6;
static const double QUADS = 1000, MANY_QUADS = 10000;
/* The same at QUADS and at MANY_QUADS quads: on a surface without sharp edges, and on one with as many as a machined
   part. */
static const double WORKING_EDGES_SMOOTH[2] = {1.1, 0.8}, WORKING_EDGES_PART[2] = {1.2, 1.0};
/* From which detail (whole/state.h) on a surface counts as a machined part, and as one with sharp edges everywhere. A
   way around a handle or a hole counts as LOOP edges of the quads of sharp length. */
static const double PART = 0.03, SHARP = 0.1, LOOP = 4;
/* Least working edges an edge of the quads where `follow` is at least FOLLOW_ALL, so that the mesh shows what to
 * follow. */
static const double WORKING_EDGES_FOLLOW = 1.2, FOLLOW_ALL = 0.5;
static const double PREVIEW_EDGES = 0.75;  /* share of the working edges that a preview has */
static const double SMOOTHNESS_FEW = 0.75; /* share of the smoothness that is used where there are few quads */

/* No wanted edge length is less: single precision resolves no less in the centred frame. */
static const double LEAST_EDGE = 1e-9;

/* A triangle is a needle where its longest side is so many times as long as it is high. A bar has RIDGES such edges
   that are sharp, and is as long as one of them: so are components made of many needles. */
static const double NEEDLE = 1000, RIDGES = 4;

/* Edge length of so many quads on an area: that of squares, but at least the extent over their number, so that a
   component of hardly any area gets no more quads along it than there are in all. At four times as many, boxes and
   fans of 1 : 10,000 took ten times as long. */
static double edge_of(double area, double extent, double quads) { return fmax(sqrt(area / quads), extent / quads); }

double qw_edge_wanted(const qw_run_state *run, double faces)
{
    return edge_of(run->core.area, run->core.extent, faces);
}

double qw_in_quads(const qw_run_state *run, double area) { return area / (run->rho * run->rho); }

float qw_uncovered_distance(const qw_run_state *run) { return (float)QW_UNCOVERED_DISTANCE * (float)run->rho; }

/* Interpolates on a logarithmic scale: 0 up to SMALL_FACES quads of the result, 1 from QUADS on. */
static double above_few(const qw_run_state *run)
{
    double faces = qw_times_used(run) * run->faces_wanted;
    return fmin(fmax(qw_ln(faces / QW_SMALL_FACES) / qw_ln(QUADS / QW_SMALL_FACES), 0), 1);
}

/* The same from QUADS to MANY_QUADS. */
static double up_to_many(const qw_run_state *run)
{
    double faces = qw_times_used(run) * run->faces_wanted;
    return fmin(fmax(qw_ln(faces / QUADS) / qw_ln(MANY_QUADS / QUADS), 0), 1);
}

static double between(double from, double to, double t) { return from + (to - from) * t; }

/* With few quads a protrusion is a few working edges around, so the working mesh is finer there; that costs little.
   Between sharp edges a narrow band is but a few edges wide at any count. On surfaces without sharp edges the relief
   gets smoother, in quads, the more quads there are, so the working mesh gets coarser. */
static double edges_by_count(const qw_run_state *run)
{
    double many = up_to_many(run);
    double smooth = between(WORKING_EDGES_SMOOTH[0], WORKING_EDGES_SMOOTH[1], many),
           part = between(WORKING_EDGES_PART[0], WORKING_EDGES_PART[1], many);
    double sharp = between(part, WORKING_EDGES_SHARP, fmin(run->feature_density / SHARP, 1));
    return between(WORKING_EDGES_FEW, between(smooth, sharp, fmin(run->feature_density / PART, 1)), above_few(run));
}

double qw_working_edges(const qw_run_state *run)
{
    double edges = edges_by_count(run), share = fmin(run->options.follow / FOLLOW_ALL, 1);
    if (run->options.fast == QW_FAST_DRAFT) return edges;
    if (run->options.fast == QW_FAST_PREVIEW) return PREVIEW_EDGES * edges;
    return between(edges, fmax(edges, WORKING_EDGES_FOLLOW), share);
}

/* With few quads, normals smoothed over as many edges as elsewhere would no longer show the protrusions. */
double qw_smoothness(const qw_run_state *run)
{
    return run->options.smoothness * (SMOOTHNESS_FEW + (1 - SMOOTHNESS_FEW) * above_few(run));
}

double qw_marked_length(const qw_trimesh *s)
{
    double sum = 0;
    for (uint32_t h = 0; s->mark && h < 3 * s->face_count; h++)
        if (s->mark[h]) sum += (double)qw_edge_length(s, h) / 2;
    return sum;
}

/* uint8_t[census->components]: whether it has a boundary. */
static uint8_t *find_open(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    uint8_t *open = QW_NEW_ZERO(env, uint8_t, (size_t)census->components);
    for (uint32_t h = 0; census->boundary_loops > 0 && h < 3 * s->face_count; h++)
        if (s->twin[h] == QW_NONE) open[census->component[h / 3]] = 1;
    return open;
}

static uint32_t open_components(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    uint8_t *open = find_open(env, mesh, census);
    uint32_t count = 0;
    for (int64_t c = 0; c < census->components; c++) count += open[c];
    qw_free(env, open);
    return count;
}

/* Loops that need quads around them: two for each handle, one for each hole except the first of a component. */
static double loops_of(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    int64_t handles = census->components - (census->euler + census->boundary_loops) / 2;
    double holes = census->boundary_loops > 0 ? (double)census->boundary_loops - open_components(env, mesh, census) : 0;
    return 2 * fmax((double)handles, 0) + holes;
}

double qw_find_feature_density(const qw_run_state *run)
{
    return (qw_marked_length(&run->surface) +
            LOOP * loops_of(run->env, &run->core.mesh, &run->core.census) * run->rho) *
           run->rho / run->core.area;
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

double *qw_extents(qw_env *env, const qw_trimesh *s, const qw_census *census)
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

/* Whether a triangle is that much longer than high, or has no area. */
static bool is_needle(const qw_trimesh *s, uint32_t f)
{
    double longest2 = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        double length2 = (double)qw_length2(qw_edge_way(s, h));
        if (length2 > longest2) longest2 = length2;
    }
    return !((double)qw_length(qw_face_cross(s, f)) * NEEDLE >= longest2);
}

typedef struct needle_task {
    const qw_trimesh *surface;
    uint8_t *needle; /* uint8_t[faces]: whether each is one */
} needle_task;

static void find_needles(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const needle_task *t = user;
    for (uint32_t f = begin; f < end; f++) t->needle[f] = is_needle(t->surface, f);
}

/* Whether the edge of h is a ridge, with needles on either side, which nothing merges. */
static bool is_ridge(const qw_trimesh *s, const uint8_t *needle, uint32_t h)
{
    uint32_t t = s->twin[h];
    if (!needle[h / 3] || t == QW_NONE || t < h || !needle[t / 3]) return false;
    qw_vec3 n = qw_normalize(qw_face_cross(s, h / 3)), m = qw_normalize(qw_face_cross(s, t / 3));
    return !((double)qw_dot(n, m) > QW_SHARP_COSINE);
}

double qw_total_extent(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    double *extent = qw_extents(env, s, census), sum = 0;
    double *ridges = QW_NEW_ZERO(env, double, (size_t)census->components);
    uint8_t *needle = QW_NEW(env, uint8_t, s->face_count);
    qw_parallel(env, s->face_count, QW_GRAIN_LIGHT, find_needles, &(needle_task){s, needle});
    for (uint32_t h = 0; h < 3 * s->face_count; h++)
        if (is_ridge(s, needle, h)) ridges[census->component[h / 3]] += (double)qw_edge_length(s, h);
    for (int64_t c = 0; c < census->components; c++) sum += fmax(extent[c], ridges[c] / RIDGES);
    qw_free(env, extent), qw_free(env, ridges), qw_free(env, needle);
    return sum;
}

/* Boundary loops of each component, int64_t[census->components]. */
static int64_t *count_loops(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    int64_t *loops = QW_NEW_ZERO(env, int64_t, (size_t)census->components);
    if (census->boundary_loops == 0) return loops;
    uint8_t *passed = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)s->face_count);
    for (uint32_t h = 0; h < 3 * s->face_count; h++) {
        if (s->twin[h] != QW_NONE || passed[h]) continue;
        loops[census->component[h / 3]]++;
        for (uint32_t g = h; !passed[g]; g = qw_next_on_boundary(s, g)) passed[g] = 1;
    }
    qw_free(env, passed);
    return loops;
}

/* Twice the Euler number of each component, int64_t[census->components]. */
static int64_t *count_euler(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    int64_t *twice = QW_NEW_ZERO(env, int64_t, (size_t)census->components);
    uint32_t *component = vertex_components(env, s, census);
    for (uint32_t v = 0; v < s->vertex_count; v++) twice[component[v]] += 2;
    for (uint32_t f = 0; f < s->face_count; f++) twice[census->component[f]] += 2;
    for (uint32_t h = 0; h < 3 * s->face_count; h++) twice[census->component[h / 3]] -= s->twin[h] == QW_NONE ? 2 : 1;
    qw_free(env, component);
    return twice;
}

/* The fewest quads of a component of which no edge is double. V vertices, B of them on the boundary, have
   F = V - B / 2 - euler quads: V >= B >= 3 loops, and without a boundary the 2 F edges join V (V - 1) / 2 pairs. */
static int64_t least_quads(int64_t loops, int64_t twice_euler)
{
    if (loops > 0) {
        int64_t twice = 3 * loops - twice_euler;
        return twice > 2 * QW_LEAST_OPEN ? (twice + 1) / 2 : QW_LEAST_OPEN;
    }
    int64_t vertices = 4, euler = twice_euler / 2;
    if (euler > 0) return QW_LEAST_SHELL;
    while (vertices * (vertices - 1) < 4 * (vertices - euler)) vertices++;
    return vertices - euler;
}

double qw_faces_needed(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    int64_t *loops = count_loops(env, s, census), *twice_euler = count_euler(env, s, census);
    double sum = 0;
    for (int64_t c = 0; c < census->components; c++) sum += (double)least_quads(loops[c], twice_euler[c]);
    qw_free(env, loops), qw_free(env, twice_euler);
    return sum;
}

/* ---- around what was found too thin */

typedef struct refining {
    const qw_run_state *run;
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
static void refine_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const refining *a = user;
    const qw_vec3 *position = a->run->surface.position;
    uint8_t refined[QW_GRAIN_LIGHT] = {0}; /* the last round that made it smaller */
    qw_vec3 low = position[begin], high = low;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 p = position[v];
        low = qw_v3(lesser(low.x, p.x), lesser(low.y, p.y), lesser(low.z, p.z));
        high = qw_v3(greater(high.x, p.x), greater(high.y, p.y), greater(high.z, p.z));
    }
    for (uint32_t i = 0; i < a->run->plan.refinements; i++) {
        const qw_refinement *r = &a->run->refinement[i];
        if (!may_touch(r, low, high)) continue;
        for (uint32_t v = begin; v < end; v++) {
            if (refined[v - begin] == r->round || qw_distance(position[v], r->center) >= r->radius) continue;
            refined[v - begin] = r->round;
            a->size[v] = fmaxf(a->size[v] * (float)QW_REFINED_SIZE, fminf(a->size[v], a->least));
        }
    }
}

bool qw_has_density(const qw_run_state *run) { return run->options.adaptive > 0 || run->input.density; }

/* Factors of the wanted size at the vertices of run->surface; NULL: 1 everywhere. *tips: of qw_wanted_size. */
static float *density_factors(const qw_run_state *run, double rho, qw_tip_list *tips)
{
    qw_env *env = run->env;
    if (!qw_has_density(run) && !tips) return NULL;
    float *factor = NULL;
    qw_scope_begin(env);
    qw_surface_cells cells = qw_cells_of_surface(env, &run->surface, rho);
    if (tips) *tips = qw_find_tips(env, &cells, (float)rho, (float)QW_SEEN_IN_OUTLINE);
    if (qw_has_density(run)) {
        qw_density_wish wish = {.edge = rho,
                                .strength = run->options.adaptive,
                                .painted = qw_painted_density(run),
                                .with_boundary = run->options.align_boundary != 0,
                                .cells = &cells,
                                .tree = run->tree};
        factor = qw_size_factors(env, &run->surface, &wish);
        qw_keep(env, factor);
    }
    if (tips) qw_keep(env, tips->tip);
    qw_scope_end(env);
    return factor;
}

/* qw_part[census->components]: what they need. */
static qw_part *list_parts(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    qw_part *part = QW_NEW_ZERO(env, qw_part, (size_t)census->components);
    int64_t *loops = count_loops(env, s, census), *twice_euler = count_euler(env, s, census);
    double *bend = census->components > 1 ? qw_component_bends(env, s, census) : NULL,
           *extent = qw_extents(env, s, census);
    for (int64_t c = 0; c < census->components; c++) {
        part[c].least = loops[c] > 0 ? LEAST_QUADS_OPEN : LEAST_QUADS_CLOSED;
        part[c].is_ball = loops[c] == 0 && twice_euler[c] == 4;
        part[c].bare = part[c].is_ball ? QW_LEAST_SHELL : part[c].least; /* fields lose handles and holes sooner */
        part[c].bend = bend ? bend[c] : 0, part[c].extent = extent[c];   /* in the centred frame */
    }
    for (uint32_t f = 0; f < s->face_count; f++)
        part[census->component[f]].area += 0.5 * qw_length(qw_face_cross(s, f));
    qw_free(env, bend), qw_free(env, extent), qw_free(env, loops), qw_free(env, twice_euler);
    return part;
}

double *qw_component_shares(qw_env *env, const qw_trimesh *s, const qw_census *census, double quads, qw_part **part)
{
    assert(quads > 0 && census->components > 0);
    double *share = QW_NEW(env, double, (size_t)census->components);
    qw_part *parts = list_parts(env, s, census);
    qw_share_quads(parts, (uint32_t)census->components, quads, share);
    if (part) *part = parts;
    else qw_free(env, parts);
    return share;
}

/* The longest edge with which a component has so many quads. */
static double longest_of(const qw_part *part, double quads)
{
    return fmax(edge_of(part->area, part->extent, quads), LEAST_EDGE);
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
static void share_quads(const qw_run_state *run, double rho, const qw_part *part, const uint32_t *component,
                        float *size)
{
    const qw_trimesh *s = &run->surface;
    qw_env *env = run->env;
    uint32_t count = (uint32_t)run->surface_census.components;
    double *factor = QW_NEW_ZERO(env, double, count), *share = QW_NEW(env, double, count), quads = 0;
    for (uint32_t c = 0; c < count; c++) quads += part[c].area / (rho * rho);
    qw_share_quads(part, count, quads, share);
    for (uint32_t f = 0; f < s->face_count; f++) {
        const uint32_t *corner = s->corner + 3 * (size_t)f;
        double l = ((double)size[corner[0]] + (double)size[corner[1]] + (double)size[corner[2]]) / 3;
        factor[run->surface_census.component[f]] += 0.5 * (double)qw_length(qw_face_cross(s, f)) / (l * l);
    }
    for (uint32_t c = 0; c < count; c++) {
        double edge = longest_of(&part[c], share[c]);
        factor[c] = factor[c] > 0 && part[c].area > 0 ? edge * sqrt(factor[c] / part[c].area) : 1;
    }
    for (uint32_t v = 0; v < s->vertex_count; v++) size[v] *= (float)factor[component[v]];
    qw_free(env, factor), qw_free(env, share);
}

float *qw_wanted_size(const qw_run_state *run, double rho, float **base_target, qw_tip_list *tips)
{
    const qw_trimesh *s = &run->surface;
    const qw_census *census = &run->surface_census;
    qw_env *env = run->env;
    qw_part *part = list_parts(env, s, census);
    float *size = QW_NEW(env, float, s->vertex_count), *factor = density_factors(run, rho, tips);
    uint32_t *component = vertex_components(env, s, census);
    for (uint32_t v = 0; v < s->vertex_count; v++)
        size[v] = (float)(factor ? fmax(rho * (double)factor[v], LEAST_EDGE) : rho);
    qw_free(env, factor);
    bool is_shared = census->components > 1 && !run->input.density; /* what is painted says which part is finer */
    if (is_shared) share_quads(run, rho, part, component, size);
    else limit_sizes(part, component, s->vertex_count, size);
    if (qw_keeps_rims(run)) qw_fit_rims(run, size);
    *base_target = QW_NEW(env, float, s->vertex_count);
    memcpy(*base_target, size, s->vertex_count * sizeof *size);
    qw_fit_loops(env, s, run->options.align_boundary != 0, size);
    refining a = {run, (float)rho * (float)QW_LEAST_REFINED_SIZE, size};
    if (run->plan.refinements) qw_parallel(env, s->vertex_count, QW_GRAIN_LIGHT, refine_block, &a);
    qw_limit_gradation(env, s, size, 1.0f);
    qw_free(env, part), qw_free(env, component);
    return size;
}
