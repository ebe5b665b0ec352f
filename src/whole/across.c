#include "whole/across.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Up to so many edges 99.9 % of the surface may lie off its reflection for positions to be reflected exactly. */
static const double ALIKE = 0.05;
/* Planes are across one another where the cosine between their normals is below this. */
static const double ACROSS = 0.01;

bool qw_is_alike(double far, double edge) { return far <= ALIKE * edge; }

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The middle of the surface's area, in the coordinates of the input. */
static void middle_of(const qw_run_state *run, double middle[3])
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    const qw_frame *frame = &run->whole.clean.frame;
    double sum[3] = {0}, all = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        double area = (double)qw_length(qw_face_cross(m, f));
        all += area;
        for (uint32_t i = 0; i < 3; i++) {
            qw_vec3 p = m->position[m->corner[3 * f + i]];
            sum[0] += area * (double)p.x / 3, sum[1] += area * (double)p.y / 3, sum[2] += area * (double)p.z / 3;
        }
    }
    assert(all > 0);
    for (int k = 0; k < 3; k++) middle[k] = frame->center[k] + sum[k] / (all * frame->scale);
}

/* Turns a plane about its point beneath the middle until it is across `count` others; false where it is far from it. */
static bool turn_across(qw_mirror_plane *plane, const qw_mirror_plane *const *others, uint32_t count,
                        const double middle[3])
{
    double normal[3], at[3], offset = 0, up = plane->offset - dot(plane->normal, middle);
    memcpy(normal, plane->normal, sizeof normal);
    for (int k = 0; k < 3; k++) at[k] = middle[k] + up * plane->normal[k];
    for (uint32_t i = 0; i < count; i++) {
        double along = dot(normal, others[i]->normal);
        if (fabs(along) > ACROSS) return false;
        for (int k = 0; k < 3; k++) normal[k] -= along * others[i]->normal[k];
    }
    double length = sqrt(dot(normal, normal));
    assert(length > ACROSS); /* each of the others takes little from a normal that is nearly across it */
    for (int k = 0; k < 3; k++) normal[k] /= length, offset += normal[k] * at[k];
    if (plane->axis == QW_NO_AXIS) *plane = qw_mirror_plane_of(normal, offset);
    return true;
}

/* The plane across both, through the middle. */
static qw_mirror_plane third_of(const qw_mirror_plane *a, const qw_mirror_plane *b, const double middle[3])
{
    const double *x = a->normal, *y = b->normal;
    double normal[3] = {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
    return qw_mirror_plane_of(normal, dot(normal, middle));
}

uint32_t qw_find_across(const qw_run_state *run, const qw_mirror_search *found, uint32_t count, double edge,
                        qw_mirror_plane across[QW_MOST_PLANES - 1])
{
    const qw_mirror_plane *taken[QW_MOST_PLANES] = {&found[0].plane};
    double middle[3];
    uint32_t kept = 0;
    assert(count > 0 && count <= QW_MOST_PLANES);
    if (!qw_is_alike(found[0].far, edge)) return 0;
    middle_of(run, middle);
    for (uint32_t i = 1; i <= count && kept < QW_MOST_PLANES - 1; i++) {
        if (i == count && kept == 0) break;
        qw_mirror_plane plane = i < count ? found[i].plane : third_of(taken[0], taken[1], middle);
        if (!turn_across(&plane, taken, kept + 1, middle)) continue;
        if (!qw_is_alike(qw_judge_mirror_plane(run->env, &run->whole.clean.mesh, &run->whole.clean.frame, &plane).far,
                         edge))
            continue;
        across[kept] = plane, taken[kept + 1] = &across[kept], kept++;
    }
    assert(kept < QW_MOST_PLANES);
    return kept;
}
