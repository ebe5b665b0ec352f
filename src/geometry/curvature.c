/* Edges and triangles as pieces smaller than the ball, grouped by the cells of a grid whose cells are as wide as the
 * ball's radius: a ball lies in 3 x 3 x 3 cells. Cells are hashed to buckets; a bucket may hold several.
 */
#include "geometry/curvature.h"

#include "base/hash.h"
#include "base/elementary.h"
#include "geometry/weld.h"
#include "base/groups.h"

#include <assert.h>
#include <string.h>

enum {
    CELL_BITS = 21, /* a coordinate of a cell */
    /* Pieces of area in a square of the ball's radius, of which a ball has about three times as many: where curvature
       is measured, and where fields follow it. */
    PIECES_MEASURED = 32,
    PIECES_FOLLOWED = 8,
    MOST_CUTS = 4096,     /* of one edge or triangle */
    MOST_PIECES = 2000000 /* beyond one a triangle: pieces get larger instead */
};

static const float least_bow = 0.12f, least_share = 0.3f, flat = 1e-6f; /* radians */

typedef struct piece {
    qw_vec3 point;
    qw_vec3 facing; /* of an edge the sum of its faces' unit normals; of an area its unit normal */
    qw_vec3 along;  /* edges: unit direction; areas: not used */
    float amount;   /* edges: angle times length; areas: area */
    uint32_t cell;  /* what tells its cell of the grid from those around it */
} piece;

typedef struct piece_grid {
    uint32_t mask;   /* buckets - 1; a power of two of them */
    uint32_t most;   /* pieces in a bucket */
    uint32_t *begin; /* uint32_t[buckets + 1] */
    piece *piece;    /* piece[begin[buckets]], by bucket */
} piece_grid;

struct qw_ball_curvature {
    float radius;
    piece_grid edges, areas;
};

/* ---- pieces */

typedef struct piece_task {
    const qw_trimesh *mesh; /* position and corner */
    const qw_vec3 *normal;  /* qw_vec3[face_count] */
    const uint32_t (
        *sides)[2]; /* uint32_t[edges][2]: the half-edges of each edge that has two, of opposite directions */
    double radius, piece_area;
    uint32_t *begin; /* uint32_t[items + 1]: the pieces of each edge or triangle */
    piece *piece;
} piece_task;

static qw_vec3 corner_position(const qw_trimesh *m, uint32_t h) { return m->position[m->corner[h]]; }

static double triangle_area(const piece_task *t, uint32_t f)
{
    return qw_length2(t->normal[f]) > 0 ? 0.5 * (double)qw_length(qw_face_cross(t->mesh, f)) : 0;
}

/* Whether turn_across is not 0. */
static bool bends_across(const piece_task *t, uint32_t h, uint32_t g, qw_vec3 along)
{
    qw_vec3 a = t->normal[h / 3], b = t->normal[g / 3];
    float cosine = qw_dot(a, b);
    return cosine < 0 || fabsf(qw_dot(qw_cross(a, b), along)) > flat * cosine;
}

/* Signed angle by which the normal turns across the half-edge. */
static double turn_across(const piece_task *t, uint32_t h, uint32_t g, qw_vec3 along)
{
    qw_vec3 a = t->normal[h / 3], b = t->normal[g / 3];
    return qw_angle_of(qw_dot(qw_cross(a, b), along), qw_dot(a, b));
}

/* Into how many pieces each edge is cut: half a radius long at most; 0 where nothing bends. */
static void count_edge_pieces(void *user, uint32_t begin, uint32_t end)
{
    const piece_task *t = user;
    for (uint32_t e = begin; e < end; e++) {
        uint32_t h = t->sides[e][0], g = t->sides[e][1];
        qw_vec3 v = qw_sub(corner_position(t->mesh, qw_next(h)), corner_position(t->mesh, h));
        double length = qw_length(v), steps = qw_ceil(length / (0.5 * t->radius));
        bool bends = length > 0 && bends_across(t, h, g, qw_normalize(v));
        t->begin[e + 1] = !bends ? 0 : steps < 1 ? 1 : steps > MOST_CUTS ? MOST_CUTS : (uint32_t)steps;
    }
}

/* The pieces of each edge, with their share of what it bends. */
static void fill_edge_pieces(void *user, uint32_t begin, uint32_t end)
{
    const piece_task *t = user;
    for (uint32_t e = begin; e < end; e++) {
        uint32_t h = t->sides[e][0], g = t->sides[e][1], cuts = t->begin[e + 1] - t->begin[e];
        if (cuts == 0) continue;
        qw_vec3 a = corner_position(t->mesh, h), b = corner_position(t->mesh, qw_next(h)),
                along = qw_normalize(qw_sub(b, a));
        piece p = {.facing = qw_add(t->normal[h / 3], t->normal[g / 3]), .along = along};
        p.amount = (float)turn_across(t, h, g, along) * qw_distance(a, b) / (float)cuts;
        for (uint32_t i = 0; i < cuts; i++) {
            p.point = qw_lerp(a, b, ((float)i + 0.5f) / (float)cuts);
            t->piece[t->begin[e] + i] = p;
        }
    }
}

static void count_area_pieces(void *user, uint32_t begin, uint32_t end)
{
    const piece_task *t = user;
    for (uint32_t f = begin; f < end; f++) {
        double pieces = qw_ceil(triangle_area(t, f) / t->piece_area);
        t->begin[f + 1] = pieces < 1 ? 1 : pieces > MOST_PIECES ? MOST_PIECES : (uint32_t)pieces;
    }
}

/* The pieces of each triangle, spread over it at random. */
static void fill_area_pieces(void *user, uint32_t begin, uint32_t end)
{
    const piece_task *t = user;
    for (uint32_t f = begin; f < end; f++) {
        uint32_t first = t->begin[f], count = t->begin[f + 1] - first;
        qw_vec3 a = corner_position(t->mesh, 3 * f), b = corner_position(t->mesh, 3 * f + 1),
                c = corner_position(t->mesh, 3 * f + 2);
        piece p = {.facing = t->normal[f], .amount = (float)(triangle_area(t, f) / count)};
        for (uint32_t i = 0; i < count; i++) {
            float u = (float)qw_hashed(first + i, 3), v = (float)(((double)i + qw_hashed(first + i, 4)) / count);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            p.point = qw_madd(qw_madd(a, u, qw_sub(b, a)), v, qw_sub(c, a));
            t->piece[first + i] = p;
        }
    }
}

/* ---- grid */

typedef struct cell {
    uint64_t x, y, z;
} cell;

static uint64_t coordinate_of(float x, float radius)
{
    double at = qw_floor((double)x / (double)radius) + (1 << (CELL_BITS - 1));
    return at < 1 ? 1 : at > (1 << CELL_BITS) - 2 ? (1 << CELL_BITS) - 2 : (uint64_t)at;
}

static cell cell_of(qw_vec3 p, float radius)
{
    return (cell){coordinate_of(p.x, radius), coordinate_of(p.y, radius), coordinate_of(p.z, radius)};
}

/* Equal for no two cells of the 3 x 3 x 3 around one. */
static uint32_t told_cell(cell c) { return (uint32_t)((c.x & 3) | (c.y & 3) << 2 | (c.z & 3) << 4); }

/* Cells of a block of 4 x 4 x 4 lie side by side in memory, as balls after one another ask for the same. */
static uint32_t bucket_of(const piece_grid *g, cell c)
{
    uint64_t block = (c.z >> 2) << 2 * CELL_BITS | (c.y >> 2) << CELL_BITS | c.x >> 2;
    return ((uint32_t)qw_mix(block) << 6 | told_cell(c)) & g->mask;
}

typedef struct bucket_task {
    const piece_grid *grid;
    piece *piece;
    float radius;
    uint32_t *bucket; /* written, as the pieces' cells are */
} bucket_task;

static void bucket_block(void *user, uint32_t begin, uint32_t end)
{
    const bucket_task *t = user;
    for (uint32_t i = begin; i < end; i++) {
        cell own = cell_of(t->piece[i].point, t->radius);
        t->piece[i].cell = told_cell(own);
        t->bucket[i] = bucket_of(t->grid, own);
    }
}

/* Stable counting sort, so that sums over a bucket have one order. There are as many buckets as pieces, as every ball
   looks into 27. */
static piece_grid group_pieces(qw_env *env, piece *pieces, uint32_t count, float radius)
{
    piece_grid g = {.mask = 1};
    while (g.mask < count) g.mask = 2 * g.mask + 1;
    g.piece = QW_NEW(env, piece, count);
    uint32_t *bucket = QW_NEW(env, uint32_t, count);
    bucket_task t = {&g, pieces, radius, bucket};
    qw_parallel(env, count, QW_GRAIN_LIGHT, bucket_block, &t);
    uint32_t *sorted = qw_group(env, bucket, count, g.mask + 1, &g.begin);
    for (uint32_t b = 0; b <= g.mask; b++)
        if (g.begin[b + 1] - g.begin[b] > g.most) g.most = g.begin[b + 1] - g.begin[b];
    for (uint32_t i = 0; i < count; i++) g.piece[i] = pieces[sorted[i]];
    qw_free(env, bucket), qw_free(env, sorted);
    return g;
}

/* Makes pieces of all items, counted first, and groups them by cells as large as the radius. */
static piece_grid make_pieces(qw_env *env, piece_task *t, uint32_t items, qw_task count, qw_task fill)
{
    assert(t->radius > 0);
    t->begin = QW_NEW_ZERO(env, uint32_t, (size_t)items + 1);
    qw_parallel(env, items, QW_GRAIN_LIGHT, count, t);
    uint64_t total = 0;
    for (uint32_t i = 0; i < items; i++) {
        total += t->begin[i + 1];
        if (total >= QW_NONE) qw_fail(env, QW_TOO_LARGE, i, "the curvature of so many triangles cannot be measured");
        t->begin[i + 1] = (uint32_t)total;
    }
    t->piece = QW_NEW(env, piece, total);
    qw_parallel(env, items, QW_GRAIN_LIGHT, fill, t);
    piece_grid g = group_pieces(env, t->piece, (uint32_t)total, (float)t->radius);
    qw_free(env, t->begin), qw_free(env, t->piece);
    return g;
}

static qw_ball_curvature *make_curvature(qw_env *env, piece_task *t, uint32_t edges, double area, double pieces)
{
    qw_ball_curvature *c = QW_NEW_ZERO(env, qw_ball_curvature, 1);
    c->radius = (float)t->radius;
    t->piece_area = fmax(t->radius * t->radius / pieces, area / MOST_PIECES);
    c->edges = make_pieces(env, t, edges, count_edge_pieces, fill_edge_pieces);
    c->areas = make_pieces(env, t, t->mesh->face_count, count_area_pieces, fill_area_pieces);
    return c;
}

/* The first two half-edges of each edge, where they are of opposite directions. */
static uint32_t pair_sides(const qw_polygon_edges *edges, const uint32_t *corner, uint32_t (*sides)[2])
{
    uint32_t count = 0;
    for (uint32_t e = 0; e < edges->edge_count; e++) {
        uint32_t begin = edges->edge_begin[e];
        if (edges->edge_begin[e + 1] - begin < 2) continue;
        uint32_t h = edges->sorted[begin], g = edges->sorted[begin + 1];
        if (corner[h] == corner[g]) continue;
        sides[count][0] = h, sides[count++][1] = g;
    }
    return count;
}

qw_ball_curvature *qw_ball_curvature_make(qw_env *env, const qw_surface *s, const qw_mesh_view *view, double radius)
{
    assert(radius > 0 && s->mesh.face_count > 0);
    uint32_t faces = s->mesh.face_count, *corner = QW_NEW(env, uint32_t, 3 * (size_t)faces);
    memcpy(corner, s->mesh.corner, 3 * (size_t)faces * sizeof *corner);
    qw_weld_equal(env, view->positions, view->vertex_count, NULL, corner, faces);
    qw_surface welded = *s;
    welded.mesh.corner = corner;
    qw_polygon_edges edges = qw_surface_edges(env, &welded, view);
    uint32_t(*sides)[2] = qw_alloc(env, edges.edge_count, sizeof *sides);
    piece_task t = {.mesh = &s->mesh, .normal = s->normal, .sides = (const uint32_t(*)[2])sides, .radius = radius};
    return make_curvature(env, &t, pair_sides(&edges, corner, sides), s->area_end[faces - 1], PIECES_MEASURED);
}

qw_ball_curvature *qw_ball_curvature_of(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, qw_ball_edges edges,
                                        double radius)
{
    assert(radius > 0);
    uint32_t(*sides)[2] = qw_alloc(env, 3 * (size_t)mesh->face_count, sizeof *sides), count = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        if (mesh->twin[h] == QW_NONE || mesh->twin[h] < h) continue;
        if ((mesh->mark && mesh->mark[h]) != (edges == QW_BALL_MARKED)) continue;
        sides[count][0] = h, sides[count++][1] = mesh->twin[h];
    }
    piece_task t = {.mesh = mesh, .normal = normal, .sides = (const uint32_t(*)[2])sides, .radius = radius};
    return make_curvature(env, &t, count, qw_trimesh_area(mesh), PIECES_FOLLOWED);
}

/* ---- tensor */

typedef struct ball {
    const qw_ball_curvature *c;
    qw_vec3 centre, normal;
    uint32_t at; /* told_cell of the one being visited */
} ball;

static bool in_ball(const ball *b, const piece *p)
{
    if (p->cell != b->at) return false; /* other cells of the bucket have their turn */
    if (qw_length2(qw_sub(p->point, b->centre)) > b->c->radius * b->c->radius) return false;
    return qw_dot(p->facing, b->normal) > 0;
}

/* The squared distances, in cells, along one axis from x to those whose coordinate is one less than that of its own,
   the same, and one more. 0 at the rim of the grid, whose cells hold what lies outside it. */
static void gaps_along(float x, uint64_t own, float radius, double gap2[3])
{
    bool at_rim = own <= 2 || own >= (1 << CELL_BITS) - 3;
    double within = (double)x / (double)radius + (1 << (CELL_BITS - 1)) - (double)own;
    gap2[0] = at_rim ? 0 : within * within, gap2[1] = 0, gap2[2] = at_rim ? 0 : (1 - within) * (1 - within);
}

/* Calls visit for each piece in the ball, always in the same order. */
static void visit_ball(ball b, const piece_grid *g, void (*visit)(double *sums, const piece *p), double *sums)
{
    static const double REACHED = 1 + 1e-6; /* squared; what rounding leaves of a cell is far less */
    cell middle = cell_of(b.centre, b.c->radius);
    double x2[3], y2[3], z2[3];
    gaps_along(b.centre.x, middle.x, b.c->radius, x2), gaps_along(b.centre.y, middle.y, b.c->radius, y2);
    gaps_along(b.centre.z, middle.z, b.c->radius, z2);
    for (uint64_t z = 0; z < 3; z++)
        for (uint64_t y = 0; y < 3; y++)
            for (uint64_t x = 0; x < 3; x++) {
                if (x2[x] + y2[y] + z2[z] > REACHED) continue;
                cell c = {middle.x + x - 1, middle.y + y - 1, middle.z + z - 1};
                b.at = told_cell(c);
                uint32_t bucket = bucket_of(g, c);
                for (uint32_t i = g->begin[bucket]; i < g->begin[bucket + 1]; i++)
                    if (in_ball(&b, &g->piece[i])) visit(sums, &g->piece[i]);
            }
}

static void add_area(double *sums, const piece *p)
{
    sums[0] += (double)(p->facing.x * p->amount);
    sums[1] += (double)(p->facing.y * p->amount);
    sums[2] += (double)(p->facing.z * p->amount);
    sums[3] += (double)p->amount;
}

static void add_edge(double *sums, const piece *p)
{
    double x = (double)p->along.x, y = (double)p->along.y, z = (double)p->along.z, a = (double)p->amount;
    sums[0] += a * x * x, sums[1] += a * y * y, sums[2] += a * z * z;
    sums[3] += a * x * y, sums[4] += a * y * z, sums[5] += a * z * x;
}

/* u M v for the sums of add_edge. */
static double product(const double m[6], qw_vec3 u, qw_vec3 v)
{
    double x = m[0] * (double)v.x + m[3] * (double)v.y + m[5] * (double)v.z,
           y = m[3] * (double)v.x + m[1] * (double)v.y + m[4] * (double)v.z,
           z = m[5] * (double)v.x + m[4] * (double)v.y + m[2] * (double)v.z;
    return (double)u.x * x + (double)u.y * y + (double)u.z * z;
}

static void add_turn(double *sums, const piece *p)
{
    sums[0] += (double)p->amount;
    sums[1] += fabs((double)p->amount);
}

qw_ball_sums qw_ball_sums_at(const qw_ball_curvature *c, qw_vec3 point, qw_vec3 normal)
{
    ball b = {.c = c, .centre = point, .normal = normal};
    double area[4] = {0}, turn[2] = {0};
    visit_ball(b, &c->areas, add_area, area);
    visit_ball(b, &c->edges, add_turn, turn);
    return (qw_ball_sums){.area = area[3], .normal = qw_v3_of_doubles(area), .turn = turn[0], .turning = turn[1]};
}

qw_principal qw_ball_curvature_at(const qw_ball_curvature *c, qw_vec3 point, qw_vec3 normal)
{
    qw_principal none = {{0, 0, 0}, 0};
    ball b = {.c = c, .centre = point, .normal = normal};
    double area[4] = {0}, m[6] = {0};
    visit_ball(b, &c->edges, add_edge, m);
    bool bends = false;
    for (int i = 0; i < 6; i++) bends |= m[i] != 0; /* of a saddle the first three may be 0 */
    if (!bends) return none;
    visit_ball(b, &c->areas, add_area, area);
    qw_vec3 n = qw_normalize(qw_v3_of_doubles(area));
    if (!(area[3] > 0) || qw_length2(n) == 0) return none;
    qw_vec3 u = qw_any_orthogonal(n), v = qw_cross(n, u);
    double uu = product(m, u, u) / area[3], uv = product(m, u, v) / area[3], vv = product(m, v, v) / area[3];
    double mean = 0.5 * (uu + vv), half = 0.5 * (uu - vv), spread = sqrt(half * half + uv * uv);
    double difference = 2 * spread * (double)c->radius,
           both = (fabs(mean + spread) + fabs(mean - spread)) * (double)c->radius;
    if (!(difference > (double)least_bow && difference > (double)least_share * both)) return none;
    /* the eigenvector of mean + spread, from whichever row of the matrix loses no digits */
    double along_u = half >= 0 ? half + spread : uv, along_v = half >= 0 ? uv : spread - half;
    qw_vec3 d = qw_normalize(qw_madd(qw_scale(u, (float)along_u), (float)along_v, v));
    return (qw_principal){d, (float)fmin(difference, 1)};
}

/* How many pieces lie in the 27 cells around a point's. */
static uint64_t pieces_around(const piece_grid *g, cell middle)
{
    uint64_t count = 0;
    for (uint64_t z = middle.z - 1; z <= middle.z + 1; z++)
        for (uint64_t y = middle.y - 1; y <= middle.y + 1; y++)
            for (uint64_t x = middle.x - 1; x <= middle.x + 1; x++) {
                uint32_t bucket = bucket_of(g, (cell){x, y, z});
                count += g->begin[bucket + 1] - g->begin[bucket];
            }
    return count;
}

uint64_t qw_ball_effort(const qw_ball_curvature *c, qw_vec3 point)
{
    cell middle = cell_of(point, c->radius);
    assert(middle.x > 0 && middle.y > 0 && middle.z > 0);
    return pieces_around(&c->areas, middle) + pieces_around(&c->edges, middle);
}

uint64_t qw_ball_most_effort(const qw_ball_curvature *c)
{
    enum { CELLS = 27 };
    return (uint64_t)CELLS * ((uint64_t)c->areas.most + c->edges.most);
}
