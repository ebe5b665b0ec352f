#include "whole/thin.h"

#include "geometry/tri_edit.h"
#include "geometry/flips.h"
#include "geometry/parts.h"
#include "remesh/working/working.h"
#include "remesh/quads/quad_components.h"
#include "remesh/quads/pair.h"
#include "remesh/quads/simplify.h"

#include "base/constants.h"
#include "base/elementary.h"

#include <math.h>
#include <string.h>

enum { PAIRINGS = 3 };

static uint32_t farthest_from(const qw_edit *e, uint32_t v)
{
    uint32_t far = v;
    for (uint32_t u = 0; u < e->vertex_count; u++)
        if (qw_distance(e->vertex[u].position, e->vertex[v].position) >
            qw_distance(e->vertex[far].position, e->vertex[v].position))
            far = u;
    return far;
}

/* The two ends stay where they are when quads are thinned out. */
static void hold_ends(qw_edit *e)
{
    uint32_t one = farthest_from(e, 0), other = farthest_from(e, one);
    e->vertex[one].kind = e->vertex[other].kind = QW_VERTEX_CORNER;
}

/* Twice as many triangles as quads, of one size, paired. */
static qw_quadmesh pair_part(qw_env *env, const qw_trimesh *part, double quads)
{
    qw_census census = qw_trimesh_census(env, part);
    double edge = sqrt(qw_trimesh_area(part) / (2 * (double)QW_EQUILATERAL_AREA * quads));
    float *size = QW_NEW(env, float, part->vertex_count);
    for (uint32_t v = 0; v < part->vertex_count; v++) size[v] = (float)edge;
    qw_working working = qw_coarsest_mesh(env, part, &census, size);
    qw_edit e = qw_edit_open(env, &working.mesh, working.target, qw_trimesh_outgoing(env, &working.mesh));
    for (uint32_t v = 0; v < e.vertex_count; v++) e.vertex[v].home = 0; /* the component */
    hold_ends(&e);
    uint32_t *vertex_of;
    qw_pair_counts pairs = {0};
    return qw_pair_triangles(env, &e, NULL, &vertex_of, &pairs);
}

/* Working meshes of few triangles have more than they are asked for, so it takes a few attempts. Thinning out quads
   that are paired already costs the part its ends. */
static qw_quadmesh pair_to_count(qw_env *env, const qw_trimesh *part, double quads)
{
    double asked = quads;
    qw_quadmesh paired = pair_part(env, part, asked);
    for (int i = 1; i < PAIRINGS && paired.face_count > quads; i++) {
        asked *= quads / paired.face_count;
        qw_quadmesh next = pair_part(env, part, asked);
        if (next.face_count < paired.face_count) paired = next;
    }
    return paired;
}

static bool has_flipped(qw_env *env, const qw_trimesh *part, const qw_quadmesh *q)
{
    float edge = (float)sqrt(qw_trimesh_area(part) / q->face_count);
    qw_flip_judge judge = {.surface = part, .tree = qw_bvh_build(env, part), .edge = edge};
    for (uint32_t f = 0; f < q->face_count; f++)
        if (qw_flip_of_quad(&judge, q->position, q->corner + 4 * (size_t)f) == QW_FLIPPED) return true;
    return false;
}

/* Whether the quads have the topology of the part and none is flipped. */
static bool is_sound(qw_env *env, const qw_trimesh *part, const qw_quadmesh *q)
{
    if (q->face_count == 0) return false;
    qw_census wanted = qw_trimesh_census(env, part);
    qw_quad_census census = qw_quadmesh_census(env, q);
    return census.double_edges == 0 && census.degenerate_faces == 0 && census.components == 1 &&
           census.boundary_loops == wanted.boundary_loops && census.euler == wanted.euler && !has_flipped(env, part, q);
}

/* One component, given as a surface of its own, with about so many quads: thinned out at any price, without loss of
   shape, or not at all, the first of these that is sound and has no flipped quad. No faces: none is. */
static qw_quadmesh make_part(qw_env *env, const qw_trimesh *part, double quads)
{
    bool is_ball = qw_trimesh_census(env, part).euler == 2;
    qw_quadmesh paired = pair_to_count(env, part, quads);
    int64_t most = (int64_t)fmax(qw_floor(quads), is_ball ? QW_LEAST_SHELL : QW_LEAST_OPEN);
    for (int way = 0; way < 3; way++) {
        qw_simplify_counts moves = {0};
        qw_quadmesh one = way == 2 ? paired : qw_simplify_quads(env, &paired, NULL, most, most, way == 1, &moves);
        if (is_sound(env, part, &one)) return one;
    }
    return (qw_quadmesh){0};
}

/* All of them, one behind the other. */
static qw_quadmesh join(qw_env *env, const qw_quadmesh *part, uint32_t count)
{
    size_t vertices = 0, faces = 0;
    for (uint32_t i = 0; i < count; i++) vertices += part[i].vertex_count, faces += part[i].face_count;
    qw_quadmesh all = {.position = QW_NEW(env, qw_vec3, vertices),
                       .kind = QW_NEW(env, uint8_t, vertices),
                       .component = QW_NEW(env, uint32_t, vertices),
                       .corner = QW_NEW(env, uint32_t, 4 * faces),
                       .twin = QW_NEW(env, uint32_t, 4 * faces),
                       .mark = QW_NEW(env, uint8_t, 4 * faces)};
    for (uint32_t i = 0; i < count; i++) qw_append_quads(&all, &part[i]);
    return all;
}

qw_quadmesh qw_make_thin(qw_env *env, const qw_trimesh *mesh, const qw_census *census, const uint8_t *thin,
                         const double *quads)
{
    uint32_t n = (uint32_t)census->components, count = 0;
    qw_quadmesh *part = QW_NEW_ZERO(env, qw_quadmesh, n);
    qw_parts parts = qw_sort_parts(env, mesh, census->component, n);
    for (uint32_t c = 0; c < n; c++) {
        if (!thin[c]) continue;
        qw_break_silence(env);
        qw_trimesh surface = qw_take_part(env, &parts, c);
        part[count] = make_part(env, &surface, quads[c]);
        if (part[count].face_count == 0) continue;
        if (part[count].face_count > fmax(quads[c], QW_LEAST_SHELL)) continue; /* fields make it, and count */
        for (uint32_t v = 0; v < part[count].vertex_count; v++)
            part[count].component[v] = c, part[count].kind[v] = QW_VERTEX_FREE;
        count++;
    }
    return join(env, part, count);
}
