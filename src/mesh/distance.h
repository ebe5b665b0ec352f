/* Distances between a polygon mesh and the surface it stands for; a part of measure.h. */
#ifndef QW_MESH_DISTANCE_H
#define QW_MESH_DISTANCE_H

#include "mesh/measure.h"
#include "mesh/trimesh.h"

#include <math.h>

/* Double precision, for figures that must not depend on where the coordinates lie. */
typedef struct qw_dvec3 {
    double x, y, z;
} qw_dvec3;

static inline qw_dvec3 qw_dsub(qw_dvec3 a, qw_dvec3 b) { return (qw_dvec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline qw_dvec3 qw_dscale(qw_dvec3 a, double s) { return (qw_dvec3){a.x * s, a.y * s, a.z * s}; }
static inline double qw_ddot(qw_dvec3 a, qw_dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double qw_dlength(qw_dvec3 a) { return sqrt(qw_ddot(a, a)); }
static inline qw_dvec3 qw_dcross(qw_dvec3 a, qw_dvec3 b)
{
    return (qw_dvec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline qw_dvec3 qw_dpoint(const qw_mesh_view *mesh, uint32_t vertex, double scale)
{
    const double *p = mesh->positions + 3 * (size_t)vertex;
    return (qw_dvec3){p[0] * scale, p[1] * scale, p[2] * scale};
}

static inline uint64_t qw_mix(uint64_t x) /* one step of splitmix64 */
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/* A frame in which both (other may be NULL) have a box of half to one quarter; its scale is a power of two. Vertices
   that no face uses do not count. */
qw_frame qw_common_frame(const qw_mesh_view *mesh, const qw_mesh_view *other);

/* The value below which the share (0 to 1) of the values lies, between neighbours linearly. Values are not negative,
 * count not 0. */
double qw_percentile(const float *values, size_t count, double share);

/* Fills flipped_faces and the distances, in units of quality->mean_edge, which is set and positive. */
void qw_measure_distances(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const qw_mesh_view *against, qw_quality *quality);

#endif
