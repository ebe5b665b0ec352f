#include "products/limit/second_order.h"

#include "geometry/polygons.h"

#include <assert.h>
#include <string.h>

/* Derivatives of the eight shape functions along r and s, -1 to 1 across the element. */
static void find_slopes(double r, double s, double slope[8][2])
{
    static const double at[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int i = 0; i < 4; i++) {
        double a = at[i][0], b = at[i][1];
        slope[i][0] = 0.25 * a * (1 + b * s) * (2 * a * r + b * s);
        slope[i][1] = 0.25 * b * (1 + a * r) * (a * r + 2 * b * s);
    }
    for (int i = 0; i < 4; i++) { /* the node between corners i and i + 1 */
        double a = (at[i][0] + at[(i + 1) & 3][0]) / 2, b = (at[i][1] + at[(i + 1) & 3][1]) / 2;
        slope[4 + i][0] = a == 0 ? -r * (1 + b * s) : 0.5 * a * (1 - s * s);
        slope[4 + i][1] = a == 0 ? 0.5 * b * (1 - r * r) : -s * (1 + a * r);
    }
}

static double determinant(const qw_dvec3 node[8], qw_dvec3 up, double r, double s)
{
    double slope[8][2];
    qw_dvec3 along[2] = {{0, 0, 0}, {0, 0, 0}};
    find_slopes(r, s, slope);
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 2; k++) along[k] = qw_dsub(along[k], qw_dscale(node[i], -slope[i][k]));
    return qw_ddot(qw_dcross(along[0], along[1]), up);
}

static qw_dvec3 point_at(const double *position, uint32_t v)
{
    return (qw_dvec3){position[3 * (size_t)v], position[3 * (size_t)v + 1], position[3 * (size_t)v + 2]};
}

/* Corners, then nodes of sides, of element e. */
static uint32_t node_of(const uint32_t *corner, uint32_t e, int i)
{
    return corner[16 * (size_t)e + 4 * (size_t)(i & 3) + (i >= 4)];
}

/* Whether the element is bent too much, at nine points of it. */
static bool is_bent(const double *position, const uint32_t *corner, uint32_t e)
{
    const double least_share = 0.25; /* of the determinant with straight sides */
    qw_dvec3 node[8], straight[8];
    for (int i = 0; i < 8; i++) node[i] = straight[i] = point_at(position, node_of(corner, e, i));
    for (int i = 0; i < 4; i++) straight[4 + i] = qw_dscale(qw_dsub(node[i], qw_dscale(node[(i + 1) & 3], -1)), 0.5);
    qw_dvec3 up = qw_dcross(qw_dsub(node[2], node[0]), qw_dsub(node[3], node[1]));
    for (int r = -1; r <= 1; r++)
        for (int s = -1; s <= 1; s++)
            if (determinant(node, up, r, s) < least_share * determinant(straight, up, r, s)) return true;
    return false;
}

static void pull_side(double *position, const uint32_t *corner, uint32_t e, int i, double share)
{
    double *node = position + 3 * (size_t)node_of(corner, e, 4 + i);
    const double *a = position + 3 * (size_t)node_of(corner, e, i),
                 *b = position + 3 * (size_t)node_of(corner, e, (i + 1) & 3);
    for (int k = 0; k < 3; k++) node[k] += share * ((a[k] + b[k]) / 2 - node[k]);
}

uint32_t qw_hold_sides_back(qw_env *env, double *position, const uint32_t *corner, uint32_t elements, uint32_t vertices)
{
    assert(position && corner);
    const int rounds = 6; /* after the last of them sides are straight */
    uint32_t held = 0;
    uint8_t *pulled = QW_NEW(env, uint8_t, vertices), *bent = QW_NEW_ZERO(env, uint8_t, elements);
    for (int round = 1; round <= rounds; round++) {
        bool any = false;
        memset(pulled, 0, vertices);
        for (uint32_t e = 0; e < elements; e++) {
            if (!is_bent(position, corner, e)) continue;
            any = true, held += !bent[e], bent[e] = 1;
            for (int i = 0; i < 4; i++) pulled[node_of(corner, e, 4 + i)] = 1;
        }
        if (!any) break;
        for (uint32_t e = 0; e < elements; e++)
            for (int i = 0; i < 4; i++) {
                uint8_t *is_pulled = &pulled[node_of(corner, e, 4 + i)];
                if (*is_pulled) pull_side(position, corner, e, i, round == rounds ? 1 : 0.5);
                *is_pulled = 0;
            }
    }
    qw_free(env, pulled), qw_free(env, bent);
    return held;
}
