/* The last look at relaxed quads: one that lies with its back to the surface around it is spread out again, with some
 * rings around it. */
#ifndef QW_QUAD_UNTANGLE_H
#define QW_QUAD_UNTANGLE_H

#include "mesh/bvh.h"
#include "quad/relax_curves.h"

typedef struct qw_untangling {
    const qw_quadmesh *quads;
    const qw_trimesh *surface;
    const qw_bvh *tree; /* of the surface */
    qw_curve_binding *curves;
    const uint32_t *begin, *around; /* quads around each vertex: corner half-edges around[begin[v]..begin[v + 1]] */
    const qw_vec3 *ground;          /* [vertices] normal of the surface where a free vertex lies, or 0 */
    qw_vec3 *position;              /* [vertices], changed where quads are flipped and nowhere else */
    uint8_t *flipped; /* [faces]: set to 1 for those that are perhaps left so, QW_CERTAINLY_FLIPPED where that is
                         certain; NULL: not wanted */
} qw_untangling;

enum { QW_CERTAINLY_FLIPPED = 2 };

float qw_mean_edge(const qw_untangling *u);
/* Whether f is flipped: 0 not, 1 perhaps, QW_CERTAINLY_FLIPPED. edge: as of qw_mean_edge. */
uint32_t qw_flip_degree(const qw_untangling *u, float edge, uint32_t f);
/* The triangles of the surface some point of which may be within `reach` of `middle`; listed when they are asked for.
 */
typedef struct qw_near {
    qw_vec3 middle;
    float reach;
    uint32_t *list; /* uint32_t[surface faces], count in use */
    uint32_t count;
    bool is_listed;
} qw_near;

/* Whether f is flipped by the measure itself: most of it opposes the surface nearest to it (qw_is_opposed), and next to
   nothing agrees that is less than an edge away. near: what is within an edge of f, at least. A narrower question than
   that of qw_flip_degree, which is on the safe side. */
bool qw_is_turned_over(const qw_untangling *u, float edge, uint32_t f, qw_near *near);
bool qw_is_opposed(const qw_untangling *u, uint32_t f);

/* The faces with those that were flipped when asked last in front, as most often they still are; returns how many those
 * are. was_flipped: uint8_t of all faces; order: uint32_t[count]. */
uint32_t qw_flipped_first(const uint32_t *faces, uint32_t count, const uint8_t *was_flipped, uint32_t *order);

/* A quad is flipped when most of it opposes the surface nearest to it and nothing of the surface within an edge length
   agrees with it. Returns how many are left. */
uint32_t qw_untangle_quads(qw_env *env, const qw_untangling *u);

#endif
