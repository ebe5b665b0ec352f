/* Charts: what seams bound. A seam is an edge of the input at which the texture coordinates of its two faces differ by
 * more than rounding, or that has one face or more than two. */
#pragma once

#include "products/attributes/provenance.h"

typedef struct qw_charts {
    uint32_t *across; /* uint32_t[3 triangles]: triangle beyond each half-edge of the source, QW_NONE at seams */
    uint32_t *chart;  /* uint32_t[triangles] */
    uint32_t count;
} qw_charts;

/* Triangle beyond each half-edge of the source where it has just one, else QW_NONE; vertices at equal positions count
   as one. uint32_t[3 triangles], half-edges. */
uint32_t *qw_find_neighbours(qw_env *env, const qw_source *source);
qw_charts qw_find_charts(qw_env *env, const qw_source *source, const uint32_t *neighbour, const qw_attribute *uv);

/* The source points from which the corners of the quads take their texture coordinates: [4 quads->face_count]. All
   corners of a quad take theirs from one side of every seam: from that on which most of the quad's area lies, and there
   from the nearest point. *straddling: quads that have more than a tenth of their area beyond. */
qw_source_point *qw_choose_charts(qw_env *env, const qw_source *source, const qw_charts *charts,
                                  const qw_quadmesh *quads, const qw_origins *origins, uint32_t *straddling);

/* Point (i, j) of a grid of QW_SAMPLES x QW_SAMPLES over a quad, in the middle of its cell, and what is nearest to it
   as of qw_find_origins: a triangle of the source, or QW_NONE. cache: of qw_fill_cache. */
enum { QW_SAMPLES = 8 };
uint32_t qw_sample_quad(const qw_source *source, const qw_quadmesh *quads, const qw_origins *origins, uint32_t f,
                        uint32_t i, uint32_t j, uint32_t hint, const qw_bvh_cache *cache);

/* The number among all elements of the attribute's domain that corner k of a triangle of the source has. */
static inline size_t qw_element_of(const qw_source *source, qw_domain domain, uint32_t triangle, uint32_t k)
{
    uint32_t corner = source->corner[3 * (size_t)triangle + k];
    return domain == QW_PER_CORNER ? corner
           : domain == QW_PER_FACE ? source->face[triangle]
                                   : source->input->corner[corner];
}
