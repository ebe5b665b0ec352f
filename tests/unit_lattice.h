/* A sheet of nx by ny cells as a component of a decimated complex, two triangles a cell, whose vertices lie on lattice
 * points that the test chooses. Each triangle has a frame of its own, turned at random, as on a curved surface. */
#ifndef QW_TESTS_UNIT_LATTICE_H
#define QW_TESTS_UNIT_LATTICE_H

#include "random.h"
#include "unit_shapes.h"

#include "remesh/quantise/complex_components.h"

typedef struct unit_lattice {
    uint32_t nx, ny;
    qw_component component;
    uint8_t *turns;     /* [faces] quarter turns from the sheet's frame to the triangle's */
    qw_int2 *place;     /* [vertices] */
    qw_real2 *position; /* [vertices], what the integers are near to */
} unit_lattice;

static inline uint32_t unit_lattice_at(const unit_lattice *l, uint32_t x, uint32_t y) { return y * (l->nx + 1) + x; }

/* The edge from the first vertex to the second or back. */
static inline uint32_t unit_lattice_edge(const unit_lattice *l, uint32_t a, uint32_t b)
{
    const qw_decimated *k = &l->component.decimated;
    for (uint32_t h = 0; h < 3 * k->complex.face_count; h++) {
        uint32_t from = k->corner[h], to = k->corner[qw_next(h)];
        if ((from == a && to == b) || (from == b && to == a)) return k->complex.edge[h];
    }
    fail_msg("no edge");
    return QW_NONE;
}

static inline uint32_t unit_lattice_turns(const unit_lattice *l, uint32_t e)
{
    return l->turns[l->component.decimated.complex.side[2 * e] / 3];
}

/* Offsets of all edges from the vertices' places and positions. */
static inline void unit_lattice_fill(unit_lattice *l)
{
    qw_complex *c = &l->component.decimated.complex;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        uint32_t h = c->side[2 * e], a = l->component.decimated.corner[h],
                 b = l->component.decimated.corner[qw_next(h)];
        unsigned k = unit_lattice_turns(l, e);
        c->d[e] = qw_turn(k, qw_int2_sub(l->place[b], l->place[a]));
        c->real[e] = qw_turn_real(k,
                                  (qw_real2){l->position[b].x - l->position[a].x, l->position[b].y - l->position[a].y});
    }
}

/* Constrains an edge to run along x (or along y) of the sheet, as a feature curve does. */
static inline void unit_lattice_hold(unit_lattice *l, uint32_t a, uint32_t b, bool along_x)
{
    uint32_t e = unit_lattice_edge(l, a, b);
    bool fixes_y = along_x != (unit_lattice_turns(l, e) & 1u);
    l->component.decimated.complex.fixed[e] = fixes_y ? QW_FIXED_Y : QW_FIXED_X;
}

/* Places and positions are (x, y) of the cell's corner. seed: of the frames; 0: all are the sheet's. */
static inline unit_lattice unit_lattice_make(qw_env *env, uint32_t nx, uint32_t ny, uint64_t seed)
{
    unit_lattice l = {.nx = nx, .ny = ny};
    uint32_t faces = 2 * nx * ny, vertices = (nx + 1) * (ny + 1), most = 3 * faces;
    qw_complex *c = &l.component.decimated.complex;
    *c = (qw_complex){.face_count = faces};
    c->edge = QW_NEW(env, uint32_t, most), c->rot = QW_NEW_ZERO(env, uint8_t, most);
    c->side = QW_NEW(env, uint32_t, 2 * (size_t)most);
    c->d = QW_NEW(env, qw_int2, most), c->real = QW_NEW(env, qw_real2, most);
    c->fixed = QW_NEW_ZERO(env, uint8_t, most);
    l.component.vertex_count = vertices;
    l.component.constraint = QW_NEW_ZERO(env, uint8_t, vertices);
    uint32_t *corner = l.component.decimated.corner = QW_NEW(env, uint32_t, most);
    l.turns = QW_NEW_ZERO(env, uint8_t, faces);
    l.place = QW_NEW(env, qw_int2, vertices), l.position = QW_NEW(env, qw_real2, vertices);
    for (uint32_t v = 0; v < vertices; v++) {
        l.place[v] = (qw_int2){(int32_t)(v % (nx + 1)), (int32_t)(v / (nx + 1))};
        l.position[v] = (qw_real2){(float)l.place[v].x, (float)l.place[v].y};
    }
    for (uint32_t f = 0; f < faces; f++) {
        uint32_t at = unit_lattice_at(&l, f / 2 % nx, f / 2 / nx), far = at + nx + 2;
        corner[3 * f] = at, corner[3 * f + 1] = f & 1u ? far : at + 1, corner[3 * f + 2] = f & 1u ? far - 1 : far;
        if (seed) l.turns[f] = (uint8_t)(random_step(&seed) >> 40 & 3u);
    }
    for (uint32_t h = 0; h < most; h++) {
        uint32_t e = 0;
        while (e < c->edge_count &&
               (corner[c->side[2 * e]] != corner[qw_next(h)] || corner[qw_next(c->side[2 * e])] != corner[h]))
            e++;
        c->edge[h] = e;
        if (e == c->edge_count) {
            c->side[2 * e] = h, c->side[2 * e + 1] = QW_NONE, c->edge_count++;
            continue;
        }
        c->side[2 * e + 1] = h;
        c->rot[h] = (uint8_t)((l.turns[h / 3] + 2u + 4u - l.turns[c->side[2 * e] / 3]) & 3u);
    }
    unit_lattice_fill(&l);
    return l;
}

/* Makes the whole rim a feature curve with corners at the sheet's corners. */
static inline void unit_lattice_hold_rim(unit_lattice *l)
{
    for (uint32_t x = 0; x < l->nx; x++)
        for (uint32_t y = 0; y <= l->ny; y += l->ny)
            unit_lattice_hold(l, unit_lattice_at(l, x, y), unit_lattice_at(l, x + 1, y), true);
    for (uint32_t y = 0; y < l->ny; y++)
        for (uint32_t x = 0; x <= l->nx; x += l->nx)
            unit_lattice_hold(l, unit_lattice_at(l, x, y), unit_lattice_at(l, x, y + 1), false);
    for (uint32_t x = 0; x <= l->nx; x += l->nx)
        for (uint32_t y = 0; y <= l->ny; y += l->ny)
            l->component.constraint[unit_lattice_at(l, x, y)] = QW_VERTEX_CORNER;
}

#endif
