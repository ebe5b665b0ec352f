#include "base/lanes.h"

#include "base/mechanisms.h"

/* Called on the thread that may speak to the host. */
static int hear(void *user, qw_stage stage, double fraction)
{
    (void)stage, (void)fraction;
    return qw_listen(((qw_lane *)user)->run) ? 0 : 1;
}

qw_lane *qw_lanes_begin(qw_env *run, uint32_t count, size_t bytes)
{
    qw_lane *lanes = QW_NEW_ZERO(run, qw_lane, count);
    for (qw_lane *l = lanes; l < lanes + count; l++) {
        l->run = run;
        qw_arena_begin(&l->arena, qw_alloc(run, bytes, 1), bytes);
        qw_host host = {.resize = qw_arena_resize, .resize_user = &l->arena, .progress = hear, .progress_user = l};
        l->env = qw_env_create(&host, 1);
        if (l->env) qw_env_share_switches(l->env, run);
    }
    return lanes;
}

void qw_lanes_end(qw_lane *lanes, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) qw_env_destroy(lanes[i].env);
}
