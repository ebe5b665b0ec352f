/* Designed parts as CAD tessellates them: vertices on planes, cylinders and cones, triangles between. */
#ifndef QW_TESTS_PARTS_H
#define QW_TESTS_PARTS_H

#include "shapes.h"

enum { PART_MOST = 64, PART_VERTICES = 4096, PART_FACES = 8192, PART_CORNERS = 32768 };

/* A true surface. Turned: made of a profile about the z axis, from radius a[0], height a[1] to b; upright: over a line
   from a to b in the plane, or over a circle about a of this radius; round: the circle about a, radius and height,
   turned about the z axis; none of them: the plane z = a[0]. */
typedef struct part_side {
    enum { PART_TURNED, PART_LINE, PART_CIRCLE, PART_LEVEL, PART_ROUND } kind;
    double a[2], b[2], radius;
} part_side;

typedef struct part {
    uint32_t vertex_count, face_count, corner_count, side_count;
    double position[3 * PART_VERTICES];
    uint32_t corner[PART_CORNERS], size[PART_FACES];
    part_side side[PART_MOST];
} part;

static inline qw_mesh_view part_view(const part *p)
{
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = p->vertex_count,
                          .face_count = p->face_count,
                          .face_sizes = p->size,
                          .positions = p->position,
                          .corners = p->corner};
}

static inline uint32_t part_vertex(part *p, double x, double y, double z)
{
    double *to = p->position + 3 * (size_t)p->vertex_count;
    to[0] = x, to[1] = y, to[2] = z;
    return p->vertex_count++;
}

static inline void part_face(part *p, uint32_t size, const uint32_t *corner)
{
    memcpy(p->corner + p->corner_count, corner, size * sizeof *corner);
    p->corner_count += size, p->size[p->face_count++] = size;
}

static inline void part_quad(part *p, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    uint32_t first[3] = {a, b, c}, second[3] = {a, c, d};
    part_face(p, 3, first), part_face(p, 3, second);
}

/* A closed profile, double[count][2] of radius and height, counter-clockwise, turned about the z axis in n steps. */
static inline part *part_turned(uint32_t count, const double (*profile)[2], uint32_t n)
{
    part *p = calloc(1, sizeof *p);
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = 0; k < n; k++) {
            double t = 2 * 3.14159265358979323846 * k / n;
            part_vertex(p, profile[i][0] * cos(t), profile[i][0] * sin(t), profile[i][1]);
        }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t j = (i + 1) % count;
        const double *a = profile[i], *b = profile[j];
        if (p->side_count < PART_MOST)
            p->side[p->side_count++] = (part_side){PART_TURNED, {a[0], a[1]}, {b[0], b[1]}, 0};
        for (uint32_t k = 0; k < n; k++) {
            uint32_t l = (k + 1) % n;
            part_quad(p, i * n + k, i * n + l, j * n + l, j * n + k);
        }
    }
    return p;
}

/* A point of an outline; bulge: the arc to the next one turns by this angle about its middle, to the right of the way
   where it is negative; 0: a line. */
typedef struct part_point {
    double x, y, bulge;
} part_point;

/* The points of an outline, arcs in steps of at most `step`, into at[PART_MOST * 4]: their number. Its sides are added,
   lines and arcs as said. */
static inline uint32_t part_outline(part *p, uint32_t count, const part_point *outline, double step, double (*at)[2],
                                    int line, int arc)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < count; i++) {
        const part_point *a = &outline[i], *b = &outline[(i + 1) % count];
        at[n][0] = a->x, at[n++][1] = a->y;
        part_side *side = &p->side[p->side_count++];
        *side = (part_side){.kind = line, .a = {a->x, a->y}, .b = {b->x, b->y}};
        if (a->bulge == 0) continue;
        double dx = b->x - a->x, dy = b->y - a->y, up = 0.5 / tan(a->bulge / 2);
        double mx = (a->x + b->x) / 2 - up * dy, my = (a->y + b->y) / 2 + up * dx;
        *side = (part_side){.kind = arc, .a = {mx, my}, .radius = hypot(a->x - mx, a->y - my)};
        uint32_t steps = (uint32_t)ceil(fabs(a->bulge) / step - 1e-9);
        for (uint32_t k = 1; k < steps; k++) {
            double t = a->bulge * k / steps, x = a->x - mx, y = a->y - my;
            at[n][0] = mx + x * cos(t) - y * sin(t), at[n++][1] = my + x * sin(t) + y * cos(t);
        }
    }
    return n;
}

/* The outline, in radius and height, turned about the z axis in n steps. */
static inline part *part_round(uint32_t count, const part_point *outline, double step, uint32_t n)
{
    part sides = {.side_count = 0};
    double at[PART_MOST * 4][2];
    uint32_t points = part_outline(&sides, count, outline, step, at, PART_TURNED, PART_ROUND);
    part *p = part_turned(points, (const double(*)[2])at, n);
    memcpy(p->side, sides.side, sizeof p->side), p->side_count = sides.side_count;
    return p;
}

/* The outline, counter-clockwise, from z = 0 to the height; arcs in steps of at most `step`. */
static inline part *part_upright(uint32_t count, const part_point *outline, double height, double step)
{
    part *p = calloc(1, sizeof *p);
    uint32_t corner[2][PART_MOST * 4];
    double at[PART_MOST * 4][2];
    uint32_t n = part_outline(p, count, outline, step, at, PART_LINE, PART_CIRCLE);
    for (uint32_t i = 0; i < n; i++) {
        corner[1][i] = part_vertex(p, at[i][0], at[i][1], height);
        corner[0][n - 1 - i] = part_vertex(p, at[i][0], at[i][1], 0);
    }
    part_face(p, n, corner[0]), part_face(p, n, corner[1]);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t j = (i + 1) % n;
        part_quad(p, corner[0][n - 1 - i], corner[0][n - 1 - j], corner[1][j], corner[1][i]);
    }
    p->side[p->side_count++] = (part_side){.kind = PART_LEVEL, .a = {0, 0}};
    p->side[p->side_count++] = (part_side){.kind = PART_LEVEL, .a = {height, 0}};
    return p;
}

/* The point of the unit square's outline in the direction of step k of n, a multiple of 8: its corners among them. */
static inline void part_on_square(uint32_t k, uint32_t n, double p[2])
{
    double along = 8.0 * k / n, side = floor(along / 2 + 0.5), t = along - 2 * side; /* -1 to 1 along the side */
    const double out[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const double *o = out[(int)side % 4], *next = out[((int)side + 1) % 4];
    for (int i = 0; i < 2; i++) p[i] = 0.5 * (o[i] + t * next[i]);
}

/* A plate of unit cells in a row, each with a round hole through its middle in n steps. Cells share no vertices. */
static inline part *part_holes(uint32_t cells, double radius, double height, uint32_t n)
{
    part *p = calloc(1, sizeof *p);
    for (uint32_t c = 0; c < cells; c++) {
        uint32_t first = p->vertex_count;
        for (uint32_t k = 0; k < n; k++) {
            double t = 2 * 3.14159265358979323846 * k / n, square[2];
            part_on_square(k, n, square);
            for (int up = 0; up < 2; up++) {
                part_vertex(p, c + radius * cos(t), radius * sin(t), up ? height : 0);
                part_vertex(p, c + square[0], square[1], up ? height : 0);
            }
        }
        for (uint32_t k = 0; k < n; k++) {
            uint32_t a = first + 4 * k, b = first + 4 * ((k + 1) % n);
            bool right = k >= n - n / 8 || k < n / 8, left = k >= n / 2 - n / 8 && k < n / 2 + n / 8;
            part_quad(p, a + 2, a + 3, b + 3, b + 2); /* above, below, in the hole, around */
            part_quad(p, a, b, b + 1, a + 1);
            part_quad(p, a, a + 2, b + 2, b);
            if (!(right && c + 1 < cells) && !(left && c > 0)) part_quad(p, a + 1, b + 1, b + 3, a + 3);
        }
        p->side[p->side_count++] = (part_side){PART_CIRCLE, {c, 0}, {0, 0}, radius};
    }
    double e = cells - 0.5;
    p->side[p->side_count++] = (part_side){PART_LINE, {-0.5, -0.5}, {e, -0.5}, 0};
    p->side[p->side_count++] = (part_side){PART_LINE, {-0.5, 0.5}, {e, 0.5}, 0};
    p->side[p->side_count++] = (part_side){PART_LINE, {-0.5, -0.5}, {-0.5, 0.5}, 0};
    p->side[p->side_count++] = (part_side){PART_LINE, {e, -0.5}, {e, 0.5}, 0};
    p->side[p->side_count++] = (part_side){.kind = PART_LEVEL, .a = {0, 0}};
    p->side[p->side_count++] = (part_side){.kind = PART_LEVEL, .a = {height, 0}};
    return p;
}

/* How far a point is from the nearest side. */
static inline double part_distance(const part *p, const double *at)
{
    double least = INFINITY;
    for (uint32_t i = 0; i < p->side_count; i++) {
        const part_side *s = &p->side[i];
        bool is_turned = s->kind == PART_TURNED || s->kind == PART_ROUND;
        double x = is_turned ? hypot(at[0], at[1]) : at[0], y = is_turned ? at[2] : at[1];
        double dx = s->b[0] - s->a[0], dy = s->b[1] - s->a[1], off;
        if (s->kind == PART_LEVEL) off = fabs(at[2] - s->a[0]);
        else if (s->kind == PART_CIRCLE || s->kind == PART_ROUND)
            off = fabs(hypot(x - s->a[0], y - s->a[1]) - s->radius);
        else off = fabs((x - s->a[0]) * dy - (y - s->a[1]) * dx) / hypot(dx, dy);
        least = fmin(least, off);
    }
    return least;
}

#endif
