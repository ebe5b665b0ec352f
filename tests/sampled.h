/* CAD parts as programs that know no edges would give them: level sets on a grid, in which each crease is a ragged band
 * of chamfers. The true creases are known as segments. Parts lie askew to the grid, within the cube -1 .. 1. */
#ifndef QW_TESTS_SAMPLED_H
#define QW_TESTS_SAMPLED_H

#include "shapes.h"

#include <assert.h>
#include <stdio.h>

typedef enum sampled_how { MARCHING_CUBES, MARCHING_TETRAHEDRA, SURFACE_NETS, SAMPLED_HOWS } sampled_how;

typedef enum part_name {
    PART_STEP,     /* a block with a step */
    PART_ANGLE,    /* an L profile */
    PART_BRACKET,  /* the same with a hole */
    PART_CYLINDER, /* with flat ends */
    PART_WEDGE,
    PART_PRISM, /* of six sides */
    PARTS,
    PART_BALL = PARTS, /* from here on without any crease */
    PART_TORUS,
    PART_BLOB,
    PART_FILLET, /* a box, its edges rounded with a radius of 0.2 */
    PART_PILL,
    ALL_PARTS
} part_name;

typedef struct part {
    part_name name;
    double (*segment)[2][3]; /* double[segments][2][3]: the true creases, as the surface lies */
    int segments;
} part;

/* Columns: the axes of a part in the grid. */
static const double part_turn[3][3] = {
    {0.8529406, -0.3790847, 0.3588235}, {0.4852941, 0.8227941, -0.2843137}, {-0.1874612, 0.4166411, 0.8895289}};

static inline void part_axes(double axes[3][3]) /* orthonormal to rounding */
{
    memcpy(axes, part_turn, sizeof part_turn);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < i; j++) {
            double d = 0;
            for (int k = 0; k < 3; k++) d += axes[i][k] * axes[j][k];
            for (int k = 0; k < 3; k++) axes[i][k] -= d * axes[j][k];
        }
        double l = 0;
        for (int k = 0; k < 3; k++) l += axes[i][k] * axes[i][k];
        for (int k = 0; k < 3; k++) axes[i][k] /= sqrt(l);
    }
}

static inline double part_box(const double *p, double x0, double x1, double y0, double y1, double z0, double z1)
{
    return fmax(fmax(fmax(x0 - p[0], p[0] - x1), fmax(y0 - p[1], p[1] - y1)), fmax(z0 - p[2], p[2] - z1));
}

/* Negative inside. p: in the axes of the part. */
static inline double part_distance(part_name name, const double *p)
{
    double x = p[0], y = p[1], z = p[2], d;
    switch (name) {
    case PART_STEP:
        return fmin(part_box(p, -0.6, 0.6, -0.4, 0.4, -0.4, 0), part_box(p, -0.6, 0, -0.4, 0.4, -0.4, 0.35));
    case PART_ANGLE:
    case PART_BRACKET:
        d = fmin(part_box(p, -0.6, 0.6, -0.5, 0.5, -0.5, -0.25), part_box(p, -0.6, -0.35, -0.5, 0.5, -0.5, 0.5));
        return name == PART_ANGLE ? d : fmax(d, 0.2 - hypot(x - 0.15, y));
    case PART_CYLINDER: return fmax(hypot(x, y) - 0.45, fabs(z) - 0.5);
    case PART_WEDGE:
        return fmax(fmax(-0.6 - x, -0.3 - y),
                    fmax(fabs(z) - 0.4, (0.8 * (x - 0.6) + 1.2 * (y + 0.3)) / hypot(0.8, 1.2)));
    case PART_PRISM:
        d = fabs(z) - 0.45;
        for (int i = 0; i < 6; i++)
            d = fmax(d, x * cos(i * 1.0471975511965976) + y * sin(i * 1.0471975511965976) - 0.5);
        return d;
    case PART_BALL: return sqrt(x * x + y * y + z * z) - 0.6;
    case PART_TORUS: return hypot(hypot(x, y) - 0.5, z) - 0.2;
    case PART_BLOB: return sqrt(x * x + y * y + z * z) - 0.6 - 0.06 * sin(7 * x) * sin(6 * y + 1) * sin(5 * z + 2);
    case PART_FILLET: {
        double a = fmax(fabs(x) - 0.4, 0), b = fmax(fabs(y) - 0.25, 0), c = fmax(fabs(z) - 0.3, 0);
        return sqrt(a * a + b * b + c * c) - 0.2;
    }
    default: z -= fmax(-0.4, fmin(0.4, z)); return sqrt(x * x + y * y + z * z) - 0.3; /* PART_PILL */
    }
}

static inline void part_segment(part *m, double x0, double y0, double z0, double x1, double y1, double z1)
{
    double axes[3][3], from[3] = {x0, y0, z0}, to[3] = {x1, y1, z1};
    part_axes(axes);
    m->segment = realloc(m->segment, (size_t)(m->segments + 1) * sizeof *m->segment);
    for (int k = 0; k < 3; k++) {
        m->segment[m->segments][0][k] = m->segment[m->segments][1][k] = 0;
        for (int i = 0; i < 3; i++) {
            m->segment[m->segments][0][k] += axes[i][k] * from[i];
            m->segment[m->segments][1][k] += axes[i][k] * to[i];
        }
    }
    m->segments++;
}

/* The edges of a prism over a polygon in the plane of the axes a and b. */
static inline void part_prism(part *m, int count, const double (*q)[2], int a, int b, double c0, double c1)
{
    for (int i = 0; i < count; i++) {
        double p[4][3];
        for (int k = 0; k < 4; k++) {
            const double *at = q[(i + (k & 1)) % count];
            p[k][a] = at[0], p[k][b] = at[1], p[k][3 - a - b] = k & 2 ? c1 : c0;
        }
        part_segment(m, p[0][0], p[0][1], p[0][2], p[1][0], p[1][1], p[1][2]);
        part_segment(m, p[2][0], p[2][1], p[2][2], p[3][0], p[3][1], p[3][2]);
        part_segment(m, p[0][0], p[0][1], p[0][2], p[2][0], p[2][1], p[2][2]);
    }
}

static inline void part_circle(part *m, double x, double y, double z, double r)
{
    enum { SIDES = 96 };
    for (int i = 0; i < SIDES; i++) {
        double s = 6.283185307179586 * i / SIDES, t = 6.283185307179586 * (i + 1) / SIDES;
        part_segment(m, x + r * cos(s), y + r * sin(s), z, x + r * cos(t), y + r * sin(t), z);
    }
}

static inline part part_of(part_name name)
{
    static const double step[6][2] = {{-0.6, -0.4}, {0.6, -0.4}, {0.6, 0}, {0, 0}, {0, 0.35}, {-0.6, 0.35}},
                        angle[6][2] = {{-0.6, -0.5},   {0.6, -0.5},  {0.6, -0.25},
                                       {-0.35, -0.25}, {-0.35, 0.5}, {-0.6, 0.5}},
                        wedge[3][2] = {{-0.6, -0.3}, {0.6, -0.3}, {-0.6, 0.5}};
    part m = {.name = name};
    double six[6][2];
    for (int i = 0; i < 6; i++) {
        six[i][0] = 0.5 / cos(0.5235987755982988) * cos((i + 0.5) * 1.0471975511965976);
        six[i][1] = 0.5 / cos(0.5235987755982988) * sin((i + 0.5) * 1.0471975511965976);
    }
    if (name == PART_STEP) part_prism(&m, 6, step, 0, 2, -0.4, 0.4);
    if (name == PART_ANGLE || name == PART_BRACKET) part_prism(&m, 6, angle, 0, 2, -0.5, 0.5);
    if (name == PART_BRACKET) part_circle(&m, 0.15, 0, -0.5, 0.2), part_circle(&m, 0.15, 0, -0.25, 0.2);
    if (name == PART_CYLINDER) part_circle(&m, 0, 0, -0.5, 0.45), part_circle(&m, 0, 0, 0.5, 0.45);
    if (name == PART_WEDGE) part_prism(&m, 3, wedge, 0, 1, -0.4, 0.4);
    if (name == PART_PRISM) part_prism(&m, 6, (const double(*)[2])six, 0, 1, -0.45, 0.45);
    return m;
}

static inline void part_free(part *m) { free(m->segment), m->segment = NULL, m->segments = 0; }

static inline double part_off_crease(const part *m, const double *p)
{
    double best = INFINITY;
    for (int i = 0; i < m->segments; i++) {
        const double *a = m->segment[i][0], *b = m->segment[i][1];
        double ab = 0, ap = 0, d = 0;
        for (int k = 0; k < 3; k++) ab += (b[k] - a[k]) * (b[k] - a[k]), ap += (b[k] - a[k]) * (p[k] - a[k]);
        double t = fmin(1, fmax(0, ap / ab));
        for (int k = 0; k < 3; k++) {
            double x = p[k] - a[k] - t * (b[k] - a[k]);
            d += x * x;
        }
        best = fmin(best, d);
    }
    return sqrt(best);
}

/* ---- level sets on a grid */

typedef struct sampled_grid {
    int n;            /* cells a side of the cube -1 .. 1 */
    double *value;    /* double[(n + 1)^3] */
    uint32_t *vertex; /* uint32_t[8 (n + 1)^3]: on the edge from a node by the bits of 1 .. 7, in the cell at 0; + 1 */
    shape made;
    size_t room; /* for faces and vertices */
} sampled_grid;

static inline size_t sampled_node(const sampled_grid *g, int x, int y, int z)
{
    return ((size_t)z * (size_t)(g->n + 1) + (size_t)y) * (size_t)(g->n + 1) + (size_t)x;
}

static inline uint32_t sampled_vertex(sampled_grid *g, const double *p)
{
    if (g->made.vertex_count + 8 > g->room || g->made.face_count + 64 > g->room) {
        g->room = 2 * g->room + 4096;
        g->made.position = realloc(g->made.position, g->room * 3 * sizeof(double));
        g->made.corner = realloc(g->made.corner, g->room * 3 * 4 * sizeof(uint32_t));
    }
    memcpy(g->made.position + 3 * (size_t)g->made.vertex_count, p, 3 * sizeof(double));
    return g->made.vertex_count++;
}

static inline void sampled_at(const sampled_grid *g, size_t i, double *p)
{
    size_t w = (size_t)g->n + 1;
    p[0] = 2.0 * (double)(i % w) / g->n - 1, p[1] = 2.0 * (double)(i / w % w) / g->n - 1,
    p[2] = 2.0 * (double)(i / w / w) / g->n - 1;
}

static inline size_t sampled_step(const sampled_grid *g, int bits)
{
    size_t w = (size_t)g->n + 1;
    return (size_t)(bits & 1) + (bits & 2 ? w : 0) + (bits & 4 ? w * w : 0);
}

/* Where the surface crosses the edge from a node to the one by the bits. */
static inline void sampled_cut(const sampled_grid *g, size_t a, int bits, double *p)
{
    size_t b = a + sampled_step(g, bits);
    double q[3], t = g->value[a] / (g->value[a] - g->value[b]);
    t = fmin(0.98, fmax(0.02, t));
    sampled_at(g, a, p), sampled_at(g, b, q);
    for (int k = 0; k < 3; k++) p[k] += t * (q[k] - p[k]);
}

static inline uint32_t sampled_crossing(sampled_grid *g, size_t a, size_t b)
{
    size_t low = a < b ? a : b;
    int bits = 1;
    while (low + sampled_step(g, bits) != (a < b ? b : a)) bits++;
    uint32_t *slot = &g->vertex[8 * low + (size_t)bits];
    double p[3];
    if (*slot == 0) sampled_cut(g, low, bits, p), *slot = sampled_vertex(g, p) + 1;
    return *slot - 1;
}

static inline void sampled_tetrahedron(sampled_grid *g, const size_t n[4])
{
    size_t in[4], out[4];
    int ins = 0, outs = 0, moves = 0;
    for (int i = 0; i < 4; i++) {
        if (g->value[n[i]] < 0) in[ins++] = n[i], moves += outs;
        else out[outs++] = n[i];
    }
    bool even = moves % 2 == 0;
    if (ins == 1 || ins == 3) {
        size_t tip = ins == 1 ? in[0] : out[0], *base = ins == 1 ? out : in;
        uint32_t a = sampled_crossing(g, tip, base[0]), b = sampled_crossing(g, tip, base[1]),
                 c = sampled_crossing(g, tip, base[2]);
        shape_triangle(&g->made, a, even ? b : c, even ? c : b);
    } else if (ins == 2) {
        uint32_t a = sampled_crossing(g, in[0], out[0]), b = sampled_crossing(g, in[0], out[1]),
                 c = sampled_crossing(g, in[1], out[1]), d = sampled_crossing(g, in[1], out[0]);
        shape_triangle(&g->made, a, even ? b : d, c), shape_triangle(&g->made, a, c, even ? d : b);
    }
}

static inline void sampled_tetrahedra(sampled_grid *g, size_t o)
{
    static const int paths[6][2] = {{1, 2}, {2, 4}, {4, 1}, {2, 1}, {4, 2}, {1, 4}};
    for (int k = 0; k < 6; k++) {
        size_t p = o + sampled_step(g, paths[k][0]), q = p + sampled_step(g, paths[k][1]), r = o + sampled_step(g, 7);
        size_t t[4] = {o, k < 3 ? p : q, k < 3 ? q : p, r};
        sampled_tetrahedron(g, t);
    }
}

/* One side of a cube with corners c[0 .. 3] around, as seen from outside: the surface leaves the cube's inside on its
 * left. next: by the cube's edges, numbered by 8 lower corner + bits. */
static inline void sampled_side(const sampled_grid *g, size_t o, const int c[4], int next[64])
{
    bool in[4];
    int edge[4];
    for (int i = 0; i < 4; i++) {
        int a = c[i], b = c[(i + 1) % 4];
        in[i] = g->value[o + sampled_step(g, a)] < 0;
        edge[i] = 8 * (a & b) + (a ^ b);
    }
    for (int i = 0; i < 4; i++) /* each run of inside corners: from the edge that ends it to that which begins it */
        if (in[i] && !in[(i + 1) % 4]) {
            int j = i;
            while (in[(j + 3) % 4]) j = (j + 3) % 4;
            next[edge[i]] = edge[(j + 3) % 4];
        }
}

static inline void sampled_cube(sampled_grid *g, size_t o)
{
    static const int sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    int next[64];
    for (int i = 0; i < 64; i++) next[i] = -1;
    for (int i = 0; i < 6; i++) sampled_side(g, o, sides[i], next);
    for (int i = 0; i < 64; i++) {
        uint32_t loop[12];
        int length = 0;
        for (int at = i, to; next[at] >= 0; at = to) {
            to = next[at], next[at] = -1;
            size_t a = o + sampled_step(g, at / 8);
            loop[length++] = sampled_crossing(g, a, a + sampled_step(g, at % 8));
        }
        for (int k = 1; k + 1 < length; k++) shape_triangle(&g->made, loop[0], loop[k], loop[k + 1]);
    }
}

/* The vertex of a cell: the mean of the crossings of its edges. */
static inline uint32_t sampled_net(sampled_grid *g, size_t o)
{
    static const int axis[3] = {1, 2, 4};
    uint32_t *slot = &g->vertex[8 * o];
    if (*slot) return *slot - 1;
    double sum[3] = {0};
    int count = 0;
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 8; c++) {
            size_t a = o + sampled_step(g, c);
            double p[3];
            if ((c & axis[k]) || (g->value[a] < 0) == (g->value[a + sampled_step(g, axis[k])] < 0)) continue;
            sampled_cut(g, a, axis[k], p);
            for (int i = 0; i < 3; i++) sum[i] += p[i];
            count++;
        }
    for (int i = 0; i < 3; i++) sum[i] /= count;
    *slot = sampled_vertex(g, sum) + 1;
    return *slot - 1;
}

static inline void sampled_nets(sampled_grid *g, size_t o)
{
    for (int k = 0; k < 3; k++) {
        size_t u = sampled_step(g, 1 << (k + 1) % 3), v = sampled_step(g, 1 << (k + 2) % 3);
        bool in = g->value[o] < 0;
        if (in == (g->value[o + sampled_step(g, 1 << k)] < 0)) continue;
        uint32_t a = sampled_net(g, o - u - v), b = sampled_net(g, o - v), c = sampled_net(g, o),
                 d = sampled_net(g, o - u);
        if (in) shape_triangle(&g->made, a, b, c), shape_triangle(&g->made, a, c, d);
        else shape_triangle(&g->made, a, c, b), shape_triangle(&g->made, a, d, c);
    }
}

/* Moves each vertex at random by up to noise / 2 cells along each axis. */
static inline void sampled_shake(shape *s, int n, double noise, uint64_t random)
{
    for (uint32_t i = 0; noise > 0 && i < 3 * s->vertex_count; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        s->position[i] += noise * 2 / n * ((double)(random >> 33) / 2147483648.0 - 0.5);
    }
}

static inline shape sampled_part(part_name name, int n, sampled_how how, double noise)
{
    size_t nodes = (size_t)(n + 1) * (size_t)(n + 1) * (size_t)(n + 1);
    sampled_grid g = {.n = n, .value = malloc(nodes * sizeof(double)), .vertex = calloc(8 * nodes, sizeof(uint32_t))};
    double axes[3][3];
    part_axes(axes);
    for (size_t i = 0; i < nodes; i++) {
        double p[3], q[3] = {0};
        sampled_at(&g, i, p);
        for (int a = 0; a < 3; a++)
            for (int k = 0; k < 3; k++) q[a] += axes[a][k] * p[k];
        g.value[i] = part_distance(name, q);
    }
    for (int z = 1; z + 1 < n; z++)
        for (int y = 1; y + 1 < n; y++)
            for (int x = 1; x + 1 < n; x++) {
                size_t o = sampled_node(&g, x, y, z);
                if (how == MARCHING_CUBES) sampled_cube(&g, o);
                else if (how == MARCHING_TETRAHEDRA) sampled_tetrahedra(&g, o);
                else sampled_nets(&g, o);
            }
    free(g.value), free(g.vertex);
    sampled_shake(&g.made, n, noise, 7);
    return g.made;
}

#endif
