/* A decimated complex that can be changed: its edges flipped, vertices put on them. Beside its integers it has its real
 * lengths, which say what is where; the way back to the edges that it began with is kept.
 *
 * Lines: at each cone as many lattice lines begin as quads meet there. They are numbered around it, by the quarter
 * turns of the real layout, from the vertex's first half-edge on. */
#pragma once

#include "remesh/quantise/complex_components.h"

enum { QW_MOST_LINES = 32 }; /* of a cone; one with more counts as none */

/* What a line needs to know where it crosses a half-edge. */
typedef struct qw_crossing {
    qw_int2 steps; /* along the half-edge, in the frame of its triangle */
    uint32_t twin; /* QW_NONE on the boundary */
    uint32_t turn; /* quarter turns from the frame of its triangle to the twin's, as of qw_turn_across */
} qw_crossing;

typedef struct qw_layout {
    qw_complex complex;
    uint32_t *corner; /* uint32_t[3 faces]: the vertex at the tail of the half-edge */
    uint32_t vertex_count;
    uint32_t face_room, edge_room, vertex_room;
    qw_decimation_step *step; /* as of qw_decimated, to be taken back from the last */
    uint32_t step_count, step_room;
    /* as qw_layout_number has left it */
    uint32_t *number;      /* uint32_t[3 faces]: of the quarter turn nearest to the half-edge */
    uint32_t *valence;     /* uint32_t[vertices]: number of lines, 0 where the vertex is no cone */
    uint32_t *held;        /* uint32_t[vertices]: a bit for each line that a constrained edge runs along */
    uint8_t *is_end;       /* uint8_t[vertices]: of lines, as there is a cone in the same place; by qw_layout_measure */
    qw_crossing *crossing; /* qw_crossing[3 faces], by qw_layout_measure */
} qw_layout;

/* Room for a layout of so many faces; empty. In the current scope. */
qw_layout qw_layout_make(qw_env *env, uint32_t faces);
/* The component's complex with these lengths and integers of its edges. */
void qw_layout_fill(qw_layout *l, const qw_component *component, const qw_real2 *real, const qw_int2 *d);
/* to: of the same room. Numbers of lines are not copied. */
void qw_layout_copy(qw_env *env, const qw_layout *from, qw_layout *to);
/* The integers of the edges that the layout was filled with: d has room for as many as it has now. */
void qw_layout_undo(const qw_layout *l, qw_int2 *d);

/* Flips the edge of h where both new triangles have a real area. Their frames are that of h's triangle. */
bool qw_layout_flip(qw_env *env, qw_layout *l, uint32_t h);
/* Puts a vertex on the edge of h at `share` of its real length from the tail on, and `steps` from there, which is along
   the edge in the frame of h's triangle. h and its twin stay at the tail's side; the new faces are the last two, each
   with the frame of the one that it was part of. Returns false where there is no room or h is on the boundary. */
bool qw_layout_split(qw_env *env, qw_layout *l, uint32_t h, double share, qw_int2 steps);

void qw_layout_number(qw_layout *l);
/* Lengths of all lines of all cones, each from its cone to the next that it meets, to the boundary, or `most`:
   length[QW_MOST_LINES v + line]. Returns their sum; or, as soon as that is sure to be more than most_sum, something
   that is more, and lengths that say nothing. */
int64_t qw_layout_measure(qw_layout *l, int32_t most, int64_t most_sum, int32_t *length);

static inline uint32_t qw_across(const qw_complex *c, uint32_t h)
{
    uint32_t e = c->edge[h];
    return c->side[2 * e] == h ? c->side[2 * e + 1] : c->side[2 * e];
}

/* The turn that takes the frame of t's triangle to where h's goes by `turn`; t is h's twin. */
static inline unsigned qw_turn_across(const qw_complex *c, unsigned turn, uint32_t h, uint32_t t)
{
    return (turn + c->rot[h] + 6u - c->rot[t]) & 3u;
}

/* The quarter turn nearest to d; of two that are as near the same one in every frame. */
static inline unsigned qw_quarter_of(qw_double2 d)
{
    if (d.y < d.x && d.y >= -d.x) return 0;
    if (d.y > -d.x && d.x <= d.y) return 1;
    if (d.y > d.x && d.y <= -d.x) return 2;
    return 3;
}
