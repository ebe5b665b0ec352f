/* The width at a triangle: from its middle a straight line is followed over the surface, both ways along each axis
   of its frame, until it meets a constrained curve that runs across. The width is the distance between the two ends. */
#include "remesh/quantise/narrow_bands.h"

#include <assert.h>
#include <math.h>

/* The curves of a band may slant against the axis that they follow by this sine at most (17 degrees), */
static const float SLANT = 0.3f;
/* and in a triangle at a corner against one another by this (8 degrees). */
static const float TAPER = 0.15f;
/* Narrower widths, in wanted lengths, count as this: what is so thin is freed elsewhere (acute_corners.h) or left to
   rounding. */
static const float LEAST_WIDTH = 0.05f;
enum { MAX_STEPS = 32, SIZE_ROUNDS = 12 };

typedef struct narrow_bands {
    const qw_offset_mesh *m;
    uint8_t *near; /* uint8_t[vertex_count], see qw_offset_near_curves */
    float *width;  /* float[2 face_count]: across the x and y axis of the triangle's frame, in wanted lengths; INFINITY
                      where no band is */
} narrow_bands;

static qw_vec3 tail_of(const qw_offset_mesh *m, uint32_t h) { return m->position[m->corner[h]]; }

static qw_vec3 face_normal(const qw_offset_mesh *m, uint32_t f)
{
    qw_vec3 p = tail_of(m, 3 * f);
    return qw_normalize(qw_cross(qw_sub(tail_of(m, 3 * f + 1), p), qw_sub(tail_of(m, 3 * f + 2), p)));
}

/* The side of f by which the line p + t d leaves it, other than `entry`; *t: how far that is. QW_NONE where rounding
 * hides it. */
static uint32_t exit_of(const qw_offset_mesh *m, uint32_t f, uint32_t entry, qw_vec3 normal, qw_vec3 p, qw_vec3 d,
                        float *t)
{
    assert(f < m->face_count);
    uint32_t best = QW_NONE;
    *t = INFINITY;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        if (h == entry) continue;
        qw_vec3 a = tail_of(m, h), outward = qw_cross(qw_sub(tail_of(m, qw_next(h)), a), normal);
        float speed = qw_dot(outward, d), away = qw_dot(outward, qw_sub(a, p));
        if (!(speed > 0)) continue;
        float at = fmaxf(away / speed, 0);
        if (at < *t) *t = at, best = h;
    }
    return best;
}

/* The distance from p in triangle f along d, a unit vector in its plane, to a constrained curve that runs across;
   INFINITY if none is within `most`. *lean: the sine by which the curve turns to the left of what is square to d. */
static float distance_to_curve(const qw_offset_mesh *m, uint32_t f, qw_vec3 p, qw_vec3 d, float most, float *lean)
{
    assert(f < m->face_count && lean);
    float gone = 0, t;
    *lean = 0;
    uint32_t entry = QW_NONE;
    qw_vec3 normal = face_normal(m, f);
    for (int step = 0; step < MAX_STEPS; step++) {
        uint32_t h = exit_of(m, f, entry, normal, p, d, &t);
        if (h == QW_NONE || !((gone += t) < most)) return INFINITY;
        qw_vec3 side = qw_normalize(qw_sub(tail_of(m, qw_next(h)), tail_of(m, h)));
        float slant = qw_dot(side, d);
        if (m->fixed[m->edge[h]]) {
            *lean = -slant; /* sides of a triangle go counter-clockwise, so this one leaves d on its left */
            return fabsf(slant) < SLANT ? gone : INFINITY;
        }
        entry = m->twin[h];
        if (entry == QW_NONE) return INFINITY;
        p = qw_madd(p, t, d);
        f = entry / 3;
        normal = face_normal(m, f);
        /* the direction, turned over the side into the plane of the next triangle */
        d = qw_madd(qw_scale(side, slant), sqrtf(fmaxf(1 - slant * slant, 0)), qw_cross(side, normal));
    }
    return INFINITY;
}

/* The half-edge of f whose edge's frame is used: the cross at a corner cannot follow all of its curves. */
static uint32_t well_framed(const qw_offset_mesh *m, uint32_t f)
{
    assert(f < m->face_count);
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
        if (m->constraint[m->corner[m->half[m->edge[h]]]] != QW_VERTEX_CORNER) return h;
    return 3 * f;
}

/* How wide the band between curves is around each triangle, along both axes of its cross, as a share of the wanted
 * size. */
static void measure_widths(void *user, uint32_t begin, uint32_t end)
{
    const narrow_bands *s = user;
    const qw_offset_mesh *m = s->m;
    for (uint32_t f = begin; f < end; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        s->width[2 * f] = s->width[2 * f + 1] = INFINITY;
        if (!s->near[c[0]] && !s->near[c[1]] && !s->near[c[2]]) continue;
        float size = (m->size[c[0]] + m->size[c[1]] + m->size[c[2]]) / 3;
        qw_vec3 middle = qw_scale(qw_add(qw_add(m->position[c[0]], m->position[c[1]]), m->position[c[2]]), 1 / 3.0f);
        qw_vec3 normal = face_normal(m, f), axis[2];
        float lean[2];
        bool at_corner = m->constraint[c[0]] == QW_VERTEX_CORNER || m->constraint[c[1]] == QW_VERTEX_CORNER ||
                         m->constraint[c[2]] == QW_VERTEX_CORNER;
        if (!(qw_length2(normal) > 0)) continue;
        qw_offset_axes(m, well_framed(m, f), &axis[0], &axis[1]);
        for (uint32_t k = 0; k < 2; k++) {
            qw_vec3 d = qw_normalize(qw_madd(axis[k], -qw_dot(axis[k], normal), normal));
            float one = distance_to_curve(m, f, middle, d, size, &lean[0]);
            if (!(one < size)) continue;
            float both = one + distance_to_curve(m, f, middle, qw_scale(d, -1), size - one, &lean[1]);
            if (at_corner && fabsf(lean[0] - lean[1]) > TAPER)
                continue; /* otherwise the tip of an acute corner would be stretched without bound */
            if (both < size) s->width[2 * f + k] = fmaxf(both / size, LEAST_WIDTH);
        }
    }
}

static float stretch_of(float width, double scale) { return fmaxf(1, 1 / (width * (float)scale)); }

/* The factor of all offsets for which, with narrow bands stretched to a width of one, the area is that of so many
   quads. */
static double find_scale(const narrow_bands *s, double quads)
{
    const qw_offset_mesh *m = s->m;
    double scale = 1;
    for (int round = 0; round < SIZE_ROUNDS; round++) {
        double area = 0;
        for (uint32_t h = 0; h < 3 * m->face_count; h += 3) {
            qw_real2 a = qw_turn_real(m->rot[h], m->real[m->edge[h]]),
                     b = qw_turn_real(m->rot[h + 1], m->real[m->edge[h + 1]]);
            const float *width = s->width + 2 * (size_t)(h / 3);
            double stretch = (double)(stretch_of(width[0], scale) * stretch_of(width[1], scale));
            area += 0.5 * stretch * fabs((double)a.x * (double)b.y - (double)a.y * (double)b.x);
        }
        scale = sqrt(quads / fmax(area, 1e-30));
    }
    return scale;
}

int64_t qw_stretch_narrow_bands(qw_env *env, qw_offset_mesh *m, double quads)
{
    assert(quads > 0 && m->size);
    qw_scope_begin(env);
    narrow_bands s = {.m = m};
    int64_t count = 0;
    bool any = false;
    for (uint32_t e = 0; e < m->edge_count; e++) any |= m->fixed[e] != 0;
    if (any) {
        s.near = qw_offset_near_curves(env, m);
        s.width = QW_NEW(env, float, 2 * (size_t)m->face_count);
        qw_parallel(env, m->face_count, QW_GRAIN, measure_widths, &s);
        for (uint32_t f = 0; f < m->face_count; f++) count += s.width[2 * f] < 1 || s.width[2 * f + 1] < 1;
    }
    if (count > 0) {
        double scale = find_scale(&s, quads);
        for (uint32_t e = 0; e < m->edge_count; e++) {
            uint32_t sides[2] = {m->half[e], m->twin[m->half[e]]};
            float width[2] = {INFINITY, INFINITY};
            for (int i = 0; i < 2; i++)
                for (uint32_t k = 0; k < 2 && sides[i] != QW_NONE; k++)
                    width[k] = fminf(width[k], s.width[2 * (sides[i] / 3) + (k ^ (m->rot[sides[i]] & 1u))]);
            m->real[e].x *= stretch_of(width[0], scale), m->real[e].y *= stretch_of(width[1], scale);
        }
    }
    qw_scope_end(env);
    return count;
}
