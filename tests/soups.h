/* Soups of boxes, sheets, tubes and fragments that cross one another, as the wrap is made for. */
#ifndef QW_TESTS_SOUPS_H
#define QW_TESTS_SOUPS_H

#include "random.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct soup {
    uint32_t vertex_count, face_count;
    double *position; /* double[vertex_count][3] */
    uint32_t *corner; /* uint32_t[3 face_count] */
    uint64_t state;   /* of what is random */
} soup;

static inline double soup_uniform(soup *s, double low, double high)
{
    random_step(&s->state);
    return low + (high - low) * ((double)(s->state >> 11) / 9007199254740992.0);
}

static inline uint32_t soup_vertex(soup *s, double x, double y, double z)
{
    s->position = realloc(s->position, 3 * ((size_t)s->vertex_count + 1) * sizeof *s->position);
    double *p = s->position + 3 * (size_t)s->vertex_count;
    p[0] = x, p[1] = y, p[2] = z;
    return s->vertex_count++;
}

static inline void soup_triangle(soup *s, uint32_t a, uint32_t b, uint32_t c)
{
    s->corner = realloc(s->corner, 3 * ((size_t)s->face_count + 1) * sizeof *s->corner);
    uint32_t *t = s->corner + 3 * (size_t)s->face_count++;
    t[0] = a, t[1] = b, t[2] = c;
}

static inline void soup_quad(soup *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    soup_triangle(s, a, b, c), soup_triangle(s, a, c, d);
}

/* A turn by an axis that is not one of the frame: nothing lies along the lattice. turn: double[9]. */
static inline void soup_turn(double angle, double turn[9])
{
    double c = cos(angle), t = sin(angle), u[3] = {0.6, 0.48, 0.64};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double cross = j == (i + 1) % 3 ? -u[3 - i - j] : i == (j + 1) % 3 ? u[3 - i - j] : 0;
            turn[3 * i + j] = (i == j ? c : 0) + (1 - c) * u[i] * u[j] + t * cross;
        }
}

static inline uint32_t soup_turned(soup *s, const double turn[9], const double centre[3], double x, double y, double z)
{
    double p[3], q[3] = {x, y, z};
    for (int i = 0; i < 3; i++) p[i] = centre[i] + turn[3 * i] * q[0] + turn[3 * i + 1] * q[1] + turn[3 * i + 2] * q[2];
    return soup_vertex(s, p[0], p[1], p[2]);
}

/* A box of half sides x, y, z; sides: bits of the sides that it has: -x, x, -y, y, -z, z. */
static inline void soup_box(soup *s, const double centre[3], double x, double y, double z, double angle, int sides)
{
    static const int side[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    double turn[9];
    uint32_t v[8];
    soup_turn(angle, turn);
    for (int i = 0; i < 8; i++) v[i] = soup_turned(s, turn, centre, i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z);
    for (int i = 0; i < 6; i++)
        if (sides >> i & 1) soup_quad(s, v[side[i][0]], v[side[i][1]], v[side[i][2]], v[side[i][3]]);
}

/* A ball about the origin, of n by n/2 quads by longitude and latitude. */
static inline void soup_ball(soup *s, double radius, int n)
{
    uint32_t first = s->vertex_count;
    for (int j = 0; j <= n / 2; j++)
        for (int i = 0; i < n; i++) {
            double a = 6.283185307179586 * i / n, b = 6.283185307179586 * j / n;
            soup_vertex(s, radius * sin(b) * cos(a), radius * sin(b) * sin(a), -radius * cos(b));
        }
    for (int j = 0; j < n / 2; j++)
        for (int i = 0; i < n; i++) {
            uint32_t row = first + (uint32_t)(j * n), next = (uint32_t)((i + 1) % n), a = row + (uint32_t)i;
            soup_quad(s, a, row + next, row + (uint32_t)n + next, a + (uint32_t)n);
        }
}

/* A rectangle of n by n quads that bends by `bend`. */
static inline void soup_sheet(soup *s, const double centre[3], double x, double y, double bend, double angle, int n)
{
    double turn[9];
    uint32_t first = s->vertex_count;
    soup_turn(angle, turn);
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++) {
            double u = 2.0 * i / n - 1, v = 2.0 * j / n - 1;
            soup_turned(s, turn, centre, x * u, y * v, bend * (1 - u * u));
        }
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            uint32_t a = first + (uint32_t)(j * (n + 1) + i), b = a + (uint32_t)n + 1;
            soup_quad(s, a, a + 1, b + 1, b);
        }
}

/* A tube without ends. */
static inline void soup_tube(soup *s, const double centre[3], double radius, double length, double angle, int n)
{
    double turn[9];
    uint32_t first = s->vertex_count;
    soup_turn(angle, turn);
    for (int i = 0; i < n; i++) {
        double a = 6.283185307179586 * i / n;
        soup_turned(s, turn, centre, radius * cos(a), radius * sin(a), -length);
        soup_turned(s, turn, centre, radius * cos(a), radius * sin(a), length);
    }
    for (int i = 0; i < n; i++) {
        uint32_t a = first + 2 * (uint32_t)i, b = first + 2 * (uint32_t)((i + 1) % n);
        soup_quad(s, a, b, b + 1, a + 1);
    }
}

/* Some of each, some of them turned over, doubled, or without a side. */
static inline soup soup_random(uint64_t seed, int parts)
{
    soup s = {.state = seed * 2 + 1};
    for (int i = 0; i < parts; i++) {
        double c[3], angle = soup_uniform(&s, 0, 6.28), x = soup_uniform(&s, 0.05, 0.4),
                     y = soup_uniform(&s, 0.02, 0.3);
        for (int k = 0; k < 3; k++) c[k] = soup_uniform(&s, -0.5, 0.5);
        int kind = (int)soup_uniform(&s, 0, 4);
        if (kind == 0) soup_box(&s, c, x, y, soup_uniform(&s, 0.01, 0.3), angle, 63);
        if (kind == 1) soup_box(&s, c, x, y, y, angle, (int)soup_uniform(&s, 1, 63));
        if (kind == 2) soup_sheet(&s, c, x, y, soup_uniform(&s, -0.2, 0.2), angle, 6);
        if (kind == 3) soup_tube(&s, c, y / 2, x, angle, 12);
    }
    for (uint32_t f = 0, n = s.face_count; f < n; f += 7)
        soup_triangle(&s, s.corner[3 * f], s.corner[3 * f + 2], s.corner[3 * f + 1]);
    return s;
}

/* Triangles anywhere, of all sizes. */
static inline soup soup_of_triangles(uint64_t seed, uint32_t count, double size)
{
    soup s = {.state = seed * 2 + 1};
    for (uint32_t f = 0; f < count; f++) {
        double c[3];
        for (int k = 0; k < 3; k++) c[k] = soup_uniform(&s, -0.5, 0.5);
        for (int i = 0; i < 3; i++) {
            double p[3]; /* drawn one after the other, as compilers order arguments differently */
            for (int k = 0; k < 3; k++) p[k] = c[k] + soup_uniform(&s, -size, size);
            soup_vertex(&s, p[0], p[1], p[2]);
        }
        soup_triangle(&s, 3 * f, 3 * f + 1, 3 * f + 2);
    }
    return s;
}

static inline void soup_free(soup *s) { free(s->position), free(s->corner), s->position = NULL, s->corner = NULL; }

#endif
