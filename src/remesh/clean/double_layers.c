/* Sheets of the file that lie on one another, whose rims would be joined where they have vertices in common. At one
 * edge they look like the two sides of a thin blade, so pairs of sheets are judged by the share of their faces that lie
 * on the other. */
#include "remesh/clean/sheets.h"

#include "base/sets.h"
#include "base/sort.h"
#include "base/vec.h"
#include "geometry/box_tree.h"
#include "geometry/trimesh.h"

#include <assert.h>
#include <string.h>

/* Sheets of one position along their rims, as files have them of which each was cut alike. Those that agree may be a
   thin blade. */
static const qw_fold_limits same_rim = {0.99996, 0.985}; /* 0.5 and 10 degrees */

static const double *position_of(const qw_sheets *s, uint32_t v) { return s->position + 3 * (size_t)v; }

bool qw_fold_back(const qw_sheets *s, uint32_t a, uint32_t b, const qw_fold_limits *limits)
{
    const uint32_t half[2] = {a, b};
    double axis[2][3], out[2][3];
    for (int i = 0; i < 2; i++) {
        const double *p = position_of(s, s->corner[half[i]]), *q = position_of(s, s->corner[qw_next(half[i])]),
                     *r = position_of(s, s->corner[qw_prev(half[i])]);
        for (int k = 0; k < 3; k++) axis[i][k] = q[k] - p[k], out[i][k] = r[k] - p[k];
        qw_unit_doubles(axis[i]);
        double along = qw_dot_doubles(out[i], axis[i]);
        for (int k = 0; k < 3; k++) out[i][k] -= along * axis[i][k];
        qw_unit_doubles(out[i]);
    }
    bool agree = qw_dot_doubles(axis[0], axis[1]) < 0;
    return qw_dot_doubles(out[0], out[1]) > (agree ? limits->agreeing : limits->disagreeing);
}

bool qw_is_named_alike(const qw_sheets *s, uint32_t a, uint32_t b)
{
    uint32_t from = s->named[a], to = s->named[qw_next(a)], other = s->named[b], end = s->named[qw_next(b)];
    return (from == other && to == end) || (from == end && to == other);
}

static bool is_listed(const qw_sheets *s, uint64_t pair)
{
    size_t at = qw_first_not_below(s->layered, s->layers, pair);
    return at < s->layers && s->layered[at] == pair;
}

bool qw_are_layered(const qw_sheets *s, uint32_t a, uint32_t b)
{
    return s->sheet && is_listed(s, qw_pair_key(s->sheet[a / 3], s->sheet[b / 3]));
}

bool qw_stay_apart(const qw_sheets *s, uint32_t a, uint32_t b)
{
    if (!s->named || qw_is_named_alike(s, a, b)) return false;
    return qw_are_layered(s, a, b) || qw_fold_back(s, a, b, &same_rim);
}

/* Sheets that are cut differently: their faces need not lie in one plane where they are curved. */
static const double AGREEING = 0.985; /* the cosine of 10 degrees */
/* Share of the samples that lie on the other of two sheets of which neither has an open side; else it is the rest. */
static const double MOST = 0.75;

enum { SAMPLES = 64 }; /* faces of a sheet that look for others, at most */

typedef struct overlap {
    const qw_sheets *sheets;
    const uint32_t *order;
    qw_box_tree tree; /* of all faces */
    uint64_t *pair;   /* uint64_t[pairs]: sheet << 32 | another that lies on its sample */
    size_t pairs, room;
} overlap;

/* How far two cuttings of one surface may lie apart at a face: their chords, where it turns by ten degrees in each. */
static double chord_of(const double normal[3])
{
    return sqrt(sqrt(qw_dot_doubles(normal, normal)) * 2 * (1 - AGREEING)) / 8;
}

static void normal_of(const qw_sheets *s, uint32_t f, double normal[3])
{
    const uint32_t *c = s->corner + 3 * (size_t)f;
    const double *p = position_of(s, c[0]), *q = position_of(s, c[1]), *r = position_of(s, c[2]);
    const double a[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, b[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
    qw_cross_doubles(a, b, normal);
}

/* Whether a point lies on face f, of about this normal. */
static bool lies_on(const qw_sheets *s, const double *at, const double *unit, double chord, uint32_t f)
{
    double normal[3], out[3];
    normal_of(s, f, normal);
    double length = sqrt(qw_dot_doubles(normal, normal));
    if (!(fabs(qw_dot_doubles(normal, unit)) > AGREEING * length)) return false;
    for (int i = 0; i < 3; i++) {
        const double *p = position_of(s, s->corner[3 * (size_t)f + (size_t)i]),
                     *q = position_of(s, s->corner[3 * (size_t)f + (size_t)(i + 1) % 3]);
        const double a[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, b[3] = {at[0] - p[0], at[1] - p[1], at[2] - p[2]};
        qw_cross_doubles(a, b, out);
        if (!(qw_dot_doubles(out, normal) > 0) || fabs(qw_dot_doubles(b, normal)) > chord * length) return false;
    }
    return true;
}

/* Notes the other sheets that lie on the middle of face f, or some where there are very many. */
static void look_from(qw_env *env, overlap *o, uint32_t f)
{
    const qw_sheets *s = o->sheets;
    double at[3] = {0}, unit[3];
    uint32_t stack[QW_BOX_STACK], top = 0;
    size_t most = o->pairs + SAMPLES;
    for (size_t h = 3 * (size_t)f; h < 3 * (size_t)f + 3; h++)
        for (int k = 0; k < 3; k++) at[k] += position_of(s, s->corner[h])[k] / 3;
    normal_of(s, f, unit);
    double chord = chord_of(unit);
    qw_unit_doubles(unit);
    stack[top++] = 0;
    while (top > 0 && o->pairs < most) {
        const qw_box_node *n = &o->tree.nodes[stack[--top]];
        bool far = false;
        for (int k = 0; k < 3; k++) far |= fabs(at[k] - (double)n->centre[k]) > (double)n->half[k] + chord;
        if (far) continue;
        for (uint32_t i = n->first; i < n->first + n->count; i++) {
            uint32_t g = o->order[i];
            if (s->sheet[g] == s->sheet[f] || !lies_on(s, at, unit, chord, g)) continue;
            o->pair = qw_grow(env, o->pair, &o->room, o->pairs + 1, sizeof *o->pair);
            o->pair[o->pairs++] = (uint64_t)s->sheet[f] << 32 | s->sheet[g];
        }
        if (n->count == 0) stack[top++] = n->first + 1, stack[top++] = n->first;
    }
}

static void label_sheets(qw_env *env, qw_sheets *s, uint32_t *faces)
{
    s->sheet = QW_NEW(env, uint32_t, s->face_count);
    uint32_t *set = QW_NEW(env, uint32_t, s->names);
    qw_sets_begin(set, s->names);
    for (size_t h = 0; h < 3 * (size_t)s->face_count; h += 3)
        qw_join_sets(set, s->named[h], s->named[h + 1]), qw_join_sets(set, s->named[h], s->named[h + 2]);
    for (uint32_t f = 0; f < s->face_count; f++)
        s->sheet[f] = qw_set_of(set, s->named[3 * (size_t)f]), faces[s->sheet[f]]++;
    qw_free(env, set);
}

/* Marks the sheets that have a side without another. */
static void mark_open(const qw_sheets *s, const qw_edges *edges, uint8_t *open)
{
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i == 1) open[s->sheet[qw_side_half(edges->side[i]) / 3]] = 1;
        }
}

/* A box tree of the triangles of sheets; order: as they stand in it. */
static qw_box_tree tree_of(qw_env *env, const qw_sheets *s, uint32_t *order)
{
    qw_box *box = QW_NEW(env, qw_box, s->face_count);
    for (uint32_t f = 0; f < s->face_count; f++) {
        qw_vec3 corner[3];
        for (int i = 0; i < 3; i++) {
            const double *p = position_of(s, s->corner[3 * (size_t)f + (size_t)i]);
            corner[i] = qw_v3((float)p[0], (float)p[1], (float)p[2]);
        }
        box[f] = qw_box_of(corner, 3);
    }
    qw_box_tree tree = qw_box_tree_build(env, box, s->face_count, order);
    qw_free(env, box);
    return tree;
}

void qw_find_double_layers(qw_env *env, qw_sheets *s, const qw_edges *edges)
{
    assert(s->named && !s->sheet);
    uint32_t *faces = QW_NEW_ZERO(env, uint32_t, s->names), *seen = QW_NEW_ZERO(env, uint32_t, s->names),
             *order = QW_NEW(env, uint32_t, s->face_count);
    label_sheets(env, s, faces);
    if (faces[s->sheet[0]] == s->face_count) return;
    overlap o = {.sheets = s, .order = order, .tree = tree_of(env, s, order)};
    for (uint32_t f = 0; f < s->face_count; f++) {
        uint32_t of = s->sheet[f];
        if (seen[of]++ % (faces[of] / SAMPLES + 1) == 0) look_from(env, &o, f);
    }
    uint8_t *open = QW_NEW_ZERO(env, uint8_t, s->names);
    mark_open(s, edges, open);
    qw_sort_u64(o.pair, o.pairs);
    s->layered = QW_NEW(env, uint64_t, o.pairs);
    for (size_t i = 0, end; i < o.pairs; i = end) {
        uint32_t a = (uint32_t)(o.pair[i] >> 32), b = (uint32_t)o.pair[i],
                 samples = faces[a] / (faces[a] / SAMPLES + 1);
        for (end = i; end < o.pairs && o.pair[end] == o.pair[i];) end++;
        if ((double)(end - i) > samples * (open[a] || open[b] ? 1 - MOST : MOST))
            s->layered[s->layers++] = qw_pair_key(a, b);
    }
    s->layers = qw_sort_once(s->layered, s->layers);
}
