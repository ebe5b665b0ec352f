/* An edge is a step of stairs where, within a ball as wide as a few quads, the surface turns back as much as it turns,
 * and yet its mean normal lies askew to both faces of the edge. The first holds for ledges, ribs and teeth too, but
 * there the mean is the normal of the tread; the second for the corner of a box, which turns one way.
 */
#include "mesh/stairs.h"

#include "mesh/curvature.h"

#include <assert.h>

/* Radius, in the size given, which is that of the smallest quads that the surface is made for (the largest have edges
 * 1.8 times as long): it takes in the next step where a step is as high as these are long. With 2.7, teeth of belts
 * that 1,000 quads can carry pass for stairs. */
static const double BALL = 2.0;
static const double MOST_TURN = 0.5;      /* of all the turning: what is left of it */
static const float IN_LINE = 0.94f;       /* cosine of 20 degrees between the mean normal and a face's */
static const double LEAST_DENSITY = 0.25; /* length of the sharp edges times the size, over the area */
enum { GRAIN = 64, BACK = 1, ASKEW = 2 };

typedef struct stairs_task {
    const qw_trimesh *mesh;
    const qw_vec3 *normal;
    const qw_ball_curvature *ball;
    const uint32_t *edge; /* half-edges */
    uint8_t *step;        /* uint8_t[edges]: 0, BACK, ASKEW */
} stairs_task;

static uint8_t step_at(const stairs_task *t, uint32_t h)
{
    qw_vec3 a = t->mesh->position[t->mesh->corner[h]], b = t->mesh->position[t->mesh->corner[qw_next(h)]];
    qw_vec3 n = t->normal[h / 3], m = t->normal[t->mesh->twin[h] / 3], both = qw_normalize(qw_add(n, m));
    qw_ball_sums s = qw_ball_sums_at(t->ball, qw_lerp(a, b, 0.5f), both);
    if (!(fabs(s.turn) < MOST_TURN * s.turning)) return 0;
    qw_vec3 mean = qw_normalize(s.normal);
    return qw_dot(mean, n) < IN_LINE && qw_dot(mean, m) < IN_LINE ? ASKEW : BACK;
}

static void ask_steps(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const stairs_task *t = user;
    for (uint32_t i = begin; i < end; i++) t->step[i] = step_at(t, t->edge[i]);
}

void qw_find_steps(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_step_networks *networks,
                   float size, qw_steps *steps)
{
    assert(mesh->mark && size > 0);
    qw_scope_begin(env);
    uint32_t *edge = QW_NEW(env, uint32_t, 3 * (size_t)mesh->face_count), count = 0;
    double length = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (!mesh->mark[h] || mesh->twin[h] < h || !networks->asked[networks->of_vertex[mesh->corner[h]]]) continue;
        edge[count++] = h;
        length += (double)qw_edge_length(mesh, h);
    }
    if (length * (double)size > LEAST_DENSITY * qw_trimesh_area(mesh)) {
        stairs_task t = {.mesh = mesh, .normal = normal, .edge = edge, .step = QW_NEW(env, uint8_t, count)};
        t.ball = qw_ball_curvature_of(env, mesh, normal, QW_BALL_MARKED, BALL * (double)size);
        qw_parallel(env, count, GRAIN, ask_steps, &t);
        for (uint32_t i = 0; i < count; i++) {
            qw_steps *s = &steps[networks->of_vertex[mesh->corner[edge[i]]]];
            if (t.step[i]) s->back += (double)qw_edge_length(mesh, edge[i]);
            if (t.step[i] == ASKEW) s->askew += (double)qw_edge_length(mesh, edge[i]);
        }
    }
    qw_scope_end(env);
}
