/* The mesh that is unwrapped, and the edges at which it is cut: the seams. Half-edge c leaves corner c of its polygon.
 *
 * Charts are what the seams leave connected. They are kept disks: cutting begins from patches that are disks, and two
 * charts are joined along one connected path of their boundaries.
 */
#pragma once

#include "base/env.h"

/* Rings only cut patches. Sharp edges may be folded where they bound charts of a few faces. */
enum qw_wall { QW_WALL_RING = 1, QW_WALL_SHARP = 2, QW_WALL_BORDER = 4 };

typedef struct qw_atlas_mesh {
    uint32_t vertex_count, face_count, corner_count;
    const double *position; /* double[vertex_count][3] */
    double least;           /* triangles are laid as if they were no thinner; 0: none are */
    const uint32_t *begin;  /* uint32_t[face_count + 1]: corners of face f are begin[f] .. begin[f + 1] - 1 */
    const uint32_t *corner; /* uint32_t[corner_count]: vertex */
    uint32_t *face;         /* uint32_t[corner_count]: polygon of each corner */
    uint32_t *twin;         /* uint32_t[corner_count]: half-edge across, or QW_NONE */
    uint8_t *wall;          /* uint8_t[corner_count]: qw_wall of edges that begin as seams, or 0 */
    uint8_t *seam;          /* uint8_t[corner_count]: 1 on seams, both half-edges; boundaries are seams */
} qw_atlas_mesh;

/* corners: of faces one after the other. face_sizes: NULL: quads. mark: uint8_t[mark_count], of the first half-edges:
   QW_MARK_ bits; may be NULL. label: uint32_t[face_count]: edges between faces of unlike labels stay seams;
   may be NULL. All arrays but position and corner are of the caller's scope. */
qw_atlas_mesh qw_atlas_mesh_of(qw_env *env, const qw_mesh_view *view, const uint8_t *mark, uint32_t mark_count,
                               const int32_t *label);

static inline uint32_t qw_atlas_next(const qw_atlas_mesh *m, uint32_t c)
{
    uint32_t f = m->face[c];
    return c + 1 == m->begin[f + 1] ? m->begin[f] : c + 1;
}
static inline uint32_t qw_atlas_prev(const qw_atlas_mesh *m, uint32_t c)
{
    uint32_t f = m->face[c];
    return c == m->begin[f] ? m->begin[f + 1] - 1 : c - 1;
}
/* The corner of the same vertex one polygon on, counter-clockwise and clockwise; QW_NONE across a boundary. */
static inline uint32_t qw_atlas_turn(const qw_atlas_mesh *m, uint32_t c) { return m->twin[qw_atlas_prev(m, c)]; }
static inline uint32_t qw_atlas_turn_back(const qw_atlas_mesh *m, uint32_t c)
{
    return m->twin[c] == QW_NONE ? QW_NONE : qw_atlas_next(m, m->twin[c]);
}
/* The seam that follows a seam on the boundary of its chart. */
static inline uint32_t qw_next_seam(const qw_atlas_mesh *m, uint32_t c)
{
    for (c = qw_atlas_next(m, c); !m->seam[c];) c = qw_atlas_next(m, m->twin[c]);
    return c;
}
static inline void qw_set_seam(const qw_atlas_mesh *m, uint32_t c, uint8_t is_seam)
{
    m->seam[c] = is_seam;
    if (m->twin[c] != QW_NONE) m->seam[m->twin[c]] = is_seam;
}
double qw_atlas_edge_length(const qw_atlas_mesh *m, uint32_t c);

/* Of all seams, boundaries of the mesh left out. */
double qw_seam_length(const qw_atlas_mesh *m);

/* Cuts the mesh into patches: lines leave irregular vertices, ends and corners of walls along every edge and go
   straight on until they meet another line or a wall (the motorcycle graph: Eppstein et al. 2008). Every patch is a
   disk. Sets the seams. */
void qw_cut_patches(qw_env *env, qw_atlas_mesh *mesh);

/* Chart of each face and their number: uint32_t[face_count], numbered by their first faces. */
uint32_t *qw_label_charts(qw_env *env, const qw_atlas_mesh *mesh, uint32_t *count);

/* Cuts a patch in two or four by lines from a vertex in its middle, or across. false: it is a single face. */
bool qw_split_patch(qw_env *env, qw_atlas_mesh *mesh, const uint32_t *face, uint32_t count);
