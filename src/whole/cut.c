#include "whole/cut.h"

#include "base/constants.h"

#include <math.h>

bool qw_is_in_cut(const qw_run_state *run, qw_vec3 p)
{
    const double *cut = run->input.cut;
    const qw_frame *frame = &run->clean.frame;
    if (!cut) return false;
    double offset = cut[3];
    for (int k = 0; k < 3; k++) offset -= cut[k] * frame->center[k];
    return fabs(cut[0] * (double)p.x + cut[1] * (double)p.y + cut[2] * (double)p.z - offset * frame->scale) <
           QW_IN_PLANE;
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
