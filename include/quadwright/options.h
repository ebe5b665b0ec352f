/* Made of options.def by tools/options-header: make docs. */
#ifndef QUADWRIGHT_OPTIONS_H
#define QUADWRIGHT_OPTIONS_H

#include <stdint.h>

/* clang-format off */

/* ---- values of choices */

typedef enum qw_flow_choice {
    QW_FLOW_MF,
    QW_FLOW_MF_MR,
    QW_FLOW_MCF,
    QW_FLOW_MCF_MR,
    QW_FLOW_ILP,
    QW_FLOW_CLOSED
} qw_flow_choice;

typedef enum qw_cost_choice {
    QW_COST_PLAIN,
    QW_COST_GEOMETRIC
} qw_cost_choice;

typedef enum qw_symmetry_choice {
    QW_SYMMETRY_NONE,
    QW_SYMMETRY_AUTO,
    QW_SYMMETRY_X,
    QW_SYMMETRY_Y,
    QW_SYMMETRY_Z,
    QW_SYMMETRY_PLANE,
    QW_SYMMETRY_ANY
} qw_symmetry_choice;

typedef enum qw_fit_to_choice {
    QW_FIT_TO_QUADS,
    QW_FIT_TO_LIMIT
} qw_fit_to_choice;

typedef enum qw_region_rim_choice {
    QW_REGION_RIM_KEEP,
    QW_REGION_RIM_FREE
} qw_region_rim_choice;

typedef enum qw_fast_choice {
    QW_FAST_NO,
    QW_FAST_DRAFT,
    QW_FAST_PREVIEW
} qw_fast_choice;

/* ---- the options; qw_options_init sets the defaults */

typedef struct qw_options {
    /* sizeof(qw_options), set by qw_options_init; guards against a mismatched library */
    uint32_t size;
    /* number of quads wanted (0: not asked for); 0 to 20000000 faces, 0 by default */
    int64_t faces;
    /* number of vertices wanted (0: not asked for); 0 to 20000000 vertices, 0 by default */
    int64_t vertices;
    /* mean edge length wanted (0: not asked for); 0.0 to 1e300 input units, 0.0 by default */
    double edge_length;
    /* number of quads as a share of the input triangles (0: not asked for); 0.0 to 100.0 quads per input
       triangle, 0.0 by default */
    double ratio;
    /* drop components that have less than this share of the whole area, but never the largest (0: keep all);
       0.0 to 1.0 share of the area, 0.0 by default */
    double min_component;
    /* turn closed components that are inside out outward, unless all are or it is a cavity in another; off
       keeps them as they are; 1 by default */
    int32_t outward;
    /* an edge is sharp where its faces' normals differ by more than this; -1 finds a suitable angle, 180 finds
       none; -1.0 to 180.0 degrees, -1.0 by default */
    double sharp_angle;
    /* only the edges that the input marks are sharp, whatever their angle: in OBJ lines and the borders of
       smoothing groups and materials; 0 by default */
    int32_t sharp_marks;
    /* edges of the result follow the boundary of an open surface; 1 by default */
    int32_t align_boundary;
    /* how much quads differ in size: 0 not at all, 0.5 smaller where the surface bends, on limbs and between
       close sharp edges, 1 as people have them: small where there is much to see; the number of quads stays;
       0.0 to 1.0, 0.5 by default */
    double adaptive;
    /* closed rings of quads around the necks of what sticks out or in (fingers, limbs, ears, sockets, mouths),
       where six quads fit around: 0 around none, 0.5 around the clearest, to 1 around all that are found; 0.0
       to 1.0, 0.5 by default */
    double rings;
    /* where the input has skin weights or morph targets, how much rows run along the lines on which these are
       equal, with smaller quads where they change: 0 not at all; 0.0 to 1.0, 0.5 by default */
    double follow_motion;
    /* how much the quads run along the directions in which the surface bends most and least: 0 gives the fewest
       irregular vertices, 1 follows the shape most; 0.0 to 1.0, 0.5 by default */
    double follow;
    /* relief smaller than this (three quarters of it below 250 quads) does not steer the quads: less follows
       more of it, more gives fewer irregular vertices; 0.0 to 10.0 edge lengths, 2.0 by default */
    double smoothness;
    /* how offsets become regular: from the position field by a solver of the paper's Table 4, or from the
       closest closed real offsets; QW_FLOW_CLOSED by default */
    int32_t flow;
    /* what a change of an offset costs the flow: 1, as in the paper, or more against the edge than along it;
       QW_COST_GEOMETRIC by default */
    int32_t cost;
    /* use the SAT solver where greedy shrinking leaves inverted triangles; 1 by default */
    int32_t sat;
    /* relax the quads on the input surface at the end; 1 by default */
    int32_t relax;
    /* what the relaxation weighs more: right angles at 0, even areas at 1; 0.0 to 1.0, 0.5 by default */
    double evenness;
    /* repair and simplify the connectivity of the quads after extraction; 1 by default */
    int32_t repair;
    /* seed of every random choice; 0 to 2147483647, 0 by default */
    int64_t seed;
    /* threads to use (0: one a processor that the process may run on); never changes the result; 0 to 256
       threads, 0 by default */
    int64_t threads;
    /* the edges that the input marks are sharp too, beside those found by their angle; 0 by default */
    int32_t keep_marks;
    /* both sides of a plane alike: auto finds the plane where that costs nothing, of a nearly symmetric surface
       that has nothing narrow or pointed on the plane and is steered on both sides alike, or where there is
       none, the planes of single components; any takes one of other surfaces too; x, y and z are across an
       axis, where the surface is most nearly symmetric; QW_SYMMETRY_AUTO by default */
    int32_t symmetry;
    /* each side follows its own surface: only the connectivity is symmetric; auto and any do so by themselves
       where the sides differ; 0 by default */
    int32_t symmetry_follow;
    /* normal of the plane, x; -1e300 to 1e300, 0.0 by default */
    double symmetry_x;
    /* normal of the plane, y; -1e300 to 1e300, 0.0 by default */
    double symmetry_y;
    /* normal of the plane, z; -1e300 to 1e300, 0.0 by default */
    double symmetry_z;
    /* the plane's points p have normal . p = this; -1e300 to 1e300 input units times the normal's length, 0.0
       by default */
    double symmetry_offset;
    /* how much irregular vertices are placed so that the lines that leave them meet, which makes loops of edges
       shorter and patches fewer: 0 not at all, 1 whatever it costs; 0.0 to 1.0, 0.5 by default */
    double loops;
    /* the vertices of the boundary stay exactly as they are, and no others are added there: what was cut out of
       a mesh can be sewn back; 0 by default */
    int32_t fix_boundary;
    /* how far vertices may leave the surface so that the quads lie as near to it as they can: 0 not at all, 1
       to where the distance is least; on sharp edges and boundaries they stay; 0.0 to 1.0, 1.0 by default */
    double fit;
    /* what lies near the surface: the quads themselves, or the surface that Catmull and Clark's subdivision
       makes of them, with sharp edges and boundaries as creases: --fit limit; QW_FIT_TO_QUADS by default */
    int32_t fit_to;
    /* vertices of a designed part lie on its planes, cylinders and cones themselves, not on the triangles that
       stand for them; circles have equal edges, rows run straight along the axes; 1 by default */
    int32_t exact;
    /* move vertices of quads whose scaled Jacobian, the least sine of their corners, is below this, on the
       surface and along sharp edges; where it stays below the report says how often (0: not asked for; solvers
       want 0.3); 0.0 to 0.9, 0.0 by default */
    double jacobian_min;
    /* split each quad in four that often, by Catmull and Clark's rule, and put the vertices on the surface:
       there are exactly 4, 16, 64, ... times as many quads as were made for the number asked for; 0 to 6 times,
       0 by default */
    int64_t subdivide;
    /* the rim between a region and the rest: keep leaves it as it is; free gives it vertices as far apart as
       the quads are long, and splits or joins the triangles around it to fit; QW_REGION_RIM_KEEP by default */
    int32_t region_rim;
    /* close holes: boundary loops of at most so many edges get a smooth patch; what is longer stays open (0:
       none); 0 to 1000000 edges, 0 by default */
    int64_t fill_holes;
    /* wrap the input first: one closed skin about all that lies together, for soups of parts that cross one
       another, with gaps, holes and fragments; inner parts vanish. A value says which gaps are closed: narrower
       than a share of the diagonal, 0.02, or than so many mean edges of the quads, 0.5q; 0 by default */
    int32_t wrap;
    /* with wrap, as its value sets it: gaps and holes narrower than this are closed; 0: wrap_quads says which;
       0.0 to 0.5 diagonals, 0.0 by default */
    double wrap_distance;
    /* with wrap and no wrap_distance, as the value of wrap sets it: gaps and holes narrower than so many mean
       edges of the quads are closed; 0.05 to 100.0 mean edges, 1.0 by default */
    double wrap_quads;
    /* what is left out for a quick answer: draft makes no lines meet and does not go back to what few quads
       cover badly; preview also makes quads of one size that do not follow the shape; QW_FAST_NO by default */
    int32_t fast;
    /* at least so many edges around each full circle: the rims of holes and bosses, and of the surface where it
       bends, on fillets and cylinders; within the number of quads (0: not asked for); 0 to 1000 edges, 0 by
       default */
    int64_t around;
} qw_options;

/* clang-format on */

#endif
