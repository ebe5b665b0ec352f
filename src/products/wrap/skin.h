/* The skin of a wrap: a closed, manifold triangle mesh whose vertices are points of a lattice of whole numbers, and
 * what edits it. Nothing here asks whether it intersects itself: guard.h does. */
#pragma once

#include "products/wrap/wrap_lattice.h"

#include "geometry/trimesh.h"

typedef struct qw_skin {
    qw_env *env;
    qw_wrap_frame frame;
    uint32_t vertex_count, face_count; /* slots in use, dead ones among them */
    size_t vertex_capacity, corner_capacity, out_capacity, twin_capacity;
    qw_wrap_lattice_point *position; /* qw_wrap_lattice_point[vertex_count] */
    uint32_t *corner;                /* uint32_t[3 face_count], as of a qw_trimesh; QW_NONE: the face is dead */
    uint32_t *twin;                  /* uint32_t[3 face_count] */
    uint32_t *out; /* uint32_t[vertex_count]: a half-edge that leaves the vertex; QW_NONE: it is dead */
} qw_skin;

/* The boundary of the cells that are not outside, two triangles to a face. In the caller's scope. */
qw_skin qw_skin_of_lattice(qw_env *env, const qw_wrap_lattice *lattice);

static inline uint32_t qw_skin_tail(const qw_skin *s, uint32_t h) { return s->corner[h]; }
static inline uint32_t qw_skin_head(const qw_skin *s, uint32_t h) { return s->corner[qw_next(h)]; }
static inline uint32_t qw_skin_apex(const qw_skin *s, uint32_t h) { return s->corner[qw_prev(h)]; }
static inline bool qw_skin_dead(const qw_skin *s, uint32_t f) { return s->corner[3 * (size_t)f] == QW_NONE; }

/* The next half-edge that leaves the same vertex, counter-clockwise. */
static inline uint32_t qw_skin_around(const qw_skin *s, uint32_t h) { return s->twin[qw_prev(h)]; }

uint32_t qw_skin_valence(const qw_skin *s, uint32_t v);
/* The half-edge from a to b, or QW_NONE. */
uint32_t qw_skin_find(const qw_skin *s, uint32_t a, uint32_t b);

/* Turns the edge of h to the other diagonal. The two apices must have no edge. */
void qw_skin_flip(qw_skin *s, uint32_t h);
/* A place for the vertex that the next split makes; returns its number. */
uint32_t qw_skin_reserve(qw_skin *s, qw_wrap_lattice_point at);
/* A new vertex on the edge of h; the faces `made` are the two new ones. */
uint32_t qw_skin_split(qw_skin *s, uint32_t h, qw_wrap_lattice_point at, uint32_t made[2]);
/* Whether the tail of h can become one with its head without another topology. */
bool qw_skin_can_collapse(const qw_skin *s, uint32_t h);
/* The tail of h becomes its head; the two faces at h die. */
void qw_skin_collapse(qw_skin *s, uint32_t h);
/* Renumbers what is alive. */
void qw_skin_pack(qw_skin *s);
