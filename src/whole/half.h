/* One side of a surface, and the quads of a side put together with their reflection. */
#pragma once

#include "geometry/quadmesh.h"
#include "whole/plane.h"

/* The part of a surface on one side of a plane. Its vertices at the plane lie on it. */
typedef struct qw_half_vertex {
    uint32_t from, to; /* vertices of the surface: the vertex lies on their edge, or from == to */
    double share;      /* of `to` */
} qw_half_vertex;

typedef struct qw_half {
    uint32_t vertex_count, face_count, mark_count;
    double *position;       /* double[vertex_count][3], in the coordinates of the input */
    uint8_t *on_plane;      /* uint8_t[vertex_count] */
    qw_half_vertex *origin; /* qw_half_vertex[vertex_count] */
    uint32_t *corner;       /* uint32_t[3 face_count] */
    uint32_t *source;       /* uint32_t[face_count]: the face of the surface that each is, or is a piece of */
    uint32_t *mark;         /* uint32_t[mark_count][2]: ends of marked edges */
    uint32_t in_plane;      /* triangles that lie in the plane and so are left out */
    qw_census whole;        /* of the half sewn to its reflection */
    uint64_t *topology;     /* uint64_t[whole.components]: as of qw_list_topologies, of the same */
} qw_half;

/* How a component lies at the plane: it is cut; it lies off it and has no twin on its other side: it belongs to the
   half whichever side it is on, and is not reflected; of two that cross the plane and are reflections of one another,
   not of themselves, one belongs to the half whole, and the other is left out. */
enum { QW_IS_CUT, QW_SINGLE, QW_KEPT_WHOLE, QW_LEFT_OUT };

/* The side of the larger area; between equal ones that which the normal points to; `other`: the other of the two,
   without the components that are not reflected and with those left out for those kept. mesh: linked, oriented;
   position: double[vertex_count][3] of its vertices, in the planes' coordinates. planes: where there are several, the
   vertices of a component belong to one. kind: uint8_t[vertex_count], of each vertex' component; NULL: all are cut. A
   half without faces where all lie in the plane. In the current scope. */
qw_half qw_cut_half(qw_env *env, const qw_trimesh *mesh, const double *position, const qw_mirror_planes *planes,
                    const uint8_t *kind, bool other);

/* Whether the half sewn to its reflection has components of the same topologies as the surface that was cut: holes that
   one side has may be on another component of the other side, so that sums alone do not tell. */
bool qw_is_like_half(qw_env *env, const qw_half *half, const qw_trimesh *surface, const qw_census *was);

/* Quads of a half together with their reflection. */
typedef struct qw_mirrored {
    qw_quadmesh quads; /* the half's first, in their order, then the reflections of those that have one, in the same
                          order; corner, twin and counts only */
    double *position;  /* double[quads.vertex_count][3]; the half's vertices come first */
    uint32_t *source;  /* uint32_t[quads.face_count]: the quad of the half that each is or is the reflection of */
} qw_mirrored;

/* Sewn together along the half-edges of the boundary that are 1 in sewn, uint8_t[4 half->face_count], whose vertices
   are put on the plane. position: double[half->vertex_count][3]. single: uint8_t[half->vertex_count], 1 at the vertices
   of components that are not reflected; NULL: all are. own: double[half->vertex_count][3], where the reflection of each
   vertex off the plane lies; NULL: where the plane puts it. In the current scope. */
qw_mirrored qw_mirror_quads(qw_env *env, const qw_quadmesh *half, const double *position, const qw_mirror_plane *plane,
                            const uint8_t *sewn, const uint8_t *single, const double *own);

/* After the half's vertices were moved: puts those of the seam on the plane again and, unless the other side follows
   its own surface, the others' reflections where they belong. reflected: the first quad that is a reflection. */
void qw_reflect_again(qw_env *env, const qw_mirrored *mirrored, uint32_t reflected, const qw_mirror_planes *planes,
                      bool follows);
