/* Bounding volume tree over the triangles of a surface: nearest points, with an optional test of the normal so that the
 * two sides of a thin wall are never mistaken for one another, and ray hits. */
#pragma once

#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"

typedef struct qw_bvh qw_bvh;

/* Normals of a face and of the surface that differ by no more than this (cosine) are taken for those of one sheet. */
#define QW_SAME_SHEET 0.2f

typedef struct qw_hit {
    uint32_t face;   /* QW_NONE: nothing within the limit */
    float distance2; /* squared */
    qw_vec3 point;
    float weight[3]; /* barycentric, for the corners in order */
    uint32_t looked; /* last: faces that a search for the nearest point looked at, its effort */
} qw_hit;

/* Refers to the mesh's positions, corners and components: they must outlive the tree. Deterministic at any thread
 * count. */
qw_bvh *qw_bvh_build(qw_env *env, const qw_trimesh *mesh);
/* Nearest point among the faces whose unit normal n has dot(n, normal) >= least_dot (normal zero or least_dot <= -1:
   all faces) within max_distance. hint: a face to try first (a good one makes the query fast), or QW_NONE. Equal
   distances: the lower face index wins. Thread-safe; allocates nothing. */
qw_hit qw_bvh_nearest(const qw_bvh *bvh, qw_vec3 point, qw_vec3 normal, float least_dot, float max_distance,
                      uint32_t hint);

/* The same among the faces of one component of the mesh that the tree was built of, where that says which each face is
   in; QW_NONE: of all. Parts that touch others stay on their own surface. */
qw_hit qw_bvh_nearest_of(const qw_bvh *bvh, uint32_t component, qw_vec3 point, qw_vec3 normal, float least_dot,
                         float max_distance, uint32_t hint);

/* The faces in an order in which neighbours lie near one another. place: less than the mesh's face_count. */
uint32_t qw_bvh_face_at(const qw_bvh *bvh, uint32_t place);
uint32_t qw_bvh_place_of(const qw_bvh *bvh, uint32_t face);
/* Squared distance below which two points are one, for the rounding of coordinates. */
float qw_bvh_rounding2(const qw_bvh *bvh);

/* Unit, or zero where the face has no area. */
qw_vec3 qw_bvh_normal(const qw_bvh *bvh, uint32_t face);

/* A query in full. */
typedef struct qw_bvh_query {
    qw_vec3 point, normal;
    float least_dot, max_distance;
    uint32_t hint;
    const uint32_t *label; /* uint32_t[face_count]: only the faces whose label is the wanted one; NULL: all */
    uint32_t wanted;
    float enough2; /* squared: what is nearer than this need not be the nearest; 0: it must */
} qw_bvh_query;
/* The faces that meet a ball, for many queries in one place. */
enum { QW_CACHE_SIZE = 192 };
typedef struct qw_bvh_cache {
    qw_vec3 centre;
    float radius; /* 0: the ball meets more faces than there is room for; queries go through the tree then */
    uint32_t count, place[QW_CACHE_SIZE];
    float at[3][QW_CACHE_SIZE], around[QW_CACHE_SIZE]; /* balls around the faces: centres, and radii */
    qw_vec3 corner[QW_CACHE_SIZE][3];                  /* of the faces, for rays */
} qw_bvh_cache;
void qw_bvh_fill_cache(const qw_bvh *bvh, qw_vec3 centre, float radius, qw_bvh_cache *cache);
/* As qw_bvh_nearest. cache: quick where the point and what is nearest to it lie in its ball; never changes the answer;
   may be NULL. */
qw_hit qw_bvh_find(const qw_bvh *bvh, const qw_bvh_query *query, const qw_bvh_cache *cache);
/* The nearest point of one face. */
qw_hit qw_bvh_nearest_on(const qw_bvh *bvh, uint32_t face, qw_vec3 point);
/* First hit of the ray within max_distance at a face other than `skip` (may be QW_NONE). distance2 is squared along the
 * unit direction. */
qw_hit qw_bvh_ray(const qw_bvh *bvh, qw_vec3 origin, qw_vec3 direction, float max_distance, uint32_t skip);
/* Bits of the four rays from one point that meet anything within reach. */
uint32_t qw_bvh_blocked(const qw_bvh *bvh, qw_vec3 origin, const qw_vec3 direction[4], float reach, uint32_t skip);
/* As qw_bvh_ray; cache: quick where the ray up to max_distance lies in its ball; never changes the answer;
   may be NULL. */
qw_hit qw_bvh_ray_near(const qw_bvh *bvh, const qw_bvh_cache *cache, qw_vec3 origin, qw_vec3 direction,
                       float max_distance, uint32_t skip);

/* The same for `count` rays that lie near one another, QW_MOST_RAYS at most. */
enum { QW_MOST_RAYS = 4 };
void qw_bvh_rays_near(const qw_bvh *bvh, const qw_bvh_cache *cache, const qw_vec3 *origin, const qw_vec3 *direction,
                      const float *max_distance, uint32_t count, qw_hit *hit);

/* The same over segments (sharp edges, boundary curves). */
typedef struct qw_curve_tree qw_curve_tree;
/* from, to: qw_vec3[count] end points; copied. */
qw_curve_tree *qw_curve_tree_build(qw_env *env, const qw_vec3 *from, const qw_vec3 *to, uint32_t count);
/* Of the edges of the quads, which are linked. It refers to the quads no more. */
qw_curve_tree *qw_curve_tree_of_quads(qw_env *env, const qw_quadmesh *quads);
typedef struct qw_curve_hit {
    uint32_t segment;   /* QW_NONE: nothing within the limit */
    float distance2, t; /* point = from + t (to - from) */
    qw_vec3 point;
    uint32_t looked; /* last: segments that were looked at */
} qw_curve_hit;
qw_curve_hit qw_curve_nearest(const qw_curve_tree *tree, qw_vec3 point, float max_distance);
