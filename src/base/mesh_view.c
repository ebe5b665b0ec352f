#include "base/mesh_view.h"

#include <float.h>
#include <math.h>

/* Units of single precision at twice the mean of all numbers, which in a chart that fills the texture is about 1: what
 * a few operations, or texts of six decimals, are off. A thirtieth of a pixel of a texture of 16384. The mean, as one
 * wrong number would spoil the largest. */
static const double ROUNDING_UNITS = 16;

/* Sums and differences of so large coordinates, and their multiples by any count, are finite. */
static const double MOST_COORDINATE = 1e300;

static uint64_t count_corners(qw_env *env, const qw_mesh_view *view, const char *what)
{
    uint64_t corners = 0;
    for (uint32_t f = 0; f < view->face_count; f++) {
        uint32_t size = qw_view_face_size(view, f);
        if (size < 3) qw_fail(env, QW_ARGUMENT, f, "face %u of the %s has %u corners; the least is 3", f, what, size);
        corners += size;
    }
    return corners;
}

uint32_t qw_require_view(qw_env *env, const qw_mesh_view *view, const char *what)
{
    if (!view) qw_fail(env, QW_ARGUMENT, -1, "there is no %s", what);
    if (view->size != sizeof *view)
        qw_fail(env, QW_ARGUMENT, -1, "the size stamp of the %s is %u, not sizeof(qw_mesh_view) = %zu", what,
                view->size, sizeof *view);
    if (view->vertex_count && !view->positions)
        qw_fail(env, QW_ARGUMENT, -1, "the %s has vertices but no positions", what);
    if (view->face_count && !view->corners) qw_fail(env, QW_ARGUMENT, -1, "the %s has faces but no corners", what);
    if (view->vertex_count == QW_NONE)
        qw_fail(env, QW_TOO_LARGE, -1, "the %s has more vertices than can be addressed", what);

    uint64_t corners = count_corners(env, view, what);
    if (corners >= QW_NONE)
        qw_fail(env, QW_TOO_LARGE, -1, "the %s has %llu corners; the most is %u", what, (unsigned long long)corners,
                QW_NONE - 1);
    uint32_t face = 0, left = view->face_count ? qw_view_face_size(view, 0) : 0;
    for (uint32_t c = 0; c < (uint32_t)corners; c++, left--) {
        if (left == 0) left = qw_view_face_size(view, ++face);
        if (view->corners[c] >= view->vertex_count)
            qw_fail(env, QW_INDEX_RANGE, face, "face %u of the %s names vertex %u of %u", face, what, view->corners[c],
                    view->vertex_count);
    }
    for (uint32_t v = 0; v < view->vertex_count; v++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(view->positions[3 * (size_t)v + k]))
                qw_fail(env, QW_NOT_FINITE, v, "vertex %u of the %s is not finite", v, what);
    if (view->marked_edge_count && !view->marked_edges)
        qw_fail(env, QW_ARGUMENT, -1, "the %s has marked edges but no list of them", what);
    if (view->marked_edge_count >= QW_NONE / 2)
        qw_fail(env, QW_TOO_LARGE, -1, "the %s has more marked edges than can be addressed", what);
    for (size_t i = 0; i < 2 * (size_t)view->marked_edge_count; i++)
        if (view->marked_edges[i] >= view->vertex_count)
            qw_fail(env, QW_INDEX_RANGE, (int64_t)(i / 2), "marked edge %zu of the %s names vertex %u of %u", i / 2,
                    what, view->marked_edges[i], view->vertex_count);
    return (uint32_t)corners;
}

void qw_require_moderate(qw_env *env, const qw_mesh_view *view, const char *what)
{
    for (uint32_t v = 0; v < view->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            double x = view->positions[3 * (size_t)v + k];
            if (fabs(x) > MOST_COORDINATE)
                qw_fail(env, QW_TOO_LARGE, v, "vertex %u of the %s has the coordinate %g; the most is %g", v, what, x,
                        MOST_COORDINATE);
        }
}

float qw_rounding_of(const qw_attribute *a)
{
    double sum = 0;
    size_t numbers = (size_t)a->count * a->components;
    for (size_t i = 0; i < numbers; i++) sum += fabs((double)a->values[i]);
    return numbers ? (float)(ROUNDING_UNITS * (double)FLT_EPSILON * 2 * sum / (double)numbers) : 0;
}
