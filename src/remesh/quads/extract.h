/* Quads from regular, orientation-preserving offsets (paper, Section 3.6): zero edges are contracted and triangles
 * paired across hypotenuses.
 *
 * The contraction is done on the triangles' own adjacency, not by vertex numbers: a triangle without area passes its
 * neighbours on to one another. So the quads' twins are exact even where a tube is only two quads around, and a vertex
 * is a fan of quads: the result is always manifold, whatever was contracted. Where a contracted part was no disc (a
 * handle or a finger vanished) its vertex falls into several.
 */
#pragma once

#include "remesh/offsets/offsets.h"
#include "geometry/quadmesh.h"

typedef struct qw_extraction {
    qw_quadmesh quads;      /* linked; positions are the means of what was contracted; kind and mark set */
    uint32_t *vertex_class; /* uint32_t[quads.vertex_count]: contraction class of each quad vertex */
    uint32_t *class_of; /* uint32_t[m->vertex_count]: contraction class of each vertex: the lowest vertex in it. Of a
                           corner that no quad was left at: that of a vertex beside it */
    int64_t unpaired;   /* triangles of area 1 that found no partner: left out, and a hole */
} qw_extraction;

qw_extraction qw_extract_quads(qw_env *env, const qw_offset_mesh *m);
