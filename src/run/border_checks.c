#include "run/border_checks.h"

#include "remesh/features/graph.h"
#include "remesh/quads/topology.h"

#include <math.h>

static bool is_finite(qw_vec3 p) { return isfinite(p.x) && isfinite(p.y) && isfinite(p.z); }
static bool is_unit(qw_vec3 p) { return fabsf(qw_length2(p) - 1) < 1e-3f; }

static void check_positions(qw_env *env, const char *what, const qw_vec3 *position, uint32_t count)
{
    for (uint32_t v = 0; v < count; v++)
        if (!is_finite(position[v])) qw_fail(env, QW_INTERNAL, v, "vertex %u of the %s is not finite", v, what);
}

static void check_sizes(qw_env *env, const char *what, const float *size, uint32_t count)
{
    for (uint32_t v = 0; v < count; v++)
        if (!(size[v] > 0 && isfinite(size[v])))
            qw_fail(env, QW_INTERNAL, v, "the %s at vertex %u is %g", what, v, (double)size[v]);
}

static void check_clean(qw_run_state *run)
{
    qw_env *env = run->env;
    qw_trimesh_validate(env, &run->whole.clean.mesh);
    if (run->whole.clean.mesh.face_count == 0) qw_fail(env, QW_INTERNAL, -1, "the clean surface is empty");
    if (!(run->whole.area > 0 && isfinite(run->whole.area)))
        qw_fail(env, QW_INTERNAL, -1, "the area of the surface is %g", run->whole.area);
}

static void check_core(qw_run_state *run)
{
    qw_env *env = run->env;
    qw_trimesh_validate(env, &run->clean.mesh);
    if (!(run->area > 0 && isfinite(run->area) && run->extent > 0))
        qw_fail(env, QW_INTERNAL, -1, "the area of the core is %g", run->area);
    if (!(run->mirror.times >= 1 && run->mirror.times <= 1 << QW_MOST_PLANES))
        qw_fail(env, QW_INTERNAL, -1, "quads of the core are %g times in the result", run->mirror.times);
}

/* Fails where a mesh has not the topology of what it was made from. */
static void check_topology(qw_env *env, const char *what, const qw_trimesh *mesh, const qw_trimesh *from)
{
    qw_trimesh_validate(env, mesh);
    qw_census is = qw_trimesh_census(env, mesh), was = qw_trimesh_census(env, from);
    if (is.components != was.components || is.euler != was.euler || is.boundary_loops != was.boundary_loops)
        qw_fail(
            env, QW_INTERNAL, -1,
            "the %s has %lld components, Euler number %lld and %lld loops, what it was made from %lld, %lld and %lld",
            what, (long long)is.components, (long long)is.euler, (long long)is.boundary_loops,
            (long long)was.components, (long long)was.euler, (long long)was.boundary_loops);
}

static void check_surface(qw_run_state *run)
{
    check_topology(run->env, "surface", &run->surface, &run->core.mesh);
    check_positions(run->env, "surface", run->surface.position, run->surface.vertex_count);
}

/* The working mesh is sound, has a size, a verdict and a constraint at every vertex. */
static void check_working(qw_run_state *run)
{
    qw_env *env = run->env;
    const qw_trimesh *mesh = &run->working.mesh;
    if (!(run->rho > 0 && isfinite(run->rho) && run->faces_wanted >= 1))
        qw_fail(env, QW_INTERNAL, -1, "the size of the quads is %g", run->rho);
    check_topology(env, "working mesh", mesh, &run->surface);
    check_sizes(env, "target length", run->working.target, mesh->vertex_count);
    if (!qw_are_verdicts_of(mesh, run->curve_verdict))
        qw_fail(env, QW_INTERNAL, -1, "a verdict is of no curve, or a curve has none");
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (run->constraint[v] > QW_VERTEX_CORNER)
            qw_fail(env, QW_INTERNAL, v, "vertex %u is held by %u", v, run->constraint[v]);
        if (run->constraint[v] == QW_VERTEX_CURVE && !is_unit(run->direction[v]))
            qw_fail(env, QW_INTERNAL, v, "the curve at vertex %u has no direction", v);
        if (!is_finite(run->normal[v])) qw_fail(env, QW_INTERNAL, v, "the normal at vertex %u is not finite", v);
    }
}

/* A level's neighbours are vertices of it, none of its own colour; each vertex has one colour and a parent. */
static void check_level(qw_env *env, const qw_level *level, const qw_level *coarse)
{
    uint32_t n = level->vertex_count;
    for (uint32_t v = 0; v < n; v++) {
        if (level->begin[v] > level->begin[v + 1])
            qw_fail(env, QW_INTERNAL, v, "the neighbours of vertex %u end before they begin", v);
        for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++)
            if (level->neighbour[i] >= n || level->neighbour[i] == v)
                qw_fail(env, QW_INTERNAL, v, "vertex %u has a neighbour %u", v, level->neighbour[i]);
        if (coarse && level->parent[v] >= coarse->vertex_count)
            qw_fail(env, QW_INTERNAL, v, "vertex %u has no parent", v);
    }
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, n);
    uint32_t *color = QW_NEW(env, uint32_t, n);
    for (uint32_t c = 0; c < level->color_count; c++)
        for (uint32_t i = level->color_begin[c]; i < level->color_begin[c + 1]; i++)
            seen[level->by_color[i]]++, color[level->by_color[i]] = c;
    for (uint32_t v = 0; v < n; v++) {
        if (seen[v] != 1) qw_fail(env, QW_INTERNAL, v, "vertex %u has %u colours", v, seen[v]);
        for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++)
            if (color[level->neighbour[i]] == color[v])
                qw_fail(env, QW_INTERNAL, v, "vertex %u has a neighbour of its own colour", v);
    }
    qw_free(env, seen), qw_free(env, color);
}

static void check_hierarchy(qw_run_state *run)
{
    const qw_hierarchy *h = run->hierarchy;
    if (h->level[0].vertex_count != run->working.mesh.vertex_count)
        qw_fail(run->env, QW_INTERNAL, -1, "the hierarchy is of another mesh");
    for (uint32_t l = 0; l < h->level_count; l++)
        check_level(run->env, &h->level[l], l + 1 < h->level_count ? &h->level[l + 1] : NULL);
}

static void check_orientation(qw_run_state *run)
{
    for (uint32_t v = 0; v < run->working.mesh.vertex_count; v++)
        if (!is_unit(run->orientation[v]))
            qw_fail(run->env, QW_INTERNAL, v, "the cross at vertex %u has no direction", v);
}

/* regular: Eq. (3) holds on every triangle. */
static void check_offsets(qw_run_state *run, const qw_offset_mesh *m, bool regular)
{
    qw_offset_validate(run->env, m);
    check_sizes(run->env, "wanted size", m->size, m->vertex_count);
    for (uint32_t f = 0; f < m->face_count && regular; f++)
        if (!qw_int2_is_zero(qw_offset_residual(m, f)))
            qw_fail(run->env, QW_INTERNAL, f, "the offsets around triangle %u do not close", f);
}

static void check_repaired(qw_run_state *run)
{
    if (!run->options.repair) return; /* as it came out of the contraction */
    qw_quadmesh_validate(run->env, &run->repaired);
    qw_topology_check check = qw_check_topology(run->env, &run->repaired, &run->working.mesh);
    if (run->topology_kept && check.broken_count > 0)
        qw_fail(run->env, QW_INTERNAL, -1, "%u components lost their topology unseen", check.broken_count);
}

static void check_simplified(qw_run_state *run)
{
    if (!run->options.repair) return;
    qw_quadmesh_validate(run->env, &run->simplified);
    qw_topology_check check = qw_check_topology(run->env, &run->simplified, &run->working.mesh);
    if (run->topology_kept && check.broken_count > 0)
        qw_fail(run->env, QW_INTERNAL, -1, "%u components lost their topology to moves", check.broken_count);
}

/* Relaxation moves vertices and turns quads. Half of a surface may have none where so few are wanted: the whole is
   taken then. */
static void check_relaxed(qw_run_state *run, const qw_quadmesh *quads)
{
    if (run->options.repair) qw_quadmesh_validate(run->env, quads);
    if (quads->face_count == 0 && !run->mirror.is_used) qw_fail(run->env, QW_INTERNAL, -1, "no quads are left");
    check_positions(run->env, "result", quads->position, quads->vertex_count);
}

static void check_assembled(qw_run_state *run)
{
    check_relaxed(run, &run->finished);
    if (run->finished.face_count == 0 && run->sides_meet) qw_fail(run->env, QW_INTERNAL, -1, "no quads are left");
    for (uint32_t i = 0; i < 3 * run->finished.vertex_count; i++)
        if (!isfinite(run->output[i]))
            qw_fail(run->env, QW_INTERNAL, i / 3, "vertex %u of the output is not finite", i / 3);
}

void qw_check_border(qw_run_state *run, qw_stage finished)
{
    qw_env *env = run->env;
    uint32_t n = run->working.mesh.vertex_count;
    bool regular = run->irregular == 0; /* the paper's flows may leave some */
    qw_scope_begin(env);
    switch (finished) {
    case QW_STAGE_CLEAN: check_clean(run); break;
    case QW_STAGE_CORE: check_core(run); break;
    case QW_STAGE_SURFACE: check_surface(run); break;
    case QW_STAGE_WORKING: check_working(run); break;
    case QW_STAGE_HIERARCHY: check_hierarchy(run); break;
    case QW_STAGE_ORIENTATION: check_orientation(run); break;
    case QW_STAGE_SCALE: check_sizes(env, "wanted size", run->size, n); break;
    case QW_STAGE_POSITION: check_positions(env, "lattice", run->lattice, n); break;
    case QW_STAGE_OFFSETS: check_offsets(run, &run->offsets, false); break;
    case QW_STAGE_REGULAR: check_offsets(run, &run->regular, regular); break;
    case QW_STAGE_INVERSIONS: check_offsets(run, &run->inversion_free, regular); break;
    case QW_STAGE_QUADS:
        check_positions(env, "quads", run->extraction.quads.position, run->extraction.quads.vertex_count);
        break;
    case QW_STAGE_POSITIONS:
        check_positions(env, "embedded quads", run->embedded.position, run->embedded.vertex_count);
        break;
    case QW_STAGE_REPAIR: check_repaired(run); break;
    case QW_STAGE_SIMPLIFY: check_simplified(run); break;
    case QW_STAGE_RELAX: check_relaxed(run, &run->relaxed); break;
    case QW_STAGE_FINISH: check_relaxed(run, &run->fitted); break;
    case QW_STAGE_ASSEMBLE: check_assembled(run); break;
    default: break;
    }
    qw_scope_end(env);
}
