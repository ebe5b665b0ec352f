#include "remesh/quantise/complex.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Where integers leave a triangle less than this share of its real area, rows of quads lie on one another or far apart:
   what is missing costs so many times its area. */
static const double AREA_LEFT = 0.4, CRUSHED = 5;

qw_complex qw_complex_of(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->half && m->d && m->real);
    qw_complex c = {.face_count = m->face_count, .edge_count = m->edge_count};
    uint32_t corners = 3 * m->face_count;
    c.edge = QW_NEW(env, uint32_t, corners);
    c.rot = QW_NEW(env, uint8_t, corners);
    c.side = QW_NEW(env, uint32_t, (size_t)2 * m->edge_count);
    c.d = QW_NEW(env, qw_int2, m->edge_count);
    c.real = QW_NEW(env, qw_real2, m->edge_count);
    c.fixed = QW_NEW(env, uint8_t, m->edge_count);
    memcpy(c.real, m->real, m->edge_count * sizeof *c.real);
    memcpy(c.edge, m->edge, corners * sizeof *c.edge);
    memcpy(c.rot, m->rot, corners);
    memcpy(c.d, m->d, m->edge_count * sizeof *c.d);
    memcpy(c.fixed, m->fixed, m->edge_count);
    for (uint32_t e = 0; e < m->edge_count; e++) {
        c.side[2 * e] = m->half[e];
        c.side[2 * e + 1] = m->twin[m->half[e]];
    }
    return c;
}

void qw_complex_weigh(qw_complex *c)
{
    assert(c->weight && c->side && c->real);
    static const float LEAST = 0.2f, MOST = 3.0f;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        float sum = 0;
        for (int s = 0; s < 2; s++) {
            uint32_t h = c->side[2 * e + (uint32_t)s];
            if (h == QW_NONE) continue;
            uint32_t a = qw_next(h), b = qw_next(a);
            /* both vectors start at the apex */
            qw_real2 u = qw_turn_real(c->rot[a] + 2u, c->real[c->edge[a]]),
                     v = qw_turn_real(c->rot[b], c->real[c->edge[b]]);
            float det = fabsf(u.x * v.y - u.y * v.x), dot = u.x * v.x + u.y * v.y;
            sum += dot / fmaxf(det, 1e-6f);
        }
        c->weight[e] = fminf(fmaxf(sum / 2, LEAST), MOST);
    }
}

double qw_complex_cost(const qw_complex *c)
{
    double sum = 0;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        double x = c->d[e].x - (double)c->real[e].x, y = c->d[e].y - (double)c->real[e].y;
        sum += (double)(c->weight ? c->weight[e] : 1) * (x * x + y * y);
        if (c->at_least)
            sum += QW_BOUND_COST * (qw_complex_short(c, 2 * e, c->d[e].x) + qw_complex_short(c, 2 * e + 1, c->d[e].y));
    }
    return sum;
}

double qw_complex_area(const qw_complex *c)
{
    double sum = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3)
        sum += qw_int2_det(qw_steps_along(c, h), qw_steps_along(c, h + 1));
    return sum / 2;
}

uint32_t qw_complex_inverted(const qw_complex *c)
{
    assert(c->real && c->d);
    uint32_t count = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3) {
        uint32_t e = c->edge[h], g = c->edge[h + 1];
        qw_real2 a = qw_turn_real(c->rot[h], c->real[e]), b = qw_turn_real(c->rot[h + 1], c->real[g]);
        int32_t det = qw_int2_det(qw_steps_along(c, h), qw_steps_along(c, h + 1));
        count += det < 0 && a.x * b.y - a.y * b.x > 0;
    }
    return count;
}

bool qw_complex_loses_length(const qw_complex *c, const qw_int2 *had)
{
    for (uint32_t e = 0; e < c->edge_count; e++)
        if ((had[e].x && !c->d[e].x) || (had[e].y && !c->d[e].y)) return true;
    return false;
}

bool qw_complex_is_closed(const qw_complex *c)
{
    for (uint32_t f = 0; f < c->face_count; f++)
        if (!qw_int2_is_zero(qw_complex_residual(c, f))) return false;
    return true;
}

double qw_triangle_energy(const qw_complex *c, uint32_t f)
{
    uint32_t h = 3 * f;
    qw_double2 u = qw_along(c, h), v = qw_turned2(2, qw_along(c, h + 2));
    qw_int2 iu = qw_steps_along(c, h), iv = qw_turn(2, qw_steps_along(c, h + 2));
    double det = qw_cross2(u, v), left = (double)((int64_t)iu.x * iv.y - (int64_t)iu.y * iv.x);
    if (det <= 0) return 0;
    qw_double2 a = {iu.x - u.x, iu.y - u.y}, b = {iv.x - v.x, iv.y - v.y};
    /* [a b] times the inverse of [u v], times det */
    qw_double2 p = {a.x * v.y - b.x * u.y, b.x * u.x - a.x * v.x}, q = {a.y * v.y - b.y * u.y, b.y * u.x - a.y * v.x};
    return CRUSHED * fmax(AREA_LEFT * det - left, 0) / 2 + (qw_square2(p) + qw_square2(q)) / fmax(det, 1e-6) / 2;
}

double qw_complex_energy(const qw_complex *c)
{
    double sum = 0;
    for (uint32_t f = 0; f < c->face_count; f++) sum += qw_triangle_energy(c, f);
    return sum;
}
