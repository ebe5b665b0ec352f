/* Small meshes of quads, made anew for each test. */
#ifndef QW_TESTS_QUAD_SHAPES_H
#define QW_TESTS_QUAD_SHAPES_H

#include "quadwright/quadwright.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct quad_shape {
    uint32_t vertex_count, face_count;
    double *position; /* double[vertex_count][3] */
    uint32_t *corner; /* uint32_t[face_count][4] */
} quad_shape;

static inline qw_mesh_view quad_shape_view(const quad_shape *s)
{
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = s->vertex_count,
                          .face_count = s->face_count,
                          .uniform_face_size = 4,
                          .positions = s->position,
                          .corners = s->corner};
}

static inline void quad_shape_free(quad_shape *s) { free(s->position), free(s->corner); }

/* nu x nv quads. twist: the last column is joined to the first turned over, a Moebius strip. Positions are those of a
 * sheet, a ring or a torus of radius 1. */
static inline quad_shape quad_sheet(uint32_t nu, uint32_t nv, int wrap_u, int wrap_v, int twist)
{
    uint32_t cu = wrap_u ? nu : nu + 1, cv = wrap_v ? nv : nv + 1;
    quad_shape s = {cu * cv, nu * nv, malloc(3 * sizeof(double) * cu * cv), malloc(4 * sizeof(uint32_t) * nu * nv)};
    for (uint32_t j = 0; j < cv; j++)
        for (uint32_t i = 0; i < cu; i++) {
            double *p = s.position + 3 * (size_t)(j * cu + i), a = 2 * 3.14159265358979 * i / nu,
                   b = 2 * 3.14159265358979 * j / nv;
            double across = twist ? (double)j / nv - 0.5 : 0;
            if (!wrap_u) p[0] = (double)i / nu, p[1] = (double)j / nv, p[2] = 0.1 * sin(3 * p[0]);
            else if (wrap_v)
                p[0] = (1 + 0.4 * cos(b)) * cos(a), p[1] = (1 + 0.4 * cos(b)) * sin(a), p[2] = 0.4 * sin(b);
            else if (twist)
                p[0] = (1 + across * cos(a / 2)) * cos(a), p[1] = (1 + across * cos(a / 2)) * sin(a),
                p[2] = across * sin(a / 2);
            else p[0] = cos(a), p[1] = sin(a), p[2] = (double)j / nv;
        }
    for (uint32_t j = 0, f = 0; j < nv; j++)
        for (uint32_t i = 0; i < nu; i++, f++) {
            int last = wrap_u && i + 1 == nu;
            uint32_t i1 = last ? 0 : i + 1, j1 = wrap_v && j + 1 == nv ? 0 : j + 1;
            uint32_t low = last && twist ? nv - j : j, high = last && twist ? nv - j1 : j1;
            uint32_t q[4] = {j * cu + i, low * cu + i1, high * cu + i1, j1 * cu + i};
            memcpy(s.corner + 4 * (size_t)f, q, sizeof q);
        }
    return s;
}

/* The six sides of a cube, n x n quads each, on the unit sphere. */
static inline quad_shape quad_sphere(uint32_t n)
{
    uint32_t side = n + 1, all = 6 * side * side, *index = malloc(all * sizeof *index);
    quad_shape s = {0, 6 * n * n, malloc(3 * sizeof(double) * all), malloc(4 * sizeof(uint32_t) * 6 * n * n)};
    for (uint32_t k = 0; k < all; k++) {
        uint32_t f = k / (side * side), axis = f / 2;
        double u = 2.0 * (k % side) / n - 1, v = 2.0 * (k / side % side) / n - 1, w = f % 2 ? 1 : -1, p[3];
        if (f % 2 == 0) u = -u;
        p[axis] = w, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
        double l = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        uint32_t found = 0;
        for (int r = 0; r < 3; r++) p[r] /= l;
        while (found < s.vertex_count &&
               (fabs(s.position[3 * found] - p[0]) > 1e-9 || fabs(s.position[3 * found + 1] - p[1]) > 1e-9 ||
                fabs(s.position[3 * found + 2] - p[2]) > 1e-9))
            found++;
        if (found == s.vertex_count) memcpy(s.position + 3 * (size_t)s.vertex_count++, p, sizeof p);
        index[k] = found;
    }
    for (uint32_t f = 0; f < s.face_count; f++) {
        uint32_t at = f / (n * n) * side * side + f % (n * n) / n * side + f % n;
        uint32_t q[4] = {index[at], index[at + 1], index[at + side + 1], index[at + side]};
        memcpy(s.corner + 4 * (size_t)f, q, sizeof q);
    }
    free(index);
    return s;
}

#endif
