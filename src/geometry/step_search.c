#include "geometry/step_search.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { DIRECTIONS = 8 };
static const double across[DIRECTIONS][2] = {{1, 0},  {0.70710678, 0.70710678},   {0, 1},  {-0.70710678, 0.70710678},
                                             {-1, 0}, {-0.70710678, -0.70710678}, {0, -1}, {0.70710678, -0.70710678}};

/* Of the cost before, what may be left after a step: one that saves less is not worth another round around it. */
static const double LEFT = 0.999;

void qw_grow_marks(const qw_quadmesh *q, int rings, uint8_t *marks)
{
    assert(rings >= 0 && marks);
    for (int ring = 0; ring < rings; ring++) {
        for (uint32_t h = 0; h < 4 * q->face_count; h++)
            if (marks[q->corner[h]] == 1) {
                uint32_t u = q->corner[qw_quad_next(h)], w = q->corner[qw_quad_prev(h)];
                if (!marks[u]) marks[u] = 2;
                if (!marks[w]) marks[w] = 2;
            }
        for (uint32_t v = 0; v < q->vertex_count; v++) marks[v] = marks[v] != 0;
    }
}

/* Of the quads around v; a lower bound once it reaches `most`. */
static double cost_around(const qw_step_search *s, uint32_t v, double most)
{
    double sum = 0;
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1] && sum < most; i++) sum += s->cost(s->user, v, s->around[i] / 4);
    return sum;
}

static void put(const qw_step_search *s, uint32_t v, const qw_spot *spot)
{
    if (s->position) s->position[v] = qw_v3_of_doubles(spot->at);
    else memcpy(s->place + 3 * (size_t)v, spot->at, sizeof spot->at);
    if (s->put) s->put(s->user, v, spot);
}

/* Takes the best of the steps of one length; returns whether there is one. */
static bool step_once(const qw_step_search *s, uint32_t v, double length, const qw_vec3 *axis, qw_spot *here,
                      double *least)
{
    const qw_spot from = *here;
    bool along = qw_length2(axis[1]) == 0, found = false;
    for (int i = 0; i < DIRECTIONS; i += along ? DIRECTIONS / 2 : 1) {
        double x = length * across[i][0], y = length * across[i][1];
        const double to[3] = {from.at[0] + x * (double)axis[0].x + y * (double)axis[1].x,
                              from.at[1] + x * (double)axis[0].y + y * (double)axis[1].y,
                              from.at[2] + x * (double)axis[0].z + y * (double)axis[1].z};
        qw_spot spot = from;
        if (!s->land(s->user, v, to, &spot)) continue;
        put(s, v, &spot);
        double cost = cost_around(s, v, *least);
        if (cost < LEFT * *least) *least = cost, *here = spot, found = true;
    }
    put(s, v, here);
    return found;
}

/* Moves v to the best spot, and it sleeps. Returns whether that costs less. */
static bool search_vertex(const qw_step_search *s, uint32_t v)
{
    assert(s->lengths > 0 && (s->position != NULL) != (s->place != NULL));
    qw_spot here = {.on = QW_NONE};
    qw_vec3 axis[2];
    s->awake[v] = 0;
    if (s->position) qw_to_doubles(s->position[v], here.at);
    else memcpy(here.at, s->place + 3 * (size_t)v, sizeof here.at);
    double length = s->frame(s->user, v, &here, axis);
    if (!(length > 0)) return false;
    double least = cost_around(s, v, INFINITY);
    bool found = false;
    for (int i = 0; i < s->lengths; i++, length /= 2) found |= step_once(s, v, length, axis, &here, &least);
    return found;
}

static void wake_around(const qw_step_search *s, uint32_t v)
{
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; i++)
        for (uint32_t k = 0; k < 4; k++) s->awake[s->corner[(s->around[i] & ~3u) + k]] = 1;
}

bool qw_search_all(const qw_step_search *s, const uint32_t *vertex, uint32_t count)
{
    bool any = false;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t v = vertex ? vertex[i] : i;
        if (!s->awake[v] || !search_vertex(s, v)) continue;
        wake_around(s, v), any = true;
    }
    return any;
}
