#include "io/outlines.h"

#include "base/hash.h"
#include "base/sort.h"
#include "base/mesh_view.h"
#include "io/soup.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- edges */

/* An edge by its first side; the others are compared with it. */
typedef struct known_edge {
    uint64_t key;   /* of its ends */
    qw_side side;   /* the first */
    uint32_t count; /* sides */
} known_edge;

typedef struct table {
    qw_hash_table at;
    known_edge *edge; /* known_edge[count] */
    uint32_t count;
} table;

typedef struct edge_search {
    qw_env *env;
    const qw_outlines *of;
    const uint32_t *place; /* uint32_t[vertices]: ends of edges are told by it; NULL: by the vertices */
    const uint8_t *only;
    qw_is_outline *differ;
    const void *user;
    uint32_t *edge, edges;
    size_t capacity;
} edge_search;

static table new_table(qw_env *env, size_t sides)
{
    return (table){.at = qw_hash_table_create(env, sides), .edge = QW_NEW(env, known_edge, sides)};
}

static void free_table(qw_env *env, table *t) { qw_free(env, t->at.slot), qw_free(env, t->edge); }

typedef struct wanted_edge {
    const table *t;
    uint64_t key;
} wanted_edge;

static bool is_same_edge(const void *wanted, uint32_t e)
{
    const wanted_edge *w = wanted;
    return w->t->edge[e].key == w->key;
}

/* The edge of a side, which is its first where there is none yet. */
static known_edge *edge_of(table *t, uint64_t key, const qw_side *side)
{
    uint32_t *slot = qw_hash_slot(&t->at, qw_mix(key), is_same_edge, &(wanted_edge){t, key});
    if (*slot == QW_NONE) *slot = t->count, t->edge[t->count++] = (known_edge){key, *side, 0};
    return &t->edge[*slot];
}

/* The side that begins at a corner; its key, or 0 where it is not looked at. */
static uint64_t side_at(const edge_search *s, bool by_place, uint32_t f, uint32_t c, qw_side *side)
{
    uint32_t d = c + 1 < s->of->face_begin[f + 1] ? c + 1 : s->of->face_begin[f], a = s->of->corner[c],
             b = s->of->corner[d];
    if (s->only && !(s->only[a] && s->only[b])) return 0;
    if (by_place) a = s->place[a], b = s->place[b];
    if (a == b) return 0;
    *side = (qw_side){f, a < b ? c : d, a < b ? d : c};
    return qw_pair_key(a, b) + 1;
}

static void add_edge(edge_search *s, const qw_side *side)
{
    s->edge = qw_grow(s->env, s->edge, &s->capacity, s->edges + (size_t)1, 2 * sizeof *s->edge);
    s->edge[2 * (size_t)s->edges] = s->of->corner[side->low];
    s->edge[2 * (size_t)s->edges + 1] = s->of->corner[side->high];
    s->edges++;
}

static size_t count_sides(const edge_search *s)
{
    size_t count = 0;
    qw_side side;
    for (uint32_t f = 0; f < s->of->face_count; f++)
        for (uint32_t c = s->of->face_begin[f]; c < s->of->face_begin[f + 1]; c++)
            count += side_at(s, false, f, c, &side) != 0;
    return count;
}

/* Between faces that share the vertices of an edge. Returns the table of these edges; *alone: sides of only one. */
static table find_shared(edge_search *s, size_t *alone)
{
    table t = new_table(s->env, count_sides(s));
    qw_side side;
    *alone = 0;
    for (uint32_t f = 0; f < s->of->face_count; f++)
        for (uint32_t c = s->of->face_begin[f]; c < s->of->face_begin[f + 1]; c++) {
            uint64_t key = side_at(s, false, f, c, &side);
            if (!key) continue;
            known_edge *known = edge_of(&t, key, &side);
            if (known->count++ == 0) ++*alone;
            else if (known->count == 2) --*alone;
            if (known->count > 1 && known->side.face != f && s->differ(s->user, &known->side, &side))
                add_edge(s, &side);
        }
    return t;
}

/* Between sides that are alone, by their positions: twice over them, as only where there are two in all are they one
 * edge. */
static void find_parted(edge_search *s, table *shared, size_t alone)
{
    table t = new_table(s->env, alone);
    qw_side side;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t f = 0; f < s->of->face_count; f++)
            for (uint32_t c = s->of->face_begin[f]; c < s->of->face_begin[f + 1]; c++) {
                uint64_t own = side_at(s, false, f, c, &side), key = own ? side_at(s, true, f, c, &side) : 0;
                if (!key || edge_of(shared, own, &side)->count > 1) continue;
                known_edge *known = edge_of(&t, key, &side);
                known->count += pass == 0;
                if (pass == 0 || known->count != 2 || known->side.face == f) continue;
                if (s->differ(s->user, &known->side, &side)) add_edge(s, &side);
            }
    free_table(s->env, &t);
}

uint32_t *qw_find_borders(qw_env *env, const qw_outlines *of, const uint32_t *place, const uint8_t *only,
                          qw_is_outline *differ, const void *user, uint32_t *edges)
{
    edge_search s = {.env = env, .of = of, .place = place, .only = only, .differ = differ, .user = user};
    size_t alone;
    table shared = find_shared(&s, &alone);
    if (alone > 1) {
        uint32_t *own = place ? NULL : qw_find_places(env, of->position, of->vertex_count, NULL);
        if (own) s.place = own;
        find_parted(&s, &shared, alone);
        qw_free(env, own);
    }
    free_table(env, &shared);
    *edges = s.edges;
    return s.edge;
}

/* ---- attributes */

/* An attribute, and how far numbers of it may be apart and are still one. */
typedef struct judged {
    const qw_attribute *of;
    float rounding;
} judged;

typedef struct judges {
    const judged *judge; /* judged[count] */
    uint32_t count;
    const uint32_t *corner; /* uint32_t[corners]: vertices */
} judges;

static bool differs_at(const judged *j, uint32_t x, uint32_t y)
{
    const qw_attribute *a = j->of;
    const float *p = a->values + (size_t)a->components * x, *q = a->values + (size_t)a->components * y;
    for (uint32_t k = 0; k < a->components; k++)
        if (fabsf(p[k] - q[k]) > j->rounding) return true;
    return false;
}

static bool differ(const judges *all, const judged *j, const qw_side *x, const qw_side *y)
{
    const qw_attribute *a = j->of;
    const uint32_t *v = all->corner;
    if (a->kind == QW_LABELS && a->domain == QW_PER_FACE) return a->labels[x->face] != a->labels[y->face];
    if (!a->values || a->kind == QW_WEIGHTS) return false;
    if (a->domain == QW_PER_FACE) return differs_at(j, x->face, y->face);
    if (a->domain == QW_PER_CORNER) return differs_at(j, x->low, y->low) || differs_at(j, x->high, y->high);
    return differs_at(j, v[x->low], v[y->low]) || differs_at(j, v[x->high], v[y->high]);
}

static bool any_differs(const void *user, const qw_side *x, const qw_side *y)
{
    const judges *all = user;
    for (uint32_t k = 0; k < all->count; k++)
        if (differ(all, &all->judge[k], x, y)) return true;
    return false;
}

uint32_t *qw_find_attribute_borders(qw_env *env, const qw_mesh_view *mesh, const qw_attribute *const *attributes,
                                    uint32_t count, uint32_t *edges)
{
    uint32_t *begin = QW_NEW(env, uint32_t, mesh->face_count + (size_t)1);
    begin[0] = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) begin[f + 1] = begin[f] + qw_view_face_size(mesh, f);
    judged *judge = QW_NEW(env, judged, count);
    for (uint32_t k = 0; k < count; k++)
        judge[k] = (judged){attributes[k], attributes[k]->kind == QW_UVS ? qw_rounding_of(attributes[k]) : 0};
    const qw_outlines of = {mesh->vertex_count, mesh->face_count, mesh->positions, begin, mesh->corners};
    const judges all = {judge, count, mesh->corners};
    uint32_t *edge = qw_find_borders(env, &of, NULL, NULL, any_differs, &all, edges);
    qw_free(env, begin), qw_free(env, judge);
    return edge;
}
