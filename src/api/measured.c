/* The public functions that measure: each makes an environment of its own, so that they can be called from any thread.
 */
#include "api/context.h"
#include "api/loaded.h"
#include "base/mesh_view.h"
#include "products/measure/measure.h"
#include "products/wrap/visible.h"
#include "products/wrap/wrap.h"
#include "whole/mirror.h"

#include <float.h>

/* ---- what is seen from outside */

static const double VISIBLE_CELL = 1.0 / 200; /* of the diagonal */

typedef struct visible_job {
    qw_mesh *mesh;
    double distance;
} visible_job;

/* gap: in the coordinates of the view, or else a share of its diagonal. flags: as of qw_visible_part. The arrays are of
 * the current scope. */
static qw_mesh_view visible_part(qw_env *env, const qw_mesh_view *view, double gap, double share, uint8_t **flags)
{
    uint32_t *begin = QW_NEW(env, uint32_t, (size_t)view->face_count + 1);
    begin[0] = 0;
    for (uint32_t f = 0; f < view->face_count; f++) begin[f + 1] = begin[f] + qw_view_face_size(view, f);
    const qw_clean_input input = {.vertex_count = view->vertex_count,
                                  .face_count = view->face_count,
                                  .position = view->positions,
                                  .face_begin = begin,
                                  .corner = view->corners};
    qw_clean_input seen = qw_visible_part(env, &input, gap > 0 ? gap : share * qw_wrap_diagonal(&input), flags);
    return (qw_mesh_view){.size = sizeof *view,
                          .vertex_count = seen.vertex_count,
                          .face_count = seen.face_count,
                          .uniform_face_size = 3,
                          .positions = seen.position,
                          .corners = seen.corner};
}

/* Replaces the view of a mesh by its part that can be seen from outside, gaps of that width closed. */
static void visible_body(void *user)
{
    visible_job *job = user;
    qw_mesh *mesh = job->mesh;
    qw_env *env = mesh->env;
    qw_mesh_view *view = &mesh->view;
    if (!mesh->is_whole) qw_fail(env, QW_ARGUMENT, -1, "there is no mesh: it could not be read");
    if (!(job->distance >= 0 && job->distance <= 1))
        qw_fail(env, QW_ARGUMENT, -1, "the width of gaps is %g; it must be a share of the diagonal, 0 to 1",
                job->distance);
    qw_require_view(env, view, "mesh");
    qw_require_moderate(env, view, "mesh");
    *view = visible_part(env, view, 0, job->distance > 0 ? job->distance : VISIBLE_CELL, NULL);
    mesh->attribute = NULL, mesh->attribute_count = 0;
}

qw_status qw_mesh_visible(qw_mesh *mesh, double distance)
{
    if (!mesh) return QW_ARGUMENT;
    visible_job job = {mesh, distance};
    return qw_protect(mesh->env, visible_body, &job);
}

/* ---- what the quads were made of */

/* Adds the triangles of the clean surface in the coordinates of the input or, turned, of its reflection. */
static void add_surface(const qw_run_state *run, bool reflected, qw_mesh_view *to, double *position, uint32_t *corner)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        double *p = position + 3 * ((size_t)to->vertex_count + v);
        qw_place_in_input(&run->whole.clean, m->position[v], p);
        if (reflected) qw_reflect(&run->mirror.plane[0], (const double[3]){p[0], p[1], p[2]}, p);
    }
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t from = reflected ? 3 * (h / 3) + 2 - h % 3 : h;
        corner[3 * (size_t)to->face_count + h] = to->vertex_count + m->corner[from];
    }
    to->vertex_count += m->vertex_count, to->face_count += m->face_count;
}

/* The surface that quads were made of, where their sides are not those of the input: false where they are, where what
   is measured has polygons beside it, and where it was wrapped, as the input says more then. In the current scope. */
static bool find_origin(qw_env *env, const qw_run_state *run, qw_mesh_view *origin)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    const qw_report *r = run->report;
    bool is_mirrored = run->mirror.is_used && !run->mirror.own && !qw_sides_differ(run);
    bool differs = is_mirrored || r->turned_components > 0 || r->flipped_triangles > 0;
    if (!differs || run->whole.left_out || run->whole.clean.wrapped > 0 || m->face_count == 0) return false;
    size_t times = is_mirrored ? 2 : 1;
    double *position = QW_NEW(env, double, 3 * times * m->vertex_count);
    uint32_t *corner = QW_NEW(env, uint32_t, 3 * times * m->face_count);
    *origin = (qw_mesh_view){.size = sizeof *origin, .uniform_face_size = 3, .positions = position, .corners = corner};
    add_surface(run, false, origin, position, corner);
    if (is_mirrored) add_surface(run, true, origin, position, corner);
    return true;
}

/* ---- measuring */

typedef struct measure_job {
    qw_env *env;
    const qw_mesh_view *mesh, *against;
    double gap;              /* above 0: what lies behind narrower ones does not count */
    const qw_run_state *run; /* whose result the mesh is; NULL: of none that is known */
    qw_topology topology;
    qw_quality quality;
} measure_job;

/* Checks the meshes and measures one, against the other where there is one, of which only what can be seen counts
   if gaps have a width. */
static void measure_body(void *user)
{
    measure_job *job = user;
    qw_require_view(job->env, job->mesh, "mesh");
    qw_require_moderate(job->env, job->mesh, "mesh");
    if (job->against) qw_require_view(job->env, job->against, "surface to measure against");
    if (job->against) qw_require_moderate(job->env, job->against, "surface to measure against");
    if (!(job->gap >= 0 && job->gap <= DBL_MAX))
        qw_fail(job->env, QW_ARGUMENT, -1, "the width of gaps is %g; it must be 0 or a length", job->gap);
    qw_mesh_view seen;
    uint8_t *flags = NULL;
    bool hides = job->against && job->against->face_count > 0 && job->gap > 0;
    if (hides) seen = visible_part(job->env, job->against, job->gap, 0, &flags);
    qw_mesh_view origin;
    bool has_origin = job->run && find_origin(job->env, job->run, &origin);
    qw_sides sides = {flags, has_origin ? &origin : NULL};
    qw_measure_mesh(job->env, job->mesh, hides ? &seen : job->against, &sides, &job->topology, &job->quality);
}

/* Runs measure_body in an environment of its own; *topology and *quality are written only if it succeeds. */
static qw_status measure(measure_job *job, const qw_host *host, qw_topology *topology, qw_quality *quality)
{
    if (!topology || !quality) return QW_ARGUMENT;
    job->env = qw_env_create(host, 0);
    if (!job->env) return QW_MEMORY;
    qw_status status = qw_protect(job->env, measure_body, job);
    if (status == QW_OK) *topology = job->topology, *quality = job->quality;
    if (status != QW_OK)
        qw_log(job->env, QW_LOG_WARNING, "%s", qw_env_message(job->env)); /* there is no other place for it */
    qw_env_destroy(job->env);
    return status;
}

qw_status qw_measure(const qw_mesh_view *mesh, const qw_mesh_view *against, const qw_host *host, qw_topology *topology,
                     qw_quality *quality)
{
    return qw_measure_seen(mesh, against, 0, host, topology, quality);
}

qw_status qw_measure_seen(const qw_mesh_view *mesh, const qw_mesh_view *against, double gap, const qw_host *host,
                          qw_topology *topology, qw_quality *quality)
{
    measure_job job = {.mesh = mesh, .against = against, .gap = gap};
    return measure(&job, host, topology, quality);
}

qw_status qw_measure_result(const qw_context *context, const qw_mesh_view *against, const qw_host *host,
                            qw_topology *topology, qw_quality *quality)
{
    qw_mesh_view mesh;
    qw_status status = qw_get_mesh(context, &mesh);
    if (status != QW_OK) return status;
    measure_job job = {
        .mesh = &mesh, .against = against, .gap = qw_get_report(context)->wrap_distance, .run = &context->state.run};
    return measure(&job, host, topology, quality);
}
