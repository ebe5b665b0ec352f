/* The base complex and the chords of the quads of a polygon mesh.
 *
 * A vertex is special where its valence differs from that of a regular grid: other than four quads inside, other than
 * two on a boundary. From each special vertex a line leaves along every edge and goes straight on until it meets
 * another special vertex or a boundary. These lines and the boundaries cut the quads into patches, each a regular grid:
 * the base complex (Bommes et al. 2011). Marked edges (creases) are lines too, and vertices where they end, turn or
 * cross are special, as in patches for CAD (products/limit/patch_blocks.h). A chord is a strip of quads, side by side,
 * each entered and left through opposite edges; it ends at boundaries or closes, and may cross itself.
 *
 * Half-edge 4 q + i leaves corner i of the q-th quad; direction i & 1 of a quad crosses its edges i and i + 2.
 */
#pragma once

#include "geometry/polygons.h"

typedef struct qw_base_complex {
    uint32_t quads;       /* faces with four corners; the other faces count as holes */
    uint32_t *face;       /* uint32_t[quads]: of the mesh */
    uint32_t *corner;     /* uint32_t[4 quads]: vertex */
    uint32_t *twin;       /* uint32_t[4 quads]: the half-edge across, or QW_NONE: boundary, more than two quads, or two
                             that lie opposite ways round */
    uint8_t *line;        /* uint8_t[4 quads]: 1 on lines and boundaries */
    uint32_t patches;     /* faces of the base complex */
    uint32_t chord_count; /* chords are numbered by falling length, those first that cross themselves; equal ones by
                             their first quad */
    uint32_t *chord;      /* uint32_t[2 quads]: chord of each direction of each quad */
    uint32_t *length;     /* uint32_t[chord_count]: quads, those twice where the chord crosses itself */
    uint32_t crossing;    /* chords that cross themselves: chords 0 .. crossing - 1 */
} qw_base_complex;

/* edges: of the mesh. The arrays belong to the current scope. Takes time in proportion to the quads. */
qw_base_complex qw_find_base_complex(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges);

/* Share of the area of the quads, each counted once for either of its chords, in chords that never cross themselves (an
   entry of the score of SQuadGen, ACM TOG 45(4), 2026). Spirals are what is left. */
double qw_simple_share(const qw_base_complex *complex, const qw_mesh_view *mesh);
