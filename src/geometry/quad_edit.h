/* A quad mesh that can be edited: the writes that moves are made of, and a journal by which they can be taken back.
 *
 * Faces that are gone stay in place until qw_quad_edit_pack. Nothing here asks whether a move is legal or wanted.
 */
#pragma once

#include "geometry/quadmesh.h"

/* What was at an address before a write. */
typedef struct qw_quad_write {
    void *at;
    unsigned char old[12];
    uint32_t size;
} qw_quad_write;

typedef struct qw_quad_edit {
    qw_env *env;
    qw_quadmesh mesh;
    uint8_t *gone; /* uint8_t[face_count] */
    uint32_t *out; /* uint32_t[vertex_count], an outgoing half-edge, the first of the fan at a boundary; stale where no
                      face is left */
    uint32_t live_faces;
    bool keeps_journal;
    qw_quad_write *journal; /* the latest last */
    size_t writes, journal_capacity;
} qw_quad_edit;

/* A copy of the mesh, in the current scope; kind, mark and component are made where there are none. */
qw_quad_edit qw_quad_edit_open(qw_env *env, const qw_quadmesh *mesh);
/* Room for so many vertices and faces more, of the mesh alone: gone and out stay as they are. */
void qw_quad_edit_reserve(qw_quad_edit *e, uint32_t more);
/* Without the faces that are gone and the vertices that no face uses. */
void qw_quad_edit_pack(qw_quad_edit *e);
/* Moves the mesh's arrays one scope outward. */
void qw_quad_edit_keep(const qw_quad_edit *e);
/* Takes back all writes but the first `writes`. */
void qw_quad_edit_undo(qw_quad_edit *e, size_t writes);

void qw_quad_edit_put(qw_quad_edit *e, uint32_t *at, uint32_t value);
void qw_quad_edit_put_byte(qw_quad_edit *e, uint8_t *at, uint8_t value);
void qw_quad_edit_place(qw_quad_edit *e, uint32_t v, qw_vec3 position);
/* Makes two half-edges twins; either may be QW_NONE. A mark on one is on both. */
void qw_quad_edit_glue(qw_quad_edit *e, uint32_t a, uint32_t b);
/* The corners at `from` are now `to`. */
void qw_quad_edit_relabel(qw_quad_edit *e, uint32_t from, uint32_t to);
/* Sets out of v from any half-edge that leaves it. */
void qw_quad_edit_set_out(qw_quad_edit *e, uint32_t v, uint32_t leaving);
void qw_quad_edit_remove(qw_quad_edit *e, uint32_t f);

/* Splits the inner vertex v in two, joined by a new quad between two of its edges, p and q: the inverse of collapsing
 * a quad. fan: the n half-edges that leave v in turn; p = fan[cut] and q = fan[(cut + part) % n], neither marked,
 * with different heads, 0 < part < n. The arrays must have room for one vertex and one face more. The two vertices
 * move apart a little. Returns the new face.
 *
 *        b                 b
 *     \  |p /         \   / \   /
 *      \ | /           \ /   \ /
 *     -- v --    ->   - w     v -
 *      / | \           / \   / \
 *     /  |q \         /   \ /   \
 *        d                 d
 */
uint32_t qw_quad_split_vertex(qw_quadmesh *m, const uint32_t *fan, uint32_t n, uint32_t cut, uint32_t part);
