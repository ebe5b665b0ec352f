#include "remesh/working/working.h"

#include "base/constants.h"
#include "remesh/working/cluster.h"
#include "geometry/corners.h"
#include "remesh/working/passes.h"

#include <assert.h>
#include <string.h>

/* Botsch and Kobbelt, A Remeshing Approach to Multiresolution Modeling (2004): these two bounds make an edge's halves,
   or what a collapse makes of its neighbours, better than the edge was. In target lengths. */
#define LONG  (4.0f / 3.0f)
#define SHORT (4.0f / 5.0f)

/* Coarsening: growth of the length below which edges collapse, from pass to pass; the first pass takes edges of this
   share of the length before the first; and the least mean edge, in targets, that it begins at. */
#define COARSER         1.6f
#define FIRST_COLLAPSED 0.25f
#define SHORTEST_MEAN   1e-3
/* In target lengths: edges that the last round collapses; what it leaves short no later round makes even. */
#define LAST_SHORT      0.6f
/* Cells of the clusters of a dense surface, in lengths that it is condensed to. */
#define CLUSTERED       0.7f

/* Slivers are merged where cutting each by itself would make this many times the faces that are needed: ordinary
   surfaces are below 2, fans of some hundred slivers above 10. */
#define MUCH_CUT 4

/* An edge still shorter than this after coarsening could not be collapsed; see grade_targets. In target lengths. */
#define STUCK       0.35f
#define LEAST_SCALE (1.0f / 32)
#define GRADING     0.4f

/* What single precision leaves of a frame of diagonal 1; no target is lowered below it. */
#define RESOLUTION 2e-6f

enum {
    LEAST_FACES = 40,       /* of a component, so that its shape and topology have room */
    LEAST_COARSEST = 12,    /* likewise, of one whose triangles are paired at once */
    LEAST_CONDENSED = 1500, /* likewise, of a condensed one: as many as 24 quads have there */
    ROUNDS = 3,             /* of split, collapse, flip, smooth: with two, distortion at 1,000 quads is 3 % worse */
    MAX_GRADING_SWEEPS = 64,
    MAX_REFINE_PASSES = 200 /* each halves the longest edge; some ten more settle what flips have lengthened */
};

/* ---- prepare */

/* Of each component: float[census->components]. */
static float *longest_edges2(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    float *longest2 = QW_NEW_ZERO(env, float, (size_t)census->components);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        const uint32_t *c = mesh->corner + 3 * (size_t)f;
        float *most2 = &longest2[census->component[f]];
        for (uint32_t i = 0; i < 3; i++) {
            float length2 = qw_length2(qw_sub(mesh->position[c[i]], mesh->position[c[(i + 1) % 3]]));
            *most2 = length2 > *most2 ? length2 : *most2;
        }
    }
    return longest2;
}

/* A component with fewer than least_faces triangles of the target size gets smaller targets. */
static void limit_targets(qw_env *env, const qw_trimesh *mesh, const qw_census *census, uint32_t least_faces,
                          const float *wanted, float *target, float *base_target)
{
    assert(wanted && target);
    double *room = QW_NEW_ZERO(env, double,
                               (size_t)census->components); /* in equilateral triangles of the target size */
    bool limited = false;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (!(wanted[v] > 0)) qw_fail(env, QW_INTERNAL, v, "the target length at vertex %u is not positive", v);
        target[v] = wanted[v];
    }
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        const uint32_t *c = mesh->corner + 3 * (size_t)f;
        double t = (wanted[c[0]] + wanted[c[1]] + wanted[c[2]]) / 3.0;
        room[census->component[f]] += qw_length(qw_face_cross(mesh, f)) / (2 * QW_EQUILATERAL_AREA * t * t);
    }
    for (int64_t k = 0; k < census->components; k++) limited |= !(room[k] >= least_faces);
    if (!limited) return;
    const float *longest2 = longest_edges2(env, mesh, census);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t k = census->component[f];
        if (room[k] >= least_faces) continue;
        float scale = (float)sqrt(room[k] / least_faces);
        float least = fmaxf(sqrtf(longest2[k]) / 16, RESOLUTION); /* without area there is no scale to find */
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t v = mesh->corner[3 * f + i];
            target[v] = fminf(wanted[v], fmaxf(wanted[v] * scale, least));
            if (base_target) base_target[v] = target[v]; /* it is small as a whole */
        }
    }
}

/* Cosine of the most that a curve may turn at a vertex inside it, 35 degrees: less than QW_CORNER_ANGLE, so that the
   working mesh keeps every corner of the quads where it was. */
static const float KEPT_COSINE = 0.819f;

/* The first curve vertex at least `distance` away from v when leaving through its neighbour `to`; v where the curve
 * returns first. */
static uint32_t walk_curve(const qw_trimesh *mesh, const qw_curve_ends *ends, uint32_t v, uint32_t to, float distance)
{
    assert(v < mesh->vertex_count && to < mesh->vertex_count);
    uint32_t before = v;
    while (to != v && ends[to].count == 2 && qw_distance(mesh->position[v], mesh->position[to]) < distance) {
        uint32_t next = qw_curve_beyond(ends, before, to);
        before = to;
        to = next;
    }
    return to;
}

/* A corner turns between its two edges, and still so between the points half a target away: that keeps the jags of a
   scanned boundary from being held for corners. */
static qw_vertex_kind kind_of(const qw_trimesh *mesh, const qw_curve_ends *ends, uint32_t v, float target)
{
    assert(v < mesh->vertex_count);
    if (ends[v].count == 0) return QW_VERTEX_FREE;
    if (!qw_is_curve_corner(mesh, ends, v, KEPT_COSINE)) return QW_VERTEX_CURVE;
    if (qw_curves_end_at(&ends[v])) return QW_VERTEX_CORNER;
    uint32_t a = walk_curve(mesh, ends, v, ends[v].other[0], 0.5f * target),
             b = walk_curve(mesh, ends, v, ends[v].other[1], 0.5f * target);
    if (a == v || b == v) return QW_VERTEX_CURVE; /* the rim of a pinhole */
    return qw_turns_sharply(mesh->position[a], mesh->position[v], mesh->position[b], KEPT_COSINE) ? QW_VERTEX_CORNER
                                                                                                  : QW_VERTEX_CURVE;
}

/* Sets kind and, on curves, home of every vertex. rank: where the mesh's vertices are in e; stop:
 * uint8_t[mesh->vertex_count]. */
static void find_curves(qw_env *env, const qw_trimesh *mesh, const uint32_t *rank, qw_edit *e, uint8_t *stop)
{
    assert(e->vertex_count == mesh->vertex_count && stop);
    qw_curve_ends *ends = qw_find_curve_ends(env, mesh, true);
    uint32_t *curve = QW_NEW(env, uint32_t, mesh->vertex_count); /* a curve half-edge that starts or ends here */
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (qw_is_curve_edge(mesh, h, true)) curve[mesh->corner[h]] = curve[mesh->corner[qw_next(h)]] = h;
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        qw_edit_vertex *to = &e->vertex[rank[v]];
        to->kind = (uint8_t)kind_of(mesh, ends, v, to->target);
        if (mesh->point && mesh->point[v]) to->kind = QW_VERTEX_CORNER;
        if (to->kind == QW_VERTEX_CURVE) to->home = curve[v];
        stop[v] = to->kind == QW_VERTEX_CORNER;
    }
    qw_free(env, ends), qw_free(env, curve);
}

/* ---- phases */

/* The mean length of edges, one of each face, and the greatest square of any, in target lengths. */
typedef struct lengths {
    const qw_edit *edit;
    double *sum;  /* [blocks] */
    float *most2; /* [blocks] */
} lengths;

static void sum_block(void *user, uint32_t begin, uint32_t end)
{
    const lengths *l = user;
    double sum = 0;
    for (uint32_t f = begin; f < end; f++)
        if (!qw_edit_dead(l->edit, f)) sum += sqrtf(qw_edge_ratio2(l->edit, 4 * f));
    l->sum[begin / QW_GRAIN_LIGHT] = sum;
}

static double mean_edge(const qw_edit *e)
{
    uint32_t blocks = qw_block_count(e->face_count, QW_GRAIN_LIGHT);
    lengths l = {.edit = e, .sum = QW_NEW(e->env, double, blocks)};
    qw_parallel(e->env, e->face_count, QW_GRAIN_LIGHT, sum_block, &l);
    double sum = 0;
    for (uint32_t b = 0; b < blocks; b++) sum += l.sum[b];
    qw_free(e->env, l.sum);
    return sum / (e->live_faces ? e->live_faces : 1);
}

/* The longest edge of a block, in target lengths, squared. */
static void most_block(void *user, uint32_t begin, uint32_t end)
{
    const lengths *l = user;
    float most2 = 0;
    for (uint32_t h = 4 * begin; h < 4 * end; h++) {
        if ((h & 3) == 3 || qw_edit_dead(l->edit, h >> 2) || !qw_is_first_side(l->edit, h)) continue;
        float length2 = qw_edge_ratio2(l->edit, h);
        most2 = length2 > most2 ? length2 : most2;
    }
    l->most2[begin / QW_GRAIN_LIGHT] = most2;
}

static float longest_of_all2(const qw_edit *e)
{
    uint32_t blocks = qw_block_count(e->face_count, QW_GRAIN_LIGHT);
    lengths l = {.edit = e, .most2 = QW_NEW(e->env, float, blocks)};
    qw_parallel(e->env, e->face_count, QW_GRAIN_LIGHT, most_block, &l);
    float most2 = 0;
    for (uint32_t b = 0; b < blocks; b++) most2 = fmaxf(most2, l.most2[b]);
    qw_free(e->env, l.most2);
    return most2;
}

/* From the shortest edges upward, so that the mesh stays even on the way. */
static void coarsen(qw_reshape *r, qw_pass p)
{
    qw_edit *e = &r->edit;
    double mean = mean_edge(e);
    float below = SHORT;
    while (below / COARSER >= (float)fmax(mean, SHORTEST_MEAN)) below /= COARSER;
    qw_collapse_pass(r, FIRST_COLLAPSED * below / COARSER, LONG * below / SHORT, p);
    for (;; below = fminf(COARSER * below, SHORT)) {
        qw_collapse_pass(r, below, LONG * below / SHORT, p);
        if (below >= SHORT) break;
        if (2 * e->live_faces < e->face_count) qw_edit_pack(e); /* blocks of full size again */
    }
    qw_edit_pack(e);
}

/* A handle or a protrusion much thinner than the target keeps its short edges. Without this, long thin triangles would
   join them to their surroundings: the target is lowered to them, and grows from there by GRADING of the way. */
static void grade_targets(qw_edit *e)
{
    bool any = false;
    for (uint32_t f = 0; f < e->face_count; f++)
        for (uint32_t h = 4 * f; h < 4 * f + 3; h++) {
            qw_edit_vertex *a = &e->vertex[qw_edit_tail(e, h)], *b = &e->vertex[qw_edit_head(e, h)];
            if (!qw_is_first_side(e, h) || a->kind != QW_VERTEX_FREE || b->kind != QW_VERTEX_FREE) continue;
            float length = qw_distance(a->position, b->position),
                  least = fmaxf(length / SHORT, fmaxf(a->target, b->target) * LEAST_SCALE);
            if (length > STUCK * fminf(a->target, b->target) || qw_edit_can_collapse(e, h)) continue;
            a->target = fminf(a->target, least);
            b->target = fminf(b->target, least);
            any = true;
        }
    for (uint32_t sweep = 0; any && sweep < MAX_GRADING_SWEEPS; sweep++) {
        any = false;
        for (uint32_t f = 0; f < e->face_count; f++)
            for (uint32_t h = 4 * f; h < 4 * f + 3; h++) {
                qw_edit_vertex *a = &e->vertex[qw_edit_tail(e, h)], *b = &e->vertex[qw_edit_head(e, h)];
                float most = a->target + GRADING * qw_distance(a->position, b->position);
                if (b->target > most) b->target = most, any = true;
            }
    }
}

/* Faces that the surface needs where edges are one target long, those of them that curves need, and those that arise if
   each face is cut by itself. */
typedef struct face_need {
    double needed, curves, cut;
} face_need;

/* How many faces the surface needs at its targets: by area, by length of curves, and if each sliver is cut by
 * itself. */
static face_need count_needed(const qw_edit *e)
{
    face_need sum = {0, 0, 0};
    for (uint32_t f = 0; f < e->face_count; f++) {
        if (qw_edit_dead(e, f)) continue;
        const uint32_t *c = e->face[f].corner;
        const qw_edit_vertex *a = &e->vertex[c[0]], *b = &e->vertex[c[1]], *d = &e->vertex[c[2]];
        double t = (a->target + b->target + d->target) / 3.0;
        qw_vec3 cross = qw_cross(qw_sub(b->position, a->position), qw_sub(d->position, a->position));
        double room = qw_length(cross) / (2 * QW_EQUILATERAL_AREA * t * t);
        float longest2;
        qw_longest_edge(e, f, &longest2);
        sum.needed += room;
        sum.cut += fmax(room, sqrtf(longest2));
        for (uint32_t h = 4 * f; h < 4 * f + 3; h++)
            if (qw_edit_on_curve(e, h)) sum.curves += sqrtf(qw_edge_ratio2(e, h));
    }
    sum.needed += sum.curves;
    return sum;
}

/* Refinement would cut the slivers of a fan each by itself, as no flip joins them. So coarsening goes on beyond the
   target, as long as surface and curves are kept, until that is no waste; curves get their vertices back. */
static void merge_slivers(qw_reshape *r, qw_pass p)
{
    qw_edit *e = &r->edit;
    float longest = sqrtf(longest_of_all2(e));
    for (float below = COARSER * SHORT; below < longest; below *= COARSER) {
        face_need need = count_needed(e);
        if (!(need.cut > MUCH_CUT * need.needed)) break;
        qw_collapse_pass(r, below, LONG * below / SHORT, p);
    }
    if (e->live_faces < e->face_count) qw_edit_pack(e);
}

/* Grades targets, but not where needles, whose short edges are no thin parts, would make a crowd of that. */
static void grade_unless_cut(qw_edit *e)
{
    double before = count_needed(e).cut;
    float *target = QW_NEW(e->env, float, e->vertex_count);
    for (uint32_t v = 0; v < e->vertex_count; v++) target[v] = e->vertex[v].target;
    grade_targets(e);
    bool much_cut = count_needed(e).cut > MUCH_CUT * fmax(before, LEAST_CONDENSED);
    for (uint32_t v = 0; much_cut && v < e->vertex_count; v++) e->vertex[v].target = target[v];
    qw_free(e->env, target);
}

/* Faces that the surface needs where edges are `above` targets long, of `all` at the beginning. */
static double needed_above(const face_need *need, uint32_t all, float above)
{
    double lines = need->curves + need->cut;
    return all + lines / (double)above + need->needed / ((double)above * (double)above);
}

/* From the longest edges downward, Delaunay on the way, so that huge triangles are not cut into slivers. Halving the
   edges of a needle leaves vertices side by side; where these are a crowd they are drawn together on the way. */
static void refine(qw_reshape *r, qw_pass p)
{
    qw_edit *e = &r->edit;
    const face_need need = count_needed(e);
    uint32_t all = e->live_faces;
    float above = fmaxf(0.5f * sqrtf(longest_of_all2(e)), LONG);
    for (uint32_t pass = 0; pass < MAX_REFINE_PASSES; pass++, above = fmaxf(0.5f * above, LONG)) {
        uint32_t split = qw_split_pass(r, above, p);
        if (split > e->live_faces / 16) qw_flip_pass(r, p);
        if (split > 0 && e->live_faces > MUCH_CUT * needed_above(&need, all, above))
            qw_collapse_pass(r, SHORT * above / LONG, above, p);
        if (above <= LONG && split == 0) break;
    }
}

/* Rounds of splits, collapses, flips and smoothing, until edges are near to their targets. */
static void even_out(qw_reshape *r, qw_pass p)
{
    double step = (p.to - p.from) / ROUNDS;
    r->avoid_chords = true;
    for (uint32_t i = 0; i < ROUNDS; i++) {
        p.from += i ? step : 0;
        p.to = p.from + step;
        qw_split_pass(r, LONG, p);
        qw_split_between_curves(r, p);
        qw_collapse_pass(r, i + 1 < ROUNDS ? SHORT : LAST_SHORT, LONG, p);
        qw_flip_pass(r, p);
        qw_sliver_pass(r, p);
        qw_smooth_pass(r, p);
        qw_flip_pass(r, p);
    }
}

/* least_faces: see limit_targets. base_target: float[input->vertex_count], which is limited likewise, or NULL. */
static qw_reshape open_surface(qw_env *env, const qw_trimesh *input, const qw_census *census, uint32_t least_faces,
                               const float *wanted, float *base_target)
{
    assert(input->twin && wanted);
    uint32_t *outgoing = qw_trimesh_outgoing(env, input), *rank;
    uint8_t *stop = QW_NEW(env, uint8_t, input->vertex_count);
    float *target = QW_NEW(env, float, input->vertex_count);
    limit_targets(env, input, census, least_faces, wanted, target, base_target);
    qw_reshape r = {.input = input, .input_outgoing = outgoing, .input_stop = stop, .base_target = base_target};
    r.edit = qw_edit_open_packed(env, input, target, outgoing, &rank);
    find_curves(env, input, rank, &r.edit, stop);
    qw_free(env, rank), qw_free(env, target);
    return r;
}

/* Where each face goes so that those of the first component come first, and those of one stay in their order:
   uint32_t[mesh->face_count]. NULL: there already. */
static uint32_t *order_components(const qw_reshape *r, const qw_census *census, const qw_trimesh *mesh)
{
    qw_env *env = r->edit.env;
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)census->components + 1),
             *to = QW_NEW(env, uint32_t, mesh->face_count), last = 0;
    bool ordered = true;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t c = census->component[r->edit.vertex[mesh->corner[3 * (size_t)f]].home / 3];
        begin[c + 1]++, to[f] = c;
        ordered &= c >= last, last = c;
    }
    for (int64_t c = 0; c < census->components; c++) begin[c + 1] += begin[c];
    for (uint32_t f = 0; f < mesh->face_count; f++) to[f] = begin[to[f]]++;
    qw_free(env, begin);
    if (!ordered) return to;
    qw_free(env, to);
    return NULL;
}

/* Components keep their numbers, which are in the order of their first faces. */
static void sort_components(const qw_reshape *r, const qw_census *census, qw_trimesh *mesh)
{
    qw_env *env = r->edit.env;
    size_t sides = 3 * (size_t)mesh->face_count;
    uint32_t *to = order_components(r, census, mesh);
    if (!to) return;
    qw_trimesh sorted = *mesh;
    sorted.corner = QW_NEW(env, uint32_t, sides), sorted.twin = QW_NEW(env, uint32_t, sides);
    sorted.mark = mesh->mark ? QW_NEW(env, uint8_t, sides) : NULL;
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t g = 3 * to[h / 3] + h % 3, t = mesh->twin[h];
        sorted.corner[g] = mesh->corner[h], sorted.twin[g] = t == QW_NONE ? QW_NONE : 3 * to[t / 3] + t % 3;
        if (mesh->mark) sorted.mark[g] = mesh->mark[h];
    }
    qw_free(env, to), qw_free(env, mesh->corner), qw_free(env, mesh->twin), qw_free(env, mesh->mark);
    *mesh = sorted;
}

/* The mesh that was made, and its points: corners do not move. */
static qw_trimesh close_surface(qw_reshape *r, const qw_census *census, float **target)
{
    assert(target && r->edit.env);
    qw_trimesh mesh = qw_edit_close(&r->edit, target);
    if (census->components > 1) sort_components(r, census, &mesh);
    const qw_trimesh *input = r->input;
    if (!input->point) return mesh;
    mesh.point = QW_NEW_ZERO(r->edit.env, uint8_t, mesh.vertex_count);
    for (uint32_t v = 0; v < mesh.vertex_count; v++) {
        const qw_edit_vertex *from = &r->edit.vertex[v];
        mesh.point[v] = from->kind == QW_VERTEX_CORNER && input->point[input->corner[from->home]];
    }
    return mesh;
}

/* What is much finer than `length` is clustered first. Sets *length to that at its vertices, and *census of it as far
   as components go; *clustered: the surface. */
static const qw_trimesh *cluster_dense(qw_env *env, const qw_trimesh *input, qw_census *census, const float **length,
                                       qw_clustered *clustered)
{
    float *cell = QW_NEW(env, float, input->vertex_count);
    limit_targets(env, input, census, LEAST_CONDENSED, *length, cell, NULL);
    for (uint32_t v = 0; v < input->vertex_count; v++) cell[v] *= CLUSTERED;
    bool dense = qw_cluster(env, input, census->component, (uint32_t)census->components, cell, clustered);
    qw_free(env, cell);
    if (!dense) return input;
    qw_log(env, QW_LOG_DEBUG, "clustered to %u triangles", clustered->mesh.face_count);
    float *at = QW_NEW(env, float, clustered->mesh.vertex_count);
    for (uint32_t v = 0; v < clustered->mesh.vertex_count; v++) at[v] = (*length)[clustered->origin[v]];
    *length = at, census->component = clustered->component;
    return &clustered->mesh;
}

qw_trimesh qw_condensed_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, const float *length)
{
    assert(input->twin && census->component && length);
    qw_scope_begin(env);
    float *target;
    qw_census of = *census;
    qw_clustered clustered;
    const qw_trimesh *surface = cluster_dense(env, input, &of, &length, &clustered);
    qw_reshape r = open_surface(env, surface, &of, LEAST_CONDENSED, length, NULL);
    coarsen(&r, (qw_pass){env, 0, 1});
    qw_trimesh mesh = close_surface(&r, &of, &target);
    qw_keep(env, mesh.position), qw_keep(env, mesh.corner), qw_keep(env, mesh.twin), qw_keep(env, mesh.mark);
    qw_keep(env, mesh.point);
    qw_scope_end(env);
    return mesh;
}

qw_trimesh qw_evenly_condensed_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, double length)
{
    assert(length > 0);
    if (input->face_count <= qw_trimesh_area(input) / (QW_EQUILATERAL_AREA * length * length)) return *input;
    float *everywhere = QW_NEW(env, float, input->vertex_count);
    for (uint32_t v = 0; v < input->vertex_count; v++) everywhere[v] = (float)length;
    qw_trimesh mesh = qw_condensed_mesh(env, input, census, everywhere);
    qw_free(env, everywhere);
    return mesh;
}

/* The working mesh: coarsened, cut, refined and smoothed. wanted: float[vertices] or NULL; base_target:
 * float[vertices] or NULL. */
static qw_working make_working(qw_env *env, const qw_trimesh *input, const qw_census *census, uint32_t least_faces,
                               const float *wanted, const float *base_target)
{
    qw_working result;
    qw_scope_begin(env);
    float *limited = base_target ? QW_NEW(env, float, input->vertex_count) : NULL;
    if (base_target) memcpy(limited, base_target, input->vertex_count * sizeof *limited);
    qw_reshape r = open_surface(env, input, census, least_faces, wanted, limited);
    coarsen(&r, (qw_pass){env, 0, 0.5});
    merge_slivers(&r, (qw_pass){env, 0.5, 0.5});
    grade_unless_cut(&r.edit);
    uint32_t packed = r.edit.vertex_count;
    refine(&r, (qw_pass){env, 0.5, 0.6});
    if (r.edit.vertex_count > packed + packed / 4) qw_edit_pack(&r.edit); /* what was added lies anywhere */
    even_out(&r, (qw_pass){env, 0.6, 0.95});
    qw_split_short_curves(&r, (qw_pass){env, 0.95, 1});
    qw_free_faces(&r, (qw_pass){env, 0.95, 1});
    qw_smooth_pass(&r, (qw_pass){env, 0.95, 1});
    qw_edit_pack(&r.edit);
    result.mesh = close_surface(&r, census, &result.target);
    qw_keep(env, result.mesh.position);
    qw_keep(env, result.mesh.corner);
    qw_keep(env, result.mesh.twin);
    qw_keep(env, result.mesh.mark);
    qw_keep(env, result.mesh.point);
    qw_keep(env, result.target);
    qw_scope_end(env);
    return result;
}

qw_working qw_working_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, const float *wanted,
                           const float *base_target)
{
    assert(input->twin && census->component && wanted);
    return make_working(env, input, census, LEAST_FACES, wanted, base_target);
}

qw_working qw_coarsest_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, const float *wanted)
{
    assert(input->twin && census->component && wanted);
    return make_working(env, input, census, LEAST_COARSEST, wanted, NULL);
}
