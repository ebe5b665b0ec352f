#include "whole/one_sided.h"

#include "geometry/bvh.h"
#include "products/attributes/motion.h"
#include "remesh/sizes/painted.h"
#include "whole/motion_on.h"

#include <assert.h>
#include <math.h>

/* Densities are alike within this share of their mean. */
static const double DENSITY_ALIKE = 0.05;
/* Directions of movement are alike where they differ by this share of their lengths: weights are less alike, painted by
   a person or found by a program. */
static const double MOTION_ALIKE = 0.2;

static qw_vec3 reflected_in_frame(const qw_run_state *run, const qw_mirror_plane *plane, const double p[3])
{
    double q[3];
    qw_reflect(plane, p, q);
    return qw_in_frame(&run->whole.clean.frame, q);
}

static qw_vec3 reflected_direction(const qw_mirror_plane *plane, qw_vec3 d)
{
    qw_vec3 normal = qw_v3_of_doubles(plane->normal);
    return qw_madd(d, -2 * qw_dot(d, normal), normal);
}

/* Of its length how far a loop with rings may be from the reflection of another and still stand for it, a quarter of
   its radius: there is no room for rings around both. */
static const double RINGS_ALIKE = 0.04;

float qw_drawn_alike(const qw_steering *s, uint32_t guide, double scale)
{
    double length = 0;
    for (uint32_t i = s->guide_begin[guide]; i + 1 < s->guide_begin[guide + 1]; i++)
        length += sqrt(qw_distance2_doubles(s->guide_point + 3 * (size_t)i, s->guide_point + 3 * (size_t)i + 3));
    return s->guide_rings[guide] == 0 ? QW_DRAWN_ALIKE : fmaxf(QW_DRAWN_ALIKE, (float)(RINGS_ALIKE * length * scale));
}

/* Segments between points of the input, and whether the reflection of each end and middle lies on one. */
typedef struct segments {
    const qw_run_state *run;
    const qw_mirror_plane *plane;
    uint32_t count;
    qw_vec3 *from, *to; /* in the frame */
    qw_vec3 *mirrored_from, *mirrored_to;
    float *near; /* how far from one another they may be and are still alike */
} segments;

static segments begin_segments(const qw_run_state *run, const qw_mirror_plane *plane, size_t most)
{
    qw_env *env = run->env;
    return (segments){.run = run,
                      .plane = plane,
                      .from = QW_NEW(env, qw_vec3, most),
                      .to = QW_NEW(env, qw_vec3, most),
                      .mirrored_from = QW_NEW(env, qw_vec3, most),
                      .mirrored_to = QW_NEW(env, qw_vec3, most),
                      .near = QW_NEW(env, float, most)};
}

static void add_segment(segments *s, float near, const double *p, const double *q)
{
    const qw_frame *frame = &s->run->whole.clean.frame;
    s->near[s->count] = near;
    s->from[s->count] = qw_in_frame(frame, p), s->to[s->count] = qw_in_frame(frame, q);
    s->mirrored_from[s->count] = reflected_in_frame(s->run, s->plane, p);
    s->mirrored_to[s->count++] = reflected_in_frame(s->run, s->plane, q);
}

/* Whether the reflection of every segment lies near some segment, at both ends and in the middle. */
static bool are_alike(const segments *s)
{
    if (s->count == 0) return true;
    const qw_curve_tree *tree = qw_curve_tree_build(s->run->env, s->from, s->to, s->count);
    for (uint32_t i = 0; i < s->count; i++) {
        qw_vec3 middle = qw_scale(qw_add(s->mirrored_from[i], s->mirrored_to[i]), 0.5f);
        qw_heartbeat(s->run->env);
        if (qw_curve_nearest(tree, s->mirrored_from[i], s->near[i]).segment == QW_NONE ||
            qw_curve_nearest(tree, middle, s->near[i]).segment == QW_NONE ||
            qw_curve_nearest(tree, s->mirrored_to[i], s->near[i]).segment == QW_NONE)
            return false;
    }
    return true;
}

/* Whether the guides are those of a symmetric surface. */
static bool guides_are_alike(const qw_run_state *run, const qw_mirror_plane *plane)
{
    const qw_steering *st = run->whole.steering;
    if (st->guide_count == 0) return true;
    segments s = begin_segments(run, plane, st->guide_begin[st->guide_count]);
    for (uint32_t g = 0; g < st->guide_count; g++) {
        float near = qw_drawn_alike(st, g, run->whole.clean.frame.scale);
        for (uint32_t i = st->guide_begin[g]; i + 1 < st->guide_begin[g + 1]; i++)
            add_segment(&s, near, st->guide_point + 3 * (size_t)i, st->guide_point + 3 * (size_t)i + 3);
    }
    return are_alike(&s);
}

/* Whether painted densities are the same on both sides, by the mean of their differences. */
static bool densities_are_alike(const qw_run_state *run, const qw_mirror_plane *plane)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    qw_env *env = run->env;
    if (!run->whole.input->density) return true;
    const qw_density *density = qw_painted_at_clean(env, run->whole.input, &run->whole.clean);
    const qw_bvh *tree = qw_bvh_build(env, m);
    double off = 0, all = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        double p[3];
        qw_heartbeat(env);
        qw_place_in_input(&run->whole.clean, m->position[v], p);
        qw_hit hit = qw_bvh_nearest(tree, reflected_in_frame(run, plane, p), qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
        assert(hit.face < m->face_count);
        const uint32_t *c = m->corner + 3 * (size_t)hit.face;
        double there = ((double)density[c[0]] + (double)density[c[1]] + (double)density[c[2]]) / 3;
        off += fabs((double)density[v] - there), all += (double)density[v];
    }
    return off <= DENSITY_ALIKE * all;
}

/* Whether the surface is stretched alike on both sides, by the mean difference of the directions. */
static bool motions_are_alike(const qw_run_state *run, const qw_mirror_plane *plane)
{
    const qw_clean *clean = &run->whole.clean;
    const qw_trimesh *m = &clean->mesh;
    qw_env *env = run->env;
    if (!qw_follows_motion(run)) return true;
    qw_vec3 *normal = qw_vertex_normals(env, m), *point = QW_NEW(env, qw_vec3, m->vertex_count),
            *facing = QW_NEW(env, qw_vec3, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        double p[3];
        qw_place_in_input(clean, m->position[v], p);
        point[v] = reflected_in_frame(run, plane, p), facing[v] = reflected_direction(plane, normal[v]);
    }
    const qw_vec3 *here = qw_motion_at_points(env, run->whole.motion, m->position, normal, m->vertex_count),
                  *there = qw_motion_at_points(env, run->whole.motion, point, facing, m->vertex_count);
    double off = 0, all = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) { /* lines, which have no sign */
        qw_vec3 d = reflected_direction(plane, here[v]);
        off += fmin((double)qw_distance(d, there[v]), (double)qw_length(qw_add(d, there[v])));
        all += (double)qw_length(d);
    }
    return off <= MOTION_ALIKE * all;
}

const char *qw_one_sided_steering(const qw_run_state *run, const qw_mirror_plane *plane)
{
    const char *what = NULL;
    qw_scope_begin(run->env);
    if (run->whole.steering->field_count > 0) what = "directions that were given";
    else if (!guides_are_alike(run, plane)) what = "guides";
    else if (!densities_are_alike(run, plane)) what = "densities";
    else if (!motions_are_alike(run, plane)) what = "weights or targets";
    qw_scope_end(run->env);
    return what;
}
