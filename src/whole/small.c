#include "whole/small.h"

#include "whole/kept_rims.h"

#include "base/elementary.h"
#include "base/mechanisms.h"
#include "remesh/quads/quad_components.h"
#include "geometry/parts.h"
#include "remesh/quads/straight.h"
#include "remesh/sizes/needs.h"
#include "whole/sizes.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A surface of fewer components goes through all stages with every one of them. */
enum { LEAST_APART = 256 };
/* One with a boundary whose area is below that of so many quads gets one. */
static const double SHARE_OPEN = 1.5;
/* The report says so where there are more quads than this share of those asked for. */
static const double MOST_OVER = 1.02;

/* Sets the census of run->core.mesh, the components that are not small, and the sizes that follow from it. For
   a state that was read from a dump. */
static void measure_core(qw_run_state *run)
{
    qw_core *core = &run->core;
    if (core->mesh.corner == run->clean.mesh.corner) {
        core->census = run->clean_census;
        core->area = run->area, core->extent = run->extent, core->needed = run->faces_needed;
        return;
    }
    core->census = qw_trimesh_census(run->env, &core->mesh);
    core->area = qw_trimesh_area(&core->mesh);
    core->extent = qw_total_extent(run->env, &core->mesh, &core->census);
    core->needed = qw_faces_needed(run->env, &core->mesh, &core->census);
}

/* The faces of mesh of which the component is not `made`, in their order. */
static qw_trimesh pick_rest(qw_env *env, const qw_trimesh *mesh, const uint32_t *component, const uint8_t *made)
{
    uint32_t *face = QW_NEW(env, uint32_t, mesh->face_count), *vertex = QW_NEW(env, uint32_t, mesh->vertex_count);
    qw_trimesh r = {0};
    memset(vertex, 0xff, mesh->vertex_count * sizeof *vertex);
    for (uint32_t f = 0; f < mesh->face_count; f++) face[f] = made[component[f]] ? QW_NONE : r.face_count++;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (face[h / 3] != QW_NONE) vertex[mesh->corner[h]] = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (vertex[v] != QW_NONE) vertex[v] = r.vertex_count++;
    r.position = QW_NEW(env, qw_vec3, r.vertex_count);
    r.corner = QW_NEW(env, uint32_t, 3 * (size_t)r.face_count),
    r.twin = QW_NEW(env, uint32_t, 3 * (size_t)r.face_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (vertex[v] != QW_NONE) r.position[vertex[v]] = mesh->position[v];
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t to = 3 * face[h / 3] + h % 3, t = mesh->twin[h];
        if (face[h / 3] == QW_NONE) continue;
        assert(t == QW_NONE || face[t / 3] != QW_NONE); /* components are taken as wholes */
        r.corner[to] = vertex[mesh->corner[h]], r.twin[to] = t == QW_NONE ? QW_NONE : 3 * face[t / 3] + t % 3;
    }
    qw_free(env, face), qw_free(env, vertex);
    return r;
}

/* Takes the components that were made off the surface. made: uint8_t[components]. */
static void set_small_aside(qw_run_state *run, const uint8_t *made, qw_quadmesh quads)
{
    run->core.mesh = pick_rest(run->env, &run->clean.mesh, run->clean_census.component, made);
    run->core.small_quads = quads;
    measure_core(run);
    qw_log(run->env, QW_LOG_DEBUG, "%u quads made straight away, %lld components left", quads.face_count,
           (long long)run->core.census.components);
}

bool qw_may_be_thin(const qw_run_state *run)
{
    return run->clean_census.components > 1 && run->clean_census.components < LEAST_APART && !run->input.density;
}

/* Components that are to be made straight: chosen: uint8_t[components]; double[components]: about as many quads as
   each gets, and at most. */
typedef struct choice {
    uint8_t *chosen;
    double *share, *most;
} choice;

/* Chooses closed parts that get fewer quads than a rod of their length has with four square ones around it, or than
   their curvature asks for: fields would draw them together. Never the largest. */
static void find_thin(qw_env *env, const qw_run_state *run, choice *p)
{
    const qw_census *census = &run->clean_census;
    qw_part *part;
    p->share = qw_component_shares(env, &run->clean.mesh, census, run->surface_faces, &part);
    p->most = QW_NEW(env, double, (size_t)census->components);
    int64_t largest = 0;
    for (int64_t c = 0; c < census->components; c++) {
        if (p->share[c] > p->share[largest]) largest = c;
        double along = 4 * part[c].extent, bent = part[c].bend * (4 / (2 * QW_PI));
        p->most[c] = fmax(along * along, bent * bent) / part[c].area;
        p->chosen[c] = part[c].is_closed && p->most[c] > p->share[c];
    }
    p->chosen[largest] = 0;
}

/* Components of next to no quads, but never the largest. */
static void find_least(qw_env *env, const qw_run_state *run, choice *p)
{
    const qw_trimesh *mesh = &run->clean.mesh;
    const uint32_t *component = run->clean_census.component;
    uint32_t n = (uint32_t)run->clean_census.components, largest = 0;
    double edge = qw_edge_wanted(run, run->surface_faces), *quads = QW_NEW_ZERO(env, double, n);
    uint8_t *is_open = QW_NEW_ZERO(env, uint8_t, n);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        is_open[component[h / 3]] |= mesh->twin[h] == QW_NONE;
        if (h % 3 == 0) quads[component[h / 3]] += 0.5 * (double)qw_length(qw_face_cross(mesh, h / 3)) / (edge * edge);
    }
    for (uint32_t c = 0; c < n; c++) {
        if (quads[c] > quads[largest]) largest = c;
        p->chosen[c] = quads[c] < (is_open[c] ? SHARE_OPEN : QW_LEAST_SHELL);
    }
    p->chosen[largest] = 0, p->share = p->most = quads;
}

/* Makes those of the components that are chosen; the others, and those that cannot be made with as few quads, are left
   to the fields. */
static qw_quadmesh make_chosen(qw_env *env, const qw_run_state *run, choice *p, bool is_least, uint32_t *count)
{
    uint32_t n = (uint32_t)run->clean_census.components;
    qw_parts parts = qw_sort_parts(env, &run->clean.mesh, run->clean_census.component, n);
    qw_quadmesh *made = QW_NEW(env, qw_quadmesh, n);
    *count = 0;
    for (uint32_t c = 0; c < n; c++) {
        if (!p->chosen[c]) continue;
        qw_heartbeat(env);
        qw_flip worst;
        qw_scope_begin(env);
        qw_trimesh part = qw_take_part(env, &parts, c);
        const qw_straight plan = {p->share[c], is_least ? QW_NOT_FLIPPED : QW_DOUBTFUL, is_least};
        qw_quadmesh quads = qw_make_straight(env, &part, &plan, &worst);
        p->chosen[c] = worst <= plan.enough &&
                       quads.face_count <= fmax(fmax(p->share[c] + 1, p->most[c] / 2), QW_LEAST_SHELL);
        if (p->chosen[c]) qw_keep_quads(env, &quads);
        qw_scope_end(env);
        for (uint32_t v = 0; v < quads.vertex_count && p->chosen[c]; v++) quads.component[v] = c;
        if (p->chosen[c]) made[(*count)++] = quads;
    }
    return qw_join_quads(env, made, *count);
}

void qw_set_core(qw_run_state *run)
{
    qw_env *env = run->env;
    run->core = (qw_core){.mesh = run->clean.mesh, .small_quads = qw_join_quads(env, NULL, 0)};
    measure_core(run);
    bool is_least = !qw_may_be_thin(run);
    if (!qw_uses(env, is_least ? QW_MECH_SMALL_PARTS : QW_MECH_THIN_PARTS)) return;
    uint32_t n = (uint32_t)run->clean_census.components, count = 0;
    if (is_least && n < LEAST_APART) return;
    choice p = {.chosen = QW_NEW(env, uint8_t, n)};
    qw_scope_begin(env);
    if (is_least) find_least(env, run, &p);
    else find_thin(env, run, &p);
    qw_quadmesh quads = make_chosen(env, run, &p, is_least, &count);
    if (count > 0 && !(is_least && count < LEAST_APART)) {
        qw_keep_quads(env, &quads);
        qw_scope_end(env);
        set_small_aside(run, p.chosen, quads);
        qw_did(env, is_least ? QW_MECH_SMALL_PARTS : QW_MECH_THIN_PARTS, count);
    } else {
        qw_scope_end(env);
    }
    qw_free(env, p.chosen);
}

/* How many quads small components take, in quads of the core: one that is not reflected is there once. */
static double faces_of_small(const qw_run_state *run)
{
    const qw_quadmesh *small = &run->core.small_quads;
    double all = small->face_count, once = 0;
    if (!run->mirror.about) return all;
    for (uint32_t f = 0; f < small->face_count; f++)
        once += run->mirror.about[small->component[small->corner[4 * (size_t)f]]] == 0;
    return (2 * all - once) / qw_times_used(run);
}

double qw_faces_without_small(const qw_run_state *run, double faces)
{
    double left = faces - faces_of_small(run);
    if (run->core.small_quads.face_count == 0) return faces;
    if (faces < run->faces_needed) left = fmax(left, qw_floor(faces * run->core.area / run->area));
    return fmax(left, 1);
}

double qw_core_faces(const qw_run_state *run, double faces)
{
    double core = qw_faces_inside_rims(run, faces) / qw_times_used(run);
    if (run->mirror.is_used) core = fmax(qw_floor(core + 0.5), 1);
    if (run->plan.core_faces > core) core = run->plan.core_faces;
    return fmax(qw_faces_without_small(run, core) - run->plan.reserve, 1);
}

/* Fewer quads than this are not worth a warning. */
static void warn_of_count(qw_run_state *run, double quads)
{
    const char *text = "so few faces cannot carry the surface's parts, handles and sharp edges: there are more";
    for (uint32_t i = 0; i < run->report->warning_count; i++)
        if (strcmp(run->report->warnings[i], text) == 0) return;
    if (quads * qw_times_used(run) > (double)run->report->faces_asked * MOST_OVER) qw_warn(run, text);
}

qw_quadmesh qw_join_small(qw_run_state *run, const qw_quadmesh *quads)
{
    const qw_quadmesh *more = &run->core.small_quads;
    if (more->face_count == 0) return *quads;
    uint32_t components = (uint32_t)run->core.census.components;
    uint8_t *all = QW_NEW(run->env, uint8_t, components);
    memset(all, 1, components);
    qw_quadmesh joined = qw_pick_components(run->env, quads, all, more);
    uint32_t from = joined.vertex_count;
    qw_append_quads(&joined, more);
    assert(joined.vertex_count == from + more->vertex_count);
    for (uint32_t v = from; v < joined.vertex_count; v++) joined.component[v] += components;
    qw_free(run->env, all);
    warn_of_count(run, joined.face_count);
    return joined;
}
