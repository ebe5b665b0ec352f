#include "whole/cut.h"

#include "base/constants.h"

#include <math.h>

uint8_t qw_cuts_at(const qw_run_state *run, qw_vec3 p)
{
    const qw_frame *frame = &run->clean.frame;
    uint32_t planes = 0;
    for (uint32_t i = 0; i < run->input.cuts; i++) {
        const double *cut = run->input.cut + 4 * (size_t)i;
        double offset = cut[3];
        for (int k = 0; k < 3; k++) offset -= cut[k] * frame->center[k];
        double up = cut[0] * (double)p.x + cut[1] * (double)p.y + cut[2] * (double)p.z - offset * frame->scale;
        planes |= (fabs(up) < QW_IN_PLANE ? 1u : 0u) << i;
    }
    return (uint8_t)planes;
}

uint8_t *qw_find_cuts(const qw_run_state *run, const qw_trimesh *mesh)
{
    uint8_t *cuts = QW_NEW(run->env, uint8_t, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) cuts[v] = qw_cuts_at(run, mesh->position[v]);
    if (!run->mirror.about) return cuts;
    uint32_t *component = qw_clean_components_of_faces(run, mesh);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) cuts[mesh->corner[h]] &= run->mirror.about[component[h / 3]];
    qw_free(run->env, component);
    return cuts;
}

double *qw_cuts_in_frame(const qw_run_state *run)
{
    const qw_frame *frame = &run->clean.frame;
    double *cut = QW_NEW(run->env, double, 4 * (size_t)run->input.cuts);
    for (uint32_t i = 0; i < run->input.cuts; i++) {
        const double *from = run->input.cut + 4 * (size_t)i;
        double *to = cut + 4 * (size_t)i, offset = from[3];
        for (int k = 0; k < 3; k++) to[k] = from[k], offset -= from[k] * frame->center[k];
        to[3] = offset * frame->scale;
    }
    return cut;
}

double qw_whole_scale(const qw_run_state *run) { return run->whole.clean.frame.scale / run->clean.frame.scale; }

qw_vec3 qw_in_whole(const qw_run_state *run, qw_vec3 point)
{
    const qw_frame *from = &run->clean.frame, *to = &run->whole.clean.frame;
    double p[3] = {point.x, point.y, point.z};
    if (!run->mirror.is_used) return point;
    qw_leave_own_frame(&run->clean.own, point, p);
    for (int k = 0; k < 3; k++) p[k] = (p[k] / from->scale + from->center[k] - to->center[k]) * to->scale;
    return qw_v3_of_doubles(p);
}
