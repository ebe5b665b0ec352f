/* Edge operations of the working mesh with the tests that allow them: each changes the mesh only if the surface, its
 * curves and its thin parts survive. geometry/tri_edit.h knows how, this file whether, remesh/working/working.c when.
 * What is protected, and how:
 * - topology: the link condition (qw_edit_can_collapse), no second edge between two vertices;
 * - curves: corners stay; curve vertices leave only along their curve, and only if it hardly bends there;
 * - folds: no face turns by more than a limit, no face becomes a sliver that was none;
 * - shape: a flip may move the surface by a small part of the target length;
 * - position: vertices are vertices of the input, or lie where a walk on the input surface or curve ends
 * (geometry/slide.h).
 */
#pragma once

#include "geometry/tri_edit.h"

typedef struct qw_reshape {
    qw_edit edit;
    const qw_trimesh *input;
    const uint32_t *input_outgoing; /* uint32_t[input->vertex_count] */
    const uint8_t *input_stop;      /* uint8_t[input->vertex_count]: ends of curves, 1 */
    const float *base_target;       /* float[input->vertex_count] or NULL: see working.h */
    bool avoid_chords;              /* collapses and flips make no new edges that join two curve vertices */
} qw_reshape;

/* Target length of an edge. */
static inline float qw_edge_target(const qw_edit *e, uint32_t a, uint32_t b)
{
    return 0.5f * (e->vertex[a].target + e->vertex[b].target);
}
static inline float qw_edge_length2(const qw_edit *e, uint32_t a, uint32_t b)
{
    return qw_length2(qw_sub(e->vertex[a].position, e->vertex[b].position));
}

/* Splits the edge at its midpoint, or where the walk from there ends on the input; false where floats have no point
 * between its ends. */
bool qw_reshape_split(qw_reshape *r, uint32_t h);
/* Draws one end of h into the other if that is allowed; longest: edges longer than this many targets shall not arise.
 */
bool qw_reshape_collapse(qw_reshape *r, uint32_t h, float longest);
/* Flips h if it is not Delaunay. */
bool qw_reshape_flip(qw_reshape *r, uint32_t h);
/* Moves a free vertex towards the middle of its neighbourhood, on the input surface. */
bool qw_reshape_smooth(qw_reshape *r, uint32_t v);
/* Removes a face that is nearly a segment, by a collapse of its short edge or by turning or splitting its long one. */
bool qw_reshape_sliver(qw_reshape *r, uint32_t f);
bool qw_reshape_is_sliver(const qw_edit *e, uint32_t f);
