#include "products/limit/cavities.h"

#include "base/vec.h"

#include <assert.h>
#include <math.h>
#include <string.h>

typedef struct corners {
    const double *of[3];
} corners;

/* Half of a quad, cut from its first corner to its third. */
static corners half_of(const qw_quadmesh *q, const double *position, uint32_t f, uint32_t half)
{
    const uint32_t *c = q->corner + 4 * (size_t)f;
    return (corners){
        {position + 3 * (size_t)c[0], position + 3 * (size_t)c[1 + half], position + 3 * (size_t)c[2 + half]}};
}

static void normal_of(const corners *t, double normal[3])
{
    double u[3], v[3];
    for (int k = 0; k < 3; k++) u[k] = t->of[1][k] - t->of[0][k], v[k] = t->of[2][k] - t->of[0][k];
    qw_cross_doubles(u, v, normal);
}

/* Whether the ray from p along the first axis passes through the triangle. */
static bool is_crossed(const corners *t, const double *p)
{
    bool inside = false;
    for (int i = 0; i < 3; i++) {
        const double *a = t->of[i], *b = t->of[(i + 1) % 3];
        if ((a[1] > p[1]) != (b[1] > p[1])) inside ^= p[2] < a[2] + (p[1] - a[1]) / (b[1] - a[1]) * (b[2] - a[2]);
    }
    if (!inside) return false;
    double normal[3];
    const double *a = t->of[0];
    normal_of(t, normal);
    return a[0] - (normal[1] * (p[1] - a[1]) + normal[2] * (p[2] - a[2])) / normal[0] > p[0];
}

/* Six times the signed volume of each shell, from the place of one of its corners; *first: a corner of each. */
static double *volumes_of(qw_env *env, const qw_quadmesh *q, const double *position, const uint32_t *shell,
                          uint32_t shells, uint32_t *first)
{
    double *volume = QW_NEW_ZERO(env, double, shells);
    memset(first, 0xff, shells * sizeof *first);
    for (uint32_t f = 0; f < q->face_count; f++) {
        uint32_t s = shell[f];
        assert(s < shells);
        if (first[s] == QW_NONE) first[s] = q->corner[4 * (size_t)f];
        for (uint32_t half = 0; half < 2; half++) {
            corners t = half_of(q, position, f, half);
            double normal[3];
            normal_of(&t, normal);
            for (int k = 0; k < 3; k++)
                volume[s] += normal[k] * (t.of[0][k] - position[3 * (size_t)first[s] + (size_t)k]);
        }
    }
    return volume;
}

uint32_t *qw_find_cavities(qw_env *env, const qw_quadmesh *quads, const double *position, const uint32_t *shell,
                           uint32_t shells, const uint8_t *closed)
{
    uint32_t *outer = QW_NEW(env, uint32_t, shells), *first = QW_NEW(env, uint32_t, shells);
    memset(outer, 0xff, shells * sizeof *outer);
    double *volume = volumes_of(env, quads, position, shell, shells, first);
    uint8_t *around = QW_NEW(env, uint8_t, shells); /* 1: the ray has crossed the shell an odd number of times */
    for (uint32_t s = 0; s < shells; s++) {
        if (!closed[s] || !(volume[s] < 0)) continue;
        memset(around, 0, shells);
        qw_heartbeat(env);
        for (uint32_t f = 0; f < quads->face_count; f++)
            for (uint32_t half = 0; half < 2 && closed[shell[f]] && volume[shell[f]] > 0; half++) {
                corners t = half_of(quads, position, f, half);
                around[shell[f]] ^= is_crossed(&t, position + 3 * (size_t)first[s]);
            }
        for (uint32_t i = 0; i < shells; i++)
            if (around[i] && (outer[s] == QW_NONE || volume[i] < volume[outer[s]])) outer[s] = i;
        assert(outer[s] != s); /* one that is inside out lies within another that is not */
    }
    qw_free(env, volume), qw_free(env, around), qw_free(env, first);
    return outer;
}
