#include "whole/own_planes.h"

#include "base/constants.h"
#include "base/sort.h"
#include "geometry/box_tree.h"
#include "geometry/parts.h"
#include "whole/across.h"
#include "whole/half.h"
#include "whole/suits_cut.h"

#include <assert.h>
#include <math.h>

/* Components of less than this share of the area are not asked: it bounds how many are. Nor are flat ones, of which the
   sum of the normals has this share of the area: their boundary alone says where a plane lies, and not exactly. */
static const double LEAST_PART = 1.0 / 16;

static bool is_flat(const qw_cut_surface *part)
{
    qw_vec3 sum = {0, 0, 0};
    for (uint32_t f = 0; f < part->mesh->face_count; f++) sum = qw_add(sum, qw_face_cross(part->mesh, f));
    return (double)qw_length(sum) / 2 > QW_PARALLEL_COSINE * part->area;
}

/* Whether both sides of the plane have one topology. */
static bool has_like_sides(const qw_run_state *run, const qw_cut_surface *part, const qw_mirror_plane *plane)
{
    double *position = QW_NEW(run->env, double, 3 * (size_t)part->mesh->vertex_count);
    for (uint32_t v = 0; v < part->mesh->vertex_count; v++)
        qw_place_in_input(&run->whole.clean, part->mesh->position[v], position + 3 * (size_t)v);
    qw_half half = qw_cut_half(run->env, part->mesh, position, &(qw_mirror_planes){1, plane, NULL}, NULL, false);
    return half.face_count > 0 && qw_is_like_half(run->env, &half, part->mesh, part->census);
}

/* The component's plane, if it has one. Its `far` becomes one of the whole's diagonals. */
static bool find_own(const qw_run_state *run, qw_parts *parts, uint32_t component, double edge, qw_mirror_search *own)
{
    const qw_frame *frame = &run->whole.clean.frame;
    qw_mirror_search found[QW_MOST_PLANES];
    bool is_found = false, is_auto = run->options.symmetry == QW_SYMMETRY_AUTO;
    qw_scope_begin(run->env);
    qw_trimesh mesh = qw_take_part(run->env, parts, component);
    qw_census census = qw_trimesh_census(run->env, &mesh);
    qw_cut_surface part = {&mesh, &census, qw_trimesh_area(&mesh)};
    uint32_t count = is_flat(&part) ? 0
                                    : qw_find_mirror_planes(run->env, &mesh, frame, QW_NO_AXIS, QW_NEARLY_ALIKE, found);
    qw_box box = qw_box_of(mesh.position, (int)mesh.vertex_count);
    double diagonal = (double)qw_distance(qw_v3(box.lo[0], box.lo[1], box.lo[2]),
                                          qw_v3(box.hi[0], box.hi[1], box.hi[2]));
    bool is_turned = count > 0 && qw_is_turned(run->env, &mesh, frame, found, count);
    for (uint32_t i = 0; i < count && !is_found; i++) {
        *own = found[i], own->far *= diagonal;
        is_found = own->most <= QW_NEARLY_ALIKE && (run->plan.plane == 0 || qw_is_alike(own->far, edge)) &&
                   (!is_auto || qw_suits_cut(run, &part, &own->plane, is_turned)) &&
                   has_like_sides(run, &part, &own->plane);
    }
    qw_scope_end(run->env);
    return is_found;
}

/* Lists the components that are large enough, the largest first: the lower half of a key is the number of one. Returns
   how many there are. */
static uint32_t list_largest(const qw_run_state *run, uint64_t *keys)
{
    uint32_t components = (uint32_t)run->whole.census.components, count = 0;
    double *area = QW_NEW_ZERO(run->env, double, components);
    for (uint32_t f = 0; f < run->whole.clean.mesh.face_count; f++)
        area[run->whole.census.component[f]] += (double)qw_length(qw_face_cross(&run->whole.clean.mesh, f)) / 2;
    for (uint32_t c = 0; c < components; c++)
        if (area[c] >= LEAST_PART * run->whole.area)
            keys[count++] = (uint64_t)qw_float_key((float)(run->whole.area - area[c])) << 32 | c;
    qw_sort_u64(keys, count);
    qw_free(run->env, area);
    return count;
}

qw_mirror qw_find_own_planes(const qw_run_state *run, double edge)
{
    qw_env *env = run->env;
    uint32_t components = (uint32_t)run->whole.census.components;
    qw_mirror m = {.own = QW_NEW_ZERO(env, uint8_t, components)};
    qw_scope_begin(env);
    uint64_t *keys = QW_NEW(env, uint64_t, components);
    uint32_t count = components > 1 ? list_largest(run, keys) : 0;
    qw_parts parts = {.count = components};
    if (count > 0) parts = qw_sort_parts(env, &run->whole.clean.mesh, run->whole.census.component, components);
    for (uint32_t i = 0; i < count && m.planes < QW_MOST_CUTS; i++) {
        uint32_t c = (uint32_t)keys[i];
        assert(c < components);
        qw_mirror_search found;
        qw_heartbeat(env);
        if (!find_own(run, &parts, c, edge, &found)) continue;
        m.plane[m.planes++] = found.plane;
        m.own[c] = (uint8_t)m.planes, m.far = fmax(m.far, found.far);
    }
    qw_scope_end(env);
    m.is_used = m.planes > 0;
    return m;
}
