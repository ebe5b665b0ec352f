/* The connected parts of a skeleton, each with numbers of its own. Their integers have nothing to do with one another
 * but the count of all of them. */
#ifndef QW_INTEGER_PARTS_H
#define QW_INTEGER_PARTS_H

#include "integer/skeleton.h"

typedef struct qw_part {
    qw_skeleton
        skeleton; /* its complex and corners; vertices are numbered from 0, and no steps lead back to the surface */
    uint32_t vertex_count;
    uint32_t *edge; /* uint32_t[skeleton.complex.edge_count]: the same edges in the whole */
} qw_part;

typedef struct qw_parts {
    uint32_t count;
    qw_part *part;       /* qw_part[count], in the order of their first triangles */
    uint32_t *of_vertex; /* uint32_t[m->vertex_count]: the part of each vertex of the surface; 0 too where nothing is
                            left of its component */
} qw_parts;

/* m: the surface of the skeleton. In the current scope. */
qw_parts qw_split_skeleton(qw_env *env, const qw_skeleton *s, const qw_offset_mesh *m);

#endif
