/* Where on the input each vertex and each corner of the quads lies.
 *
 * A vertex lies at the nearest point of the input that faces as the quads around it do and belongs to the component
 * that these were made of: a sheet never takes from the sheet behind it, nor from another that it nearly touches. A
 * corner of a quad lies on the triangle that is nearest a little way into the quad, so that at a sharp edge or a seam
 * each quad takes from its own side.
 */
#pragma once

#include "products/attributes/source.h"
#include "geometry/quadmesh.h"

/* A point of a triangle of the source; triangle QW_NONE: nothing near faces the same way. */
typedef struct qw_source_point {
    uint32_t triangle;
    float weight[3]; /* barycentric, of the triangle's corners in order */
} qw_source_point;

typedef struct qw_origins {
    qw_source_point *vertex; /* [quads->vertex_count] */
    qw_source_point *corner; /* [4 quads->face_count]; where a corner finds nothing, its vertex's */
    uint32_t *component;     /* uint32_t[quads->face_count]: of the clean surface, or QW_NONE */
    float *reach;            /* float[quads->face_count]: longest edge: what is farther than that is not near */
    uint32_t lost_vertices, lost_corners;
    float farthest; /* distance of a vertex that was found to where it was found, in the centred frame */
} qw_origins;

/* quads: linked, in the frame of the source, none of them without an edge. In the caller's scope. */
qw_origins qw_find_origins(qw_env *env, const qw_source *source, const qw_quadmesh *quads);

/* What a query says of the sheet that a quad is of: its component, and no farther than its reach. */
qw_bvh_query qw_query_of_quad(const qw_source *source, const qw_origins *origins, uint32_t f);
/* The source around a quad, for queries at points of it. */
void qw_fill_cache(const qw_source *source, const qw_quadmesh *quads, uint32_t f, qw_bvh_cache *cache);

/* The same as the public structure tells it. */
qw_origin qw_origin_of(const qw_source *source, const qw_source_point *point);
