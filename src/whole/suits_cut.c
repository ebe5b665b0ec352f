#include "whole/suits_cut.h"

#include "base/constants.h"
#include "remesh/features/feature_points.h"
#include "remesh/features/features.h"
#include "remesh/features/sharpen.h"
#include "remesh/sizes/needs.h"
#include "whole/asked.h"

#include <math.h>

/* Sharp edges, in square roots of the area, of a surface that counts as smooth. */
static const double SHARP = 0.1;
/* The edges of so many quads tell sharp edges from noise, whatever count is asked for. */
static const double QUADS = 1000;
/* A tip, or a corner of a boundary, lies on the plane if it is no farther from it, in edges of those quads. */
static const double ON_PLANE = 0.25;

/* A sharp edge runs along the plane where its ends' heights differ by less than this share of it, and half of what is
   narrow has no room for quads where it is no farther than this share of an edge from the plane. */
static const double ALONG = 0.2, NARROW = 0.6;
/* So many quads' edges of them are too many; a solid with fewer corners than these is a plain one. */
static const double MUCH_NARROW = 4;
enum { FEW_CORNERS = 16 };

/* In radians: a boundary that turns by more than a right angle on the plane leaves less than half of one on either
   side, which is no corner of a quad. */
static const double ACUTE = 0.55 * QW_PI;

/* Of corners that the surface has for quads of that edge, tips and acute ones of a boundary among them, how many there
   are, how many lie on the plane, and how many components have any. */
typedef struct corners {
    uint32_t all, on, components;
} corners;

/* How many corners of curves there are, how many of them lie on the plane, and how many components have any. */
static corners count_corners(const qw_run_state *run, const qw_census *census, const qw_trimesh *m, float edge,
                             const qw_mirror_plane *plane)
{
    corners count = {0};
    float *span = QW_NEW(run->env, float, m->vertex_count);
    uint8_t *kind, *has_any = QW_NEW_ZERO(run->env, uint8_t, (size_t)census->components);
    qw_vec3 *direction;
    for (uint32_t v = 0; v < m->vertex_count; v++) span[v] = edge;
    qw_find_constraints(run->env, m, true, ACUTE, span, NULL, &kind, &direction);
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (kind[m->corner[h]] == QW_VERTEX_CORNER) has_any[census->component[h / 3]] = 1;
    for (int64_t c = 0; c < census->components; c++) count.components += has_any[c];
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        double p[3];
        if (kind[v] != QW_VERTEX_CORNER) continue;
        qw_place_in_input(&run->whole.clean, m->position[v], p);
        count.all++,
            count.on += fabs(qw_plane_height(plane, p)) * run->whole.clean.frame.scale < ON_PLANE * (double)edge;
    }
    return count;
}

/* Whether the surface is a solid of few corners and without handles, but with a corner on each component, or turned:
   its rows run from corner to corner, or around and along, and close, and counts that half of its quads may have lie
   farther apart. */
static bool is_plain(const qw_run_state *run, const qw_census *census, const qw_trimesh *marked, float edge,
                     const qw_mirror_plane *plane, bool is_turned)
{
    corners count = count_corners(run, census, marked, edge, plane);
    int64_t components = census->components;
    return count.all < FEW_CORNERS && (count.components == components || is_turned) && census->euler == 2 * components;
}

/* How long sharp edges are, in quads' edges, that run along the plane so near to it that what is between has but half
   of the room that quads need. edge: that of a quad. */
static double length_of_narrow(const qw_run_state *run, const qw_trimesh *m, double edge, const qw_mirror_plane *plane)
{
    double sum = 0;
    for (uint32_t h = 0; m->mark && h < 3 * m->face_count; h++) {
        double up[2], length = (double)qw_edge_length(m, h);
        if (!m->mark[h] || !qw_stands_for_edge(m, h)) continue;
        for (int i = 0; i < 2; i++) {
            double p[3];
            qw_place_in_input(&run->whole.clean, m->position[m->corner[i ? qw_next(h) : h]], p);
            up[i] = qw_plane_height(plane, p) * run->whole.clean.frame.scale;
        }
        bool is_along = up[0] * up[1] > 0 && fabs(up[0] - up[1]) < ALONG * length;
        double far = fmax(fabs(up[0]), fabs(up[1]));
        if (is_along && far > QW_IN_PLANE && far < NARROW * edge) sum += length;
    }
    return sum / edge;
}

/* The surface with its sharp edges marked. In the current scope. */
static qw_trimesh mark_sharp(const qw_run_state *run, const qw_cut_surface *of)
{
    double used, angle = run->options.sharp_angle;
    float edge = (float)sqrt(of->area / QUADS);
    qw_trimesh surface = *of->mesh;
    surface.mark = NULL, surface.point = NULL;
    qw_find_features(run->env, &surface, angle < 0 ? -1.0 : angle * QW_PI / 180.0, edge, &used);
    return surface;
}

static bool has_sharp(const qw_cut_surface *of, const qw_trimesh *marked)
{
    return qw_marked_length(marked) > SHARP * sqrt(of->area);
}

bool qw_is_sharp(const qw_run_state *run)
{
    qw_scope_begin(run->env);
    qw_cut_surface whole = qw_cut_whole(run);
    qw_trimesh surface = mark_sharp(run, &whole);
    bool is = has_sharp(&whole, &surface);
    qw_scope_end(run->env);
    return is;
}

bool qw_suits_cut(const qw_run_state *run, const qw_cut_surface *of, const qw_mirror_plane *plane, bool is_turned)
{
    qw_env *env = run->env;
    float edge = (float)sqrt(of->area / QUADS);
    if (run->whole.input->mark_count > 0 && (run->options.keep_marks || run->options.sharp_marks)) return false;
    qw_scope_begin(env);
    qw_trimesh surface = mark_sharp(run, of);
    bool is_sharp = has_sharp(of, &surface);
    double quad = sqrt(run->whole.area / qw_faces_wanted(run, &run->options));
    bool is_easy = length_of_narrow(run, &surface, quad, plane) < MUCH_NARROW;
    if (is_sharp && is_easy)
        is_easy = run->whole.clean.wrapped == 0 && !is_plain(run, of->census, &surface, edge, plane, is_turned);
    if (is_easy && run->options.sharp_angle < 0) {
        qw_find_points(env, &surface, edge);
        surface.mark = NULL; /* where sharp edges meet on the plane nothing is lost */
        is_easy = count_corners(run, of->census, &surface, edge, plane).on == 0 &&
                  (is_sharp || !qw_sharpen(env, &surface, of->census, edge));
    }
    qw_scope_end(env);
    return is_easy;
}
