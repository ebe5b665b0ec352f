/* Whether the quads have the topology of the surface, where they lost it, and how components that did are rebuilt. */
#pragma once

#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"
#include "remesh/quads/extract.h"
#include "remesh/quads/pair.h"

typedef struct qw_topology_check {
    uint32_t component_count; /* of the surface */
    uint32_t broken_count;
    uint8_t *broken; /* uint8_t[component_count]: pieces, Euler characteristic or boundary loops differ, there are faces
                        or edges on the same vertices as others, or it is a sphere of fewer quads than a cube */
} qw_topology_check;

/* surface: what the quads were made from (its components numbered by their first faces, as quads->component says). */
qw_topology_check qw_check_topology(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface);

enum { QW_MOST_SITES = 256 };

/* The points at which contraction lost topology: classes that are no disc and not represented by exactly one vertex
   of the quads, triangles left inverted, and one point of each component without quads. size: the wanted edge length
   there. */
typedef struct qw_sites {
    uint32_t count;
    qw_vec3 *point; /* qw_vec3[QW_MOST_SITES], count in use */
    float *size;
    double area; /* of what is left uncovered (remesh/quads/uncovered.h) */
} qw_sites;
qw_sites qw_find_lost_topology(qw_env *env, const qw_offset_mesh *m, const qw_extraction *x);

/* Rebuilds the broken components from the same offsets: contracted only where the surface allows it, and paired
   (remesh/quads/contract.h, remesh/quads/pair.h). Components that are broken even then, of a few triangles each, are
   cut into three quads a triangle. */
typedef struct qw_replacement {
    qw_quadmesh quads; /* in the current scope */
    qw_pair_counts pairs;
    uint32_t cut_components;
} qw_replacement;
/* quads: what was checked. x, place: the extraction from m, and qw_vec3[x->quads.vertex_count]. */
qw_replacement qw_replace_components(qw_env *env, const qw_quadmesh *quads, const qw_offset_mesh *m,
                                     const qw_extraction *x, const qw_vec3 *position, const qw_topology_check *check);
