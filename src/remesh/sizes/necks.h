/* Closed curves that a person would lay rings around: the necks of what sticks out of a surface or into it (fingers,
 * limbs, ears; sockets, mouths).
 *
 * A neck encloses far more area than a curve of its length does in a plane: with L its length and A the area on its far
 * side, q = L^2 / (4 pi A) is 1 for a circle in a plane, 1/2 for the rim of half a ball, 1/4 for a rod twice as long as
 * it is thick. Tips of rods and floors of sockets are farther from the rest of the surface than all around them; from
 * each of them the level lines of the distance are looked at, and where q has a minimum there is a neck. */
#pragma once

#include "geometry/bvh.h"

/* So many edges are to fit around a neck at least; so many necks are taken at most. */
enum { QW_NECK_EDGES = 6, QW_MOST_NECKS = 256 };
/* Two curves nearer than so many edges, or than this share of their radius, are one. */
#define QW_NECKS_APART       3.0f
#define QW_NECKS_APART_SHARE 0.5f

typedef struct qw_necks {
    uint32_t count;
    uint32_t *begin;    /* uint32_t[count + 1]: points of neck i are point[begin[i]] .. point[begin[i + 1]] */
    qw_vec3 *point;     /* on the surface, about; the last of each is its first, except of a half */
    float *ratio;       /* float[count]: q, ascending */
    uint8_t *is_pocket; /* uint8_t[count]: 1: what it encloses lies inside the body, as the socket of an eye */
} qw_necks;

/* Necks with q of 0.4 times strength (0 to 1) at the most, pockets with q of 0.4, around which six edges fit, around
   pockets half as long ones. Of what a cut halves others need half the q. tree: of the surface; size:
   float[surface->vertex_count], the wanted edge lengths. is_half: boundaries are the cut at a plane of symmetry, which
   halves what encloses a tip or a floor in it. In the current scope. */
qw_necks qw_find_necks(qw_env *env, const qw_trimesh *surface, const qw_bvh *tree, const float *size, bool is_half,
                       double strength);
