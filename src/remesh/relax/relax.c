/* The loop of relaxation: Gauss-Newton on the energy of relax_energy.h and on how far edges lift off the surface.
 *
 *     frames    each vertex may move along two axes of its tangent plane, along one on a curve, not at all at a corner
 *     model     each quad's energy in its own plane, to second order, by the axes of its corners
 *     solve     all vertices at once (relax_solve.h)
 *     step      along the axes, back onto the surface or the curve; shorter around quads that it would turn over;
 * undone where the energy rises
 *
 * and what is flipped or inverted after all of them is repaired by itself (flip_repair.h).
 */
#include "remesh/relax/relax.h"

#include "base/mechanisms.h"
#include "base/constants.h"
#include "geometry/bvh.h"
#include "geometry/go_back.h"
#include "geometry/slide.h"
#include "geometry/step_search.h"
#include "remesh/relax/flip_repair.h"
#include "remesh/relax/diagonals.h"
#include "remesh/relax/relax_align.h"
#include "remesh/relax/relax_curves.h"
#include "remesh/relax/relax_energy.h"
#include "remesh/relax/relax_solve.h"
#include "remesh/quads/wanted.h"
#include "base/groups.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Few steps do, as each is nearly Newton's. */
enum { STEPS = 12, REJECTIONS = 3, SOLVE_MOST = 80, GRAIN = 512, SPREADS = 10 };
_Static_assert(GRAIN % QW_LANES == 0, "no four quads are in two blocks");

/* The surface's normal beside the quad's own, whose length is twice its area, where the two say together how a quad is
 * seen. */
static const float REFERENCE_SHARE = 0.2f;
/* A quad whose diagonals cross at more than this angle (sine) and whose normal makes no more than this one (cosine)
   with the surface's is looked at from its own side: on rough ground and over creases the surface's normal is no guide.
 */
static const float SOUND = 0.3f, AGAINST = -QW_SAME_SHEET;
/* A corner whose area falls below this share of the wanted one does not get smaller still. */
static const float LEAST_CORNER = 0.05f;
/* Nor does the energy of a quad (about 1 for one that is hardly a quad any more) grow more than so much in a step. */
static const float MOST_RISE = 3;
/* What a term counts with follow 0, and from QW_USUAL_FOLLOW on. */
typedef struct weight_range {
    float plain, following;
} weight_range;
/* Equal sides count less than right angles: with them a quad that is to keep its area must take its place sideways, and
   no figure of merit asks for them. At a third the edges' lengths still vary no more than other programs' do; at a
   ninth both distortions fall by a tenth again, but quads get long. Lines that follow the shape need quads that are
   longer than wide, and right angles more than equal areas. */
static const weight_range CONFORMAL = {0.5f, 0.3f}, SQUARE = {1.5f, 2.2f};
/* What an edge that stands off the surface by its own length counts, as a root. Half of it lets the rims of ears be cut
   off, twice as much costs a tenth of squareness on rough scans. Longer quads bridge more. */
static const weight_range LIFT = {0.25f, 0.38f};
/* What the squared sine of the angle to a clear direction counts with follow 1. Without, quads that lay along the shape
   turn away from it by 2 degrees for the sake of their angles. 28 for 20 costs a twentieth of squareness and gains a
   fiftieth of the angle to the shape (docs/dev/decisions/follow.md). */
static const float LINES = 25;
/* SOFT: softening of the energy where no corner is inverted; it changes the energy by a hundredth. SOFT_SHARE:
   softening where one is, as a share of how far it is inverted. */
static const float SOFT = 0.15f, SOFT_SHARE = 0.5f;
/* DAMPING: Levenberg damping, as a share of the diagonal; at 1e-3 corrections 100 quads wide still converge. SOLVED:
   the residual of a linear step, as a share of its right side. */
static const float DAMPING = 1e-3f, SOLVED = 0.08f;
/* A step that ends further from the surface than this, in edge lengths, may be nearer to another part of it than to
 * where the walk got stuck. */
static const float NEAR_SURFACE = 0.25f;
/* Bound of the wanted area over the mean of the areas around it, and of its inverse. */
static const float OFF_BY = 3;
/* In edge lengths. */
static const float LONGEST_STEP = 1.2f, ON_PLACE = 1e-3f;
/* What a step must gain, as a share of the energy, for another to follow. */
static const double ENOUGH = 2e-2;

typedef struct relaxation {
    const qw_quadmesh *quads;
    const uint8_t *held; /* [vertices] 1: stays; NULL: none does */
    const qw_trimesh *surface;
    const qw_bvh *tree;
    const uint32_t *outgoing; /* of the surface */
    qw_curve_binding curves;
    qw_relax_weights weights;
    uint32_t *begin, *around;    /* quads around each vertex: corner half-edges around[begin[v]..begin[v+1]] */
    float *size;                 /* [vertices] edge length around, as given */
    float *wanted;               /* [faces] area */
    qw_vec3 *reference, *facing; /* [faces] normals: of the surface there, and of the plane in which the quad is seen */
    qw_vec3 *position, *next;    /* [vertices] */
    uint32_t *face, *next_face;  /* [vertices] of the surface where a free vertex lies, or QW_NONE */
    qw_vec3 *ground, *next_ground; /* [vertices] normal of the surface where a free vertex lies, or 0 */
    uint32_t *next_edge;           /* [vertices] as curves.edge */
    qw_vec3 *normal, (*axis)[2];   /* [vertices] */
    qw_relax_model *model;         /* [faces / QW_LANES, rounded up] */
    float *least, *next_least;     /* [faces] smallest corner */
    float *energy, *next_energy;   /* [faces] */
    float *soft;                   /* [faces] as in relax_energy.h */
    /* [faces] was seen to lie on the surface with its face up; from then on its own normal is followed */
    uint8_t *face_up;
    double *sum;          /* [blocks of faces] */
    float *share;         /* [vertices] of the step that is taken */
    uint8_t *moves;       /* [vertices] its step, or the share of it, is another than when it was moved last */
    qw_vec2 *step;        /* [vertices] along the axes */
    qw_relax_lines lines; /* along is NULL: no quad has a direction */
    float lift;           /* weight of edges that lift off, as a root */
    qw_relax_system system;
} relaxation;

static bool is_free(const relaxation *r, uint32_t v)
{
    return r->curves.edge[v] == QW_NONE && (!r->quads->kind || r->quads->kind[v] != QW_VERTEX_CORNER);
}

/* ---- planes of the quads */

/* A quad that has come to lie with its back to the surface is looked at from the surface's side; the surface's normal
   counts for little but where the quad has no area to speak of. */
static qw_vec3 twice_area(const relaxation *r, uint32_t f, const qw_vec3 *position)
{
    return qw_quad_cross(position, r->quads->corner + 4 * (size_t)f);
}

static qw_vec3 facing_of(const relaxation *r, uint32_t f, const qw_vec3 *position)
{
    qw_vec3 n = twice_area(r, f, position);
    if (qw_dot(n, r->reference[f]) < 0) n = qw_scale(n, -1);
    return qw_normalize(qw_madd(n, REFERENCE_SHARE * r->wanted[f], r->reference[f]));
}

/* Four quads side by side, from `first` on; past the last, the last once more. */
typedef struct quads4 {
    uint32_t face[QW_LANES];
    const uint32_t *corner[QW_LANES];
    qw_lanes wanted;
} quads4;

static qw_lanes of_faces(const uint32_t face[QW_LANES], const float *value)
{
    return (qw_lanes){value[face[0]], value[face[1]], value[face[2]], value[face[3]]};
}

static qw_vec3_lanes vectors_of_faces(const uint32_t face[QW_LANES], const qw_vec3 *value)
{
    return qw_four(value[face[0]], value[face[1]], value[face[2]], value[face[3]]);
}

static quads4 four_from(const relaxation *r, uint32_t first, uint32_t end)
{
    quads4 q;
    for (uint32_t k = 0; k < QW_LANES; k++) {
        q.face[k] = first + k < end ? first + k : end - 1;
        q.corner[k] = r->quads->corner + 4 * (size_t)q.face[k];
    }
    q.wanted = of_faces(q.face, r->wanted);
    return q;
}

static void at_corners(const quads4 *q, const qw_vec3 *of_vertices, qw_vec3_lanes at[4])
{
    const uint32_t *const *c = q->corner;
    for (int i = 0; i < 4; i++)
        at[i] = qw_four(of_vertices[c[0][i]], of_vertices[c[1][i]], of_vertices[c[2][i]], of_vertices[c[3][i]]);
}

static qw_vec3_lanes facing_of_four(const relaxation *r, const quads4 *q, const qw_vec3_lanes p[4])
{
    qw_vec3_lanes reference = vectors_of_faces(q->face, r->reference),
                  n = qw_cross4(qw_sub4(p[2], p[0]), qw_sub4(p[3], p[1]));
    n = qw_scale4(n, qw_choose(qw_dot4(n, reference) < 0, qw_lanes_of(-1), qw_lanes_of(1)));
    return qw_normalize4(qw_madd4(n, REFERENCE_SHARE * q->wanted, reference));
}

typedef struct planes {
    qw_vec3_lanes x, y;
    qw_plane_quads q;
} planes;

/* Four quads in the planes of their normals: coordinates of the corners, and the axes. */
static planes planes_of(qw_vec3_lanes n, const qw_vec3_lanes p[4])
{
    planes s;
    qw_vec3_lanes across = qw_sub4(qw_add4(p[1], p[2]), qw_add4(p[0], p[3]));
    s.x = qw_normalize4(qw_madd4(across, -qw_dot4(across, n), n));
    qw_lanes length2 = qw_dot4(s.x, s.x);
    for (int k = 0; k < QW_LANES; k++)
        if (length2[k] < 0.5f) qw_put_lane(&s.x, k, qw_any_orthogonal(qw_lane(&n, k)));
    s.y = qw_cross4(n, s.x);
    for (int i = 0; i < 4; i++) {
        qw_vec3_lanes d = qw_sub4(p[i], p[0]);
        s.q.x[i] = qw_dot4(d, s.x), s.q.y[i] = qw_dot4(d, s.y);
    }
    return s;
}

/* How far the edges at corner i lift off the surface there, to the next corner and to the previous one, in wanted
   lengths. Small where a quad follows the surface; where it bridges a ridge that is no curve, least when the far corner
   lies on the ridge: so ridges draw edges onto them, and the tips of thin parts are not cut off. */
static void lifts_at(uint32_t i, const qw_vec3_lanes p[4], qw_vec3_lanes ground, qw_lanes scale, qw_lanes lift[2])
{
    for (uint32_t k = 0; k < 2; k++) lift[k] = scale * qw_dot4(qw_sub4(p[(i + 1 + 2 * k) & 3], p[i]), ground);
}

static qw_lanes lift_energy(float weight, qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes ground[4])
{
    qw_lanes sum = qw_lanes_of(0), lift[2], scale = weight / qw_lanes_sqrt(wanted);
    for (uint32_t i = 0; i < 4; i++) {
        lifts_at(i, p, ground[i], scale, lift);
        sum += lift[0] * lift[0] + lift[1] * lift[1];
    }
    return sum;
}

/* Adds to the model what corners lift off the ground planes of their neighbours, first and second derivatives. */
static void add_lifts(float weight, qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes ground[4],
                      const qw_vec3_lanes axis[4][2], qw_relax_model *model)
{
    qw_lanes scale = weight / qw_lanes_sqrt(wanted);
    for (uint32_t i = 0; i < 4; i++) {
        qw_lanes lift[2], own[2] = {-scale * qw_dot4(axis[i][0], ground[i]), -scale * qw_dot4(axis[i][1], ground[i])};
        lifts_at(i, p, ground[i], scale, lift);
        for (uint32_t k = 0; k < 2; k++) {
            uint32_t j = (i + 1 + 2 * k) & 3, at[4] = {2 * j, 2 * j + 1, 2 * i, 2 * i + 1};
            qw_lanes d[4] = {scale * qw_dot4(axis[j][0], ground[i]), scale * qw_dot4(axis[j][1], ground[i]), own[0],
                             own[1]};
            for (int s = 0; s < 4; s++) {
                model->gradient[at[s]] += 2.0f * lift[k] * d[s];
                for (int t = 0; t < 4; t++) model->matrix[at[s]][at[t]] += 2.0f * d[s] * d[t];
            }
        }
    }
}

static bool lines_of_four(const relaxation *r, const quads4 *q, qw_vec3_lanes line[2])
{
    if (!r->lines.along) return false;
    line[0] = vectors_of_faces(q->face, r->lines.along), line[1] = vectors_of_faces(q->face, r->lines.across);
    return true;
}

/* Energies where the step leads. */
static void survey_block(void *user, uint32_t begin, uint32_t end)
{
    const relaxation *r = user;
    double sum = 0;
    for (uint32_t f = begin; f < end; f += QW_LANES) {
        quads4 q = four_from(r, f, end);
        qw_vec3_lanes p[4], ground[4], line[2];
        at_corners(&q, r->next, p), at_corners(&q, r->next_ground, ground);
        planes at = planes_of(facing_of_four(r, &q, p), p);
        qw_lanes least, energy = qw_quad_energy(&at.q, q.wanted, of_faces(q.face, r->soft), &r->weights, &least);
        energy += lift_energy(r->lift, q.wanted, p, ground);
        if (lines_of_four(r, &q, line)) energy += qw_lines_energy(q.wanted, p, &line[0], &line[1]);
        for (uint32_t k = 0; k < QW_LANES && f + k < end; k++) {
            r->next_energy[f + k] = energy[k], r->next_least[f + k] = least[k];
            sum += energy[k];
        }
    }
    r->sum[begin / GRAIN] = sum;
}

static double sum_blocks(const relaxation *r)
{
    double sum = 0;
    for (uint32_t i = 0; i < qw_block_count(r->quads->face_count, GRAIN); i++) sum += r->sum[i];
    return sum;
}

/* From the planes to the axes of the corners. */
static void turn_model(const planes *at, const qw_vec3_lanes axis[4][2], const qw_relax_model *plane,
                       qw_relax_model *model)
{
    qw_lanes to[4][2][2], half[8][8];
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++) to[i][0][k] = qw_dot4(at->x, axis[i][k]), to[i][1][k] = qw_dot4(at->y, axis[i][k]);
    for (int i = 0; i < 8; i++)
        for (int j = 0; j < 8; j++)
            half[i][j] = plane->matrix[i][j & ~1] * to[j >> 1][0][j & 1] +
                         plane->matrix[i][j | 1] * to[j >> 1][1][j & 1];
    for (int i = 0; i < 8; i++) {
        qw_lanes x = to[i >> 1][0][i & 1], y = to[i >> 1][1][i & 1];
        model->gradient[i] = x * plane->gradient[i & ~1] + y * plane->gradient[i | 1];
        for (int j = 0; j < 8; j++) model->matrix[i][j] = x * half[i & ~1][j] + y * half[i | 1][j];
    }
}

static void axes_at_corners(const relaxation *r, const quads4 *q, qw_vec3_lanes at[4][2])
{
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++)
            at[i][k] = qw_four(r->axis[q->corner[0][i]][k], r->axis[q->corner[1][i]][k], r->axis[q->corner[2][i]][k],
                               r->axis[q->corner[3][i]][k]);
}

/* Softness, energy and model of each quad where it is. Softer where a corner is inverted, by how much it is: so the
   energy there is large but not beyond all measure. */
static void model_block(void *user, uint32_t begin, uint32_t end)
{
    const relaxation *r = user;
    double sum = 0;
    for (uint32_t f = begin; f < end; f += QW_LANES) {
        quads4 q = four_from(r, f, end);
        qw_vec3_lanes p[4], ground[4], axis[4][2], line[2];
        qw_lanes least, soft = qw_lanes_of(SOFT);
        at_corners(&q, r->position, p), at_corners(&q, r->ground, ground);
        axes_at_corners(r, &q, axis);
        planes at = planes_of(vectors_of_faces(q.face, r->facing), p);
        qw_relax_model plane, *model = &r->model[f / QW_LANES];
        qw_lanes energy = qw_quad_energy(&at.q, q.wanted, soft, &r->weights, &least), own = -SOFT_SHARE * least;
        soft = qw_choose(own > soft, own, soft);
        if (qw_any(soft > SOFT)) energy = qw_quad_energy(&at.q, q.wanted, soft, &r->weights, &least);
        energy += lift_energy(r->lift, q.wanted, p, ground);
        qw_quad_energy_model(&at.q, q.wanted, soft, &r->weights, &plane);
        turn_model(&at, axis, &plane, model);
        add_lifts(r->lift, q.wanted, p, ground, axis, model);
        if (lines_of_four(r, &q, line)) {
            energy += qw_lines_energy(q.wanted, p, &line[0], &line[1]);
            qw_add_lines(q.wanted, p, axis, &line[0], &line[1], model);
        }
        for (uint32_t k = 0; k < QW_LANES && f + k < end; k++) {
            r->energy[f + k] = energy[k], r->least[f + k] = least[k], r->soft[f + k] = soft[k];
            sum += energy[k];
        }
    }
    r->sum[begin / GRAIN] = sum;
}

/* ---- frames */

static qw_vec3 curve_direction(const relaxation *r, uint32_t v)
{
    const qw_trimesh *s = r->surface;
    uint32_t h = r->curves.edge[v];
    return qw_normalize(qw_edge_way(s, h));
}

/* Normal and directions of movement of each vertex: two in its plane, one along a curve, none where it is held. */
static void frame_block(void *user, uint32_t begin, uint32_t end)
{
    relaxation *r = user;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 n = {0, 0, 0};
        for (uint32_t k = r->begin[v]; k < r->begin[v + 1]; k++) n = qw_add(n, r->facing[r->around[k] / 4]);
        n = qw_normalize(n);
        if (qw_length2(n) > 0.5f) r->normal[v] = n;
        r->axis[v][0] = r->axis[v][1] = qw_v3(0, 0, 0);
        if (r->held && r->held[v]) continue;
        if (r->curves.edge[v] != QW_NONE) r->axis[v][0] = curve_direction(r, v);
        if (!is_free(r, v) || qw_length2(r->normal[v]) < 0.5f) continue;
        r->axis[v][0] = qw_any_orthogonal(r->normal[v]);
        r->axis[v][1] = qw_cross(r->normal[v], r->axis[v][0]);
    }
}

/* The component of the surface that a vertex of the quads is of: it moves on no other, though that touches it. */
static uint32_t component_of(const relaxation *r, uint32_t v)
{
    return r->quads->component ? r->quads->component[v] : QW_NONE;
}

/* How far, in edge lengths, the surface below a quad is sought: first of the same sheet, then of any. */
static const float BELOW = 0.3f, BELOW_ANY = 4;

/* Where no corner is free, the nearest point with a like normal, or else with any. */
static qw_vec3 reference_at_center(const relaxation *r, uint32_t f)
{
    assert(f < r->quads->face_count);
    qw_quadmesh now = *r->quads;
    now.position = r->position;
    qw_vec3 center = qw_quad_middle(r->position, r->quads->corner + 4 * (size_t)f), own = qw_quad_normal(&now, f);
    float size = sqrtf(r->wanted[f]);
    uint32_t part = component_of(r, r->quads->corner[4 * (size_t)f]);
    qw_hit hit = qw_bvh_nearest_of(r->tree, part, center, own, QW_SAME_SHEET, BELOW * size, QW_NONE);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest_of(r->tree, part, center, own, -1, BELOW_ANY * size, QW_NONE);
    return hit.face == QW_NONE ? own : qw_normalize(qw_face_cross(r->surface, hit.face));
}

static qw_vec3 surface_reference(const relaxation *r, uint32_t f)
{
    qw_vec3 n = {0, 0, 0};
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t v = r->quads->corner[4 * f + i];
        n = qw_add(n, r->ground[v]);
    }
    n = qw_normalize(n);
    return qw_length2(n) > 0.5f ? n : reference_at_center(r, f);
}

/* Its diagonals cross at an angle that is worth the name. */
static bool is_sound(const relaxation *r, uint32_t f, qw_vec3 twice)
{
    const uint32_t *c = r->quads->corner + 4 * (size_t)f;
    float even = qw_distance(r->position[c[0]], r->position[c[2]]),
          odd = qw_distance(r->position[c[1]], r->position[c[3]]);
    return qw_length(twice) > SOUND * even * odd;
}

/* The direction in which each quad should face: its own once it agrees with the surface, else the surface's. */
static void reference_block(void *user, uint32_t begin, uint32_t end)
{
    relaxation *r = user;
    for (uint32_t f = begin; f < end; f++) {
        qw_vec3 own = twice_area(r, f, r->position), n = qw_normalize(own);
        if (!r->face_up[f]) {
            r->reference[f] = surface_reference(r, f);
            r->face_up[f] = is_sound(r, f, own) && qw_dot(n, r->reference[f]) > AGAINST;
        } else if (qw_dot(n, r->reference[f]) < 0) n = qw_scale(n, -1);
        if (r->face_up[f] && qw_length2(n) > 0.5f) r->reference[f] = n;
        r->facing[f] = facing_of(r, f, r->position);
    }
}

static void update_frames(qw_env *env, relaxation *r)
{
    qw_parallel(env, r->quads->face_count, GRAIN, reference_block, r);
    qw_parallel(env, r->quads->vertex_count, GRAIN, frame_block, r);
}

/* ---- steps */

static void put_vertex(relaxation *r, uint32_t v, qw_vec3 point, uint32_t face)
{
    r->next[v] = point;
    r->next_face[v] = face;
    r->next_ground[v] = qw_normalize(qw_face_cross(r->surface, face));
}

/* A walk over the surface from where the vertex lies, if it ends near p on a face that looks the same way: quicker than
   to ask for the nearest point, and it can't change to another sheet. */
static bool slide_vertex(relaxation *r, uint32_t v, qw_vec3 p)
{
    qw_surface_point at = qw_slide_on_surface(r->surface, r->outgoing, 3 * r->face[v], p, 0);
    float near = NEAR_SURFACE * r->size[v];
    qw_vec3 cross = qw_face_cross(r->surface, at.half_edge / 3);
    if (at.distance2 > near * near || !(qw_dot(cross, r->normal[v]) > QW_SAME_SHEET * qw_length(cross))) return false;
    put_vertex(r, v, at.point, at.half_edge / 3);
    return true;
}

/* hint: a face of the surface that may be near, or QW_NONE. */
static void move_vertex(relaxation *r, uint32_t v, uint32_t hint)
{
    qw_vec2 u = r->step[v];
    qw_vec3 p = qw_madd(qw_madd(r->position[v], r->share[v] * u.x, r->axis[v][0]), r->share[v] * u.y, r->axis[v][1]);
    r->next[v] = r->position[v];
    r->next_face[v] = r->face[v];
    r->next_ground[v] = r->ground[v];
    r->next_edge[v] = r->curves.edge[v];
    if (r->share[v] <= 0) return;
    if (r->curves.edge[v] != QW_NONE) {
        r->next[v] = qw_slide_bound(&r->curves, &r->next_edge[v], p);
    } else if (is_free(r, v)) {
        if (r->face[v] != QW_NONE && slide_vertex(r, v, p)) return;
        qw_hit hit = qw_bvh_nearest_of(r->tree, component_of(r, v), p, r->normal[v], QW_SAME_SHEET, 2.0f * r->size[v],
                                       r->face[v] == QW_NONE ? hint : r->face[v]);
        if (hit.face != QW_NONE) put_vertex(r, v, hit.point, hit.face);
    }
}

static void move_block(void *user, uint32_t begin, uint32_t end)
{
    relaxation *r = user;
    for (uint32_t v = begin, hint = QW_NONE; v < end; v++) { /* neighbours follow one another */
        if (!r->moves[v]) continue;
        move_vertex(r, v, hint);
        hint = r->next_face[v];
    }
}

static bool turns_over(const relaxation *r, uint32_t f)
{
    if (r->least[f] > 0 && r->next_least[f] < LEAST_CORNER && r->next_least[f] < r->least[f]) return true;
    return r->next_energy[f] > MOST_RISE * (r->energy[f] + 1);
}

static void find_turned(qw_env *env, void *user, uint8_t *is_worse)
{
    relaxation *r = user;
    qw_parallel(env, r->quads->vertex_count, GRAIN, move_block, r);
    qw_parallel(env, r->quads->face_count, GRAIN, survey_block, r);
    memset(r->moves, 0, r->quads->vertex_count);
    for (uint32_t f = 0; f < r->quads->face_count; f++) is_worse[f] = turns_over(r, f);
}

static void go_back(void *user, uint32_t v, float share)
{
    relaxation *r = user;
    r->share[v] = share, r->moves[v] = 1;
}

/* Steps as far as can be without turning a corner over; whether that lowers the energy. */
static bool try_step(qw_env *env, relaxation *r, double energy, double *after)
{
    assert(r->moves && r->share && after);
    memset(r->moves, 1, r->quads->vertex_count);
    bool is_sound = qw_go_back(env, &(qw_going_back){r->quads, false, r, find_turned, go_back}, NULL);
    *after = sum_blocks(r);
    return is_sound && *after < energy;
}

/* The next positions become the current ones. */
static void take_step(relaxation *r)
{
    assert(r->position != r->next && r->face != r->next_face);
    qw_vec3 *p = r->position;
    r->position = r->next, r->next = p;
    uint32_t *f = r->face;
    r->face = r->next_face, r->next_face = f;
    qw_vec3 *g = r->ground;
    r->ground = r->next_ground, r->next_ground = g;
    uint32_t *e = r->curves.edge;
    r->curves.edge = r->next_edge, r->next_edge = e;
}

/* The step that the model asks for, no longer than the plane of a vertex is to be trusted. */
static void clamp_block(void *user, uint32_t begin, uint32_t end)
{
    relaxation *r = user;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec2 u = r->system.x[v];
        float length = sqrtf(u.x * u.x + u.y * u.y), most = LONGEST_STEP * r->size[v],
              k = length > most ? most / length : 1;
        r->step[v] = (qw_vec2){k * u.x, k * u.y};
        r->share[v] = 1;
    }
}

/* Gauss-Newton steps with damping, until one gains too little or too many are rejected. */
static void descend(qw_env *env, relaxation *r)
{
    assert(r->begin && r->around && r->wanted);
    r->system = qw_relax_system_create(env, r->quads, r->begin, r->around);
    float damping = DAMPING;
    update_frames(env, r);
    if (r->lines.along) qw_find_relax_lines(env, &r->lines, r->position);
    for (int i = 0, rejected = 0; i < STEPS && rejected < REJECTIONS; i++) {
        qw_parallel(env, r->quads->face_count, GRAIN, model_block, r);
        double before = sum_blocks(r), after;
        qw_relax_system_fill(env, &r->system, r->model, r->axis, damping);
        qw_relax_system_solve(env, &r->system, SOLVED, SOLVE_MOST);
        qw_parallel(env, r->quads->vertex_count, GRAIN, clamp_block, r);
        qw_progress(env, (i + 1.0) / STEPS);
        if (!try_step(env, r, before, &after)) {
            rejected++;
            damping *= 10;
            continue;
        }
        take_step(r);
        update_frames(env, r);
        if (after > (1 - ENOUGH) * before) break;
        if (r->lines.along) qw_find_relax_lines(env, &r->lines, r->position);
    }
}

/* ---- what is given */

static float area_of(const relaxation *r, uint32_t f) { return 0.5f * qw_length(twice_area(r, f, r->position)); }

/* Where there are many times more or fewer quads than wanted, as in parts that had to be made finer than was asked for,
   no sliding of vertices gets them the wanted area, and trying spoils them. Sets size as well. */
static void limit_wanted(qw_env *env, relaxation *r)
{
    assert(r->wanted && r->begin);
    uint32_t n = r->quads->vertex_count, faces = r->quads->face_count;
    float *at_face = QW_NEW(env, float, faces), *at_vertex = QW_NEW(env, float, n);
    for (uint32_t f = 0; f < faces; f++) at_face[f] = area_of(r, f);
    for (int pass = 0; pass < SPREADS; pass++) {
        for (uint32_t v = 0; v < n; v++) {
            at_vertex[v] = 0;
            uint32_t count = r->begin[v + 1] - r->begin[v];
            for (uint32_t k = r->begin[v]; k < r->begin[v + 1]; k++)
                at_vertex[v] += at_face[r->around[k] / 4] / (float)count;
        }
        for (uint32_t f = 0; f < faces; f++) {
            const uint32_t *c = r->quads->corner + 4 * (size_t)f;
            at_face[f] = 0.25f * (at_vertex[c[0]] + at_vertex[c[1]] + at_vertex[c[2]] + at_vertex[c[3]]);
        }
    }
    for (uint32_t f = 0; f < faces; f++)
        if (at_face[f] > 0) r->wanted[f] = fminf(fmaxf(r->wanted[f], at_face[f] / OFF_BY), at_face[f] * OFF_BY);
    for (uint32_t v = 0; v < n; v++) r->size[v] = sqrtf(at_vertex[v]);
    qw_free(env, at_face), qw_free(env, at_vertex);
}

/* Onto the surface: the only move that may turn a corner over. */
static void settle(qw_env *env, relaxation *r)
{
    uint32_t n = r->quads->vertex_count, faces = r->quads->face_count;
    qw_quadmesh now = *r->quads;
    now.position = r->position;
    qw_vec3 *normal = qw_quadmesh_vertex_normals(env, &now);
    memcpy(r->normal, normal, n * sizeof *normal);
    qw_free(env, normal);
    r->curves = qw_bind_curves(env, r->quads, r->surface, r->size, r->position);
    memset(r->face, 0xff, n * sizeof *r->face);
    memset(r->axis, 0, n * sizeof *r->axis);
    memset(r->step, 0, n * sizeof *r->step);
    memset(r->reference, 0, faces * sizeof *r->reference);
    for (uint32_t v = 0; v < n; v++) r->share[v] = 1;
    memset(r->moves, 1, n);
    qw_parallel(env, n, GRAIN, move_block, r);
    take_step(r);
}

/* Vertices that never came down, as each step there would have turned a quad over, go to the nearest point of the
   surface whichever way it looks; false where there are none. */
static bool land(relaxation *r)
{
    bool any = false;
    for (uint32_t v = 0; v < r->quads->vertex_count; v++) {
        if (!is_free(r, v) || r->face[v] != QW_NONE) continue;
        qw_hit hit = qw_bvh_nearest_of(r->tree, component_of(r, v), r->position[v], qw_v3(0, 0, 0), -1, INFINITY,
                                       QW_NONE);
        if (hit.face == QW_NONE) continue;
        r->position[v] = hit.point, r->face[v] = hit.face,
        r->ground[v] = qw_normalize(qw_face_cross(r->surface, hit.face));
        any = true;
    }
    return any;
}

/* The triangle where v was last seen to lie, if it still does: untangling moves vertices without saying where to. */
static uint32_t place_of(const relaxation *r, uint32_t v)
{
    assert(v < r->quads->vertex_count);
    uint32_t h = r->curves.edge[v], f = h != QW_NONE ? h / 3 : r->face[v];
    if (f == QW_NONE) return QW_NONE;
    const uint32_t *c = r->surface->corner + 3 * (size_t)f;
    const qw_vec3 *p = r->surface->position;
    return qw_triangle_distance2(p[c[0]], p[c[1]], p[c[2]], r->position[v]) <=
                   ON_PLACE * ON_PLACE * r->size[v] * r->size[v]
               ? f
               : QW_NONE;
}

/* Which quads of the result are cut along their other diagonal: turn, uint8_t[quads]. */
static void choose_diagonals(qw_env *env, const relaxation *r, uint8_t *turn)
{
    assert(turn && r->curves.edge);
    qw_quadmesh now = *r->quads;
    now.position = r->position;
    uint32_t *place = QW_NEW(env, uint32_t, now.vertex_count);
    for (uint32_t v = 0; v < now.vertex_count; v++) place[v] = place_of(r, v);
    qw_choose_diagonals(env, &now, r->surface, r->outgoing, r->tree, place, turn);
    for (uint32_t f = 0; f < now.face_count; f++) qw_did(env, QW_MECH_DIAGONALS, turn[f] != 0);
    qw_free(env, place);
}

/* Areas alone don't hold a quad up: where right angles count less than this leaves them it leans without bound. */
static const float MOST_EVENNESS = 0.9f;

/* How much a direction says about each quad: it is that of the surface at the scale of the quads that were asked for,
   and says little about smaller ones. */
static const float *shares_of(qw_env *env, const relaxation *r, const float *asked)
{
    float *share = QW_NEW(env, float, r->quads->face_count);
    for (uint32_t f = 0; f < r->quads->face_count; f++) share[f] = asked[f] > 0 ? fminf(r->wanted[f] / asked[f], 1) : 0;
    return share;
}

static float weight_in(weight_range range, const qw_relax_target *target)
{
    float share = target->direction ? fminf(target->follow / (float)QW_USUAL_FOLLOW, 1) : 0;
    return range.plain + share * (range.following - range.plain);
}

/* Vertices that are held are as good as corners. */
static uint8_t *kinds_with_held(qw_env *env, const relaxation *r)
{
    const qw_quadmesh *q = r->quads;
    if (!r->held || !q->kind) return q->kind;
    uint8_t *kind = QW_NEW(env, uint8_t, q->vertex_count);
    for (uint32_t v = 0; v < q->vertex_count; v++) kind[v] = r->held[v] ? QW_VERTEX_CORNER : q->kind[v];
    return kind;
}

qw_vec3 *qw_relax_quads(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const qw_relax_target *target)
{
    assert(quads->twin && surface->twin && surface->face_count > 0 && target->evenness >= 0);
    qw_scope_begin(env);
    uint32_t n = quads->vertex_count, faces = quads->face_count;
    relaxation r = {.quads = quads, .held = target->held, .surface = surface};
    float evenness = fminf(fmaxf(target->evenness, 0), MOST_EVENNESS);
    r.weights = (qw_relax_weights){(1 - evenness) * weight_in(CONFORMAL, target),
                                   (1 - evenness) * weight_in(SQUARE, target), 2 * evenness};
    r.lift = weight_in(LIFT, target);
    r.tree = target->tree ? target->tree : qw_bvh_build(env, surface), r.outgoing = qw_trimesh_outgoing(env, surface);
    r.position = QW_NEW(env, qw_vec3, n), r.next = QW_NEW(env, qw_vec3, n), r.normal = QW_NEW(env, qw_vec3, n);
    r.axis = qw_alloc(env, n, sizeof *r.axis);
    r.face = QW_NEW(env, uint32_t, n), r.next_face = QW_NEW(env, uint32_t, n), r.next_edge = QW_NEW(env, uint32_t, n);
    r.ground = QW_NEW_ZERO(env, qw_vec3, n), r.next_ground = QW_NEW(env, qw_vec3, n);
    r.size = QW_NEW(env, float, n), r.share = QW_NEW(env, float, n), r.moves = QW_NEW(env, uint8_t, n),
    r.step = QW_NEW(env, qw_vec2, n);
    r.reference = QW_NEW(env, qw_vec3, faces), r.facing = QW_NEW(env, qw_vec3, faces);
    r.model = QW_NEW(env, qw_relax_model, faces / QW_LANES + 1);
    r.least = QW_NEW(env, float, faces), r.next_least = QW_NEW(env, float, faces), r.soft = QW_NEW(env, float, faces);
    r.face_up = QW_NEW_ZERO(env, uint8_t, faces), r.energy = QW_NEW(env, float, faces),
    r.next_energy = QW_NEW(env, float, faces);
    r.sum = QW_NEW_ZERO(env, double, (size_t)qw_block_count(faces, GRAIN) + 1);
    memcpy(r.position, quads->position, n * sizeof *r.position);
    r.around = qw_group(env, r.quads->corner, 4 * r.quads->face_count, r.quads->vertex_count, &r.begin);
    bool has_lines = target->direction && target->follow > 0;
    const qw_bvh *near = target->near;
    if (has_lines && !near) near = qw_bvh_build(env, target->mesh);
    uint32_t *found = QW_NEW(env, uint32_t, faces);
    r.wanted = qw_areas_wanted_of(env, quads, &(qw_wanted){target->mesh, target->size, near, found});
    qw_fit_wanted_areas(env, quads, r.wanted);
    float *asked = QW_NEW(env, float, faces);
    memcpy(asked, r.wanted, faces * sizeof *asked);
    limit_wanted(env, &r);
    settle(env, &r);
    if (has_lines)
        r.lines = qw_begin_relax_lines(env, quads, target->mesh, near, target->direction, LINES * target->follow,
                                       shares_of(env, &r, asked));
    r.lines.near = found;
    descend(env, &r);
    if (qw_uses(env, QW_MECH_LAND) && land(&r)) descend(env, &r), qw_did(env, QW_MECH_LAND, 1);
    qw_quadmesh now = *quads;
    now.position = r.position, now.kind = kinds_with_held(env, &r);
    qw_flip_repair repair = {.surface = surface, .tree = r.tree, .curves = &r.curves, .ground = r.ground};
    if (!target->leaves_flips)
        qw_repair_flips(env, &now, &repair, target->flipped ? target->flipped : QW_NEW(env, uint8_t, faces));
    if (target->turn && qw_uses(env, QW_MECH_DIAGONALS)) choose_diagonals(env, &r, target->turn);
    qw_keep(env, r.position);
    qw_scope_end(env);
    return r.position;
}
