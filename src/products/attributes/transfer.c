#include "products/attributes/transfer.h"

#include "base/constants.h"
#include "base/sort.h"
#include "base/mesh_view.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    MOST_PARCELS = 16, /* elements that one is blended of: three corners, or neighbours */
    MOST_PAIRS = MOST_PARCELS * QW_MOST_COMPONENTS,
    SAMPLES = QW_SAMPLES * QW_SAMPLES
};
#define NOT_SAMPLED (QW_NONE - 1)

/* As a share of the quad's size in the texture: a corner looks so far into its quad for its triangle. */
static const float NEARLY_SAME = 0.01f;

/* The samples that do for the mean of numbers of faces: one in each row and each column of the grid, and the same from
 * all four sides, so that their mean lies in the middle. */
static const uint8_t COLUMN_OF_ROW[QW_SAMPLES] = {2, 4, 7, 1, 6, 0, 3, 5};

/* One attribute on its way. */
typedef struct carriage {
    qw_env *env;
    const qw_source *source;
    const qw_quadmesh *quads;
    const qw_origins *origins;
    const qw_attribute *in;
    qw_attribute out; /* its arrays are written through the next three */
    float *values;
    uint32_t *group;
    int32_t *labels;
    uint8_t *known; /* uint8_t[out.count] */
    uint32_t dropped;
    uint32_t *sample; /* uint32_t[quads->face_count][SAMPLES]: triangles, or NOT_SAMPLED; of all attributes */
} carriage;

/* An element, of the input or of the result, and how much it counts. */
typedef struct parcel {
    const qw_attribute *of;
    size_t element;
    float weight;
} parcel;

/* ---- blending */

typedef struct pair {
    uint32_t group;
    float weight;
} pair;

/* Adds up the weights of all parcels by group. Returns the number of pairs, sorted from the largest weight down. */
static uint32_t gather_pairs(const parcel *p, uint32_t count, pair *pairs)
{
    assert(p && pairs);
    uint32_t n = 0;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = 0; k < p[i].of->components; k++) {
            size_t at = p[i].element * p[i].of->components + k;
            pair new = {p[i].of->group[at], p[i].weight * p[i].of->values[at]};
            uint32_t j = 0;
            while (j < n && pairs[j].group != new.group) j++;
            if (!(new.weight > 0)) continue;
            if (j < n) pairs[j].weight += new.weight;
            else pairs[n++] = new;
        }
    for (uint32_t i = 1; i < n; i++) {
        pair moved = pairs[i];
        uint32_t j = i;
        for (; j > 0 && (pairs[j - 1].weight < moved.weight ||
                         (pairs[j - 1].weight == moved.weight && pairs[j - 1].group > moved.group));
             j--)
            pairs[j] = pairs[j - 1];
        pairs[j] = moved;
    }
    return n;
}

/* Weights of an element as a mean of those of its parcels: the largest, as many as there is room for, their sum
   one. Whether there are any. */
static bool blend_weights(carriage *c, size_t element, const parcel *p, uint32_t count)
{
    pair pairs[MOST_PAIRS];
    uint32_t n = gather_pairs(p, count, pairs), most = c->out.components;
    float sum = 0;
    c->dropped += n > most ? n - most : 0;
    for (uint32_t k = 0; k < most && k < n; k++) sum += pairs[k].weight;
    for (uint32_t k = 0; k < most; k++) {
        size_t at = element * most + k;
        c->group[at] = k < n ? pairs[k].group : 0;
        c->values[at] = k < n && sum > 0 ? pairs[k].weight / sum : 0;
    }
    return n > 0;
}

/* Writes an element; false where the parcels say nothing. */
static bool blend(carriage *c, size_t element, const parcel *p, uint32_t count)
{
    uint32_t components = c->out.components;
    if (count == 0) return false;
    if (c->in->kind == QW_WEIGHTS) return blend_weights(c, element, p, count);
    if (c->in->kind == QW_LABELS) {
        uint32_t best = 0;
        for (uint32_t i = 1; i < count; i++)
            if (p[i].weight > p[best].weight) best = i;
        c->labels[element] = p[best].of->labels[p[best].element];
        return true;
    }
    float sum = 0;
    for (uint32_t i = 0; i < count; i++) sum += p[i].weight;
    for (uint32_t k = 0; k < components; k++) {
        /* by differences, so that what is the same at all of them stays so to the last bit */
        float first = p[0].of->values[p[0].element * components + k], value = first;
        for (uint32_t i = 1; i < count; i++)
            value += p[i].weight / sum * (p[i].of->values[p[i].element * components + k] - first);
        c->values[element * components + k] = value;
    }
    return true;
}

static bool blend_at(carriage *c, size_t element, const qw_source_point *point)
{
    parcel p[3];
    if (point->triangle == QW_NONE) return false;
    for (uint32_t k = 0; k < 3; k++)
        p[k] = (parcel){c->in, qw_element_of(c->source, c->in->domain, point->triangle, k), point->weight[k]};
    return blend(c, element, p, 3);
}

/* ---- faces */

typedef struct share {
    const qw_attribute *of;
    uint32_t face, samples;
} share;

static bool is_same(const share *a, uint32_t face)
{
    return a->of->kind == QW_LABELS ? a->of->labels[a->face] == a->of->labels[face] : a->face == face;
}

static uint32_t add_sample(const qw_attribute *of, share *shares, uint32_t count, uint32_t face)
{
    for (uint32_t i = 0; i < count; i++)
        if (is_same(&shares[i], face)) {
            shares[i].samples++;
            return count;
        }
    if (count < MOST_PARCELS) shares[count++] = (share){of, face, 1};
    return count;
}

/* The shares of all samples of a quad, or of those that do for numbers. */
static uint32_t add_samples(carriage *c, uint32_t f, uint32_t hint, share *shares)
{
    assert(f < c->quads->face_count);
    uint32_t count = 0;
    qw_bvh_cache cache;
    bool is_filled = false, for_numbers = c->in->kind != QW_LABELS;
    for (uint32_t k = 0; k < (for_numbers ? QW_SAMPLES : SAMPLES); k++) {
        uint32_t j = for_numbers ? k : k / QW_SAMPLES, i = for_numbers ? COLUMN_OF_ROW[k] : k % QW_SAMPLES,
                 *known = c->sample + SAMPLES * (size_t)f + QW_SAMPLES * j + i;
        if (*known == NOT_SAMPLED) {
            if (!is_filled) qw_fill_cache(c->source, c->quads, f, &cache);
            is_filled = true;
            *known = qw_sample_quad(c->source, c->quads, c->origins, f, i, j, hint, &cache);
        }
        if (*known != QW_NONE) hint = *known, count = add_sample(c->in, shares, count, c->source->face[*known]);
    }
    return count;
}

/* Takes the label that all four corners lie on; where they differ, the one of most samples of the quad. */
static bool blend_face(carriage *c, uint32_t f)
{
    assert(f < c->quads->face_count);
    share shares[MOST_PARCELS];
    parcel p[MOST_PARCELS];
    uint32_t count = 0, hint = QW_NONE;
    for (size_t h = 4 * (size_t)f; h < 4 * (size_t)f + 4; h++) {
        uint32_t t = c->origins->corner[h].triangle;
        if (t != QW_NONE) hint = t, count = add_sample(c->in, shares, count, c->source->face[t]);
    }
    if (count != 1) count = add_samples(c, f, hint, shares);
    for (uint32_t i = 0; i < count; i++) p[i] = (parcel){c->in, shares[i].face, (float)shares[i].samples};
    return blend(c, f, p, count);
}

/* ---- filling in */

/* The neighbours of an element that are known. A corner asks its quad first, then the other corners of its vertex. */
static uint32_t neighbours_of(const carriage *c, size_t h, parcel *p, uint32_t count)
{
    const qw_quadmesh *q = c->quads;
    uint32_t half = (uint32_t)h, next = qw_quad_next(half), previous = qw_quad_prev(half);
    size_t near[4] = {QW_NONE, QW_NONE, QW_NONE, QW_NONE};
    if (c->out.domain == QW_PER_VERTEX) near[0] = q->corner[next], near[1] = q->corner[previous];
    if (c->out.domain == QW_PER_FACE && q->twin[h] != QW_NONE) near[0] = q->twin[h] / 4;
    if (c->out.domain == QW_PER_CORNER) {
        near[0] = next, near[1] = previous;
        if (!c->known[next] && !c->known[previous]) {
            near[0] = q->twin[h] == QW_NONE ? QW_NONE : qw_quad_next(q->twin[h]);
            near[1] = q->twin[previous];
        }
    }
    for (uint32_t i = 0; i < 2; i++)
        if (near[i] != QW_NONE && c->known[near[i]] == 1 && count < MOST_PARCELS)
            p[count++] = (parcel){&c->out, near[i], 1};
    return count;
}

static size_t element_at(const carriage *c, size_t h)
{
    return c->out.domain == QW_PER_VERTEX ? c->quads->corner[h] : c->out.domain == QW_PER_FACE ? h / 4 : h;
}

/* Fills the unknown elements that have a known neighbour, each with the blend of these. Returns how many were filled.
 * order: half-edges of unknown elements as element << 32 | half-edge, sorted, so that those of one element are
 * together.
 */
static uint32_t fill_ring(carriage *c, const uint64_t *order, size_t count)
{
    uint32_t filled = 0;
    for (size_t i = 0, end; i < count; i = end) {
        parcel p[MOST_PARCELS];
        uint32_t n = 0, element = (uint32_t)(order[i] >> 32);
        for (end = i; end < count && (uint32_t)(order[end] >> 32) == element; end++)
            n = neighbours_of(c, (uint32_t)order[end], p, n);
        if (!c->known[element] && blend(c, element, p, n)) c->known[element] = 2, filled++;
    }
    for (size_t i = 0; i < count; i++)
        if (c->known[order[i] >> 32] == 2) c->known[order[i] >> 32] = 1;
    return filled;
}

/* Components in frames of their own lie far off: farther than any point of any. */
static const float BEYOND_ALL = 1e3f;

/* What no neighbour reaches, as where nothing of a component was found, takes what is nearest, whichever way it faces.
 */
static void fill_rest(carriage *c, const uint64_t *order, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        size_t element = (size_t)(order[i] >> 32), h = (uint32_t)order[i];
        if (c->known[element]) continue;
        qw_vec3 zero = {0, 0, 0};
        qw_hit hit = qw_bvh_nearest(c->source->bvh, c->quads->position[c->quads->corner[h]], zero, -1, BEYOND_ALL,
                                    QW_NONE);
        qw_source_point point = {hit.face, {hit.weight[0], hit.weight[1], hit.weight[2]}};
        c->known[element] = 1;
        (void)blend_at(c, element, &point);
    }
}

/* Returns how many were not known. */
static uint32_t fill_in(carriage *c)
{
    size_t sides = 4 * (size_t)c->quads->face_count, count = 0;
    uint32_t missing = 0;
    for (uint32_t e = 0; e < c->out.count; e++) missing += !c->known[e];
    if (missing == 0) return 0;
    uint64_t *order = QW_NEW(c->env, uint64_t, sides);
    for (size_t h = 0; h < sides; h++)
        if (!c->known[element_at(c, h)]) order[count++] = (uint64_t)element_at(c, h) << 32 | h;
    qw_sort_u64(order, count);
    while (fill_ring(c, order, count) > 0) qw_heartbeat(c->env);
    fill_rest(c, order, count);
    qw_free(c->env, order);
    return missing;
}

/* ---- one attribute */

/* Unit length, and to the side to which the quads face. */
static void settle_normals(carriage *c)
{
    qw_vec3 *of_vertex = qw_quadmesh_vertex_normals(c->env, c->quads);
    for (size_t h = 0; h < 4 * (size_t)c->quads->face_count; h++) {
        float *v = c->values + 3 * element_at(c, h);
        qw_vec3 side = c->out.domain == QW_PER_CORNER ? qw_quad_normal(c->quads, (uint32_t)(h / 4))
                                                      : of_vertex[c->quads->corner[h]];
        qw_vec3 n = qw_normalize(qw_v3(v[0], v[1], v[2]));
        if (qw_length2(n) == 0) n = side;
        if (qw_dot(n, side) < 0) n = qw_scale(n, -1);
        v[0] = n.x, v[1] = n.y, v[2] = n.z;
    }
    qw_free(c->env, of_vertex);
}

/* Longest side of a quad in the texture, by the larger of its two differences. */
static float texture_size(const carriage *c, uint32_t f)
{
    assert(f < c->quads->face_count);
    uint32_t n = c->out.components;
    const float *first = c->values + 4 * (size_t)f * n;
    float longest = 0;
    for (uint32_t i = 0; i < 4; i++)
        for (uint32_t k = 0; k < n; k++) longest = fmaxf(longest, fabsf(first[(i + 1) % 4 * n + k] - first[i * n + k]));
    return longest;
}

/* Corners of one vertex whose texture coordinates are nearly the same take those of the first of them: they differ as
 * the vertex, off the surface, was sought in several triangles. So where the result has a seam there is one, and files
 * need not say the same twice. */
static void even_out(carriage *c)
{
    uint32_t n = c->out.components, corners = c->out.count;
    float rounding = qw_rounding_of(&c->out);
    uint32_t *last = QW_NEW(c->env, uint32_t, c->quads->vertex_count), *before = QW_NEW(c->env, uint32_t, corners);
    for (uint32_t v = 0; v < c->quads->vertex_count; v++) last[v] = QW_NONE;
    for (uint32_t h = 0; h < corners; h++) {
        float *own = c->values + (size_t)n * h, near = fmaxf(rounding, NEARLY_SAME * texture_size(c, h / 4));
        uint32_t *of_vertex = &last[c->quads->corner[h]], other = *of_vertex;
        for (; other != QW_NONE; other = before[other]) {
            const float *known = c->values + (size_t)n * other;
            uint32_t same = 0;
            while (same < n && fabsf(known[same] - own[same]) <= near) same++;
            if (same < n) continue;
            memcpy(own, known, n * sizeof *own);
            break;
        }
        if (other == QW_NONE) before[h] = *of_vertex, *of_vertex = h;
    }
    qw_free(c->env, last), qw_free(c->env, before);
}

static const char *copy_text(qw_env *env, const char *text)
{
    size_t size = strlen(text) + 1;
    return memcpy(qw_alloc(env, size, 1), text, size);
}

/* An attribute of the result like one of the input, with room for its values. */
static void begin(carriage *c, uint32_t most_weights)
{
    const qw_attribute *in = c->in;
    qw_attribute *out = &c->out;
    *out = *in;
    out->name = copy_text(c->env, in->name);
    if (in->kind == QW_UVS) out->domain = QW_PER_CORNER; /* a vertex on a seam has several */
    out->count = out->domain == QW_PER_VERTEX ? c->quads->vertex_count
                                              : c->quads->face_count * (out->domain == QW_PER_CORNER ? 4 : 1);
    if (in->kind == QW_WEIGHTS && most_weights) out->components = most_weights;
    size_t numbers = (size_t)out->count * out->components;
    if (in->kind == QW_LABELS) out->labels = c->labels = QW_NEW_ZERO(c->env, int32_t, numbers), out->values = NULL;
    else out->values = c->values = QW_NEW_ZERO(c->env, float, numbers), out->labels = NULL;
    out->group = in->kind == QW_WEIGHTS ? c->group = QW_NEW_ZERO(c->env, uint32_t, numbers) : NULL;
    const char **names = in->label_count ? QW_NEW(c->env, const char *, in->label_count) : NULL;
    for (uint32_t i = 0; i < in->label_count; i++) names[i] = copy_text(c->env, in->label_names[i]);
    out->label_names = names;
    c->known = QW_NEW_ZERO(c->env, uint8_t, out->count);
}

/* Where the corners take their texture coordinates from. */
static const qw_source_point *points_of_charts(carriage *c, uint32_t **neighbour, qw_transfer_report *report)
{
    if (!*neighbour) *neighbour = qw_find_neighbours(c->env, c->source);
    qw_charts charts = qw_find_charts(c->env, c->source, *neighbour, c->in);
    uint32_t straddling = 0;
    const qw_source_point *points = qw_choose_charts(c->env, c->source, &charts, c->quads, c->origins, &straddling);
    report->charts += charts.count, report->straddling_quads += straddling;
    qw_free(c->env, charts.across), qw_free(c->env, charts.chart);
    return points;
}

typedef struct blending {
    const carriage *carriage;
    const qw_source_point *points; /* of the elements, where they are vertices or corners */
    uint32_t *dropped;             /* one a block */
    uint32_t grain;
} blending;

static void blend_block(void *user, uint32_t begin, uint32_t end)
{
    const blending *b = user;
    carriage c = *b->carriage;
    c.dropped = 0;
    for (uint32_t e = begin; e < end; e++)
        c.known[e] = c.out.domain == QW_PER_FACE ? blend_face(&c, e) : blend_at(&c, e, &b->points[e]);
    b->dropped[begin / b->grain] = c.dropped;
}

static void blend_all(carriage *c, const qw_source_point *points)
{
    uint32_t grain = c->out.domain == QW_PER_FACE ? QW_GRAIN_HEAVY : QW_GRAIN_LIGHT,
             blocks = qw_block_count(c->out.count, grain);
    blending b = {c, points, QW_NEW(c->env, uint32_t, blocks), grain};
    qw_parallel(c->env, c->out.count, grain, blend_block, &b);
    for (uint32_t i = 0; i < blocks; i++) c->dropped += b.dropped[i];
    qw_free(c->env, b.dropped);
}

/* The values of one attribute of the result: blended where its points lie on the input, filled in from neighbours
   elsewhere. */
static void carry(carriage *c, uint32_t **neighbour, qw_transfer_report *report)
{
    const qw_source_point *points = c->out.domain == QW_PER_VERTEX ? c->origins->vertex : c->origins->corner;
    bool by_chart = c->in->kind == QW_UVS;
    if (by_chart) points = points_of_charts(c, neighbour, report);
    blend_all(c, points);
    uint32_t filled = fill_in(c);
    uint32_t *counts[] = {&report->filled_vertices, &report->filled_corners, &report->filled_faces};
    *counts[c->out.domain] += filled;
    if (c->in->kind == QW_NORMALS) settle_normals(c);
    if (by_chart) even_out(c);
    report->dropped_weights += c->dropped;
    if (by_chart) qw_free(c->env, (void *)points);
    qw_free(c->env, c->known);
}

qw_attribute *qw_transfer_attributes(qw_env *env, const qw_source *source, const qw_quadmesh *quads,
                                     const qw_origins *origins, const qw_attribute *attributes, uint32_t count,
                                     uint32_t most_weights, qw_transfer_report *report)
{
    assert(most_weights <= QW_MOST_COMPONENTS && quads->twin);
    qw_attribute *out = QW_NEW(env, qw_attribute, count);
    uint32_t *neighbour = NULL, *sample = NULL;
    for (uint32_t i = 0; i < count; i++) {
        carriage c = {.env = env, .source = source, .quads = quads, .origins = origins, .in = &attributes[i]};
        if (c.in->domain == QW_PER_FACE && !sample) {
            sample = QW_NEW(env, uint32_t, SAMPLES * (size_t)quads->face_count);
            for (size_t k = 0; k < SAMPLES * (size_t)quads->face_count; k++) sample[k] = NOT_SAMPLED;
        }
        c.sample = sample;
        begin(&c, most_weights);
        carry(&c, &neighbour, report);
        out[i] = c.out;
    }
    qw_free(env, neighbour), qw_free(env, sample);
    return out;
}
