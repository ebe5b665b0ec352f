/* How large the quads are wanted at each vertex of a surface: by its shape and what is painted on it, by what its
 * components need, around small loops and where an earlier attempt was too coarse. Lengths are in the centred frame. */
#pragma once

#include "geometry/bvh.h"
#include "remesh/sizes/around.h"
#include "remesh/sizes/density.h"
#include "remesh/sizes/tips.h"

/* A ball (centred frame) in which the wanted edge length is multiplied by QW_REFINED_SIZE, once for each round. */
typedef struct qw_refinement {
    qw_vec3 center;
    float radius;
    uint32_t round; /* 1, 2, ... */
} qw_refinement;

typedef struct qw_size_request {
    const qw_trimesh *surface;
    const qw_census *census;         /* of the surface */
    const qw_bvh *tree;              /* of the surface; NULL: there is none yet */
    double rho;                      /* the mean edge length wanted */
    double adaptive;                 /* the option */
    const float *circles;            /* float[surface->vertex_count], of around.h; NULL: none */
    double turn;                     /* of an edge on a circle, at most; positive */
    const qw_density *painted;       /* qw_density[surface->vertex_count]; NULL: none */
    bool with_boundary;              /* the option align_boundary */
    const qw_refinement *refinement; /* qw_refinement[refinements], by rounds */
    uint32_t refinements;
} qw_size_request;

/* Edge length of so many quads on an area, at least the extent over their number. */
double qw_edge_of(double area, double extent, double quads);

/* rho times the factors of density.h, shared out so that each component gets the quads that it needs:
   float[surface->vertex_count], in the current scope. *tips, if not NULL: what sticks out, in the current scope. */
float *qw_shared_sizes(qw_env *env, const qw_size_request *request, qw_tip_list *tips);

/* Lowers them along small loops and in refinements, and then so that they grow no faster than they may. */
void qw_refine_sizes(qw_env *env, const qw_size_request *request, float *size);
