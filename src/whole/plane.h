/* The plane about which a surface is, or is to be made, symmetric. */
#pragma once

#include "geometry/trimesh.h"

/* Points p with dot(normal, p) = offset, in the coordinates of the input. */
typedef struct qw_mirror_plane {
    double normal[3]; /* of unit length */
    double offset;
    int axis; /* the axis that the normal is, 0 to 2; 3: none */
} qw_mirror_plane;

enum { QW_NO_AXIS = 3 };

/* Whether the plane is found, and not used where that costs something. */
static inline bool qw_finds_plane(int64_t symmetry)
{
    return symmetry == QW_SYMMETRY_AUTO || symmetry == QW_SYMMETRY_ANY;
}

/* Of any length but 0 and finite. A normal along an axis gives a plane of that axis, whatever its sign. */
qw_mirror_plane qw_mirror_plane_of(const double normal[3], double offset);

double qw_plane_height(const qw_mirror_plane *plane, const double p[3]);
/* The point of the plane beneath p: exactly on it where the plane has an axis. */
void qw_put_on_plane(const qw_mirror_plane *plane, double p[3]);
/* The reflection of p. About a plane with an axis its other coordinates are those of p. */
void qw_reflect(const qw_mirror_plane *plane, const double p[3], double q[3]);

/* Several planes, of which each vertex of a mesh belongs to one. */
typedef struct qw_mirror_planes {
    uint32_t count;
    const qw_mirror_plane *plane; /* qw_mirror_plane[count] */
    const uint8_t *of;            /* uint8_t[vertices]; NULL: all belong to the first */
} qw_mirror_planes;

static inline const qw_mirror_plane *qw_plane_of(const qw_mirror_planes *planes, uint32_t vertex)
{
    return &planes->plane[planes->of ? planes->of[vertex] : 0];
}

/* A plane, and how nearly the surface is symmetric about it. */
typedef struct qw_mirror_search {
    qw_mirror_plane plane;
    double gap;  /* mean distance of the reflected surface from the surface, over the diagonal of its box */
    double most; /* that which 95 % of it stay below */
    double far;  /* and 99.9 % of it */
} qw_mirror_search;

/* MOST_PLANES: that are found of one surface. MOST_CUTS: along which it is cut; one less than a byte has bits. */
enum { QW_MOST_PLANES = 3, QW_MOST_CUTS = 7 };

/* Sets found[0] to the plane about which the surface is most nearly symmetric: one along the given axis, or any
   (QW_NO_AXIS). Of several that are as good, those along an axis come first, then those that cut the surface along
   the shorter curves; the next best follow. A plane goes through the origin where that is as good. mesh: in the frame.
   Returns how many there are, at least 1. Distances are cut off at a tenth of the diagonal. near: diagonals within
   which 95 % of the reflected surface are to lie: where even the best plane is far from that, it is found and measured
   about samples of the surface alone. */
uint32_t qw_find_mirror_planes(qw_env *env, const qw_trimesh *mesh, const qw_frame *frame, int axis, double near,
                               qw_mirror_search found[QW_MOST_PLANES]);

/* How nearly a surface is symmetric about a plane, in the coordinates of the input. */
qw_mirror_search qw_judge_mirror_plane(qw_env *env, const qw_trimesh *mesh, const qw_frame *frame,
                                       const qw_mirror_plane *plane);

/* Whether the surface is turned about an axis: planes through it have another between them, at no angle that polygons
   have. found: of qw_find_mirror_planes. */
bool qw_is_turned(qw_env *env, const qw_trimesh *mesh, const qw_frame *frame, const qw_mirror_search *found,
                  uint32_t count);
