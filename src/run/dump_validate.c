#include "base/constants.h"
#include "whole/kept_rims.h"
#include "run/dump_validate.h"

#include "whole/small.h"
#include "remesh/quads/extract.h"
#include "remesh/features/graph.h"
#include "remesh/quads/topology.h"
#include "whole/sizes.h"
#include "run/stages/stages.h"

#include <math.h>
#include <string.h>

enum { MOST_WARNINGS = sizeof((qw_report *)0)->warnings / sizeof((qw_report *)0)->warnings[0] };
/* Mean length of offsets, and quads a triangle of the working mesh: more than any run has, and few enough to be made.
 */
enum { MEAN_OFFSET = 32, QUADS_A_TRIANGLE = 64 };
/* Vertices of quads may lie so far outside the box of the surface, in its diagonals, before they are relaxed: those of
   a dozen quads do. */
static const float OUTSIDE = 16;

#define REQUIRE(c, condition, what)                                       \
    do {                                                                  \
        if (!(condition)) qw_fail((c)->env, QW_INTERNAL, -1, "%s", what); \
    } while (0)

static bool is_positive(double x) { return x > 0 && isfinite(x); }

/* Requires that a value, computed again from earlier parts, equals the one that was read. */
static void require_same(qw_context_state *c, const void *read, const void *made, size_t size, const char *what)
{
    if (size > 0 && memcmp(read, made, size) != 0) qw_fail(c->env, QW_INTERNAL, -1, "%s is not what a run makes", what);
}

/* ---- the input, and how the run came about */

static void validate_report(qw_context_state *c)
{
    REQUIRE(c, c->report.size == sizeof c->report && c->report.warning_count <= MOST_WARNINGS,
            "the report is not one of this library");
    for (uint32_t i = 0; i < MOST_WARNINGS; i++)
        REQUIRE(c, memchr(c->report.warnings[i], 0, sizeof c->report.warnings[i]),
                "a warning in the report has no end");
    for (int i = 0; i < QW_STAGE_COUNT; i++)
        REQUIRE(c, c->warnings_before[i] <= c->report.warning_count, "a stage began with more warnings than there are");
}

static void validate_history(qw_context_state *c, uint32_t finished)
{
    const char *fault = qw_history_fault(&c->history, finished);
    if (fault) qw_fail(c->env, QW_INTERNAL, -1, "%s", fault);
    for (uint32_t i = 0; i < QW_MAX_REFINEMENTS; i++) {
        const qw_refinement *r = &c->refinement[i];
        REQUIRE(c, qw_length(r->center) <= 4 && r->radius >= 0 && r->radius <= 4, "a refinement is beyond the surface");
    }
}

/* Field, region and guides belong to the input. */
static bool has_points(const uint32_t *begin, uint32_t least)
{
    return begin[1] > begin[0] && begin[1] - begin[0] >= least;
}

static void validate_steering(qw_context_state *c)
{
    const qw_steering *s = &c->steering;
    uint32_t elements = s->field_domain == QW_PER_FACE ? c->input.face_count : c->input.vertex_count;
    REQUIRE(c,
            s->field
                ? (s->field_domain == QW_PER_FACE || s->field_domain == QW_PER_VERTEX) && s->field_count == elements
                : s->field_count == 0,
            "the field is one of another mesh");
    for (uint32_t e = 0; e < s->field_count; e++) {
        float length2 = qw_length2(s->field[e]);
        REQUIRE(c, length2 == 0 || fabsf(length2 - 1) < 1e-4f, "a direction of the field is not of unit length");
    }
    for (uint32_t f = 0; s->region && f < c->input.face_count; f++)
        REQUIRE(c, s->region[f] <= 1, "a face is neither inside of the region nor outside");
    REQUIRE(c,
            !s->guide_begin == (s->guide_count == 0) && !s->guide_kind == (s->guide_count == 0) &&
                !s->guide_rings == (s->guide_count == 0),
            "guides are missing");
    for (uint32_t g = 0; g < s->guide_count; g++)
        REQUIRE(c, s->guide_begin[0] == 0 && has_points(s->guide_begin + g, 2) && s->guide_kind[g] <= QW_GUIDE_LOOP,
                "a guide has fewer than two points");
    REQUIRE(c, !s->joint_begin == (s->joint_count == 0) && !s->joint_point == (s->joint_count == 0),
            "joints are missing");
    for (uint32_t i = 0; i < s->joint_count; i++)
        REQUIRE(c, s->joint_begin[0] == 0 && has_points(s->joint_begin + i, 3), "a joint has fewer than three points");
}

/* The polygons of the input and their densities are in range. */
static void validate_input(qw_context_state *c, uint32_t finished)
{
    const qw_clean_input *in = &c->input;
    validate_report(c);
    validate_history(c, finished);
    const uint32_t *begin = in->face_begin;
    REQUIRE(c, in->face_count > 0 && begin[0] == 0 && begin[in->face_count] <= INT32_MAX,
            "the input has no faces, or too many");
    for (uint32_t f = 0; f < in->face_count; f++)
        REQUIRE(c, begin[f + 1] > begin[f] && begin[f + 1] - begin[f] >= 3,
                "a face of the input has fewer than three corners");
    for (uint32_t v = 0; in->density && v < in->vertex_count; v++)
        REQUIRE(c, in->density[v] >= QW_LEAST_DENSITY && in->density[v] <= QW_MOST_DENSITY,
                "a density is out of range");
    validate_steering(c);
}

/* ---- surfaces */

/* A surface is sound, and its marks agree on both sides of an edge. */
static void validate_surface(qw_context_state *c, const qw_trimesh *mesh)
{
    REQUIRE(c, mesh->face_count < QW_NONE / 4, "a surface has too many triangles");
    qw_trimesh_validate(c->env, mesh);
    for (uint32_t h = 0; mesh->mark && h < 3 * mesh->face_count; h++)
        REQUIRE(c,
                mesh->mark[h] <= QW_MARKS && (mesh->twin[h] == QW_NONE || mesh->mark[mesh->twin[h]] == mesh->mark[h]),
                "an edge of a surface is marked from one side");
    for (uint32_t v = 0; mesh->point && v < mesh->vertex_count; v++)
        REQUIRE(c, mesh->point[v] <= 1, "a vertex of a surface is more than a point");
}

/* Frames of components are orthonormal and stretch. */
static void validate_own_frames(qw_context_state *c, const qw_own_frames *own)
{
    REQUIRE(c, own->count <= c->run.whole.census.components && (own->count == 0 || own->frame),
            "there are more frames than components");
    for (uint32_t i = 0; i < own->count; i++)
        for (int k = 0; k < 3; k++) {
            const qw_own_frame *f = &own->frame[i];
            const double *a = f->axis[k];
            REQUIRE(c,
                    fabs(a[0] * a[0] + a[1] * a[1] + a[2] * a[2] - 1) < 1e-6 && fabs(f->center[k]) <= 1 &&
                        f->stretch[k] >= 1 && isfinite(f->stretch[k]),
                    "the frame of a component is none");
        }
}

/* The clean surface is sound, and the counts and sizes that come with it are its own. */
static void validate_clean(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    const qw_frame *frame = &run->whole.clean.frame;
    const qw_trimesh *mesh = &run->whole.clean.mesh;
    REQUIRE(c, mesh->face_count > 0, "the clean surface has no triangles");
    validate_surface(c, mesh);
    for (int k = 0; k < 3; k++)
        REQUIRE(c, is_positive(frame->scale) && isfinite(fabs(frame->center[k]) + QW_LONGEST_OFFSET / frame->scale),
                "the frame of the clean surface is not finite");
    run->whole.census = qw_trimesh_census(c->env, mesh);
    validate_own_frames(c, &run->whole.clean.own);
    REQUIRE(c, is_positive(run->whole.area) && run->whole.area == qw_trimesh_area(mesh),
            "the area of the surface is not its own");
    REQUIRE(c, run->whole.hidden >= 0 && run->whole.hidden <= 1, "the share of the area that is hidden");
    REQUIRE(c, run->whole.clean.wrapped >= 0 && run->whole.clean.wrapped < 1e30f,
            "the width of the gaps that a wrap has closed");
    REQUIRE(c, run->whole.clean.counts.triangles >= 0 && run->whole.clean.counts.triangles <= INT32_MAX,
            "the triangles of the input are not counted");
}

static void require_same_triangles(qw_context_state *c, const qw_trimesh *read, const qw_trimesh *made,
                                   const char *what)
{
    size_t corners = 3 * (size_t)made->face_count;
    REQUIRE(c, read->vertex_count == made->vertex_count && read->face_count == made->face_count, what);
    require_same(c, read->position, made->position, made->vertex_count * sizeof *made->position, what);
    require_same(c, read->corner, made->corner, corners * sizeof *made->corner, what);
    require_same(c, read->twin, made->twin, corners * sizeof *made->twin, what);
}

/* Refuses quads with other faces, kinds, marks or components than those made anew. */
static void require_same_quads(qw_context_state *c, const qw_quadmesh *read, const qw_quadmesh *made, const char *what)
{
    size_t n = made->vertex_count, corners = 4 * (size_t)made->face_count;
    REQUIRE(c,
            read->vertex_count == n && read->face_count == made->face_count && !read->kind == !made->kind &&
                !read->mark == !made->mark && !read->component == !made->component,
            what);
    require_same(c, read->corner, made->corner, corners * sizeof *made->corner, what);
    require_same(c, read->twin, made->twin, corners * sizeof *made->twin, what);
    if (made->kind) require_same(c, read->kind, made->kind, n, what);
    if (made->mark) require_same(c, read->mark, made->mark, corners, what);
    if (made->component) require_same(c, read->component, made->component, n * sizeof *made->component, what);
}

static void require_topology(qw_context_state *c, const qw_census *is, const qw_census *was, const char *what)
{
    REQUIRE(c,
            is->components == was->components && is->euler == was->euler && is->boundary_loops == was->boundary_loops,
            what);
}

/* What was taken off the clean surface is what this library takes off; the marked surface has its topology. */
static void validate_marked(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    REQUIRE(c, run->surface_faces == qw_surface_faces(run, &c->used), "the surface was made for another face count");
    qw_core read = run->core;
    qw_set_core(run);
    require_same_triangles(c, &read.mesh, &run->core.mesh, "what is left of the clean surface");
    require_same_quads(c, &read.small_quads, &run->core.small_quads, "quads of small components");
    require_same(c, read.small_quads.position, run->core.small_quads.position,
                 read.small_quads.vertex_count * sizeof(qw_vec3), "quads of small components");
    read.census = run->core.census, read.area = run->core.area, read.extent = run->core.extent;
    read.needed = run->core.needed;
    run->core = read;
    validate_surface(c, &run->surface);
    const qw_necks *necks = &run->necks;
    REQUIRE(c, !necks->begin == (necks->count == 0) && !necks->point == (necks->count == 0), "necks are missing");
    REQUIRE(c, !necks->is_pocket == (necks->count == 0), "what necks are is missing");
    for (uint32_t i = 0; i < necks->count; i++)
        REQUIRE(c, necks->begin[0] == 0 && has_points(necks->begin + i, 3) && necks->is_pocket[i] <= 1,
                "a neck has fewer than three points or is of no kind");
    run->surface_census = qw_trimesh_census(c->env, &run->surface);
    require_topology(c, &run->surface_census, &run->core.census, "the marked surface has another topology");
}

/* ---- the working mesh and the fields */

/* Unit vectors, or shorter where there is no direction. */
static void require_units(qw_context_state *c, const qw_vec3 *unit, uint32_t count)
{
    for (uint32_t v = 0; v < count; v++) REQUIRE(c, qw_length2(unit[v]) < 1.01f, "a direction is longer than 1");
}

typedef struct box {
    qw_vec3 low, high;
} box;

/* The surface's bounding box, grown by what quads may stand out. */
static box wide_box(const qw_trimesh *s)
{
    box b = {s->position[0], s->position[0]};
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        qw_vec3 p = s->position[v];
        b.low = qw_v3(fminf(b.low.x, p.x), fminf(b.low.y, p.y), fminf(b.low.z, p.z));
        b.high = qw_v3(fmaxf(b.high.x, p.x), fmaxf(b.high.y, p.y), fmaxf(b.high.z, p.z));
    }
    float margin = OUTSIDE * qw_distance(b.low, b.high);
    b.low = qw_sub(b.low, qw_v3(margin, margin, margin)), b.high = qw_add(b.high, qw_v3(margin, margin, margin));
    return b;
}

/* Refuses vertices far off the surface. */
static void require_inside(qw_context_state *c, const qw_vec3 *position, uint32_t count)
{
    if (count == 0) return;
    box b = wide_box(&c->run.clean.mesh);
    for (uint32_t v = 0; v < count; v++) {
        qw_vec3 p = position[v];
        REQUIRE(c,
                p.x >= b.low.x && p.y >= b.low.y && p.z >= b.low.z && p.x <= b.high.x && p.y <= b.high.y &&
                    p.z <= b.high.z,
                "a vertex lies far from the surface");
    }
}

/* Requires sizes that are not too small: they decide how long integer offsets and how many quads there are. */
static void require_sizes(qw_context_state *c, const float *size)
{
    const qw_trimesh *mesh = &c->run.working.mesh;
    double quads = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) REQUIRE(c, size[v] > 0, "a wanted edge length is not positive");
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        double least = INFINITY, longest = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            least = fmin(least, size[mesh->corner[h]]);
            longest = fmax(longest, qw_edge_length(mesh, h));
        }
        REQUIRE(c, longest <= QW_LONGEST_OFFSET * least, "an edge is much longer than the one that is wanted");
        quads += 0.5 * qw_length(qw_face_cross(mesh, f)) / (least * least);
    }
    REQUIRE(c, quads <= (double)QUADS_A_TRIANGLE * mesh->face_count,
            "the wanted edge lengths are those of far more quads");
}

/* Constraints and directions are those that follow from the curves. */
static void validate_holds(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    uint32_t n = run->working.mesh.vertex_count;
    uint8_t *constraint = run->constraint;
    qw_vec3 *direction = run->direction;
    qw_set_holds(run);
    require_same(c, constraint, run->constraint, n * sizeof *constraint, "what is held of the working mesh");
    require_same(c, direction, run->direction, n * sizeof *direction, "the direction of a curve");
    run->constraint = constraint, run->direction = direction;
}

/* The working mesh fits the options and the surface. */
static void validate_working(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    const qw_trimesh *mesh = &run->working.mesh;
    double faces = qw_core_faces(run, qw_faces_wanted(run, &c->used));
    REQUIRE(c,
            run->faces_wanted == faces && run->rho == qw_edge_wanted(run, run->faces_wanted) &&
                run->feature_density == qw_feature_density_of(run),
            "a wanted size is not what the options ask for");
    validate_surface(c, mesh);
    require_inside(c, mesh->position, mesh->vertex_count);
    qw_census census = qw_trimesh_census(c->env, mesh);
    require_topology(c, &census, &run->surface_census, "the working mesh has another topology than the surface");
    require_sizes(c, run->working.target);
    REQUIRE(c, qw_are_verdicts_of(mesh, run->curve_verdict), "a verdict is of no curve, or a curve has none");
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        REQUIRE(c, run->smoothed[v] >= 0 && run->smoothed[v] <= 1, "a share is not between 0 and 1");
    REQUIRE(c, run->tips.count == 0 || run->tips.tip, "parts that stick out are missing");
    for (uint32_t t = 0; t < run->tips.count; t++)
        REQUIRE(c, run->tips.tip[t].length > 0 && run->tips.tip[t].girth > 0, "a part that sticks out has no length");
    require_units(c, run->normal, mesh->vertex_count);
    if (run->nested) require_units(c, run->nested, mesh->vertex_count);
    validate_holds(c);
}

static void validate_size(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    float *size = run->size;
    qw_stage_SCALE(run);
    require_same(c, size, run->size, run->working.mesh.vertex_count * sizeof *size, "the scale field");
    run->size = size;
    require_sizes(c, size);
}

static void validate_lattice(qw_context_state *c)
{
    const qw_run_state *run = &c->run;
    const qw_trimesh *mesh = &run->working.mesh;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        float away = qw_distance(run->lattice[v], mesh->position[v]);
        REQUIRE(c, away <= MEAN_OFFSET * run->size[v], "a lattice point is far from its vertex");
    }
}

/* ---- the integers */

/* Refuses an offset mesh that is not the one made anew, its offsets aside. */
static void require_same_mesh(qw_context_state *c, const qw_offset_mesh *read, const qw_offset_mesh *made)
{
    size_t corners = 3 * (size_t)made->face_count, edges = made->edge_count, n = made->vertex_count;
    static const char what[] = "the offset mesh";
    REQUIRE(c, read->vertex_count == n && read->edge_count == edges && read->face_count == made->face_count, what);
    require_same(c, read->corner, made->corner, corners * sizeof *made->corner, what);
    require_same(c, read->twin, made->twin, corners * sizeof *made->twin, what);
    require_same(c, read->edge, made->edge, corners * sizeof *made->edge, what);
    require_same(c, read->rot, made->rot, corners, what);
    require_same(c, read->mark, made->mark, corners, what);
    require_same(c, read->half, made->half, edges * sizeof *made->half, what);
    require_same(c, read->axis, made->axis, edges * sizeof *made->axis, what);
    require_same(c, read->side, made->side, edges * sizeof *made->side, what);
    require_same(c, read->position, made->position, n * sizeof *made->position, what);
    require_same(c, read->normal, made->normal, n * sizeof *made->normal, what);
    require_same(c, read->lattice, made->lattice, n * sizeof *made->lattice, what);
    require_same(c, read->index, made->index, n, what);
}

/* Offsets are short, directions of unit length, vertices near the surface. */
static void validate_offsets(qw_context_state *c, const qw_offset_mesh *m)
{
    int64_t sum = 0;
    REQUIRE(c, m->face_count < QW_NONE / 4, "an offset mesh has too many triangles");
    for (uint32_t e = 0; e < m->edge_count; e++) {
        qw_int2 x = m->d[e];
        REQUIRE(c,
                x.x <= QW_LONGEST_OFFSET && x.x >= -QW_LONGEST_OFFSET && x.y <= QW_LONGEST_OFFSET &&
                    x.y >= -QW_LONGEST_OFFSET,
                "an offset is too long");
        sum += qw_int2_norm(x);
    }
    REQUIRE(c, sum <= (int64_t)MEAN_OFFSET * m->edge_count, "the offsets are too long");
    require_units(c, m->axis, m->edge_count);
    require_units(c, m->side, m->edge_count);
    require_units(c, m->normal, m->vertex_count);
    require_units(c, m->direction, m->vertex_count);
    require_inside(c, m->position, m->vertex_count);
    qw_offset_validate(c->env, m);
}

/* The offsets before any change are those that follow from crosses and sizes. */
static void validate_first_offsets(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    qw_offset_mesh m = run->offsets;
    qw_report report = c->report;
    qw_stage_OFFSETS(run);
    c->report = report;
    require_same_mesh(c, &m, &run->offsets);
    require_same(c, m.d, run->offsets.d, m.edge_count * sizeof *m.d, "an offset");
    require_same(c, m.real, run->offsets.real, m.edge_count * sizeof *m.real, "a real offset");
    require_same(c, m.fixed, run->offsets.fixed, m.edge_count, "what is fixed of an offset");
    require_same(c, m.size, run->offsets.size, m.vertex_count * sizeof *m.size, "the scale field");
    require_same(c, m.constraint, run->offsets.constraint, m.vertex_count, "what is held");
    require_same(c, m.direction, run->offsets.direction, m.vertex_count * sizeof *m.direction,
                 "the direction of a curve");
    run->offsets = m;
}

static void validate_regular(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    validate_offsets(c, &run->regular);
    require_same_mesh(c, &run->regular, &run->offsets);
    REQUIRE(c,
            run->irregular == qw_offset_count(&run->regular).irregular_triangles &&
                run->stiffening_changes_nothing <= 1 && run->lacks_room <= 2,
            "the irregular triangles are not counted");
}

static void validate_orientation(qw_context_state *c)
{
    const qw_run_state *run = &c->run;
    validate_offsets(c, &run->inversion_free);
    REQUIRE(c, run->inverted >= 0 && run->inverted <= run->inversion_free.face_count,
            "the inverted triangles are not counted");
}

/* ---- the quads */

/* components: one more than the largest number of one. */
static void validate_quads(qw_context_state *c, const qw_quadmesh *q, int64_t components)
{
    REQUIRE(c, q->face_count < QW_NONE / 4, "there are too many quads");
    qw_quadmesh_validate(c->env, q);
    require_inside(c, q->position, q->vertex_count);
    for (uint32_t v = 0; v < q->vertex_count; v++)
        REQUIRE(c,
                (!q->kind || q->kind[v] <= QW_VERTEX_CORNER) &&
                    (!q->component || q->component[v] < (uint64_t)components),
                "a vertex is of no known kind or component");
}

/* The quads are those that follow from the offsets. */
static void validate_extraction(qw_context_state *c)
{
    const qw_extraction *x = &c->run.extraction;
    const qw_offset_mesh *m = &c->run.inversion_free;
    qw_extraction made = qw_extract_quads(c->env, m);
    require_same_quads(c, &x->quads, &made.quads, "the quads");
    require_same(c, x->quads.position, made.quads.position, made.quads.vertex_count * sizeof(qw_vec3), "the quads");
    require_same(c, x->vertex_class, made.vertex_class, made.quads.vertex_count * sizeof *made.vertex_class, "a class");
    require_same(c, x->class_of, made.class_of, m->vertex_count * sizeof *made.class_of, "a class");
    REQUIRE(c, x->unpaired == made.unpaired, "the triangles without a partner are not counted");
}

static void validate_placed(qw_context_state *c)
{
    validate_quads(c, &c->run.embedded, c->run.core.census.components);
    require_same_quads(c, &c->run.embedded, &c->run.extraction.quads, "the placed quads");
}

static void validate_repaired(qw_context_state *c)
{
    const qw_run_state *run = &c->run;
    validate_quads(c, &run->repaired, run->core.census.components);
    bool kept = qw_check_topology(c->env, &run->repaired, &run->working.mesh).broken_count == 0;
    REQUIRE(c, run->topology_kept == kept, "the topology of the quads is not as it says");
}

/* The faces of the joined mesh are quads first, then polygons of the input. */
static void validate_joined(qw_context_state *c)
{
    const qw_run_state *run = &c->run;
    const qw_joined *j = &run->joined;
    uint64_t corners = 0;
    REQUIRE(c, run->reflected <= run->finished.face_count && run->sides_meet <= 1 && run->sides_unlike <= QW_PARTS_LOST,
            "the sides of the plane are no sides");
    uint32_t rim_vertices = run->rim ? qw_rim_vertices(run) : 0;
    for (uint32_t v = 0; run->rim && v < run->finished.vertex_count; v++)
        REQUIRE(c, run->rim[v] == QW_NONE || run->rim[v] < rim_vertices, "a vertex of the rim is none of the input");
    for (uint32_t f = 0; f < j->face_count; f++) corners += j->face_size[f];
    REQUIRE(c, j->face_count == 0 || j->face_count >= run->finished.face_count, "the joined mesh lacks quads");
    for (uint32_t f = 0; f < j->face_count; f++)
        REQUIRE(c, f < run->finished.face_count ? j->face_size[f] == 4 : j->face_size[f] >= 3,
                "a face of the joined mesh has a wrong number of corners");
    REQUIRE(c, corners == j->corner_count, "the corners of the joined mesh are not those of its faces");
}

void qw_state_validate(qw_context_state *c, int part, uint32_t finished)
{
    int64_t rest = c->run.core.census.components;
    switch (part) {
    case -1: validate_input(c, finished); break;
    case QW_STAGE_CLEAN: validate_clean(c); break;
    case QW_STAGE_SURFACE: validate_marked(c); break;
    case QW_STAGE_WORKING: validate_working(c); break;
    case QW_STAGE_ORIENTATION: require_units(c, c->run.orientation, c->run.working.mesh.vertex_count); break;
    case QW_STAGE_SCALE: validate_size(c); break;
    case QW_STAGE_POSITION: validate_lattice(c); break;
    case QW_STAGE_OFFSETS: validate_first_offsets(c); break;
    case QW_STAGE_REGULAR: validate_regular(c); break;
    case QW_STAGE_INVERSIONS: validate_orientation(c); break;
    case QW_STAGE_QUADS: validate_extraction(c); break;
    case QW_STAGE_POSITIONS: validate_placed(c); break;
    case QW_STAGE_REPAIR: validate_repaired(c); break;
    case QW_STAGE_SIMPLIFY: validate_quads(c, &c->run.simplified, rest); break;
    case QW_STAGE_RELAX: validate_quads(c, &c->run.relaxed, rest); break;
    case QW_STAGE_FINISH: validate_quads(c, &c->run.fitted, rest); break;
    case QW_STAGE_ASSEMBLE:
        validate_quads(c, &c->run.finished, rest + c->run.clean_census.components);
        validate_joined(c);
        break;
    default: break; /* made again */
    }
}
