/* An edge is a step of stairs where, within a ball as wide as a few quads, the surface turns back as much as it turns,
 * and yet its mean normal lies askew to both faces of the edge. The first holds for ledges, ribs and teeth too, but
 * there the mean is the normal of the tread; the second for the corner of a box, which turns one way.
 */
#include "remesh/features/stairs.h"

#include "geometry/curvature.h"
#include "geometry/effort.h"

#include <assert.h>
#include <math.h>

/* Radius, in the size given, which is that of the smallest quads that the surface is made for (the largest have edges
 * 1.8 times as long): it takes in the next step where a step is as high as these are long. With 2.7, teeth of belts
 * that 1,000 quads can carry pass for stairs. */
static const double BALL = 2.0;
static const double MOST_TURN = 0.5;      /* of all the turning: what is left of it */
static const float IN_LINE = 0.94f;       /* cosine of 20 degrees between the mean normal and a face's */
static const double LEAST_DENSITY = 0.25; /* length of the sharp edges times the size, over the area */
enum step_flag { BACK = 1, ASKEW = 2 };

typedef struct stairs_task {
    const qw_trimesh *mesh;
    const qw_vec3 *normal;
    const qw_ball_curvature *ball;
    const uint32_t *edge; /* half-edges that are asked */
    uint8_t *step;        /* uint8_t[edges]: 0, BACK, ASKEW */
} stairs_task;

static qw_vec3 middle_of(const stairs_task *t, uint32_t h)
{
    return qw_lerp(t->mesh->position[t->mesh->corner[h]], t->mesh->position[t->mesh->corner[qw_next(h)]], 0.5f);
}

static uint8_t step_at(const stairs_task *t, uint32_t h)
{
    qw_vec3 n = t->normal[h / 3], m = t->normal[t->mesh->twin[h] / 3], both = qw_normalize(qw_add(n, m));
    qw_ball_sums s = qw_ball_sums_at(t->ball, middle_of(t, h), both);
    if (!(fabs(s.turn) < MOST_TURN * s.turning)) return 0;
    qw_vec3 mean = qw_normalize(s.normal);
    return qw_dot(mean, n) < IN_LINE && qw_dot(mean, m) < IN_LINE ? ASKEW : BACK;
}

static void ask_steps(void *user, uint32_t begin, uint32_t end)
{
    const stairs_task *t = user;
    for (uint32_t i = begin; i < end; i++) t->step[i] = step_at(t, t->edge[i]);
}

/* Marked edges of the networks that are asked, in the order of their half-edges; the surface is looked at for a few of
   each network, and what was found holds for those after it. */
typedef struct stairs_edges {
    uint32_t *half, count;    /* half-edges */
    uint32_t *sample;         /* uint32_t[count]: the one in `asked` whose answer each takes */
    uint32_t *asked, samples; /* half-edges */
    double length;            /* of all */
} stairs_edges;

/* holds: how far what was found holds. */
static stairs_edges list_edges(qw_env *env, const qw_trimesh *mesh, const qw_step_networks *networks, double holds)
{
    size_t most = 3 * (size_t)mesh->face_count;
    stairs_edges e = {QW_NEW(env, uint32_t, most), 0, QW_NEW(env, uint32_t, most), QW_NEW(env, uint32_t, most), 0, 0};
    uint32_t *last = QW_NEW(env, uint32_t, mesh->vertex_count); /* of each network */
    double *left = QW_NEW_ZERO(env, double, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t network = networks->of_vertex[mesh->corner[h]];
        if (!mesh->mark[h] || mesh->twin[h] < h || !networks->asked[network]) continue;
        if (left[network] <= 0) {
            last[network] = e.samples, e.asked[e.samples++] = h;
            left[network] = holds;
        }
        left[network] -= (double)qw_edge_length(mesh, h);
        e.length += (double)qw_edge_length(mesh, h);
        e.half[e.count] = h, e.sample[e.count++] = last[network];
    }
    qw_free(env, last), qw_free(env, left);
    return e;
}

/* Of the samples as many as can be afforded: where teeth are much finer than the ball, each looks at thousands of
   pieces. */
static uint32_t affordable_samples(const stairs_task *t, const stairs_edges *e)
{
    qw_probes probes = {0};
    for (uint32_t i; qw_next_probe(&probes, e->samples, &i);)
        probes.effort += qw_ball_effort(t->ball, middle_of(t, e->asked[i]));
    return qw_affordable(&probes, e->samples);
}

void qw_find_steps(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_step_networks *networks,
                   float size, qw_steps *steps)
{
    assert(mesh->mark && size > 0);
    qw_scope_begin(env);
    double holds = BALL / 4 * (double)size;
    stairs_edges e = list_edges(env, mesh, networks, holds);
    if (e.length * (double)size > LEAST_DENSITY * qw_trimesh_area(mesh)) {
        stairs_task t = {.mesh = mesh, .normal = normal};
        t.ball = qw_ball_curvature_of(env, mesh, normal, QW_BALL_MARKED, BALL * (double)size);
        uint32_t affordable = affordable_samples(&t, &e);
        if (affordable < e.samples) e = list_edges(env, mesh, networks, fmax(holds, e.length / affordable));
        t.edge = e.asked, t.step = QW_NEW(env, uint8_t, e.samples);
        qw_parallel(env, e.samples, QW_GRAIN_SEARCH, ask_steps, &t);
        for (uint32_t i = 0; i < e.count; i++) {
            qw_steps *s = &steps[networks->of_vertex[mesh->corner[e.half[i]]]];
            uint8_t step = t.step[e.sample[i]];
            if (step) s->back += (double)qw_edge_length(mesh, e.half[i]);
            if (step == ASKEW) s->askew += (double)qw_edge_length(mesh, e.half[i]);
        }
    }
    qw_scope_end(env);
}
