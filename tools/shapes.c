/* Makes the project's own test shapes: quadwright-shapes NAME FACES OUT.obj (without arguments: the list of names).
 *
 * Smooth solids are level sets of a signed function, cut out of a grid by marching tetrahedra: each cube is six
 * tetrahedra around its diagonal, so the surface is a closed manifold by construction. The bracket and the sheet are
 * put together from square cells, some with a round hole, so that their sharp edges are exact. The knot and the strip
 * are parametric. FACES is met roughly: the resolution is a whole number. The same file on every machine. */
#include "base/elementary.h"
#include "quadwright/quadwright.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct vec {
    double x, y, z;
} vec;

typedef struct mesh {
    vec *position;         /* vec[vertex_count] */
    uint32_t (*corner)[3]; /* uint32_t[face_count][3] */
    size_t vertex_count, face_count, vertex_capacity, face_capacity;
} mesh;

static const double pi = 3.14159265358979323846;

static void *grown(void *block, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity) return block;
    *capacity = *capacity + *capacity / 2 + 1024;
    block = realloc(block, *capacity * size);
    if (!block) {
        fputs("quadwright-shapes: out of memory\n", stderr);
        exit(1);
    }
    return block;
}

static uint32_t add_vertex(mesh *m, vec p)
{
    m->position = grown(m->position, &m->vertex_capacity, m->vertex_count + 1, sizeof(vec));
    m->position[m->vertex_count] = p;
    return (uint32_t)m->vertex_count++;
}

static void add_triangle(mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    m->corner = grown(m->corner, &m->face_capacity, m->face_count + 1, sizeof *m->corner);
    memcpy(m->corner[m->face_count++], (uint32_t[3]){a, b, c}, sizeof *m->corner);
}

static void clear(mesh *m)
{
    free(m->position);
    free(m->corner);
    *m = (mesh){0};
}

/* ---- vectors, distances */

static vec v3(double x, double y, double z) { return (vec){x, y, z}; }
static vec add(vec a, vec b) { return v3(a.x + b.x, a.y + b.y, a.z + b.z); }
static vec sub(vec a, vec b) { return v3(a.x - b.x, a.y - b.y, a.z - b.z); }
static vec scale(vec a, double s) { return v3(a.x * s, a.y * s, a.z * s); }
static double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static vec cross(vec a, vec b) { return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }
static double length(vec a) { return sqrt(dot(a, a)); }
static vec unit(vec a) { return scale(a, 1 / length(a)); }

/* Distance to a limb from a (radius ra) to b (radius rb), roughly where the radii differ. */
static double limb(vec p, vec a, vec b, double ra, double rb)
{
    vec ab = sub(b, a), ap = sub(p, a);
    double t = fmin(1, fmax(0, dot(ap, ab) / dot(ab, ab)));
    return length(sub(ap, scale(ab, t))) - (ra + t * (rb - ra));
}

/* Smooth minimum: a union with a fillet of about k. */
static double join(double a, double b, double k)
{
    double h = fmax(k - fabs(a - b), 0) / k;
    return fmin(a, b) - h * h * k / 4;
}

/* ---- solids: negative inside the box */

/* The edges of a cube and the way from its middle to each corner: 20 limbs, 9 joints, genus 12. */
static double lattice(vec p)
{
    double d = 10;
    for (int c = 0; c < 8; c++) {
        vec a = scale(v3(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1), 0.72);
        d = join(d, limb(p, v3(0.05, -0.03, 0.02), a, 0.13, 0.08 + 0.008 * c), 0.12);
        for (int axis = 1; axis < 8; axis *= 2) {
            if (c & axis) continue;
            vec b = scale(v3((c | axis) & 1 ? 1 : -1, (c | axis) & 2 ? 1 : -1, (c | axis) & 4 ? 1 : -1), 0.72);
            d = join(d, limb(p, a, b, 0.14 + 0.008 * c, 0.14 + 0.008 * (c | axis)), 0.08);
        }
    }
    return d;
}

static double dancer(vec p)
{
    static const double limbs[][8] = {
        /* from, to, radii: torso, hips, standing leg, raised leg, arms, neck, head */
        {0.00, 0.05, 0.0, 0.02, 0.38, 0.02, 0.10, 0.13},      {-0.07, 0.02, 0.0, 0.07, 0.02, 0.0, 0.11, 0.11},
        {-0.07, 0.00, 0.0, -0.05, -0.42, 0.03, 0.085, 0.055}, {-0.05, -0.42, 0.03, -0.06, -0.82, -0.02, 0.055, 0.036},
        {0.08, 0.02, 0.0, 0.45, 0.10, 0.10, 0.085, 0.055},    {0.45, 0.10, 0.10, 0.84, 0.34, 0.05, 0.055, 0.034},
        {0.12, 0.40, 0.0, 0.42, 0.58, 0.0, 0.048, 0.038},     {0.42, 0.58, 0.0, 0.62, 0.86, 0.05, 0.038, 0.032},
        {-0.10, 0.40, 0.0, -0.42, 0.48, 0.10, 0.048, 0.038},  {-0.42, 0.48, 0.10, -0.22, 0.80, 0.06, 0.038, 0.032},
        {0.02, 0.40, 0.02, 0.03, 0.58, 0.02, 0.055, 0.050},   {0.03, 0.63, 0.02, 0.04, 0.72, 0.03, 0.085, 0.075},
    };
    double d = fmax(length(v3(p.x + 0.06, 0, p.z + 0.02)) - 0.30, fabs(p.y + 0.86) - 0.035); /* the plinth */
    for (size_t i = 0; i < sizeof limbs / sizeof limbs[0]; i++) {
        const double *l = limbs[i];
        d = join(d, limb(p, v3(l[0], l[1], l[2]), v3(l[3], l[4], l[5]), l[6], l[7]), 0.05);
    }
    return d;
}

static double hand(vec p)
{
    static const double fingers[5][5] = {
        /* root x, root y, tip x, tip y, radius */
        {-0.25, 0.05, -0.42, 0.62, 0.042}, {-0.09, 0.12, -0.14, 0.80, 0.045}, {0.08, 0.12, 0.12, 0.82, 0.045},
        {0.22, 0.06, 0.36, 0.68, 0.040},   {0.28, -0.30, 0.72, 0.10, 0.050},
    };
    double palm = length(v3(p.x / 0.34, (p.y + 0.2) / 0.42, p.z / 0.13)) - 1;
    double d = join(0.13 * palm, limb(p, v3(0, -0.5, 0), v3(0, -0.85, 0), 0.15, 0.13), 0.1);
    for (int i = 0; i < 5; i++) {
        const double *f = fingers[i];
        d = join(d, limb(p, v3(f[0], f[1], 0), v3(f[2], f[3], 0.06), f[4], 0.8 * f[4]), 0.05);
    }
    return d;
}

/* About the distance to an ellipsoid. */
static double ellipsoid(vec p, vec middle, vec radii)
{
    vec q = sub(p, middle);
    return (length(v3(q.x / radii.x, q.y / radii.y, q.z / radii.z)) - 1) * fmin(radii.x, fmin(radii.y, radii.z));
}

static double without(double a, double b, double k) { return -join(-a, b, k); }

/* Where its mouth and eyes are, as seen from the front, and how wide and high. */
typedef struct opening {
    const char *target;
    double x, y, wide, high;
} opening;
static const opening openings[] = {{"target:open mouth", 0, -0.285, 0.17, 0.08},
                                   {"target:close right eye", -0.17, 0.09, 0.12, 0.07},
                                   {"target:close left eye", 0.17, 0.09, 0.12, 0.07}};
enum { OPENINGS = sizeof openings / sizeof *openings };

static double head(vec p)
{
    vec q = v3(fabs(p.x), p.y, p.z); /* both sides alike */
    double d = join(ellipsoid(q, v3(0, 0.22, -0.08), v3(0.44, 0.5, 0.52)),
                    limb(q, v3(0, -0.02, 0.08), v3(0, -0.38, 0.24), 0.34, 0.15), 0.2);
    d = join(d, limb(q, v3(0, -0.3, -0.12), v3(0, -0.68, -0.16), 0.22, 0.25), 0.16);  /* neck */
    d = join(d, limb(q, v3(0, 0.14, 0.42), v3(0, -0.1, 0.5), 0.035, 0.06), 0.12);     /* nose */
    d = join(d, limb(q, v3(0.05, 0.21, 0.42), v3(0.25, 0.2, 0.34), 0.03, 0.03), 0.1); /* brows */
    d = join(d, ellipsoid(q, v3(0.44, 0.06, -0.06), v3(0.07, 0.15, 0.1)), 0.08);      /* ears */
    d = without(d, ellipsoid(q, v3(0.17, 0.09, 0.47), v3(0.11, 0.06, 0.16)), 0.1);    /* lids */
    d = join(d, length(sub(q, v3(0.17, 0.09, 0.32))) - 0.09, 0.04);                   /* eyes */
    d = join(d, limb(q, v3(0, -0.24, 0.4), v3(0.1, -0.27, 0.36), 0.035, 0.02), 0.08); /* lips */
    d = join(d, limb(q, v3(0, -0.33, 0.39), v3(0.1, -0.3, 0.36), 0.04, 0.02), 0.08);
    return without(d, ellipsoid(q, v3(0, -0.285, 0.45), v3(0.14, 0.02, 0.14)), 0.08); /* mouth */
}

static double star(vec p)
{
    double r = length(p), spike = 0;
    if (r < 1e-9) return -0.3;
    for (int i = 0; i < 20; i++) { /* directions by the golden angle */
        double z = 1 - (2 * i + 1) / 20.0, phi = i * pi * (3 - sqrt(5.0)), s = sqrt(1 - z * z);
        double c = dot(p, v3(s * qw_cos(phi), s * qw_sin(phi), z)) / r;
        double c2 = c * c, c4 = c2 * c2, c8 = c4 * c4;
        if (c > 0) spike = fmax(spike, c8 * c8 * c8 * c8 * c8);
    }
    return 0.35 * (r - 0.38 - 0.5 * spike);
}

/* ---- marching tetrahedra */

typedef struct grid {
    int n;         /* cells a side of the cube -1 .. 1 */
    double *value; /* double[(n + 1)^3] */
    /* uint32_t[7 (n + 1)^3]: surface vertex on the edge from a node towards +dx +dy +dz, by the bits of 1..7; 0: none
     * yet */
    uint32_t *vertex;
} grid;

static size_t node(const grid *g, int x, int y, int z) { return ((size_t)z * (g->n + 1) + y) * (g->n + 1) + x; }
static vec node_position(const grid *g, size_t i)
{
    size_t w = (size_t)g->n + 1;
    return sub(scale(v3((double)(i % w), (double)(i / w % w), (double)(i / w / w)), 2.0 / g->n), v3(1, 1, 1));
}

/* The vertex between nodes a and b of one tetrahedron; the higher one is the lower one plus the bits of the edge's
 * direction. */
static uint32_t crossing(grid *g, mesh *m, size_t a, size_t b)
{
    size_t low = a < b ? a : b, high = a < b ? b : a, w = (size_t)g->n + 1, step = high - low;
    int bits = (int)(step / (w * w)) * 4 + (int)(step / w % w) * 2 + (int)(step % w);
    uint32_t *slot = &g->vertex[7 * low + (size_t)bits - 1];
    if (*slot) return *slot - 1;
    double t = g->value[low] / (g->value[low] - g->value[high]);
    t = fmin(0.95, fmax(0.05, t)); /* no slivers where the surface touches a node */
    vec p = node_position(g, low), q = node_position(g, high);
    *slot = add_vertex(m, add(p, scale(sub(q, p), t))) + 1;
    return *slot - 1;
}

/* n[1], n[2], n[3] are clockwise as seen from n[0]. */
static void cut_tetrahedron(grid *g, mesh *m, const size_t n[4])
{
    size_t in[4], out[4];
    int ins = 0, outs = 0, moves = 0;
    for (int i = 0; i < 4; i++) {
        if (g->value[n[i]] < 0) in[ins++] = n[i], moves += outs; /* the nodes outside that it is moved past */
        else out[outs++] = n[i];
    }
    bool even = moves % 2 == 0;
    if (ins == 1 || ins == 3) {
        size_t tip = ins == 1 ? in[0] : out[0], *base = ins == 1 ? out : in;
        uint32_t a = crossing(g, m, tip, base[0]), b = crossing(g, m, tip, base[1]), c = crossing(g, m, tip, base[2]);
        add_triangle(m, a, even ? b : c, even ? c : b);
    } else if (ins == 2) {
        uint32_t a = crossing(g, m, in[0], out[0]), b = crossing(g, m, in[0], out[1]),
                 c = crossing(g, m, in[1], out[1]), d = crossing(g, m, in[1], out[0]);
        add_triangle(m, a, even ? b : d, c);
        add_triangle(m, a, c, even ? d : b);
    }
}

static mesh march(double (*solid)(vec), int n)
{
    static const int paths[6][2] = {{1, 2}, {2, 4}, {4, 1},
                                    {2, 1}, {4, 2}, {1, 4}}; /* the first three are even permutations */
    mesh m = {0};
    size_t nodes = (size_t)(n + 1) * (n + 1) * (n + 1);
    grid g = {.n = n, .value = malloc(nodes * sizeof(double)), .vertex = calloc(7 * nodes, sizeof(uint32_t))};
    if (!g.value || !g.vertex) {
        fputs("quadwright-shapes: out of memory\n", stderr);
        exit(1);
    }
    for (size_t i = 0; i < nodes; i++) g.value[i] = solid(node_position(&g, i));
    size_t step[8];
    for (int b = 0; b < 8; b++) step[b] = node(&g, b & 1, b >> 1 & 1, b >> 2);
    for (int z = 0; z < n; z++)
        for (int y = 0; y < n; y++)
            for (int x = 0; x < n; x++)
                for (int k = 0; k < 6; k++) {
                    size_t o = node(&g, x, y, z), p = o + step[paths[k][0]], q = p + step[paths[k][1]], r = o + step[7];
                    size_t tetrahedron[4] = {o, k < 3 ? p : q, k < 3 ? q : p, r};
                    cut_tetrahedron(&g, &m, tetrahedron);
                }
    free(g.value);
    free(g.vertex);
    return m;
}

static mesh solid_of(double (*solid)(vec), size_t faces)
{
    int n = 32;
    mesh m = march(solid, n);
    n = (int)lround(n * sqrt((double)faces / (double)m.face_count));
    clear(&m);
    return march(solid, n < 12 ? 12 : (n > 400 ? 400 : n));
}

/* ---- cells and holes */

/* A square of corner o and sides u, v, cut into k x k; with a hole it is four sides, k long and k / 2 deep, around a
 * circle. */
static void add_patch(mesh *m, vec (*at)(vec o, vec u, vec v, double s, double t, double depth), vec o, vec u, vec v,
                      int columns, int rows)
{
    uint32_t first = (uint32_t)m->vertex_count;
    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= columns; i++) add_vertex(m, at(o, u, v, (double)i / columns, (double)j / rows, 0));
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++) {
            uint32_t a = first + (uint32_t)(j * (columns + 1) + i), b = a + 1, c = b + (uint32_t)columns + 1, d = c - 1;
            if ((i + j) % 2 == 0) add_triangle(m, a, b, c), add_triangle(m, a, c, d);
            else add_triangle(m, a, b, d), add_triangle(m, b, c, d);
        }
}

static vec flat(vec o, vec u, vec v, double s, double t, double depth)
{
    (void)depth;
    return add(o, add(scale(u, s), scale(v, t)));
}

enum { HOLE_PERCENT = 31 }; /* radius of a hole, of the side of its cell */

static vec on_circle(vec o, vec u, vec v, double angle)
{
    double r = HOLE_PERCENT / 100.0;
    return add(o, add(scale(u, 0.5 + r * qw_cos(angle)), scale(v, 0.5 + r * qw_sin(angle))));
}

/* Along the lower side of the cell (s) and from there to the hole (t). */
static vec towards_hole(vec o, vec u, vec v, double s, double t, double depth)
{
    (void)depth;
    vec outer = add(o, scale(u, s)), inner = on_circle(o, u, v, 1.25 * pi + 0.5 * pi * s);
    return add(scale(outer, 1 - t), scale(inner, t));
}

static void add_cell(mesh *m, vec o, vec u, vec v, int k, bool hole)
{
    if (!hole) {
        add_patch(m, flat, o, u, v, k, k);
        return;
    }
    int depth = (k + 1) / 2;
    for (int side = 0; side < 4; side++) {
        add_patch(m, towards_hole, o, u, v, k, depth);
        o = add(o, u); /* turn the cell by a quarter */
        vec turned = scale(u, -1);
        u = v;
        v = turned;
    }
}

/* The wall of a hole, from the cell (o, u, v) along w; seen from inside the hole. */
static void add_bore(mesh *m, vec o, vec u, vec v, vec w, int k)
{
    uint32_t first = (uint32_t)m->vertex_count;
    for (int side = 0; side < 4; side++) {
        for (int j = 0; j <= k; j++)
            for (int i = 0; i <= k; i++)
                add_vertex(m, add(on_circle(o, u, v, 1.25 * pi + 0.5 * pi * i / k), scale(w, (double)j / k)));
        o = add(o, u);
        vec turned = scale(u, -1);
        u = v;
        v = turned;
    }
    for (uint32_t side = 0; side < 4; side++)
        for (uint32_t j = 0; j < (uint32_t)k; j++)
            for (uint32_t i = 0; i < (uint32_t)k; i++) {
                uint32_t w1 = (uint32_t)k + 1, a = first + (side * w1 + j) * w1 + i, b = a + 1, c = b + w1, d = c - 1;
                add_triangle(m, a, c, b);
                add_triangle(m, a, d, c);
            }
}

typedef struct keyed {
    int64_t key[3];
    uint32_t vertex;
} keyed;

static int by_key(const void *a, const void *b)
{
    const keyed *p = a, *q = b;
    for (int k = 0; k < 3; k++)
        if (p->key[k] != q->key[k]) return p->key[k] < q->key[k] ? -1 : 1;
    return p->vertex < q->vertex ? -1 : 1;
}

/* Patches are built apart and agree on their borders up to rounding: vertices within 1e-7 of each other become one. */
static void weld(mesh *m)
{
    keyed *rows = calloc(m->vertex_count, sizeof *rows);
    uint32_t *to = calloc(m->vertex_count, sizeof *to);
    if (!rows || !to) exit(1);
    for (size_t i = 0; i < m->vertex_count; i++) {
        vec p = m->position[i];
        rows[i] = (keyed){{llround(p.x * 1e6), llround(p.y * 1e6), llround(p.z * 1e6)}, (uint32_t)i};
    }
    qsort(rows, m->vertex_count, sizeof *rows, by_key);
    vec *kept = calloc(m->vertex_count, sizeof *kept);
    if (!kept) exit(1);
    uint32_t count = 0;
    for (size_t i = 0; i < m->vertex_count; i++) {
        if (i == 0 || memcmp(rows[i].key, rows[i - 1].key, sizeof rows[i].key) != 0)
            kept[count++] = m->position[rows[i].vertex];
        to[rows[i].vertex] = count - 1;
    }
    for (size_t f = 0; f < m->face_count; f++)
        for (int i = 0; i < 3; i++) m->corner[f][i] = to[m->corner[f][i]];
    free(m->position);
    free(rows);
    free(to);
    m->position = kept;
    m->vertex_count = m->vertex_capacity = count;
}

/* ---- bracket */

enum { BX = 6, BY = 4, BZ = 4 };

/* An angle bracket of unit cells: a base, a wall, two gussets. */
static bool filled(int x, int y, int z)
{
    if (x < 0 || y < 0 || z < 0 || x >= BX || y >= BY || z >= BZ) return false;
    return z == 0 || y == 0 || (z == 1 && y == 1 && (x == 0 || x == BX - 1));
}

/* 'z': a hole through the base; 'y': through the wall; 0: none. */
static char bored(int x, int y, int z)
{
    if (z == 0 && y == 2 && (x == 1 || x == 2 || x == 4)) return 'z';
    if (y == 0 && z == 2 && (x == 1 || x == 3 || x == 4)) return 'y';
    return 0;
}

static void add_block(mesh *m, int x, int y, int z, int k)
{
    static const int side[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    vec axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, corner = v3(x, y, z);
    char bore = bored(x, y, z);
    for (int s = 0; s < 6; s++) {
        if (filled(x + side[s][0], y + side[s][1], z + side[s][2])) continue;
        int a = s / 2;
        bool up = s % 2 == 0;
        vec u = axis[(a + 1) % 3], v = axis[(a + 2) % 3], o = up ? add(corner, axis[a]) : corner;
        add_cell(m, o, up ? u : v, up ? v : u, k, (bore == 'z' && a == 2) || (bore == 'y' && a == 1));
    }
    if (bore == 'z') add_bore(m, corner, axis[0], axis[1], axis[2], k);
    if (bore == 'y') add_bore(m, corner, axis[2], axis[0], axis[1], k);
}

static mesh bracket_of(int k)
{
    mesh m = {0};
    for (int z = 0; z < BZ; z++)
        for (int y = 0; y < BY; y++)
            for (int x = 0; x < BX; x++)
                if (filled(x, y, z)) add_block(&m, x, y, z, k);
    weld(&m);
    return m;
}

/* ---- other surfaces */

static mesh sheet_of(int k)
{
    mesh m = {0};
    for (int y = 0; y < 5; y++)
        for (int x = 0; x < 7; x++)
            add_cell(&m, v3(x, y, 0), v3(1, 0, 0), v3(0, 1, 0), k, (x * 2 + y * 3) % 7 == 3 && x > 0 && x < 6);
    weld(&m);
    for (size_t i = 0; i < m.vertex_count; i++) {
        vec *p = &m.position[i];
        p->z = 0.5 * qw_sin(1.1 * p->x) * qw_cos(0.9 * p->y) + 0.15 * qw_sin(2.7 * p->y + p->x);
    }
    return m;
}

static vec trefoil(double t)
{
    return v3(qw_sin(t) + 2 * qw_sin(2 * t), qw_cos(t) - 2 * qw_cos(2 * t), -qw_sin(3 * t));
}

static mesh knot_of(int around)
{
    mesh m = {0};
    int along = 14 * around; /* the curve is about 33 long, the tube 0.4 thick */
    double h = 1e-3;
    for (int i = 0; i < along; i++) {
        double t = 2 * pi * i / along;
        vec tangent = unit(sub(trefoil(t + h), trefoil(t - h)));
        vec bend = sub(add(trefoil(t + h), trefoil(t - h)), scale(trefoil(t), 2));
        vec n = unit(sub(bend, scale(tangent, dot(bend, tangent)))), b = cross(tangent, n);
        for (int j = 0; j < around; j++) {
            double a = 2 * pi * j / around;
            add_vertex(&m, add(trefoil(t), add(scale(n, 0.4 * qw_cos(a)), scale(b, 0.4 * qw_sin(a)))));
        }
    }
    for (int i = 0; i < along; i++)
        for (int j = 0; j < around; j++) {
            uint32_t p = (uint32_t)(i * around), q = (uint32_t)((i + 1) % along * around), j0 = (uint32_t)j,
                     j1 = (uint32_t)((j + 1) % around);
            add_triangle(&m, p + j0, p + j1, q + j1);
            add_triangle(&m, p + j0, q + j1, q + j0);
        }
    return m;
}

static mesh strip_of(int across)
{
    mesh m = {0};
    int along = 10 * across;
    uint32_t row = (uint32_t)across + 1;
    for (int i = 0; i < along; i++)
        for (int j = 0; j <= across; j++) {
            double t = 2 * pi * i / along, s = 0.35 * (2.0 * j / across - 1), r = 1 + s * qw_cos(t / 2);
            add_vertex(&m, v3(r * qw_cos(t), r * qw_sin(t), s * qw_sin(t / 2)));
        }
    for (uint32_t i = 0; i < (uint32_t)along; i++)
        for (uint32_t j = 0; j < (uint32_t)across; j++) {
            bool last = i + 1 == (uint32_t)along; /* the end meets the beginning turned over */
            uint32_t a = i * row + j, b = a + 1, d = last ? (uint32_t)across - j : a + row, c = last ? d - 1 : d + 1;
            add_triangle(&m, a, d, c);
            add_triangle(&m, a, c, b);
        }
    return m;
}

/* Surfaces of a whole-number resolution k have about c k^2 faces. */
static mesh resolved(mesh (*make)(int k), size_t faces)
{
    mesh m = make(8);
    int k = (int)lround(8 * sqrt((double)faces / (double)m.face_count));
    clear(&m);
    return make(k < 3 ? 3 : (k > 2000 ? 2000 : k));
}

/* ---- the tool */

typedef struct shape {
    const char *name, *what;
    double (*solid)(vec);
    mesh (*make)(int k);
} shape;

static const shape shapes[] = {
    {"lattice", "a cube of struts: twelve handles", lattice, NULL},
    {"dancer", "a figure with thin limbs on a plinth", dancer, NULL},
    {"hand", "a hand with thin fingers", hand, NULL},
    {"head", "a head, with a mouth and eyes; in a GLB with targets that open and close them", head, NULL},
    {"star", "a ball with twenty spikes", star, NULL},
    {"bracket", "an angle bracket with six holes and exact sharp edges", NULL, bracket_of},
    {"sheet", "a wavy open sheet with round holes", NULL, sheet_of},
    {"knot", "a trefoil tube", NULL, knot_of},
    {"moebius", "a strip with one side", NULL, strip_of},
};

static int usage(void)
{
    fputs("usage: quadwright-shapes NAME FACES OUT.obj\n", stderr);
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++)
        fprintf(stderr, "  %-8s  %s\n", shapes[i].name, shapes[i].what);
    return 2;
}

static int write_obj(const mesh *m, const char *path)
{
    FILE *file = strcmp(path, "-") == 0 ? stdout : fopen(path, "wb");
    if (!file) {
        fprintf(stderr, "quadwright-shapes: %s cannot be written\n", path);
        return 1;
    }
    for (size_t i = 0; i < m->vertex_count; i++)
        fprintf(file, "v %.9g %.9g %.9g\n", m->position[i].x, m->position[i].y, m->position[i].z);
    for (size_t f = 0; f < m->face_count; f++)
        fprintf(file, "f %u %u %u\n", m->corner[f][0] + 1, m->corner[f][1] + 1, m->corner[f][2] + 1);
    return fclose(file) == 0 ? 0 : 1;
}

/* How far each target moves the vertices of the head: all of a mouth or an eye, and less farther out. */
static float *offsets_of(const mesh *m, const opening *o)
{
    float *offset = calloc(3 * m->vertex_count, sizeof *offset);
    for (size_t i = 0; offset && i < m->vertex_count; i++) {
        vec p = m->position[i];
        double far =
            sqrt((p.x - o->x) * (p.x - o->x) / (o->wide * o->wide) + (p.y - o->y) * (p.y - o->y) / (o->high * o->high));
        double near = p.z > 0 ? fmin(fmax(1 - far / 2, 0), 1) : 0;
        offset[3 * i + 1] = (float)(-o->high * near * near * (3 - 2 * near));
    }
    return offset;
}

static int write_glb(const mesh *m, const char *path)
{
    qw_attribute target[OPENINGS];
    const qw_mesh_view view = {.size = sizeof view,
                               .vertex_count = (uint32_t)m->vertex_count,
                               .face_count = (uint32_t)m->face_count,
                               .uniform_face_size = 3,
                               .positions = &m->position->x,
                               .corners = m->corner[0]};
    for (int i = 0; i < OPENINGS; i++)
        target[i] = (qw_attribute){.size = sizeof *target,
                                   .name = openings[i].target,
                                   .components = 3,
                                   .count = view.vertex_count,
                                   .values = offsets_of(m, &openings[i])};
    qw_mesh *made;
    qw_status status = qw_mesh_wrap(&view, target, OPENINGS, NULL, NULL, NULL, &made);
    if (status == QW_OK) status = qw_mesh_save(made, path, QW_FORMAT_GLB);
    if (status != QW_OK) fprintf(stderr, "quadwright-shapes: %s\n", qw_mesh_message(made));
    qw_mesh_destroy(made);
    for (int i = 0; i < OPENINGS; i++) free((void *)target[i].values);
    return status == QW_OK ? 0 : 1;
}

int main(int argc, char **argv)
{
    if (argc != 4) return usage();
    long faces = strtol(argv[2], NULL, 10);
    if (faces < 100 || faces > 20000000) {
        fputs("quadwright-shapes: FACES must be from 100 to 20000000\n", stderr);
        return 2;
    }
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        if (strcmp(argv[1], shapes[i].name) != 0) continue;
        mesh m = shapes[i].solid ? solid_of(shapes[i].solid, (size_t)faces) : resolved(shapes[i].make, (size_t)faces);
        size_t letters = strlen(argv[3]);
        bool moves = shapes[i].solid == head && letters > 4 && strcmp(argv[3] + letters - 4, ".glb") == 0;
        int code = moves ? write_glb(&m, argv[3]) : write_obj(&m, argv[3]);
        clear(&m);
        return code;
    }
    fprintf(stderr, "quadwright-shapes: no shape is called %s\n", argv[1]);
    return usage();
}
