/* The connected components of a decimated complex, each with its own numbering. Their integers depend on one another
   only through the count of all quads. */
#pragma once

#include "remesh/quantise/decimated.h"

typedef struct qw_component {
    /* its complex and corners; vertices are numbered from 0, and no steps lead back to the surface */
    qw_decimated decimated;
    uint32_t vertex_count;
    uint32_t *edge;      /* uint32_t[decimated.complex.edge_count]: the same edges in the whole */
    uint8_t *constraint; /* uint8_t[vertex_count], as of the surface; NULL: no vertex is a corner */
} qw_component;

typedef struct qw_components {
    uint32_t count;
    qw_component *component; /* qw_component[count], in the order of their first triangles */
    uint32_t *of_vertex; /* uint32_t[m->vertex_count]: the component of each vertex of the surface; 0 too where nothing
                            is left of its component */
} qw_components;

/* m: the surface of the decimated complex. In the current scope. */
qw_components qw_split_components(qw_env *env, const qw_decimated *s, const qw_offset_mesh *m);
