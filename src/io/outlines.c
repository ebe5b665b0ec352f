#include "io/outlines.h"

#include "base/sort.h"
#include "base/mesh_view.h"
#include "io/soup.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- places */

static uint64_t hash_place(const double *p)
{
    uint64_t h = 0;
    for (int k = 0; k < 3; k++) {
        double x = p[k] + 0.0; /* -0 becomes 0 */
        uint64_t bits;
        memcpy(&bits, &x, sizeof bits);
        h = (h ^ bits) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
    }
    return h >> 20;
}

uint32_t *qw_find_places(qw_env *env, const double *position, uint32_t vertex_count)
{
    assert(position || vertex_count == 0);
    size_t slots = 16;
    while (slots < 2 * (size_t)vertex_count) slots *= 2;
    uint32_t *place = QW_NEW(env, uint32_t, vertex_count), *slot = QW_NEW(env, uint32_t, slots);
    memset(slot, 0xff, slots * sizeof *slot);
    for (uint32_t v = 0; v < vertex_count; v++) {
        const double *p = position + 3 * (size_t)v, *q;
        size_t at = (size_t)hash_place(p) & (slots - 1);
        for (; slot[at] != QW_NONE; at = (at + 1) & (slots - 1)) {
            q = position + 3 * (size_t)slot[at];
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) break;
        }
        if (slot[at] == QW_NONE) slot[at] = v;
        place[v] = slot[at];
    }
    qw_free(env, slot);
    return place;
}

/* ---- edges */

/* The first side of an edge takes its slot; the others are compared with it. */
typedef struct slot {
    uint64_t edge;  /* key of its ends, + 1; 0: free */
    qw_side side;   /* the first */
    uint32_t count; /* sides */
} slot;

typedef struct table {
    slot *slot; /* slot[count], a power of two */
    size_t count;
} table;

typedef struct search {
    qw_env *env;
    const qw_outlines *of;
    const uint32_t *place; /* uint32_t[vertices]: ends of edges are told by it; NULL: by the vertices */
    const uint8_t *only;
    qw_sides_differ *differ;
    const void *user;
    uint32_t *edge, edges;
    size_t capacity;
} search;

static table new_table(qw_env *env, size_t sides)
{
    table t = {.count = 16};
    while (t.count < 2 * sides) t.count *= 2;
    t.slot = QW_NEW_ZERO(env, slot, t.count);
    return t;
}

static slot *slot_of(const table *t, uint64_t edge)
{
    size_t at = (size_t)(edge * 0x9e3779b97f4a7c15u >> 20) & (t->count - 1);
    while (t->slot[at].edge && t->slot[at].edge != edge) at = (at + 1) & (t->count - 1);
    return &t->slot[at];
}

/* The side that begins at a corner; its key, or 0 where it is not looked at. */
static uint64_t side_at(const search *s, bool by_place, uint32_t f, uint32_t c, qw_side *side)
{
    uint32_t d = c + 1 < s->of->face_begin[f + 1] ? c + 1 : s->of->face_begin[f], a = s->of->corner[c],
             b = s->of->corner[d];
    if (s->only && !(s->only[a] && s->only[b])) return 0;
    if (by_place) a = s->place[a], b = s->place[b];
    if (a == b) return 0;
    *side = (qw_side){f, a < b ? c : d, a < b ? d : c};
    return qw_pair_key(a, b) + 1;
}

static void add_edge(search *s, const qw_side *side)
{
    s->edge = qw_grow(s->env, s->edge, &s->capacity, s->edges + (size_t)1, 2 * sizeof *s->edge);
    s->edge[2 * (size_t)s->edges] = s->of->corner[side->low];
    s->edge[2 * (size_t)s->edges + 1] = s->of->corner[side->high];
    s->edges++;
}

static size_t count_sides(const search *s)
{
    size_t count = 0;
    qw_side side;
    for (uint32_t f = 0; f < s->of->face_count; f++)
        for (uint32_t c = s->of->face_begin[f]; c < s->of->face_begin[f + 1]; c++)
            count += side_at(s, false, f, c, &side) != 0;
    return count;
}

/* Between faces that share the vertices of an edge. Returns the table of these edges; *alone: sides of only one. */
static table find_shared(search *s, size_t *alone)
{
    table t = new_table(s->env, count_sides(s));
    qw_side side;
    *alone = 0;
    for (uint32_t f = 0; f < s->of->face_count; f++)
        for (uint32_t c = s->of->face_begin[f]; c < s->of->face_begin[f + 1]; c++) {
            uint64_t edge = side_at(s, false, f, c, &side);
            if (!edge) continue;
            slot *known = slot_of(&t, edge);
            if (known->count++ == 0) known->edge = edge, known->side = side, ++*alone;
            else if (known->count == 2) --*alone;
            if (known->count > 1 && known->side.face != f && s->differ(s->user, &known->side, &side))
                add_edge(s, &side);
        }
    return t;
}

/* Between sides that are alone, by their positions: twice over them, as only where there are two in all are they one
 * edge. */
static void find_parted(search *s, const table *shared, size_t alone)
{
    table t = new_table(s->env, alone);
    qw_side side;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t f = 0; f < s->of->face_count; f++)
            for (uint32_t c = s->of->face_begin[f]; c < s->of->face_begin[f + 1]; c++) {
                uint64_t own = side_at(s, false, f, c, &side), edge = own ? side_at(s, true, f, c, &side) : 0;
                if (!edge || slot_of(shared, own)->count > 1) continue;
                slot *known = slot_of(&t, edge);
                if (pass == 0 && known->count++ == 0) known->edge = edge, known->side = side;
                if (pass == 0 || known->count != 2 || known->side.face == f) continue;
                if (s->differ(s->user, &known->side, &side)) add_edge(s, &side);
            }
    qw_free(s->env, t.slot);
}

uint32_t *qw_find_borders(qw_env *env, const qw_outlines *of, const uint32_t *place, const uint8_t *only,
                          qw_sides_differ *differ, const void *user, uint32_t *edges)
{
    search s = {.env = env, .of = of, .place = place, .only = only, .differ = differ, .user = user};
    size_t alone;
    table shared = find_shared(&s, &alone);
    if (alone > 1) {
        uint32_t *own = place ? NULL : qw_find_places(env, of->position, of->vertex_count);
        if (own) s.place = own;
        find_parted(&s, &shared, alone);
        qw_free(env, own);
    }
    qw_free(env, shared.slot);
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
