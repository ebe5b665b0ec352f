/* What is baked onto: the triangles of the result as they are exported, with normals, tangents and texture coordinates,
 * and how far from them the input is looked for. */
#pragma once

#include "products/attributes/provenance.h"
#include "base/simd.h"

typedef struct qw_bake_target {
    uint32_t corner_count, face_count, triangle_count;
    const uint32_t *begin;  /* uint32_t[face_count + 1]: corners of each face */
    const uint32_t *vertex; /* uint32_t[corner_count] */
    const uint32_t *twin;   /* uint32_t[corner_count]: half-edge across, or QW_NONE */
    qw_vec3 *place;         /* qw_vec3[corner_count]: in the frame of the source */
    const float *aim;       /* float[corner_count][3]: unit, of the result's shape: along these rays go */
    const float *normal;    /* float[corner_count][3]: unit, with which it is shaded */
    const float *uv;        /* float[corner_count][2]: v upward; tiles one behind the other along u */
    uint32_t *corner;       /* uint32_t[triangle_count][3]: fans from the first corner of each face */
    uint32_t *face;         /* uint32_t[triangle_count] */
    float *tangent;         /* float[corner_count][4]: MikkTSpace's, of unit length, the sign last */
    float *cage;            /* float[corner_count]: the input is looked for so far outside and inside */
} qw_bake_target;

/* Sets triangles and tangents: at each corner the mean, by angles, of the directions in which u grows on the triangles
   around its vertex that share its normal and texture coordinates, in the plane of the normal (Mikkelsen 2008). */
void qw_bake_target_begin(qw_env *env, qw_bake_target *target);

/* Sets the cage: at each vertex as far as quads around it and what the source has there lie apart, in both directions,
   and somewhat more; at most twice the longest edge there. given: a distance for all, or 0. Returns the largest. */
float qw_bake_target_cage(qw_env *env, qw_bake_target *target, const qw_source *source, float given);

/* A triangle of the target, as its points are looked from. */
typedef struct qw_bake_face {
    qw_vec3 place[3], aim[3], normal[3], tangent[3], across[3]; /* at its corners; across: to the tangent and normal */
    float cage[3];
} qw_bake_face;
qw_bake_face qw_bake_face_of(const qw_bake_target *target, uint32_t triangle);

/* Four points of it, side by side: interpolated. */
typedef struct qw_bake_points {
    qw_vec3_lanes place, from;                  /* from: where rays begin, on the outer cage */
    qw_vec3_lanes aim, normal, tangent, across; /* unit */
    qw_lanes cage;
} qw_bake_points;
/* weight: of the corners in each point. */
qw_bake_points qw_bake_points_of(const qw_bake_face *face, const qw_lanes weight[3]);

/* What a point sees of the source. */
typedef struct qw_sight {
    uint32_t triangle; /* of the source; QW_NONE: nothing at all */
    float weight[3];
    float height;   /* of what is seen above the point, along the normal */
    bool is_missed; /* no ray met it: it is the nearest point */
    qw_vec3 point;  /* that is seen */
} qw_sight;
/* Of the first `count` points. cache: of the source; quick where its ball holds the cage at the points; may be NULL.
 */
void qw_bake_see(const qw_source *source, const qw_bake_points *points, uint32_t count, uint32_t *hint,
                 const qw_bvh_cache *cache, qw_sight sight[QW_LANES]);
/* What rays can meet of points of a parallelogram in the triangle's plane: weights of its centre and of two corners
   that are neighbours, which may lie outside of the triangle. */
void qw_bake_fill_cache(const qw_source *source, const qw_bake_face *face, const float weight[3][3],
                        qw_bvh_cache *cache);
