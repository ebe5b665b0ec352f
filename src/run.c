#include "run.h"

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

qw_trimesh qw_parted_working(const qw_run_state *run)
{
    qw_trimesh mesh = run->working.mesh;
    if (run->surface_census.components == 1) return mesh;
    uint32_t *component = QW_NEW(run->env, uint32_t, mesh.face_count);
    qw_label_components(run->env, 3, mesh.twin, mesh.face_count, component);
    mesh.component = component;
    return mesh;
}
