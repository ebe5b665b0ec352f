/* Clean surface: polygons of a file -> an oriented, manifold triangle surface in the centred frame.
 *
 * In this order: triangulate polygons (ear clipping where they are not convex); weld exactly equal positions of
 * vertices that lie on an open edge (all vertices where the format shares none), so that closed parts that merely touch
 * stay apart; weld boundary vertices that differ by rounding, where that closes the surface; split open edges at
 * vertices of others that lie on them, where that closes them (junctions.h); drop faces that repeat a vertex and faces
 * with the same three vertices as another (small flaps with both sides); cut edges with more than two faces into
 * sheets, pairing faces of opposite direction that meet at the widest angle; orient neighbours alike, each component by
 * a flood that never crosses a cut, closed components outward (but cavities, and files all inside out, as they are);
 * where a component is one-sided cut a seam; split vertices with several fans; drop isolated vertices; drop components
 * that are too small, where that is asked for, and those of which no face has an area; split all but one of the edges
 * that cuts have left between the same two vertices; give components that single precision would flatten a frame of
 * their own (own_frame.h); smooth out folds in flat places (unfold.h), the only other thing that moves vertices. A
 * surface without any face of non-zero area fails with QW_ONLY_DEGENERATE, one without faces with QW_NO_FACES.
 */
#pragma once

#include "geometry/clean_input.h"
#include "remesh/clean/own_frame.h"
#include "geometry/trimesh.h"

typedef struct qw_clean_counts {
    int64_t triangles; /* after triangulation, before anything was dropped */
    int64_t welded_vertices, sewn_junctions, dropped_degenerate, dropped_duplicate, dropped_isolated,
        dropped_components;
    int64_t flipped_alone, turned_components; /* of flipped_triangles: to agree with neighbours; closed, inside out */
    int64_t flipped_triangles, split_edges, split_vertices, one_sided_seam_edges, unfolded_vertices;
    int64_t dropped_flat; /* components without an area in the precision of their coordinates */
    uint32_t first_flat;  /* a polygon of the first of them */
} qw_clean_counts;

typedef struct qw_clean {
    qw_trimesh mesh; /* marks set by qw_find_features later; NULL here */
    qw_frame frame;
    qw_own_frames own;               /* of components that single precision would flatten */
    uint32_t *component, components; /* of each face, as by qw_label_components */
    uint32_t *source_face;           /* uint32_t[mesh.face_count]: polygon that each triangle comes from */
    float wrapped; /* this is a skin about the input (products/wrap/wrap.h), made of cells of this width; 0: it is not.
                      Its triangles come from the polygons that are nearest */
    uint8_t *seen; /* uint8_t[faces of the input] of a skin: 1: outside comes near this polygon; NULL: it is no skin */
    qw_clean_counts counts;
} qw_clean;

/* least_share: components that have less than this share of the whole area are dropped, but never the largest; 0 keeps
 * all. outward: closed components that are inside out are turned, but cavities and files all inside out. */
qw_clean qw_clean_surface(qw_env *env, const qw_clean_input *input, double least_share, bool outward);

/* The place of a point of the clean surface in the coordinates of the input. */
void qw_place_in_input(const qw_clean *clean, qw_vec3 point, double place[3]);
