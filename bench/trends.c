/* Trends: figures that are better the lower they are, on families in which no count of them is right or wrong by
 * itself, so that they are no tests. One line each: name, value, of how many. bench/trends builds and runs it and keeps
 * the past.
 */
#include "../tests/shapes.h"

#include <stdio.h>

/* The result of the options on a surface; NULL where the run failed. */
static qw_result *result_of(const shape *s, const qw_options *options)
{
    qw_mesh_view view = shape_view(s);
    qw_result *result = NULL;
    if (qw_remesh(&view, options, NULL, &result) == QW_OK) return result;
    qw_result_destroy(result);
    return NULL;
}

static qw_options asking(int64_t faces)
{
    qw_options o;
    qw_options_init(&o);
    o.faces = faces;
    return o;
}

static void print_row(const char *name, double value, int64_t of)
{
    printf("%s\t%.4g\t%lld\n", name, value, (long long)of);
}

static shape horned(int horns, double width, double longer)
{
    shape ball = shape_sphere(24);
    for (uint32_t v = 0; v < ball.vertex_count; v++) {
        double *p = ball.position + 3 * (size_t)v, length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), r = 1;
        for (int i = 0; i < horns; i++) {
            double a = 2.4 * i, z = 0.8 - 1.6 * i / fmax(horns - 1, 1), w = sqrt(1 - z * z);
            double angle = acos(fmin((p[0] * w * cos(a) + p[1] * w * sin(a) + p[2] * z) / length, 1));
            r += longer * fmax(0, 1 - angle / width);
        }
        for (int k = 0; k < 3; k++) p[k] *= r / length;
    }
    return ball;
}

/* Ten horns of a ball, each thinner than a quad. */
static void horns(void)
{
    enum { HORNS = 10 };
    int64_t lost = 0, of = 0;
    shape ball = horned(HORNS, 0.2, 0.8);
    for (int64_t faces = 140; faces <= 180; faces += 10, of += HORNS) {
        qw_options o = asking(faces);
        qw_result *result = result_of(&ball, &o);
        lost += result ? qw_result_report(result)->lost_parts : HORNS;
        qw_result_destroy(result);
    }
    print_row("horns of a ball that are lost", (double)lost, of);
    shape_free(&ball);
}

/* Hands of sharp edges at few quads: what stays below the scaled Jacobian that is asked for. */
static void low_jacobians(void)
{
    int64_t low = 0, of = 0;
    for (int fineness = 2; fineness <= 3; fineness++) {
        shape s = shape_hand(fineness);
        for (int64_t faces = 80; faces <= 200; faces += 10) {
            qw_options o = asking(faces);
            o.jacobian_min = 0.3;
            qw_result *result = result_of(&s, &o);
            low += result ? qw_result_report(result)->low_jacobians : faces;
            of += faces;
            qw_result_destroy(result);
        }
        shape_free(&s);
    }
    print_row("quads of hands whose scaled Jacobian stays below 0.3", (double)low, of);
}

int main(void)
{
    horns();
    low_jacobians();
    return 0;
}
