/* A plane is improved in rounds: samples of the surface are reflected, each goes with the nearest point of the surface,
 * and of all planes that which brings the samples nearest to the surface's planes there is next (the closest points of
 * Besl and McKay 1992, and the planes of Chen and Medioni 1992, for a reflection), by a step of Gauss and Newton.
 */
#include "whole/plane.h"

#include "base/axes.h"
#include "base/constants.h"
#include "geometry/bvh.h"
#include "geometry/polygons.h"
#include "base/elementary.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    SAMPLES = 600,     /* of each round; all rounds use the same ones */
    FEW_SAMPLES = 240, /* the same while planes are looked for about the samples alone */
    ROUNDS = 8,
    JUDGED = 2400, /* samples by which the resulting plane is measured */
    BEGINNINGS = 6 /* start planes: across the coordinate axes and across the principal axes */
};

/* A plane counts as good as the best if its mean distance is at most AS_GOOD times that of the best, plus AS_GOOD_GAP
   diagonals. */
static const double AS_GOOD = 1.05, AS_GOOD_GAP = 2e-4;
/* One cut counts as shorter than another below this share of the other's length. */
static const double SHORTER = 0.95;
/* The nearest point of the surface is looked for within so many diagonals of a reflected sample. */
static const double REACH = 0.1;
/* Rounds go on while each lowers the mean distance to less than this share; a start is given up if the distance is
   above HOPELESS diagonals after two rounds, and about samples alone after one. */
static const double SHRINKS = 0.98, HOPELESS = 0.04;
/* Planes are looked for about triangles at the samples first, together so many times as large as the surface: what is
   too far off then is no plane of the surface, and of the rest those are improved about the surface itself whose mean
   distance is at most ROUGHLY times that of the best, plus ROUGH diagonals. About
   samples rounds go on while each lowers it by that factor. */
static const double COVERED = 2, ROUGHLY = 1.3, ROUGH = 2e-3;
/* What is added to the normal equations' diagonal, of its sum. */
static const double DAMPING = 1e-6;
/* A surface lies in a plane if its mean distance from it is below so many diagonals. */
static const double FLAT = 1e-6;

qw_mirror_plane qw_mirror_plane_of(const double normal[3], double offset)
{
    double largest = fmax(fabs(normal[0]), fmax(fabs(normal[1]), fabs(normal[2])));
    assert(largest > 0 && isfinite(largest));
    double n[3] = {normal[0] / largest, normal[1] / largest, normal[2] / largest};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    qw_mirror_plane plane = {.offset = offset / largest / length, .axis = QW_NO_AXIS};
    for (int k = 0; k < 3; k++) plane.normal[k] = n[k] / length;
    for (int k = 0; k < 3; k++)
        if (fabs(plane.normal[k]) == 1) {
            plane.axis = k;
            plane.offset *= plane.normal[k];
            plane.normal[k] = 1;
        }
    return plane;
}

double qw_plane_height(const qw_mirror_plane *plane, const double p[3])
{
    if (plane->axis != QW_NO_AXIS) return p[plane->axis] - plane->offset;
    return plane->normal[0] * p[0] + plane->normal[1] * p[1] + plane->normal[2] * p[2] - plane->offset;
}

void qw_put_on_plane(const qw_mirror_plane *plane, double p[3])
{
    double height = qw_plane_height(plane, p);
    if (plane->axis != QW_NO_AXIS) p[plane->axis] = plane->offset;
    else
        for (int k = 0; k < 3; k++) p[k] -= height * plane->normal[k];
}

void qw_reflect(const qw_mirror_plane *plane, const double p[3], double q[3])
{
    double height = qw_plane_height(plane, p);
    for (int k = 0; k < 3; k++) q[k] = p[k];
    if (plane->axis != QW_NO_AXIS) q[plane->axis] = plane->offset - height;
    else
        for (int k = 0; k < 3; k++) q[k] -= 2 * height * plane->normal[k];
}

/* ---- samples */

typedef struct plane_search {
    qw_env *env;
    const qw_trimesh *mesh, *seen; /* the surface, and what the tree is of */
    const qw_bvh *bvh;
    uint32_t samples; /* of each round */
    double centre[3]; /* of the area */
    double diagonal;
    double *area_end;   /* double[face_count]: area of the triangles up to here */
    double (*point)[3]; /* double[JUDGED][3], of which the rounds use some, evenly spaced */
    qw_vec3 *normal;    /* qw_vec3[JUDGED], unit */
    double (*near)[3];  /* the point of the surface nearest to each reflection */
    qw_vec3 *facing;    /* and the unit normal there */
    uint8_t *is_near;   /* uint8_t[JUDGED]: there is one within REACH */
    float *distance;    /* float[JUDGED], of the two; REACH where there is none */
} plane_search;

/* Samples spread evenly over the area. */
static void place_samples(plane_search *s)
{
    assert(s->mesh->face_count > 0 && s->area_end);
    const qw_trimesh *m = s->mesh;
    uint32_t f = 0;
    for (uint32_t i = 0; i < JUDGED; i++) {
        double at = s->area_end[m->face_count - 1] * (i + 0.5) / JUDGED;
        while (f + 1 < m->face_count && s->area_end[f] < at) f++;
        double u, v;
        qw_spread_in_triangle(i + 1, &u, &v);
        const uint32_t *c = m->corner + 3 * (size_t)f;
        qw_vec3 a = m->position[c[0]], b = m->position[c[1]], d = m->position[c[2]];
        s->point[i][0] = (double)a.x + u * (double)(b.x - a.x) + v * (double)(d.x - a.x);
        s->point[i][1] = (double)a.y + u * (double)(b.y - a.y) + v * (double)(d.y - a.y);
        s->point[i][2] = (double)a.z + u * (double)(b.z - a.z) + v * (double)(d.z - a.z);
        s->normal[i] = qw_normalize(qw_face_cross(m, f));
    }
}

/* Area, centre and diagonal of the surface. */
static void measure_area(plane_search *s)
{
    assert(s->mesh->face_count > 0);
    const qw_trimesh *m = s->mesh;
    double sum = 0;
    qw_vec3 lo = {FLT_MAX, FLT_MAX, FLT_MAX}, hi = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (uint32_t f = 0; f < m->face_count; f++) {
        double area = 0.5 * (double)qw_length(qw_face_cross(m, f));
        s->area_end[f] = sum += area;
        for (int i = 0; i < 3; i++) {
            qw_vec3 p = m->position[m->corner[3 * (size_t)f + (size_t)i]];
            s->centre[0] += area / 3 * (double)p.x, s->centre[1] += area / 3 * (double)p.y;
            s->centre[2] += area / 3 * (double)p.z;
            lo = qw_v3(fminf(lo.x, p.x), fminf(lo.y, p.y), fminf(lo.z, p.z));
            hi = qw_v3(fmaxf(hi.x, p.x), fmaxf(hi.y, p.y), fmaxf(hi.z, p.z));
        }
    }
    for (int k = 0; k < 3; k++) s->centre[k] /= sum;
    s->diagonal = (double)qw_distance(lo, hi);
}

typedef struct reflect_task {
    plane_search *s;
    const qw_mirror_plane *plane;
    uint32_t step;
} reflect_task;

/* Reflects samples at the plane and looks for the surface near them. */
static void reflect_samples(void *user, uint32_t begin, uint32_t end)
{
    const reflect_task *t = user;
    plane_search *s = t->s;
    uint32_t hint = QW_NONE;
    float reach = (float)(REACH * s->diagonal);
    qw_vec3 across = qw_v3_of_doubles(t->plane->normal);
    for (uint32_t i = begin; i < end; i++) {
        double q[3];
        qw_vec3 n = s->normal[i * t->step], reflected = qw_madd(n, -2 * qw_dot(n, across), across);
        qw_reflect(t->plane, s->point[i * t->step], q);
        qw_vec3 p = qw_v3((float)q[0], (float)q[1], (float)q[2]);
        qw_hit hit = qw_bvh_nearest(s->bvh, p, reflected, QW_SAME_SHEET, reach, hint);
        hint = hit.face;
        s->is_near[i] = hit.face != QW_NONE;
        s->distance[i] = s->is_near[i] ? sqrtf(hit.distance2) : reach;
        if (s->is_near[i]) s->facing[i] = qw_normalize(qw_face_cross(s->seen, hit.face));
        s->near[i][0] = (double)hit.point.x, s->near[i][1] = (double)hit.point.y, s->near[i][2] = (double)hit.point.z;
    }
}

static double reflect_all(plane_search *s, const qw_mirror_plane *plane, uint32_t count)
{
    reflect_task task = {s, plane, JUDGED / count};
    double sum = 0;
    qw_parallel(s->env, count, QW_GRAIN_SEARCH, reflect_samples, &task);
    for (uint32_t i = 0; i < count; i++) sum += (double)s->distance[i];
    return sum / count / s->diagonal;
}

/* ---- rounds */

/* The normal equations of a step: offset, and the normal's turns about the centre in two directions across it. */
typedef struct step_sums {
    double a[3][3], b[3];
} step_sums;

/* Adds what one sample, off by `off` along the unit normal m of the surface that is nearest to its reflection, wants.
 */
static void add_sample(step_sums *sums, const double row[3], double off)
{
    for (int j = 0; j < 3; j++) {
        sums->b[j] -= row[j] * off;
        for (int k = 0; k < 3; k++) sums->a[j][k] += row[j] * row[k];
    }
}

/* Solves for the step by elimination, damped, so that what no sample tells stays. */
static void solve_step(step_sums *sums, int unknowns, double x[3])
{
    assert(unknowns >= 1 && unknowns <= 3);
    double damping = DAMPING * (sums->a[0][0] + sums->a[1][1] + sums->a[2][2]);
    for (int k = 0; k < unknowns; k++) sums->a[k][k] += damping, x[k] = 0;
    for (int k = 0; k < unknowns && damping > 0; k++)
        for (int j = k + 1; j < unknowns; j++) {
            double share = sums->a[j][k] / sums->a[k][k];
            for (int i = k; i < unknowns; i++) sums->a[j][i] -= share * sums->a[k][i];
            sums->b[j] -= share * sums->b[k];
        }
    for (int k = unknowns - 1; k >= 0 && damping > 0; k--) {
        x[k] = sums->b[k];
        for (int i = k + 1; i < unknowns; i++) x[k] -= sums->a[k][i] * x[i];
        x[k] /= sums->a[k][k];
    }
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The plane that suits the samples and the surface at their nearest points best, its normal free or kept. */
static qw_mirror_plane next_plane(const plane_search *s, const qw_mirror_plane *plane, bool is_free)
{
    assert(s->samples > 0 && JUDGED % s->samples == 0);
    const double *n = plane->normal;
    qw_vec3 x = qw_any_orthogonal(qw_v3_of_doubles(n)), y = qw_cross(qw_v3_of_doubles(n), x);
    const double across[2][3] = {{(double)x.x, (double)x.y, (double)x.z}, {(double)y.x, (double)y.y, (double)y.z}};
    double step[3] = {0}, normal[3], offset = plane->offset;
    step_sums sums = {.b = {0}};
    for (uint32_t i = 0; i < s->samples; i++) {
        if (!s->is_near[i]) continue;
        double p[3], q[3], row[3] = {0},
                           m[3] = {(double)s->facing[i].x, (double)s->facing[i].y, (double)s->facing[i].z};
        const double *from = s->point[i * (JUDGED / s->samples)];
        double height = dot(n, from) - plane->offset, turned = dot(m, n);
        for (int k = 0; k < 3; k++) p[k] = from[k] - s->centre[k], q[k] = from[k] - 2 * height * n[k] - s->near[i][k];
        row[0] = 2 * turned;
        for (int k = 0; k < 2 && is_free; k++)
            row[k + 1] = -2 * (dot(across[k], p) * turned + height * dot(m, across[k]));
        add_sample(&sums, row, dot(m, q));
    }
    solve_step(&sums, is_free ? 3 : 1, step);
    offset += step[0];
    for (int k = 0; k < 3; k++) {
        double turn = step[1] * across[0][k] + step[2] * across[1][k];
        normal[k] = n[k] + turn, offset += turn * s->centre[k];
    }
    return is_free ? qw_mirror_plane_of(normal, offset) : (qw_mirror_plane){{n[0], n[1], n[2]}, offset, plane->axis};
}

/* Improves a plane by rounds. Returns the best plane on the way; its gap is measured on the samples of a round. */
static qw_mirror_search improve(plane_search *s, qw_mirror_plane plane, bool is_free)
{
    assert(s->bvh && s->distance);
    qw_mirror_search best = {plane, DBL_MAX, DBL_MAX, DBL_MAX};
    bool is_rough = s->seen != s->mesh;
    double shrinks = is_rough ? 1 / ROUGHLY : SHRINKS;
    for (int round = 0; round < ROUNDS; round++) {
        double gap = reflect_all(s, &plane, s->samples);
        bool goes_on = gap < shrinks * best.gap && (gap <= HOPELESS || (round == 0 && !is_rough));
        if (gap < best.gap) best.gap = gap, best.plane = plane;
        if (!goes_on) break;
        plane = next_plane(s, &plane, is_free);
    }
    return best;
}

static qw_mirror_plane through_centre(const plane_search *s, const double normal[3])
{
    double offset = 0;
    for (int k = 0; k < 3; k++) offset += normal[k] * s->centre[k];
    return qw_mirror_plane_of(normal, offset);
}

static bool is_as_good(double gap, double best) { return gap <= AS_GOOD * best + AS_GOOD_GAP; }

/* How long the line is along which the plane cuts the surface. */
static double cut_length(const plane_search *s, const qw_mirror_plane *plane)
{
    double sum = 0;
    for (uint32_t f = 0; f < s->mesh->face_count; f++) {
        double height[3], at[2][3], p[3][3];
        int found = 0;
        for (int i = 0; i < 3; i++) {
            qw_vec3 v = s->mesh->position[s->mesh->corner[3 * (size_t)f + (size_t)i]];
            p[i][0] = (double)v.x, p[i][1] = (double)v.y, p[i][2] = (double)v.z;
            height[i] = qw_plane_height(plane, p[i]);
        }
        for (int i = 0; i < 3; i++) {
            int j = (i + 1) % 3;
            if ((height[i] >= 0) == (height[j] >= 0)) continue;
            double t = height[i] / (height[i] - height[j]);
            for (int k = 0; k < 3; k++) at[found][k] = p[i][k] + t * (p[j][k] - p[i][k]);
            found++;
        }
        assert(found == 0 || found == 2);
        if (found == 2)
            sum += sqrt((at[0][0] - at[1][0]) * (at[0][0] - at[1][0]) + (at[0][1] - at[1][1]) * (at[0][1] - at[1][1]) +
                        (at[0][2] - at[1][2]) * (at[0][2] - at[1][2]));
    }
    return sum;
}

/* Whether the surface lies in the plane. */
static bool lies_in(const plane_search *s, const qw_mirror_plane *plane)
{
    double sum = 0;
    for (uint32_t i = 0; i < JUDGED; i++) sum += fabs(qw_plane_height(plane, s->point[i]));
    return sum / JUDGED <= FLAT * s->diagonal;
}

/* Keeps the planes that are as good as the best, those with shorter cuts first. A plane in which the surface lies is
   kept only if there is no other. */
static uint32_t keep_good(const plane_search *s, qw_mirror_search *of, uint32_t count)
{
    double best = DBL_MAX, length[BEGINNINGS];
    bool is_flat[BEGINNINGS], are_flat = true;
    uint32_t kept = 0;
    assert(count > 0 && count <= BEGINNINGS);
    for (uint32_t i = 0; i < count; i++) is_flat[i] = lies_in(s, &of[i].plane), are_flat &= is_flat[i];
    for (uint32_t i = 0; i < count; i++)
        if (!is_flat[i] || are_flat) best = fmin(best, of[i].gap);
    for (uint32_t i = 0; i < count; i++) {
        if ((is_flat[i] && !are_flat) || !is_as_good(of[i].gap, best)) continue;
        qw_mirror_search one = of[i];
        double cut = cut_length(s, &one.plane);
        uint32_t to = kept++;
        for (; to > 0 && cut < SHORTER * length[to - 1]; to--) of[to] = of[to - 1], length[to] = length[to - 1];
        of[to] = one, length[to] = cut;
    }
    return kept;
}

/* A triangle at each sample, in the plane of the surface there. */
static qw_trimesh rough_surface(plane_search *s, double area)
{
    static const float X[3] = {1, -0.5f, -0.5f}, Y[3] = {0, 0.8660254f, -0.8660254f};
    qw_trimesh m = {.vertex_count = 3 * JUDGED, .face_count = JUDGED};
    m.position = QW_NEW(s->env, qw_vec3, 3 * JUDGED), m.corner = QW_NEW(s->env, uint32_t, 3 * JUDGED);
    float radius = (float)sqrt(COVERED * area / JUDGED / 1.2990381); /* area over the squared radius */
    for (uint32_t i = 0; i < JUDGED; i++) {
        qw_vec3 x = qw_any_orthogonal(s->normal[i]), y = qw_cross(s->normal[i], x), p = qw_v3_of_doubles(s->point[i]);
        for (uint32_t k = 0; k < 3; k++) {
            m.position[3 * i + k] = qw_madd(qw_madd(p, radius * X[k], x), radius * Y[k], y);
            m.corner[3 * i + k] = 3 * i + k;
        }
    }
    return m;
}

/* Where the search begins: the planes across the coordinate axes, which keep their normals, then those across these and
   the principal axes, which do not. */
typedef struct beginning {
    qw_mirror_search from;
    bool is_free;
} beginning;
enum { ALL_BEGINNINGS = 3 + BEGINNINGS };

/* The planes from which the search begins: through the centre, across the axis that is asked for, or all axes of
   space and of the points. */
static uint32_t begin_all(plane_search *s, int axis, beginning *all)
{
    double m[3][3] = {{0}}, principal[3][3];
    uint32_t count = 0;
    for (int k = 0; k < 3; k++) {
        double normal[3] = {k == 0, k == 1, k == 2};
        if (axis == QW_NO_AXIS || axis == k) all[count++] = (beginning){{.plane = through_centre(s, normal)}, false};
    }
    if (axis != QW_NO_AXIS) return count;
    for (uint32_t i = 0; i < JUDGED; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) m[j][k] += (s->point[i][j] - s->centre[j]) * (s->point[i][k] - s->centre[k]);
    qw_principal_axes(m, principal);
    for (int b = 0; b < BEGINNINGS; b++) {
        double normal[3] = {b == 0, b == 1, b == 2};
        all[count++] = (beginning){{.plane = through_centre(s, b < 3 ? normal : principal[b - 3])}, true};
        assert(count < ALL_BEGINNINGS || b + 1 == BEGINNINGS);
    }
    return count;
}

static bool are_parallel(const qw_mirror_plane *a, const qw_mirror_plane *b)
{
    return fabs(dot(a->normal, b->normal)) >= QW_PARALLEL_COSINE;
}

/* Whether one before it that is as free leads to a plane parallel to it, and roughly as good. */
static bool is_double(const beginning *all, uint32_t i)
{
    const beginning *b = &all[i];
    for (uint32_t k = 0; k < i; k++)
        if (all[k].is_free == b->is_free && all[k].from.gap <= ROUGHLY * b->from.gap &&
            are_parallel(&all[k].from.plane, &b->from.plane))
            return true;
    return false;
}

/* Improves all planes about the triangles of the samples, and keeps those that may be the best, each once. */
static uint32_t improve_roughly(plane_search *s, beginning *all, uint32_t count)
{
    double best = DBL_MAX;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++) {
        all[i].from = improve(s, all[i].from.plane, all[i].is_free);
        best = fmin(best, all[i].from.gap);
    }
    for (uint32_t i = 0; i < count; i++) {
        all[kept] = all[i];
        kept += all[i].from.gap <= ROUGHLY * best + ROUGH && !is_double(all, kept);
    }
    return kept;
}

/* The planes that keep their normals, improved; then, where one of another direction is better, those. */
static uint32_t improve_all(plane_search *s, const beginning *all, uint32_t count, qw_mirror_search *found)
{
    assert(count <= ALL_BEGINNINGS);
    qw_mirror_search other[BEGINNINGS];
    uint32_t good = 0, others = 0;
    for (uint32_t i = 0; i < count; i++)
        if (!all[i].is_free) found[good++] = improve(s, all[i].from.plane, false);
    if (good > 0) good = keep_good(s, found, good);
    if (good > 0 && found[0].gap <= AS_GOOD_GAP) return good;
    for (uint32_t i = 0; i < count; i++) {
        if (!all[i].is_free) continue;
        qw_mirror_search one = improve(s, all[i].from.plane, true);
        bool is_new = good == 0 || !is_as_good(found[0].gap, one.gap);
        for (uint32_t k = 0; k < others && is_new; k++) is_new = !are_parallel(&other[k].plane, &one.plane);
        if (is_new) other[others++] = one;
    }
    if (others == 0) return good;
    others = keep_good(s, other, others);
    memcpy(found, other, others * sizeof *other);
    return others;
}

/* Converts the plane to the coordinates of the input, and moves it through their origin if that is as good. */
static qw_mirror_plane in_input(plane_search *s, const qw_frame *frame, const qw_mirror_search *found)
{
    double to_origin = 0, offset = found->plane.offset / frame->scale;
    for (int k = 0; k < 3; k++) to_origin -= found->plane.normal[k] * frame->center[k];
    qw_mirror_plane centred = found->plane;
    centred.offset = to_origin * frame->scale;
    bool is_centred = is_as_good(reflect_all(s, &centred, s->samples), found->gap);
    return qw_mirror_plane_of(found->plane.normal, is_centred ? 0 : offset - to_origin);
}

/* Measures the plane, in the precision in which it will be used, on so many samples. */
static qw_mirror_search judge(plane_search *s, const qw_frame *frame, const qw_mirror_plane *plane, uint32_t samples)
{
    qw_mirror_search result = {.plane = *plane};
    qw_mirror_plane judged = *plane;
    for (int k = 0; k < 3; k++) judged.offset -= judged.normal[k] * frame->center[k];
    judged.offset *= frame->scale;
    result.gap = reflect_all(s, &judged, samples);
    result.most = qw_percentile(s->distance, samples, QW_MOST_OF_IT) / s->diagonal;
    result.far = qw_percentile(s->distance, samples, QW_NEARLY_ALL) / s->diagonal;
    return result;
}

static plane_search begin_search(qw_env *env, const qw_trimesh *mesh)
{
    plane_search s = {.env = env, .mesh = mesh, .seen = mesh, .samples = SAMPLES};
    s.area_end = QW_NEW(env, double, mesh->face_count), s.normal = QW_NEW(env, qw_vec3, JUDGED);
    s.point = qw_alloc(env, JUDGED, sizeof *s.point), s.near = qw_alloc(env, JUDGED, sizeof *s.near);
    s.facing = QW_NEW(env, qw_vec3, JUDGED), s.is_near = QW_NEW(env, uint8_t, JUDGED),
    s.distance = QW_NEW(env, float, JUDGED);
    measure_area(&s);
    place_samples(&s);
    return s;
}

qw_mirror_search qw_judge_mirror_plane(qw_env *env, const qw_trimesh *mesh, const qw_frame *frame,
                                       const qw_mirror_plane *plane)
{
    qw_scope_begin(env);
    plane_search s = begin_search(env, mesh);
    s.bvh = qw_bvh_build(env, mesh);
    qw_mirror_search judged = judge(&s, frame, plane, JUDGED);
    qw_scope_end(env);
    return judged;
}

uint32_t qw_find_mirror_planes(qw_env *env, const qw_trimesh *mesh, const qw_frame *frame, int axis, double near,
                               qw_mirror_search found[QW_MOST_PLANES])
{
    assert(mesh->face_count > 0 && axis >= 0 && axis <= QW_NO_AXIS);
    qw_mirror_search good[ALL_BEGINNINGS];
    beginning all[ALL_BEGINNINGS];
    qw_scope_begin(env);
    plane_search s = begin_search(env, mesh);
    qw_trimesh rough = rough_surface(&s, s.area_end[mesh->face_count - 1]);
    s.bvh = qw_bvh_build(env, &rough), s.seen = &rough, s.samples = FEW_SAMPLES;
    uint32_t beginnings = improve_roughly(&s, all, begin_all(&s, axis, all)), count = 1, best = 0;
    for (uint32_t i = 1; i < beginnings; i++)
        if (all[i].from.gap < all[best].from.gap) best = i;
    qw_mirror_plane plane = in_input(&s, frame, &all[best].from);
    found[0] = judge(&s, frame, &plane, SAMPLES);
    if (found[0].most <= near) {
        s.bvh = qw_bvh_build(env, mesh), s.seen = mesh, s.samples = SAMPLES;
        count = improve_all(&s, all, beginnings, good);
        if (count > QW_MOST_PLANES) count = QW_MOST_PLANES;
        for (uint32_t i = 0; i < count; i++) {
            plane = in_input(&s, frame, &good[i]);
            qw_mirror_search one = judge(&s, frame, &plane, JUDGED);
            uint32_t to = i;
            for (; to > 0 && 2 * one.far + AS_GOOD_GAP < found[to - 1].far; to--) found[to] = found[to - 1];
            found[to] = one;
        }
    }
    qw_scope_end(env);
    return count;
}

bool qw_is_turned(qw_env *env, const qw_trimesh *mesh, const qw_frame *frame, const qw_mirror_search *found,
                  uint32_t count)
{
    for (uint32_t j = 1; j < count; j++)
        for (uint32_t i = 0; i < j && found[j].most <= QW_NEARLY_ALIKE; i++) {
            const qw_mirror_plane *a = &found[i].plane, *b = &found[j].plane;
            double normal[3];
            for (int k = 0; k < 3; k++) normal[k] = a->normal[k] + 2 * b->normal[k];
            qw_mirror_plane between = qw_mirror_plane_of(normal, a->offset + 2 * b->offset);
            if (qw_judge_mirror_plane(env, mesh, frame, &between).most <= QW_NEARLY_ALIKE) return true;
        }
    return false;
}
