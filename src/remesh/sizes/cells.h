/* A surface in cells: connected pieces about as wide as is asked for, and which of them touch. What sizes depend on is
 * found on these, so that it costs as much for a dense scan as for a coarse mesh and does not depend on the triangles.
 */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_cells {
    uint32_t count;
    uint32_t *of;        /* uint32_t[vertices, or cells of the finer ones]: the cell that each lies in */
    uint32_t *begin;     /* uint32_t[count + 1] */
    uint32_t *neighbour; /* uint32_t[begin[count]]: those that touch cell c, from begin[c] on */
    uint32_t *start;     /* uint32_t[count]: the vertex, or the finer cell, where each began */
    qw_vec3 *point;      /* qw_vec3[count]: where that is */
    float step;          /* mean distance between the points of cells that touch; 0 where none do */
} qw_cells;

/* The graph of the vertices, as cells of one vertex each in the current scope; `of`, `start` and `step` are not set. */
qw_cells qw_cells_of_vertices(qw_env *env, const qw_trimesh *mesh);

/* In the current scope. A cell begins at each vertex that is farther than `width` times 0.8 from those before it, along
   the surface; every vertex belongs to the cell that it is fewest edges away from. */
qw_cells qw_cells_of_mesh(qw_env *env, const qw_trimesh *mesh, float width);
/* Cells of cells. */
qw_cells qw_cells_of_cells(qw_env *env, const qw_cells *finer, float width);

/* A surface as sizes and what sticks out are found on it: cut so that no edge is longer than a cell is wide, CELL edges
   of the quads. */
typedef struct qw_surface_cells {
    qw_trimesh mesh;
    qw_cells cells;
} qw_surface_cells;
qw_surface_cells qw_cells_of_surface(qw_env *env, const qw_trimesh *surface, double edge);

/* Rounds of qw_cells_spread after which a sum has spread as over a ball of this radius. */
uint32_t qw_cells_rounds(const qw_cells *cells, double radius);
/* Each round, each cell gives half of its sums to its neighbours, in equal shares. sum: float[count][channels]. */
void qw_cells_spread(qw_env *env, const qw_cells *cells, float *sum, uint32_t channels, uint32_t rounds);

/* Lowers values until none grows by more than `slope` times the distance from a cell to its neighbour. value:
   float[count], positive. */
void qw_cells_limit(qw_env *env, const qw_cells *cells, float *value, float slope);

/* Values at points of which cells->of says in which cell they lie: the mean of the lowest and the highest with which
   none would grow by more than `slope` times the distance, from the values of that cell and its neighbours. point, at:
   [count]. */
void qw_cells_interpolate(const qw_cells *cells, const float *value, float slope, const qw_vec3 *point, uint32_t count,
                          float *at);
