/* Sharp edges.
 *
 * With a given angle an edge is sharp when the normals on its two sides differ by more. Without one, creases must be
 * told from the folds of organic surfaces, the relief of scans and noise, all of which have edges above any fixed
 * angle. What tells them apart is what lies beside the edge: along a crease the turn happens in one edge and both sides
 * are smooth, so that the other edges of its two triangles ("wings") are nearly flat; a fold spreads its turn over
 * several rows of triangles. Measured on chains above 40 degrees, the mean wing angle is 1 to 11 % of the mean crease
 * angle on machined parts and 17 to 35 % on statues, animals and noise.
 *
 * A surface of few large facets has no rows of triangles beside its creases: where nearly all of its turn lies in sharp
 * edges they all stay, and shallower ones above 25 degrees join them: without these relaxation rounds them off, and
 * what is flat beside them hangs through.
 *
 * Stairs of voxels and of quantised heights are no creases where their steps are as small as the quads (stairs.h).
 *
 * In this order: seeds above 40 degrees; loose ends grow straight on along edges above 25 degrees until they meet
 * another crease. Those that meet none lose again what is below 35: the tail of a crease that fades out holds the field
 * where nothing sharp is left. The facets of a coarse cylinder stay out. Each connected network stays or goes as a
 * whole by its wings and its length.
 *
 * Triangles so flat that the rounding of their corners decides their normal take the normal of the neighbour across
 * their longest edge: the slivers of machined parts lie in a smooth face more often than not. */
#include "remesh/features/features.h"

#include "base/mechanisms.h"
#include "base/constants.h"
#include "base/elementary.h"
#include "base/sets.h"
#include "remesh/features/stairs.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const float GROW_STRAIGHT = 0.5f; /* cosine of the most that a growing chain may turn at a vertex */
static const double WING_SHARE = 0.14;   /* most that the wings may turn, as a share of the crease */
/* A closed network of fewer edges than a box or a prism has is the rim of one triangle or a spike: a flaw of a scan,
 * unless it is large. */
enum { SPIKE_EDGES = 8 };
/* A surface is one of stairs where more than this share of its sharp length is steps at which it is askew; then
 * networks go that turn back over so much of their length. */
static const double MOST_STEPS = 0.65, MOST_STAIRS = 0.5;
static const double SPIKE_LENGTH = 4;
static const double FACET_LENGTH = 6;      /* quad edges, mean of the sharp edges of a surface of facets */
static const double FACET_TURN = 0.8;      /* share of its turn in sharp edges */
static const float FOLD_COSINE = -0.9962f; /* 175 degrees: it lies flat on itself */
static const double MOST_FOLDS = 0.05;     /* share of the sharp edges' length */
static const float LEAST_HEIGHT =
    4e-6f; /* below this the float coordinates (6e-8) may turn a normal by more than a degree */

/* ---- reliable normals */

/* The longest half-edge of a triangle, and its length. */
static uint32_t longest_side(const qw_trimesh *mesh, uint32_t f, float *length)
{
    assert(f < mesh->face_count);
    uint32_t best = 3 * f;
    *length = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        float l = qw_edge_length(mesh, h);
        if (l <= *length) continue;
        *length = l;
        best = h;
    }
    return best;
}

typedef struct question {
    const qw_trimesh *mesh;
    const qw_vec3 *normal;
    uint8_t *sliver;
    float *cosine;
} question;

static void ask_slivers(void *user, uint32_t begin, uint32_t end)
{
    const question *q = user;
    for (uint32_t f = begin; f < end; f++) {
        float length;
        longest_side(q->mesh, f, &length);
        q->sliver[f] = qw_length(qw_face_cross(q->mesh, f)) <= LEAST_HEIGHT * length;
    }
}

/* Faces whose own normal means nothing, in the order of their numbers. */
static uint32_t *find_slivers(qw_env *env, const qw_trimesh *mesh, uint8_t *sliver, uint32_t *count)
{
    question q = {.mesh = mesh, .sliver = sliver};
    qw_parallel(env, mesh->face_count, QW_GRAIN_LIGHT, ask_slivers, &q);
    uint32_t n = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) n += sliver[f];
    uint32_t *list = QW_NEW(env, uint32_t, n);
    *count = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++)
        if (sliver[f]) list[(*count)++] = f;
    return list;
}

/* Slivers lean on one another (a strip of them across a flat face), so this goes in rounds; what is left keeps its own
 * normal. */
static qw_vec3 *reliable_normals(qw_env *env, const qw_trimesh *mesh)
{
    enum { ROUNDS = 16 };
    qw_vec3 *normal = qw_face_normals(env, mesh);
    uint8_t *sliver = QW_NEW(env, uint8_t, mesh->face_count);
    uint32_t count, *list = find_slivers(env, mesh, sliver, &count);
    for (int round = 0; round < ROUNDS && count > 0; round++) {
        uint32_t kept = 0;
        for (uint32_t i = 0; i < count; i++) {
            float length;
            uint32_t f = list[i], t = mesh->twin[longest_side(mesh, f, &length)];
            if (t != QW_NONE && !sliver[t / 3]) {
                normal[f] = normal[t / 3];
                sliver[f] = 0;
            } else list[kept++] = f;
        }
        count = kept;
    }
    return normal;
}

/* ---- chains */

typedef struct creases {
    qw_trimesh *mesh;
    const uint32_t *outgoing;
    const qw_vec3 *normal; /* qw_vec3[face_count] */
    float *cosine;         /* float[3 face_count]: between the normals on both sides; 1 on the boundary */
    uint32_t *degree;      /* uint32_t[vertex_count]: marked edges */
} creases;

static void compare_normals(void *user, uint32_t begin, uint32_t end)
{
    const question *q = user;
    for (uint32_t f = begin; f < end; f++)
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t t = q->mesh->twin[h];
            q->cosine[h] = t == QW_NONE ? 1 : qw_dot(q->normal[f], q->normal[t / 3]);
        }
}

static float *edge_cosines(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal)
{
    question q = {.mesh = mesh, .normal = normal, .cosine = QW_NEW(env, float, 3 * (size_t)mesh->face_count)};
    qw_parallel(env, mesh->face_count, QW_GRAIN_LIGHT, compare_normals, &q);
    return q.cosine;
}

static void mark_edge(creases *c, uint32_t h)
{
    assert(h < 3 * c->mesh->face_count && c->mesh->twin[h] != QW_NONE);
    qw_trimesh *mesh = c->mesh;
    mesh->mark[h] = mesh->mark[mesh->twin[h]] = QW_MARK_FEATURE;
    c->degree[mesh->corner[h]]++;
    c->degree[mesh->corner[qw_next(h)]]++;
}

static void unmark_edge(creases *c, uint32_t h)
{
    assert(h < 3 * c->mesh->face_count && c->mesh->twin[h] != QW_NONE);
    qw_trimesh *mesh = c->mesh;
    mesh->mark[h] = mesh->mark[mesh->twin[h]] = 0;
    c->degree[mesh->corner[h]]--;
    c->degree[mesh->corner[qw_next(h)]]--;
}

static void mark_seeds(creases *c, float cosine)
{
    for (uint32_t h = 0; h < 3 * c->mesh->face_count; h++)
        if (c->mesh->twin[h] != QW_NONE && h < c->mesh->twin[h] && c->cosine[h] < cosine) mark_edge(c, h);
}

static qw_vec3 direction(const qw_trimesh *mesh, uint32_t h) { return qw_normalize(qw_edge_way(mesh, h)); }

/* The marked half-edge out of v, a loose end. */
static uint32_t marked_edge_at(const creases *c, uint32_t v)
{
    assert(c->degree[v] > 0);
    uint32_t h = c->outgoing[v];
    while (!c->mesh->mark[h]) h = qw_around(c->mesh, h);
    return h;
}

/* The half-edge out of v, the loose end of a chain, along which the chain goes on; QW_NONE if none is sharp and
 * straight enough. */
static uint32_t continuation(const creases *c, uint32_t v)
{
    assert(v < c->mesh->vertex_count && c->degree[v] == 1);
    const qw_trimesh *mesh = c->mesh;
    qw_vec3 backward = direction(mesh, marked_edge_at(c, v));
    uint32_t best = QW_NONE, h = c->outgoing[v];
    do {
        if (!mesh->mark[h] && c->cosine[h] < (float)QW_STRAIGHT_COSINE &&
            -qw_dot(direction(mesh, h), backward) > GROW_STRAIGHT &&
            (best == QW_NONE || c->cosine[h] < c->cosine[best]))
            best = h;
        h = qw_around(mesh, h);
    } while (h != QW_NONE && h != c->outgoing[v]);
    return best;
}

/* Continues each loose end of a crease as long as there is an edge that goes on (continuation). */
static void grow_ends(creases *c)
{
    for (uint32_t start = 0; start < c->mesh->vertex_count; start++) {
        uint32_t v = start;
        while (c->degree[v] == 1) {
            uint32_t h = continuation(c, v);
            if (h == QW_NONE) break;
            mark_edge(c, h);
            v = c->mesh->corner[qw_next(h)];
        }
    }
}

static bool on_boundary(const qw_trimesh *mesh, uint32_t outgoing) { return mesh->twin[outgoing] == QW_NONE; }

/* Back from loose ends, once all have grown and met what they meet. The boundary holds an end as another crease does.
 */
static void drop_tails(creases *c)
{
    const qw_trimesh *mesh = c->mesh;
    for (uint32_t start = 0; start < mesh->vertex_count; start++) {
        uint32_t v = start;
        while (c->degree[v] == 1 && !on_boundary(mesh, c->outgoing[v])) {
            uint32_t h = marked_edge_at(c, v);
            if (c->cosine[h] < (float)QW_BENT_COSINE) break;
            unmark_edge(c, h);
            v = mesh->corner[qw_next(h)];
        }
    }
}

/* ---- networks */

/* Edges that hang together. Weighted by length, angles in radians. */
typedef struct network {
    double length, angle, wing;
    double stairs;        /* length of the edges that are steps, on a surface of stairs */
    uint32_t ends, edges; /* vertices with one marked edge; edges */
} network;

/* network of each vertex: uint32_t[vertex_count], QW_NONE away from marked edges. */
static uint32_t *label_networks(qw_env *env, const creases *c, uint32_t *count)
{
    assert(c->mesh->mark && c->outgoing);
    const qw_trimesh *mesh = c->mesh;
    uint32_t *label = QW_NEW(env, uint32_t, mesh->vertex_count), *stack = QW_NEW(env, uint32_t, mesh->vertex_count);
    memset(label, 0xff, mesh->vertex_count * sizeof *label);
    *count = 0;
    for (uint32_t seed = 0; seed < mesh->vertex_count; seed++) {
        if (c->degree[seed] == 0 || label[seed] != QW_NONE) continue;
        uint32_t top = 0;
        stack[top++] = seed;
        label[seed] = *count;
        while (top > 0) {
            uint32_t v = stack[--top], h = c->outgoing[v];
            do {
                uint32_t w = mesh->corner[qw_next(h)];
                if (mesh->mark[h] && label[w] == QW_NONE) {
                    label[w] = *count;
                    stack[top++] = w;
                }
                h = qw_around(mesh, h);
            } while (h != QW_NONE && h != c->outgoing[v]);
        }
        ++*count;
    }
    qw_free(env, stack);
    return label;
}

static double angle_of(float cosine) { return qw_acos(fmin(fmax((double)cosine, -1), 1)); }

/* Mean angle of the unmarked edges of the two triangles at h. */
static double wing_angle(const creases *c, uint32_t h)
{
    assert(c->mesh->twin[h] != QW_NONE);
    const uint32_t wing[4] = {qw_next(h), qw_prev(h), qw_next(c->mesh->twin[h]), qw_prev(c->mesh->twin[h])};
    double sum = 0;
    int count = 0;
    for (int i = 0; i < 4; i++)
        if (!c->mesh->mark[wing[i]]) {
            sum += angle_of(c->cosine[wing[i]]);
            count++;
        }
    return count > 0 ? sum / count : 0;
}

/* What each network of creases has: edges, length, angle, wings and loose ends. label: of vertices, from 0 to count
 * - 1. */
static network *measure_networks(qw_env *env, const creases *c, const uint32_t *label, uint32_t count)
{
    const qw_trimesh *mesh = c->mesh;
    network *list = QW_NEW_ZERO(env, network, count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (!mesh->mark[h] || mesh->twin[h] < h) continue;
        network *n = &list[label[mesh->corner[h]]];
        double length = qw_edge_length(mesh, h);
        n->edges++;
        n->length += length;
        n->angle += length * angle_of(c->cosine[h]);
        n->wing += length * wing_angle(c, h);
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (c->degree[v] == 1) list[label[v]].ends++;
    return list;
}

static bool is_crease(const network *n, float quad_edge, double wing_share)
{
    if (n->wing > wing_share * n->angle || n->stairs > MOST_STAIRS * n->length) return false;
    if (n->ends == 0 && n->edges < SPIKE_EDGES && n->length < SPIKE_LENGTH * quad_edge) return false;
    return n->length >= (n->ends == 0 ? quad_edge / 4
                                      : quad_edge / 2); /* closed: the rim of a hole may be small, a spike is smaller */
}

/* Where most of the sharp length is folds, as on a statue, the few networks that pass are more often luck: ask more of
   them. A flat base of the statue still passes. */
static double suitable_wing_share(const network *list, uint32_t count, float quad_edge)
{
    double all = 0, passing = 0;
    for (uint32_t i = 0; i < count; i++) {
        all += list[i].length;
        if (is_crease(&list[i], quad_edge, WING_SHARE)) passing += list[i].length;
    }
    return 2 * passing < all ? WING_SHARE / 2 : WING_SHARE;
}

/* Only networks that would stay are asked about: those of statues and noise, which have the most edges, go anyway. */
static void find_stairs(qw_env *env, const creases *c, const uint32_t *label, network *list, uint32_t count,
                        float quad_edge, double wing_share)
{
    assert(list || count == 0);
    qw_steps *steps = QW_NEW_ZERO(env, qw_steps, count);
    uint8_t *asked = QW_NEW(env, uint8_t, count);
    double askew = 0, all = 0;
    for (uint32_t i = 0; i < count; i++) {
        asked[i] = is_crease(&list[i], quad_edge, wing_share);
        if (asked[i]) all += list[i].length;
    }
    if (quad_edge > 0 && qw_uses(env, QW_MECH_STAIRS))
        qw_find_steps(env, c->mesh, c->normal, &(qw_step_networks){label, asked}, quad_edge, steps);
    for (uint32_t i = 0; i < count; i++) askew += steps[i].askew;
    for (uint32_t i = 0; i < count; i++) list[i].stairs = askew > MOST_STEPS * all ? steps[i].back : 0;
    for (uint32_t i = 0; i < count; i++) qw_did(env, QW_MECH_STAIRS, list[i].stairs > 0);
    qw_free(env, steps), qw_free(env, asked);
}

static void drop_networks(qw_env *env, creases *c, float quad_edge, bool with_any_wings)
{
    uint32_t count, *label = label_networks(env, c, &count);
    network *list = measure_networks(env, c, label, count);
    find_stairs(env, c, label, list, count, quad_edge, with_any_wings ? INFINITY : WING_SHARE);
    double wing_share = with_any_wings ? INFINITY : suitable_wing_share(list, count, quad_edge);
    for (uint32_t h = 0; h < 3 * c->mesh->face_count; h++)
        if (c->mesh->mark[h] && !is_crease(&list[label[c->mesh->corner[h]]], quad_edge, wing_share))
            c->mesh->mark[h] = 0;
}

/* ---- the surface as a whole */

/* Sharp edges of the surface beside all of them; folds: those at which it lies flat on itself. */
typedef struct sharpness {
    double length, folds, all;
    uint32_t edges;
} sharpness;

static bool is_lower(const qw_trimesh *mesh, uint32_t h) { return mesh->twin[h] == QW_NONE || h < mesh->twin[h]; }

typedef struct sharpness_sums {
    const creases *creases;
    sharpness *of; /* sharpness[blocks] */
} sharpness_sums;

/* Length of all edges, of the marked ones, and of those that are folds, over a block. */
static void add_up_sharpness(void *user, uint32_t begin, uint32_t end)
{
    const sharpness_sums *sums = user;
    const creases *c = sums->creases;
    const qw_trimesh *mesh = c->mesh;
    sharpness s = {0};
    for (uint32_t h = 3 * begin; h < 3 * end; h++) {
        if (!is_lower(mesh, h)) continue;
        double length = qw_edge_length(mesh, h);
        s.all += length;
        if (!mesh->mark[h]) continue;
        s.length += length, s.edges++;
        if (c->cosine[h] < FOLD_COSINE) s.folds += length;
    }
    sums->of[begin / QW_GRAIN_LIGHT] = s;
}

/* The same over the whole surface. */
static sharpness measure_sharpness(qw_env *env, const creases *c)
{
    uint32_t blocks = qw_block_count(c->mesh->face_count, QW_GRAIN_LIGHT);
    sharpness_sums sums = {c, QW_NEW(env, sharpness, blocks)};
    qw_parallel(env, c->mesh->face_count, QW_GRAIN_LIGHT, add_up_sharpness, &sums);
    sharpness s = {0};
    for (uint32_t b = 0; b < blocks; b++)
        s.length += sums.of[b].length, s.folds += sums.of[b].folds, s.all += sums.of[b].all,
            s.edges += sums.of[b].edges;
    qw_free(env, sums.of);
    return s;
}

/* A surface of facets, each of which holds many quads, and not one of concave polygons that were cut into triangles
 * regardless. */
static bool has_facets(const sharpness *s, float quad_edge)
{
    return s->length > FACET_LENGTH * quad_edge * s->edges && s->folds <= MOST_FOLDS * s->length;
}

/* Noise so strong that its edges are all sharp has no wings. It fills the surface, and more than three sharp edges meet
   at most of its vertices; low polygon models that are all creases have mostly three, or facets (an octahedron, an
   obelisk). */
static bool is_noise(const creases *c, const sharpness *s, float quad_edge)
{
    if (3 * s->length < s->all || has_facets(s, quad_edge)) return false;
    uint32_t touched = 0, crossed = 0;
    for (uint32_t v = 0; v < c->mesh->vertex_count; v++) {
        touched += c->degree[v] > 0;
        crossed += c->degree[v] > 3;
    }
    return 2 * (uint64_t)crossed > touched;
}

/* Where nearly all the turn of a surface of facets lies in its sharp edges, others beside them are shallow creases and
 * no folds. */
static bool is_all_creases(const creases *c, const sharpness *s, float quad_edge)
{
    if (!has_facets(s, quad_edge)) return false;
    const qw_trimesh *mesh = c->mesh;
    double sharp = 0, all = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (!is_lower(mesh, h)) continue;
        double turn = qw_edge_length(mesh, h) * angle_of(c->cosine[h]);
        all += turn;
        if (mesh->mark[h]) sharp += turn;
    }
    return sharp >= FACET_TURN * all;
}

/* Whether an unmarked edge is as sharp as what creases grow along. */
static bool is_shallow(const creases *c, uint32_t h)
{
    return c->mesh->twin[h] != QW_NONE && !c->mesh->mark[h] && c->cosine[h] < (float)QW_STRAIGHT_COSINE;
}

static bool are_in_line(const qw_trimesh *mesh, uint32_t g, uint32_t h)
{
    qw_vec3 a = mesh->position[mesh->corner[g]], along = direction(mesh, g);
    float length = qw_edge_length(mesh, h), most = (1 - (float)QW_STRAIGHT_COSINE) * length;
    return qw_length(qw_reject(qw_sub(mesh->position[mesh->corner[h]], a), along)) <= most &&
           qw_length(qw_reject(qw_sub(mesh->position[mesh->corner[qw_next(h)]], a), along)) <= most;
}

/* On a surface of facets, most of them between sharp edges, those between two facets of which one has no other shallow
   edge than along the same line are creases too: a roof that is less steep than the walls. The facets of a coarse
   cylinder have two each. */
static void add_shallow_creases(qw_env *env, creases *c)
{
    const qw_trimesh *mesh = c->mesh;
    uint32_t *facet = QW_NEW(env, uint32_t, mesh->face_count), *only = QW_NEW(env, uint32_t, mesh->face_count);
    uint8_t *has_more = QW_NEW_ZERO(env, uint8_t, mesh->face_count);
    qw_sets_begin(facet, mesh->face_count);
    memset(only, 0xff, mesh->face_count * sizeof *only);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (mesh->twin[h] != QW_NONE && !mesh->mark[h] && !is_shallow(c, h))
            qw_join_sets(facet, h / 3, mesh->twin[h] / 3);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (!is_shallow(c, h)) continue;
        uint32_t f = qw_set_of(facet, h / 3);
        if (only[f] == QW_NONE) only[f] = h;
        has_more[f] |= !are_in_line(mesh, only[f], h);
    }
    uint8_t *joins = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        joins[h] = is_shallow(c, h) &&
                   !(has_more[qw_set_of(facet, h / 3)] && has_more[qw_set_of(facet, mesh->twin[h] / 3)]);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (joins[h] && h < mesh->twin[h]) mark_edge(c, h);
    qw_free(env, joins), qw_free(env, has_more), qw_free(env, only), qw_free(env, facet);
}

/* Marks the creases of a mesh: seeds are grown, tails dropped, and what is noise or no network of a design goes. */
static void find_creases(qw_env *env, creases *c, float quad_edge)
{
    assert(c->mesh->mark && c->cosine && c->degree);
    mark_seeds(c, (float)QW_SHARP_COSINE);
    grow_ends(c);
    drop_tails(c);
    sharpness s = measure_sharpness(env, c);
    bool is_all = is_all_creases(c, &s, quad_edge);
    if (is_all) add_shallow_creases(env, c);
    if (is_noise(c, &s, quad_edge)) memset(c->mesh->mark, 0, 3 * (size_t)c->mesh->face_count);
    else drop_networks(env, c, quad_edge, is_all);
}

int64_t qw_find_features(qw_env *env, qw_trimesh *mesh, double angle, float quad_edge, double *used)
{
    assert(mesh->twin && quad_edge >= 0 && used);
    mesh->mark = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)mesh->face_count);
    qw_scope_begin(env);
    creases c = {.mesh = mesh, .outgoing = qw_trimesh_outgoing(env, mesh), .normal = reliable_normals(env, mesh)};
    c.cosine = edge_cosines(env, mesh, c.normal);
    c.degree = QW_NEW_ZERO(env, uint32_t, mesh->vertex_count);
    if (angle < 0) find_creases(env, &c, quad_edge);
    else mark_seeds(&c, (float)qw_cos(fmin(angle, QW_PI)));
    *used = angle < 0 ? angle_of((float)QW_SHARP_COSINE) : angle;
    int64_t count = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) count += mesh->mark[h] != 0;
    qw_scope_end(env);
    return count / 2;
}
