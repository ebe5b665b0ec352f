#include "geometry/quadmesh.h"

#include "geometry/edges.h"

#include <assert.h>
#include <string.h>

double qw_sum_of_sides(const qw_quadmesh *mesh)
{
    double sum = 0;
    for (uint32_t h = 0; h < 4 * mesh->face_count; h++)
        sum += (double)qw_distance(mesh->position[mesh->corner[h]], mesh->position[mesh->corner[qw_quad_next(h)]]);
    return sum;
}

void qw_quadmesh_link(qw_env *env, qw_quadmesh *quads)
{
    uint32_t fault;
    quads->twin = qw_find_twins(env, 4, quads->corner, quads->face_count, quads->vertex_count, &fault);
    if (fault != QW_NONE)
        qw_fail(env, QW_INTERNAL, fault / 4, "the edge of half-edge %u has sides that do not pair up", fault);
}

uint32_t *qw_quadmesh_outgoing(qw_env *env, const qw_quadmesh *mesh)
{
    assert(mesh->corner && mesh->twin);
    uint32_t *out = QW_NEW(env, uint32_t, mesh->vertex_count);
    memset(out, 0xff, mesh->vertex_count * sizeof *out);
    for (uint32_t h = 0; h < 4 * mesh->face_count; h++)
        if (out[mesh->corner[h]] == QW_NONE || mesh->twin[h] == QW_NONE) out[mesh->corner[h]] = h;
    return out;
}

uint32_t qw_quad_valence(const qw_quadmesh *mesh, uint32_t first, bool *on_boundary)
{
    assert(first < 4 * mesh->face_count && mesh->twin && on_boundary);
    uint32_t valence = 0, h = first;
    *on_boundary = false;
    do {
        valence++;
        h = qw_quad_around(mesh, h);
    } while (h != QW_NONE && h != first);
    if (h == QW_NONE) {
        *on_boundary = true;
        valence++;
    }
    return valence;
}

bool qw_quad_is_small_shell(const qw_quadmesh *mesh, uint32_t f, uint32_t most)
{
    assert(f < mesh->face_count && most <= QW_LEAST_SHELL);
    uint32_t list[QW_LEAST_SHELL] = {f}, count = 1;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t h = 4 * list[i]; h < 4 * list[i] + 4; h++) {
            if (mesh->twin[h] == QW_NONE) return false;
            uint32_t k = 0, other = mesh->twin[h] / 4;
            while (k < count && list[k] != other) k++;
            if (k < count) continue;
            if (count == most) return false;
            list[count++] = other;
        }
    return true;
}

/* The boundary half-edge that follows h along its loop: turn about its head. */
static uint32_t next_on_boundary(const qw_quadmesh *mesh, uint32_t h)
{
    uint32_t g = qw_quad_next(h);
    while (mesh->twin[g] != QW_NONE) g = qw_quad_next(mesh->twin[g]);
    return g;
}

/* How many boundary loops there are. */
static int64_t count_loops(qw_env *env, const qw_quadmesh *mesh)
{
    assert(mesh->twin);
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, (size_t)4 * mesh->face_count);
    int64_t loops = 0;
    for (uint32_t h = 0; h < 4 * mesh->face_count; h++) {
        if (mesh->twin[h] != QW_NONE || seen[h]) continue;
        loops++;
        for (uint32_t g = h; !seen[g]; g = next_on_boundary(mesh, g)) seen[g] = 1;
    }
    qw_free(env, seen);
    return loops;
}

/* ---- edges by their ends: those at each vertex in turn, found by its corners */

static bool is_first_side(const qw_quadmesh *mesh, uint32_t h) { return mesh->twin[h] == QW_NONE || h < mesh->twin[h]; }

static void mark_edge(const qw_quadmesh *mesh, uint32_t h, uint8_t *is_double)
{
    if (!is_double) return;
    is_double[h] = 1;
    if (mesh->twin[h] != QW_NONE) is_double[mesh->twin[h]] = 1;
}

/* The half-edge by which a vertex was last met, and from which other vertex. */
typedef struct spoke {
    uint32_t from, half;
} spoke;

/* Meets `to` from v by half-edge h of either direction; returns whether that is once more, or v itself. */
static bool meets_again(const qw_quadmesh *mesh, uint32_t v, uint32_t to, uint32_t h, spoke *met, uint8_t *is_double)
{
    assert(v < mesh->vertex_count && h < 4 * mesh->face_count);
    if (to != v && met[to].from != v) {
        met[to] = (spoke){v, h};
        return false;
    }
    mark_edge(mesh, h, is_double);
    if (to != v) mark_edge(mesh, met[to].half, is_double);
    return true;
}

int64_t qw_quadmesh_double_edges(qw_env *env, const qw_quadmesh *mesh, uint8_t *is_double)
{
    assert(mesh->twin && mesh->corner);
    uint32_t n = mesh->vertex_count, sides = 4 * mesh->face_count;
    uint32_t *first = QW_NEW(env, uint32_t, n),
             *next = QW_NEW(env, uint32_t, sides); /* lists of the corners of each vertex */
    spoke *met = QW_NEW(env, spoke, n);
    memset(first, 0xff, n * sizeof *first), memset(met, 0xff, n * sizeof *met);
    if (is_double) memset(is_double, 0, sides);
    for (uint32_t h = 0; h < sides; h++) {
        next[h] = first[mesh->corner[h]];
        first[mesh->corner[h]] = h;
    }
    int64_t doubles = 0; /* each is met from both ends */
    for (uint32_t v = 0; v < n; v++)
        for (uint32_t h = first[v]; h != QW_NONE; h = next[h]) {
            uint32_t before = qw_quad_prev(h);
            doubles += meets_again(mesh, v, mesh->corner[qw_quad_next(h)], h, met, is_double);
            if (mesh->twin[before] == QW_NONE)
                doubles += meets_again(mesh, v, mesh->corner[before], before, met, is_double);
        }
    qw_free(env, first), qw_free(env, next), qw_free(env, met);
    return doubles / 2;
}

static bool has_repeated_corner(const uint32_t *c)
{
    return c[0] == c[1] || c[0] == c[2] || c[0] == c[3] || c[1] == c[2] || c[1] == c[3] || c[2] == c[3];
}

qw_quad_census qw_quadmesh_census(qw_env *env, const qw_quadmesh *mesh)
{
    assert(mesh->twin);
    qw_quad_census c = {.faces = mesh->face_count};
    uint32_t *out = qw_quadmesh_outgoing(env, mesh);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (out[v] == QW_NONE) continue;
        bool on_boundary;
        uint32_t valence = qw_quad_valence(mesh, out[v], &on_boundary);
        c.vertices++;
        c.irregular += !on_boundary && valence != 4;
    }
    for (uint32_t h = 0; h < 4 * mesh->face_count; h++) c.edges += is_first_side(mesh, h);
    for (uint32_t f = 0; f < mesh->face_count; f++) c.degenerate_faces += has_repeated_corner(mesh->corner + 4 * f);
    uint32_t *component = QW_NEW(env, uint32_t, mesh->face_count);
    c.components = qw_label_components(env, 4, mesh->twin, mesh->face_count, component);
    c.boundary_loops = count_loops(env, mesh);
    c.double_edges = qw_quadmesh_double_edges(env, mesh, NULL);
    c.euler = c.vertices - c.edges + c.faces;
    qw_free(env, out), qw_free(env, component);
    return c;
}

void qw_quadmesh_validate(qw_env *env, const qw_quadmesh *mesh)
{
    assert(mesh->position && mesh->corner && mesh->twin);
    uint32_t sides = 4 * mesh->face_count;
    uint32_t *corners_at = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count), *out;
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t t = mesh->twin[h];
        if (mesh->corner[h] >= mesh->vertex_count)
            qw_fail(env, QW_INTERNAL, h, "corner %u of the quads is out of range", h);
        corners_at[mesh->corner[h]]++;
        if (t == QW_NONE) continue;
        if (t >= sides || mesh->twin[t] != h || mesh->corner[t] != mesh->corner[qw_quad_next(h)] ||
            mesh->corner[qw_quad_next(t)] != mesh->corner[h])
            qw_fail(env, QW_INTERNAL, h, "side %u of the quads and its twin disagree", h);
    }
    out = qw_quadmesh_outgoing(env, mesh);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (out[v] == QW_NONE) continue;
        bool on_boundary;
        uint32_t faces = qw_quad_valence(mesh, out[v], &on_boundary) - on_boundary;
        if (faces != corners_at[v]) qw_fail(env, QW_INTERNAL, v, "vertex %u of the quads has more than one fan", v);
    }
    qw_free(env, corners_at), qw_free(env, out);
}

qw_vec3 qw_quad_normal(const qw_quadmesh *mesh, uint32_t f)
{
    assert(f < mesh->face_count);
    return qw_normalize(qw_quad_cross(mesh->position, mesh->corner + 4 * (size_t)f));
}

qw_vec3 *qw_quadmesh_vertex_normals(qw_env *env, const qw_quadmesh *mesh)
{
    assert(mesh->position && mesh->corner);
    qw_vec3 *normal = QW_NEW_ZERO(env, qw_vec3, mesh->vertex_count);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        qw_vec3 n = qw_quad_normal(mesh, f);
        for (uint32_t i = 0; i < 4; i++) {
            uint32_t v = mesh->corner[4 * f + i];
            normal[v] = qw_add(normal[v], n);
        }
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++) normal[v] = qw_normalize(normal[v]);
    return normal;
}

qw_quadmesh qw_quadmesh_copy(qw_env *env, const qw_quadmesh *mesh, uint32_t more_vertices, uint32_t more_faces)
{
    assert(mesh->face_count < QW_NONE / 4 - more_faces);
    size_t vertices = mesh->vertex_count, sides = 4 * (size_t)mesh->face_count;
    size_t v = vertices + more_vertices, h = sides + 4 * (size_t)more_faces;
    qw_quadmesh n = {mesh->vertex_count,           mesh->face_count,
                     QW_NEW(env, qw_vec3, v),      QW_NEW(env, uint32_t, h),
                     QW_NEW(env, uint32_t, h),     QW_NEW_ZERO(env, uint8_t, v),
                     QW_NEW_ZERO(env, uint8_t, h), QW_NEW_ZERO(env, uint32_t, v)};
    memcpy(n.position, mesh->position, vertices * sizeof *n.position);
    memcpy(n.corner, mesh->corner, sides * sizeof *n.corner), memcpy(n.twin, mesh->twin, sides * sizeof *n.twin);
    if (mesh->kind) memcpy(n.kind, mesh->kind, vertices);
    if (mesh->mark) memcpy(n.mark, mesh->mark, sides);
    if (mesh->component) memcpy(n.component, mesh->component, vertices * sizeof *n.component);
    return n;
}
