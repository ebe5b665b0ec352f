/* The moves of single quads and edges that keep the topology (for simplify.h and flip_repair.h):
 * - collapse: two opposite corners of a quad become one vertex, and the quad goes; its other two corners lose an edge
 * each;
 * - rotate: the edge between two quads goes to the next pair of opposite corners of their hexagon.
 *
 * A move is legal where it leaves a simple surface with its curves; whether it is wanted is for the caller to say.
 */
#pragma once

#include "geometry/quad_edit.h"

typedef enum qw_quad_move_kind { QW_COLLAPSE, QW_ROTATE_ON, QW_ROTATE_BACK } qw_quad_move_kind;

typedef struct qw_quad_move {
    /* rotate: the edge; collapse: a half-edge that leaves one of the two corners in the quad that goes */
    uint32_t half;
    uint8_t kind; /* qw_quad_move_kind */
} qw_quad_move;

enum {
    QW_MAX_VALENCE = 24, /* vertices of more edges are left alone, so that every move costs the same */
    QW_MOVES_AT = 10 * QW_MAX_VALENCE
};

/* Edges at v, or QW_MAX_VALENCE + 1 where there are more. */
uint32_t qw_valence_at(const qw_quad_edit *e, uint32_t v, bool *open);

/* Makes the move where it is legal, and says so. curveless: the ends of a collapse may both lie on curves. */
bool qw_make_quad_move(qw_quad_edit *e, qw_quad_move move, bool curveless);

/* The vertices whose edges a move changes; of a collapse the third one goes. Returns how many, 0 where there is no such
 * move. */
uint32_t qw_changed_by_move(const qw_quadmesh *m, qw_quad_move move, uint32_t changed[6]);

/* All moves that change the edges at v, some of them twice; returns how many. */
uint32_t qw_quad_moves_at(const qw_quad_edit *e, uint32_t v, qw_quad_move list[QW_MOVES_AT]);
