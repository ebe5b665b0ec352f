#include "whole/mirror.h"

#include "base/constants.h"
#include "base/mechanisms.h"
#include "remesh/sizes/needs.h"
#include "remesh/sizes/painted.h"
#include "whole/sizes.h"
#include "geometry/bvh.h"
#include "remesh/clean/marks.h"
#include "remesh/features/feature_points.h"
#include "remesh/features/features.h"
#include "remesh/features/sharpen.h"
#include "remesh/field/hierarchy.h"
#include "whole/across.h"
#include "whole/asked.h"
#include "whole/half.h"
#include "whole/one_sided.h"
#include "whole/own_planes.h"
#include "whole/suits_cut.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* A component is another's twin if QW_MOST_OF_IT, reflected, lies within QW_NEARLY_ALIKE of the surface's diagonal and
   TWIN of its own. */
static const double TWIN = 0.1;

/* In the report: components are, each about a plane of its own. */
enum { SYMMETRIC_PARTS = 2 };

static const char ONE_SIDED[] =
    "a one-sided surface, such as a Moebius strip, cannot be made symmetric: its two sides cannot be told apart";
static const char OTHER_TOPOLOGY[] =
    "the two sides of the plane of symmetry have different holes, handles or parts: the result has those of one side "
    "twice";
static const char NOT_USED[] =
    "the two sides of the plane of symmetry have different holes, handles or parts: it was not used";
static const char NO_ROOM[] =
    "the two sides are not alike enough for one set of quads, or so few have no room for both at the plane of "
    "symmetry: it was not used";

/* ---- planes */

static bool is_found(const qw_run_state *run) { return qw_finds_plane(run->options.symmetry); }

static bool is_one_sided(const qw_run_state *run) { return run->whole.clean.counts.one_sided_seam_edges > 0; }

/* The planes of symmetry to be tried: the one that was given, or those that are found. Returns how many. */
static uint32_t find_planes(const qw_run_state *run, qw_mirror_search found[QW_MOST_PLANES])
{
    const qw_options *o = &run->options;
    if (o->symmetry == QW_SYMMETRY_PLANE) {
        double normal[3] = {o->symmetry_x, o->symmetry_y, o->symmetry_z};
        if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)
            qw_fail(run->env, QW_OPTION, -1, "the plane of symmetry has no normal: symmetry_x, _y and _z are all 0");
        found[0] = (qw_mirror_search){qw_mirror_plane_of(normal, o->symmetry_offset), -1, -1, -1};
        return 1;
    }
    int axis = is_found(run) ? QW_NO_AXIS : (int)o->symmetry - QW_SYMMETRY_X;
    double near = is_found(run) ? QW_NEARLY_ALIKE : 1; /* across an axis the best plane is wanted, however far it is */
    return qw_find_mirror_planes(run->env, &run->whole.clean.mesh, &run->whole.clean.frame, axis, near, found);
}

static void report_plane(qw_report *report, const qw_mirror_search *found, bool is_used)
{
    report->symmetric = is_used;
    report->symmetry_gap = found->gap;
    report->symmetry_far = found->far;
    report->plane_x = is_used ? found->plane.normal[0] : 0, report->plane_y = is_used ? found->plane.normal[1] : 0;
    report->plane_z = is_used ? found->plane.normal[2] : 0, report->plane_offset = is_used ? found->plane.offset : 0;
}

/* ---- components without a twin */

/* The clean surface and its components. */
typedef struct twins {
    const qw_run_state *run;
    const qw_mirror_plane *plane;
    const double *position; /* double[vertices][3], in the coordinates of the input */
    uint32_t components;
    double *low, *high; /* double[components]: least and largest height above the plane */
    double *extent;     /* double[components]: the longest side of the box, in the frame */
    uint32_t *mate;     /* uint32_t[components]: one that lies at the reflection of each that crosses the plane */
    uint32_t *samples, *found;
} twins;

static bool is_off(const twins *t, uint32_t c)
{
    double near = QW_IN_PLANE / t->run->whole.clean.frame.scale;
    return t->low[c] > near || t->high[c] < -near;
}

/* How far each component reaches to both sides of the plane, and how large it is. */
static void measure_components(twins *t)
{
    const qw_trimesh *m = &t->run->whole.clean.mesh;
    qw_env *env = t->run->env;
    double *box = QW_NEW(env, double, 6 * (size_t)t->components);
    for (uint32_t c = 0; c < t->components; c++) {
        t->low[c] = HUGE_VAL, t->high[c] = -HUGE_VAL;
        for (int k = 0; k < 3; k++) box[6 * (size_t)c + k] = HUGE_VAL, box[6 * (size_t)c + 3 + k] = -HUGE_VAL;
    }
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t c = t->run->whole.census.component[h / 3];
        const double *p = t->position + 3 * (size_t)m->corner[h];
        double height = qw_plane_height(t->plane, p), *b = box + 6 * (size_t)c;
        t->low[c] = fmin(t->low[c], height), t->high[c] = fmax(t->high[c], height);
        for (int k = 0; k < 3; k++) b[k] = fmin(b[k], p[k]), b[3 + k] = fmax(b[3 + k], p[k]);
    }
    for (uint32_t c = 0; c < t->components; c++) {
        const double *b = box + 6 * (size_t)c;
        assert(t->low[c] <= t->high[c]);
        t->extent[c] = fmax(b[3] - b[0], fmax(b[4] - b[1], b[5] - b[2])) * t->run->whole.clean.frame.scale;
    }
    qw_free(env, box);
}

/* The faces of the components off the plane, or of those that cross it, with the positions of all vertices in the
   frame. *face: the face of the clean surface that each is. */
static qw_trimesh faces_of(const twins *t, bool off_plane, uint32_t **face)
{
    const qw_trimesh *m = &t->run->whole.clean.mesh;
    qw_env *env = t->run->env;
    qw_trimesh off = {.vertex_count = m->vertex_count};
    qw_vec3 *position = QW_NEW(env, qw_vec3, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++)
        position[v] = qw_in_frame(&t->run->whole.clean.frame, t->position + 3 * (size_t)v);
    off.position = position, off.corner = QW_NEW(env, uint32_t, 3 * (size_t)m->face_count);
    *face = QW_NEW(env, uint32_t, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) {
        if (is_off(t, t->run->whole.census.component[f]) != off_plane) continue;
        (*face)[off.face_count] = f;
        memcpy(off.corner + 3 * (size_t)off.face_count++, m->corner + 3 * (size_t)f, 3 * sizeof *m->corner);
    }
    return off;
}

/* Counts, for each component off the plane, how many of its corners have one of the other side at their reflection;
   for each that crosses it, how many have its mate there. */
static void count_found(twins *t, bool off_plane)
{
    const uint32_t *component = t->run->whole.census.component;
    uint32_t *face;
    qw_trimesh some = faces_of(t, off_plane, &face);
    if (some.face_count == 0) return;
    qw_bvh *tree = qw_bvh_build(t->run->env, &some);
    for (uint32_t h = 0; h < 3 * some.face_count; h++) {
        uint32_t c = component[face[h / 3]];
        double p[3];
        qw_heartbeat(t->run->env);
        qw_reflect(t->plane, t->position + 3 * (size_t)some.corner[h], p);
        float reach = (float)fmin(QW_NEARLY_ALIKE, TWIN * t->extent[c]);
        qw_hit hit = qw_bvh_nearest(tree, qw_in_frame(&t->run->whole.clean.frame, p), qw_v3(0, 0, 0), -1, reach,
                                    QW_NONE);
        t->samples[c]++;
        if (hit.face == QW_NONE) continue;
        uint32_t d = component[face[hit.face]];
        if (!off_plane && d != c && t->mate[c] == QW_NONE) t->mate[c] = d;
        t->found[c] += off_plane ? (t->low[c] > 0) != (t->low[d] > 0) : d == t->mate[c];
        assert(t->found[c] <= t->samples[c]);
    }
}

static bool has_twin(const twins *t, uint32_t c) { return t->found[c] >= QW_MOST_OF_IT * t->samples[c]; }

/* uint8_t[components of the clean surface]: QW_SINGLE where one lies off the plane and has no twin on its other side;
   QW_KEPT_WHOLE and QW_LEFT_OUT: two that cross the plane and one another, each the reflection of the other. NULL: all
   are cut, or all are single, so that nothing would be reflected. */
static uint8_t *find_kinds(const qw_run_state *run, const qw_mirror_plane *plane, const double *position)
{
    qw_env *env = run->env;
    uint32_t n = (uint32_t)run->whole.census.components, count = 0, singles = 0;
    if (n < 2) return NULL;
    uint8_t *kind = QW_NEW_ZERO(env, uint8_t, n);
    qw_scope_begin(env);
    twins t = {.run = run, .plane = plane, .position = position, .components = n};
    t.low = QW_NEW(env, double, n), t.high = QW_NEW(env, double, n), t.extent = QW_NEW(env, double, n);
    t.samples = QW_NEW_ZERO(env, uint32_t, n), t.found = QW_NEW_ZERO(env, uint32_t, n);
    t.mate = QW_NEW(env, uint32_t, n);
    memset(t.mate, 0xff, n * sizeof *t.mate);
    measure_components(&t);
    count_found(&t, true), count_found(&t, false);
    for (uint32_t c = 0; c < n; c++) {
        uint32_t d = t.mate[c];
        assert(d != c); /* none is its own mate */
        if (is_off(&t, c)) kind[c] = has_twin(&t, c) ? QW_IS_CUT : QW_SINGLE;
        else if (d != QW_NONE && t.mate[d] == c && has_twin(&t, c) && has_twin(&t, d))
            kind[c] = c < d ? QW_KEPT_WHOLE : QW_LEFT_OUT;
        count += kind[c] != QW_IS_CUT, singles += kind[c] == QW_SINGLE;
    }
    qw_scope_end(env);
    if (count > 0 && singles < n) return kind;
    qw_free(env, kind);
    return NULL;
}

static void warn_of_single(qw_run_state *run, const uint8_t *kind)
{
    uint32_t count = 0;
    char text[sizeof run->report->warnings[0]];
    for (uint32_t c = 0; kind && c < (uint32_t)run->whole.census.components; c++) count += kind[c] == QW_SINGLE;
    snprintf(text, sizeof text,
             "%u component%s on one side of the plane of symmetry ha%s no twin on the other: kept once, not reflected",
             count, count == 1 ? "" : "s", count == 1 ? "s" : "ve");
    if (count > 0) qw_warn(run, text);
}

/* ---- the cut */

/* One side of the surface, and what belongs to it. */
typedef struct side {
    qw_half half;
    uint8_t *kind; /* uint8_t[components of the clean surface]: as of find_kinds, or NULL */
    uint8_t *vertex_kind;
    qw_mirror_planes planes;
} side;

/* uint8_t[vertices]: the value of each vertex' component; NULL where there are none. */
static uint8_t *by_vertex(const qw_run_state *run, const uint8_t *of_component)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    if (!of_component) return NULL;
    uint8_t *of = QW_NEW_ZERO(run->env, uint8_t, m->vertex_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        of[m->corner[h]] = of_component[run->whole.census.component[h / 3]];
    return of;
}

/* Cuts the clean surface at the plane, with marks; components without a twin on the other side stay whole, and so
   does one of two that cross one another there. Where planes are of single components these are cut, each at its own.
   m: the planes; other: as of qw_cut_half. */
static side cut_surface(const qw_run_state *run, const qw_mirror *m, bool other)
{
    qw_env *env = run->env;
    qw_trimesh surface = run->whole.clean.mesh;
    side s = {.vertex_kind = NULL};
    if (run->whole.input->mark_count > 0) qw_take_marks(env, run->whole.input, &run->whole.clean.frame, &surface);
    double *position = QW_NEW(env, double, 3 * (size_t)surface.vertex_count);
    for (uint32_t v = 0; v < surface.vertex_count; v++)
        qw_place_in_input(&run->whole.clean, surface.position[v], position + 3 * (size_t)v);
    s.kind = m->own ? QW_NEW(env, uint8_t, (size_t)run->whole.census.components) : find_kinds(run, m->plane, position);
    for (int64_t c = 0; m->own && c < run->whole.census.components; c++) s.kind[c] = m->own[c] ? QW_IS_CUT : QW_SINGLE;
    s.vertex_kind = by_vertex(run, s.kind);
    uint8_t *own = by_vertex(run, m->own);
    for (uint32_t v = 0; own && v < surface.vertex_count; v++) own[v] -= own[v] > 0;
    s.planes = (qw_mirror_planes){m->planes, m->plane, own};
    s.half = qw_cut_half(env, &surface, position, &s.planes, s.vertex_kind, other);
    qw_free(env, position);
    if (surface.mark != run->whole.clean.mesh.mark) qw_free(env, surface.mark);
    return s;
}

/* The painted density at the vertices of one side; NULL: none was painted. */
static qw_density *density_of(const qw_run_state *run, const qw_half *half)
{
    if (!run->whole.input->density) return NULL;
    qw_density *painted = qw_painted_at_clean(run->env, &run->input, &run->clean),
               *density = QW_NEW(run->env, qw_density, half->vertex_count);
    for (uint32_t v = 0; v < half->vertex_count; v++) {
        const qw_half_vertex *o = &half->origin[v];
        density[v] = (qw_density)((1 - o->share) * (double)painted[o->from] + o->share * (double)painted[o->to]);
    }
    qw_free(run->env, painted);
    return density;
}

/* One side of the plane as an input of its own, with the cuts of what it was cut from. */
static qw_clean_input input_of(const qw_run_state *run, const qw_half *half, const qw_mirror_plane *plane,
                               uint32_t planes)
{
    uint32_t *begin = QW_NEW(run->env, uint32_t, (size_t)half->face_count + 1), cuts = run->input.cuts;
    double *cut = QW_NEW(run->env, double, 4 * ((size_t)cuts + planes));
    for (uint32_t f = 0; f <= half->face_count; f++) begin[f] = 3 * f;
    if (cuts > 0) memcpy(cut, run->input.cut, 4 * (size_t)cuts * sizeof *cut);
    for (uint32_t p = 0; p < planes; p++) {
        memcpy(cut + 4 * ((size_t)cuts + p), plane[p].normal, 3 * sizeof *cut);
        cut[4 * ((size_t)cuts + p) + 3] = plane[p].offset;
    }
    return (qw_clean_input){.vertex_count = half->vertex_count,
                            .face_count = half->face_count,
                            .position = half->position,
                            .face_begin = begin,
                            .corner = half->corner,
                            .mark_count = half->mark_count,
                            .mark = half->mark,
                            .density = density_of(run, half),
                            .cut = cut,
                            .cuts = cuts + planes};
}

/* ---- guides */

/* The guides on the core's side. Those that lie on the other side altogether are reflected, unless what was drawn on
   the core's side is the same; of those that cross the plane, what lies on the core's side remains, as one guide for
   each stretch. */
typedef struct folding {
    const qw_steering *from;
    qw_steering *to;
    const qw_mirror_plane *plane;
    double side; /* 1 or -1: the sign of the heights on the core's side */
    const qw_frame *frame;
    const qw_curve_tree *drawn; /* in the frame: what was drawn on the core's side; NULL: not yet known, or nothing */
    uint32_t begin, end;        /* the points of `to` that belong to the stretch that was begun */
} folding;

static void put_point(folding *f, const double p[3])
{
    memcpy(f->to->guide_point + 3 * (size_t)f->end++, p, 3 * sizeof *p);
}

/* Ends the stretch, which is dropped if it is but a point. */
static void end_stretch(folding *f, uint32_t guide)
{
    qw_steering *to = f->to;
    if (f->end - f->begin < 2) {
        f->end = f->begin;
        return;
    }
    to->guide_rings[to->guide_count] = f->from->guide_rings[guide];
    to->guide_kind[to->guide_count++] = f->from->guide_kind[guide];
    to->guide_begin[to->guide_count] = f->begin = f->end;
}

/* Puts the point where the step from p to q, with heights a and b, crosses the plane. */
static void put_crossing(folding *f, const double *p, double a, const double *q, double b)
{
    double t = a / (a - b), x[3];
    for (int k = 0; k < 3; k++) x[k] = p[k] + t * (q[k] - p[k]);
    qw_put_on_plane(f->plane, x);
    put_point(f, x);
}

/* 0 for points in the plane, from which no step crosses it. */
static double height_of(const folding *f, uint32_t point)
{
    double height = f->side * qw_plane_height(f->plane, f->from->guide_point + 3 * (size_t)point);
    return fabs(height) * f->frame->scale > QW_IN_PLANE ? height : 0;
}

/* Adds the reflection of a guide, unless the other side has it already. */
static void reflect_guide(folding *f, uint32_t guide)
{
    bool is_drawn = f->drawn != NULL;
    float near = qw_drawn_alike(f->from, guide, f->frame->scale);
    for (uint32_t i = f->from->guide_begin[guide]; i < f->from->guide_begin[guide + 1]; i++) {
        double reflected[3];
        qw_reflect(f->plane, f->from->guide_point + 3 * (size_t)i, reflected);
        is_drawn = is_drawn && qw_curve_nearest(f->drawn, qw_in_frame(f->frame, reflected), near).segment != QW_NONE;
        put_point(f, reflected);
    }
    if (is_drawn) f->end = f->begin;
    end_stretch(f, guide);
}

static bool is_beyond(const folding *f, uint32_t guide)
{
    for (uint32_t i = f->from->guide_begin[guide]; i < f->from->guide_begin[guide + 1]; i++)
        if (height_of(f, i) > 0) return false;
    return true;
}

/* Cuts a guide at the plane and keeps the stretches above it. A closed one is walked from a point below it, so that no
   stretch is cut in two. */
static void fold_guide(folding *f, uint32_t guide)
{
    assert(guide < f->from->guide_count);
    uint32_t begin = f->from->guide_begin[guide], steps = f->from->guide_begin[guide + 1] - begin - 1, first = 0;
    const double *point = f->from->guide_point + 3 * (size_t)begin;
    if (memcmp(point, point + 3 * (size_t)steps, 3 * sizeof *point) == 0)
        while (first < steps && height_of(f, begin + first) >= 0) first++;
    first = first < steps ? first : 0;
    for (uint32_t i = 0; i <= steps; i++) {
        uint32_t at = i + first < steps || first == 0 ? i + first : i + first - steps, next = at < steps ? at + 1 : 1;
        const double *p = point + 3 * (size_t)at, *q = point + 3 * (size_t)next;
        double a = height_of(f, begin + at), b = i < steps ? height_of(f, begin + next) : a;
        if (a >= 0) put_point(f, p);
        if ((a > 0 && b < 0) || (a < 0 && b > 0)) put_crossing(f, p, a, q, b);
        if (b < 0) end_stretch(f, guide);
    }
    end_stretch(f, guide);
}

/* The steps of all stretches so far that were drawn, not those of joints. */
static const qw_curve_tree *drawn_so_far(const qw_run_state *run, const folding *f)
{
    const qw_steering *to = f->to;
    uint32_t count = 0;
    qw_vec3 *from = QW_NEW(run->env, qw_vec3, f->end), *end = QW_NEW(run->env, qw_vec3, f->end);
    for (uint32_t g = 0; g < to->guide_count; g++)
        for (uint32_t i = to->guide_begin[g]; to->guide_kind[g] != QW_GUIDE_JOINT && i + 1 < to->guide_begin[g + 1];
             i++) {
            from[count] = qw_in_frame(f->frame, to->guide_point + 3 * (size_t)i);
            end[count++] = qw_in_frame(f->frame, to->guide_point + 3 * (size_t)i + 3);
        }
    return count > 0 ? qw_curve_tree_build(run->env, from, end, count) : NULL;
}

/* There are no more stretches than points, and no more crossings. */
static qw_steering steering_of(const qw_run_state *run, const qw_mirror_plane *plane, double sign)
{
    const qw_steering *from = &run->steering; /* still of the whole */
    qw_steering to = *from;
    if (from->guide_count == 0) return to;
    size_t points = from->guide_begin[from->guide_count];
    to.guide_count = 0;
    to.guide_begin = QW_NEW_ZERO(run->env, uint32_t, points + 1);
    to.guide_kind = QW_NEW_ZERO(run->env, uint8_t, points);
    to.guide_rings = QW_NEW_ZERO(run->env, uint32_t, points);
    to.guide_point = QW_NEW(run->env, double, 6 * points);
    folding f = {from, &to, plane, sign, &run->whole.clean.frame, NULL, 0, 0};
    for (uint32_t g = 0; g < from->guide_count; g++)
        if (!is_beyond(&f, g)) fold_guide(&f, g);
    f.drawn = drawn_so_far(run, &f);
    for (uint32_t g = 0; g < from->guide_count; g++)
        if (is_beyond(&f, g)) reflect_guide(&f, g);
    assert(to.guide_count <= points && to.guide_begin[to.guide_count] <= 2 * points);
    return to;
}

/* ---- the core */

static double area_of_single(const qw_run_state *run)
{
    const qw_trimesh *m = &run->clean.mesh;
    double area = 0;
    for (uint32_t f = 0; run->mirror.about && f < m->face_count; f++)
        if (run->mirror.about[run->clean_census.component[f]] == 0)
            area += 0.5 * (double)qw_length(qw_face_cross(m, f));
    return area;
}

/* The planes about which each of the core's components is reflected: as of qw_mirror. */
static uint8_t *planes_of_core(const qw_run_state *run, const side *s)
{
    if (!s->kind) return NULL;
    uint8_t *planes = QW_NEW_ZERO(run->env, uint8_t, (size_t)run->clean_census.components);
    for (uint32_t f = 0; f < run->clean.mesh.face_count; f++) {
        uint32_t c = run->whole.census.component[s->half.source[run->clean.source_face[f]]];
        uint32_t plane = run->mirror.own && run->mirror.own[c] ? run->mirror.own[c] - 1u : 0;
        planes[run->clean_census.component[f]] = s->kind[c] == QW_SINGLE ? 0 : (uint8_t)(1u << plane);
    }
    return planes;
}

/* The half becomes the core, which is cleaned like an input of its own. */
static void take_half(qw_run_state *run, const qw_half *half, const qw_mirror_plane *plane, uint32_t planes)
{
    qw_env *env = run->env;
    run->input = input_of(run, half, plane, planes);
    run->clean = qw_clean_surface(env, &run->input, 0, false);
    run->clean_census = qw_trimesh_census_of(env, &run->clean.mesh, run->clean.component, run->clean.components);
    run->area = qw_trimesh_area(&run->clean.mesh);
    run->extent = qw_total_extent(env, &run->clean.mesh, &run->clean_census);
    run->faces_needed = qw_faces_needed(env, &run->clean.mesh, &run->clean_census);
}

/* Of the components that are reflected, the distance that 99.9 % of them stay below when they are. */
static double far_of_reflected(const qw_run_state *run, const qw_mirror_plane *plane, const uint8_t *kind)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    qw_scope_begin(run->env);
    qw_trimesh rest = {.vertex_count = m->vertex_count, .position = m->position};
    rest.corner = QW_NEW(run->env, uint32_t, 3 * (size_t)m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++)
        if (kind[run->whole.census.component[f]] != QW_SINGLE)
            memcpy(rest.corner + 3 * (size_t)rest.face_count++, m->corner + 3 * (size_t)f, 3 * sizeof *m->corner);
    double far = qw_judge_mirror_plane(run->env, &rest, &run->whole.clean.frame, plane).far;
    qw_scope_end(run->env);
    return far;
}

/* Makes one side the core, and says what it is to be with its reflection. m: what is known of the planes. */
static void take_core(qw_run_state *run, const side *s, const qw_mirror *m)
{
    const qw_half *half = &s->half;
    take_half(run, half, m->plane, m->planes);
    run->mirror = *m;
    run->mirror.components = half->whole.components, run->mirror.boundary_loops = half->whole.boundary_loops;
    run->mirror.euler = half->whole.euler;
    run->mirror.about = planes_of_core(run, s);
    run->mirror.times = 2 - area_of_single(run) / run->area;
}

/* Makes one side of the plane the core: surface, counts, steering, and what both sides together are to be. */
static void take_side(qw_run_state *run, const side *s, const qw_mirror_search *found)
{
    const qw_half *half = &s->half;
    const qw_mirror_plane *plane = &found->plane;
    qw_mirror m = {.is_used = 1, .planes = 1, .plane = {*plane}, .far = found->far};
    if (s->kind) m.far = far_of_reflected(run, plane, s->kind);
    take_core(run, s, &m);
    double sign = 1;
    for (uint32_t v = 0; v < half->vertex_count; v++)
        if (!half->on_plane[v] && !(s->vertex_kind && s->vertex_kind[half->origin[v].from]))
            sign = qw_plane_height(plane, half->position + 3 * (size_t)v) > 0 ? 1 : -1;
    run->steering = steering_of(run, plane, sign);
    report_plane(run->report, found, true);
    warn_of_single(run, s->kind);
}

bool qw_take_other_side(qw_run_state *run)
{
    const qw_mirror *m = &run->mirror;
    qw_census was = run->clean_census;
    run->input = *run->whole.input, run->clean = run->whole.clean;
    side s = cut_surface(run, m, true);
    qw_half half = s.half;
    if (half.face_count == 0) return false;
    for (uint32_t v = 0; v < half.vertex_count; v++) {
        double *p = half.position + 3 * (size_t)v, q[3];
        qw_reflect(qw_plane_of(&s.planes, half.origin[v].from), p, q);
        if (!half.on_plane[v]) memcpy(p, q, sizeof q);
    }
    for (uint32_t f = 0; f < half.face_count; f++) {
        uint32_t *c = half.corner + 3 * (size_t)f, second = c[1];
        c[1] = c[2], c[2] = second;
    }
    take_half(run, &half, m->plane, m->planes);
    run->mirror.about = planes_of_core(run, &s);
    const qw_census *is = &run->clean_census;
    if (run->mirror.about) return true; /* the core has more components, of any topology */
    return is->components == was.components && is->boundary_loops == was.boundary_loops && is->euler == was.euler;
}

/* Whether something but the surface itself says what its quads are to be like. */
static bool is_steered(const qw_run_state *run)
{
    const qw_steering *s = run->whole.steering;
    const qw_options *o = &run->options;
    return s->region || s->field || s->guide_count > 0 || s->joint_count > 0 || run->whole.motion ||
           run->whole.input->density || o->symmetry_follow || o->sharp_marks || o->keep_marks || o->fix_boundary;
}

/* Whether nothing steers its quads, it is one component, and its topology
   asks for many irregular vertices (more than a ball and a torus do). Without these its quads are regular as they are,
   and counts that a quarter of them may have lie farther apart. Sharp edges lose corners in so small a part. */
static bool may_be_cut_again(const qw_run_state *run)
{
    return !is_steered(run) && run->whole.census.components == 1 && run->clean.own.count == 0 &&
           run->whole.census.euler < 0 && !qw_is_sharp(run);
}

/* Makes one side of a plane across those along which it was cut the core; not where that has no like sides. */
static void cut_again(qw_run_state *run, const qw_mirror_plane *plane)
{
    const qw_trimesh *m = &run->clean.mesh;
    double *position = QW_NEW(run->env, double, 3 * (size_t)m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++)
        qw_place_in_input(&run->clean, m->position[v], position + 3 * (size_t)v);
    qw_half half = qw_cut_half(run->env, m, position, &(qw_mirror_planes){1, plane, NULL}, NULL, false);
    if (half.face_count == 0 || !qw_is_like_half(run->env, &half, m, &run->clean_census)) return;
    take_half(run, &half, plane, 1);
    run->mirror.plane[run->mirror.planes++] = *plane;
    run->mirror.times *= 2;
}

/* Whether the plane was used. `auto` uses no plane whose sides have another topology. */
static bool use_plane(qw_run_state *run, const qw_mirror_search *found)
{
    side s = cut_surface(run, &(qw_mirror){.planes = 1, .plane = {found->plane}}, false);
    if (is_one_sided(run)) qw_fail(run->env, QW_UNSUPPORTED, -1, "%s", ONE_SIDED);
    if (s.half.face_count == 0 && is_found(run)) return false;
    if (s.half.face_count == 0) qw_fail(run->env, QW_OPTION, -1, "the whole surface lies in the plane of symmetry");
    bool is_other = !qw_is_like_half(run->env, &s.half, &run->whole.clean.mesh, &run->whole.census);
    if (is_other && is_found(run)) return false;
    if (is_other) qw_warn(run, OTHER_TOPOLOGY);
    take_side(run, &s, found);
    return true;
}

/* A surface that is not symmetric is no fault: where the plane was only looked for, the log says why none is used. */
static void log_not_used(const qw_run_state *run, const char *why) { qw_log(run->env, QW_LOG_DEBUG, "%s", why); }

/* Whether the quads are steered alike on both sides of the plane; else a warning says what is not. */
static bool is_steered_alike(qw_run_state *run, const qw_mirror_plane *plane)
{
    char text[sizeof run->report->warnings[0]];
    const char *what = qw_one_sided_steering(run, plane);
    if (!what) return true;
    snprintf(text, sizeof text, "the surface is symmetric and %s are not: both sides are remeshed by themselves", what);
    qw_warn(run, text);
    return false;
}

/* Boundaries that are to be met vertex by vertex are met on the whole, and circles have an even number of edges there
   more often. */
static bool wants_whole(const qw_run_state *run)
{
    return run->whole.steering->region || run->options.around > 0 ||
           (run->options.fix_boundary && run->whole.census.boundary_loops > 0);
}

/* Uses the first plane from run->plan.plane on that may be used. Where others are across the first, all of them come
   before each by itself. Whether there was one, or what steers the quads is on one side only. */
static bool use_found(qw_run_state *run, const qw_mirror_search *found, uint32_t count, double edge)
{
    bool is_auto = run->options.symmetry == QW_SYMMETRY_AUTO;
    qw_mirror_plane across[QW_MOST_PLANES - 1];
    uint32_t crossing = may_be_cut_again(run) ? qw_find_across(run, found, count, edge, across) : 0;
    uint32_t together = crossing > 0;
    if (count + together > QW_MOST_PLANES) count--;
    assert(crossing < QW_MOST_PLANES && count + together <= QW_MOST_PLANES);
    for (uint32_t i = run->plan.plane; i < count + together; i++) {
        uint32_t plane = i > together ? i - together : 0;
        if (found[plane].most > QW_NEARLY_ALIKE) return false;
        if (is_auto && !is_steered_alike(run, &found[plane].plane)) return true;
        if (!use_plane(run, &found[plane])) continue;
        for (uint32_t k = 0; k < crossing && i == 0 && may_be_cut_again(run); k++) cut_again(run, &across[k]);
        return true;
    }
    return false;
}

/* Where the surface has no plane of symmetry: cuts the components that have one of their own. Whether there were any.
 */
static bool use_own(qw_run_state *run, double edge)
{
    if (run->plan.plane > 1 || wants_whole(run) || is_steered(run) || run->whole.clean.own.count > 0 ||
        !qw_uses(run->env, QW_MECH_OWN_PLANES))
        return false;
    qw_mirror m = qw_find_own_planes(run, edge);
    if (!m.is_used) return false;
    side s = cut_surface(run, &m, false);
    if (!qw_is_like_half(run->env, &s.half, &run->whole.clean.mesh, &run->whole.census)) return false;
    take_core(run, &s, &m);
    run->report->symmetric = SYMMETRIC_PARTS;
    qw_did(run->env, QW_MECH_OWN_PLANES, m.planes);
    return true;
}

/* Makes one side of a plane of symmetry the core, if there is a plane and the quads are better for it; else logs why
   not. */
static void take_one_side_if_alike(qw_run_state *run)
{
    qw_mirror_search found[QW_MOST_PLANES];
    if (is_one_sided(run)) {
        log_not_used(run, ONE_SIDED);
        return;
    }
    uint32_t count = find_planes(run, found);
    double edge = sqrt(run->whole.area / qw_faces_wanted(run, &run->options));
    report_plane(run->report, &found[0], false);
    if (found[0].most > QW_NEARLY_ALIKE) {
        if (!use_own(run, edge)) log_not_used(run, "no plane of symmetry was found");
        return;
    }
    bool is_auto = run->options.symmetry == QW_SYMMETRY_AUTO;
    qw_cut_surface whole = qw_cut_whole(run);
    if (is_auto && (wants_whole(run) ||
                    !qw_suits_cut(run, &whole, &found[0].plane,
                                  qw_is_turned(run->env, whole.mesh, &run->whole.clean.frame, found, count)))) {
        log_not_used(run, "tips, narrow parts, creases that were sampled, circles and boundaries that stay are better "
                          "off without the plane "
                          "of symmetry");
        return;
    }
    if (use_found(run, found, count, edge)) return;
    log_not_used(run, run->plan.plane > 0 ? NO_ROOM : NOT_USED);
}

void qw_take_one_side(qw_run_state *run)
{
    if (is_found(run)) {
        take_one_side_if_alike(run);
        return;
    }
    qw_mirror_search found[QW_MOST_PLANES];
    find_planes(run, found);
    use_plane(run, &found[0]);
}
