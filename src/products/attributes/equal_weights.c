#include "products/attributes/equal_weights.h"

#include "base/hash.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Points of a curve, each the mean of as much of it, so that the steps of its triangles are gone. */
enum { POINTS = 48 };
static const double HALF = 0.5;
/* Around a place that a target moves as a whole, movement changes alike on all sides: at the least by this share of the
   most. Where a lip leaves the other, or a lid the eye, it does not, and the curve goes around one of the two. */
static const double ALIKE = 0.25;
/* At a joint a weight changes by this share at least within a radius of the limb; slower changes are those of a back
   that bends as a whole. */
static const double LEAST_CHANGE = 0.25;

/* A step of a curve through a triangle; the group has more than half on its left. */
typedef struct step {
    double from[3], to[3], change; /* of what moves, in a unit of length */
    uint32_t group;
} step;

typedef struct tracing {
    qw_env *env;
    const qw_clean_input *input;
    const qw_attribute *moves; /* weights, or a target */
    double largest;            /* offset of a target */
    const qw_vec3 *motion;     /* qw_vec3[faces of the input] */
    step *step;                /* step[count] */
    uint32_t count;
    size_t room;
    qw_hash_table from; /* steps by where they begin */
    uint8_t *walked;    /* uint8_t[count] */
} tracing;

/* The share of a group in the weights of a vertex; of a target's largest offset that of a vertex. */
static double share_of(const tracing *t, uint32_t v, uint32_t group)
{
    return t->moves->kind == QW_WEIGHTS ? qw_share_of_group(t->moves, v, group)
                                        : qw_offset_at(t->moves, v) / t->largest;
}

/* The group with more than half; QW_NONE: there is none. */
static uint32_t main_group(const tracing *t, uint32_t v)
{
    const qw_attribute *a = t->moves;
    if (a->kind != QW_WEIGHTS) return share_of(t, v, 0) > HALF ? 0 : QW_NONE;
    for (size_t k = (size_t)v * a->components; k < (size_t)(v + 1) * a->components; k++)
        if (share_of(t, v, a->group[k]) > HALF) return a->group[k];
    return QW_NONE;
}

/* Where the share on an edge is a half; the same from both sides, and for vertices that lie at the same places. */
static void cross_edge(const double *p, const double *q, double of_p, double of_q, double at[3])
{
    int k = 0;
    while (k < 2 && p[k] == q[k]) k++;
    if (p[k] > q[k]) {
        cross_edge(q, p, of_q, of_p, at);
        return;
    }
    double share = (HALF - of_p) / (of_q - of_p);
    for (int i = 0; i < 3; i++) at[i] = p[i] + share * (q[i] - p[i]);
}

/* Adds the segment in triangle f along which a bone has half of the weight, if there is one. */
static void add_step(tracing *t, uint32_t f, const uint32_t corner[3], uint32_t group)
{
    double share[3];
    const double *p[3];
    for (int i = 0; i < 3; i++)
        share[i] = share_of(t, corner[i], group), p[i] = t->input->position + 3 * (size_t)corner[i];
    step s = {.change = (double)qw_length(t->motion[f]), .group = group};
    int ends = 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        bool is_in = share[i] > HALF, goes_in = share[j] > HALF;
        if (is_in == goes_in) continue;
        cross_edge(p[i], p[j], share[i], share[j], is_in ? s.from : s.to), ends++;
    }
    if (ends != 2 || qw_is_one_place(s.from, s.to)) return;
    t->step = qw_grow(t->env, t->step, &t->room, (size_t)t->count + 1, sizeof *t->step);
    t->step[t->count++] = s;
}

static void add_triangle(tracing *t, uint32_t f, const uint32_t corner[3])
{
    uint32_t group[3];
    for (int i = 0; i < 3; i++) {
        group[i] = main_group(t, corner[i]);
        bool is_new = group[i] != QW_NONE;
        for (int j = 0; j < i; j++) is_new &= group[j] != group[i];
        if (is_new) add_step(t, f, corner, group[i]);
    }
}

static void add_steps(tracing *t)
{
    const qw_clean_input *in = t->input;
    for (uint32_t f = 0; f < in->face_count; f++) {
        if (f % 4096 == 0) qw_heartbeat(t->env);
        for (uint32_t c = in->face_begin[f] + 1; c + 1 < in->face_begin[f + 1]; c++) {
            const uint32_t corner[3] = {in->corner[in->face_begin[f]], in->corner[c], in->corner[c + 1]};
            add_triangle(t, f, corner);
        }
    }
}

/* ---- from step to step */

typedef struct place {
    const tracing *t;
    const double *at;
    uint32_t group;
} place;

static bool begins_at(const void *wanted, uint32_t number)
{
    const place *p = wanted;
    const step *s = &p->t->step[number];
    return s->group == p->group && qw_is_one_place(s->from, p->at);
}

static uint32_t *slot_of(const tracing *t, const double at[3], uint32_t group)
{
    place p = {t, at, group};
    return qw_hash_slot(&t->from, qw_mix(qw_hash_place(at) + group), begins_at, &p);
}

/* The mean of each part of a curve. */
typedef struct part {
    double place[3], change;
} part;

/* Adds a step to the means of the parts that it lies in; gone: how much of the length of all lies before it. */
static void spread_step(const step *s, double gone, double length, double total, part *parts)
{
    double at = 0, each = total / POINTS;
    int i = (int)fmin(gone / each, POINTS - 1);
    for (; at < length; i++) {
        double end = i < POINTS - 1 ? fmin(fmax((i + 1) * each - gone, at), length) : length;
        double share = (end - at) / each, middle = (at + end) / (2 * length);
        for (int k = 0; k < 3; k++) parts[i].place[k] += share * (s->from[k] + middle * (s->to[k] - s->from[k]));
        parts[i].change += share * s->change, at = end;
    }
}

static double length_of(const step *s) { return sqrt(qw_distance2_doubles(s->from, s->to)); }

/* The curve that a step is of, where it closes. */
static bool walk(tracing *t, uint32_t first, part *parts)
{
    double total = 0, gone = 0;
    uint32_t at = first;
    while (at != QW_NONE && !t->walked[at]) {
        t->walked[at] = 1, total += length_of(&t->step[at]);
        at = *slot_of(t, t->step[at].to, t->step[at].group);
    }
    if (at != first || !(total > 0) || !isfinite(total)) return false;
    memset(parts, 0, POINTS * sizeof *parts);
    do {
        double length = length_of(&t->step[at]);
        spread_step(&t->step[at], gone, length, total, parts);
        gone += length, at = *slot_of(t, t->step[at].to, t->step[at].group);
    } while (at != first);
    return true;
}

static bool is_joint(const tracing *t, const part *parts)
{
    double least = INFINITY, most = 0, mean = 0, length = 0;
    for (int i = 0; i < POINTS; i++) {
        least = fmin(least, parts[i].change), most = fmax(most, parts[i].change), mean += parts[i].change / POINTS;
        length += sqrt(qw_distance2_doubles(parts[i].place, parts[(i + 1) % POINTS].place));
    }
    return t->moves->kind == QW_WEIGHTS ? mean * length > 2 * QW_PI * LEAST_CHANGE : least > ALIKE * most;
}

/* Joins the steps of each bone to curves and keeps those around joints, as POINTS points and the first again. */
static void add_curves(tracing *t, qw_equal_weights *made)
{
    add_steps(t);
    if (t->count == 0) return;
    t->from = qw_hash_table_create(t->env, t->count), t->walked = QW_NEW_ZERO(t->env, uint8_t, t->count);
    for (uint32_t i = 0; i < t->count; i++) *slot_of(t, t->step[i].from, t->step[i].group) = i;
    for (uint32_t i = 0; i < t->count; i++) {
        part parts[POINTS];
        if (t->walked[i] || !walk(t, i, parts) || !is_joint(t, parts)) continue;
        uint32_t begin = made->count * (POINTS + 1);
        made->point = qw_resize(t->env, made->point, begin + POINTS + 1, 3 * sizeof *made->point);
        for (size_t k = 0; k <= POINTS; k++)
            memcpy(made->point + 3 * (begin + k), parts[k % POINTS].place, sizeof parts->place);
        made->count++;
    }
    qw_free(t->env, t->from.slot), qw_free(t->env, t->walked), qw_free(t->env, t->step);
}

qw_equal_weights qw_find_equal_weights(qw_env *env, const qw_clean_input *input, const qw_attribute *attributes,
                                       uint32_t count, const double *largest, const qw_vec3 *motion)
{
    qw_equal_weights made = {0};
    for (uint32_t i = 0; i < count && motion; i++) {
        tracing t = {.env = env, .input = input, .moves = &attributes[i], .motion = motion, .largest = largest[i]};
        if (t.moves->kind == QW_WEIGHTS || t.largest > 0) add_curves(&t, &made);
    }
    if (made.count == 0) return made;
    made.begin = QW_NEW(env, uint32_t, made.count + 1);
    for (uint32_t i = 0; i <= made.count; i++) made.begin[i] = i * (POINTS + 1);
    return made;
}
