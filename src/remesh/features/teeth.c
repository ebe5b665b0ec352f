#include "remesh/features/teeth.h"

#include "geometry/corners.h"
#include "base/constants.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Corners of curves turn by more than 35 degrees, cosine, as those that the working mesh keeps. */
/* Cosine between the normals on either side of an edge that is sharp: a move along the surface would leave it. */
static const float SHARP_COSINE = 0.5f;
/* Least area of a triangle, in its own at first, and farthest that a vertex goes, in edges. */
static const float LEAST_AREA = 0.05f, FARTHEST = 0.5f;
enum { SWEEPS = 40 };

typedef enum role { STAYS, TOOTH, BETWEEN } role; /* BETWEEN: on the way from one tooth to the next corner */

typedef struct teeth {
    const qw_trimesh *mesh;
    const qw_curve_ends *ends;
    const qw_vec3 *normal;    /* qw_vec3[vertex_count] */
    const uint32_t *outgoing; /* uint32_t[vertex_count] */
    qw_vec3 *position;        /* qw_vec3[vertex_count]: where they go; mesh has where they were */
    uint8_t *role;            /* uint8_t[vertex_count] */
    float edge;
} teeth;

/* Which way the curve turns at v on the way from a: 1 left, -1 right, 0 if it goes on, or ends. */
static int turn_at(const teeth *t, uint32_t from, uint32_t v)
{
    if (t->ends[v].count != 2) return 0;
    uint32_t to = qw_curve_beyond(t->ends, from, v);
    const qw_vec3 *p = t->mesh->position;
    if (!qw_turns_sharply(p[from], p[v], p[to], (float)QW_BENT_COSINE)) return 0;
    return qw_dot(qw_cross(qw_sub(p[v], p[from]), qw_sub(p[to], p[v])), t->normal[v]) > 0 ? 1 : -1;
}

/* The way the next corner turns on the way from v by way of `next`, within an edge; 0: there is none. Where `marks` is
   set, vertices on the way that stay so far are BETWEEN. */
static int next_turn(teeth *t, uint32_t v, uint32_t next, bool marks)
{
    assert(v < t->mesh->vertex_count);
    float length = 0;
    for (uint32_t from = v;;) {
        length += qw_distance(t->mesh->position[from], t->mesh->position[next]);
        if (length > t->edge || next == v || t->ends[next].count != 2) return 0;
        int turn = turn_at(t, from, next);
        if (turn != 0) return turn;
        if (marks && t->role[next] == STAYS) t->role[next] = BETWEEN;
        uint32_t after = qw_curve_beyond(t->ends, from, next);
        from = next, next = after;
    }
}

/* Whether no sharp edge is at v: all faces around it lie near one plane, or nearly so. */
static bool is_soft(const teeth *t, uint32_t v)
{
    assert(v < t->mesh->vertex_count);
    uint32_t first = t->outgoing[v], h = first;
    do {
        if (qw_dot(qw_normalize(qw_face_cross(t->mesh, h / 3)), t->normal[v]) < SHARP_COSINE) return false;
        h = qw_around(t->mesh, h);
    } while (h != QW_NONE && h != first);
    return true;
}

/* Marks the vertices of curves that turn to one side between two that turn to the other. Returns how many. */
static uint32_t find_teeth(teeth *t)
{
    uint32_t count = 0;
    for (uint32_t v = 0; v < t->mesh->vertex_count; v++) {
        if (t->ends[v].count != 2) continue;
        const uint32_t *other = t->ends[v].other;
        int turn = turn_at(t, other[0], v);
        if (turn == 0 || next_turn(t, v, other[1], false) != -turn || next_turn(t, v, other[0], false) != turn)
            continue;
        t->role[v] = TOOTH, count++;
    }
    for (uint32_t v = 0; v < t->mesh->vertex_count && count > 0; v++) {
        if (t->role[v] != TOOTH) continue;
        for (int k = 0; k < 2; k++) next_turn(t, v, t->ends[v].other[k], true);
    }
    return count;
}

/* Whether the triangles around v are no worse than they may be with v at p. */
static bool may_lie_at(const teeth *t, uint32_t v, qw_vec3 p)
{
    assert(v < t->mesh->vertex_count);
    uint32_t first = t->outgoing[v], h = first;
    do {
        const uint32_t *c = t->mesh->corner + 3 * (size_t)(h / 3);
        qw_vec3 now[3], before = qw_face_cross(t->mesh, h / 3);
        for (int i = 0; i < 3; i++) now[i] = c[i] == v ? p : t->position[c[i]];
        qw_vec3 cross = qw_cross(qw_sub(now[1], now[0]), qw_sub(now[2], now[0]));
        if (!(qw_dot(cross, before) > LEAST_AREA * qw_length2(before))) return false;
        h = qw_around(t->mesh, h);
    } while (h != QW_NONE && h != first);
    return true;
}

/* Half the way to the middle between its neighbours, along the surface. */
static void smooth_vertex(teeth *t, uint32_t v)
{
    const uint32_t *other = t->ends[v].other;
    qw_vec3 from = t->position[v], middle = qw_lerp(t->position[other[0]], t->position[other[1]], 0.5f),
            step = qw_reject(qw_scale(qw_sub(middle, from), 0.5f), t->normal[v]), to = qw_add(from, step);
    if (qw_distance(to, t->mesh->position[v]) > FARTHEST * t->edge || !may_lie_at(t, v, to)) return;
    t->position[v] = to;
}

uint32_t qw_smooth_teeth(qw_env *env, qw_trimesh *mesh, double edge, bool with_boundary, const uint8_t *held)
{
    assert(mesh->twin && edge > 0);
    qw_scope_begin(env);
    teeth t = {.mesh = mesh, .edge = (float)edge};
    uint32_t n = mesh->vertex_count;
    t.ends = qw_find_curve_ends(env, mesh, with_boundary);
    bool has_curves = false;
    for (uint32_t v = 0; v < n && !has_curves; v++) has_curves = t.ends[v].count == 2;
    uint32_t count = 0;
    if (has_curves) {
        t.normal = qw_vertex_normals(env, mesh), t.outgoing = qw_trimesh_outgoing(env, mesh);
        t.role = QW_NEW_ZERO(env, uint8_t, n);
        count = find_teeth(&t);
    }
    if (count > 0) {
        t.position = memcpy(QW_NEW(env, qw_vec3, n), mesh->position, n * sizeof(qw_vec3));
        for (uint32_t v = 0; v < n; v++)
            if (t.role[v] != STAYS && ((held && held[v]) || !is_soft(&t, v))) t.role[v] = STAYS;
        for (int i = 0; i < SWEEPS; i++)
            for (uint32_t v = 0; v < n; v++)
                if (t.role[v] != STAYS) smooth_vertex(&t, v);
        mesh->position = t.position;
        qw_keep(env, t.position);
    }
    qw_scope_end(env);
    return count;
}
