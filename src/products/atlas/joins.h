/* Joins pairs of charts along the seams between them. The pair that loses most of its border is joined first. */
#pragma once

#include "products/atlas/flat.h"

/* A chart that another cannot be joined to. */
typedef struct qw_refusal {
    uint32_t chart;
    uint32_t faces; /* of both: as long as they have so many nothing is different; 0: it may be worth it another time */
} qw_refusal;

typedef struct qw_chart {
    uint32_t *face; /* uint32_t[count] */
    uint32_t count;
    double perimeter;           /* in space */
    double box;                 /* area of the rectangle around it, along its rows */
    uint32_t stamp;             /* how often it has changed */
    uint32_t into;              /* the chart that it was joined to; itself while it is one */
    struct qw_refusal *refused; /* qw_refusal[refusals] */
    uint32_t refusals;
    size_t room;   /* for refusals */
    bool is_loose; /* what is left of a chart that is shared out among its neighbours */
    bool is_stub;  /* a face without an area of its own, laid as a regular polygon */
} qw_chart;

typedef struct qw_charts_made {
    qw_chart *chart; /* qw_chart[count]: those that remain, numbered by their first faces */
    uint32_t count, patches, joins, tries;
    double (*uv)[2]; /* double[corner_count][2]: of each corner within its chart, lengths those in space */
} qw_charts_made;

/* What charts that are joined must be like. */
typedef struct qw_join_bounds {
    double most_stretch; /* in the mean */
    double most_of_one;  /* a triangle may be stretched so much more than that */
    double waste;     /* in roots of the surface's area, the seams that have to go for all of that area around charts */
    double longest;   /* side of the rectangle around a chart */
    bool only_crumbs; /* of two charts one has to be a crumb */
    bool only_loose;  /* one has to be loose */
} qw_join_bounds;

typedef struct qw_join_candidate {
    double key; /* larger: sooner */
    uint32_t a, b, stamp_a, stamp_b;
    uint32_t first, length; /* seams of a: from this one on along its boundary */
} qw_join_candidate;

typedef struct qw_joiner {
    qw_env *env;
    qw_atlas_mesh *m;
    qw_charts_made made;
    uint32_t *chart_of;     /* uint32_t[face_count] */
    uint32_t *local;        /* uint32_t[corner_count] */
    const double *weight;   /* may be NULL */
    const uint32_t *mirror; /* may be NULL */
    qw_join_bounds bounds;
    double total;     /* area of the surface */
    bool lacks_worth; /* the last candidate may be laid flat where room is worth less */
    /* whether what a join made, one chart or two that lie opposite, is wanted; NULL: all of it is */
    bool (*suits)(struct qw_joiner *joiner, uint32_t a, uint32_t b);
    void *user;         /* of that */
    int64_t looks_left; /* it is asked until it has looked at so many charts */
    qw_join_candidate *heap;
    uint32_t held;
    size_t capacity;
} qw_joiner;

/* Joins charts as long as any can be. */
void qw_join_charts(qw_joiner *joiner);

/* What seam c costs, both sides once: its length, more where it is seen. */
double qw_seam_cost(const qw_joiner *joiner, uint32_t c);
/* The chart's size along its rows, as it lies: double[2]. */
void qw_chart_size(const qw_joiner *joiner, const qw_chart *chart, double size[2]);
double qw_chart_perimeter(const qw_joiner *joiner, const qw_chart *chart);
/* The chart that lies opposite to one, face by face; QW_NONE: there is none. */
uint32_t qw_chart_opposite(const qw_joiner *joiner, uint32_t chart);
/* Whether that is beyond the bound. */
bool qw_is_too_long(const qw_joiner *joiner, const double size[2]);
/* Whether a chart that was laid flat covers no point twice. */
bool qw_covers_once(const qw_joiner *joiner, const qw_flat *flat);
/* And is stretched within the bounds. */
bool qw_lies_fair(const qw_joiner *joiner, const qw_flat *flat);
