#include "remesh/quads/topology.h"

#include "remesh/quads/quad_components.h"
#include "remesh/quads/contract.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- counts a component */

typedef struct tally {
    int64_t twice_euler, loops, pieces, faces, doubles;
} tally;

/* Triangles or quads. */
typedef struct faces {
    uint32_t sides, count, vertex_count; /* sides: of each, 3 or 4 */
    const uint32_t *corner, *twin;       /* uint32_t[sides count] */
    const uint32_t *component;           /* uint32_t[count] */
} faces;

static uint32_t next_side(uint32_t sides, uint32_t h) { return h - h % sides + (h + 1) % sides; }

/* Counts the boundary loops of each component. */
static void tally_loops(qw_env *env, const faces *m, tally *t)
{
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, (size_t)m->sides * m->count);
    for (uint32_t h = 0; h < m->sides * m->count; h++) {
        if (m->twin[h] != QW_NONE || seen[h]) continue;
        t[m->component[h / m->sides]].loops++;
        for (uint32_t g = h; !seen[g];) {
            seen[g] = 1;
            for (g = next_side(m->sides, g); m->twin[g] != QW_NONE;) g = next_side(m->sides, m->twin[g]);
        }
    }
    qw_free(env, seen);
}

/* Twice the Euler characteristic, face by face: 2 for itself, 2 a vertex not seen before, less 2 an edge, or 1 where
 * the other face takes the rest. */
static void tally_faces(qw_env *env, const faces *m, tally *t)
{
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    uint32_t n = m->sides, all_open = 0;
    for (uint32_t f = 0; f < m->count; f++) {
        uint32_t fresh = 0, open = 0;
        for (uint32_t h = n * f; h < n * f + n; h++) {
            fresh += !seen[m->corner[h]];
            open += m->twin[h] == QW_NONE;
            seen[m->corner[h]] = 1;
        }
        t[m->component[f]].faces++;
        t[m->component[f]].twice_euler += 2 + 2 * (int64_t)fresh - n - open;
        all_open += open;
    }
    qw_free(env, seen);
    if (all_open) tally_loops(env, m, t);
}

static void tally_pieces(qw_env *env, const qw_quadmesh *q, const uint32_t *component, tally *t)
{
    uint32_t *piece = QW_NEW(env, uint32_t, q->face_count), count = 0;
    qw_label_components(env, 4, q->twin, q->face_count, piece);
    for (uint32_t f = 0; f < q->face_count; f++)
        if (piece[f] == count) t[component[f]].pieces++, count++;
    qw_free(env, piece);
}

/* Counts the quads of each component with a side that another has too, or with two equal corners. */
static void tally_doubles(qw_env *env, const qw_quadmesh *q, const uint32_t *component, tally *t)
{
    uint8_t *doubled = QW_NEW(env, uint8_t, (size_t)4 * q->face_count);
    qw_quadmesh_double_edges(env, q, doubled);
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *c = q->corner + 4 * f;
        const uint8_t *d = doubled + 4 * f;
        t[component[f]].doubles += d[0] || d[1] || d[2] || d[3] || c[0] == c[2] || c[1] == c[3];
    }
    qw_free(env, doubled);
}

static tally *tally_surface(qw_env *env, const qw_trimesh *s, uint32_t *components)
{
    assert(s->twin && components);
    uint32_t *component = QW_NEW(env, uint32_t, s->face_count);
    *components = qw_label_components(env, 3, s->twin, s->face_count, component);
    tally *t = QW_NEW_ZERO(env, tally, *components);
    tally_faces(env, &(faces){3, s->face_count, s->vertex_count, s->corner, s->twin, component}, t);
    qw_free(env, component);
    return t;
}

/* Counts of each component of the quads: tally[components], in the current scope. */
static tally *tally_quads(qw_env *env, const qw_quadmesh *q, uint32_t components)
{
    tally *t = QW_NEW_ZERO(env, tally, components);
    uint32_t *component = QW_NEW(env, uint32_t, q->face_count);
    for (uint32_t f = 0; f < q->face_count; f++) component[f] = q->component[q->corner[4 * f]];
    tally_faces(env, &(faces){4, q->face_count, q->vertex_count, q->corner, q->twin, component}, t);
    tally_pieces(env, q, component, t);
    tally_doubles(env, q, component, t);
    qw_free(env, component);
    return t;
}

qw_topology_check qw_check_topology(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface)
{
    assert(quads->component && surface->twin);
    qw_topology_check check = {0};
    tally *want = tally_surface(env, surface, &check.component_count);
    tally *have = tally_quads(env, quads, check.component_count);
    check.broken = QW_NEW(env, uint8_t, check.component_count);
    for (uint32_t c = 0; c < check.component_count; c++) {
        /* too few for a closed component, though no edge may be double: two quads of a torus on the same corners */
        bool too_few = have[c].loops == 0 &&
                       have[c].faces < (have[c].twice_euler == 4 ? QW_LEAST_SHELL : QW_LEAST_HANDLED);
        bool differs = have[c].pieces != 1 || have[c].twice_euler != want[c].twice_euler ||
                       have[c].loops != want[c].loops;
        check.broken[c] = differs || have[c].doubles > 0 || too_few;
        check.broken_count += check.broken[c];
    }
    qw_free(env, want), qw_free(env, have);
    return check;
}

/* ---- where it went wrong */

static qw_trimesh view_of(const qw_offset_mesh *m)
{
    return (qw_trimesh){.vertex_count = m->vertex_count,
                        .face_count = m->face_count,
                        .position = m->position,
                        .corner = m->corner,
                        .twin = m->twin,
                        .mark = m->mark};
}

static void add_site(const qw_offset_mesh *m, qw_sites *l, uint32_t v)
{
    for (uint32_t i = 0; i < l->count; i++)
        if (qw_distance(l->point[i], m->position[v]) < l->size[i]) return;
    l->point[l->count] = m->position[v];
    l->size[l->count++] = m->size[v];
}

/* Euler characteristic of each class as a complex of zero edges and triangles; a disc (or a tree) has 1.
 * int32_t[vertex_count] at the names. */
static int32_t *class_euler(qw_env *env, const qw_offset_mesh *m, const uint32_t *class_of)
{
    assert(m->twin && class_of);
    int32_t *euler = QW_NEW_ZERO(env, int32_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) euler[class_of[v]]++;
    for (uint32_t e = 0; e < m->edge_count; e++)
        if (qw_int2_is_zero(m->d[e])) euler[class_of[m->corner[m->half[e]]]]--;
    for (uint32_t f = 0; f < m->face_count; f++)
        if (qw_int2_is_zero(m->d[m->edge[3 * f]]) && qw_int2_is_zero(m->d[m->edge[3 * f + 1]]))
            euler[class_of[m->corner[3 * f]]]++;
    return euler;
}

qw_sites qw_find_lost_topology(qw_env *env, const qw_offset_mesh *m, const qw_extraction *x)
{
    assert(x->class_of && x->vertex_class && x->quads.vertex_count <= 4 * x->quads.face_count);
    qw_sites l = {0, QW_NEW(env, qw_vec3, QW_MOST_SITES), QW_NEW(env, float, QW_MOST_SITES), 0};
    int32_t *euler = class_euler(env, m, x->class_of);
    uint32_t *fans = QW_NEW_ZERO(env, uint32_t, m->vertex_count);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) fans[x->vertex_class[v]]++;
    for (uint32_t f = 0; f < m->face_count && l.count < QW_MOST_SITES; f++)
        if (qw_offset_det(m, f) < 0) add_site(m, &l, m->corner[3 * f]);
    for (uint32_t v = 0; v < m->vertex_count && l.count < QW_MOST_SITES; v++) {
        uint32_t c = x->class_of[v];
        if (fans[c] > 1 || (fans[c] == 0 && euler[c] != 1)) add_site(m, &l, v);
    }
    qw_trimesh surface = view_of(m);
    qw_census census = qw_trimesh_census(env, &surface);
    uint8_t *has_quads = QW_NEW_ZERO(env, uint8_t, (size_t)census.components);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) has_quads[x->quads.component[v]] = 1;
    for (uint32_t f = 0; f < m->face_count && l.count < QW_MOST_SITES; f++)
        if (!has_quads[census.component[f]]) add_site(m, &l, m->corner[3 * f]);
    qw_free(env, euler), qw_free(env, fans), qw_free(env, census.component), qw_free(env, has_quads);
    return l;
}

/* ---- components that are rebuilt */

/* The quads with their broken components replaced by those of `fresh`. */
static qw_quadmesh with_fresh(qw_env *env, const qw_quadmesh *quads, const qw_topology_check *check,
                              const qw_quadmesh *fresh)
{
    uint8_t *whole = QW_NEW(env, uint8_t, check->component_count);
    for (uint32_t c = 0; c < check->component_count; c++) whole[c] = !check->broken[c];
    qw_quadmesh r = qw_pick_components(env, quads, whole, fresh);
    qw_append_quads(&r, fresh);
    return r;
}

/* Sets a vertex to its least-squares position if its class is one vertex of the quads and of the contracted triangles
   and none of these is inverted. Near inverted triangles that position is unreliable, so the vertex stays where it is
   on the surface. */
static void take_positions(qw_env *env, const qw_extraction *x, const qw_vec3 *position, uint32_t members,
                           const uint32_t *vertex_of, const uint8_t *hypotenuse, qw_edit *e)
{
    assert(x->class_of && x->vertex_class && hypotenuse);
    uint8_t *loose = QW_NEW_ZERO(env, uint8_t, e->vertex_count);
    uint32_t *fan = QW_NEW(env, uint32_t, members), *cluster = QW_NEW(env, uint32_t, members);
    enum { MANY = 0xfffffffe };
    for (uint32_t f = 0; f < e->face_count; f++) {
        const uint8_t *across = hypotenuse + 4 * (size_t)f;
        for (uint32_t i = 0; i < 3 && !qw_edit_dead(e, f); i++)
            loose[e->face[f].corner[i]] |= !(across[0] || across[1] || across[2]);
    }
    memset(fan, 0xff, members * sizeof *fan), memset(cluster, 0xff, members * sizeof *cluster);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) {
        uint32_t c = x->vertex_class[v];
        fan[c] = fan[c] == QW_NONE ? v : MANY;
    }
    for (uint32_t v = 0; v < members; v++) {
        uint32_t c = x->class_of[v];
        if (vertex_of[v] != QW_NONE && cluster[c] != vertex_of[v])
            cluster[c] = cluster[c] == QW_NONE ? vertex_of[v] : MANY;
    }
    for (uint32_t c = 0; c < members; c++)
        if (fan[c] < MANY && cluster[c] < MANY && !loose[cluster[c]]) e->vertex[cluster[c]].position = position[fan[c]];
    qw_free(env, loose), qw_free(env, fan), qw_free(env, cluster);
}

qw_replacement qw_replace_components(qw_env *env, const qw_quadmesh *quads, const qw_offset_mesh *m,
                                     const qw_extraction *x, const qw_vec3 *position, const qw_topology_check *check)
{
    assert(quads->component && position && check->broken && check->broken_count > 0);
    qw_scope_begin(env);
    qw_replacement r = {0};
    qw_trimesh surface = view_of(m);
    qw_census census = qw_trimesh_census(env, &surface);
    uint8_t *hypotenuse;
    uint32_t *vertex_of, *from;
    qw_edit e = qw_contract(env, m, census.component, check->broken, &hypotenuse, &vertex_of);
    take_positions(env, x, position, m->vertex_count, vertex_of, hypotenuse, &e);
    qw_quadmesh fresh = qw_pair_triangles(env, &e, hypotenuse, &from, &r.pairs);
    r.quads = with_fresh(env, quads, check, &fresh);
    qw_topology_check again = qw_check_topology(env, &r.quads, &surface);
    if (again.broken_count) { /* components of so few triangles that all pairs share their corners, or none can be found
                               */
        e = qw_contract(env, m, census.component, again.broken, &hypotenuse, &vertex_of);
        fresh = qw_cut_triangles(env, &e);
        r.quads = with_fresh(env, &r.quads, &again, &fresh);
    }
    r.cut_components = again.broken_count;
    qw_keep_quads(env, &r.quads);
    qw_scope_end(env);
    return r;
}
