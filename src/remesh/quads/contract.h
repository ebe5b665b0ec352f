/* Contraction of zero edges, but only where the surface allows it.
 *
 * Extraction (remesh/quads/extract.h) contracts every zero edge at once: fast, and right wherever what is contracted is
 * a disc. Here the same edges are collapsed one by one, each only if the surface stays one (the link condition), so the
 * triangles that are left always have the topology of the surface, and no two edges join the same vertices. Where all
 * zero edges could go, what is left are the right triangles whose pairs across hypotenuses are the quads; around a
 * handle or a protrusion too thin for them, and where triangles are inverted, others are left as well, as few as the
 * surface needs. remesh/quads/pair.h makes quads of both.
 */
#pragma once

#include "remesh/offsets/offsets.h"
#include "geometry/tri_edit.h"

/* The contracted triangles of the components c with wanted[c], in the current scope. Of their vertices, `position`
   is the mean of the vertices contracted into it (of corners if there are any, else of curve vertices), `kind` the
   feature constraint, `target` the wanted edge length and `home` the component. component: uint32_t[m->face_count].
   *hypotenuse: uint8_t[4 edit.face_count], 1 on half-edges that are the hypotenuse of a right triangle of positive
   area. *vertex_of: uint32_t[m->vertex_count], the vertex that each became, or QW_NONE. */
qw_edit qw_contract(qw_env *env, const qw_offset_mesh *m, const uint32_t *component, const uint8_t *wanted,
                    uint8_t **hypotenuse, uint32_t **vertex_of);
