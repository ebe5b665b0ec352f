/* Closed curves that a person would lay rings around: the necks of what sticks out of a surface or into it (fingers,
 * limbs, ears; sockets, mouths).
 *
 * A neck encloses far more area than a curve of its length does in a plane: with L its length and A the area on its far
 * side, q = L^2 / (4 pi A) is 1 for a circle in a plane, 1/2 for the rim of half a ball, 1/4 for a rod twice as long as
 * it is thick. Tips of rods and floors of sockets are farther from the rest of the surface than all around them; from
 * each of them the level lines of the distance are looked at, and where q has a minimum there is a neck.
 *
 * Many eyes and mouths are flatter than that: dents. Around them lines of equal curvature (turning.h) are looked at,
 * and the one within which the surface turns most for the length of the line, about the sine of its slope there, is
 * taken. Noise makes dents too, but none with a twin: they are looked for where there is a plane of symmetry. */
#pragma once

#include "geometry/bvh.h"

/* So many edges are to fit around a neck at least; so many necks are taken at most. */
enum { QW_NECK_EDGES = 6, QW_MOST_NECKS = 256 };
/* What a curve is around. What a pocket encloses lies inside the body, as a socket; a dent is flatter. */
enum { QW_LIMB, QW_POCKET, QW_DENT };
/* Edges of the mean length that fit around a dent at least. */
enum { QW_DENT_EDGES = 10 };
/* The largest q of a pocket, and of other necks at strength 1. */
#define QW_NECK_RATIO        0.4
/* Two curves nearer than this share of their radius are one. */
#define QW_NECKS_APART_SHARE 0.5f

typedef struct qw_necks {
    uint32_t count;
    uint32_t *begin; /* uint32_t[count + 1]: points of neck i are point[begin[i]] .. point[begin[i + 1]] */
    qw_vec3 *point;  /* on the surface, about; the last of each is its first, except of a half */
    uint8_t *kind;   /* uint8_t[count] */
} qw_necks;

/* Whether these edges fit around a curve, which is closed where its last point is its first, and else half of one. */
bool qw_fits_on_neck(const qw_vec3 *point, uint32_t count, double edge, int kind);

/* Necks with q of 0.4 times strength (0 to 1) at the most, pockets with q of 0.4, the clearest first, around which six
   edges fit that are a fifth as long as the mean one. Of what a cut halves others need half the q. cut:
   double[cuts][4], normals and offsets of planes in which the boundary lies that halves what encloses a tip or a floor
   in it. dents: these too; the surface is half of one. In the current scope. */
qw_necks qw_find_necks(qw_env *env, const qw_trimesh *surface, double edge, const double *cut, uint32_t cuts,
                       bool dents, double strength);
