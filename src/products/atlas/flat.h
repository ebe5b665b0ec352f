/* One chart laid flat: a disk of triangles, or one with holes, each with its shape in space, and coordinates in the
 * plane.
 *
 * All steps work on the stretch of the linear map from each triangle in space to the plane: its singular values s1 >=
 * s2. Lengths in the plane are those in space where both are 1.
 */
#pragma once

#include "products/atlas/seams.h"
#include "solve/envelope.h"

typedef struct qw_flat {
    uint32_t vertex_count, triangle_count, rim_count, corner_count, loops;
    uint32_t *corner;  /* uint32_t[triangle_count][3]: vertices, counter-clockwise */
    double (*rest)[3]; /* double[triangle_count][3]: its corners in space lie at (0, 0), (x, 0), (y, z) */
    double *area;      /* double[triangle_count]: in space; 0: degenerate, and left out */
    double *stiff;     /* double[triangle_count]: how rigid each triangle is, times its area; 1 at first */
    double total;      /* sum of the areas */
    double (*at)[2];   /* double[vertex_count][2] */
    uint32_t *rim; /* uint32_t[rim_count]: where each edge of the boundary begins: loops one after the other, the chart
                      on their left */
    uint32_t *rim_to; /* uint32_t[rim_count]: and where it ends */
    uint32_t *place;  /* uint32_t[corner_count]: corner of the mesh, corners of the chart's faces in their order */
    uint32_t *vertex; /* uint32_t[corner_count]: vertex of each of these */
    uint32_t *next;   /* uint32_t[corner_count]: the next corner of the same face, among these */
    uint8_t *axis; /* uint8_t[rim_count]: 1, 2: where an edge of the boundary is to lie along x, along y; 0: anywhere;
                      NULL: all are */
    qw_envelope matrix; /* Laplacian, with the last triangle's first vertex held */
    uint32_t held;
} qw_flat;

/* face: uint32_t[count], of one chart. local: uint32_t[mesh->corner_count], scratch. The coordinates are not
   set. In the caller's scope. */
qw_flat qw_flat_of(qw_env *env, const qw_atlas_mesh *mesh, const uint32_t *face, uint32_t count, uint32_t *local);

/* Whether it is a disk, or one with holes. */
bool qw_flat_is_planar(const qw_flat *flat);

/* Tutte 1963, of a disk: the boundary on a circle, each other vertex at the mean of its neighbours. No triangle is
 * inverted. */
void qw_flat_on_circle(qw_env *env, qw_flat *flat);
/* As rigid as possible (Liu et al. 2008): each step fits a rotation to each triangle, then places the vertices. */
void qw_flat_rigid(qw_env *env, qw_flat *flat, uint32_t steps);
/* Makes all triangles that are inverted, or whose larger of s1 and 1 / s2 is above the bound, more rigid. Returns how
   many. */
uint32_t qw_flat_stiffen(qw_flat *flat, double most);
/* Lowers the symmetric Dirichlet energy by steps that are Laplacians of its gradient (Kovalsky et al. 2016), each as
   long as lowers it and inverts no triangle. None may be inverted on entry. */
void qw_flat_lower(qw_env *env, qw_flat *flat, uint32_t steps);
/* Turns it so that its rows run along the axes, on the whole. */
void qw_flat_turn(qw_flat *flat);
/* Lays rows of quads on the boundary along an axis that are no higher than `bulge` of their length: lowers the energy
   with them tied to it, then moves what is left. false: there are none. Triangles may be inverted afterwards. */
bool qw_flat_straighten(qw_env *env, qw_flat *flat, double bulge, uint32_t steps);
/* Scales it so that the areas in the plane are those in space, in all. */
void qw_flat_scale(qw_flat *flat);
/* Scales a flattening without inverted triangles so that its symmetric Dirichlet energy is least. */
void qw_flat_scale_best(qw_flat *flat);

typedef struct qw_stretch {
    uint32_t inverted; /* triangles */
    double angle;      /* mean of s1 / s2, by area in space */
    double area;       /* mean of the larger of s1 s2 and 1 / (s1 s2) */
    double most;       /* largest of s1 and 1 / s2 of all triangles */
    double mean;       /* mean of that */
} qw_stretch;
qw_stretch qw_flat_stretch(const qw_flat *flat);

/* Whether no two points of the chart lie at one place, exactly, of the coordinates rounded to whole multiples of
   `grid`: all triangles and one loop of the boundary are counter-clockwise, and the boundary crosses nothing. A point
   is covered as often as loops go around it, so that a second such loop would cover what it holds twice; where the
   boundary turns by more than 360 degrees at a vertex there may be one. */
bool qw_flat_is_simple(qw_env *env, const qw_flat *flat, double grid);
