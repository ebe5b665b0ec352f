/* Dense surfaces such as scanners and generators leave, of any number of triangles, as binary PLY.
 *
 *     cc -O2 bench/make_scan.c -o make_scan -lm
 *     ./make_scan torus 1000000 torus.ply
 *     ./make_scan cubes 1000000 cubes.ply
 *
 * torus: a torus with bumps, on a grid. cubes: a ball with bumps and noise of some tenths of a cell, by marching cubes:
 * with the slivers that these leave, and vertices in the order in which a program would come to them.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct mesh {
    float *position; /* float[vertices][3] */
    uint32_t *corner;
    size_t vertices, triangles, vertex_room, triangle_room;
} mesh;

static void *more(void *block, size_t bytes)
{
    void *grown = realloc(block, bytes);
    if (!grown) fprintf(stderr, "no memory\n"), exit(1);
    return grown;
}

static uint32_t add_vertex(mesh *m, double x, double y, double z)
{
    if (m->vertices == m->vertex_room)
        m->position = more(m->position, (m->vertex_room = 2 * m->vertex_room + 1024) * 3 * sizeof(float));
    float *p = m->position + 3 * m->vertices;
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
    return (uint32_t)m->vertices++;
}

static void add_triangle(mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    if (m->triangles == m->triangle_room)
        m->corner = more(m->corner, (m->triangle_room = 2 * m->triangle_room + 1024) * 3 * sizeof(uint32_t));
    uint32_t *t = m->corner + 3 * m->triangles++;
    t[0] = a, t[1] = b, t[2] = c;
}

static void write_mesh(const mesh *m, const char *path)
{
    FILE *file = fopen(path, "wb");
    if (!file) perror(path), exit(1);
    fprintf(file,
            "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty float x\nproperty float y\n"
            "property float z\nelement face %zu\nproperty list uchar int vertex_indices\nend_header\n",
            m->vertices, m->triangles);
    fwrite(m->position, 3 * sizeof(float), m->vertices, file);
    for (size_t f = 0; f < m->triangles; f++) {
        fputc(3, file);
        fwrite(m->corner + 3 * f, sizeof(uint32_t), 3, file);
    }
    if (fclose(file)) perror(path), exit(1);
}

/* ---- torus */

static void make_torus(mesh *m, size_t triangles)
{
    const double pi = 3.14159265358979;
    size_t rows = (size_t)sqrt((double)triangles / 6), columns = 3 * rows;
    for (size_t i = 0; i < columns; i++)
        for (size_t j = 0; j < rows; j++) {
            double a = 2 * pi * (double)i / (double)columns, b = 2 * pi * (double)j / (double)rows,
                   r = 0.35 * (1 + 0.12 * sin(9 * a) * sin(5 * b) + 0.01 * sin(60 * a + 1) * sin(25 * b));
            add_vertex(m, cos(a) * (1 + r * cos(b)), sin(a) * (1 + r * cos(b)), r * sin(b));
        }
    for (size_t i = 0; i < columns; i++)
        for (size_t j = 0; j < rows; j++) {
            uint32_t p = (uint32_t)(i * rows + j), q = (uint32_t)((i + 1) % columns * rows + j),
                     r = (uint32_t)((i + 1) % columns * rows + (j + 1) % rows),
                     s = (uint32_t)(i * rows + (j + 1) % rows);
            add_triangle(m, p, q, r), add_triangle(m, p, r, s);
        }
}

/* ---- marching cubes */

typedef struct table {
    uint64_t *key; /* 4 * lattice point + axis + 1; 0: free */
    uint32_t *vertex;
    size_t slots, used;
} table;

static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 31) * 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 29) * 0xbf58476d1ce4e5b9u;
    return x ^ x >> 32;
}

static size_t slot_of(const table *t, uint64_t key)
{
    size_t i = mix(key) & (t->slots - 1);
    while (t->key[i] && t->key[i] != key) i = (i + 1) & (t->slots - 1);
    return i;
}

static void make_room(table *t)
{
    if (2 * t->used < t->slots) return;
    table grown = {.slots = t->slots ? 2 * t->slots : 1 << 16, .used = t->used};
    grown.key = calloc(grown.slots, sizeof *grown.key), grown.vertex = calloc(grown.slots, sizeof *grown.vertex);
    if (!grown.key || !grown.vertex) fprintf(stderr, "no memory\n"), exit(1);
    for (size_t i = 0; i < t->slots; i++) {
        if (!t->key[i]) continue;
        size_t to = slot_of(&grown, t->key[i]);
        grown.key[to] = t->key[i], grown.vertex[to] = t->vertex[i];
    }
    free(t->key), free(t->vertex);
    *t = grown;
}

enum { SIDE = 16, LATTICE = 1 << 14 }; /* cells of a block a side; lattice points a side at most */

static const int corner_at[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                    {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
/* Corners of the six faces, counter-clockwise from outside. */
static const int face_of[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7, 6}, {1, 2, 6, 5}, {0, 4, 7, 3}};

typedef struct field {
    mesh *mesh;
    table edges;
    double radius; /* in cells */
} field;

static uint64_t point_key(const int *p)
{
    return ((uint64_t)(p[2] + LATTICE / 2) * LATTICE + (uint64_t)(p[1] + LATTICE / 2)) * LATTICE +
           (uint64_t)(p[0] + LATTICE / 2);
}

static double smooth_value(const field *f, const int *p)
{
    double x = p[0], y = p[1], z = p[2], d = sqrt(x * x + y * y + z * z) + 1e-9;
    double bumps = 0.06 * sin(7 * x / d) * sin(6 * y / d + 1) * sin(8 * z / d);
    return d - f->radius * (0.92 + bumps);
}

static double value_at(const field *f, const int *p)
{
    double noise = (double)(mix(point_key(p) + 77) >> 11) / 9007199254740992.0 - 0.5;
    return smooth_value(f, p) + 0.3 * noise;
}

/* The vertex on the edge from lattice point p to q, of values a and b of different sign. */
static uint32_t vertex_on(field *f, const int *p, const int *q, double a, double b)
{
    int axis = p[0] != q[0] ? 0 : p[1] != q[1] ? 1 : 2;
    const int *low = p[axis] < q[axis] ? p : q;
    double low_value = low == p ? a : b, high_value = low == p ? b : a, t = low_value / (low_value - high_value);
    uint64_t key = 4 * point_key(low) + (uint64_t)axis + 1;
    make_room(&f->edges);
    size_t at = slot_of(&f->edges, key);
    if (!f->edges.key[at]) {
        double place[3] = {low[0], low[1], low[2]};
        place[axis] += t;
        f->edges.key[at] = key, f->edges.used++;
        f->edges.vertex[at] = add_vertex(f->mesh, place[0] / f->radius, place[1] / f->radius, place[2] / f->radius);
    }
    return f->edges.vertex[at];
}

/* Lines on the faces of the cell, each with what is inside on its left, linked into loops, which are cut into
 * triangles. */
static void march(field *f, int at[8][3], const double *value)
{
    uint32_t from[16], to[16], count = 0;
    for (int k = 0; k < 6; k++) {
        uint32_t cross[4], n = 0, starts[2], ends[2], s = 0, e = 0;
        for (int i = 0; i < 4; i++) {
            int a = face_of[k][i], b = face_of[k][(i + 1) % 4];
            if ((value[a] < 0) == (value[b] < 0)) continue;
            cross[n++] = vertex_on(f, at[a], at[b], value[a], value[b]);
            if (value[a] < 0) starts[s++] = cross[n - 1]; /* leaves the inside */
            else ends[e++] = cross[n - 1];
        }
        if (n == 2) from[count] = starts[0], to[count++] = ends[0];
        if (n == 4) { /* around each corner that is inside: from where it is entered to where it is left */
            int first_inside = value[face_of[k][0]] < 0;
            for (uint32_t i = 0; i < 2; i++)
                from[count] = starts[i], to[count++] = first_inside ? ends[(i + 1) % 2] : ends[i];
        }
    }
    for (uint32_t i = 0; i < count; i++) {
        if (from[i] == UINT32_MAX) continue;
        uint32_t loop[16], n = 0, next = from[i];
        for (uint32_t j = i; j < count;) {
            loop[n++] = next, next = to[j], from[j] = UINT32_MAX;
            for (j = 0; j < count && from[j] != next; j++) continue;
        }
        for (uint32_t j = 1; j + 1 < n; j++) add_triangle(f->mesh, loop[0], loop[j], loop[j + 1]);
    }
}

static void march_block(field *f, const int *low)
{
    static double value[SIDE + 1][SIDE + 1][SIDE + 1];
    for (int z = 0; z <= SIDE; z++)
        for (int y = 0; y <= SIDE; y++)
            for (int x = 0; x <= SIDE; x++) value[z][y][x] = value_at(f, (int[]){low[0] + x, low[1] + y, low[2] + z});
    for (int z = 0; z < SIDE; z++)
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                int at[8][3], inside = 0;
                double v[8];
                for (int i = 0; i < 8; i++) {
                    const int *c = corner_at[i];
                    v[i] = value[z + c[2]][y + c[1]][x + c[0]], inside += v[i] < 0;
                    at[i][0] = low[0] + x + c[0], at[i][1] = low[1] + y + c[1], at[i][2] = low[2] + z + c[2];
                }
                if (inside % 8) march(f, at, v);
            }
}

static void make_cubes(mesh *m, size_t triangles)
{
    field f = {.mesh = m, .radius = sqrt((double)triangles / 29.5)};
    int blocks = (int)(f.radius / SIDE) + 2;
    for (int z = -blocks; z < blocks; z++)
        for (int y = -blocks; y < blocks; y++)
            for (int x = -blocks; x < blocks; x++) {
                int low[3] = {SIDE * x, SIDE * y, SIDE * z},
                    middle[3] = {low[0] + SIDE / 2, low[1] + SIDE / 2, low[2] + SIDE / 2};
                if (fabs(smooth_value(&f, middle)) < 2.2 * SIDE) march_block(&f, low);
            }
}

int main(int count, char **word)
{
    mesh m = {0};
    size_t triangles = count == 4 ? strtoull(word[2], NULL, 10) : 0;
    if (triangles < 100 || (strcmp(word[1], "torus") && strcmp(word[1], "cubes"))) {
        fprintf(stderr, "usage: make_scan torus|cubes TRIANGLES OUT.ply\n");
        return 2;
    }
    if (strcmp(word[1], "torus") == 0) make_torus(&m, triangles);
    else make_cubes(&m, triangles);
    write_mesh(&m, word[3]);
    printf("%zu triangles\n", m.triangles);
    return 0;
}
