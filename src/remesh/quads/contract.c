#include "remesh/quads/contract.h"

#include <assert.h>
#include <string.h>

/* Each pass collapses what the one before made possible; a chain that needs more is left to the pairing. */
enum { MAX_PASSES = 64 };

/* The faces of the wanted components as a mesh of their own; face_of: face of m for each. */
static qw_trimesh wanted_subset(qw_env *env, const qw_offset_mesh *m, const uint32_t *component, const uint8_t *wanted,
                                uint32_t *face_of, uint32_t *vertex_of)
{
    qw_trimesh subset = {0};
    uint32_t *face = QW_NEW(env, uint32_t, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) {
        face[f] = QW_NONE;
        if (!wanted[component[f]]) continue;
        face_of[subset.face_count] = f;
        face[f] = subset.face_count++;
    }
    subset.corner = QW_NEW(env, uint32_t, (size_t)3 * subset.face_count),
    subset.twin = QW_NEW(env, uint32_t, (size_t)3 * subset.face_count);
    subset.mark = QW_NEW(env, uint8_t, (size_t)3 * subset.face_count),
    subset.position = QW_NEW(env, qw_vec3, m->vertex_count);
    memset(vertex_of, 0xff, m->vertex_count * sizeof *vertex_of);
    for (uint32_t h = 0; h < 3 * subset.face_count; h++) {
        uint32_t from = 3 * face_of[h / 3] + h % 3, v = m->corner[from], t = m->twin[from];
        if (vertex_of[v] == QW_NONE) {
            subset.position[subset.vertex_count] = m->position[v];
            vertex_of[v] = subset.vertex_count++;
        }
        subset.corner[h] = vertex_of[v], subset.mark[h] = m->mark[from];
        subset.twin[h] = t == QW_NONE ? QW_NONE : 3 * face[t / 3] + t % 3;
    }
    qw_free(env, face);
    return subset;
}

static void clear_mark(qw_edit *e, uint32_t h)
{
    uint32_t t = qw_edit_twin(e, h);
    e->face[h >> 2].mark[h & 3] = 0;
    if (t != QW_NONE) e->face[t >> 2].mark[t & 3] = 0;
}

static void set_mark(qw_edit *e, uint32_t h, uint8_t mark)
{
    uint32_t t = qw_edit_twin(e, h);
    e->face[h >> 2].mark[h & 3] = mark;
    if (t != QW_NONE) e->face[t >> 2].mark[t & 3] = mark;
}

/* Where both other sides of h's face are marked, the marks meet in one edge when h goes: one of the two is taken off
   beforehand, as qw_edit_can_collapse keeps curves apart. Returns the half-edge, and its mark, or QW_NONE. */
static uint32_t lift_mark(qw_edit *e, uint32_t h, uint8_t *mark)
{
    if (h == QW_NONE) return QW_NONE;
    uint32_t a = qw_edit_next(h), b = qw_edit_prev(h), which = qw_edit_twin(e, b) == QW_NONE ? a : b;
    if (!qw_edit_on_curve(e, a) || !qw_edit_on_curve(e, b) || qw_edit_twin(e, which) == QW_NONE) return QW_NONE;
    *mark = qw_edit_mark(e, which);
    clear_mark(e, which);
    return which;
}

/* Whether the edge joins no two corners, and no two vertices of curves but along one. */
static bool keeps_curves(const qw_edit *e, const uint8_t *constraint, uint32_t h)
{
    uint8_t a = constraint[qw_edit_tail(e, h)], b = constraint[qw_edit_head(e, h)];
    return a == QW_VERTEX_FREE || b == QW_VERTEX_FREE ||
           (qw_edit_on_curve(e, h) && (a != QW_VERTEX_CORNER || b != QW_VERTEX_CORNER));
}

/* Collapses an edge if the surface stays one; the weaker of its ends goes. Marks beside it are lifted and put back
 * where it can't. into: uint32_t[vertices], receives where vertices have gone. */
static bool collapse(qw_edit *e, uint8_t *constraint, uint32_t *into, uint32_t h)
{
    assert(constraint && into && !qw_edit_dead(e, h >> 2));
    uint32_t a = qw_edit_tail(e, h), b = qw_edit_head(e, h);
    uint8_t first_mark = 0, second_mark = 0;
    uint32_t first = lift_mark(e, h, &first_mark), second = lift_mark(e, qw_edit_twin(e, h), &second_mark);
    if (!qw_edit_can_collapse(e, h)) {
        if (first != QW_NONE) set_mark(e, first, first_mark);
        if (second != QW_NONE) set_mark(e, second, second_mark);
        return false;
    }
    uint32_t gone = a < b ? b : a;
    into[gone] = a < b ? a : b;
    if (constraint[gone] > constraint[into[gone]]) constraint[into[gone]] = constraint[gone];
    qw_edit_collapse(e, h, gone);
    return true;
}

/* Collapses zero edges: first those that leave corners and curves apart, as the link condition allows only some of
   all. */
static void collapse_zero_edges(qw_edit *e, const uint8_t *zero, uint8_t *constraint, uint32_t *into)
{
    assert(zero && constraint && into);
    bool all = false;
    for (int pass = 0; pass < MAX_PASSES; pass++) {
        bool any = false;
        for (uint32_t f = 0; f < e->face_count; f++)
            for (uint32_t h = 4 * f; h < 4 * f + 3 && !qw_edit_dead(e, f); h++)
                if (zero[h] && (all || keeps_curves(e, constraint, h)) && collapse(e, constraint, into, h)) any = true;
        if (!any && all) return;
        if (!any || pass == MAX_PASSES / 2) all = true;
    }
}

/* Sets vertex_of to the vertices that are left, and their positions to the mean of all vertices drawn into them. */
static void place_clusters(qw_env *env, const qw_offset_mesh *m, uint32_t *into, qw_edit *e, uint32_t *vertex_of)
{
    assert(e->vertex_count <= m->vertex_count && into);
    uint32_t n = e->vertex_count;
    qw_vec3 *sum = QW_NEW_ZERO(env, qw_vec3, n);
    uint32_t *members = QW_NEW_ZERO(env, uint32_t, n);
    for (uint32_t v = 0; v < n; v++) into[v] = into[into[v]]; /* of lower number, so it is final already */
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        if (vertex_of[v] == QW_NONE) continue;
        uint32_t c = vertex_of[v] = into[vertex_of[v]];
        if (m->constraint[v] > e->vertex[c].kind)
            e->vertex[c].kind = m->constraint[v], sum[c] = qw_v3(0, 0, 0), members[c] = 0;
        if (m->constraint[v] < e->vertex[c].kind) continue;
        sum[c] = qw_add(sum[c], m->position[v]);
        members[c]++;
        e->vertex[c].target = m->size[v];
    }
    for (uint32_t v = 0; v < n; v++)
        if (members[v]) e->vertex[v].position = qw_scale(sum[v], 1.0f / (float)members[v]);
    qw_free(env, sum), qw_free(env, members);
}

qw_edit qw_contract(qw_env *env, const qw_offset_mesh *m, const uint32_t *component, const uint8_t *wanted,
                    uint8_t **hypotenuse, uint32_t **vertex_of)
{
    assert(m->face_count > 0 && component && wanted && hypotenuse && vertex_of);
    uint32_t *face_of = QW_NEW(env, uint32_t, m->face_count);
    *vertex_of = QW_NEW(env, uint32_t, m->vertex_count);
    qw_trimesh subset = wanted_subset(env, m, component, wanted, face_of, *vertex_of);
    float *target = QW_NEW_ZERO(env, float, subset.vertex_count);
    qw_edit e = qw_edit_open(env, &subset, target, qw_trimesh_outgoing(env, &subset));
    uint8_t *zero = QW_NEW_ZERO(env, uint8_t, (size_t)4 * subset.face_count);
    *hypotenuse = QW_NEW_ZERO(env, uint8_t, (size_t)4 * subset.face_count);
    for (uint32_t h = 0; h < 3 * subset.face_count; h++) {
        uint32_t from = 3 * face_of[h / 3] + h % 3, to = 4 * (h / 3) + h % 3;
        qw_int2 d = m->d[m->edge[from]];
        zero[to] = qw_int2_is_zero(d);
        (*hypotenuse)[to] = d.x != 0 && d.y != 0 && qw_offset_det(m, from / 3) > 0;
    }
    uint32_t *into = QW_NEW(env, uint32_t, subset.vertex_count);
    for (uint32_t v = 0; v < subset.vertex_count; v++) into[v] = v;
    uint8_t *constraint = QW_NEW(env, uint8_t, subset.vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if ((*vertex_of)[v] != QW_NONE) constraint[(*vertex_of)[v]] = m->constraint[v];
    collapse_zero_edges(&e, zero, constraint, into);
    place_clusters(env, m, into, &e, *vertex_of);
    for (uint32_t f = 0; f < e.face_count; f++)
        for (uint32_t i = 0; i < 3 && !qw_edit_dead(&e, f); i++)
            e.vertex[e.face[f].corner[i]].home = component[face_of[f]];
    return e;
}
