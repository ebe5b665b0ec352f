#include "base/constants.h"
#include "whole/kept_rims.h"
#include "run/dump_validate.h"

#include "whole/small.h"
#include "remesh/features/graph.h"
#include "remesh/quads/topology.h"
#include "whole/sizes.h"
#include "run/stages/stages.h"

#include <math.h>
#include <string.h>

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

/* ---- the input, and how the run came about */

/* Fails where the report of a dump is not one that this library could have written. */
static void validate_report(qw_context_state *c)
{
    REQUIRE(c,
            c->report.size == sizeof c->report &&
                c->report.warning_count <= sizeof c->report.warnings / sizeof *c->report.warnings,
            "the report is not one of this library");
    for (uint32_t i = 0; i < sizeof c->report.warnings / sizeof *c->report.warnings; i++)
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

/* Directions are of unit length, guides and joints have points, and all are of this mesh. */
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
    run->whole.area = qw_trimesh_area(mesh);
    REQUIRE(c, is_positive(run->whole.area), "the surface has no area");
    REQUIRE(c, run->whole.hidden >= 0 && run->whole.hidden <= 1, "the share of the area that is hidden");
    REQUIRE(c, run->whole.clean.wrapped >= 0 && run->whole.clean.wrapped < 1e30f,
            "the width of the gaps that a wrap has closed");
    REQUIRE(c, run->whole.clean.counts.triangles >= 0 && run->whole.clean.counts.triangles <= INT32_MAX,
            "the triangles of the input are not counted");
}

static void require_topology(qw_context_state *c, const qw_census *is, const qw_census *was, const char *what)
{
    REQUIRE(c,
            is->components == was->components && is->euler == was->euler && is->boundary_loops == was->boundary_loops,
            what);
}

/* The marked surface has the topology of the core. */
static void validate_marked(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    validate_surface(c, &run->surface);
    const qw_necks *necks = &run->necks;
    REQUIRE(c, !necks->begin == (necks->count == 0) && !necks->point == (necks->count == 0), "necks are missing");
    REQUIRE(c, !necks->kind == (necks->count == 0), "what necks are is missing");
    for (uint32_t i = 0; i < necks->count; i++)
        REQUIRE(c, necks->begin[0] == 0 && has_points(necks->begin + i, 3) && necks->kind[i] <= QW_DENT,
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

/* The working mesh fits the options and the surface. */
static void validate_working(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    const qw_trimesh *mesh = &run->working.mesh;
    run->faces_wanted = qw_core_faces(run, qw_faces_wanted(run, &run->options));
    run->rho = qw_edge_wanted(run, run->faces_wanted), run->feature_density = qw_feature_density_of(run);
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
    qw_set_holds(run);
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

static void validate_regular(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    validate_offsets(c, &run->regular);
    run->irregular = qw_offset_count(&run->regular).irregular_triangles;
    REQUIRE(c, run->lacks_room <= 2, "it is not known how much room there is");
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

static void validate_repaired(qw_context_state *c)
{
    qw_run_state *run = &c->run;
    validate_quads(c, &run->repaired, run->core.census.components);
    run->topology_kept = qw_check_topology(c->env, &run->repaired, &run->working.mesh).broken_count == 0;
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
    case QW_STAGE_SCALE: require_sizes(c, c->run.size); break;
    case QW_STAGE_POSITION: validate_lattice(c); break;
    case QW_STAGE_REGULAR: validate_regular(c); break;
    case QW_STAGE_INVERSIONS: validate_orientation(c); break;
    case QW_STAGE_POSITIONS: validate_quads(c, &c->run.embedded, rest); break;
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
