#include "whole/ring_guides.h"

#include "base/elementary.h"

#include <math.h>

/* Guides may be anywhere: farther than so many diagonals off they are held there, so that single precision has them. */
static const double FARTHEST = 1e6;

static qw_vec3 in_frame(const qw_run_state *run, const double *p)
{
    const qw_frame *f = &run->clean.frame;
    double q[3];
    for (int k = 0; k < 3; k++) q[k] = fmin(fmax((p[k] - f->center[k]) * f->scale, -FARTHEST), FARTHEST);
    return qw_v3_of_doubles(q);
}

qw_vec3 *qw_guides_in_frame(const qw_run_state *run)
{
    const qw_steering *s = &run->steering;
    uint32_t n = s->guide_begin[s->guide_count];
    qw_vec3 *point = QW_NEW(run->env, qw_vec3, n);
    for (uint32_t i = 0; i < n; i++) point[i] = in_frame(run, s->guide_point + 3 * (size_t)i);
    return point;
}

uint32_t qw_smooth_count(const qw_run_state *run, uint32_t guide)
{
    const uint32_t *begin = run->steering.guide_begin + guide;
    return qw_has_rings(run, guide) ? (begin[1] - begin[0] - 1) * QW_FINER + 1 : begin[1] - begin[0];
}

/* One halving of a polyline of so many steps in place, which is closed where its last point is its first. */
static void halve_steps(qw_vec3 *point, uint32_t steps)
{
    bool closed = qw_distance(point[0], point[steps]) == 0;
    for (uint32_t i = steps + 1; i-- > 0;) point[2 * i] = point[i];
    for (uint32_t i = 0; i < steps; i++) {
        uint32_t before = i > 0 ? i - 1 : closed ? steps - 1 : i, after = i + 2 <= steps ? i + 2 : closed ? 1 : i + 1;
        qw_vec3 inner = qw_add(point[2 * i], point[2 * i + 2]), outer = qw_add(point[2 * before], point[2 * after]);
        point[2 * i + 1] = qw_sub(qw_scale(inner, 9.0f / 16), qw_scale(outer, 1.0f / 16));
        if (before == i || after == i + 1) point[2 * i + 1] = qw_scale(inner, 0.5f); /* at an open end */
    }
}

void qw_smooth_guide(const qw_run_state *run, uint32_t guide, const qw_vec3 *point, qw_vec3 *smooth)
{
    uint32_t begin = run->steering.guide_begin[guide], steps = run->steering.guide_begin[guide + 1] - begin - 1;
    for (uint32_t i = 0; i <= steps; i++) smooth[i] = point[begin + i];
    for (int i = 0; qw_has_rings(run, guide) && i < QW_HALVINGS; i++, steps *= 2) halve_steps(smooth, steps);
}

/* Nests take this share of the quads at most. A nest of N rings on each side, as wide on each as the radius of its
   curve, has 4 pi N^2 quads. */
static const double NEST_SHARE = 0.15;

/* Rings on each side of a neck for which edges are short enough, at strength 0.5: as many as rows lie across so many
   quads, at most MOST_RINGS. And of those that have room anyway. */
static const double QUADS_OF_RINGS = 350;
enum { MOST_RINGS = 6, LEAST_RINGS = 3 };

qw_nests qw_nests_of_guides(const qw_run_state *run, double rho)
{
    qw_env *env = run->env;
    const qw_steering *s = &run->steering;
    qw_nests nests = {.is_half = run->mirror.is_used};
    for (uint32_t g = 0; g < s->guide_count; g++) nests.count += qw_has_rings(run, g);
    if (nests.count + run->necks.count == 0) return nests;
    nests.nest = QW_NEW_ZERO(env, qw_nest, nests.count + run->necks.count);
    nests.count = 0;
    const qw_vec3 *point = s->guide_count > 0 ? qw_guides_in_frame(run) : NULL;
    double most = 0, faces = run->core.area / (rho * rho);
    for (uint32_t g = 0; g < s->guide_count; g++) most += qw_has_rings(run, g);
    for (uint32_t i = 0; i < run->necks.count; i++) most += run->necks.kind[i] != QW_LIMB;
    most = sqrt(NEST_SHARE * faces / (4 * QW_PI * most));
    double wanted = fmin(sqrt(qw_times_used(run) * faces / QUADS_OF_RINGS), MOST_RINGS) *
                    fmin(2 * run->options.rings, 1);
    for (uint32_t g = 0; g < s->guide_count; g++) {
        if (!qw_has_rings(run, g)) continue;
        qw_nest *n = &nests.nest[nests.count++];
        qw_vec3 *smooth = QW_NEW(env, qw_vec3, qw_smooth_count(run, g));
        qw_smooth_guide(run, g, point, smooth);
        n->point = smooth, n->point_count = qw_smooth_count(run, g);
        n->kind = QW_DENT, n->rings = n->most_rings = fmin(s->guide_rings[g], most);
    }
    for (uint32_t i = 0; i < run->necks.count; i++) {
        uint32_t begin = run->necks.begin[i];
        qw_nest *n = &nests.nest[nests.count++];
        n->point = run->necks.point + begin, n->point_count = run->necks.begin[i + 1] - begin;
        n->kind = run->necks.kind[i];
        if (!qw_fits_on_neck(n->point, n->point_count, rho, n->kind)) continue; /* without rings: none of them */
        n->rings = fmax(n->kind == QW_LIMB ? wanted : fmin(wanted, most), 1);
        n->most_rings = n->kind == QW_DENT ? n->rings : fmax(LEAST_RINGS, n->rings);
    }
    return nests;
}
