#include "quad/topology.h"

#include "base/sets.h"
#include "quad/components.h"
#include "quad/contract.h"

#include <math.h>
#include <string.h>

/* ---- counts a component */

typedef struct tally {
    int64_t euler, loops, pieces, faces, doubles;
} tally;

/* Boundary loops, counted a component: corners per face `n` (3 or 4), component of each face. */
static void tally_loops(qw_env *env, uint32_t n, uint32_t face_count, const uint32_t *twin, const uint32_t *component, tally *t)
{
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, (size_t)n * face_count);
    for (uint32_t h = 0; h < n * face_count; h++) {
        if (twin[h] != QW_NONE || seen[h]) continue;
        t[component[h / n]].loops++;
        for (uint32_t g = h; !seen[g];) {
            seen[g] = 1;
            for (g = g - g % n + (g + 1) % n; twin[g] != QW_NONE;) {
                uint32_t over = twin[g];
                g = over - over % n + (over + 1) % n;
            }
        }
    }
    qw_free(env, seen);
}

static void tally_faces(qw_env *env, uint32_t n, uint32_t face_count, const uint32_t *twin, const uint32_t *component, tally *t)
{
    for (uint32_t f = 0; f < face_count; f++) t[component[f]].faces++, t[component[f]].euler++;
    for (uint32_t h = 0; h < n * face_count; h++)
        if (twin[h] == QW_NONE || h < twin[h]) t[component[h / n]].euler--;
    tally_loops(env, n, face_count, twin, component, t);
}

static void tally_pieces(qw_env *env, uint32_t face_count, const uint32_t *twin, const uint32_t *component, tally *t)
{
    uint32_t *parent = QW_NEW(env, uint32_t, face_count);
    qw_sets_begin(parent, face_count);
    for (uint32_t f = 0; f < face_count; f++) t[component[f]].pieces++;
    for (uint32_t h = 0; h < 4 * face_count; h++)
        if (twin[h] != QW_NONE && h < twin[h]) t[component[h / 4]].pieces -= qw_join_sets(parent, h / 4, twin[h] / 4);
    qw_free(env, parent);
}

static tally *tally_surface(qw_env *env, const qw_trimesh *s, const qw_census *census)
{
    tally *t = QW_NEW_ZERO(env, tally, (size_t)census->components);
    tally_faces(env, 3, s->face_count, s->twin, census->component, t);
    uint32_t *out = qw_trimesh_outgoing(env, s);
    for (uint32_t v = 0; v < s->vertex_count; v++) t[census->component[out[v] / 3]].euler++;
    qw_free(env, out);
    return t;
}

static tally *tally_quads(qw_env *env, const qw_quadmesh *q, uint32_t components)
{
    tally *t = QW_NEW_ZERO(env, tally, components);
    uint32_t *component = QW_NEW(env, uint32_t, q->face_count), *out = qw_quadmesh_outgoing(env, q);
    uint8_t *doubled = QW_NEW(env, uint8_t, (size_t)4 * q->face_count);
    for (uint32_t f = 0; f < q->face_count; f++) component[f] = q->component[q->corner[4 * f]];
    tally_faces(env, 4, q->face_count, q->twin, component, t);
    tally_pieces(env, q->face_count, q->twin, component, t);
    for (uint32_t v = 0; v < q->vertex_count; v++) t[q->component[v]].euler += out[v] != QW_NONE;
    qw_quadmesh_double_edges(env, q, doubled);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        const uint32_t *c = q->corner + (h & ~3u);
        t[component[h / 4]].doubles += doubled[h] || c[0] == c[2] || c[1] == c[3];
    }
    qw_free(env, component), qw_free(env, out), qw_free(env, doubled);
    return t;
}

qw_topology_check qw_check_topology(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface)
{
    qw_census census = qw_trimesh_census(env, surface);
    qw_topology_check check = {.component_count = (uint32_t)census.components};
    check.broken = QW_NEW(env, uint8_t, check.component_count);
    tally *want = tally_surface(env, surface, &census), *have = tally_quads(env, quads, check.component_count);
    for (uint32_t c = 0; c < check.component_count; c++) {
        /* a sphere of fewer than six, a torus of two on the same corners, of which no edge is double: there are good ones of five */
        bool too_few = have[c].loops == 0 && have[c].faces < (have[c].euler == 2 ? QW_LEAST_SHELL : 3);
        bool differs = have[c].pieces != 1 || have[c].euler != want[c].euler || have[c].loops != want[c].loops;
        check.broken[c] = differs || have[c].doubles > 0 || too_few;
        check.broken_count += check.broken[c];
    }
    qw_free(env, want), qw_free(env, have), qw_free(env, census.component);
    return check;
}

/* ---- where it went wrong */

static qw_trimesh view_of(const qw_offset_mesh *m)
{
    return (qw_trimesh){m->vertex_count, m->face_count, m->position, m->corner, m->twin, m->mark};
}

static void add_loss(const qw_offset_mesh *m, qw_losses *l, uint32_t v)
{
    for (uint32_t i = 0; i < l->count; i++)
        if (qw_distance(l->point[i], m->position[v]) < l->size[i]) return;
    l->point[l->count] = m->position[v];
    l->size[l->count++] = m->size[v];
}

/* Euler characteristic of each class as a complex of zero edges and triangles; a disc (or a tree) has 1. int32_t[vertex_count] at the names. */
static int32_t *class_euler(qw_env *env, const qw_offset_mesh *m, const uint32_t *class_of)
{
    int32_t *euler = QW_NEW_ZERO(env, int32_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) euler[class_of[v]]++;
    for (uint32_t e = 0; e < m->edge_count; e++)
        if (qw_int2_is_zero(m->d[e])) euler[class_of[m->corner[m->half[e]]]]--;
    for (uint32_t f = 0; f < m->face_count; f++)
        if (qw_int2_is_zero(m->d[m->edge[3 * f]]) && qw_int2_is_zero(m->d[m->edge[3 * f + 1]])) euler[class_of[m->corner[3 * f]]]++;
    return euler;
}

qw_losses qw_find_losses(qw_env *env, const qw_offset_mesh *m, const qw_extraction *x)
{
    qw_losses l = {0, QW_NEW(env, qw_vec3, QW_MOST_LOSSES), QW_NEW(env, float, QW_MOST_LOSSES), 0};
    int32_t *euler = class_euler(env, m, x->class_of);
    uint32_t *fans = QW_NEW_ZERO(env, uint32_t, m->vertex_count);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) fans[x->vertex_class[v]]++;
    for (uint32_t f = 0; f < m->face_count && l.count < QW_MOST_LOSSES; f++)
        if (qw_offset_det(m, f) < 0) add_loss(m, &l, m->corner[3 * f]);
    for (uint32_t v = 0; v < m->vertex_count && l.count < QW_MOST_LOSSES; v++) {
        uint32_t c = x->class_of[v];
        if (fans[c] > 1 || (fans[c] == 0 && euler[c] != 1)) add_loss(m, &l, v);
    }
    qw_trimesh surface = view_of(m);
    qw_census census = qw_trimesh_census(env, &surface);
    uint8_t *has_quads = QW_NEW_ZERO(env, uint8_t, (size_t)census.components);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) has_quads[x->quads.component[v]] = 1;
    for (uint32_t f = 0; f < m->face_count && l.count < QW_MOST_LOSSES; f++)
        if (!has_quads[census.component[f]]) add_loss(m, &l, m->corner[3 * f]);
    qw_free(env, euler), qw_free(env, fans), qw_free(env, census.component), qw_free(env, has_quads);
    return l;
}

/* ---- components made anew */

/* What is broken gives way to `fresh`. */
static qw_quadmesh with_fresh(qw_env *env, const qw_quadmesh *quads, const qw_topology_check *check, const qw_quadmesh *fresh)
{
    uint8_t *whole = QW_NEW(env, uint8_t, check->component_count);
    for (uint32_t c = 0; c < check->component_count; c++) whole[c] = !check->broken[c];
    qw_quadmesh r = qw_pick_components(env, quads, whole, fresh);
    qw_append_quads(&r, fresh);
    return r;
}

/* Where a class is one vertex of the quads and of the contracted triangles, all of them upright, its place is as solved; near what is not
   upright the solution follows the folds, and the vertices stay where they came from. */
static void take_places(qw_env *env, const qw_extraction *x, const qw_vec3 *place, uint32_t members, const uint32_t *vertex_of,
                        const uint8_t *hypotenuse, qw_edit *e)
{
    uint8_t *loose = QW_NEW_ZERO(env, uint8_t, e->vertex_count);
    uint32_t *fan = QW_NEW(env, uint32_t, members), *cluster = QW_NEW(env, uint32_t, members);
    enum { MANY = 0xfffffffe };
    for (uint32_t f = 0; f < e->face_count; f++) {
        const uint8_t *across = hypotenuse + 4 * (size_t)f;
        for (uint32_t i = 0; i < 3 && !qw_edit_dead(e, f); i++) loose[e->face[f].corner[i]] |= !(across[0] || across[1] || across[2]);
    }
    memset(fan, 0xff, members * sizeof *fan), memset(cluster, 0xff, members * sizeof *cluster);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) {
        uint32_t c = x->vertex_class[v];
        fan[c] = fan[c] == QW_NONE ? v : MANY;
    }
    for (uint32_t v = 0; v < members; v++) {
        uint32_t c = x->class_of[v];
        if (vertex_of[v] != QW_NONE && cluster[c] != vertex_of[v]) cluster[c] = cluster[c] == QW_NONE ? vertex_of[v] : MANY;
    }
    for (uint32_t c = 0; c < members; c++)
        if (fan[c] < MANY && cluster[c] < MANY && !loose[cluster[c]]) e->vertex[cluster[c]].position = place[fan[c]];
    qw_free(env, loose), qw_free(env, fan), qw_free(env, cluster);
}

qw_replacement qw_replace_components(qw_env *env, const qw_quadmesh *quads, const qw_offset_mesh *m, const qw_extraction *x,
                                     const qw_vec3 *place, const qw_topology_check *check)
{
    qw_scope_begin(env);
    qw_replacement r = {0};
    qw_trimesh surface = view_of(m);
    qw_census census = qw_trimesh_census(env, &surface);
    uint8_t *hypotenuse;
    uint32_t *vertex_of, *from;
    qw_edit e = qw_contract(env, m, census.component, check->broken, &hypotenuse, &vertex_of);
    take_places(env, x, place, m->vertex_count, vertex_of, hypotenuse, &e);
    qw_quadmesh fresh = qw_pair_triangles(env, &e, hypotenuse, &from, &r.pairs);
    r.quads = with_fresh(env, quads, check, &fresh);
    qw_topology_check again = qw_check_topology(env, &r.quads, &surface);
    if (again.broken_count) { /* of so few triangles that their pairs share all corners, or cannot be found */
        e = qw_contract(env, m, census.component, again.broken, &hypotenuse, &vertex_of);
        fresh = qw_cut_triangles(env, &e);
        r.quads = with_fresh(env, &r.quads, &again, &fresh);
    }
    r.cut_components = again.broken_count;
    qw_keep_quads(env, &r.quads);
    qw_scope_end(env);
    return r;
}
