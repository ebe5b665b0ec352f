#include "quad/relax_energy.h"

#include <string.h>

/* X(D) and its derivative. */
static float softened(float d, float soft, float *slope)
{
    float root = sqrtf(d * d + soft * soft);
    /* the two forms are one; each avoids the difference of near equals on its side */
    float x = d > 0 ? 0.5f * (d + root) : 0.5f * soft * soft / (root - d);
    *slope = x / root;
    return x;
}

typedef struct corner_edges {
    qw_vec2 a, b; /* over the wanted length */
    float area;
} corner_edges;

static corner_edges edges_at(const qw_vec2 q[4], int i, float scale)
{
    qw_vec2 c = q[i], n = q[(i + 1) & 3], p = q[(i + 3) & 3];
    corner_edges e = {{(n.x - c.x) * scale, (n.y - c.y) * scale}, {(p.x - c.x) * scale, (p.y - c.y) * scale}, 0};
    e.area = e.a.x * e.b.y - e.a.y * e.b.x;
    return e;
}

static float quad_area(const qw_vec2 q[4], float wanted)
{
    return 0.5f * ((q[2].x - q[0].x) * (q[3].y - q[1].y) - (q[2].y - q[0].y) * (q[3].x - q[1].x)) / wanted;
}

float qw_quad_energy(const qw_vec2 q[4], float wanted, float soft, const qw_relax_weights *w, float *least)
{
    float scale = 1 / sqrtf(wanted), sum = 0, slope, smallest = INFINITY;
    for (int i = 0; i < 4; i++) {
        corner_edges e = edges_at(q, i, scale);
        float x = softened(e.area, soft, &slope);
        float u = e.b.x + e.a.y, v = e.b.y - e.a.x, dot = e.a.x * e.b.x + e.a.y * e.b.y;
        sum += w->conformal * (u * u + v * v) / x + w->square * dot * dot / (x * x);
        smallest = e.area < smallest ? e.area : smallest;
    }
    float area = quad_area(q, wanted), x = softened(area, soft, &slope);
    *least = smallest;
    return 0.25f * sum + w->area * (1 - area) * (1 - area) / x;
}

/* Adds a residual r of the corner, with its derivative by a and b, to K = sum d d^T and g = sum r d. */
static float add_residual(float r, const float d[4], float k[4][4], float g[4])
{
    for (int i = 0; i < 4; i++) {
        g[i] += r * d[i];
        for (int j = 0; j < 4; j++) k[i][j] += d[i] * d[j];
    }
    return r * r;
}

/* By (a.x, a.y, b.x, b.y), lengths over the wanted one. */
static float corner_model(const corner_edges *e, float soft, const qw_relax_weights *w, float k[4][4], float g[4])
{
    float slope, x = softened(e->area, soft, &slope), down = slope / x;
    const float by_area[4] = {e->b.y, -e->b.x, -e->a.y, e->a.x};
    const float by_u[4] = {0, 1, 1, 0}, by_v[4] = {-1, 0, 0, 1}, by_dot[4] = {e->b.x, e->b.y, e->a.x, e->a.y};
    float u = e->b.x + e->a.y, v = e->b.y - e->a.x, dot = e->a.x * e->b.x + e->a.y * e->b.y;
    float root = sqrtf(0.25f * w->conformal / x), whole = sqrtf(0.25f * w->square) / x, energy = 0, d[4];
    for (int i = 0; i < 4; i++) d[i] = root * (by_u[i] - 0.5f * u * down * by_area[i]);
    energy += add_residual(root * u, d, k, g);
    for (int i = 0; i < 4; i++) d[i] = root * (by_v[i] - 0.5f * v * down * by_area[i]);
    energy += add_residual(root * v, d, k, g);
    for (int i = 0; i < 4; i++) d[i] = whole * (by_dot[i] - dot * down * by_area[i]);
    return energy + add_residual(whole * dot, d, k, g);
}

/* a and b are differences of three corners: spreads what is known by them to the corners. */
static void spread_corner(int i, float scale, const float k[4][4], const float g[4], float gradient[8], float matrix[8][8])
{
    int at[2] = {2 * ((i + 1) & 3), 2 * ((i + 3) & 3)}, c = 2 * i;
    for (int s = 0; s < 4; s++) {
        int row = at[s >> 1] + (s & 1), own = c + (s & 1);
        gradient[row] += 2 * scale * g[s];
        gradient[own] -= 2 * scale * g[s];
        for (int t = 0; t < 4; t++) {
            int column = at[t >> 1] + (t & 1), other = c + (t & 1);
            float value = 2 * scale * scale * k[s][t];
            matrix[row][column] += value;
            matrix[row][other] -= value;
            matrix[own][column] -= value;
            matrix[own][other] += value;
        }
    }
}

float qw_quad_energy_model(const qw_vec2 q[4], float wanted, float soft, const qw_relax_weights *w, float gradient[8], float matrix[8][8])
{
    float scale = 1 / sqrtf(wanted), energy = 0;
    memset(gradient, 0, 8 * sizeof *gradient);
    memset(matrix, 0, 8 * sizeof *matrix);
    for (int i = 0; i < 4; i++) {
        corner_edges e = edges_at(q, i, scale);
        float k[4][4] = {{0}}, g[4] = {0};
        energy += corner_model(&e, soft, w, k, g);
        spread_corner(i, scale, k, g, gradient, matrix);
    }
    float area = quad_area(q, wanted), slope, x = softened(area, soft, &slope), root = sqrtf(w->area / x);
    float r = root * (1 - area), by_area = -root * (1 + 0.5f * (1 - area) * slope / x), d[8];
    for (int i = 0; i < 4; i++) {
        qw_vec2 n = q[(i + 1) & 3], p = q[(i + 3) & 3];
        d[2 * i] = 0.5f * by_area * (n.y - p.y) / wanted;
        d[2 * i + 1] = -0.5f * by_area * (n.x - p.x) / wanted;
    }
    for (int i = 0; i < 8; i++) {
        gradient[i] += 2 * r * d[i];
        for (int j = 0; j < 8; j++) matrix[i][j] += 2 * d[i] * d[j];
    }
    return energy + r * r;
}
