/* Small surfaces of every kind with any options through the whole pipeline, held to the promise: quads with the
 * topology of the cleaned input and the count asked for, or a refusal with a sentence. The bytes are read as options,
 * then as blocks of cells or as a soup of triangles on a small lattice, so that sheets, seams, cavities, needles,
 * touching parts and components of very different sizes are all a few bits apart. One more bit adds what people have
 * beside a model: needles, a floor, many tiny parts, and a second layer close to all of that. */
#include "quadwright/quadwright.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum {
    LATTICE = 64,
    MOST_TINY = 16, /* tetrahedra */
    MOST_VERTICES = 2 * (2 * LATTICE + 4 + 4 * MOST_TINY + 4),
    MOST_TRIANGLES = 48,
    MOST_FACES = 16 * MOST_TRIANGLES,
    CELLS = 3,
    SIDE = CELLS + 1,
    HEADER = 8
};

typedef struct mesh {
    uint32_t vertex_count, face_count;
    double position[MOST_VERTICES * 3];
    uint32_t corner[MOST_FACES * 3];
} mesh;

typedef struct bytes {
    const uint8_t *data;
    size_t size, at;
} bytes;

static uint8_t next(bytes *b) { return b->at < b->size ? b->data[b->at++] : 0; }

static void add_triangle(mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    if (m->face_count == MOST_FACES) return;
    uint32_t *to = m->corner + 3 * m->face_count++;
    to[0] = a, to[1] = b, to[2] = c;
}

/* The lattice, each plane of it moved by a byte: powers of two apart, so that thin and long cells occur. */
static void make_lattice(mesh *m, bytes *b)
{
    double plane[3][SIDE];
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < SIDE; i++) plane[axis][i] = i == 0 ? 0 : plane[axis][i - 1] + ldexp(1, -(next(b) & 7));
    m->vertex_count = SIDE * SIDE * SIDE;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        m->position[3 * v] = plane[0][v % SIDE];
        m->position[3 * v + 1] = plane[1][v / SIDE % SIDE];
        m->position[3 * v + 2] = plane[2][v / SIDE / SIDE];
    }
}

static bool is_full(uint32_t cells, const int *at)
{
    for (int i = 0; i < 3; i++)
        if (at[i] < 0 || at[i] >= CELLS) return false;
    return cells >> (at[0] + CELLS * (at[1] + CELLS * at[2])) & 1;
}

static void add_side(mesh *m, const int *cell, int axis, int up)
{
    uint32_t q[4];
    for (int k = 0; k < 4; k++) {
        int p[3] = {cell[0], cell[1], cell[2]};
        p[axis] += up;
        p[(axis + 1) % 3] += k == 1 || k == 2;
        p[(axis + 2) % 3] += k >= 2;
        q[k] = (uint32_t)(p[0] + SIDE * (p[1] + SIDE * p[2]));
    }
    if (up) add_triangle(m, q[0], q[1], q[2]), add_triangle(m, q[0], q[2], q[3]);
    else add_triangle(m, q[0], q[2], q[1]), add_triangle(m, q[0], q[3], q[2]);
}

/* The outside of the cells whose bits are set, less the sides whose bits are set in `open`. */
static void add_cells(mesh *m, bytes *b)
{
    uint32_t cells = 0, open = 0;
    for (int i = 0; i < 4; i++) cells = cells << 8 | next(b);
    for (int i = 0; i < 4; i++) open = open << 8 | next(b);
    uint32_t side = 0;
    int c[3];
    for (c[2] = 0; c[2] < CELLS; c[2]++)
        for (c[1] = 0; c[1] < CELLS; c[1]++)
            for (c[0] = 0; c[0] < CELLS; c[0]++)
                for (int axis = 0; axis < 3; axis++)
                    for (int up = 0; up < 2; up++) {
                        int beside[3] = {c[0], c[1], c[2]};
                        beside[axis] += up ? 1 : -1;
                        if (is_full(cells, c) && !is_full(cells, beside) && !(open >> side++ % 32 & 1))
                            add_side(m, c, axis, up);
                    }
}

static void add_soup(mesh *m, bytes *b)
{
    for (int i = 0; i < MOST_TRIANGLES && b->at + 3 <= b->size; i++) {
        uint32_t p = next(b) % LATTICE, q = next(b) % LATTICE, r = next(b) % LATTICE;
        add_triangle(m, p, q, r);
    }
}

/* All that there is once more, up to 2^-31 as large and some of its own lengths, or of the first's, away. */
static void add_copy(mesh *m, bytes *b)
{
    double size = ldexp(1, -(next(b) & 31)), away[3];
    for (int k = 0; k < 3; k++) {
        uint8_t byte = next(b);
        away[k] = ldexp((byte & 7) - 3, byte & 8 ? 0 : ilogb(size)) * (byte & 16 ? 4 : 1);
    }
    uint32_t faces = m->face_count, first = m->vertex_count;
    for (uint32_t v = 0; v < first; v++)
        for (int k = 0; k < 3; k++) m->position[3 * (first + v) + k] = m->position[3 * v + k] * size + away[k];
    m->vertex_count += first;
    for (uint32_t f = 0; f < faces; f++)
        add_triangle(m, first + m->corner[3 * f], first + m->corner[3 * f + 1], first + m->corner[3 * f + 2]);
}

/* ---- what lies beside a model */

static uint32_t add_point(mesh *m, double x, double y, double z)
{
    double *p = m->position + 3 * m->vertex_count;
    p[0] = x, p[1] = y, p[2] = z;
    return m->vertex_count++;
}

static void add_tetrahedron(mesh *m, const double at[3], double length, double width)
{
    uint32_t a = add_point(m, at[0], at[1], at[2]), b = add_point(m, at[0] + length, at[1], at[2]),
             c = add_point(m, at[0] + length / 2, at[1] + width, at[2]),
             d = add_point(m, at[0] + length / 2, at[1], at[2] + width);
    add_triangle(m, a, c, b), add_triangle(m, a, b, d), add_triangle(m, b, c, d), add_triangle(m, c, a, d);
}

static void read_point(bytes *b, double at[3])
{
    for (int k = 0; k < 3; k++) at[k] = next(b) / 64.0;
}

/* A floor of two triangles. */
static void add_floor(mesh *m, double half, double z)
{
    uint32_t a = add_point(m, -half, -half, z), b = add_point(m, half, -half, z), c = add_point(m, half, half, z),
             d = add_point(m, -half, half, z);
    add_triangle(m, a, b, c), add_triangle(m, a, c, d);
}

/* All that there is once more, facing the other way, so far above. */
static void add_layer(mesh *m, double away)
{
    uint32_t faces = m->face_count, first = m->vertex_count;
    for (uint32_t v = 0; v < first; v++) {
        const double *p = m->position + 3 * v;
        add_point(m, p[0], p[1], p[2] + away);
    }
    for (uint32_t f = 0; f < faces; f++) {
        const uint32_t *c = m->corner + 3 * f;
        add_triangle(m, first + c[0], first + c[2], first + c[1]);
    }
}

static void add_beside(mesh *m, bytes *b)
{
    uint8_t which = next(b);
    double at[3];
    if (which & 1) read_point(b, at), add_tetrahedron(m, at, ldexp(1, (next(b) & 7) - 3), ldexp(1, -(next(b) & 31)));
    if (which & 2) {
        double size = ldexp(1, -(next(b) & 15));
        for (int i = 0, n = 1 + next(b) % MOST_TINY; i < n; i++)
            read_point(b, at), add_tetrahedron(m, at, size, size * (1 + (i & 3)));
    }
    if (which & 4) add_floor(m, ldexp(1, next(b) & 7), (next(b) - 128) / 64.0);
    if (which & 8) add_layer(m, ldexp(1, -(next(b) & 15)));
}

static void choose(qw_options *o, bytes *b, uint8_t *kind)
{
    static const double angles[4] = {-1, 30, 60, 180};
    qw_options_init(o);
    *kind = next(b);
    uint8_t bits = next(b), flow = next(b) % 12;
    o->faces = 1 + next(b) % 64;
    o->sharp_angle = angles[bits & 3];
    o->align_boundary = !(bits & 4);
    o->adaptive = bits & 8 ? 1 : 0;
    o->smoothness = bits & 16 ? 0 : 1;
    o->relax = !(bits & 32);
    o->sat = !(bits & 64);
    if (bits & 128) o->follow = 0;
    o->flow = flow < 4 ? flow : 5; /* 4 needs a solver that may not be there; the default is the likeliest */
    o->seed = next(b);
    o->threads = 1;
}

static void broken(const char *what, double is, double wanted)
{
    fprintf(stderr, "the promise is broken: %s: %g, not %g\n", what, is, wanted);
    abort();
}

static void expect(const char *what, int64_t is, int64_t wanted)
{
    if (is != wanted) broken(what, (double)is, (double)wanted);
}

static void check(const qw_result *result, const qw_options *o)
{
    const qw_report *r = qw_result_report(result);
    qw_mesh_view quads = qw_result_mesh(result);
    qw_topology t;
    qw_quality q;
    expect("status of measuring", qw_measure(&quads, NULL, NULL, &t, &q), QW_OK);
    expect("quads", t.quads, t.faces);
    expect("degenerate faces", t.degenerate_faces, 0);
    expect("duplicate faces", t.duplicate_faces, 0);
    expect("edges of more than two faces", t.nonmanifold_edges, 0);
    expect("vertices of several fans", t.nonmanifold_vertices, 0);
    expect("isolated vertices", t.isolated_vertices, 0);
    expect("edges of inconsistent faces", t.inconsistent_edges, 0);
    expect("components", t.components, r->components);
    expect("boundary loops", t.boundary_loops, r->boundary_loops);
    expect("Euler number", t.euler, r->euler);
    for (size_t i = 0; i < 3 * (size_t)quads.vertex_count; i++)
        if (!isfinite(quads.positions[i])) broken("a coordinate", quads.positions[i], 0);
    double off = (double)t.faces / (double)o->faces - 1, most = o->faces < 500 ? 0.05 : 0.02;
    bool few = fabs((double)(t.faces - o->faces)) <
               4.5; /* curves and corners leave nothing to split for a single quad more */
    if (off < -most && !few) broken("faces", (double)t.faces, (double)o->faces);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < HEADER) return 0;
    bytes b = {data, size, 0};
    qw_options options;
    uint8_t kind;
    choose(&options, &b, &kind);
    static mesh m;
    m.face_count = 0;
    make_lattice(&m, &b);
    if (kind & 3) add_cells(&m, &b);
    if (kind & 4 && kind & 3) add_copy(&m, &b);
    if (kind & 128) add_beside(&m, &b);
    if (!(kind & 1)) add_soup(&m, &b);
    qw_mesh_view view = {.size = sizeof view,
                         .vertex_count = m.vertex_count,
                         .face_count = m.face_count,
                         .uniform_face_size = 3,
                         .positions = m.position,
                         .corners = m.corner};
    qw_result *result;
    qw_status status = qw_remesh(&view, &options, NULL, &result);
    if (status == QW_OK) check(result, &options);
    else if (status != QW_NO_FACES && status != QW_ONLY_DEGENERATE)
        fprintf(stderr, "%s: %s\n", qw_status_name(status), qw_result_message(result)), abort();
    qw_result_destroy(result);
    return 0;
}
