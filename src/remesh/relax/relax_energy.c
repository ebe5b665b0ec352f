#include "remesh/relax/relax_energy.h"

#include <string.h>

/* X(D) and its derivative. */
static qw_lanes softened(qw_lanes d, qw_lanes soft, qw_lanes *slope)
{
    qw_lanes root = qw_lanes_sqrt(d * d + soft * soft);
    /* the two forms are one; each avoids the difference of near equals on its side */
    qw_lanes x = qw_choose(d > 0, 0.5f * (d + root), 0.5f * soft * soft / (root - d));
    *slope = x / root;
    return x;
}

typedef struct corner_edges {
    qw_lanes ax, ay, bx, by; /* over the wanted length */
    qw_lanes area;
} corner_edges;

/* The two edges at corner i of four quads, in wanted lengths, and the area between them. */
static corner_edges edges_at(const qw_plane_quads *q, int i, qw_lanes scale)
{
    int n = (i + 1) & 3, p = (i + 3) & 3;
    corner_edges e = {(q->x[n] - q->x[i]) * scale,
                      (q->y[n] - q->y[i]) * scale,
                      (q->x[p] - q->x[i]) * scale,
                      (q->y[p] - q->y[i]) * scale,
                      {0}};
    e.area = e.ax * e.by - e.ay * e.bx;
    return e;
}

static qw_lanes quad_area(const qw_plane_quads *q, qw_lanes wanted)
{
    return 0.5f * ((q->x[2] - q->x[0]) * (q->y[3] - q->y[1]) - (q->y[2] - q->y[0]) * (q->x[3] - q->x[1])) / wanted;
}

qw_lanes qw_quad_energy(const qw_plane_quads *q, qw_lanes wanted, qw_lanes soft, const qw_relax_weights *w,
                        qw_lanes *least)
{
    qw_lanes scale = 1.0f / qw_lanes_sqrt(wanted), sum = qw_lanes_of(0), slope, smallest = qw_lanes_of(INFINITY);
    for (int i = 0; i < 4; i++) {
        corner_edges e = edges_at(q, i, scale);
        qw_lanes x = softened(e.area, soft, &slope);
        qw_lanes u = e.bx + e.ay, v = e.by - e.ax, dot = e.ax * e.bx + e.ay * e.by;
        sum += w->conformal * (u * u + v * v) / x + w->square * dot * dot / (x * x);
        smallest = qw_choose(e.area < smallest, e.area, smallest);
    }
    qw_lanes area = quad_area(q, wanted), x = softened(area, soft, &slope);
    *least = smallest;
    return 0.25f * sum + w->area * (1.0f - area) * (1.0f - area) / x;
}

/* Adds a residual r of the corner, with its derivative by a and b, to K = sum d d^T and g = sum r d. */
static qw_lanes add_residual(qw_lanes r, const qw_lanes d[4], qw_lanes k[4][4], qw_lanes g[4])
{
    for (int i = 0; i < 4; i++) {
        g[i] += r * d[i];
        for (int j = 0; j < 4; j++) k[i][j] += d[i] * d[j];
    }
    return r * r;
}

/* By (a.x, a.y, b.x, b.y), lengths over the wanted one. */
static qw_lanes corner_model(const corner_edges *e, qw_lanes soft, const qw_relax_weights *w, qw_lanes k[4][4],
                             qw_lanes g[4])
{
    qw_lanes slope, x = softened(e->area, soft, &slope), down = slope / x;
    const qw_lanes by_area[4] = {e->by, -e->bx, -e->ay, e->ax}, by_dot[4] = {e->bx, e->by, e->ax, e->ay};
    const float by_u[4] = {0, 1, 1, 0}, by_v[4] = {-1, 0, 0, 1};
    qw_lanes u = e->bx + e->ay, v = e->by - e->ax, dot = e->ax * e->bx + e->ay * e->by;
    qw_lanes root = qw_lanes_sqrt(0.25f * w->conformal / x), whole = sqrtf(0.25f * w->square) / x,
             energy = qw_lanes_of(0), d[4];
    for (int i = 0; i < 4; i++) d[i] = root * (by_u[i] - 0.5f * u * down * by_area[i]);
    energy += add_residual(root * u, d, k, g);
    for (int i = 0; i < 4; i++) d[i] = root * (by_v[i] - 0.5f * v * down * by_area[i]);
    energy += add_residual(root * v, d, k, g);
    for (int i = 0; i < 4; i++) d[i] = whole * (by_dot[i] - dot * down * by_area[i]);
    return energy + add_residual(whole * dot, d, k, g);
}

/* a and b are differences of three corners: spreads what is known by them to the corners. */
static void spread_corner(int i, qw_lanes scale, qw_lanes k[4][4], const qw_lanes g[4], qw_relax_model *model)
{
    int at[2] = {2 * ((i + 1) & 3), 2 * ((i + 3) & 3)}, c = 2 * i;
    for (int s = 0; s < 4; s++) {
        int row = at[s >> 1] + (s & 1), own = c + (s & 1);
        model->gradient[row] += 2.0f * scale * g[s];
        model->gradient[own] -= 2.0f * scale * g[s];
        for (int t = 0; t < 4; t++) {
            int column = at[t >> 1] + (t & 1), other = c + (t & 1);
            qw_lanes value = 2.0f * scale * scale * k[s][t];
            model->matrix[row][column] += value;
            model->matrix[row][other] -= value;
            model->matrix[own][column] -= value;
            model->matrix[own][other] += value;
        }
    }
}

qw_lanes qw_quad_energy_model(const qw_plane_quads *q, qw_lanes wanted, qw_lanes soft, const qw_relax_weights *w,
                              qw_relax_model *model)
{
    qw_lanes scale = 1.0f / qw_lanes_sqrt(wanted), energy = qw_lanes_of(0);
    memset(model, 0, sizeof *model);
    for (int i = 0; i < 4; i++) {
        corner_edges e = edges_at(q, i, scale);
        qw_lanes k[4][4] = {{{0}}}, g[4] = {{0}};
        energy += corner_model(&e, soft, w, k, g);
        spread_corner(i, scale, k, g, model);
    }
    qw_lanes area = quad_area(q, wanted), slope, x = softened(area, soft, &slope), root = qw_lanes_sqrt(w->area / x);
    qw_lanes r = root * (1.0f - area), by_area = -root * (1.0f + 0.5f * (1.0f - area) * slope / x), d[8];
    for (int i = 0; i < 4; i++) {
        int n = (i + 1) & 3, p = (i + 3) & 3;
        d[2 * i] = 0.5f * by_area * (q->y[n] - q->y[p]) / wanted;
        d[2 * i + 1] = -0.5f * by_area * (q->x[n] - q->x[p]) / wanted;
    }
    for (int i = 0; i < 8; i++) {
        model->gradient[i] += 2.0f * r * d[i];
        for (int j = 0; j < 8; j++) model->matrix[i][j] += 2.0f * d[i] * d[j];
    }
    return energy + r * r;
}
