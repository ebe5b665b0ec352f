#include "quad/topology.h"

#include "mesh/working.h"

#include <math.h>
#include <string.h>

/* ---- counts a component */

typedef struct tally {
    int64_t euler, loops, pieces, faces, doubles;
} tally;

static uint32_t root_of(uint32_t *parent, uint32_t x)
{
    while (parent[x] != x) x = parent[x] = parent[parent[x]];
    return x;
}

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
    uint32_t *parent = QW_NEW(env, uint32_t, face_count);
    for (uint32_t f = 0; f < face_count; f++) {
        parent[f] = f;
        t[component[f]].faces++, t[component[f]].euler++, t[component[f]].pieces++;
    }
    for (uint32_t h = 0; h < n * face_count; h++) {
        if (twin[h] != QW_NONE && twin[h] < h) continue;
        t[component[h / n]].euler--;
        if (twin[h] == QW_NONE) continue;
        uint32_t a = root_of(parent, h / n), b = root_of(parent, twin[h] / n);
        if (a == b) continue;
        parent[a < b ? b : a] = a < b ? a : b;
        t[component[h / n]].pieces--;
    }
    tally_loops(env, n, face_count, twin, component, t);
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
        check.broken[c] = have[c].pieces != 1 || have[c].euler != want[c].euler || have[c].loops != want[c].loops || have[c].doubles > 0;
        check.broken_count += check.broken[c];
    }
    qw_free(env, want), qw_free(env, have), qw_free(env, census.component);
    return check;
}

/* ---- where it went wrong */

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
    enum { MOST = 256 };
    qw_losses l = {0, QW_NEW(env, qw_vec3, MOST), QW_NEW(env, float, MOST)};
    int32_t *euler = class_euler(env, m, x->class_of);
    uint32_t *fans = QW_NEW_ZERO(env, uint32_t, m->vertex_count);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) fans[x->vertex_class[v]]++;
    for (uint32_t f = 0; f < m->face_count && l.count < MOST; f++)
        if (qw_offset_det(m, f) < 0) add_loss(m, &l, m->corner[3 * f]);
    for (uint32_t v = 0; v < m->vertex_count && l.count < MOST; v++) {
        uint32_t c = x->class_of[v];
        if (fans[c] > 1 || (fans[c] == 0 && euler[c] != 1)) add_loss(m, &l, v);
    }
    qw_trimesh view = {.vertex_count = m->vertex_count, .face_count = m->face_count, .position = m->position, .corner = m->corner, .twin = m->twin};
    qw_census census = qw_trimesh_census(env, &view);
    uint8_t *has_quads = QW_NEW_ZERO(env, uint8_t, (size_t)census.components);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) has_quads[x->quads.component[v]] = 1;
    for (uint32_t f = 0; f < m->face_count && l.count < MOST; f++)
        if (!has_quads[census.component[f]]) add_loss(m, &l, m->corner[3 * f]);
    qw_free(env, euler), qw_free(env, fans), qw_free(env, census.component), qw_free(env, has_quads);
    return l;
}

/* ---- the last resort */

/* The broken components of the surface as a mesh of their own; *from: component of each of its components, in order. */
static qw_trimesh broken_part(qw_env *env, const qw_trimesh *s, const qw_census *census, const qw_topology_check *check, uint32_t **vertex_of,
                              uint32_t **from)
{
    qw_trimesh part = {0};
    uint32_t *face = QW_NEW(env, uint32_t, s->face_count), *vertex = QW_NEW(env, uint32_t, s->vertex_count), seen = 0;
    *from = QW_NEW(env, uint32_t, check->component_count);
    *vertex_of = QW_NEW(env, uint32_t, s->vertex_count);
    memset(vertex, 0xff, s->vertex_count * sizeof *vertex);
    uint8_t *named = QW_NEW_ZERO(env, uint8_t, check->component_count);
    for (uint32_t f = 0; f < s->face_count; f++) {
        uint32_t c = census->component[f];
        face[f] = check->broken[c] ? part.face_count++ : QW_NONE;
        if (check->broken[c] && !named[c]) named[c] = 1, (*from)[seen++] = c;
    }
    part.corner = QW_NEW(env, uint32_t, (size_t)3 * part.face_count);
    part.twin = QW_NEW(env, uint32_t, (size_t)3 * part.face_count);
    part.mark = QW_NEW_ZERO(env, uint8_t, (size_t)3 * part.face_count);
    part.position = QW_NEW(env, qw_vec3, s->vertex_count);
    for (uint32_t h = 0; h < 3 * s->face_count; h++) {
        if (face[h / 3] == QW_NONE) continue;
        uint32_t v = s->corner[h], to = 3 * face[h / 3] + h % 3;
        if (vertex[v] == QW_NONE) {
            part.position[part.vertex_count] = s->position[v];
            (*vertex_of)[part.vertex_count] = v;
            vertex[v] = part.vertex_count++;
        }
        part.corner[to] = vertex[v];
        part.twin[to] = s->twin[h] == QW_NONE ? QW_NONE : 3 * face[s->twin[h] / 3] + s->twin[h] % 3;
        if (s->mark) part.mark[to] = s->mark[h];
    }
    qw_free(env, face), qw_free(env, vertex), qw_free(env, named);
    return part;
}

static qw_quadmesh without_broken(qw_env *env, const qw_quadmesh *q, const qw_topology_check *check, uint32_t more_vertices, uint32_t more_faces)
{
    qw_quadmesh r = {0};
    uint32_t *face = QW_NEW(env, uint32_t, q->face_count), *vertex = QW_NEW(env, uint32_t, q->vertex_count);
    size_t vertices = (size_t)q->vertex_count + more_vertices, sides = 4 * ((size_t)q->face_count + more_faces);
    r.position = QW_NEW(env, qw_vec3, vertices), r.kind = QW_NEW_ZERO(env, uint8_t, vertices), r.component = QW_NEW(env, uint32_t, vertices);
    r.corner = QW_NEW(env, uint32_t, sides), r.twin = QW_NEW(env, uint32_t, sides), r.mark = QW_NEW_ZERO(env, uint8_t, sides);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        vertex[v] = QW_NONE;
        if (check->broken[q->component[v]]) continue;
        r.position[r.vertex_count] = q->position[v], r.kind[r.vertex_count] = q->kind[v], r.component[r.vertex_count] = q->component[v];
        vertex[v] = r.vertex_count++;
    }
    for (uint32_t f = 0; f < q->face_count; f++) face[f] = check->broken[q->component[q->corner[4 * f]]] ? QW_NONE : r.face_count++;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        if (face[h / 4] == QW_NONE) continue;
        uint32_t to = 4 * face[h / 4] + h % 4, t = q->twin[h];
        r.corner[to] = vertex[q->corner[h]], r.mark[to] = q->mark[h];
        r.twin[to] = t == QW_NONE ? QW_NONE : 4 * face[t / 4] + t % 4;
    }
    qw_free(env, face), qw_free(env, vertex);
    return r;
}

/* Vertex at the middle of h's edge, made on the first visit from either side. */
static uint32_t middle_of(const qw_trimesh *t, uint32_t h, uint32_t base, uint32_t *middle, qw_quadmesh *r)
{
    uint32_t twin = t->twin[h];
    if (middle[h] != QW_NONE) return middle[h];
    uint32_t v = r->vertex_count++, a = base + t->corner[h], b = base + t->corner[qw_next(h)];
    r->position[v] = qw_lerp(r->position[a], r->position[b], 0.5f);
    r->kind[v] = twin == QW_NONE || (t->mark && t->mark[h]) ? QW_VERTEX_CURVE : QW_VERTEX_FREE;
    r->component[v] = r->component[a];
    middle[h] = v;
    if (twin != QW_NONE) middle[twin] = v;
    return v;
}

/* Three quads a triangle: (corner, middle of the edge ahead, centre, middle of the edge behind) for each corner. */
static void append_triangles(qw_env *env, const qw_trimesh *t, const uint32_t *component, qw_quadmesh *r)
{
    uint32_t base = r->vertex_count, first = r->face_count;
    uint32_t *middle = QW_NEW(env, uint32_t, (size_t)3 * t->face_count);
    memset(middle, 0xff, (size_t)3 * t->face_count * sizeof *middle);
    for (uint32_t v = 0; v < t->vertex_count; v++) r->position[base + v] = t->position[v], r->kind[base + v] = QW_VERTEX_FREE;
    for (uint32_t h = 0; h < 3 * t->face_count; h++) {
        bool curve = t->twin[h] == QW_NONE || (t->mark && t->mark[h]);
        r->component[base + t->corner[h]] = component[h / 3];
        if (curve) r->kind[base + t->corner[h]] = r->kind[base + t->corner[qw_next(h)]] = QW_VERTEX_CURVE;
    }
    r->vertex_count += t->vertex_count;
    for (uint32_t f = 0; f < t->face_count; f++) {
        uint32_t center = r->vertex_count++;
        const uint32_t *c = t->corner + 3 * f;
        qw_vec3 sum = qw_add(qw_add(t->position[c[0]], t->position[c[1]]), t->position[c[2]]);
        r->position[center] = qw_scale(sum, 1.0f / 3), r->kind[center] = QW_VERTEX_FREE, r->component[center] = component[f];
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t h = 3 * f + i, back = qw_prev(h), q = 4 * r->face_count++;
            r->corner[q] = base + c[i], r->corner[q + 1] = middle_of(t, h, base, middle, r);
            r->corner[q + 2] = center, r->corner[q + 3] = middle_of(t, back, base, middle, r);
            /* side 0 and the neighbour's side 3 are halves of the edge; sides 1 and 2 meet the triangle's own quads */
            r->twin[q] = t->twin[h] == QW_NONE ? QW_NONE : 4 * (first + qw_next(t->twin[h])) + 3;
            r->twin[q + 1] = 4 * (first + qw_next(h)) + 2;
            r->twin[q + 2] = 4 * (first + back) + 1;
            r->twin[q + 3] = t->twin[back] == QW_NONE ? QW_NONE : 4 * (first + t->twin[back]);
            r->mark[q] = t->mark ? t->mark[h] : 0, r->mark[q + 3] = t->mark ? t->mark[back] : 0;
        }
    }
    qw_free(env, middle);
}

qw_quadmesh qw_replace_components(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const float *size,
                                  const qw_topology_check *check)
{
    qw_census census = qw_trimesh_census(env, surface);
    uint32_t *vertex_of, *from;
    qw_trimesh part = broken_part(env, surface, &census, check, &vertex_of, &from);
    float *target = QW_NEW(env, float, part.vertex_count);
    /* a triangle of area 3 size^2 becomes three quads of area size^2 */
    for (uint32_t v = 0; v < part.vertex_count; v++) target[v] = 2.6f * size[vertex_of[v]];
    qw_working coarse = qw_working_mesh(env, &part, target);
    qw_census coarse_census = qw_trimesh_census(env, &coarse.mesh), part_census = qw_trimesh_census(env, &part);
    if (coarse_census.components != part_census.components)
        qw_fail(env, QW_INTERNAL, -1, "the coarse mesh of a broken part has %lld components instead of %lld", (long long)coarse_census.components,
                (long long)part_census.components);
    /* components of the coarse mesh may be numbered anew: all that matters is that they are told apart */
    for (uint32_t f = 0; f < coarse.mesh.face_count; f++) coarse_census.component[f] = from[coarse_census.component[f]];
    uint32_t faces = coarse.mesh.face_count;
    qw_quadmesh r = without_broken(env, quads, check, coarse.mesh.vertex_count + 4 * faces, 3 * faces);
    append_triangles(env, &coarse.mesh, coarse_census.component, &r);
    return r;
}
