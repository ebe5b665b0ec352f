/* Small surfaces of known topology, made anew for each test. Solids are the outside of unit cells, each side cut into k
 * x k squares and each square into two triangles; sheets are grids whose ends may be joined. */
#ifndef QW_TESTS_SHAPES_H
#define QW_TESTS_SHAPES_H

#include "quadwright/quadwright.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct shape {
    uint32_t vertex_count, face_count;
    double *position; /* double[vertex_count][3] */
    uint32_t *corner; /* uint32_t[face_count][3] */
} shape;

static inline qw_mesh_view shape_view(const shape *s)
{
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = s->vertex_count,
                          .face_count = s->face_count,
                          .uniform_face_size = 3,
                          .positions = s->position,
                          .corners = s->corner};
}

static inline void shape_free(shape *s)
{
    free(s->position), free(s->corner);
    *s = (shape){0};
}

static inline void shape_triangle(shape *s, uint32_t a, uint32_t b, uint32_t c)
{
    if (a == b || b == c || c == a) return; /* at a pole */
    uint32_t *to = s->corner + 3 * (size_t)s->face_count++;
    to[0] = a, to[1] = b, to[2] = c;
}

/* a b c d counter-clockwise; the diagonal alternates so that no direction is preferred. */
static inline void shape_square(shape *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d, bool other)
{
    if (other) shape_triangle(s, a, b, d), shape_triangle(s, b, c, d);
    else shape_triangle(s, a, b, c), shape_triangle(s, a, c, d);
}

/* ---- solids */

typedef bool (*shape_solid)(int x, int y, int z);

typedef struct shape_cells {
    int n[3], k;
    shape_solid solid;
    uint32_t *index; /* of lattice points, + 1 */
    shape made;
} shape_cells;

static inline bool shape_is_solid(const shape_cells *g, const int *at)
{
    for (int i = 0; i < 3; i++)
        if (at[i] < 0 || at[i] >= g->n[i]) return false;
    return g->solid(at[0], at[1], at[2]);
}

static inline uint32_t shape_point(shape_cells *g, const int *p)
{
    size_t at = ((size_t)p[2] * (size_t)(g->n[1] * g->k + 1) + (size_t)p[1]) * (size_t)(g->n[0] * g->k + 1) +
                (size_t)p[0];
    if (g->index[at] == 0) {
        for (int i = 0; i < 3; i++)
            g->made.position[3 * (size_t)g->made.vertex_count + (size_t)i] = (double)p[i] / g->k;
        g->index[at] = ++g->made.vertex_count;
    }
    return g->index[at] - 1;
}

static inline void shape_side(shape_cells *g, const int *cell, int axis, int up)
{
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int i = 0; i < g->k; i++)
        for (int j = 0; j < g->k; j++) {
            uint32_t q[4];
            for (int c = 0; c < 4; c++) {
                int p[3] = {0};
                p[axis] = (cell[axis] + up) * g->k;
                p[u] = cell[u] * g->k + i + (c == 1 || c == 2);
                p[v] = cell[v] * g->k + j + (c >= 2);
                q[c] = shape_point(g, p);
            }
            if (up) shape_square(&g->made, q[0], q[1], q[2], q[3], (i + j) % 2);
            else shape_square(&g->made, q[0], q[3], q[2], q[1], (i + j) % 2);
        }
}

static inline shape shape_of_cells(int nx, int ny, int nz, int k, shape_solid solid)
{
    shape_cells g = {.n = {nx, ny, nz}, .k = k, .solid = solid};
    size_t points = (size_t)(nx * k + 1) * (size_t)(ny * k + 1) * (size_t)(nz * k + 1),
           squares = (size_t)(6 * nx * ny * nz * k * k);
    g.index = calloc(points, sizeof *g.index);
    g.made.position = malloc(points * 3 * sizeof(double));
    g.made.corner = malloc(squares * 6 * sizeof(uint32_t));
    int cell[3];
    for (cell[2] = 0; cell[2] < nz; cell[2]++)
        for (cell[1] = 0; cell[1] < ny; cell[1]++)
            for (cell[0] = 0; cell[0] < nx; cell[0]++)
                for (int axis = 0; axis < 3; axis++)
                    for (int up = 0; up < 2; up++) {
                        int beside[3] = {cell[0], cell[1], cell[2]};
                        beside[axis] += up ? 1 : -1;
                        if (shape_is_solid(&g, cell) && !shape_is_solid(&g, beside)) shape_side(&g, cell, axis, up);
                    }
    free(g.index);
    return g.made;
}

/* Each vertex goes to the mean of its neighbours, so many times. */
static inline void shape_smooth(shape *s, int rounds)
{
    double *sum = malloc((size_t)s->vertex_count * 4 * sizeof *sum);
    for (int r = 0; r < rounds; r++) {
        memset(sum, 0, (size_t)s->vertex_count * 4 * sizeof *sum);
        for (uint32_t h = 0; h < 3 * s->face_count; h++) {
            uint32_t v = s->corner[h], w = s->corner[h % 3 == 2 ? h - 2 : h + 1];
            for (int i = 0; i < 3; i++) sum[4 * (size_t)v + (size_t)i] += s->position[3 * (size_t)w + (size_t)i];
            sum[4 * (size_t)v + 3]++;
        }
        for (uint32_t v = 0; v < s->vertex_count; v++)
            for (int i = 0; i < 3; i++)
                s->position[3 * (size_t)v + (size_t)i] = sum[4 * (size_t)v + (size_t)i] / sum[4 * (size_t)v + 3];
    }
    free(sum);
}

static inline bool shape_all(int x, int y, int z) { return x >= 0 && y >= 0 && z >= 0; }
static inline bool shape_two_holes(int x, int y, int z) { return z == 0 && !(y == 1 && (x == 1 || x == 3)); }
static inline bool shape_every_other(int x, int y, int z) { return (x + y + z) % 2 == 0; }

static inline shape shape_cube(int k) { return shape_of_cells(1, 1, 1, k, shape_all); }

static inline shape shape_sphere(int k)
{
    shape s = shape_cube(k);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v, length = 0;
        for (int i = 0; i < 3; i++) p[i] = tan((p[i] - 0.5) * 3.14159265358979 / 2), length += p[i] * p[i];
        for (int i = 0; i < 3; i++) p[i] /= sqrt(length);
    }
    return s;
}

static inline shape shape_plate(int k) /* 1 x 1 x 0.02 */
{
    shape s = shape_cube(k);
    for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * (size_t)v + 2] *= 0.02;
    return s;
}

static inline shape shape_double_torus(int k)
{
    shape s = shape_of_cells(5, 3, 1, k, shape_two_holes);
    shape_smooth(&s, 3 * k);
    return s;
}

/* Five fingers of one by one by five on a palm of nine by four, smooth. */
static inline bool shape_hand_cells(int x, int y, int z) { return z == 0 && (y < 4 || x % 2 == 0); }
static inline shape shape_hand(int k)
{
    shape s = shape_of_cells(9, 9, 1, k, shape_hand_cells);
    shape_smooth(&s, k);
    return s;
}

static inline shape shape_double_frame(int k)
{
    return shape_of_cells(5, 3, 1, k, shape_two_holes);
} /* the same with sharp edges */
static inline shape shape_two_cubes(int k) { return shape_of_cells(3, 1, 1, k, shape_every_other); }

static inline shape shape_of_four(const double p[4][3], const uint32_t c[4][3])
{
    shape s = {4, 4, malloc(4 * sizeof *p), malloc(4 * sizeof *c)};
    memcpy(s.position, p, 4 * sizeof *p), memcpy(s.corner, c, 4 * sizeof *c);
    return s;
}

static inline shape shape_tetrahedron(int k)
{
    (void)k;
    return shape_of_four((const double[4][3]){{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                         (const uint32_t[4][3]){{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
}

static inline shape shape_regular_tetrahedron(int k)
{
    (void)k;
    return shape_of_four((const double[4][3]){{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}},
                         (const uint32_t[4][3]){{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}});
}

/* ---- sheets */

typedef struct shape_sheet {
    int nu, nv;
    bool wrap_u, wrap_v, twist;                  /* twist: the first column is the last one upside down */
    void (*at)(double u, double v, double p[3]); /* u, v: 0 to 1 */
} shape_sheet;

static inline uint32_t shape_node(const shape_sheet *g, int i, int j)
{
    if (g->wrap_u && i == g->nu) i = 0, j = g->twist ? g->nv - j : j;
    if (g->wrap_v && j == g->nv) j = 0;
    return (uint32_t)(j * (g->nu + !g->wrap_u) + i);
}

static inline shape shape_of_sheet(const shape_sheet *g)
{
    int columns = g->nu + !g->wrap_u, rows = g->nv + !g->wrap_v;
    shape s = {.vertex_count = (uint32_t)(columns * rows)};
    s.position = malloc(s.vertex_count * 3 * sizeof(double));
    s.corner = malloc((size_t)(g->nu * g->nv) * 6 * sizeof(uint32_t));
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++)
            g->at((double)i / g->nu, (double)j / g->nv, s.position + 3 * (size_t)shape_node(g, i, j));
    for (int j = 0; j < g->nv; j++)
        for (int i = 0; i < g->nu; i++)
            shape_square(&s, shape_node(g, i, j), shape_node(g, i + 1, j), shape_node(g, i + 1, j + 1),
                         shape_node(g, i, j + 1), (i + j) % 2);
    return s;
}

static inline void shape_at_torus(double u, double v, double p[3])
{
    double a = 6.283185307179586 * u, b = 6.283185307179586 * v, r = 1 + 0.4 * cos(b);
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = 0.4 * sin(b);
}

static inline void shape_at_annulus(double u, double v, double p[3])
{
    double a = 6.283185307179586 * u, r = 1 - 0.6 * v;
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = 0;
}

static inline void shape_at_strip(double u, double v, double p[3])
{
    double a = 6.283185307179586 * u, w = 0.5 * (v - 0.5), r = 1 + w * cos(a / 2);
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = w * sin(a / 2);
}

/* The figure-eight immersion of a Klein bottle. */
static inline void shape_at_klein(double u, double v, double p[3])
{
    double a = 6.283185307179586 * u, b = 6.283185307179586 * v, r = 2 + cos(a / 2) * sin(b) - sin(a / 2) * sin(2 * b);
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = sin(a / 2) * sin(b) + cos(a / 2) * sin(2 * b);
}

/* The square spread over the disc, with a gentle hill. */
static inline void shape_at_disc(double u, double v, double p[3])
{
    double x = 2 * u - 1, y = 2 * v - 1;
    p[0] = x * sqrt(1 - y * y / 2), p[1] = y * sqrt(1 - x * x / 2), p[2] = 0.3 * (1 - p[0] * p[0] - p[1] * p[1]);
}

static inline shape shape_torus(int k)
{
    return shape_of_sheet(&(shape_sheet){4 * k, 2 * k, true, true, false, shape_at_torus});
}
static inline shape shape_annulus(int k)
{
    return shape_of_sheet(&(shape_sheet){6 * k, k, true, false, false, shape_at_annulus});
}
static inline shape shape_moebius(int k)
{
    return shape_of_sheet(&(shape_sheet){8 * k, k, true, false, true, shape_at_strip});
}
static inline shape shape_klein(int k)
{
    return shape_of_sheet(&(shape_sheet){4 * k, 2 * k, true, true, true, shape_at_klein});
}
static inline shape shape_disc(int k)
{
    return shape_of_sheet(&(shape_sheet){k, k, false, false, false, shape_at_disc});
}

static inline shape shape_one_triangle(int k)
{
    static const double p[3][3] = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}};
    static const uint32_t c[3] = {0, 1, 2};
    (void)k;
    shape s = {3, 1, malloc(sizeof p), malloc(sizeof c)};
    memcpy(s.position, p, sizeof p), memcpy(s.corner, c, sizeof c);
    return s;
}

/* ---- quads */

enum { SHAPE_MOST_SIDES = 20 };

/* The unit cube, each side n by n quads, corners and edges shared; n is at most SHAPE_MOST_SIDES. position: room for
   6 n^2 + 2 points; corner: uint32_t[6 n^2][4]. */
static inline qw_mesh_view shape_cube_of_quads(uint32_t n, double *position, uint32_t *corner)
{
    enum { POINTS = SHAPE_MOST_SIDES + 1 };
    static uint32_t number[POINTS][POINTS][POINTS];
    uint32_t vertices = 0, faces = 0;
    memset(number, 0xff, sizeof number);
    for (int side = 0; side < 6; side++)
        for (uint32_t i = 0; i < n; i++)
            for (uint32_t j = 0; j < n; j++, faces++)
                for (int q = 0; q < 4; q++) {
                    uint32_t at[3], x = i + (q == 1 || q == 2), y = j + (q >= 2);
                    int axis = side % 3;
                    at[axis] = side < 3 ? n : 0;
                    at[(axis + 1) % 3] = side < 3 ? x : y;
                    at[(axis + 2) % 3] = side < 3 ? y : x;
                    uint32_t *v = &number[at[0]][at[1]][at[2]];
                    if (*v == UINT32_MAX) {
                        for (int k = 0; k < 3; k++) position[3 * vertices + (uint32_t)k] = (double)at[k] / n;
                        *v = vertices++;
                    }
                    corner[4 * faces + (uint32_t)q] = *v;
                }
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = vertices,
                          .face_count = faces,
                          .uniform_face_size = 4,
                          .positions = position,
                          .corners = corner};
}

#endif
