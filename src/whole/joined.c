#include "whole/joined.h"

#include "whole/kept_rims.h"

#include <assert.h>
#include <string.h>

/* Where each element of the joined mesh comes from. */
typedef struct sources {
    uint32_t quad_corners, quads;
    uint32_t *quad_vertex;   /* uint32_t[joined vertices]: of the finished quads, or QW_NONE */
    uint32_t *input_vertex;  /* uint32_t[joined vertices]: of a polygon that was left out, or QW_NONE */
    uint32_t *vertex_corner; /* uint32_t[joined vertices]: that corner of the input */
    uint32_t *input_corner;  /* uint32_t[joined corners - quad_corners] */
    uint32_t *input_face;    /* uint32_t[joined faces - quads] */
} sources;

static uint32_t *all_none(qw_env *env, uint32_t count)
{
    uint32_t *a = QW_NEW(env, uint32_t, count);
    memset(a, 0xff, count * sizeof *a);
    return a;
}

/* For each element of the joined mesh the one of the quads or of the input that it was. */
static sources find_sources(const qw_run_state *run)
{
    const qw_joined *j = &run->joined;
    const qw_clean_input *in = run->whole.input;
    qw_outside o = qw_list_outside(run);
    sources s = {.quad_corners = 4 * run->finished.face_count, .quads = run->finished.face_count};
    s.quad_vertex = all_none(run->env, j->vertex_count), s.input_vertex = all_none(run->env, j->vertex_count);
    s.vertex_corner = all_none(run->env, j->vertex_count);
    s.input_corner = all_none(run->env, j->corner_count - s.quad_corners);
    s.input_face = all_none(run->env, j->face_count - s.quads);
    for (uint32_t h = 0; h < s.quad_corners; h++) s.quad_vertex[j->corner[h]] = run->finished.corner[h];
    for (uint32_t f = 0; f < o.face_count; f++) s.input_face[f] = o.source[f];
    for (uint32_t i = 0; i < o.face_begin[o.face_count]; i++) {
        uint32_t v = j->corner[s.quad_corners + i];
        s.input_corner[i] = o.origin[i];
        if (s.input_vertex[v] == QW_NONE) s.input_vertex[v] = in->corner[o.origin[i]], s.vertex_corner[v] = o.origin[i];
    }
    return s;
}

static void free_sources(qw_env *env, const sources *s)
{
    qw_free(env, s->quad_vertex), qw_free(env, s->input_vertex), qw_free(env, s->vertex_corner);
    qw_free(env, s->input_corner), qw_free(env, s->input_face);
}

/* ---- provenance */

/* The polygon of each corner of the input. */
static uint32_t face_of(const qw_clean_input *in, uint32_t corner)
{
    uint32_t low = 0, high = in->face_count - 1;
    while (low < high) {
        uint32_t middle = (low + high + 1) / 2;
        if (in->face_begin[middle] <= corner) low = middle;
        else high = middle - 1;
    }
    return low;
}

static qw_origin origin_at(const qw_clean_input *in, uint32_t corner)
{
    uint32_t f = face_of(in, corner), n = in->face_begin[f + 1] - in->face_begin[f], i = corner - in->face_begin[f];
    return (qw_origin){f, {i, (i + 1) % n, (i + 2) % n}, {1, 0, 0}};
}

void qw_join_provenance(const qw_run_state *run, qw_provenance *p)
{
    const qw_joined *j = &run->joined;
    sources s = find_sources(run);
    qw_origin *vertex = QW_NEW(run->env, qw_origin, j->vertex_count),
              *corner = QW_NEW(run->env, qw_origin, j->corner_count);
    p->lost_vertices = 0;
    for (uint32_t v = 0; v < j->vertex_count; v++) {
        assert(s.vertex_corner[v] != QW_NONE || s.quad_vertex[v] != QW_NONE);
        vertex[v] = s.vertex_corner[v] != QW_NONE ? origin_at(run->whole.input, s.vertex_corner[v])
                                                  : p->vertices[s.quad_vertex[v]];
        p->lost_vertices += vertex[v].face == QW_NO_FACE;
    }
    memcpy(corner, p->corners, s.quad_corners * sizeof *corner);
    for (uint32_t c = s.quad_corners; c < j->corner_count; c++)
        corner[c] = origin_at(run->whole.input, s.input_corner[c - s.quad_corners]);
    p->vertices = vertex, p->corners = corner;
    p->vertex_count = j->vertex_count, p->corner_count = j->corner_count;
    free_sources(run->env, &s);
}

/* ---- attributes */

/* Element e of the joined attribute: of the quads' (QW_NONE: not from there) and of the input's. */
typedef struct element {
    uint32_t of_quads, of_input;
} element;

/* Where element e of the joined mesh comes from: one of the quads, or one of the input. */
static element element_of(const qw_run_state *run, const sources *s, qw_domain domain, qw_domain in_input, uint32_t e)
{
    if (domain == QW_PER_VERTEX)
        return s->input_vertex[e] != QW_NONE ? (element){QW_NONE, s->input_vertex[e]}
                                             : (element){s->quad_vertex[e], QW_NONE};
    if (domain == QW_PER_FACE)
        return e < s->quads ? (element){e, QW_NONE} : (element){QW_NONE, s->input_face[e - s->quads]};
    if (e < s->quad_corners) return (element){e, QW_NONE};
    uint32_t corner = s->input_corner[e - s->quad_corners];
    return (element){QW_NONE, in_input == QW_PER_CORNER ? corner : run->whole.input->corner[corner]};
}

/* The `wanted` largest of the input's weights, 1 together. */
static void take_weights(const qw_attribute *in, uint32_t e, uint32_t wanted, float *value, uint32_t *group)
{
    uint8_t taken[QW_MOST_COMPONENTS] = {0};
    double sum = 0;
    assert(in->components <= QW_MOST_COMPONENTS);
    for (uint32_t k = 0; k < wanted; k++) {
        uint32_t best = QW_NONE;
        for (uint32_t i = 0; i < in->components; i++)
            if (!taken[i] && (best == QW_NONE || in->values[(size_t)e * in->components + i] >
                                                     in->values[(size_t)e * in->components + best]))
                best = i;
        value[k] = best == QW_NONE ? 0 : in->values[(size_t)e * in->components + best];
        group[k] = best == QW_NONE ? 0 : in->group[(size_t)e * in->components + best];
        if (best != QW_NONE) taken[best] = 1;
        sum += (double)value[k];
    }
    for (uint32_t k = 0; k < wanted && sum > 0; k++) value[k] = (float)((double)value[k] / sum);
}

/* One attribute of the joined mesh, out of that of the quads and that of the input. */
static void join_one(const qw_run_state *run, const sources *s, const qw_attribute *in, qw_attribute *a)
{
    assert(a->components > 0);
    const qw_joined *j = &run->joined;
    uint32_t n = a->components, count = a->domain == QW_PER_VERTEX   ? j->vertex_count
                                        : a->domain == QW_PER_CORNER ? j->corner_count
                                                                     : j->face_count;
    float *value = a->values ? QW_NEW(run->env, float, (size_t)count *n) : NULL;
    uint32_t *group = a->group ? QW_NEW(run->env, uint32_t, (size_t)count * n) : NULL;
    int32_t *label = a->labels ? QW_NEW(run->env, int32_t, count) : NULL;
    for (uint32_t e = 0; e < count; e++) {
        element from = element_of(run, s, a->domain, in->domain, e);
        bool quads = from.of_quads != QW_NONE;
        if (label) label[e] = quads ? a->labels[from.of_quads] : in->labels[from.of_input];
        else if (group && !quads) take_weights(in, from.of_input, n, value + (size_t)e * n, group + (size_t)e * n);
        else
            for (uint32_t k = 0; k < n; k++) {
                value[(size_t)e * n + k] = quads ? a->values[(size_t)from.of_quads * n + k]
                                                 : in->values[(size_t)from.of_input * n + k];
                if (group) group[(size_t)e * n + k] = a->group[(size_t)from.of_quads * n + k];
            }
    }
    a->count = count, a->values = value, a->group = group, a->labels = label;
}

void qw_join_attributes(const qw_run_state *run, const qw_attribute *attributes, uint32_t count, qw_attribute *joined)
{
    sources s = find_sources(run);
    for (uint32_t i = 0; i < count; i++) join_one(run, &s, &attributes[i], &joined[i]);
    free_sources(run->env, &s);
}
