/* Edges at which attributes differ between the two faces. */
#include "base/sort.h"
#include "base/view.h"
#include "io/soup.h"

#include <math.h>

/* One side of an edge: the corners of a face at the lower and at the upper vertex. */
typedef struct side {
    uint64_t edge; /* key of its vertices, + 1; 0: a free slot */
    uint32_t face, low, high;
} side;

/* An attribute, and how far numbers of it may be apart and are still one. */
typedef struct judged {
    const qw_attribute *of;
    float rounding;
} judged;

static bool differs_at(const judged *j, uint32_t x, uint32_t y)
{
    const qw_attribute *a = j->of;
    const float *p = a->values + (size_t)a->components * x, *q = a->values + (size_t)a->components * y;
    for (uint32_t k = 0; k < a->components; k++)
        if (fabsf(p[k] - q[k]) > j->rounding) return true;
    return false;
}

static bool differ(const judged *j, const side *x, const side *y)
{
    const qw_attribute *a = j->of;
    if (a->kind == QW_LABELS) return a->domain == QW_PER_FACE && a->labels[x->face] != a->labels[y->face];
    if (a->domain == QW_PER_FACE) return differs_at(j, x->face, y->face);
    return a->domain == QW_PER_CORNER && (differs_at(j, x->low, y->low) || differs_at(j, x->high, y->high));
}

/* The first side of an edge takes its slot; the others are compared with it. */
static side *slot_of(side *slots, size_t count, uint64_t edge)
{
    size_t at = (size_t)(edge * 0x9e3779b97f4a7c15u >> 20) & (count - 1);
    while (slots[at].edge && slots[at].edge != edge) at = (at + 1) & (count - 1);
    return &slots[at];
}

static side side_of(const qw_mesh_view *mesh, uint32_t face, uint32_t corner, uint32_t next)
{
    uint32_t a = mesh->corners[corner], b = mesh->corners[next];
    bool up = a < b;
    return (side){qw_pair_key(a, b) + 1, face, up ? corner : next, up ? next : corner};
}

uint32_t *qw_find_attribute_borders(qw_env *env, const qw_mesh_view *mesh, const qw_attribute *const *attributes,
                                    uint32_t count, uint32_t *edges)
{
    size_t corners = 0, slot_count = 16, capacity = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) corners += qw_view_face_size(mesh, f);
    while (slot_count < 2 * corners) slot_count *= 2;
    side *slots = QW_NEW_ZERO(env, side, slot_count);
    judged *judge = QW_NEW(env, judged, count);
    for (uint32_t k = 0; k < count; k++)
        judge[k] = (judged){attributes[k], attributes[k]->kind == QW_UVS ? qw_rounding_of(attributes[k]) : 0};
    uint32_t *edge = NULL, first = 0;
    *edges = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t size = qw_view_face_size(mesh, f);
        for (uint32_t i = 0; i < size; i++) {
            side here = side_of(mesh, f, first + i, first + (i + 1) % size),
                 *known = slot_of(slots, slot_count, here.edge);
            bool borders = false;
            if (!known->edge) *known = here;
            for (uint32_t k = 0; k < count && known->face != f; k++) borders |= differ(&judge[k], known, &here);
            if (!borders) continue;
            edge = qw_grow(env, edge, &capacity, *edges + (size_t)1, 2 * sizeof *edge);
            edge[2 * (size_t)*edges] = mesh->corners[here.low], edge[2 * (size_t)*edges + 1] = mesh->corners[here.high];
            ++*edges;
        }
        first += size;
    }
    qw_free(env, slots), qw_free(env, judge);
    return edge;
}
