#include "remesh/field/plane_directions.h"

#include "base/constants.h"
#include "base/elementary.h"
#include "base/mechanisms.h"
#include "base/sets.h"
#include "geometry/harmonic.h"
#include "remesh/field/connection_level.h"

#include <assert.h>
#include <math.h>

typedef struct plane {
    qw_vec3 normal, axis; /* of its first triangle */
    qw_phasor edges;      /* sum over the edges around: fourth powers, each as long as the edge */
    float length;         /* of these edges */
    bool is_bent;         /* it turns slowly: no plane */
} plane;

static bool is_same(qw_vec3 a, qw_vec3 b)
{
    return qw_dot(a, b) > 0 && qw_length2(qw_cross(a, b)) < (float)(QW_ONE_PLANE * QW_ONE_PLANE);
}

static bool is_edge(const qw_trimesh *mesh, uint32_t h)
{
    return mesh->twin[h] == QW_NONE || (mesh->mark && (mesh->mark[h] & QW_MARK_FEATURE));
}

/* Of each triangle, the first of its plane: uint32_t[face_count]. facing: their normals. */
static uint32_t *join_planes(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *facing)
{
    uint32_t *first = QW_NEW(env, uint32_t, mesh->face_count);
    qw_sets_begin(first, mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (!is_edge(mesh, h) && is_same(facing[h / 3], facing[mesh->twin[h] / 3]))
            qw_join_sets(first, h / 3, mesh->twin[h] / 3);
    for (uint32_t f = 0; f < mesh->face_count; f++) first[f] = qw_set_of(first, f);
    return first;
}

/* Each plane at its first triangle: plane[face_count]. */
static plane *measure_planes(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *facing, const uint32_t *first)
{
    plane *planes = QW_NEW_ZERO(env, plane, mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t f = h / 3;
        plane *p = &planes[first[f]];
        if (first[f] == f && h % 3 == 0) p->normal = facing[f], p->axis = qw_any_orthogonal(facing[f]);
        p->is_bent |= !is_same(facing[f], p->normal);
        if (!is_edge(mesh, h)) continue;
        qw_vec3 d = qw_sub(mesh->position[mesh->corner[qw_next(h)]], mesh->position[mesh->corner[h]]);
        qw_phasor z = qw_phasor_of_cross(d, p->normal, p->axis);
        p->edges.re += qw_length(d) * z.re, p->edges.im += qw_length(d) * z.im;
        p->length += qw_length(d);
    }
    return planes;
}

/* The planes of a mesh. In the current scope. */
typedef struct all_planes {
    const qw_vec3 *facing; /* qw_vec3[face_count] */
    const uint32_t *first; /* uint32_t[face_count], of its plane */
    const plane *plane;    /* plane[face_count], at the first face of each */
} all_planes;

static all_planes find_planes(qw_env *env, const qw_trimesh *mesh)
{
    qw_vec3 *facing = QW_NEW(env, qw_vec3, mesh->face_count);
    for (uint32_t f = 0; f < mesh->face_count; f++) facing[f] = qw_normalize(qw_face_cross(mesh, f));
    const uint32_t *first = join_planes(env, mesh, facing);
    return (all_planes){facing, first, measure_planes(env, mesh, facing, first)};
}

/* The direction in which most edges run, as long as they agree. */
static qw_vec3 direction_of(const plane *p)
{
    double angle = 0.25 * qw_atan2(p->edges.im, p->edges.re);
    float clear = sqrtf(p->edges.re * p->edges.re + p->edges.im * p->edges.im) / p->length;
    qw_vec3 y = qw_cross(p->normal, p->axis);
    return qw_madd(qw_scale(p->axis, clear * (float)qw_cos(angle)), clear * (float)qw_sin(angle), y);
}

void qw_direct_planes(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_vec3 *cross,
                      qw_vec3 *direction)
{
    assert(mesh->twin && normal && cross && direction);
    qw_scope_begin(env);
    int64_t directed = 0;
    all_planes planes = find_planes(env, mesh);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        const plane *p = &planes.plane[planes.first[h / 3]];
        uint32_t v = mesh->corner[h];
        if (p->is_bent || !(p->length > 0) || !is_same(normal[v], p->normal)) continue;
        qw_vec3 d = direction_of(p);
        /* powers: where edges or crosses go more than one way, lines that are held straight cost distance */
        float agree = fmaxf(qw_phasor_of_cross(cross[v], p->normal, d).re, 0);
        d = qw_scale(d, qw_length(d) * agree * agree * agree);
        if (qw_length2(d) > qw_length2(direction[v])) direction[v] = d, directed++;
    }
    qw_did(env, QW_MECH_PLANES, directed);
    qw_scope_end(env);
}

/* ---- rings */

/* Up to so many times as far around the outer curve as around the inner one rows run between them: their quads are at
   most three times as wide and a third as wide as in the middle. */
static const double MOST_AROUND = 8;

/* Rows that run along a curve come home only if it climbs across them about as far as it comes down: the one is at most
   twice the other. Those along a ratchet are spirals. */
static const double COMES_DOWN = 1.0 / 3;

/* Curve along the rim of a plane: closed, or from cut to cut. */
typedef struct stretch {
    uint32_t length, *half;     /* uint32_t[length]: its half-edges, of faces of the plane */
    int32_t *quarters;          /* int32_t[length]: by which rows along it turn where each ends */
    double turn;                /* by which it turns in all */
    bool is_closed, is_oblique; /* it meets a cut at an angle that is nearer to no, two or more quarters than to one */
} stretch;

typedef struct rims {
    const qw_trimesh *mesh;
    const uint32_t *plane; /* as of all_planes */
    const uint8_t *cut;    /* as of qw_direct_rings */
    uint8_t *is_done;      /* uint8_t[half-edges]: of stretches that were walked */
    uint32_t used, *half;  /* [half-edges]: of the stretches of one plane, one after the other */
    int32_t *quarters;
} rims;

static bool is_rim(const rims *r, uint32_t h)
{
    return is_edge(r->mesh, h) || r->plane[r->mesh->twin[h] / 3] != r->plane[h / 3];
}

static bool is_of_cut(const rims *r, uint32_t h)
{
    return r->cut && r->mesh->twin[h] == QW_NONE &&
           (r->cut[r->mesh->corner[h]] & r->cut[r->mesh->corner[qw_next(h)]]) != 0;
}

/* The rim's half-edge after h, and the angle of the plane between them. */
static uint32_t next_on_rim(const rims *r, uint32_t h, double *angle)
{
    const qw_trimesh *m = r->mesh;
    *angle = 0;
    for (h = qw_next(h);; h = qw_next(m->twin[h])) {
        *angle += qw_angle_at(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]],
                              m->position[m->corner[qw_prev(h)]]);
        if (is_rim(r, h)) return h;
    }
}

/* How many quarter turns rows turn at a corner of that angle, which has a quad or more. */
static int32_t quarters_at(double angle) { return 2 - (int32_t)fmax(1, floor(angle / (QW_PI / 2) + 0.5)); }

/* The stretch from its first half-edge on. */
static stretch walk(rims *r, uint32_t first)
{
    stretch s = {.half = r->half + r->used, .quarters = r->quarters + r->used};
    uint32_t h = first;
    do {
        double angle;
        s.half[s.length] = h, r->is_done[h] = 1;
        h = next_on_rim(r, h, &angle);
        bool ends = is_of_cut(r, h);
        s.quarters[s.length++] = ends ? 0 : quarters_at(angle);
        if (ends) s.is_oblique = quarters_at(angle) != 1;
        else s.turn += QW_PI - angle;
    } while (h != first && !is_of_cut(r, h));
    s.is_closed = h == first;
    r->used += s.length;
    return s;
}

/* The stretches along the rim of the faces of a plane, up to three; none where some of it is no curve. */
static uint32_t list_stretches(rims *r, const uint32_t *face, uint32_t face_count, stretch s[3])
{
    uint32_t count = 0;
    r->used = 0;
    for (uint32_t i = 0; i < 3 * face_count; i++) {
        uint32_t h = 3 * face[i / 3] + i % 3;
        double angle;
        if (is_rim(r, h) && !is_edge(r->mesh, h)) return 0;
        if (!is_of_cut(r, h)) continue;
        h = next_on_rim(r, h, &angle);
        if (is_of_cut(r, h) || count == 3) continue;
        s[count++] = walk(r, h);
        s[count - 1].is_oblique |= quarters_at(angle) != 1;
    }
    for (uint32_t i = 0; i < 3 * face_count && count < 3; i++) {
        uint32_t h = 3 * face[i / 3] + i % 3;
        if (is_rim(r, h) && !is_of_cut(r, h) && !r->is_done[h]) s[count++] = walk(r, h);
    }
    return count;
}

/* By how many quarters rows along the curve have turned at corners, at each half-edge of the stretch: double[length],
   in the current scope. On most of the curve by none. NULL: they do not run along all of it. */
static double *quarters_along(qw_env *env, const rims *r, const stretch *s)
{
    double *turned = QW_NEW(env, double, s->length), sum = 0, length = 0, up = 0, climbs = 0;
    int32_t now = 0;
    for (uint32_t i = 0; i < s->length; now -= s->quarters[i++]) {
        double edge = (double)qw_length(qw_edge_way(r->mesh, s->half[i]));
        turned[i] = now, sum += now * edge, length += edge;
    }
    double most = s->is_closed ? floor(sum / length + 0.5) : 0;
    for (uint32_t i = 0; i < s->length; i++) {
        turned[i] -= most;
        double rise = (double)qw_length(qw_edge_way(r->mesh, s->half[i])) * qw_sin(turned[i] * (QW_PI / 2));
        up += rise, climbs += fabs(rise);
    }
    return now == 0 && !s->is_oblique && fabs(up) <= COMES_DOWN * climbs ? turned : NULL;
}

/* Gives the vertices of the stretch their value; false where one has another. */
static bool fix_values(const qw_trimesh *m, qw_harmonic *p, const stretch *s, double value)
{
    for (uint32_t i = 0; i < 2 * s->length; i++) {
        uint32_t h = s->half[i / 2], at = p->place[m->corner[i % 2 ? qw_next(h) : h]];
        if (p->is_fixed[at] && p->value[at] != value) return false;
        p->is_fixed[at] = 1, p->value[at] = value;
    }
    return true;
}

/* By how many quarters crosses in a piece are turned from lines that run along the stretches; they are fixed as those
   are, and along cuts. At a corner the mean of both sides. */
static void solve_quarters(qw_env *env, const rims *r, qw_harmonic *p, const stretch s[2], const double *turned[2])
{
    for (uint32_t i = 0; i < p->count; i++) p->is_fixed[i] |= r->cut && r->cut[p->vertex[i]], p->value[i] = 0;
    for (int k = 0; k < 2; k++)
        for (uint32_t i = 0; i < s[k].length; i++) {
            uint32_t last = i > 0 ? i - 1 : s[k].is_closed ? s[k].length - 1 : 0;
            p->value[p->place[r->mesh->corner[s[k].half[i]]]] = (turned[k][last] + turned[k][i]) / 2;
        }
    qw_harmonic_solve(env, p);
}

/* Directions where the plane lies between two stretches of curve along which rows can run around: along lines of equal
   value between them, and turned from these by what rows turn at corners, as far as that is felt. As long as the
   function between them is steep: in bays of a curve it is not. Returns at how many vertices. */
static int64_t direct_between(qw_env *env, rims *r, const uint32_t *face, uint32_t face_count, const qw_vec3 *normal,
                              qw_vec3 facing, qw_vec3 *direction)
{
    stretch s[3];
    if (list_stretches(r, face, face_count, s) != 2 || s[0].is_closed != s[1].is_closed) return 0;
    const double *turned[2] = {quarters_along(env, r, &s[0]), quarters_along(env, r, &s[1])};
    if (!turned[0] || !turned[1]) return 0;
    qw_harmonic p = qw_harmonic_begin(env, r->mesh, face, face_count, r->plane, r->plane[face[0]]);
    int64_t euler = (int64_t)p.count - p.edges + face_count;
    if (euler != !s[0].is_closed || !fix_values(r->mesh, &p, &s[0], 0) || !fix_values(r->mesh, &p, &s[1], 1)) return 0;
    qw_harmonic_solve(env, &p);
    double turn = (fabs(s[0].turn) + fabs(s[1].turn)) / 2, around = qw_exp(turn / qw_harmonic_energy(&p)), mean = 0;
    qw_log(env, QW_LOG_DEBUG, "plane of %u triangles: %.2f times as far around", face_count, around);
    if (around > MOST_AROUND) return 0;
    const qw_vec3 *lines = qw_harmonic_lines(env, &p);
    solve_quarters(env, r, &p, s, turned);
    int64_t count = 0;
    for (uint32_t i = 0; i < p.count; i++) mean += (double)qw_length(lines[i]) / p.count;
    for (uint32_t i = 0; i < p.count; i++) {
        uint32_t v = p.vertex[i];
        if (!is_same(normal[v], facing) || qw_length2(lines[i]) == 0) continue;
        double angle = p.value[i] * (QW_PI / 2);
        qw_vec3 line = qw_scale(qw_normalize(lines[i]), fminf(1, qw_length(lines[i]) / (float)mean));
        direction[v] = qw_madd(qw_scale(line, (float)qw_cos(angle)), (float)qw_sin(angle), qw_cross(facing, line));
        count++;
    }
    return count;
}

void qw_direct_rings(qw_env *env, const qw_trimesh *mesh, const uint8_t *cut, const qw_vec3 *normal, qw_vec3 *direction)
{
    assert(mesh->twin && normal && direction);
    qw_scope_begin(env);
    uint32_t n = mesh->face_count, *face = QW_NEW(env, uint32_t, n), *begin = QW_NEW_ZERO(env, uint32_t, n + 2);
    all_planes planes = find_planes(env, mesh);
    rims r = {.mesh = mesh, .plane = planes.first, .cut = cut};
    r.is_done = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)n);
    r.half = QW_NEW(env, uint32_t, 3 * (size_t)n), r.quarters = QW_NEW(env, int32_t, 3 * (size_t)n);
    for (uint32_t f = 0; f < n; f++) begin[r.plane[f] + 2]++;
    for (uint32_t f = 0; f < n; f++) begin[f + 2] += begin[f + 1];
    for (uint32_t f = 0; f < n; f++) face[begin[r.plane[f] + 1]++] = f;
    for (uint32_t f = 0; f < n; f++) {
        uint32_t count = begin[f + 1] - begin[f];
        if (count <= 1 || planes.plane[f].is_bent) continue;
        qw_scope_begin(env);
        qw_did(env, QW_MECH_PLANES,
               direct_between(env, &r, face + begin[f], count, normal, planes.facing[f], direction));
        qw_scope_end(env);
    }
    qw_scope_end(env);
}
