/* Charts: patches joined, one pair after the other, as long as what they make lies flat with little stretch. First to
 * compact ones, then to ever larger ones of any shape; the largest that pack well enough are taken. */
#ifndef QW_PRODUCTS_ATLAS_CHARTS_H
#define QW_PRODUCTS_ATLAS_CHARTS_H

#include "products/atlas/flat.h"

typedef struct qw_chart {
    uint32_t *face; /* uint32_t[count] */
    uint32_t count;
    double area;       /* in space */
    double perimeter;  /* in space */
    uint32_t stamp;    /* how often it has changed */
    uint32_t into;     /* the chart that it was joined to; itself while it is one */
    uint32_t *refused; /* uint32_t[refusals]: charts that it cannot be joined to */
    uint32_t refusals;
    size_t room;  /* for refusals */
    bool is_stub; /* a face without an area of its own, laid as a regular polygon */
} qw_chart;

typedef struct qw_charts_made {
    qw_chart *chart; /* qw_chart[count]: those that remain, numbered by their first faces */
    uint32_t count, patches, joins, tries;
    double (*uv)[2]; /* double[corner_count][2]: of each corner within its chart, lengths those in space */
} qw_charts_made;

/* Whether charts fill enough of the square. */
typedef bool qw_chart_judge(void *user, const qw_charts_made *made);

/* most_stretch: bound of the mean of the larger of s1 and 1 / s2 over a chart (flat.h). weight: double[corner_count]:
   how much a seam along each edge is to be avoided, 1 in the mean; may be NULL. mirror: uint32_t[corner_count]:
   half-edges that lie opposite to one another on a symmetric surface, or QW_NONE: charts are joined on both sides or
   on neither; may be NULL. judge: may be NULL: compact charts. In
   the caller's scope; sets the seams of the mesh. */
qw_charts_made qw_make_charts(qw_env *env, qw_atlas_mesh *mesh, double most_stretch, const double *weight,
                              const uint32_t *mirror, qw_chart_judge *judge, void *user);

#endif
