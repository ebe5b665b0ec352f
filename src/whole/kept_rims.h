/* Boundaries that stay: the option fix_boundary, and regions. The result ends in the vertices of the input's own rim,
 * with the very coordinates that the input has. A mesh of quads has an even number of boundary edges in each component;
 * where the input has an odd number one of its triangles there stays as it is, as do all polygons outside of a region,
 * and the result is joined to them. */
#pragma once

#include "whole/state.h"

bool qw_keeps_rims(const qw_run_state *run);

/* Sets run->whole: its clean surface, the census, and what is left out. Fails with QW_ARGUMENT where an odd number of
   boundary edges can't be mended. */
void qw_clean_inside(qw_run_state *run);

/* How many of so many quads are left for the rest when the rims that are kept have got theirs. */
double qw_faces_inside_rims(const qw_run_state *run, double faces);

/* Lowers the wanted sizes, float[run->surface.vertex_count], along the rims, so that the quads' edges there are not
   much longer than those, and raises them elsewhere, so that there are as many quads. */
void qw_fit_rims(const qw_run_state *run, float *size);

/* The quads with collars that end in the rims of the clean surface. *rim: as run->rim. In the current scope. */
qw_quadmesh qw_fix_rims(qw_run_state *run, const qw_quadmesh *quads, uint32_t **rim);

/* uint8_t[finished.vertex_count], 1: of a rim that is kept; NULL where none is. In the current scope. */
uint8_t *qw_list_rims(const qw_run_state *run);

/* Gives the rims the input's coordinates. output: double[quads->vertex_count][3]. Returns a quad that has no area then,
   or QW_NONE. */
uint32_t qw_put_rims(const qw_run_state *run, const qw_quadmesh *quads, double *output);

/* Where the rims that stay alone take more quads than were asked for, it is said before the work how many at the least.
 */
void qw_warn_of_least(qw_run_state *run);
/* Where the rims take more quads than were asked for, the report says so. */
void qw_warn_of_rims(qw_run_state *run);

/* The polygons around what was remeshed, as they are in the result. */
typedef struct qw_outside {
    uint32_t face_count;
    uint32_t *face_begin, *source; /* uint32_t[face_count + 1]; uint32_t[face_count]: polygon of the input */
    uint32_t *vertex, *origin;     /* uint32_t[face_begin[face_count]]: vertex of the input, or from its vertex_count on
                                      one that was made; corner of the input that it comes from */
} qw_outside;

/* Vertices of the input, and those that were made for a rim that is cut anew: run->rim and qw_outside count both. */
uint32_t qw_rim_vertices(const qw_run_state *run);

/* In the current scope. Something was left out. */
qw_outside qw_list_outside(const qw_run_state *run);

/* Sets run->joined. */
void qw_join_left_out(qw_run_state *run);

/* The result: the joined mesh where there is one, or else the finished quads. */
qw_mesh_view qw_view_of_result(const qw_run_state *run);
