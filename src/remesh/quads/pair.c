#include "remesh/quads/pair.h"

#include "base/sort.h"
#include "solve/queue.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* What a walk pays for a step, for the worst possible shape of the pair it leaves, and for a flip. Only their ratios
   matter: a flip or a folded pair is worth some steps' detour, but a walk shears a row of quads, so not many. */
enum { STEP_COST = 4, SHAPE_COST = 12, FLIP_COST = 10 };
/* Most detours of one walk, after flips that turned out impossible. */
enum { MAX_DETOURS = 32 };
/* Shape below which a pair is not taken by quality, as a walk may find a better one. */
static const float LEAST_SHAPE = 0.1f;

typedef struct pairing {
    qw_env *env;
    qw_edit *e;
    uint32_t *mate; /* [faces] or QW_NONE */
    size_t capacity;
    qw_pair_counts *counts;
    /* scratch of the walks, all [faces]; a block is a pair, named by its lower face, or a face left over */
    qw_queue queue;
    int64_t *cost;
    uint32_t *entry; /* half-edge by which the search came into the block, on the block's side */
    /* round in which cost and entry were set, and in which flips in the block were found impossible */
    uint32_t *reached, *rigid;
    uint32_t *touched, touched_count, round, walk, room; /* room: faces that the scratch is for */
} pairing;

static bool is_live(const pairing *p, uint32_t f) { return !qw_edit_dead(p->e, f); }
static uint32_t block_of(const pairing *p, uint32_t f) { return p->mate[f] < f ? p->mate[f] : f; }

/* Least scaled Jacobian at the corners of the quad that two triangles make across h: 1 for a rectangle, below 0 where
 * it folds. */
static float shape_across(const qw_edit *e, uint32_t h)
{
    assert(qw_edit_twin(e, h) != QW_NONE);
    uint32_t t = qw_edit_twin(e, h);
    qw_vec3 p[4] = {e->vertex[qw_edit_tail(e, h)].position, e->vertex[qw_edit_apex(e, t)].position,
                    e->vertex[qw_edit_head(e, h)].position, e->vertex[qw_edit_apex(e, h)].position};
    qw_vec3 n = qw_normalize(qw_quad_cross(p, (const uint32_t[4]){0, 1, 2, 3}));
    float least = 1;
    for (int i = 0; i < 4; i++) {
        qw_vec3 a = qw_normalize(qw_sub(p[(i + 1) & 3], p[i])), b = qw_normalize(qw_sub(p[(i + 3) & 3], p[i]));
        least = fminf(least, qw_dot(qw_cross(a, b), n));
    }
    return least;
}

static void match(pairing *p, uint32_t f, uint32_t g) { p->mate[f] = g, p->mate[g] = f; }

/* The half-edge of f towards g. */
static uint32_t side_towards(const qw_edit *e, uint32_t f, uint32_t g)
{
    assert(f < e->face_count);
    for (uint32_t h = 4 * f; h < 4 * f + 3; h++)
        if (qw_edit_twin(e, h) != QW_NONE && qw_edit_twin(e, h) >> 2 == g) return h;
    return QW_NONE;
}

/* ---- pairs given, and by quality */

/* Joins the triangles that the caller says were one quad before. across: uint8_t[4 faces]. */
static void take_given(pairing *p, const uint8_t *across)
{
    for (uint32_t f = 0; f < p->e->face_count; f++)
        for (uint32_t h = 4 * f; h < 4 * f + 3 && is_live(p, f); h++) {
            uint32_t t = qw_edit_twin(p->e, h);
            if (!across[h] || t == QW_NONE || !across[t] || p->mate[f] != QW_NONE || p->mate[t >> 2] != QW_NONE)
                continue;
            match(p, f, t >> 2);
            p->counts->given++;
        }
}

/* Joins the triangles that are left, those first that make the squarest quads. */
static void take_by_quality(pairing *p)
{
    qw_edit *e = p->e;
    uint32_t count = 0;
    uint64_t *item = QW_NEW(p->env, uint64_t, (size_t)2 * e->live_faces + 1);
    for (uint32_t f = 0; f < e->face_count; f++)
        for (uint32_t h = 4 * f; h < 4 * f + 3 && is_live(p, f) && p->mate[f] == QW_NONE; h++) {
            uint32_t t = qw_edit_twin(e, h);
            if (qw_edit_on_curve(e, h) || t < h || p->mate[t >> 2] != QW_NONE) continue;
            float shape = shape_across(e, h);
            if (shape > LEAST_SHAPE) item[count++] = (uint64_t)(uint32_t)((1 - fminf(shape, 1)) * 1e6f) << 32 | h;
        }
    qw_sort_u64(item, count);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t h = (uint32_t)item[i], f = h >> 2, g = qw_edit_twin(e, h) >> 2;
        if (p->mate[f] != QW_NONE || p->mate[g] != QW_NONE) continue;
        match(p, f, g);
        p->counts->taken++;
    }
    qw_free(p->env, item);
}

/* ---- even numbers between curves */

/* After a split has cut f in two, of which g is the new face: the mate of f stays with the half that it touches. */
static void settle_halves(pairing *p, uint32_t f, uint32_t g)
{
    assert(f < p->e->face_count && g < p->e->face_count);
    uint32_t mate = p->mate[f];
    p->mate[g] = QW_NONE;
    if (mate == QW_NONE || side_towards(p->e, f, mate) != QW_NONE) return;
    p->mate[f] = QW_NONE;
    match(p, g, mate);
}

/* Splits an edge given by its ends, as another split may have renamed its half-edges. */
static void split_edge(pairing *p, uint32_t a, uint32_t b)
{
    assert(a < p->e->vertex_count && b < p->e->vertex_count && a != b);
    qw_edit *e = p->e;
    uint32_t h = e->vertex[a].out, first = e->face_count;
    while (qw_edit_head(e, h) != b) h = qw_edit_around(e, h);
    uint32_t g = qw_edit_twin(e, h);
    const qw_edit_vertex va = e->vertex[a], vb = e->vertex[b];
    p->mate = qw_grow(p->env, p->mate, &p->capacity, (size_t)first + 2, sizeof *p->mate);
    uint32_t v = qw_edit_split(e, h, qw_lerp(va.position, vb.position, 0.5f), 0.5f * (va.target + vb.target), va.home);
    if (!va.kind || !vb.kind) e->vertex[v].kind = QW_VERTEX_FREE;
    settle_halves(p, h >> 2, first);
    if (g != QW_NONE) settle_halves(p, g >> 2, first + 1);
    p->counts->split_edges++;
}

/* A surface with an odd number of triangles has a boundary: the longest edge of its boundary gets another end. */
static void even_out_components(pairing *p)
{
    qw_edit *e = p->e;
    uint32_t n = 0, faces = e->face_count;
    for (uint32_t v = 0; v < e->vertex_count; v++) n = e->vertex[v].home >= n ? e->vertex[v].home + 1 : n;
    uint32_t *longest = QW_NEW(p->env, uint32_t, n);
    float *most = QW_NEW_ZERO(p->env, float, n);
    uint8_t *odd = QW_NEW_ZERO(p->env, uint8_t, n);
    memset(longest, 0xff, n * sizeof *longest);
    for (uint32_t f = 0; f < faces; f++) {
        if (!is_live(p, f)) continue;
        uint32_t home = e->vertex[e->face[f].corner[0]].home;
        odd[home] ^= 1;
        for (uint32_t h = 4 * f; h < 4 * f + 3; h++) {
            float length = qw_distance(e->vertex[qw_edit_tail(e, h)].position, e->vertex[qw_edit_head(e, h)].position);
            if (qw_edit_twin(e, h) == QW_NONE && length >= most[home]) most[home] = length, longest[home] = h;
        }
    }
    for (uint32_t c = 0; c < n; c++)
        if (odd[c] && longest[c] != QW_NONE) split_edge(p, qw_edit_tail(e, longest[c]), qw_edit_head(e, longest[c]));
    qw_free(p->env, longest), qw_free(p->env, most), qw_free(p->env, odd);
}

/* ---- walks */

/* Scratch for as many faces as there are room for mates. */
static void open_walks(pairing *p)
{
    uint32_t n = (uint32_t)p->capacity;
    p->room = n, p->round = p->walk = 0;
    p->queue = qw_queue_create(p->env, n);
    p->cost = QW_NEW(p->env, int64_t, n);
    p->entry = QW_NEW(p->env, uint32_t, n);
    p->reached = QW_NEW_ZERO(p->env, uint32_t, n), p->rigid = QW_NEW_ZERO(p->env, uint32_t, n);
    p->touched = QW_NEW(p->env, uint32_t, n);
}

static void reach(pairing *p, uint32_t block, int64_t cost, uint32_t entry)
{
    if (p->reached[block] == p->round && (!qw_queue_has(&p->queue, block) || p->cost[block] <= cost)) return;
    if (p->reached[block] != p->round) p->touched[p->touched_count++] = block;
    p->reached[block] = p->round;
    p->cost[block] = cost;
    p->entry[block] = entry;
    qw_queue_put(&p->queue, block, cost);
}

/* Goes on from triangle f of a block to the blocks across its edges, at a cost that is the higher the worse a quad
 * would be there. */
static void leave_by_sides(pairing *p, uint32_t block, uint32_t f, int64_t more, bool across_curves)
{
    for (uint32_t h = 4 * f; h < 4 * f + 3; h++) {
        uint32_t t = qw_edit_twin(p->e, h);
        if (t == QW_NONE || (!across_curves && qw_edit_mark(p->e, h))) continue;
        uint32_t to = block_of(p, t >> 2);
        if (to == block) continue;
        int64_t shape = (int64_t)(0.5f * (1 - shape_across(p->e, h)) * SHAPE_COST);
        reach(p, to, p->cost[block] + STEP_COST + shape + more, t);
    }
}

/* The nearest other face left over, or QW_NONE; `entry` of the blocks leads back to f. */
static uint32_t search(pairing *p, uint32_t f, bool across_curves)
{
    assert(f < p->e->face_count);
    uint32_t block, found = QW_NONE;
    p->round++;
    p->touched_count = 0;
    reach(p, f, p->queue.last, QW_NONE);
    while (found == QW_NONE && (block = qw_queue_take(&p->queue)) != QW_NONE) {
        if (p->mate[block] == QW_NONE && block != f) {
            found = block;
        } else if (block == f) {
            leave_by_sides(p, block, f, 0, across_curves);
        } else {
            uint32_t near = p->entry[block] >> 2;
            leave_by_sides(p, block, p->mate[near], 0, across_curves);
            if (p->rigid[block] != p->walk) leave_by_sides(p, block, near, FLIP_COST, across_curves);
        }
    }
    for (uint32_t i = 0; i < p->touched_count; i++) qw_queue_remove(&p->queue, p->touched[i]);
    return found;
}

/* Three triangles in a row, f, near and far, of which near has the side whose other half is `out`: an edge is flipped
   so that one at an end has it. Returns that one, the two others paired; QW_NONE where neither flip is possible. */
static uint32_t turn_out(pairing *p, uint32_t f, uint32_t near, uint32_t far, uint32_t out)
{
    assert(f < p->e->face_count && near < p->e->face_count && far < p->e->face_count);
    qw_edit *e = p->e;
    uint32_t edges[2] = {side_towards(e, near, f), side_towards(e, near, far)}, best = QW_NONE;
    float most = -2;
    for (int i = 0; i < 2; i++) {
        if (qw_edit_mark(e, edges[i]) || !qw_edit_can_flip(e, edges[i])) continue;
        qw_edit_flip(e, edges[i]);
        uint32_t exit = qw_edit_twin(e, out) >> 2, middle = i ? (exit == near ? far : near) : (exit == near ? f : near),
                 end = i ? f : far;
        float shape = shape_across(e, side_towards(e, middle, end));
        /* three more flips take it back */
        for (int k = 0; k < 3; k++) qw_edit_flip(e, edges[i]);
        if (shape > most) most = shape, best = (uint32_t)i;
    }
    if (best == QW_NONE) return QW_NONE;
    qw_edit_flip(e, edges[best]);
    p->counts->flips++;
    uint32_t exit = qw_edit_twin(e, out) >> 2;
    if (best == 0) match(p, exit == near ? f : near, far);
    else match(p, exit == near ? far : near, f);
    p->mate[exit] = QW_NONE;
    return exit;
}

/* Takes the way that the search found from f to `to`; returns QW_NONE when they met, else where f got stuck. */
static uint32_t follow(pairing *p, uint32_t f, uint32_t to)
{
    uint32_t length = 0, *way = p->touched; /* entries, from the end; no longer needed as a list */
    for (uint32_t block = to; block != f; length++) {
        uint32_t entry = p->entry[block];
        way[length] = entry;
        block = block_of(p, qw_edit_twin(p->e, entry) >> 2);
    }
    uint32_t here = f;
    for (uint32_t i = length; i-- > 1;) {
        uint32_t near = way[i] >> 2, far = p->mate[near], out = way[i - 1];
        assert(qw_edit_twin(p->e, way[i]) >> 2 == here);
        p->counts->steps++;
        if (qw_edit_twin(p->e, out) >> 2 == far) {
            match(p, here, near);
            p->mate[far] = QW_NONE;
            here = far;
            continue;
        }
        uint32_t next = turn_out(p, here, near, far, out);
        if (next == QW_NONE) {
            p->rigid[block_of(p, near)] = p->walk;
            return here;
        }
        here = next;
    }
    match(p, here, to);
    p->counts->walks++;
    return QW_NONE;
}

static void walk_from(pairing *p, uint32_t f, bool across_curves)
{
    p->walk++;
    for (int detour = 0; detour < MAX_DETOURS && f != QW_NONE; detour++) {
        uint32_t to = search(p, f, across_curves);
        if (to == QW_NONE) return;
        f = follow(p, f, to);
    }
}

/* Splits the edges of curves on the way from f to the nearest other face left over: either side of each gets one
   triangle more, so that both ends and all between have even numbers. */
static void split_way(pairing *p, uint32_t f)
{
    uint32_t to = search(p, f, true), count = 0, first = p->e->face_count;
    if (to == QW_NONE) return;
    uint32_t *ends = QW_NEW(p->env, uint32_t, 2 * (size_t)p->touched_count + 2);
    for (uint32_t block = to; block != f;) {
        uint32_t entry = p->entry[block];
        if (qw_edit_mark(p->e, entry))
            ends[count++] = qw_edit_tail(p->e, entry), ends[count++] = qw_edit_head(p->e, entry);
        block = block_of(p, qw_edit_twin(p->e, entry) >> 2);
    }
    for (uint32_t i = 0; i < count; i += 2) split_edge(p, ends[i], ends[i + 1]);
    qw_free(p->env, ends);
    if (p->e->face_count > p->room) open_walks(p);
    walk_from(p, f, false);
    if (p->mate[to] == QW_NONE) walk_from(p, to, false);
    for (uint32_t g = first; g < p->e->face_count; g++)
        if (p->mate[g] == QW_NONE) walk_from(p, g, false);
}

/* ---- the quads */

static uint32_t number_vertices(const pairing *p, uint32_t *number)
{
    const qw_edit *e = p->e;
    uint32_t count = 0;
    memset(number, 0xff, e->vertex_count * sizeof *number);
    for (uint32_t f = 0; f < e->face_count; f++)
        for (uint32_t i = 0; i < 3 && is_live(p, f) && p->mate[f] != QW_NONE; i++)
            if (number[e->face[f].corner[i]] == QW_NONE) number[e->face[f].corner[i]] = count++;
    return count;
}

/* A quad mesh out of the pairs. *vertex_of: receives the vertex of the triangles that each of its own was. */
static qw_quadmesh make_quads(pairing *p, uint32_t **vertex_of)
{
    assert(vertex_of);
    const qw_edit *e = p->e;
    qw_env *env = p->env;
    uint32_t *number = QW_NEW(env, uint32_t, e->vertex_count), *side = QW_NEW(env, uint32_t, (size_t)4 * e->face_count);
    qw_quadmesh q = {.vertex_count = number_vertices(p, number)};
    size_t n = q.vertex_count, sides = (size_t)2 * e->live_faces;
    q.position = QW_NEW(env, qw_vec3, n), q.kind = QW_NEW(env, uint8_t, n), q.component = QW_NEW(env, uint32_t, n);
    q.corner = QW_NEW(env, uint32_t, sides), q.twin = QW_NEW(env, uint32_t, sides),
    q.mark = QW_NEW(env, uint8_t, sides);
    *vertex_of = QW_NEW(env, uint32_t, n);
    uint32_t *leg = QW_NEW(env, uint32_t, sides);
    memset(side, 0xff, (size_t)4 * e->face_count * sizeof *side);
    for (uint32_t f = 0; f < e->face_count; f++) {
        if (!is_live(p, f) || p->mate[f] == QW_NONE || p->mate[f] < f) continue;
        uint32_t h = side_towards(e, f, p->mate[f]), t = qw_edit_twin(e, h), *to = leg + 4 * (size_t)q.face_count;
        to[0] = qw_edit_next(h), to[1] = qw_edit_prev(h), to[2] = qw_edit_next(t), to[3] = qw_edit_prev(t);
        for (uint32_t i = 0; i < 4; i++) side[to[i]] = 4 * q.face_count + i;
        q.face_count++;
    }
    for (uint32_t k = 0; k < 4 * q.face_count; k++) {
        uint32_t t = qw_edit_twin(e, leg[k]);
        q.corner[k] = number[qw_edit_tail(e, leg[k])];
        q.twin[k] = t == QW_NONE ? QW_NONE : side[t];
        q.mark[k] = qw_edit_mark(e, leg[k]);
    }
    for (uint32_t v = 0; v < e->vertex_count; v++) {
        if (number[v] == QW_NONE) continue;
        const qw_edit_vertex *from = &e->vertex[v];
        q.position[number[v]] = from->position, q.kind[number[v]] = from->kind, q.component[number[v]] = from->home;
        (*vertex_of)[number[v]] = v;
    }
    qw_free(env, number), qw_free(env, side), qw_free(env, leg);
    return q;
}

qw_quadmesh qw_pair_triangles(qw_env *env, qw_edit *e, const uint8_t *across, uint32_t **vertex_of,
                              qw_pair_counts *counts)
{
    assert(vertex_of && counts);
    pairing p = {
        .env = env, .e = e, .mate = QW_NEW(env, uint32_t, e->face_count), .capacity = e->face_count, .counts = counts};
    memset(p.mate, 0xff, e->face_count * sizeof *p.mate);
    if (across) take_given(&p, across);
    take_by_quality(&p);
    even_out_components(&p);
    open_walks(&p);
    enum { WITHIN, SPLIT, ACROSS, WAYS };
    for (int way = 0; way < WAYS; way++)
        for (uint32_t f = 0; f < e->face_count; f++) {
            if (!is_live(&p, f) || p.mate[f] != QW_NONE) continue;
            if (way == SPLIT) split_way(&p, f);
            else walk_from(&p, f, way == ACROSS);
        }
    for (uint32_t f = 0; f < e->face_count; f++) counts->unpaired += is_live(&p, f) && p.mate[f] == QW_NONE;
    return make_quads(&p, vertex_of);
}

/* ---- three quads a triangle: (corner, middle of the edge ahead, centre, middle of the edge behind) for each corner */

static qw_quadmesh room_for_cuts(qw_env *env, const qw_edit *e)
{
    size_t n = (size_t)e->live_vertices + (size_t)4 * e->live_faces, sides = (size_t)12 * e->live_faces;
    qw_quadmesh q = {0};
    q.position = QW_NEW(env, qw_vec3, n), q.kind = QW_NEW_ZERO(env, uint8_t, n), q.component = QW_NEW(env, uint32_t, n);
    q.corner = QW_NEW(env, uint32_t, sides), q.twin = QW_NEW(env, uint32_t, sides),
    q.mark = QW_NEW_ZERO(env, uint8_t, sides);
    return q;
}

static uint32_t put_vertex(qw_quadmesh *q, qw_vec3 position, uint8_t kind, uint32_t component)
{
    q->position[q->vertex_count] = position, q->kind[q->vertex_count] = kind, q->component[q->vertex_count] = component;
    return q->vertex_count++;
}

/* Vertex at the middle of h's edge, made on the first visit from either side. */
static uint32_t middle_of(const qw_edit *e, uint32_t h, uint32_t *middle, qw_quadmesh *q)
{
    assert(h < 4 * e->face_count);
    const qw_edit_vertex *a = &e->vertex[qw_edit_tail(e, h)], *b = &e->vertex[qw_edit_head(e, h)];
    uint32_t twin = qw_edit_twin(e, h);
    bool curve = qw_edit_on_curve(e, h) && a->kind && b->kind;
    if (middle[h] == QW_NONE)
        middle[h] = put_vertex(q, qw_lerp(a->position, b->position, 0.5f), curve ? QW_VERTEX_CURVE : QW_VERTEX_FREE,
                               a->home);
    if (twin != QW_NONE) middle[twin] = middle[h];
    return middle[h];
}

qw_quadmesh qw_cut_triangles(qw_env *env, const qw_edit *e)
{
    assert(e->live_faces <= e->face_count && e->live_vertices <= e->vertex_count);
    qw_quadmesh q = room_for_cuts(env, e);
    uint32_t *number = QW_NEW(env, uint32_t, e->vertex_count), *first = QW_NEW(env, uint32_t, e->face_count), faces = 0;
    uint32_t *middle = QW_NEW(env, uint32_t, (size_t)4 * e->face_count);
    memset(middle, 0xff, (size_t)4 * e->face_count * sizeof *middle);
    for (uint32_t v = 0; v < e->vertex_count; v++)
        if (e->vertex[v].out != QW_NONE)
            number[v] = put_vertex(&q, e->vertex[v].position, e->vertex[v].kind, e->vertex[v].home);
    for (uint32_t f = 0; f < e->face_count; f++)
        if (!qw_edit_dead(e, f)) first[f] = faces, faces += 3;
    for (uint32_t f = 0; f < e->face_count; f++) {
        if (qw_edit_dead(e, f)) continue;
        const uint32_t *c = e->face[f].corner;
        qw_vec3 sum = qw_add(qw_add(e->vertex[c[0]].position, e->vertex[c[1]].position), e->vertex[c[2]].position);
        uint32_t center = put_vertex(&q, qw_scale(sum, 1.0f / 3), QW_VERTEX_FREE, e->vertex[c[0]].home);
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t h = 4 * f + i, back = qw_edit_prev(h), t = qw_edit_twin(e, h), bt = qw_edit_twin(e, back),
                     k = 4 * (first[f] + i);
            q.corner[k] = number[c[i]], q.corner[k + 1] = middle_of(e, h, middle, &q);
            q.corner[k + 2] = center, q.corner[k + 3] = middle_of(e, back, middle, &q);
            /* side 0 and the neighbour's side 3 are halves of the edge; sides 1 and 2 meet the triangle's own quads */
            q.twin[k] = t == QW_NONE ? QW_NONE : 4 * (first[t >> 2] + ((t & 3) + 1) % 3) + 3;
            q.twin[k + 1] = 4 * (first[f] + (i + 1) % 3) + 2;
            q.twin[k + 2] = 4 * (first[f] + (i + 2) % 3) + 1;
            q.twin[k + 3] = bt == QW_NONE ? QW_NONE : 4 * (first[bt >> 2] + (bt & 3));
            q.mark[k] = qw_edit_mark(e, h), q.mark[k + 3] = qw_edit_mark(e, back);
        }
    }
    q.face_count = faces;
    qw_free(env, number), qw_free(env, first), qw_free(env, middle);
    return q;
}
