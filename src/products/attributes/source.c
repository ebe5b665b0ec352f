#include "products/attributes/source.h"

#include "geometry/triangulate.h"

#include <assert.h>
#include <string.h>

/* What the clean surface says of each polygon. */
typedef struct polygon_facts {
    float *agreement; /* float[face_count]: above 0 where the clean surface faces as the polygon, below where not */
    uint8_t *ways;    /* uint8_t[face_count] of a skin: AS_IT_IS, TURNED or both, as of a sheet; NULL: it is no skin */
    uint32_t *component; /* uint32_t[face_count]: QW_NONE where cleaning left nothing of it */
    uint32_t *slot;      /* uint32_t[face_count]: of the component's own frame, or QW_NONE */
} polygon_facts;

enum facing { AS_IT_IS = 1, TURNED = 2 };
/* Of the width of the gaps that a wrap closes: a polygon that is no farther from the skin can be seen from outside. */
static const float SEEN = 0.25f;

typedef struct dvec {
    double c[3];
} dvec;

static dvec difference(const double *a, const double *b) { return (dvec){{a[0] - b[0], a[1] - b[1], a[2] - b[2]}}; }

static dvec cross(dvec a, dvec b)
{
    dvec r;
    for (int k = 0; k < 3; k++) r.c[k] = a.c[(k + 1) % 3] * b.c[(k + 2) % 3] - a.c[(k + 2) % 3] * b.c[(k + 1) % 3];
    return r;
}

static void to_frame(const qw_frame *frame, const double *position, double q[3])
{
    for (int k = 0; k < 3; k++) q[k] = (position[k] - frame->center[k]) * frame->scale;
}

/* Twice the area vector of a polygon, in the frame. */
static dvec area_of_polygon(const qw_clean_input *input, const qw_frame *frame, uint32_t f)
{
    const uint32_t *corner = input->corner + input->face_begin[f];
    uint32_t n = input->face_begin[f + 1] - input->face_begin[f];
    double origin[3], before[3], now[3];
    dvec sum = {{0, 0, 0}};
    to_frame(frame, input->position + 3 * (size_t)corner[0], origin);
    to_frame(frame, input->position + 3 * (size_t)corner[1], before);
    for (uint32_t i = 2; i < n; i++) {
        to_frame(frame, input->position + 3 * (size_t)corner[i], now);
        dvec c = cross(difference(before, origin), difference(now, origin));
        for (int k = 0; k < 3; k++) sum.c[k] += c.c[k], before[k] = now[k];
    }
    return sum;
}

static dvec area_of_clean(const qw_clean *clean, uint32_t t)
{
    double p[3][3];
    for (int i = 0; i < 3; i++) {
        qw_vec3 at = clean->mesh.position[clean->mesh.corner[3 * (size_t)t + (size_t)i]];
        if (qw_leave_own_frame(&clean->own, at, p[i])) continue;
        p[i][0] = at.x, p[i][1] = at.y, p[i][2] = at.z;
    }
    return cross(difference(p[1], p[0]), difference(p[2], p[0]));
}

/* Whether a clean triangle looks the way of a polygon, 1, or the other, -1; 0: neither. */
static int8_t way_of(const qw_clean_input *input, const qw_clean *clean, uint32_t f, uint32_t t)
{
    dvec polygon = area_of_polygon(input, &clean->frame, f), left = area_of_clean(clean, t);
    double dot = polygon.c[0] * left.c[0] + polygon.c[1] * left.c[1] + polygon.c[2] * left.c[2];
    return dot > 0 ? 1 : dot < 0 ? -1 : 0;
}

static void take_facts(polygon_facts *facts, const qw_clean *clean, const uint32_t *component, uint32_t f, uint32_t t,
                       int8_t way)
{
    facts->agreement[f] += way;
    if (facts->ways) facts->ways[f] |= way < 0 ? TURNED : AS_IT_IS;
    if (facts->component[f] != QW_NONE) return;
    facts->component[f] = component[t];
    facts->slot[f] = qw_own_frame_of(&clean->own, clean->mesh.position[clean->mesh.corner[3 * (size_t)t]]);
}

/* A skin has larger triangles than the input may have: polygons that are nearest to none of them, but near. */
static void find_seen(qw_env *env, const qw_clean_input *input, const qw_clean *clean, const uint32_t *component,
                      polygon_facts *facts)
{
    qw_bvh *bvh = qw_bvh_build(env, &clean->mesh);
    for (uint32_t f = 0; f < input->face_count; f++) {
        uint32_t begin = input->face_begin[f], end = input->face_begin[f + 1];
        double middle[3] = {0, 0, 0};
        if (f % 4096 == 0) qw_heartbeat(env);
        if (facts->component[f] != QW_NONE || end - begin < 3) continue;
        for (uint32_t c = begin; c < end; c++) {
            double q[3];
            to_frame(&clean->frame, input->position + 3 * (size_t)input->corner[c], q);
            for (int k = 0; k < 3; k++) middle[k] += q[k] / (end - begin);
        }
        qw_vec3 p = qw_v3_of_doubles(middle);
        qw_hit hit = qw_bvh_nearest(bvh, p, qw_v3(0, 0, 0), -1, SEEN * clean->wrapped, QW_NONE);
        if (hit.face != QW_NONE) take_facts(facts, clean, component, f, hit.face, way_of(input, clean, f, hit.face));
    }
}

typedef struct way_search {
    const qw_clean_input *input;
    const qw_clean *clean;
    int8_t *way; /* int8_t[clean triangles] */
} way_search;

static void find_ways(void *user, uint32_t begin, uint32_t end)
{
    const way_search *s = user;
    for (uint32_t t = begin; t < end; t++) s->way[t] = way_of(s->input, s->clean, s->clean->source_face[t], t);
}

/* For each polygon of the input: its component, how far it agrees with the cleaned surface and, of a wrap, which
   of its sides is seen. */
static polygon_facts find_facts(qw_env *env, const qw_clean_input *input, const qw_clean *clean,
                                const uint32_t *component)
{
    polygon_facts facts = {.agreement = QW_NEW_ZERO(env, float, input->face_count),
                           .ways = clean->wrapped > 0 ? QW_NEW_ZERO(env, uint8_t, input->face_count) : NULL,
                           .component = QW_NEW(env, uint32_t, input->face_count),
                           .slot = QW_NEW(env, uint32_t, input->face_count)};
    for (uint32_t f = 0; f < input->face_count; f++) facts.component[f] = facts.slot[f] = QW_NONE;
    way_search s = {input, clean, QW_NEW(env, int8_t, clean->mesh.face_count)};
    memset(s.way, 1, clean->mesh.face_count);
    if (clean->wrapped > 0 || clean->counts.flipped_triangles > 0) /* else none looks another way */
        qw_parallel(env, clean->mesh.face_count, 4096, find_ways, &s);
    for (uint32_t t = 0; t < clean->mesh.face_count; t++)
        take_facts(&facts, clean, component, clean->source_face[t], t, s.way[t]);
    qw_free(env, s.way);
    if (facts.ways) find_seen(env, input, clean, component, &facts);
    return facts;
}

/* Room for the vertices of the input, and behind them for three of each triangle that lies in a slot. */
static void place_vertices(qw_env *env, const qw_clean_input *input, const qw_clean *clean, size_t in_slots,
                           qw_trimesh *mesh)
{
    assert(clean->frame.scale > 0);
    mesh->vertex_count = input->vertex_count;
    mesh->position = QW_NEW(env, qw_vec3, input->vertex_count + 3 * in_slots);
    for (uint32_t v = 0; v < input->vertex_count; v++) {
        double q[3];
        to_frame(&clean->frame, input->position + 3 * (size_t)v, q);
        mesh->position[v] = qw_v3_of_doubles(q);
    }
}

/* The corners of triangle t become vertices of their own, in the slot. */
static void move_to_slot(const qw_clean_input *input, const qw_clean *clean, uint32_t slot, qw_trimesh *mesh,
                         uint32_t *corner)
{
    for (int i = 0; i < 3; i++) {
        double q[3];
        to_frame(&clean->frame, input->position + 3 * (size_t)corner[i], q);
        mesh->position[mesh->vertex_count] = qw_enter_own_frame(&clean->own, slot, q);
        corner[i] = mesh->vertex_count++;
    }
}

/* Triangle i with its corners in the order in which it faces as the polygon, or turned. */
static void take_triangle(qw_source *s, const qw_triangles *t, uint32_t i, bool turned, const uint32_t *place)
{
    uint32_t kept = s->mesh.face_count++;
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t v = t->corner[3 * (size_t)i + (turned && k ? 3 - k : k)];
        s->mesh.corner[3 * (size_t)kept + k] = v, s->corner[3 * (size_t)kept + k] = place[v];
    }
    s->face[kept] = t->source[i];
}

/* Takes over the triangles of polygons that are left; counts those in slots. `place` is scratch:
 * uint32_t[input->vertex_count]. */
static size_t take_triangles(const qw_clean_input *input, const qw_triangles *t, const polygon_facts *facts,
                             uint32_t *place, qw_source *s)
{
    size_t in_slots = 0;
    uint32_t known = QW_NONE; /* known: the polygon whose corners `place` tells */
    for (uint32_t i = 0; i < t->count; i++) {
        uint32_t f = t->source[i], first = s->mesh.face_count;
        if (facts->component[f] == QW_NONE) continue;
        if (f != known)
            for (uint32_t c = input->face_begin[f + 1]; c-- > input->face_begin[f];) place[input->corner[c]] = c;
        known = f;
        if (facts->ways ? facts->ways[f] & AS_IT_IS : facts->agreement[f] >= 0) take_triangle(s, t, i, false, place);
        if (facts->ways ? facts->ways[f] & TURNED : facts->agreement[f] < 0) take_triangle(s, t, i, true, place);
        for (uint32_t k = first; k < s->mesh.face_count; k++)
            s->component[k] = facts->component[f], in_slots += facts->slot[f] != QW_NONE;
    }
    return in_slots;
}

qw_source qw_source_build(qw_env *env, const qw_clean_input *input, const qw_clean *clean, const uint32_t *component)
{
    assert(input->face_count > 0 && clean->source_face && component && clean->frame.scale > 0);
    qw_triangles t = qw_triangulate(env, input);
    polygon_facts facts = find_facts(env, input, clean, component);
    uint32_t *place = QW_NEW(env, uint32_t, input->vertex_count);
    size_t most = facts.ways ? 2 * (size_t)t.count : t.count;
    qw_source s = {.input = input,
                   .face = QW_NEW(env, uint32_t, most),
                   .corner = QW_NEW(env, uint32_t, 3 * most),
                   .component = QW_NEW(env, uint32_t, most)};
    s.mesh.corner = QW_NEW(env, uint32_t, 3 * most);
    size_t in_slots = take_triangles(input, &t, &facts, place, &s);
    place_vertices(env, input, clean, in_slots, &s.mesh);
    for (uint32_t i = 0; i < s.mesh.face_count && in_slots > 0; i++)
        if (facts.slot[s.face[i]] != QW_NONE)
            move_to_slot(input, clean, facts.slot[s.face[i]], &s.mesh, s.mesh.corner + 3 * (size_t)i);
    qw_free(env, t.corner), qw_free(env, t.source), qw_free(env, place);
    qw_free(env, facts.agreement), qw_free(env, facts.ways), qw_free(env, facts.component), qw_free(env, facts.slot);
    s.normal = qw_face_normals(env, &s.mesh);
    s.bvh = qw_bvh_build(env, &s.mesh);
    return s;
}
