/* The long way: a context, the stages one after another, progress, and a cancel that leaves the context in working
 * order. */
#include <quadwright/quadwright.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* A torus of 48 x 24 cells, two triangles each. */
enum { LONG_WAY = 48, SHORT_WAY = 24 };
static double positions[LONG_WAY * SHORT_WAY][3];
static uint32_t corners[2 * LONG_WAY * SHORT_WAY][3];

static qw_mesh_view make_torus(void)
{
    const double turn = 6.283185307179586;
    uint32_t t = 0;
    for (uint32_t i = 0; i < LONG_WAY; i++)
        for (uint32_t j = 0; j < SHORT_WAY; j++) {
            double u = turn * i / LONG_WAY, v = turn * j / SHORT_WAY, r = 1 + 0.4 * cos(v);
            double *p = positions[i * SHORT_WAY + j];
            p[0] = r * cos(u), p[1] = r * sin(u), p[2] = 0.4 * sin(v);
            uint32_t i1 = (i + 1) % LONG_WAY, j1 = (j + 1) % SHORT_WAY;
            uint32_t a = i * SHORT_WAY + j, b = i1 * SHORT_WAY + j, c = i1 * SHORT_WAY + j1, d = i * SHORT_WAY + j1;
            corners[t][0] = a, corners[t][1] = b, corners[t++][2] = c;
            corners[t][0] = a, corners[t][1] = c, corners[t++][2] = d;
        }
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = LONG_WAY * SHORT_WAY,
                          .face_count = t,
                          .uniform_face_size = 3,
                          .positions = positions[0],
                          .corners = corners[0]};
}

/* What the user has: here, a patience that may run out. */
typedef struct patience {
    int calls, calls_left; /* calls_left below zero: endless */
    qw_stage stage;
} patience;

static int watch(void *user, qw_stage stage, double fraction)
{
    patience *p = user;
    if (p->calls == 0 || stage != p->stage) printf("%3.0f %%  %s\n", 100 * fraction, qw_stage_title(stage));
    p->calls++;
    p->stage = stage;
    return p->calls_left >= 0 && p->calls_left-- == 0; /* anything but 0 cancels */
}

static int fail(const char *what, const qw_context *context)
{
    fprintf(stderr, "%s: %s\n", what, qw_message(context));
    return 1;
}

int main(void)
{
    patience user = {.calls_left = 3};
    qw_host host = {.progress = watch, .progress_user = &user};
    qw_context *context;
    if (qw_create(&host, &context) != QW_OK) return 1;

    qw_mesh_view torus = make_torus();
    if (qw_set_mesh(context, &torus) != QW_OK) return fail("set mesh", context);
    qw_options options;
    qw_options_init(&options);
    options.faces = 500;

    if (qw_run(context, &options) != QW_CANCELLED) return fail("a cancel was expected", context);
    printf("%s\n", qw_message(context));

    user = (patience){.calls_left = -1};
    if (qw_run_until(context, &options, QW_STAGE_ORIENTATION) != QW_OK) return fail("orientation", context);
    printf("the field has %lld singularities\n", (long long)qw_get_report(context)->orientation_singularities);

    qw_mesh_view quads;
    if (qw_get_mesh(context, &quads) != QW_NOT_READY) return fail("there should be no quads yet", context);
    if (qw_run(context, &options) != QW_OK) return fail("run", context);
    if (qw_get_mesh(context, &quads) != QW_OK) return fail("get mesh", context);
    const qw_report *report = qw_get_report(context);
    printf("%u quads, Euler characteristic %lld, angles off by %.1f degrees\n", quads.face_count,
           (long long)report->topology.euler, report->angle_rms);
    int wrong = report->topology.euler != 0 || quads.uniform_face_size != 4;
    qw_destroy(context);
    return wrong;
}
