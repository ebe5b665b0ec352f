#include "run/stages/split_levels.h"

#include "run/stages/designed.h"

#include "base/promise.h"
#include "whole/cut.h"
#include "whole/mirror.h"
#include "whole/output.h"
#include "whole/kept_rims.h"
#include "whole/asked.h"
#include "products/limit/cage.h"
#include "products/limit/fit_limit.h"
#include "products/limit/jacobian.h"
#include "products/limit/stencils.h"
#include "remesh/relax/fit.h"
#include "remesh/relax/flip_repair.h"
#include "geometry/components_below.h"
#include "geometry/quad_moves.h"
#include "whole/half.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Changes that are tried, and the quads that are looked at again in all of them. */
enum { LEAST_TURNS = 16, MOST_TURNED = 1 << 20 };

/* The quads of the result while they are fitted and split. */
typedef struct leveling {
    qw_run_state *run;
    qw_quadmesh quads; /* in the frame of the whole */
    uint32_t reflected;
    uint32_t *source; /* as run->source */
    uint8_t *stays;   /* uint8_t[vertices]: of rims that are kept; NULL: none */
    qw_trimesh surface;
    qw_shape shape;
} leveling;

/* ---- the surface */

/* Sharp edges of the core in all its images, and the boundaries of the whole. */
static void list_curves(leveling *l)
{
    const qw_run_state *run = l->run;
    const qw_trimesh *core = &run->surface, *whole = &run->whole.clean.mesh;
    uint32_t sharp = 0, open = 0, count = 0;
    for (uint32_t h = 0; h < 3 * core->face_count; h++)
        sharp += qw_stands_for_edge(core, h) && qw_is_curve_edge(core, h, false);
    for (uint32_t h = 0; h < 3 * whole->face_count; h++) open += whole->twin[h] == QW_NONE;
    if (sharp + open == 0) return;
    size_t images = qw_image_count(run), all = images * sharp + open;
    qw_vec3 *from = QW_NEW(run->env, qw_vec3, all), *to = QW_NEW(run->env, qw_vec3, all);
    uint32_t *component = qw_clean_components_of_faces(run, core);
    for (uint32_t h = 0; h < 3 * core->face_count; h++)
        for (uint32_t i = 0; i < images && qw_stands_for_edge(core, h) && qw_is_curve_edge(core, h, false); i++) {
            if (!qw_image_has(run, i, component[h / 3])) continue;
            from[count] = qw_image_of(run, i, core->position[core->corner[h]]);
            to[count++] = qw_image_of(run, i, core->position[core->corner[qw_next(h)]]);
        }
    for (uint32_t h = 0; h < 3 * whole->face_count; h++) {
        if (whole->twin[h] != QW_NONE) continue;
        from[count] = whole->position[whole->corner[h]];
        to[count++] = whole->position[whole->corner[qw_next(h)]];
    }
    assert(count <= all);
    qw_free(run->env, component);
    l->shape.from = from, l->shape.to = to, l->shape.curves = qw_curve_tree_build(run->env, from, to, count);
}

static void take_surface(leveling *l)
{
    const qw_run_state *run = l->run;
    l->surface = run->whole.clean.mesh;
    if (run->whole.census.components > 1) l->surface.component = run->whole.census.component;
    l->shape = (qw_shape){.tree = qw_bvh_build(run->env, &l->surface), .surface = &l->surface};
    list_curves(l);
}

static void find_components(leveling *l)
{
    l->quads.component = qw_components_below(l->run->env, &l->quads, l->reflected, &l->surface, l->shape.tree);
}

/* ---- positions */

/* The quads' positions in the coordinates of the input: reflections are exact, and what stays is where it was. */
static double *write_positions(leveling *l)
{
    qw_run_state *run = l->run;
    const qw_frame *frame = &run->whole.clean.frame;
    uint32_t flat;
    double *output = qw_output_positions(run, &run->whole.clean, &l->quads, &flat);
    for (uint32_t v = 0; l->stays && v < l->quads.vertex_count; v++)
        if (l->stays[v]) memcpy(output + 3 * (size_t)v, run->output + 3 * (size_t)v, 3 * sizeof *output);
    if (run->mirror.is_used) {
        const qw_mirrored m = {l->quads, output, l->source};
        if (run->mirror.own) find_components(l);
        const qw_mirror_planes planes = qw_planes_of_whole(run, l->quads.component, l->quads.vertex_count);
        qw_reflect_again(run->env, &m, l->reflected, &planes, qw_sides_differ(run));
        for (uint32_t v = 0; v < l->quads.vertex_count; v++) {
            double p[3];
            for (int k = 0; k < 3; k++) p[k] = (output[3 * (size_t)v + (size_t)k] - frame->center[k]) * frame->scale;
            l->quads.position[v] = qw_v3_of_doubles(p);
        }
    }
    if (flat != QW_NONE)
        qw_fail(run->env, QW_INTERNAL, flat,
                "quad %u has no area in the coordinates that would be written, so the result is withheld", flat);
    return output;
}

static void fit_limit(leveling *l)
{
    qw_run_state *run = l->run;
    if (run->options.fit_to != QW_FIT_TO_LIMIT || run->options.fit == 0) return;
    const qw_limit_fit fit = {&l->shape, l->stays};
    qw_fit_limit(run->env, &l->quads, &fit);
}

static bool is_low(const qw_run_state *run, const qw_quadmesh *q, uint32_t f)
{
    return qw_scaled_jacobian(q->position, q->corner + 4 * (size_t)f) < (float)run->options.jacobian_min;
}

/* Quads below the aim; *least: the lowest of all. */
static uint32_t count_low_of(const qw_run_state *run, const qw_quadmesh *q, float *least)
{
    uint32_t low = 0;
    *least = 1;
    for (uint32_t f = 0; f < q->face_count; f++) {
        low += is_low(run, q, f);
        *least = fminf(*least, qw_scaled_jacobian(q->position, q->corner + 4 * (size_t)f));
    }
    return low;
}

static uint32_t count_low(const qw_run_state *run)
{
    float least;
    return count_low_of(run, &run->finished, &least);
}

/* Whether a corner of the quad stays where it is. */
static bool has_rim(const leveling *l, uint32_t f)
{
    for (uint32_t h = 4 * f; l->stays && f != QW_NONE && h < 4 * f + 4; h++)
        if (l->stays[l->quads.corner[h]]) return true;
    return false;
}

/* One quad becomes five: one around its middle, and one along each side, so that each of its corners gets an edge. */
static void inset_quad(qw_quadmesh *m, uint32_t f)
{
    assert(f < m->face_count);
    uint32_t ring = m->face_count, first = m->vertex_count, corner[4], twin[4];
    uint8_t mark[4];
    qw_vec3 middle = qw_quad_middle(m->position, m->corner + 4 * (size_t)f);
    for (uint32_t i = 0; i < 4; i++) {
        corner[i] = m->corner[4 * f + i], twin[i] = m->twin[4 * f + i], mark[i] = m->mark[4 * f + i];
        m->position[first + i] = qw_scale(qw_add(middle, m->position[corner[i]]), 0.5f);
        m->kind[first + i] = QW_VERTEX_FREE, m->component[first + i] = m->component[corner[i]];
    }
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t after = (i + 1) & 3, h = 4 * (ring + i), inner = 4 * f + i;
        const uint32_t corners[4] = {corner[i], corner[after], first + after, first + i};
        memcpy(m->corner + h, corners, sizeof corners);
        memset(m->mark + h, 0, 4);
        m->twin[h] = twin[i], m->mark[h] = mark[i];
        if (twin[i] != QW_NONE) m->twin[twin[i]] = h;
        m->twin[h + 1] = 4 * (ring + after) + 3, m->twin[4 * (ring + after) + 3] = h + 1;
        m->twin[h + 2] = inner, m->twin[inner] = h + 2;
        m->corner[inner] = first + i, m->mark[inner] = 0;
    }
    m->face_count += 4, m->vertex_count += 4;
}

/* What may be done about a low quad besides moving vertices: a side turns, edges are added, or both. */
typedef struct mend {
    bool turns, insets;
} mend;

/* How many quads are low, the lowest of all, and how often changes were tried. */
typedef struct mending {
    uint32_t low, tries;
    float least;
} mending;

/* Moves vertices of the mesh, which may have more than the one before: new ones are put on the surface first. Whether
   fewer quads are low then, and none lower than the lowest was: *m tells how many. */
static bool raise_again(leveling *l, qw_quadmesh *q, uint32_t before, mending *m)
{
    qw_env *env = l->run->env;
    assert(before <= q->vertex_count);
    uint8_t *stays = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    memset(stays, 1, before);
    if (q->vertex_count > before) qw_put_on_shape(env, q, &l->shape, stays);
    memset(stays, 0, before);
    if (l->stays) memcpy(stays, l->stays, l->quads.vertex_count);
    qw_raise_jacobians(env, q, &l->shape, stays, (float)l->run->options.jacobian_min);
    mending now = {.tries = m->tries + 1};
    now.low = count_low_of(l->run, q, &now.least);
    bool is_better = now.low < m->low && now.least >= m->least;
    m->tries++;
    if (is_better && l->stays) l->stays = stays, qw_keep(env, stays);
    if (is_better) *m = now;
    return is_better;
}

/* Insets those of the two quads that are low, where they have no rim and the count has room: whether any is. */
static bool inset_low(const leveling *l, qw_quad_edit *e, uint32_t f, uint32_t beyond)
{
    const uint32_t both[2] = {f, beyond};
    double wanted = qw_faces_wanted(l->run, &l->run->options);
    uint32_t before = e->mesh.face_count;
    for (int i = 0; i < 2; i++) {
        if (both[i] == QW_NONE || has_rim(l, both[i]) || !is_low(l->run, &e->mesh, both[i])) continue;
        if (!qw_is_near_count(wanted, e->mesh.face_count + 4.0, 1)) continue;
        qw_quad_edit_reserve(e, 4);
        inset_quad(&e->mesh, both[i]);
    }
    return e->mesh.face_count > before;
}

/* Changes the mesh at the side h of a low quad and moves vertices again; kept where that mends. */
static bool mend_at(leveling *l, uint32_t h, mend way, qw_quad_move_kind kind, mending *m)
{
    qw_env *env = l->run->env;
    uint32_t f = h / 4, beyond = !way.turns || l->quads.twin[h] == QW_NONE ? QW_NONE : l->quads.twin[h] / 4;
    if (has_rim(l, f) || (way.turns ? beyond == QW_NONE || has_rim(l, beyond) : h % 4 != 0)) return false;
    qw_scope_begin(env);
    qw_quad_edit e = qw_quad_edit_open(env, &l->quads);
    bool is_better = false;
    uint32_t before = e.mesh.vertex_count;
    if (!way.turns || qw_make_quad_move(&e, (qw_quad_move){h, kind}, false)) {
        if (way.turns) is_better = raise_again(l, &e.mesh, before, m);
        if (!is_better && way.insets && inset_low(l, &e, f, beyond)) is_better = raise_again(l, &e.mesh, before, m);
    }
    if (is_better) l->quads = e.mesh, qw_quad_edit_keep(&e);
    qw_scope_end(env);
    return is_better;
}

/* Where both sides of a corner lie on one curve no move of vertices helps: another edge has to come there. A turn takes
   it from elsewhere; where there is no room for more edges at that vertex, a turn takes the flat corner to the next. */
static void mend_low(leveling *l)
{
    static const mend ways[] = {{true, false}, {false, true}, {true, true}};
    const qw_run_state *run = l->run;
    mending m = {.tries = 0};
    m.low = count_low_of(run, &l->quads, &m.least);
    if (run->mirror.is_used) return; /* both halves would have to change alike */
    for (size_t way = 0; way < sizeof ways / sizeof *ways; way++)
        for (uint32_t h = 0; h < 4 * l->quads.face_count && m.low > 0; h++) {
            if (!is_low(run, &l->quads, h / 4)) continue;
            if (m.tries >= LEAST_TURNS && (uint64_t)m.tries * l->quads.face_count > MOST_TURNED) return;
            qw_heartbeat(run->env);
            if (!mend_at(l, h, ways[way], QW_ROTATE_ON, &m) && ways[way].turns)
                mend_at(l, h, ways[way], QW_ROTATE_BACK, &m);
        }
}

/* Not for quads whose limit surface is what lies near. is_split: the quads belong to those of a coarser level, and only
   their vertices move. */
static void raise_jacobians(leveling *l, bool is_split)
{
    qw_run_state *run = l->run;
    if (run->options.jacobian_min == 0 || qw_fits_limit(run)) return;
    uint32_t low = count_low(run);
    if (low == 0) return;
    l->quads = run->finished;
    find_components(l);
    qw_raise_jacobians(run->env, &l->quads, &l->shape, l->stays, (float)run->options.jacobian_min);
    if (!is_split) mend_low(l);
    run->output = write_positions(l);
    run->finished = l->quads;
    qw_make_exact(run, false, false);
    l->quads = run->finished;
    uint32_t left = count_low(run);
    if (left < low) run->report->raised_jacobians += low - left;
}

static void report_low(qw_run_state *run)
{
    char text[sizeof run->report->warnings[0]];
    qw_report *r = run->report;
    r->low_jacobians = run->options.jacobian_min > 0 ? count_low(run) : 0;
    if (r->low_jacobians == 0) return;
    snprintf(text, sizeof text, "%lld quad%s a scaled Jacobian below %g, and no move of vertices mends that",
             (long long)r->low_jacobians, r->low_jacobians == 1 ? " has" : "s have", run->options.jacobian_min);
    qw_warn_once(run, text);
}

/* ---- splitting */

/* The quads, their reflections and the vertices that stay, each quad split in four. */
static void split_once(leveling *l)
{
    qw_env *env = l->run->env;
    qw_quadmesh fine = qw_split_quads(env, &l->quads);
    qw_stencils rows = qw_split_stencils(env, &l->quads);
    qw_stencils_place(env, &rows, l->quads.position, fine.position);
    uint32_t *source = l->source ? QW_NEW(env, uint32_t, fine.face_count) : NULL;
    for (uint32_t c = 0; source && c < fine.face_count; c++) {
        bool is_reflection = c >= 4 * l->reflected;
        source[c] = 4 * l->source[c / 4] + (is_reflection ? (4 - (c & 3u)) & 3u : c & 3u);
    }
    l->quads = fine, l->reflected *= 4, l->source = source;
}

/* The last level: vertices leave the surface so that quads lie nearer to it, as those of a mesh that is not split. */
static void fit_quads(leveling *l)
{
    const qw_run_state *run = l->run;
    const qw_fit fit = {.tree = l->shape.tree, .strength = (float)run->options.fit};
    qw_fit_quads(run->env, &l->quads, &fit);
}

/* Flipped quads and inverted corners are repaired by vertices off all curves. Those of a reflection follow later. */
static void repair_flips(leveling *l)
{
    const qw_run_state *run = l->run;
    const qw_quadmesh *q = &l->quads;
    if (!run->options.repair) return;
    uint8_t *stays = QW_NEW_ZERO(run->env, uint8_t, q->vertex_count),
            *flipped = QW_NEW(run->env, uint8_t, q->face_count);
    bool follows = run->mirror.is_used && !qw_sides_differ(run);
    for (uint32_t h = 4 * l->reflected; h < 4 * q->face_count; h++) stays[q->corner[h]] = 2;
    for (uint32_t h = 0; h < 4 * l->reflected; h++)
        if (stays[q->corner[h]] == 2) stays[q->corner[h]] = 1;
    for (uint32_t v = 0; v < q->vertex_count; v++)
        stays[v] = stays[v] == 1 || (follows && stays[v] == 2) || (l->stays && l->stays[v]) || (q->kind && q->kind[v]);
    const qw_flip_repair repair = {.surface = &l->surface, .tree = l->shape.tree, .stays = stays};
    qw_repair_flips(run->env, &l->quads, &repair, flipped);
    qw_free(run->env, stays), qw_free(run->env, flipped);
}

/* Splits the quads as often as asked, each level put onto the shape. */
static void split_all(leveling *l)
{
    assert(l->run->options.subdivide >= 0);
    qw_run_state *run = l->run;
    int64_t times = run->options.subdivide;
    bool is_fitted = run->options.fit_to == QW_FIT_TO_LIMIT; /* the limit is near: only the last level is put there */
    for (int64_t k = 0; k < times; k++) {
        qw_heartbeat(run->env);
        split_once(l);
        if (!is_fitted || k + 1 == times) qw_put_on_shape(run->env, &l->quads, &l->shape, NULL);
    }
    repair_flips(l);
    if (run->options.fit == 0) return;
    fit_quads(l);
    repair_flips(l);
}

void qw_require_levels(const qw_run_state *run)
{
    double times = (double)run->options.subdivide, faces = qw_faces_wanted(run, &run->options);
    if (times == 0) return;
    if (qw_keeps_rims(run))
        qw_fail(run->env, QW_OPTION, -1,
                "quads cannot be split beside a boundary that stays as it is: subdivide goes neither with fix_boundary "
                "nor with a region");
    if (ldexp(faces, 2 * (int)times - 2) >= QW_MOST_TO_SPLIT)
        qw_fail(run->env, QW_TOO_LARGE, -1, "%.0f quads split %.0f times are too many: %.3g; the most is %.3g", faces,
                times, ldexp(faces, 2 * (int)times), 4.0 * QW_MOST_TO_SPLIT);
}

bool qw_fits_limit(const qw_run_state *run) { return run->options.fit_to == QW_FIT_TO_LIMIT && run->options.fit > 0; }

/* What is asked for of the quads as they are, then of those that they are split into. */
static void make_levels(qw_run_state *run, bool splits)
{
    qw_require_levels(run);
    leveling l = {.run = run, .quads = run->finished, .reflected = run->reflected, .source = run->source};
    take_surface(&l);
    find_components(&l);
    l.stays = qw_list_rims(run);
    run->finished = l.quads; /* with its components */
    raise_jacobians(&l, false);
    fit_limit(&l);
    if (qw_fits_limit(run)) {
        run->output = write_positions(&l);
        run->creases = qw_list_creases(run->env, &l.quads, &run->crease_count);
        run->finished = l.quads;
        qw_make_exact(run, true, false);
    }
    if (!splits) return;
    l.quads = run->finished;
    run->coarse = l.quads, run->coarse_output = run->output;
    run->report->coarse_faces = run->coarse.face_count;
    split_all(&l);
    run->output = write_positions(&l);
    run->finished = l.quads, run->reflected = l.reflected, run->source = l.source;
    qw_make_exact(run, false, false);
    raise_jacobians(&l, true);
}

void qw_make_levels(qw_run_state *run)
{
    bool fits = qw_fits_limit(run), splits = run->options.subdivide > 0;
    run->coarse = (qw_quadmesh){.position = QW_NEW(run->env, qw_vec3, 0),
                                .corner = QW_NEW(run->env, uint32_t, 0),
                                .twin = QW_NEW(run->env, uint32_t, 0)};
    run->coarse_output = NULL;
    run->creases = NULL, run->crease_count = 0;
    run->report->coarse_faces = run->report->raised_jacobians = 0;
    if ((fits || splits || run->options.jacobian_min > 0) && run->finished.face_count > 0) make_levels(run, splits);
    report_low(run);
}
