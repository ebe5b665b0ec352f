#include "whole/wrapped.h"

#include "whole/asked.h"
#include "geometry/triangulate.h"
#include "products/wrap/fill.h"
#include "products/wrap/wrap.h"

#include <assert.h>
#include <stdio.h>

/* An input of so many components, of which others hide this share of the area or with fewer quads each, is taken for a
 * soup: a wrap is advised. */
static const int64_t SOUP = 8;
static const double HIDDEN = 0.2, FEW = 4;

bool qw_wraps_by_count(const qw_options *options) { return options->wrap && !(options->wrap_distance > 0); }

static bool may_be_soup(const qw_run_state *run) { return !run->options.wrap && run->whole.census.components >= SOUP; }

void qw_look_for_soup(qw_run_state *run)
{
    run->whole.hidden = 0;
    if (may_be_soup(run)) run->whole.hidden = qw_wrap_hidden(run->env, run->whole.input);
}

void qw_advise_wrap(qw_run_state *run)
{
    char text[sizeof run->report->warnings[0]];
    int64_t parts = run->whole.census.components;
    double quads = qw_faces_wanted(run, &run->options);
    if (!may_be_soup(run)) return;
    if (run->whole.hidden >= HIDDEN)
        snprintf(text, sizeof text,
                 "%lld parts, and %.0f %% of their area lies within others or close together: with wrap they become "
                 "one surface",
                 (long long)parts, 100 * run->whole.hidden);
    else if (quads < FEW * (double)parts)
        snprintf(text, sizeof text,
                 "%lld parts have fewer than %d quads each: with wrap what lies together becomes one surface",
                 (long long)parts, (int)FEW);
    else return;
    qw_warn_once(run, text);
}

/* The cause is said where it is not the distance that was asked for. */
static void refuse_count(const qw_run_state *run, double distance)
{
    const qw_clean_input *input = run->whole.input;
    double load = qw_wrap_load(input, distance), least = distance / qw_wrap_diagonal(input);
    if (!(load > 1)) return;
    while (qw_wrap_load(input, least * qw_wrap_diagonal(input)) > 1) least *= 1.05;
    qw_fail(run->env, QW_TOO_LARGE, -1,
            "so many quads are too small for a wrap by their size: gaps of %g of their edge would take %.3g cells, and "
            "the most is %d; fewer quads, or wrap=%.2g, would do",
            run->options.wrap_quads, load * QW_MOST_CELLS, QW_MOST_CELLS, 1.05 * least);
}

static double distance_by_count(const qw_run_state *run)
{
    const qw_options *o = &run->options;
    double quads = qw_faces_wanted(run, o);
    double distance = o->edge_length > 0 ? o->wrap_quads * o->edge_length
                                         : qw_wrap_distance_for(run->env, run->whole.input, quads, o->wrap_quads);
    refuse_count(run, distance);
    return distance;
}

static double distance_of(const qw_run_state *run)
{
    const qw_options *o = &run->options;
    if (o->wrap_distance > 0) return o->wrap_distance * qw_wrap_diagonal(run->whole.input);
    return distance_by_count(run);
}

void qw_close_holes(qw_run_state *run)
{
    qw_env *env = run->env;
    qw_clean *clean = &run->whole.clean;
    if (run->whole.steering->region || run->options.fix_boundary)
        qw_fail(env, QW_OPTION, -1, "option fill_holes closes boundaries, which %s is to keep",
                run->whole.steering->region ? "a region" : "fix_boundary");
    qw_scope_begin(env);
    qw_fill_counts counts = qw_fill_holes(env, clean, run->options.fill_holes);
    run->report->filled_holes = counts.holes, run->report->filled_triangles = counts.triangles;
    if (counts.holes > 0) {
        qw_keep(env, clean->mesh.position), qw_keep(env, clean->mesh.corner), qw_keep(env, clean->mesh.twin);
        qw_keep(env, clean->source_face), qw_keep(env, clean->component);
    }
    qw_scope_end(env);
    run->whole.census = qw_trimesh_census_of(env, &clean->mesh, clean->component, clean->components);
}

/* Triangle t of the polygons, as it is and turned over. */
static void take_both_ways(const qw_triangles *t, uint32_t i, qw_trimesh *mesh)
{
    const uint32_t *from = t->corner + 3 * (size_t)i;
    uint32_t *to = mesh->corner + 3 * (size_t)mesh->face_count;
    to[0] = to[3] = from[0], to[1] = to[5] = from[1], to[2] = to[4] = from[2];
    mesh->face_count += 2;
}

qw_bvh *qw_seen_of_input(qw_run_state *run, qw_trimesh *mesh)
{
    const qw_clean_input *input = run->whole.input;
    const uint8_t *seen = run->whole.clean.seen;
    const qw_frame *frame = &run->clean.frame;
    if (!seen) return NULL;
    qw_triangles t = qw_triangulate(run->env, input);
    uint32_t count = 0;
    for (uint32_t i = 0; i < t.count; i++) count += seen[t.source[i]];
    if (count >= QW_NONE / 6) return NULL;
    *mesh = (qw_trimesh){.vertex_count = input->vertex_count};
    mesh->position = QW_NEW(run->env, qw_vec3, input->vertex_count);
    mesh->corner = QW_NEW(run->env, uint32_t, 6 * (size_t)count);
    for (uint32_t v = 0; v < input->vertex_count; v++) {
        float p[3];
        for (int k = 0; k < 3; k++)
            p[k] = (float)((input->position[3 * (size_t)v + (size_t)k] - frame->center[k]) * frame->scale);
        mesh->position[v] = qw_v3(p[0], p[1], p[2]);
    }
    for (uint32_t i = 0; i < t.count; i++)
        if (seen[t.source[i]]) take_both_ways(&t, i, mesh);
    assert(mesh->face_count == 2 * count);
    return qw_bvh_build(run->env, mesh);
}

static void report(qw_run_state *run, const qw_wrapped *w)
{
    double diagonal = qw_wrap_diagonal(run->whole.input);
    qw_report *r = run->report;
    r->wrap_distance = w->distance;
    r->wrap_off = w->stats.seen_off * w->unit / diagonal, r->wrap_farthest = w->stats.skin_off * w->unit / diagonal;
    r->wrap_bridges = w->stats.bridges, r->wrap_shells = w->stats.shells, r->wrap_crumbs = w->fragments;
    r->wrap_hidden = w->stats.hidden_area;
}

void qw_wrap_whole(qw_run_state *run)
{
    const qw_clean_input *input = run->whole.input;
    qw_clean *clean = &run->whole.clean;
    int64_t triangles = 0;
    if (run->whole.steering->region || run->options.fix_boundary)
        qw_fail(run->env, QW_OPTION, -1, "option wrap makes a surface without a boundary: it cannot be with %s",
                run->whole.steering->region ? "a region" : "fix_boundary");
    run->whole.left_out = NULL;
    for (uint32_t f = 0; f < input->face_count; f++) {
        uint32_t corners = input->face_begin[f + 1] - input->face_begin[f];
        if (corners > 2) triangles += corners - 2;
    }
    clean->counts.triangles = triangles; /* which the count of quads may go by */
    qw_wrapped w = qw_wrap(run->env, input, distance_of(run));
    report(run, &w);
    *clean = qw_clean_surface(run->env, &w.skin, 0, false);
    clean->counts.triangles = triangles;
    clean->wrapped = (float)(w.distance / 2 * clean->frame.scale), clean->seen = w.seen;
    assert(w.skin.face_count > 0);
    for (uint32_t f = 0; f < clean->mesh.face_count; f++) clean->source_face[f] = w.source[clean->source_face[f]];
    run->whole.census = qw_trimesh_census_of(run->env, &clean->mesh, clean->component, clean->components);
}
