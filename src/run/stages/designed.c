#include "run/stages/designed.h"

#include "base/constants.h"
#include "whole/output.h"
#include "whole/kept_rims.h"
#include "whole/sizes.h"
#include "geometry/components_below.h"
#include "products/exact/exact.h"
#include "base/elementary.h"
#include "whole/half.h"
#include "whole/mirror.h"
#include "whole/suits_cut.h"

#include <assert.h>
#include <math.h>
#include <string.h>

typedef struct exacting {
    qw_run_state *run;
    qw_trimesh surface;
    double *position; /* double[surface vertices][3], in the frame */
    qw_primitives found;
    qw_exact exact;
} exacting;

static void to_frame(const qw_frame *frame, const double *p, double to[3])
{
    for (int k = 0; k < 3; k++) to[k] = (p[k] - frame->center[k]) * frame->scale;
}

/* The clean surface's vertices in double precision, where they are the input's. */
static void take_positions(exacting *x)
{
    const qw_run_state *run = x->run;
    const qw_clean_input *input = run->whole.input;
    const qw_trimesh *s = &x->surface;
    x->position = QW_NEW(run->env, double, 3 * (size_t)s->vertex_count);
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        double *p = x->position + 3 * (size_t)v;
        p[0] = (double)s->position[v].x, p[1] = (double)s->position[v].y, p[2] = (double)s->position[v].z;
    }
    double *framed = QW_NEW(run->env, double, 3 * (size_t)input->vertex_count);
    for (size_t v = 0; v < input->vertex_count; v++)
        to_frame(&run->whole.clean.frame, input->position + 3 * v, framed + 3 * v);
    for (uint32_t c = 0; c < 3 * s->face_count; c++) {
        double *p = x->position + 3 * (size_t)s->corner[c];
        uint32_t polygon = run->whole.clean.source_face[c / 3];
        assert(polygon < input->face_count);
        for (uint32_t k = input->face_begin[polygon]; k < input->face_begin[polygon + 1]; k++) {
            const double *q = framed + 3 * (size_t)input->corner[k];
            if (fabs(p[0] - q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]) < QW_SAME_VERTEX) memcpy(p, q, 3 * sizeof *q);
        }
    }
    qw_free(run->env, framed);
}

static bool is_asked(const qw_run_state *run)
{
    const qw_clean *clean = &run->whole.clean;
    return run->options.exact && run->options.repair && run->options.relax && clean->wrapped == 0 &&
           clean->own.count == 0 && run->finished.face_count > 0;
}

/* False where the surface is no designed one. quads: as qw_find_primitives has it. */
static bool find(exacting *x, uint32_t quads)
{
    qw_run_state *run = x->run;
    double angle = run->options.sharp_angle, sharp = angle < 0 ? QW_SHARP_COSINE : qw_cos(angle * QW_PI / 180);
    x->surface = run->whole.clean.mesh;
    x->surface.component = run->whole.census.components > 1 ? run->whole.census.component : NULL;
    if (!qw_may_be_designed(&x->surface)) return false;
    take_positions(x);
    x->found = qw_find_primitives(run->env, &x->surface, x->position, sharp, quads);
    x->exact = (qw_exact){.found = &x->found, .surface = &x->surface, .position = x->position};
    x->exact.tree = qw_bvh_build(run->env, &x->surface);
    return true;
}

/* Reflections are exact. */
static void reflect(qw_run_state *run, const uint32_t *component)
{
    qw_quadmesh *q = &run->finished;
    const qw_mirrored m = {*q, run->output, run->source};
    const qw_mirror_planes planes = qw_planes_of_whole(run, component, q->vertex_count);
    qw_reflect_again(run->env, &m, run->reflected, &planes, qw_sides_differ(run));
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        double p[3];
        to_frame(&run->whole.clean.frame, run->output + 3 * (size_t)v, p);
        q->position[v] = qw_v3_of_doubles(p);
    }
}

static bool has_rounds(const qw_primitives *found)
{
    for (uint32_t i = 0; i < found->count; i++)
        if (found->item[i].kind != QW_PLANE) return true;
    return false;
}

/* Moves run->finished and run->output. */
static uint32_t move(exacting *x)
{
    qw_run_state *run = x->run;
    qw_quadmesh *q = &run->finished, moved = *q;
    const qw_frame *frame = &run->whole.clean.frame;
    uint32_t n = q->vertex_count, flat;
    double *place = QW_NEW(run->env, double, 3 * (size_t)n), *output = QW_NEW(run->env, double, 3 * (size_t)n);
    qw_vec3 *position = QW_NEW(run->env, qw_vec3, n);
    for (uint32_t v = 0; v < n; v++) to_frame(frame, run->output + 3 * (size_t)v, place + 3 * (size_t)v);
    memcpy(position, q->position, n * sizeof *position);
    moved.position = position;
    moved.component = qw_components_below(run->env, q, run->reflected, &x->surface, x->exact.tree);
    uint32_t count = qw_put_on_primitives(run->env, &moved, place, &x->exact);
    memcpy(output, run->output, 3 * (size_t)n * sizeof *output);
    for (uint32_t v = 0; v < n; v++)
        for (uint32_t k = 0; k < 3 && !(x->exact.stays && x->exact.stays[v]); k++)
            output[3 * (size_t)v + k] = place[3 * (size_t)v + k] / frame->scale + frame->center[k];
    qw_settle_output(run, &run->whole.clean, &moved, output, &flat);
    if (flat == QW_NONE && run->rim) flat = qw_put_rims(run, &moved, output); /* to the bit */
    if (flat != QW_NONE) return 0;
    qw_keep(run->env, moved.position), qw_keep(run->env, output);
    q->position = moved.position, run->output = output;
    /* Strips to rims that stay are no reflections. On round shapes between sharp edges vertices stay as they were put,
       exactly and evenly, unless the plane was asked for. */
    bool stays = qw_finds_plane(run->options.symmetry) && has_rounds(&x->found) && qw_is_sharp(run);
    if (run->mirror.is_used && !run->rim && !stays) reflect(run, moved.component);
    return count;
}

/* Reports how many shapes of each kind were found. */
static void count_found(exacting *x)
{
    qw_report *r = x->run->report;
    for (uint32_t i = 0; i < x->found.count; i++) {
        r->exact_planes += x->found.item[i].kind == QW_PLANE;
        r->exact_cylinders += x->found.item[i].kind == QW_CYLINDER;
        r->exact_cones += x->found.item[i].kind == QW_CONE;
        r->exact_spheres += x->found.item[i].kind == QW_SPHERE;
        r->exact_tori += x->found.item[i].kind == QW_TORUS;
    }
}

void qw_make_exact(qw_run_state *run, bool is_cage, bool evens)
{
    qw_report *r = run->report;
    r->exact_planes = r->exact_cylinders = r->exact_cones = r->exact_spheres = r->exact_tori = r->exact_vertices = 0;
    if (!is_asked(run)) return;
    qw_scope_begin(run->env);
    exacting x = {.run = run};
    if (find(&x, run->finished.face_count)) {
        count_found(&x);
        x.exact.planes_only = is_cage;
        x.exact.stays = qw_list_rims(run);
        x.exact.evens = evens && !run->whole.input->density;
        r->exact_vertices = move(&x);
    }
    qw_scope_end(run->env);
}

const qw_primitive *qw_find_designed(qw_run_state *run, double (*point)[3], uint32_t count, uint32_t *of)
{
    exacting x = {.run = run};
    memset(of, 0xff, count * sizeof *of);
    if (!is_asked(run) || !find(&x, qw_unsplit_faces(run))) return NULL;
    const qw_frame *frame = &run->whole.clean.frame;
    for (uint32_t i = 0; i < count; i++) {
        qw_hit hit = qw_bvh_nearest(x.exact.tree, qw_in_frame(frame, point[i]), qw_v3(0, 0, 0), -2, INFINITY, QW_NONE);
        uint32_t p = hit.face == QW_NONE ? QW_NONE : x.found.of_face[hit.face];
        assert(p == QW_NONE || p < x.found.count);
        if (p != QW_NONE && x.found.item[p].kind <= QW_CONE) of[i] = p;
    }
    for (uint32_t i = 0; i < x.found.count; i++) {
        qw_primitive *p = &x.found.item[i];
        for (int k = 0; k < 3; k++) p->point[k] = p->point[k] / frame->scale + frame->center[k];
        p->radius /= frame->scale;
    }
    return x.found.item;
}
