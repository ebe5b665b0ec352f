#include "products/exact/primitives.h"

#include "base/constants.h"
#include "base/sort.h"
#include "base/groups.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    MOST_POINTS = 96, /* of the facets that are tried together */
    MOST_AROUND = 6,  /* neighbours of a facet that are looked at */
    PAIRED = 4,       /* those that are tried in twos with it */
    LEAST_FACETS = 3,
    FEW_FACETS = 5,
    SPARE_TO_STAY = 3, /* points more than a primitive has freedom, for it to stay; to grow one is enough */
    SAMPLES = 2000,    /* triangles that are looked at, to see whether the surface may be a designed one */
    MUCH = 12,         /* triangles */
    MOST_SCANNED = 64, /* triangles of a facet whose edges are looked at one by one */
    SEEDS = PAIRED * (PAIRED - 1) / 2 + 1, /* of a facet */
    MOST_VAIN = 300 /* facets that are tried in vain, one after another, before the search ends */
};
/* The middles of the facets of a cylinder or a cone lie off it by at least so many times as much as its vertices do. */
static const double FAR_BETTER = 3;
/* The same of a sphere or a torus that needs no reason for its end. */
static const double BEYOND_DOUBT = 50;
/* A triangle with a smaller height has no normal of its own. */
static const double SLIVER = 1e-5;
/* Cosine between the normals of a triangle and of the primitive in its middle. */
static const double AGREES = 0.8;
/* Cosine of 18 degrees: edges that run alike. */
static const double ALIKE = 0.95;
/* A triangle's neighbour belongs to the same facet where it lies off the triangle's plane by at most FLAT of the
   triangle's height, or by LEAST_OFF diagonals, as single precision rounds. */
static const double FLAT = 5e-4, LEAST_OFF = 1e-7;
/* A cylinder or a cone ends for a reason where, along REASON of its border, the surface beyond turns by at most
   LESS_BENT of what it turns by inside. */
static const double LESS_BENT = 0.75, REASON = 0.75;
/* Sine of the turn at an edge that ends what is flat or bent, though it may not be sharp enough to stop its growth. */
static const double BREAK = 0.4226;
/* Few facets are one only where the largest has no more than so many times the area of the smallest: lines in two
   planes and one between them always lie on a cylinder, if both are alike. */
static const double UNEVEN = 2.5;

/* A surface is searched only where at least this share of the sampled area lies in one plane, or on one sphere, with
   its neighbours. */
static const double PAIRED_SHARE = 0.5;

typedef struct finder {
    qw_env *env;
    const qw_trimesh *mesh;
    const double *position;
    double sharp;
    double *normal, *area; /* double[faces][3] unit or 0 for slivers; double[faces] */
    uint32_t facet_count;
    uint32_t *facet;           /* uint32_t[faces] */
    uint32_t *begin, *of;      /* triangles of each facet: of[begin[i] .. begin[i + 1]) */
    uint32_t *rim_begin, *rim; /* half-edges of each facet towards others: rim[rim_begin[i] .. rim_begin[i + 1]) */
    qw_primitive *plane;       /* qw_primitive[facets] */
    double *facet_area;        /* double[facets] */
    uint32_t *seen, stamp;     /* uint32_t[vertices]: last gathering that has the vertex */
    uint32_t *member;          /* uint32_t[faces]: triangles of the one that grows */
    uint32_t member_count;
    uint8_t *vain;          /* uint8_t[faces]: was of much that grew and was none: it is not begun with again */
    uint32_t *tried;        /* uint32_t[faces]: last growth that has met the triangle */
    double *point, *facing; /* double[vertices][3], double[faces][3]: of the members */
    struct seed *seed;      /* seed[SEEDS]: of the facet that is tried */
    qw_primitives found;
} finder;

static const double *at(const finder *f, uint32_t v) { return f->position + 3 * (size_t)v; }
static const double *normal_of(const finder *f, uint32_t t) { return f->normal + 3 * (size_t)t; }
static bool is_sliver(const finder *f, uint32_t t) { return qw_dot_doubles(normal_of(f, t), normal_of(f, t)) == 0; }

static void edge_of(const finder *f, uint32_t h, double along[3])
{
    const double *a = at(f, f->mesh->corner[h]), *b = at(f, f->mesh->corner[qw_next(h)]);
    for (int k = 0; k < 3; k++) along[k] = b[k] - a[k];
}

/* Area and unit normal of each triangle; a sliver's normal is zero. */
static void measure_triangles(void *user, uint32_t begin, uint32_t end)
{
    finder *f = user;
    for (uint32_t t = begin; t < end; t++) {
        double e[3][3], n[3], longest = 0;
        for (uint32_t i = 0; i < 3; i++)
            edge_of(f, 3 * t + i, e[i]), longest = fmax(longest, sqrt(qw_dot_doubles(e[i], e[i])));
        qw_cross_doubles(e[0], e[1], n);
        double twice = sqrt(qw_dot_doubles(n, n));
        f->area[t] = twice / 2;
        bool is_flat = !(twice > SLIVER * longest);
        for (int k = 0; k < 3; k++) f->normal[3 * (size_t)t + (size_t)k] = is_flat ? 0 : n[k] / twice;
    }
}

/* ---- facets */

static bool is_in_plane(const finder *f, const qw_primitive *plane, double off, uint32_t t)
{
    double gradient[3];
    for (int i = 0; i < 3; i++)
        if (fabs(qw_primitive_distance(plane, at(f, f->mesh->corner[3 * (size_t)t + (size_t)i]), gradient)) > off)
            return false;
    return is_sliver(f, t) || qw_dot_doubles(normal_of(f, t), plane->axis) > AGREES;
}

static double height_of(const finder *f, uint32_t t)
{
    double longest = 0, e[3];
    for (uint32_t h = 3 * t; h < 3 * t + 3; h++) edge_of(f, h, e), longest = fmax(longest, sqrt(qw_dot_doubles(e, e)));
    return longest > 0 ? 2 * f->area[t] / longest : 0;
}

/* The triangles around t that lie in its plane. */
static void flood_facet(finder *f, uint32_t t, uint32_t *stack)
{
    qw_primitive plane = {.kind = QW_PLANE};
    memcpy(plane.point, at(f, f->mesh->corner[3 * (size_t)t]), sizeof plane.point);
    memcpy(plane.axis, normal_of(f, t), sizeof plane.axis);
    uint32_t count = 0;
    double off = fmin(QW_OFF_PRIMITIVE, fmax(LEAST_OFF, FLAT * height_of(f, t)));
    assert(f->facet[t] == QW_NONE && f->facet_count < f->mesh->face_count);
    stack[count++] = t, f->facet[t] = f->facet_count;
    while (count > 0) {
        uint32_t from = stack[--count];
        for (uint32_t h = 3 * from; h < 3 * from + 3; h++) {
            uint32_t to = f->mesh->twin[h] == QW_NONE ? QW_NONE : f->mesh->twin[h] / 3;
            if (to == QW_NONE || f->facet[to] != QW_NONE || !is_in_plane(f, &plane, off, to)) continue;
            f->facet[to] = f->facet_count, stack[count++] = to;
        }
    }
    f->plane[f->facet_count++] = plane;
}

/* Triangles from the largest on, whose planes are the clearest. */
static uint32_t *by_area(qw_env *env, const double *area, uint32_t count)
{
    uint64_t *key = QW_NEW(env, uint64_t, count);
    uint32_t *order = QW_NEW(env, uint32_t, count);
    for (uint32_t t = 0; t < count; t++) key[t] = (uint64_t)~qw_float_key((float)area[t]) << 32 | t;
    qw_sort_u64(key, count);
    for (uint32_t t = 0; t < count; t++) order[t] = (uint32_t)key[t];
    qw_free(env, key);
    return order;
}

static void list_members(finder *f)
{
    uint32_t n = f->mesh->face_count;
    f->of = qw_group(f->env, f->facet, n, f->facet_count, &f->begin);
    f->facet_area = QW_NEW_ZERO(f->env, double, f->facet_count);
    for (uint32_t t = 0; t < n; t++) f->facet_area[f->facet[t]] += f->area[t];
}

/* Lists for each facet the half-edges beyond which another one lies. */
static void list_rims(finder *f)
{
    const qw_trimesh *m = f->mesh;
    uint32_t n = 3 * m->face_count, count = 0;
    f->rim_begin = QW_NEW(f->env, uint32_t, (size_t)f->facet_count + 1), f->rim = QW_NEW(f->env, uint32_t, n);
    for (uint32_t i = 0; i < f->facet_count; i++) {
        f->rim_begin[i] = count;
        for (uint32_t k = f->begin[i]; k < f->begin[i + 1]; k++)
            for (uint32_t h = 3 * f->of[k]; h < 3 * f->of[k] + 3; h++)
                if (m->twin[h] != QW_NONE && f->facet[m->twin[h] / 3] != i) f->rim[count++] = h;
    }
    f->rim_begin[f->facet_count] = count;
}

static void make_facets(finder *f)
{
    uint32_t n = f->mesh->face_count, *stack = QW_NEW(f->env, uint32_t, n);
    memset(f->facet, 0xff, n * sizeof *f->facet);
    const uint32_t *order = by_area(f->env, f->area, n);
    for (uint32_t i = 0; i < n; i++)
        if (f->facet[order[i]] == QW_NONE) flood_facet(f, order[i], stack);
    list_members(f);
    list_rims(f);
}

/* ---- edges */

/* Whether the surface goes on across a half-edge without a sharp edge. */
static bool is_smooth(const finder *f, uint32_t h)
{
    uint32_t twin = f->mesh->twin[h];
    if (twin == QW_NONE) return false;
    if (f->mesh->mark && f->mesh->mark[h]) return false;
    const qw_primitive *a = &f->plane[f->facet[h / 3]], *b = &f->plane[f->facet[twin / 3]];
    return qw_dot_doubles(a->axis, b->axis) > f->sharp;
}

/* The sine of the turn at an edge between two facets. */
static double turn_at(const finder *f, uint32_t h)
{
    double n[3];
    qw_cross_doubles(f->plane[f->facet[h / 3]].axis, f->plane[f->facet[f->mesh->twin[h] / 3]].axis, n);
    return sqrt(qw_dot_doubles(n, n));
}

/* Facets beside facet i across smooth edges that are of no primitive, those with the longest common edges first. */
static uint32_t list_around(const finder *f, uint32_t i, uint32_t around[MOST_AROUND])
{
    double length[MOST_AROUND];
    uint32_t count = 0;
    for (uint32_t m = f->begin[i]; m < f->begin[i + 1]; m++)
        for (uint32_t h = 3 * f->of[m]; h < 3 * f->of[m] + 3; h++) {
            uint32_t other = f->mesh->twin[h] == QW_NONE ? i : f->facet[f->mesh->twin[h] / 3];
            if (other == i || !is_smooth(f, h) || f->found.of_face[f->of[f->begin[other]]] != QW_NONE) continue;
            double e[3];
            edge_of(f, h, e);
            double here = sqrt(qw_dot_doubles(e, e));
            uint32_t k = 0;
            while (k < count && around[k] != other) k++;
            if (k < count) continue; /* facets that meet along several edges are rare */
            if (count < MOST_AROUND) count++;
            else if (here <= length[count - 1]) continue;
            for (k = count - 1; k > 0 && length[k - 1] < here; k--)
                around[k] = around[k - 1], length[k] = length[k - 1];
            around[k] = other, length[k] = here;
        }
    return count;
}

/* ---- what is tried */

typedef struct seed {
    double point[MOST_POINTS][3], normal[MOST_POINTS][3], middle[MOST_POINTS][3];
    uint32_t points, normals;
    qw_primitive_kind last;                    /* kinds from QW_CYLINDER to this are tried */
    bool is_known, is_fit[QW_PRIMITIVE_KINDS]; /* whether the fits have been asked for; those that are near enough */
    qw_primitive fit[QW_PRIMITIVE_KINDS];
} seed;

static void middle_of_facet(const finder *f, uint32_t i, double middle[3])
{
    double corners = 3.0 * (f->begin[i + 1] - f->begin[i]);
    memset(middle, 0, 3 * sizeof *middle);
    for (uint32_t m = f->begin[i]; m < f->begin[i + 1]; m++)
        for (uint32_t h = 3 * f->of[m]; h < 3 * f->of[m] + 3; h++)
            for (int k = 0; k < 3; k++) middle[k] += at(f, f->mesh->corner[h])[k] / corners;
}

/* False where the facet has too many points. */
static bool add_facet(finder *f, uint32_t i, seed *p)
{
    for (uint32_t m = f->begin[i]; m < f->begin[i + 1]; m++)
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t v = f->mesh->corner[3 * (size_t)f->of[m] + k];
            if (f->seen[v] == f->stamp) continue;
            if (p->points == MOST_POINTS) return false;
            f->seen[v] = f->stamp;
            memcpy(p->point[p->points++], at(f, v), sizeof *p->point);
        }
    if (p->normals == MOST_POINTS) return false;
    middle_of_facet(f, i, p->middle[p->normals]);
    memcpy(p->normal[p->normals++], f->plane[i].axis, sizeof *p->normal);
    return true;
}

static void fit(seed *t, qw_primitive_kind kind)
{
    const qw_facing facing = {t->normal[0], t->middle[0], t->normals};
    t->is_fit[kind] = t->points > qw_primitive_freedom(kind) &&
                      qw_fit_primitive(&t->fit[kind], kind, t->point[0], t->points, &facing) <= QW_OFF_PRIMITIVE;
}

static void fit_some(void *user, uint32_t begin, uint32_t end)
{
    seed *of = user;
    for (uint32_t i = begin; i < end; i++) {
        seed *t = &of[i / QW_PRIMITIVE_KINDS];
        qw_primitive_kind kind = (qw_primitive_kind)(i % QW_PRIMITIVE_KINDS);
        if (kind >= QW_CYLINDER && kind <= t->last) fit(t, kind);
    }
}

/* Whether the triangle's vertices lie on the primitive, with its normal there. */
static bool is_on(const finder *f, const qw_primitive *p, uint32_t t)
{
    double gradient[3], middle[3] = {0};
    for (uint32_t i = 0; i < 3; i++) {
        const double *v = at(f, f->mesh->corner[3 * (size_t)t + i]);
        if (!(fabs(qw_primitive_distance(p, v, gradient)) <= QW_OFF_PRIMITIVE)) return false;
        for (int k = 0; k < 3; k++) middle[k] += v[k] / 3;
    }
    if (is_sliver(f, t)) return true;
    qw_primitive_distance(p, middle, gradient);
    return fabs(qw_dot_doubles(gradient, normal_of(f, t))) > AGREES;
}

/* The places of all vertices of the member triangles, each once, into f->point; how many. */
static uint32_t gather_points(finder *f)
{
    uint32_t count = 0;
    f->stamp++;
    for (uint32_t m = 0; m < f->member_count; m++)
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t v = f->mesh->corner[3 * (size_t)f->member[m] + k];
            if (f->seen[v] == f->stamp) continue;
            f->seen[v] = f->stamp;
            memcpy(f->point + 3 * (size_t)count++, at(f, v), 3 * sizeof *f->point);
        }
    return count;
}

/* Grows from facet i over smooth edges, and fits the primitive again to what it has. */
static void grow(finder *f, uint32_t i, qw_primitive *p)
{
    uint32_t refit_at = 2 * LEAST_FACETS, stamp = ++f->stamp;
    f->member_count = 0;
    for (uint32_t m = f->begin[i]; m < f->begin[i + 1]; m++)
        f->tried[f->of[m]] = stamp, f->member[f->member_count++] = f->of[m];
    for (uint32_t next = 0; next < f->member_count; next++) {
        for (uint32_t h = 3 * f->member[next]; h < 3 * f->member[next] + 3; h++) {
            uint32_t to = f->mesh->twin[h] == QW_NONE ? QW_NONE : f->mesh->twin[h] / 3;
            if (to == QW_NONE || f->tried[to] == stamp || !is_smooth(f, h)) continue;
            if (f->found.of_face[to] != QW_NONE || !is_on(f, p, to)) continue;
            f->tried[to] = stamp, f->member[f->member_count++] = to;
        }
        if (f->member_count < refit_at) continue;
        qw_refine_primitive(p, f->point, gather_points(f));
        refit_at = 2 * f->member_count;
    }
    assert(f->member_count <= f->mesh->face_count);
}

/* ---- whether it is one */

/* How far the middles of triangles stand off at most. */
static double sagitta_of(const finder *f, const qw_primitive *p)
{
    double most = 0, gradient[3];
    for (uint32_t m = 0; m < f->member_count; m++) {
        double middle[3] = {0};
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t h = 3 * f->member[m] + i;
            const double *a = at(f, f->mesh->corner[h]), *b = at(f, f->mesh->corner[qw_next(h)]);
            for (int k = 0; k < 3; k++) middle[k] = (a[k] + b[k]) / 2;
            most = fmax(most, fabs(qw_primitive_distance(p, middle, gradient)));
        }
    }
    return most;
}

static bool runs_alike(const double *a, const double *b)
{
    return fabs(qw_dot_doubles(a, b)) > ALIKE * sqrt(qw_dot_doubles(a, a) * qw_dot_doubles(b, b));
}

/* Whether facet i turns so much more at a smooth edge that runs along a direction, but for those towards facet `from`,
   that `turn` is less bent. */
static bool is_more_bent(const finder *f, uint32_t i, uint32_t from, const double along[3], double turn)
{
    for (uint32_t k = f->rim_begin[i]; k < f->rim_begin[i + 1]; k++) {
        uint32_t h = f->rim[k];
        double e[3];
        if (f->facet[f->mesh->twin[h] / 3] == from || !is_smooth(f, h)) continue;
        edge_of(f, h, e);
        if (runs_alike(e, along) && turn <= LESS_BENT * turn_at(f, h)) return true;
    }
    return false;
}

/* Whether the surface breaks at h, or goes on with a round that was found: a plane needs that, as any triangle is one.
 */
static bool breaks_at(const finder *f, uint32_t h)
{
    if (!is_smooth(f, h) || turn_at(f, h) > BREAK) return true;
    uint32_t beyond = f->found.of_face[f->mesh->twin[h] / 3];
    return beyond != QW_NONE && f->found.item[beyond].kind != QW_PLANE;
}

/* Whether the surface goes on across h less bent than on one of its sides. */
static bool ends_at(const finder *f, uint32_t h)
{
    assert(h < 3 * f->mesh->face_count);
    if (breaks_at(f, h)) return true;
    uint32_t own = f->facet[h / 3], other = f->facet[f->mesh->twin[h] / 3];
    double along[3];
    edge_of(f, h, along);
    double turn = turn_at(f, h);
    return turn <= 0 || is_more_bent(f, own, other, along, turn) || is_more_bent(f, other, own, along, turn);
}

/* The length of an edge where the members, whose f->tried is `stamp`, end; 0 where they go on. */
static double end_at(const finder *f, uint32_t stamp, uint32_t h)
{
    uint32_t twin = f->mesh->twin[h];
    if (twin != QW_NONE && f->tried[twin / 3] == stamp) return 0;
    double e[3];
    edge_of(f, h, e);
    return sqrt(qw_dot_doubles(e, e));
}

/* Whether the members, whose f->tried is `stamp`, end for a reason. Decided as soon as the rest changes nothing. */
static bool ends_well(const finder *f, uint32_t stamp, uint32_t kind)
{
    double length = 0, good = 0, bad = 0;
    bool (*is_end)(const finder *, uint32_t) = kind == QW_PLANE ? breaks_at : ends_at;
    for (uint32_t m = 0; m < f->member_count; m++)
        for (uint32_t h = 3 * f->member[m]; h < 3 * f->member[m] + 3; h++) length += end_at(f, stamp, h);
    for (uint32_t m = 0; m < f->member_count; m++)
        for (uint32_t h = 3 * f->member[m]; h < 3 * f->member[m] + 3; h++) {
            double here = end_at(f, stamp, h);
            if (here > 0) *(is_end(f, h) ? &good : &bad) += here;
            if (bad > (1 - REASON) * length * (1 + 1e-9)) return false;
        }
    return good >= REASON * length;
}

/* Whether there are enough facets to tell. */
static bool has_facets(const finder *f)
{
    uint32_t count = 0, seen[FEW_FACETS];
    double least = INFINITY, most = 0;
    for (uint32_t m = 0; m < f->member_count && count < FEW_FACETS; m++) {
        uint32_t i = f->facet[f->member[m]], k = 0;
        while (k < count && seen[k] != i) k++;
        if (k < count) continue;
        seen[count++] = i;
        least = fmin(least, f->facet_area[i]), most = fmax(most, f->facet_area[i]);
    }
    return count == FEW_FACETS || (count >= LEAST_FACETS && most <= UNEVEN * least);
}

/* How many corners of a member are no ends, at most; f->tried of members is `stamp`. Any two circles about an axis lie
   on a sphere and any three on a torus: it takes one, and all three, to tell these from what turns about an axis. */
static uint32_t depth_of(finder *f, uint32_t stamp)
{
    const qw_trimesh *mesh = f->mesh;
    uint32_t on_rim = ++f->stamp, most = 0;
    for (uint32_t m = 0; m < f->member_count; m++)
        for (uint32_t h = 3 * f->member[m]; h < 3 * f->member[m] + 3; h++)
            if (mesh->twin[h] == QW_NONE || f->tried[mesh->twin[h] / 3] != stamp)
                f->seen[mesh->corner[h]] = f->seen[mesh->corner[qw_next(h)]] = on_rim;
    for (uint32_t m = 0; m < f->member_count; m++) {
        uint32_t inside = 0;
        for (uint32_t h = 3 * f->member[m]; h < 3 * f->member[m] + 3; h++) inside += f->seen[mesh->corner[h]] != on_rim;
        most = inside > most ? inside : most;
    }
    assert(most <= 3);
    return most;
}

/* Whether the members lie on p and could hardly do so by chance: refines p, then asks how much better it fits than
   planes do, how deep it is and how it ends. */
static bool is_certain(finder *f, qw_primitive *p)
{
    uint32_t stamp = f->member_count ? f->tried[f->member[0]] : 0, points = gather_points(f);
    if (points < qw_primitive_freedom(p->kind) + SPARE_TO_STAY || !has_facets(f)) return false;
    double off = qw_refine_primitive(p, f->point, points), sagitta = sagitta_of(f, p);
    if (off > QW_OFF_PRIMITIVE || sagitta < FAR_BETTER * off) return false;
    if (p->kind > QW_CONE) {
        uint32_t depth = depth_of(f, stamp);
        if (depth == 0) return false;
        if (sagitta >= BEYOND_DOUBT * fmax(off, LEAST_OFF) && depth >= (p->kind == QW_SPHERE ? 1 : 3)) return true;
    }
    return ends_well(f, stamp, p->kind);
}

static void keep(finder *f, const qw_primitive *p)
{
    for (uint32_t m = 0; m < f->member_count; m++) f->found.of_face[f->member[m]] = f->found.count;
    f->found.item[f->found.count++] = *p;
}

/* Grows what fits the seed, from cylinders on, and keeps the first that is certain. */
static bool try_seed(finder *f, uint32_t i, seed *s)
{
    for (qw_primitive_kind kind = QW_CYLINDER; kind <= s->last; kind++) {
        if (!s->is_known) fit(s, kind);
        if (!s->is_fit[kind]) continue;
        qw_primitive p = s->fit[kind];
        grow(f, i, &p);
        if (!is_certain(f, &p)) {
            for (uint32_t m = 0; f->member_count >= MUCH && m < f->member_count; m++) f->vain[f->member[m]] = 1;
            continue;
        }
        keep(f, &p);
        return true;
    }
    return false;
}

static seed *begin_seed(finder *f, uint32_t i, seed *p, qw_primitive_kind last)
{
    p->points = p->normals = 0, p->last = last, p->is_known = false, f->stamp++;
    return add_facet(f, i, p) ? p : NULL;
}

/* Facet i with those around it and theirs; false where there is no room for all. */
static bool take_all(finder *f, uint32_t i, const uint32_t *around, uint32_t count, seed *p)
{
    bool has_room = begin_seed(f, i, p, QW_TORUS) != NULL;
    for (uint32_t a = 0; a < count && has_room; a++) has_room = add_facet(f, around[a], p);
    for (uint32_t a = 0; a < count && has_room; a++) {
        uint32_t more[MOST_AROUND], size = f->begin[around[a] + 1] - f->begin[around[a]];
        uint32_t n = size > MOST_SCANNED ? 0 : list_around(f, around[a], more);
        for (uint32_t b = 0; b < n && has_room; b++) has_room = more[b] == i || add_facet(f, more[b], p);
    }
    return has_room;
}

/* Facet i with two of its neighbours, then with all. All fits are asked for at once where there are threads for them:
   most are in vain. */
static bool try_facet(finder *f, uint32_t i)
{
    uint32_t around[MOST_AROUND], count = list_around(f, i, around), seeds = 0;
    for (uint32_t a = 0; a < count && a < PAIRED; a++)
        for (uint32_t b = a + 1; b < count && b < PAIRED; b++) {
            seed *p = begin_seed(f, i, &f->seed[seeds], QW_CONE);
            seeds += p && add_facet(f, around[a], p) && add_facet(f, around[b], p);
        }
    if (count >= 2) seeds += take_all(f, i, around, count, &f->seed[seeds]);
    assert(seeds <= SEEDS);
    if (qw_env_threads(f->env) > 1) {
        qw_parallel(f->env, seeds * QW_PRIMITIVE_KINDS, 1, fit_some, f->seed);
        for (uint32_t k = 0; k < seeds; k++) f->seed[k].is_known = true;
    }
    for (uint32_t k = 0; k < seeds; k++)
        if (try_seed(f, i, &f->seed[k])) return true;
    return false;
}

/* Looks for round primitives from facets, the largest first, until MOST_VAIN in a row found none. */
static void find_round(finder *f)
{
    const uint32_t *order = by_area(f->env, f->facet_area, f->facet_count);
    uint32_t vain = 0;
    for (uint32_t k = 0; k < f->facet_count && vain < MOST_VAIN; k++) {
        uint32_t i = order[k];
        if (f->found.of_face[f->of[f->begin[i]]] != QW_NONE || qw_dot_doubles(f->plane[i].axis, f->plane[i].axis) == 0)
            continue;
        if (f->begin[i + 1] - f->begin[i] > MOST_SCANNED || f->vain[f->of[f->begin[i]]]) continue;
        qw_heartbeat(f->env);
        if (try_facet(f, i)) vain = 0;
        else vain++;
    }
}

/* Keeps facets as planes: those of their triangles that lie on no round primitive, if they are together no smaller than
   a quad, fit the plane, and end for a reason. quads: how many the whole surface gets. */
static void find_planes(finder *f, uint32_t quads)
{
    double whole = 0;
    for (uint32_t i = 0; i < f->facet_count; i++) whole += f->facet_area[i];
    for (uint32_t i = 0; i < f->facet_count; i++) {
        f->member_count = 0;
        uint32_t stamp = ++f->stamp;
        for (uint32_t m = f->begin[i]; m < f->begin[i + 1]; m++)
            if (f->found.of_face[f->of[m]] == QW_NONE)
                f->tried[f->of[m]] = stamp, f->member[f->member_count++] = f->of[m];
        if (f->member_count == 0 || f->facet_area[i] * quads < whole) continue;
        if (qw_dot_doubles(f->plane[i].axis, f->plane[i].axis) == 0) continue;
        uint32_t points = gather_points(f);
        qw_primitive p = f->plane[i];
        if (points < 3 || !ends_well(f, stamp, QW_PLANE) ||
            qw_refine_primitive(&p, f->point, points) > QW_OFF_PRIMITIVE)
            continue;
        keep(f, &p);
    }
}

static double reach_of(const qw_trimesh *mesh, uint32_t t)
{
    float longest = 0;
    for (uint32_t h = 3 * t; h < 3 * t + 3; h++)
        longest = fmaxf(longest,
                        qw_distance(mesh->position[mesh->corner[h]], mesh->position[mesh->corner[qw_next(h)]]));
    return (double)longest;
}

/* Whether a triangle, cross(edges) long `twice`, lies in one plane with a neighbour. */
static bool has_pair(const qw_trimesh *mesh, uint32_t t, qw_vec3 normal, double twice)
{
    double longest = reach_of(mesh, t), off = longest > 0 ? fmax(3 * LEAST_OFF, FLAT * twice / longest) : 0;
    for (uint32_t h = 3 * t; h < 3 * t + 3; h++) {
        if (mesh->twin[h] == QW_NONE) continue;
        qw_vec3 apex = mesh->position[mesh->corner[qw_prev(mesh->twin[h])]];
        if (fabs((double)qw_dot(qw_sub(apex, mesh->position[mesh->corner[h]]), normal)) <= off) return true;
    }
    return false;
}

/* Whether the vertices of a triangle and those across its edges, of one sphere, tell it from another shape. */
static bool is_of_sphere(const qw_trimesh *mesh, uint32_t t)
{
    double point[6][3], middle[3] = {0}, gradient[3];
    uint32_t count = 3;
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t h = 3 * t + i, twin = mesh->twin[h];
        qw_vec3 p = mesh->position[mesh->corner[h]];
        point[i][0] = (double)p.x, point[i][1] = (double)p.y, point[i][2] = (double)p.z;
        for (int k = 0; k < 3; k++) middle[k] += point[i][k] / 3;
        if (twin == QW_NONE) continue;
        p = mesh->position[mesh->corner[qw_prev(twin)]];
        point[count][0] = (double)p.x, point[count][1] = (double)p.y, point[count++][2] = (double)p.z;
    }
    qw_primitive sphere;
    double off = qw_fit_primitive(&sphere, QW_SPHERE, point[0], count, NULL);
    return off <= QW_OFF_PRIMITIVE &&
           BEYOND_DOUBT * fmax(off, LEAST_OFF) <= fabs(qw_primitive_distance(&sphere, middle, gradient));
}

bool qw_may_be_designed(const qw_trimesh *mesh)
{
    double whole = 0, paired = 0;
    for (uint32_t t = 0, step = mesh->face_count / SAMPLES + 1; t < mesh->face_count; t += step) {
        qw_vec3 cross = qw_face_cross(mesh, t);
        double twice = (double)qw_length(cross);
        whole += twice;
        if (has_pair(mesh, t, qw_normalize(cross), twice) || is_of_sphere(mesh, t)) paired += twice;
    }
    return paired > 0 && paired >= PAIRED_SHARE * whole;
}

qw_primitives qw_find_primitives(qw_env *env, const qw_trimesh *mesh, const double *position, double sharp,
                                 uint32_t quads)
{
    assert(mesh->twin && position);
    uint32_t n = mesh->face_count, vertices = mesh->vertex_count;
    qw_primitives found = {.item = QW_NEW(env, qw_primitive, n), .of_face = QW_NEW(env, uint32_t, n)};
    memset(found.of_face, 0xff, n * sizeof *found.of_face);
    qw_scope_begin(env);
    finder f = {.env = env, .mesh = mesh, .position = position, .sharp = sharp, .found = found};
    f.normal = QW_NEW(env, double, 3 * (size_t)n), f.area = QW_NEW(env, double, n);
    f.facet = QW_NEW(env, uint32_t, n), f.plane = QW_NEW(env, qw_primitive, n);
    f.seen = QW_NEW_ZERO(env, uint32_t, vertices), f.tried = QW_NEW_ZERO(env, uint32_t, n);
    f.vain = QW_NEW_ZERO(env, uint8_t, n);
    f.seed = QW_NEW(env, seed, SEEDS), f.member = QW_NEW(env, uint32_t, n),
    f.point = QW_NEW(env, double, 3 * (size_t)vertices);
    qw_parallel(env, n, 4096, measure_triangles, &f);
    make_facets(&f);
    for (uint32_t before = QW_NONE;
         before != f.found.count;) { /* what is found is a reason for what is beside it to end */
        before = f.found.count;
        memset(f.vain, 0, n * sizeof *f.vain);
        find_round(&f);
    }
    find_planes(&f, quads);
    found.count = f.found.count;
    qw_scope_end(env);
    return found;
}
