#include "whole/state.h"

#include <stdio.h>
#include <string.h>

void qw_warn_once(qw_run_state *run, const char *text)
{
    const qw_report *r = run->report;
    for (uint32_t i = 0; i < r->warning_count; i++)
        if (strncmp(r->warnings[i], text, sizeof r->warnings[0] - 1) == 0) return;
    qw_warn(run, text);
}

void qw_warn(qw_run_state *run, const char *text)
{
    qw_report *r = run->report;
    if (r->warning_count < sizeof r->warnings / sizeof *r->warnings) {
        snprintf(r->warnings[r->warning_count], sizeof r->warnings[0], "%s", text);
        r->warning_count++;
    }
    qw_log(run->env, QW_LOG_WARNING, "%s", text);
}

qw_trimesh qw_parted_surface(const qw_run_state *run)
{
    qw_trimesh surface = run->surface;
    if (run->surface_census.components > 1) surface.component = run->surface_census.component;
    return surface;
}

void qw_build_tree(qw_run_state *run)
{
    qw_trimesh surface = qw_parted_surface(run);
    run->tree = qw_bvh_build(run->env, &surface);
}

qw_trimesh qw_parted_working(const qw_run_state *run)
{
    qw_trimesh mesh = run->working.mesh;
    if (run->surface_census.components == 1 || mesh.component) return mesh;
    uint32_t *component = QW_NEW(run->env, uint32_t, mesh.face_count);
    qw_label_components(run->env, 3, mesh.twin, mesh.face_count, component);
    mesh.component = component;
    return mesh;
}

/* The components of run->clean that those of run->core.mesh are: uint32_t[components of the rest]. */
static uint32_t *components_of_rest(const qw_run_state *run)
{
    const qw_quadmesh *apart = &run->core.small_quads;
    uint32_t all = (uint32_t)run->clean_census.components, rest = (uint32_t)run->core.census.components, count = 0;
    uint32_t *of_rest = QW_NEW(run->env, uint32_t, rest);
    uint8_t *made = QW_NEW_ZERO(run->env, uint8_t, all);
    for (uint32_t v = 0; v < apart->vertex_count; v++) made[apart->component[v]] = 1;
    for (uint32_t c = 0; c < all && count < rest; c++)
        if (!made[c]) of_rest[count++] = c;
    qw_free(run->env, made);
    return of_rest;
}

uint32_t *qw_clean_components(const qw_run_state *run, const qw_quadmesh *quads)
{
    uint32_t rest = (uint32_t)run->core.census.components, *of_rest = components_of_rest(run);
    uint32_t *component = QW_NEW(run->env, uint32_t, quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++) {
        uint32_t c = quads->component[v];
        component[v] = c < rest ? of_rest[c] : c - rest; /* as qw_join_small has numbered them */
    }
    qw_free(run->env, of_rest);
    return component;
}

uint32_t *qw_clean_components_of_faces(const qw_run_state *run, const qw_trimesh *m)
{
    uint32_t *of_rest = components_of_rest(run), *component = QW_NEW(run->env, uint32_t, m->face_count);
    qw_label_components(run->env, 3, m->twin, m->face_count, component);
    for (uint32_t f = 0; f < m->face_count; f++) component[f] = of_rest[component[f]];
    qw_free(run->env, of_rest);
    return component;
}
