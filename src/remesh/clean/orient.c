/* Orientation: neighbours alike by a flood, then each component as a whole.
 *
 * The flood turns a face over when its neighbour asks for it. Where two parts of the front meet with contradicting
 * wants the component is one-sided, and the edge is cut. The flood takes all faces that agree in the file before it
 * crosses to those that do not, so that the cuts form a seam where the file disagrees with itself, and short because
 * the front is breadth first. A closed component is turned outward by the sign of its volume, but a cavity keeps what
 * the file says: one whose faces agreed from the start and that lies in the material of the other closed ones (a ray
 * from it crosses them an odd number of times). So does a file all of whose closed components are inside out.
 */
#include "remesh/clean/sheets.h"

#include "base/sort.h"
#include "geometry/trimesh.h"

#include <assert.h>
#include <string.h>

typedef struct piece {
    double volume; /* six times the signed volume, seen as the flood turned its faces; about a point near it */
    double area_kept, area_turned; /* twice the area of faces as in the file, and flipped, by the flood */
    uint32_t first_face;
    bool closed, turn; /* turn: turn the whole piece over after the flood */
} piece;

typedef struct pieces {
    uint32_t count;
    size_t capacity;
    piece *piece;    /* piece[count] */
    uint32_t *of;    /* uint32_t[face_count] */
    uint8_t *turned; /* uint8_t[face_count] */
} pieces;

static const double *corner_point(const qw_sheets *s, size_t h) { return s->position + 3 * (size_t)s->corner[h]; }

/* ---- flood */

static bool same_direction(const qw_sheets *s, uint32_t h, uint32_t t) { return s->corner[h] == s->corner[t]; }

/* Two queues: faces reached so far without a further disagreement, and half-edges across which there is one. */
typedef struct front {
    uint32_t *now, now_count;                 /* uint32_t[face_count] */
    uint32_t *later, later_count, later_next; /* grows: most files agree with themselves */
    size_t later_capacity;
} front;

/* Whether both faces of the edge have a definite side in the file, and these disagree. */
static bool disagrees(const qw_sheets *s, uint32_t h, uint32_t t)
{
    return same_direction(s, h, t) && s->kind[h / 3] != QW_FACE_BOTH && s->kind[t / 3] != QW_FACE_BOTH;
}

/* Goes on across half-edge h: the neighbour is turned to agree, or, where it has been turned otherwise, the edge
 * becomes a seam. */
static void cross(qw_sheets *s, pieces *p, uint32_t h, front *q, uint32_t *seams)
{
    assert(h < 3 * s->face_count);
    assert(p->of[h / 3] != QW_NONE);
    uint32_t t = s->twin[h];
    if (t == QW_NONE) return;
    uint8_t wanted = p->turned[h / 3] ^ same_direction(s, h, t);
    if (p->of[t / 3] == QW_NONE) {
        p->of[t / 3] = p->of[h / 3];
        p->turned[t / 3] = wanted;
        q->now[q->now_count++] = t / 3;
    } else if (p->turned[t / 3] != wanted) {
        s->twin[h] = s->twin[t] = QW_NONE;
        ++*seams;
    }
}

/* Collects the piece of the seed: over edges whose sides agree in the file first, over the others when none of
 * those is left. */
static void flood_from(qw_env *env, qw_sheets *s, pieces *p, uint32_t seed, front *q, uint32_t *seams)
{
    assert(seed < s->face_count);
    q->now_count = q->later_count = q->later_next = 0;
    q->now[q->now_count++] = seed;
    for (uint32_t next = 0; next < q->now_count;) {
        uint32_t f = q->now[next++];
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            if (s->twin[h] == QW_NONE || !disagrees(s, h, s->twin[h])) {
                cross(s, p, h, q, seams);
                continue;
            }
            q->later = qw_grow(env, q->later, &q->later_capacity, (size_t)q->later_count + 1, sizeof *q->later);
            q->later[q->later_count++] = h;
        }
        while (next == q->now_count && q->later_next < q->later_count) cross(s, p, q->later[q->later_next++], q, seams);
    }
}

typedef struct unlike {
    const qw_sheets *sheets;
    uint8_t *found; /* uint8_t[blocks] */
} unlike;

static void find_unlike(void *user, uint32_t begin, uint32_t end)
{
    const unlike *u = user;
    bool found = false;
    for (uint32_t h = 3 * begin; h < 3 * end; h++)
        found |= u->sheets->twin[h] != QW_NONE && same_direction(u->sheets, h, u->sheets->twin[h]);
    u->found[begin / QW_GRAIN_LIGHT] = found;
}

/* Whether neighbours are alike as they are, as in most files. */
static bool are_alike(qw_env *env, const qw_sheets *s)
{
    uint32_t blocks = qw_block_count(s->face_count, QW_GRAIN_LIGHT);
    unlike u = {s, QW_NEW_ZERO(env, uint8_t, blocks)};
    qw_parallel(env, s->face_count, QW_GRAIN_LIGHT, find_unlike, &u);
    bool alike = !memchr(u.found, 1, blocks);
    qw_free(env, u.found);
    return alike;
}

static void begin_piece(qw_env *env, pieces *p, uint32_t first)
{
    assert(p->of[first] == p->count);
    p->piece = qw_grow(env, p->piece, &p->capacity, (size_t)p->count + 1, sizeof *p->piece);
    p->piece[p->count++] = (piece){.first_face = first, .closed = true};
}

/* Cuts the surface into pieces that can be oriented alike. *seams: raised by each edge that is cut. */
static void flood(qw_env *env, qw_sheets *s, pieces *p, uint32_t *seams)
{
    front queue = {.now = QW_NEW(env, uint32_t, s->face_count)};
    for (uint32_t f = 0; f < s->face_count; f++) p->of[f] = QW_NONE;
    for (uint32_t seed = 0; seed < s->face_count; seed++) {
        if (p->of[seed] != QW_NONE) continue;
        p->of[seed] = p->count;
        begin_piece(env, p, seed);
        flood_from(env, s, p, seed, &queue, seams);
    }
    qw_free(env, queue.now), qw_free(env, queue.later);
}

/* s->component is the pieces' own, as nothing that is cut at seams falls apart. */
static pieces find_pieces(qw_env *env, qw_sheets *s, uint32_t *seams)
{
    pieces p = {.of = s->component, .turned = QW_NEW_ZERO(env, uint8_t, s->face_count)};
    if (are_alike(env, s)) {
        qw_label_components(env, 3, s->twin, s->face_count, p.of);
        for (uint32_t f = 0; f < s->face_count; f++)
            if (p.of[f] == p.count) begin_piece(env, &p, f);
    } else {
        flood(env, s, &p, seams);
    }
    return p;
}

/* Twice the face's area along its normal. */
static void area_vector(const qw_sheets *s, uint32_t f, double *n)
{
    assert(f < s->face_count);
    const double *a = corner_point(s, 3 * (size_t)f), *b = corner_point(s, 3 * (size_t)f + 1),
                 *c = corner_point(s, 3 * (size_t)f + 2);
    double u[3], v[3];
    for (int k = 0; k < 3; k++) {
        u[k] = b[k] - a[k];
        v[k] = c[k] - a[k];
    }
    for (int k = 0; k < 3; k++) n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
}

/* What a face adds to its piece. */
typedef struct portion {
    double volume;
    double area;
    bool open;
} portion;

typedef struct measuring {
    const qw_sheets *sheets;
    const pieces *pieces;
    portion *portion; /* portion[face_count] */
} measuring;

/* What each triangle adds to its piece: signed volume, area and whether it is open. */
static void measure_faces(void *user, uint32_t begin, uint32_t end)
{
    assert(end <= ((const measuring *)user)->sheets->face_count);
    const measuring *m = user;
    const qw_sheets *s = m->sheets;
    for (uint32_t f = begin; f < end; f++) {
        const double *origin = corner_point(s, 3 * (size_t)m->pieces->piece[m->pieces->of[f]].first_face),
                     *a = corner_point(s, 3 * (size_t)f);
        double n[3], volume = 0, area = 0;
        area_vector(s, f, n);
        for (int k = 0; k < 3; k++) {
            volume += (a[k] - origin[k]) * n[k];
            area += n[k] * n[k];
        }
        bool open = s->twin[3 * (size_t)f] == QW_NONE || s->twin[3 * (size_t)f + 1] == QW_NONE ||
                    s->twin[3 * (size_t)f + 2] == QW_NONE;
        m->portion[f] = (portion){m->pieces->turned[f] ? -volume : volume, s->kind[f] != QW_FACE_BOTH ? sqrt(area) : 0,
                                  open};
    }
}

/* Volume, areas and closedness of each piece. */
static void measure(qw_env *env, const qw_sheets *s, pieces *p)
{
    assert(p->of && p->piece);
    measuring m = {s, p, QW_NEW(env, portion, s->face_count)};
    qw_parallel(env, s->face_count, QW_GRAIN_LIGHT, measure_faces, &m);
    for (uint32_t f = 0; f < s->face_count; f++) {
        piece *q = &p->piece[p->of[f]];
        q->volume += m.portion[f].volume;
        *(p->turned[f] ? &q->area_turned : &q->area_kept) += m.portion[f].area;
        q->closed &= !m.portion[f].open;
    }
    qw_free(env, m.portion);
}

/* ---- cavities */

/* Rays run up from one point of each suspect. The keys are sorted by x, so that a face meets only those in its range.
 */
typedef struct suspects {
    uint32_t count;
    uint64_t *key;       /* uint64_t[count]: x << 32 | piece */
    double (*from)[3];   /* double[pieces][3] */
    uint32_t *crossings; /* uint32_t[pieces] */
} suspects;

/* Meshes in which most pieces are inside out and every face spans all of them: past so many tests nothing counts as a
 * cavity. */
static const uint64_t CAVITY_TESTS = 200u * 1000 * 1000;

/* A number that sorts like x, rounded, in the upper half. */
static uint64_t key_of(double x) { return (uint64_t)qw_signed_float_key((float)x) << 32; }

/* Whether the vertical line through p crosses the face above p. Half-open comparisons, and edges always taken from
   their lower vertex, count a line through an edge or a vertex of a closed surface once. */
static bool crosses_above(const qw_sheets *s, uint32_t f, const double *p)
{
    assert(f < s->face_count);
    bool inside = false;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        uint32_t a = s->corner[h], b = s->corner[qw_next(h)];
        const double *q = s->position + 3 * (size_t)(a < b ? a : b), *r = s->position + 3 * (size_t)(a < b ? b : a);
        if ((q[1] > p[1]) == (r[1] > p[1])) continue;
        inside ^= p[0] < q[0] + (p[1] - q[1]) / (r[1] - q[1]) * (r[0] - q[0]);
    }
    if (!inside) return false;
    double n[3];
    area_vector(s, f, n);
    const double *a = corner_point(s, 3 * (size_t)f);
    double above = (a[0] - p[0]) * n[0] + (a[1] - p[1]) * n[1] +
                   (a[2] - p[2]) * n[2]; /* height of the plane over p, times n[2] */
    return n[2] > 0 ? above > 0 : above < 0;
}

/* The closed pieces of negative volume that are all as in the file: cavities, or inside out, which rays from their
 * first triangles tell. Sorted for the sweep. */
static suspects find_suspects(qw_env *env, const qw_sheets *s, const pieces *p)
{
    suspects t = {.key = QW_NEW(env, uint64_t, p->count), .crossings = QW_NEW_ZERO(env, uint32_t, p->count)};
    t.from = qw_alloc(env, p->count, sizeof *t.from);
    for (uint32_t i = 0; i < p->count; i++) {
        const piece *q = &p->piece[i];
        if (!q->closed || q->volume >= 0 || q->area_turned > 0) continue;
        for (int k = 0; k < 3; k++) {
            t.from[i][k] = 0;
            for (size_t j = 0; j < 3; j++) t.from[i][k] += corner_point(s, 3 * (size_t)q->first_face + j)[k] / 3;
        }
        t.key[t.count++] = key_of(t.from[i][0]) | i;
    }
    qw_sort_u64(t.key, t.count);
    return t;
}

/* Clears `turn` of the cavities. Returns early, with all of them turned, when the budget is spent. */
static void spare_cavities(qw_env *env, const qw_sheets *s, pieces *p)
{
    uint32_t closed = 0;
    for (uint32_t i = 0; i < p->count; i++) closed += p->piece[i].closed;
    if (closed < 2) return;
    qw_scope_begin(env);
    suspects t = find_suspects(env, s, p);
    uint64_t budget = CAVITY_TESTS;
    for (uint32_t f = 0; f < s->face_count && t.count > 0; f++) {
        if (!p->piece[p->of[f]].closed) continue;
        const double *a = corner_point(s, 3 * (size_t)f), *b = corner_point(s, 3 * (size_t)f + 1),
                     *c = corner_point(s, 3 * (size_t)f + 2);
        uint64_t last = key_of(fmax(a[0], fmax(b[0], c[0]))) | UINT32_MAX;
        uint32_t i = (uint32_t)qw_first_not_below(t.key, t.count, key_of(fmin(a[0], fmin(b[0], c[0]))));
        for (; i < t.count && t.key[i] <= last && budget > 0; i++, budget--) {
            uint32_t piece_index = (uint32_t)t.key[i];
            if (piece_index != p->of[f]) t.crossings[piece_index] += crosses_above(s, f, t.from[piece_index]);
        }
    }
    for (uint32_t i = 0; i < t.count && budget > 0; i++)
        if (t.crossings[(uint32_t)t.key[i]] % 2 == 1) p->piece[(uint32_t)t.key[i]].turn = false;
    qw_scope_end(env);
}

/* ---- turn */

static uint32_t turned_half(const pieces *p, uint32_t h) { return p->turned[h / 3] ? h / 3 * 3 + (2 - h % 3) : h; }

/* Turns the faces over. Corners (a, b, c) become (a, c, b), so that side i becomes side 2 - i. */
static void turn_faces(qw_sheets *s, const pieces *p)
{
    assert(p->turned && s->twin);
    if (!memchr(p->turned, 1, s->face_count)) return;
    for (uint32_t f = 0; f < s->face_count; f++) {
        uint32_t *c = s->corner + 3 * (size_t)f, *t = s->twin + 3 * (size_t)f;
        for (int i = 0; i < 3; i++)
            if (t[i] != QW_NONE) t[i] = turned_half(p, t[i]);
        if (!p->turned[f]) continue;
        uint32_t corner = c[1], twin = t[0];
        c[1] = c[2];
        c[2] = corner;
        t[0] = t[2];
        t[2] = twin;
    }
}

/* Whether all closed pieces agree from the start that inside is out: then that is what the file means, and whoever
   reads the result with the input's normals in mind finds them as they were. */
static bool is_inside_out(const pieces *p)
{
    uint32_t closed = 0;
    for (uint32_t i = 0; i < p->count; i++) {
        const piece *q = &p->piece[i];
        if (!q->closed) continue;
        if (q->volume >= 0 || q->area_turned > 0) return false;
        closed++;
    }
    return closed > 0;
}

/* Whether a closed component as a whole was inside out, not only some of its triangles: most of its area is turned. */
static bool is_turned_as_whole(const piece *q)
{
    return q->closed && (q->turn ? q->area_kept > q->area_turned : q->area_turned > q->area_kept);
}

static qw_oriented count_turned(const qw_sheets *s, const pieces *p)
{
    qw_oriented is = {0};
    for (uint32_t f = 0; f < s->face_count; f++) {
        is.triangles += p->turned[f];
        is.alone += p->turned[f] && !is_turned_as_whole(&p->piece[p->of[f]]);
    }
    for (uint32_t i = 0; i < p->count; i++) is.components += is_turned_as_whole(&p->piece[i]);
    return is;
}

qw_oriented qw_orient_sheets(qw_env *env, qw_sheets *s, bool outward)
{
    assert(s->twin && s->corner);
    uint32_t seams = 0;
    s->component = QW_NEW(env, uint32_t, s->face_count);
    qw_scope_begin(env);
    pieces p = find_pieces(env, s, &seams);
    s->components = p.count;
    measure(env, s, &p);
    for (uint32_t i = 0; i < p.count; i++) {
        piece *q = &p.piece[i];
        q->turn = outward && q->closed && q->volume != 0 ? q->volume < 0 : q->area_turned > q->area_kept;
    }
    if (outward && is_inside_out(&p)) {
        for (uint32_t i = 0; i < p.count; i++) p.piece[i].turn &= !p.piece[i].closed;
    } else if (outward) {
        spare_cavities(env, s, &p);
    }
    for (uint32_t f = 0; f < s->face_count; f++) p.turned[f] ^= p.piece[p.of[f]].turn;
    qw_oriented is = count_turned(s, &p);
    is.seams = seams;
    turn_faces(s, &p);
    qw_scope_end(env);
    return is;
}
