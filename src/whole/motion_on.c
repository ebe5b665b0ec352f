#include "whole/motion_on.h"

#include "products/attributes/motion.h"
#include "whole/cut.h"

#include <math.h>

/* Rows that are wanted where movement changes from none to all, if edges need be no shorter than by QW_MOST_SHORTER for
   that. */
static const float ROWS = 4;

bool qw_follows_motion(const qw_run_state *run)
{
    return run->whole.steering->motion != NULL && run->options.follow_motion > 0;
}

qw_vec3 *qw_motion_on(const qw_run_state *run, const qw_vec3 *point, const qw_vec3 *normal, uint32_t count)
{
    qw_env *env = run->env;
    qw_vec3 *place = QW_NEW(env, qw_vec3, count);
    for (uint32_t v = 0; v < count; v++) place[v] = qw_in_whole(run, point[v]);
    qw_vec3 *change = qw_motion_at_points(env, run->whole.motion, place, normal, count);
    for (uint32_t v = 0; v < count; v++) change[v] = qw_scale(change[v], (float)qw_whole_scale(run));
    qw_free(env, place);
    return change;
}

float qw_room_of_motion(float size, qw_vec3 change)
{
    return fminf(fmaxf(4 - 1.5f * ROWS * size * qw_length(change), 0), 1);
}

void qw_fit_motion(const qw_run_state *run, float *size)
{
    qw_env *env = run->env;
    const qw_trimesh *s = &run->surface;
    qw_vec3 *normal = qw_vertex_normals(env, s), *change = qw_motion_on(run, s->position, normal, s->vertex_count);
    float share = fminf(2 * (float)run->options.follow_motion, 1);
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        float shorter = fminf(fmaxf(ROWS * size[v] * qw_length(change[v]), 1), QW_MOST_SHORTER);
        size[v] /= 1 + share * qw_room_of_motion(size[v], change[v]) * (shorter - 1);
    }
    qw_free(env, normal), qw_free(env, change);
}
