#include "whole/small.h"

#include "base/mechanisms.h"
#include "whole/kept_rims.h"

#include "base/elementary.h"
#include "remesh/quads/quad_components.h"
#include "whole/thin.h"
#include "remesh/quads/minimal.h"
#include "remesh/sizes/needs.h"
#include "whole/sizes.h"

#include <math.h>
#include <string.h>

/* A surface of fewer components goes through all stages with every one of them. */
enum { LEAST_APART = 256 };
/* The report says so where there are more quads than this share of those asked for. */
static const double MOST_OVER = 1.02;

void qw_measure_core(qw_run_state *run)
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
        r.corner[to] = vertex[mesh->corner[h]], r.twin[to] = t == QW_NONE ? QW_NONE : 3 * face[t / 3] + t % 3;
    }
    qw_free(env, face), qw_free(env, vertex);
    return r;
}

/* With arrays, as a dump has them. */
static qw_quadmesh no_quads(qw_env *env)
{
    return (qw_quadmesh){.position = QW_NEW(env, qw_vec3, 0),
                         .kind = QW_NEW(env, uint8_t, 0),
                         .component = QW_NEW(env, uint32_t, 0),
                         .corner = QW_NEW(env, uint32_t, 0),
                         .twin = QW_NEW(env, uint32_t, 0),
                         .mark = QW_NEW(env, uint8_t, 0)};
}

/* Takes what was made off the surface. made: uint8_t[components], count of which are set. */
static void set_small_aside(qw_run_state *run, const uint8_t *made, uint32_t count, qw_quadmesh quads)
{
    if (count == 0) return;
    run->core.mesh = pick_rest(run->env, &run->clean.mesh, run->clean_census.component, made);
    run->core.small_quads = quads;
    qw_measure_core(run);
    qw_log(run->env, QW_LOG_DEBUG, "%u components made straight away, of %u quads, %lld left", count, quads.face_count,
           (long long)run->core.census.components);
}

bool qw_may_be_thin(const qw_run_state *run)
{
    return run->clean_census.components > 1 && run->clean_census.components < LEAST_APART && !run->input.density;
}

/* Closed parts that get no more than the least, and are so long that four quads around them and as long as wide would
   be more: fields would draw them together. */
static void set_thin_apart(qw_run_state *run)
{
    qw_env *env = run->env;
    const qw_trimesh *mesh = &run->clean.mesh;
    const qw_census *census = &run->clean_census;
    uint32_t n = (uint32_t)census->components, count = 0;
    qw_scope_begin(env);
    qw_part *part;
    double *share = qw_component_shares(env, mesh, census, run->surface_faces, &part);
    uint8_t *thin = QW_NEW(env, uint8_t, n);
    for (uint32_t c = 0; c < n; c++) {
        double along = 4 * part[c].extent / sqrt(part[c].area); /* squared: the quads of a tube as long as it is */
        thin[c] = part[c].is_ball && share[c] <= part[c].least && along * along > part[c].least;
        count += thin[c];
    }
    qw_quadmesh quads = no_quads(env);
    if (count == n) count = 0;
    if (count > 0) quads = qw_make_thin(env, mesh, census, thin, share), count = 0;
    for (uint32_t c = 0; c < n; c++) thin[c] = 0;
    for (uint32_t v = 0; v < quads.vertex_count; v++) thin[quads.component[v]] = 1;
    for (uint32_t c = 0; c < n; c++) count += thin[c];
    qw_keep(env, thin), qw_keep_quads(env, &quads);
    qw_scope_end(env);
    set_small_aside(run, thin, count, quads);
    qw_free(env, thin);
}

void qw_set_core(qw_run_state *run)
{
    const qw_trimesh *mesh = &run->clean.mesh;
    run->core = (qw_core){.mesh = *mesh, .small_quads = no_quads(run->env)};
    qw_measure_core(run);
    if (qw_may_be_thin(run)) {
        if (qw_uses(run->env, QW_MECH_THIN_PARTS)) set_thin_apart(run);
        qw_did(run->env, QW_MECH_THIN_PARTS, run->core.small_quads.face_count > 0);
        return;
    }
    if (!qw_uses(run->env, QW_MECH_SMALL_PARTS)) return;
    double edge = qw_edge_wanted(run, run->surface_faces);
    qw_minimal minimal = qw_make_minimal(run->env, mesh, &run->clean_census, edge, LEAST_APART);
    set_small_aside(run, minimal.made, minimal.count, minimal.quads);
    qw_did(run->env, QW_MECH_SMALL_PARTS, minimal.count);
    qw_free(run->env, minimal.made);
}

double qw_faces_without_small(const qw_run_state *run, double faces)
{
    double left = faces - run->core.small_quads.face_count;
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
    for (uint32_t v = from; v < joined.vertex_count; v++) joined.component[v] += components;
    qw_free(run->env, all);
    warn_of_count(run, joined.face_count);
    return joined;
}
