/* Adjacency, invariants, census and normals of triangle surfaces. */
#include "geometry/trimesh.h"

#include "base/sort.h"
#include "geometry/edges.h"

#include <assert.h>
#include <string.h>

void qw_trimesh_link(qw_env *env, qw_trimesh *mesh)
{
    assert(mesh->corner && mesh->face_count < QW_NONE / 3);
    uint32_t fault;
    mesh->twin = qw_find_twins(env, 3, mesh->corner, mesh->face_count, mesh->vertex_count, &fault);
    if (fault != QW_NONE)
        qw_fail(env, QW_INTERNAL, fault, "link: the edge of half-edge %u has sides that do not pair up", fault);
}

/* ---- invariants */

/* Fails where corners are out of range or repeated, twins do not agree, or marks differ on two sides. */
static void validate_half_edges(qw_env *env, const qw_trimesh *mesh)
{
    const uint32_t *corner = mesh->corner, *twin = mesh->twin;
    uint32_t n = 3 * mesh->face_count;
    for (uint32_t h = 0; h < n; h++)
        if (corner[h] >= mesh->vertex_count)
            qw_fail(env, QW_INTERNAL, h / 3, "face %u names vertex %u of %u", h / 3, corner[h], mesh->vertex_count);
    for (uint32_t h = 0; h < n; h++) {
        uint32_t t = twin[h];
        if (corner[h] == corner[qw_next(h)])
            qw_fail(env, QW_INTERNAL, h / 3, "face %u repeats vertex %u", h / 3, corner[h]);
        if (t == QW_NONE) continue;
        if (t >= n) qw_fail(env, QW_INTERNAL, h, "half-edge %u has twin %u of %u", h, t, n);
        if (twin[t] != h)
            qw_fail(env, QW_INTERNAL, h, "half-edge %u has twin %u, but that one has twin %u", h, t, twin[t]);
        if (corner[t] != corner[qw_next(h)] || corner[qw_next(t)] != corner[h])
            qw_fail(env, QW_INTERNAL, h,
                    "half-edge %u and its twin %u do not run between the same vertices, one each way", h, t);
        if (mesh->mark && mesh->mark[h] != mesh->mark[t])
            qw_fail(env, QW_INTERNAL, h, "half-edges %u and %u are one edge but carry marks %d and %d", h, t,
                    mesh->mark[h], mesh->mark[t]);
    }
}

/* Walks the fan of v from its outgoing half-edge and returns its number of faces. seen[w] == v marks the neighbours
 * met. */
static uint32_t validate_fan(qw_env *env, const qw_trimesh *mesh, uint32_t v, uint32_t first, uint32_t *seen)
{
    assert(v < mesh->vertex_count && first < 3 * mesh->face_count);
    uint32_t size = 0, h = first;
    do {
        uint32_t w = mesh->corner[qw_next(h)];
        if (seen[w] == v) qw_fail(env, QW_INTERNAL, v, "two edges join vertices %u and %u", v, w);
        seen[w] = v;
        size++;
        uint32_t turned = qw_around(mesh, h);
        if (turned == QW_NONE && seen[mesh->corner[qw_prev(h)]] == v)
            qw_fail(env, QW_INTERNAL, v, "two edges join vertices %u and %u", v, mesh->corner[qw_prev(h)]);
        h = turned;
    } while (h != QW_NONE && h != first);
    return size;
}

void qw_trimesh_validate(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->position && mesh->corner && mesh->twin);
    validate_half_edges(env, mesh);
    qw_scope_begin(env);
    const uint32_t *outgoing = qw_trimesh_outgoing(env, mesh);
    uint32_t *faces = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count), *seen = QW_NEW(env, uint32_t, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) faces[mesh->corner[h]]++;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) seen[v] = QW_NONE;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (outgoing[v] == QW_NONE) qw_fail(env, QW_INTERNAL, v, "vertex %u belongs to no face", v);
        uint32_t fan = validate_fan(env, mesh, v, outgoing[v], seen);
        if (fan != faces[v])
            qw_fail(env, QW_INTERNAL, v, "vertex %u has %u faces, of which one fan holds %u", v, faces[v], fan);
        qw_vec3 p = mesh->position[v];
        if (!isfinite(p.x) || !isfinite(p.y) || !isfinite(p.z))
            qw_fail(env, QW_INTERNAL, v, "vertex %u is not finite", v);
    }
    qw_scope_end(env);
}

/* The last on the boundary, or else the first. */
uint32_t *qw_trimesh_outgoing(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->twin);
    uint32_t *outgoing = QW_NEW(env, uint32_t, mesh->vertex_count);
    const uint32_t *corner = mesh->corner, *twin = mesh->twin, n = 3 * mesh->face_count;
    memset(outgoing, 0xff, mesh->vertex_count * sizeof *outgoing); /* QW_NONE */
    for (uint32_t h = n; h-- > 0;) outgoing[corner[h]] = h;
    for (uint32_t h = 0; h < n; h++)
        if (twin[h] == QW_NONE) outgoing[corner[h]] = h;
    return outgoing;
}

/* ---- census */

/* A flood from face to face without a branch on what was reached before. queue: uint32_t[face_count + 1], scratch. */
static inline uint32_t flood(uint32_t sides, const uint32_t *twin, uint32_t face_count, uint32_t *component,
                             uint32_t *queue)
{
    assert(sides == 3 || sides == 4);
    uint32_t count = 0;
    for (uint32_t f = 0; f < face_count; f++) component[f] = QW_NONE;
    for (uint32_t seed = 0; seed < face_count; seed++) {
        if (component[seed] != QW_NONE) continue;
        uint32_t head = 0, tail = 0;
        component[queue[tail++] = seed] = count;
        while (head < tail) {
            uint32_t begin = sides * queue[head++];
            for (uint32_t h = begin; h < begin + sides; h++) {
                if (twin[h] == QW_NONE) continue;
                uint32_t f = queue[tail] = twin[h] / sides;
                tail += component[f] == QW_NONE;
                component[f] = count;
            }
        }
        count++;
    }
    return count;
}

uint32_t qw_label_components(qw_env *env, uint32_t sides, const uint32_t *twin, uint32_t face_count,
                             uint32_t *component)
{
    assert(sides == 3 || sides == 4);
    uint32_t *queue = QW_NEW(env, uint32_t, (size_t)face_count + 1);
    uint32_t count = sides == 3 ? flood(3, twin, face_count, component, queue)
                                : flood(4, twin, face_count, component, queue);
    qw_free(env, queue);
    return count;
}

qw_census qw_trimesh_census_of(qw_env *env, const qw_trimesh *mesh, uint32_t *component, uint32_t components)
{
    assert(mesh->twin && component && components > 0);
    qw_census census = {
        .vertices = mesh->vertex_count, .faces = mesh->face_count, .component = component, .components = components};
    qw_scope_begin(env);
    uint8_t *passed = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)mesh->face_count);
    int64_t boundary_edges = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (mesh->twin[h] != QW_NONE || passed[h]) continue;
        census.boundary_loops++;
        for (uint32_t g = h; !passed[g]; g = qw_next_on_boundary(mesh, g)) {
            passed[g] = 1;
            boundary_edges++;
        }
    }
    census.edges = (3 * census.faces + boundary_edges) / 2;
    census.euler = census.vertices - census.edges + census.faces;
    qw_scope_end(env);
    return census;
}

qw_census qw_trimesh_census(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->twin);
    uint32_t *component = QW_NEW(env, uint32_t, mesh->face_count);
    uint32_t components = qw_label_components(env, 3, mesh->twin, mesh->face_count, component);
    return qw_trimesh_census_of(env, mesh, component, components);
}

uint64_t *qw_list_topologies(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    assert(mesh->twin && census->component);
    uint64_t *of = QW_NEW_ZERO(env, uint64_t, (size_t)census->components); /* loops, and twice the Euler number */
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, mesh->vertex_count),
            *passed = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        bool is_boundary = mesh->twin[h] == QW_NONE;
        uint64_t loops = is_boundary && !passed[h];
        int64_t twice = 2 * !seen[mesh->corner[h]] - (is_boundary ? 2 : 1) + (h % 3 == 0 ? 2 : 0);
        seen[mesh->corner[h]] = 1;
        for (uint32_t g = h; is_boundary && !passed[g]; g = qw_next_on_boundary(mesh, g)) passed[g] = 1;
        of[census->component[h / 3]] += (loops << 32) + (uint64_t)twice;
    }
    qw_free(env, seen), qw_free(env, passed);
    qw_sort_u64(of, (size_t)census->components);
    return of;
}

/* ---- normals */

double qw_trimesh_area(const qw_trimesh *mesh)
{
    double sum = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) sum += 0.5 * qw_length(qw_face_cross(mesh, f));
    return sum;
}

typedef struct normal_job {
    const qw_trimesh *mesh;
    qw_vec3 *normal;
} normal_job;

static void face_normal_block(void *user, uint32_t begin, uint32_t end)
{
    const normal_job *job = user;
    for (uint32_t f = begin; f < end; f++) job->normal[f] = qw_normalize(qw_face_cross(job->mesh, f));
}

qw_vec3 *qw_face_normals(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->position && mesh->corner);
    normal_job job = {.mesh = mesh, .normal = QW_NEW(env, qw_vec3, mesh->face_count)};
    qw_parallel(env, mesh->face_count, QW_GRAIN_LIGHT, face_normal_block, &job);
    return job.normal;
}

qw_vec3 *qw_vertex_normals(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->position && mesh->corner);
    qw_vec3 *normal = QW_NEW_ZERO(env, qw_vec3, mesh->vertex_count);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        qw_vec3 cross = qw_face_cross(mesh, f);
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) normal[mesh->corner[h]] = qw_add(normal[mesh->corner[h]], cross);
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++) normal[v] = qw_normalize(normal[v]);
    return normal;
}
