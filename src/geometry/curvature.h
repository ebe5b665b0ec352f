/* Principal curvatures of a surface at a chosen scale, from its edges (Cohen-Steiner and Morvan 2003).
 *
 * The tensor at a point is the sum over the edges within a ball of radius h, each as its angle times its length in the
 * ball along its direction, divided by the surface's area in the ball. What faces away from the point, as the other
 * side of a thin wall does, does not count.
 */
#pragma once

#include "geometry/sampled_surface.h"

typedef struct qw_ball_curvature qw_ball_curvature;

/* radius: h, in the surface's frame, positive. view: the mesh that the surface was made of. Belongs to the current
   scope. Same at any thread count. */
qw_ball_curvature *qw_ball_curvature_make(qw_env *env, const qw_surface *s, const qw_mesh_view *view, double radius);

typedef struct qw_principal {
    qw_vec3 direction; /* unit, tangent: of the larger principal curvature; the other is orthogonal */
    float weight;      /* 0 to 1: how clear the directions are; 0: not at all */
} qw_principal;

typedef enum qw_ball_edges { QW_BALL_MARKED, QW_BALL_UNMARKED } qw_ball_edges;

/* The same of a surface that is linked, and of those of its edges that have a mark or have none. normal:
 * qw_vec3[mesh->face_count], unit; zero for faces that do not count. */
qw_ball_curvature *qw_ball_curvature_of(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, qw_ball_edges edges,
                                        double radius);

/* What lies in the ball around a point and does not face away from the normal given. */
typedef struct qw_ball_sums {
    double area;
    qw_vec3 normal;       /* sum over the area */
    double turn, turning; /* sum over the edges of angle times length: convex less concave, and without signs */
} qw_ball_sums;
qw_ball_sums qw_ball_sums_at(const qw_ball_curvature *c, qw_vec3 point, qw_vec3 normal);

/* At a point on the surface with the unit normal of its triangle. The weight is |k1 - k2| h, at most 1, where that is
   above 0.12 (a quad of size h bows by a sixteenth of that) and above 0.3 (|k1| + |k2|) h; 0 elsewhere. Thread-safe. */
qw_principal qw_ball_curvature_at(const qw_ball_curvature *c, qw_vec3 point, qw_vec3 normal);

/* Pieces of edges and of areas that such a query looks at. */
uint64_t qw_ball_effort(const qw_ball_curvature *c, qw_vec3 point);
/* No query looks at more. */
uint64_t qw_ball_most_effort(const qw_ball_curvature *c);
