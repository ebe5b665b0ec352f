/* Nests: bands of rings around closed curves that were drawn or found, and around openings, which have one side.
 *
 * In a nest the crosses run along the curve and no cone lies in it, so the same number of quads goes around each of
 * its rings. Since the curve itself is a line of the lattice (a feature curve whose mark has the bit QW_MARK_RING), no
 * line that runs beside it can come back a row further: what holds one ring closed holds all of them.
 *
 *      cones of the inside        On each side the band is as wide as its rings need, or as the surface allows: it is
 *      . - - - - - - .            an annulus (beside an open curve that ends in a cut, a strip) of what is nearer to
 *     ' .-----------. '           this curve than to any other. Directions come from the harmonic function that is 0 on
 *     ' |   curve   | ' rings     the curve and 1 on the far rim. On an annulus it has no critical point, so the lines
 *     ' '-----------' '           of equal value are closed curves around it, and a field along them has no cone.
 *      ' - - - - - - '
 *      cones of the outside       Sizes are one length on the curve and grow as the lines around do.
 */
#pragma once

#include "geometry/trimesh.h"

/* So many edges lie around a nest at least. */
enum { QW_LEAST_AROUND = 6 };

enum { QW_LEFT, QW_RIGHT, QW_SIDES }; /* of a curve, seen from outside the surface, walking along it */

typedef struct qw_nest {
    const qw_vec3
        *point; /* qw_vec3[point_count]: a polyline on the surface; the last is the first where it is closed */
    uint32_t point_count;
    uint8_t kind;          /* of necks.h; a curve that a person drew is a QW_DENT: its rings end in the middle */
    double rings;          /* on each side, for which edges are short enough */
    double most_rings;     /* on each side, as far as there is room; 0: the curve is no nest after all */
    float edge;            /* wanted edge length on the curve; set by qw_fit_nests, as the next */
    float reach[QW_SIDES]; /* width of the band on each side */
} qw_nest;

typedef struct qw_nests {
    uint32_t count;
    qw_nest *nest; /* qw_nest[count] */
    bool is_half;  /* the surface ends at a plane of symmetry, which cuts what curves enclose */
} qw_nests;

/* Decides how wide each nest is and how long its edges are, out of the sizes that are wanted anyway, and writes the
   sizes in it. The curves are engraved in the surface. size: float[surface->vertex_count]. */
void qw_fit_nests(qw_env *env, const qw_trimesh *surface, const qw_nests *nests, float *size);

/* Takes the marks off the curves that are no nests after all. */
void qw_unmark_nests(qw_env *env, qw_trimesh *mesh, const qw_nests *nests);

/* Sets the directions along the rings, all the same way around, of free vertices in nests that were fitted, on a mesh
   in which their curves are chains of edges, and of the curves' own; returns of how many free ones. constraint:
   uint8_t[mesh->vertex_count]; direction: qw_vec3[mesh->vertex_count], 0 where nothing is said. */
int64_t qw_direct_nests(qw_env *env, const qw_trimesh *mesh, const qw_nests *nests, const uint8_t *constraint,
                        qw_vec3 *direction);
