#include "products/atlas/joins.h"

#include "base/elementary.h"
#include "base/vec.h"

#include <assert.h>
#include <string.h>

enum {
    RIGID_STEPS = 4,   /* of two charts: they lie flat before, and only what lies between them has to give way */
    STIFFENINGS = 2,   /* where triangles give way too much */
    FEW_TRIANGLES = 8, /* that may be stiffened in any chart */
    CRUMB = 32,        /* faces of a chart that is joined to any other in the end, however that is shaped */
    GRID_BITS = 23     /* exact tests see the root of the surface's area as so many bits: finer than what is written */
};
static const double STIFFENED = 0.02; /* of the triangles, at most: where more give way, others would in turn */
/* Root of the mean square by which two borders miss one another, of their length: charts whose borders fit worse hardly
   ever lie flat together, those that fit so well nearly always do. */
static const double MISFIT = 0.22, FIT = 0.1;
static const double SMALL_CRUMB = 0.02; /* of the surface: where a crumb is so small even sharp edges are folded */
static const double LEAST_PART = 0.25;  /* of a path that charts are joined along */

typedef qw_join_candidate candidate;
typedef qw_joiner maker;

/* How the coordinates of a chart are moved. */
typedef struct motion {
    double turn[2], shift[2];
} motion;
static const motion at_rest = {{1, 0}, {0, 0}};

/* Seams along which two charts are joined, and how the second is moved. */
typedef struct path {
    uint32_t *seam; /* uint32_t[length] */
    uint32_t length;
    motion of_b;
} path;

/* ---- a queue by keys */

static bool is_before(const candidate *a, const candidate *b)
{
    if (a->key != b->key) return a->key > b->key;
    return a->first != b->first ? a->first < b->first : a->stamp_a < b->stamp_a;
}

static void push(maker *k, candidate c)
{
    k->heap = qw_grow(k->env, k->heap, &k->capacity, k->held + (size_t)1, sizeof *k->heap);
    uint32_t at = k->held++;
    for (; at > 0 && is_before(&c, &k->heap[(at - 1) / 2]); at = (at - 1) / 2) k->heap[at] = k->heap[(at - 1) / 2];
    k->heap[at] = c;
}

/* Takes the first candidate off the heap. */
static candidate pop(maker *k)
{
    candidate first = k->heap[0], last = k->heap[--k->held];
    uint32_t at = 0;
    for (uint32_t child; (child = 2 * at + 1) < k->held; at = child) {
        if (child + 1 < k->held && is_before(&k->heap[child + 1], &k->heap[child])) child++;
        if (!is_before(&k->heap[child], &last)) break;
        k->heap[at] = k->heap[child];
    }
    k->heap[at] = last;
    return first;
}

/* ---- where charts lie */

double qw_seam_cost(const maker *k, uint32_t c)
{
    return qw_atlas_edge_length(k->m, c) * (k->weight ? k->weight[c] : 1);
}

double qw_chart_perimeter(const maker *k, const qw_chart *c)
{
    double sum = 0;
    for (uint32_t i = 0; i < c->count; i++)
        for (uint32_t e = k->m->begin[c->face[i]]; e < k->m->begin[c->face[i] + 1]; e++)
            if (k->m->seam[e]) sum += qw_atlas_edge_length(k->m, e);
    return sum;
}

static void move(const motion *by, const double p[2], double to[2])
{
    to[0] = by->turn[0] * p[0] - by->turn[1] * p[1] + by->shift[0];
    to[1] = by->turn[1] * p[0] + by->turn[0] * p[1] + by->shift[1];
}

/* Adds four times the angle of each edge of a moved chart, as a complex number of the edge's length. */
static void add_rows(const maker *k, const qw_chart *c, const motion *by, double sum[2])
{
    for (uint32_t i = 0; i < c->count; i++)
        for (uint32_t e = k->m->begin[c->face[i]]; e < k->m->begin[c->face[i] + 1]; e++) {
            double p[2], q[2];
            move(by, k->made.uv[e], p), move(by, k->made.uv[qw_atlas_next(k->m, e)], q);
            double x = q[0] - p[0], y = q[1] - p[1], n = x * x + y * y;
            if (!(n > 0)) continue;
            double cosine = (x * x - y * y) / n, sine = 2 * x * y / n, l = sqrt(n);
            sum[0] += l * (cosine * cosine - sine * sine), sum[1] += l * 2 * cosine * sine;
        }
}

static void add_box(const maker *k, const qw_chart *c, const motion *by, double angle, double box[4])
{
    const motion back = {{qw_cos(angle), -qw_sin(angle)}, {0, 0}};
    for (uint32_t i = 0; i < c->count; i++)
        for (uint32_t e = k->m->begin[c->face[i]]; e < k->m->begin[c->face[i] + 1]; e++) {
            double p[2], q[2];
            if (!k->m->seam[e]) continue;
            move(by, k->made.uv[e], p), move(&back, p, q);
            for (int r = 0; r < 2; r++) box[r] = fmin(box[r], q[r]), box[2 + r] = fmax(box[2 + r], q[r]);
        }
}

/* Of the rectangle along their rows around two charts; b: NULL: around one. */
static void size_of(const maker *k, const qw_chart *a, const qw_chart *b, const motion *of_b, double size[2])
{
    double rows[2] = {0, 0}, box[4] = {INFINITY, INFINITY, -INFINITY, -INFINITY};
    add_rows(k, a, &at_rest, rows);
    if (b) add_rows(k, b, of_b, rows);
    double angle = rows[0] != 0 || rows[1] != 0 ? qw_atan2(rows[1], rows[0]) / 4 : 0;
    add_box(k, a, &at_rest, angle, box);
    if (b) add_box(k, b, of_b, angle, box);
    size[0] = box[2] - box[0], size[1] = box[3] - box[1];
}

void qw_chart_size(const maker *k, const qw_chart *c, double size[2]) { size_of(k, c, NULL, NULL, size); }

bool qw_is_too_long(const maker *k, const double size[2]) { return fmax(size[0], size[1]) > k->bounds.longest; }

/* How chart b is moved so that seams fit those of a, as least squares. Returns by how much they miss one another. */
static double align(const maker *k, const uint32_t *seam, uint32_t length, motion *of_b)
{
    double pa[2] = {0, 0}, pb[2] = {0, 0}, dot = 0, cross = 0, squares = 0, way = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t i = 0; i < length; i++) {
            uint32_t h = seam[i], t = k->m->twin[h];
            const double *a[2] = {k->made.uv[h], k->made.uv[qw_atlas_next(k->m, h)]};
            const double *b[2] = {k->made.uv[qw_atlas_next(k->m, t)], k->made.uv[t]};
            double x = a[1][0] - a[0][0], y = a[1][1] - a[0][1];
            way += pass ? sqrt(x * x + y * y) : 0;
            for (int e = 0; e < 2; e++) {
                for (int r = 0; r < 2 && !pass; r++) pa[r] += a[e][r] / (2 * length), pb[r] += b[e][r] / (2 * length);
                if (!pass) continue;
                double ax = a[e][0] - pa[0], ay = a[e][1] - pa[1], bx = b[e][0] - pb[0], by = b[e][1] - pb[1];
                dot += ax * bx + ay * by, cross += bx * ay - by * ax;
                squares += ax * ax + ay * ay + bx * bx + by * by;
            }
        }
    }
    double l = sqrt(dot * dot + cross * cross);
    of_b->turn[0] = l > 0 ? dot / l : 1, of_b->turn[1] = l > 0 ? cross / l : 0;
    of_b->shift[0] = pa[0] - (of_b->turn[0] * pb[0] - of_b->turn[1] * pb[1]);
    of_b->shift[1] = pa[1] - (of_b->turn[1] * pb[0] + of_b->turn[0] * pb[1]);
    return way > 0 ? sqrt(fmax(0, squares - 2 * l) / (2 * length)) / way : 0;
}

/* ---- the seams of a candidate */

/* Sharp edges are not while crumbs are joined. */
static bool is_fixed(const maker *k, uint32_t c)
{
    return k->m->wall[c] >= (k->bounds.only_crumbs ? QW_WALL_BORDER : QW_WALL_SHARP);
}

static bool is_crumb(const qw_chart *c) { return c->count < CRUMB; }

/* Whether a path holds a sharp edge, and no chart at it is so small that nobody would keep it by itself. */
static bool folds_sharply(const maker *k, const candidate *c, const path *p)
{
    const qw_chart *a = &k->made.chart[c->a], *b = &k->made.chart[c->b];
    bool small = (is_crumb(a) && a->box < SMALL_CRUMB * k->total) || (is_crumb(b) && b->box < SMALL_CRUMB * k->total);
    for (uint32_t i = 0; i < p->length && !small; i++)
        if (k->m->wall[p->seam[i]] >= QW_WALL_SHARP) return true;
    return false;
}

/* Seams of a candidate's path; with `all`, all between its charts, which may lie apart: what they make has holes then.
 */
static path seams_of(const maker *k, const candidate *c, bool all)
{
    const qw_atlas_mesh *m = k->m;
    path p = {.length = 0};
    size_t room = 0;
    for (uint32_t i = 0, h = c->first; i < c->length && !all; i++, h = qw_next_seam(m, h)) {
        p.seam = qw_grow(k->env, p.seam, &room, i + (size_t)1, sizeof *p.seam);
        p.seam[p.length++] = h;
    }
    const qw_chart *a = &k->made.chart[c->a];
    for (uint32_t i = 0; i < a->count && all; i++)
        for (uint32_t h = m->begin[a->face[i]]; h < m->begin[a->face[i] + 1]; h++) {
            if (!m->seam[h] || is_fixed(k, h) || k->chart_of[m->face[m->twin[h]]] != c->b) continue;
            p.seam = qw_grow(k->env, p.seam, &room, p.length + (size_t)1, sizeof *p.seam);
            p.seam[p.length++] = h;
        }
    return p;
}

/* Shortens a path to the longest part from one of its ends along which the charts fit: two halves of a tube become one
   that is cut once, what goes around a tip is cut up to it. */
static void keep_fitting(const maker *k, path *p)
{
    for (uint32_t part = p->length; part > 0 && part >= LEAST_PART * p->length; part--)
        for (int end = 0; end < 2; end++) {
            const uint32_t *from = p->seam + (end ? p->length - part : 0);
            motion by;
            if (align(k, from, part, &by) > FIT) continue;
            memmove(p->seam, from, part * sizeof *from);
            p->length = part;
            return;
        }
    p->length = 0;
}

/* Whether the charts fit along a path, and the seams that go are worth the room that is lost around what they make. */
static bool is_worth(maker *k, const candidate *c, path *p)
{
    const qw_chart *a = &k->made.chart[c->a], *b = &k->made.chart[c->b];
    double size[2], gain = 0, root = sqrt(k->total);
    if (p->length == 0 || align(k, p->seam, p->length, &p->of_b) > MISFIT) return false;
    for (uint32_t i = 0; i < p->length; i++) gain += qw_seam_cost(k, p->seam[i]);
    size_of(k, a, b, &p->of_b, size);
    if (qw_is_too_long(k, size)) return false;
    bool worth = gain * root >= k->bounds.waste * (size[0] * size[1] - a->box - b->box);
    k->lacks_worth |= !worth;
    return worth;
}

static void set_path(const maker *k, const path *p, uint8_t is_seam)
{
    for (uint32_t i = 0; i < p->length; i++) qw_set_seam(k->m, p->seam[i], is_seam);
}

/* ---- symmetric surfaces */

/* The chart that lies opposite to one, face by face; QW_NONE: there is none. */
uint32_t qw_chart_opposite(const maker *k, uint32_t a)
{
    const qw_chart *c = &k->made.chart[a];
    uint32_t found = QW_NONE;
    for (uint32_t i = 0; i < c->count; i++) {
        uint32_t h = k->mirror[k->m->begin[c->face[i]]];
        uint32_t b = h == QW_NONE ? QW_NONE : k->chart_of[k->m->face[h]];
        if (b == QW_NONE || (i > 0 && b != found)) return QW_NONE;
        found = b;
    }
    return k->made.chart[found].count == c->count ? found : QW_NONE;
}

/* Whether a join has to be made on the other side too: charts that lie opposite to others. */
static bool has_opposite(const maker *k, const candidate *c)
{
    if (!k->mirror) return false;
    uint32_t a = qw_chart_opposite(k, c->a), b = qw_chart_opposite(k, c->b);
    if (a == QW_NONE || b == QW_NONE) return false;
    return !(a == c->a && b == c->b) && !(a == c->b && b == c->a);
}

/* Whether a path of two charts that both lie on the plane of symmetry, or opposite to one another, is its own mirror
   image. */
static bool is_alike(const maker *k, const candidate *c, const path *p)
{
    if (!k->mirror || has_opposite(k, c) || qw_chart_opposite(k, c->a) == QW_NONE ||
        qw_chart_opposite(k, c->b) == QW_NONE)
        return true;
    for (uint32_t i = 0; i < p->length; i++) {
        uint32_t h = k->mirror[p->seam[i]], at = 0;
        while (at < p->length && p->seam[at] != h && k->m->twin[p->seam[at]] != h) at++;
        if (h == QW_NONE || at == p->length) return false;
    }
    return true;
}

/* ---- laying flat */

bool qw_covers_once(const maker *k, const qw_flat *t)
{
    return qw_flat_is_simple(k->env, t, sqrt(fmax(t->total, k->total)) / (1 << GRID_BITS));
}

bool qw_lies_fair(const maker *k, const qw_flat *t)
{
    qw_stretch s = qw_flat_stretch(t);
    double most = k->bounds.most_stretch;
    return s.inverted == 0 && s.mean <= most && s.most <= k->bounds.most_of_one * most && qw_covers_once(k, t);
}

/* Coordinates to begin with: those of a, and of b as it is moved; the mean where they meet. */
static void begin_at(const maker *k, qw_flat *t, uint32_t of_a, const motion *of_b)
{
    uint32_t *n = QW_NEW_ZERO(k->env, uint32_t, t->vertex_count);
    for (uint32_t i = 0; i < t->corner_count; i++) {
        double p[2];
        move(i < of_a ? &at_rest : of_b, k->made.uv[t->place[i]], p);
        for (int r = 0; r < 2; r++) t->at[t->vertex[i]][r] += p[r];
        n[t->vertex[i]]++;
    }
    for (uint32_t v = 0; v < t->vertex_count; v++) t->at[v][0] /= n[v], t->at[v][1] /= n[v];
    qw_free(k->env, n);
}

/* As rigid as possible, those triangles more that give way too much, as long as few do. */
static void lay_flat(const maker *k, qw_flat *t)
{
    qw_flat_rigid(k->env, t, RIGID_STEPS);
    for (uint32_t round = 0; round < STIFFENINGS; round++) {
        uint32_t count = qw_flat_stiffen(t, k->bounds.most_of_one * k->bounds.most_stretch);
        if (count == 0 || count > STIFFENED * t->triangle_count + FEW_TRIANGLES) return;
        qw_flat_rigid(k->env, t, RIGID_STEPS);
    }
}

/* Copies the coordinates of a chart's corners out, or back in. */
static void copy_uv(const maker *k, const qw_chart *c, double (*uv)[2], bool is_out)
{
    for (uint32_t i = 0, n = 0; i < c->count; i++)
        for (uint32_t e = k->m->begin[c->face[i]]; e < k->m->begin[c->face[i] + 1]; e++, n++)
            memcpy(is_out ? uv[n] : k->made.uv[e], is_out ? k->made.uv[e] : uv[n], sizeof *uv);
}

static uint32_t corners_of(const maker *k, const qw_chart *c)
{
    uint32_t sum = 0;
    for (uint32_t i = 0; i < c->count; i++) sum += k->m->begin[c->face[i] + 1] - k->m->begin[c->face[i]];
    return sum;
}

/* Whether the two charts, joined along a path, lie flat fairly: then their coordinates are those, and the seams of the
   path are gone. */
static bool lay_together(maker *k, const candidate *c, const path *p)
{
    const qw_chart *a = &k->made.chart[c->a], *b = &k->made.chart[c->b];
    assert(c->a != c->b && p->length > 0);
    qw_scope_begin(k->env);
    uint32_t *face = QW_NEW(k->env, uint32_t, a->count + (size_t)b->count);
    memcpy(face, a->face, a->count * sizeof *face), memcpy(face + a->count, b->face, b->count * sizeof *face);
    set_path(k, p, 0);
    qw_flat t = qw_flat_of(k->env, k->m, face, a->count + b->count, k->local);
    bool good = qw_flat_is_planar(&t);
    if (good) {
        begin_at(k, &t, corners_of(k, a), &p->of_b);
        lay_flat(k, &t);
        good = qw_lies_fair(k, &t);
    }
    for (uint32_t i = 0; i < t.corner_count && good; i++)
        memcpy(k->made.uv[t.place[i]], t.at[t.vertex[i]], sizeof *t.at);
    if (!good) set_path(k, p, 1);
    k->made.tries++;
    qw_scope_end(k->env);
    return good;
}

/* Lays the charts of a candidate flat together: joined along all seams between them, else along its path, else along
   the part of that along which they fit. */
static bool lay_candidate(maker *k, const candidate *c, path *p)
{
    uint32_t tried = 0;
    assert(c->a != c->b && k->made.chart[c->a].into == c->a && k->made.chart[c->b].into == c->b);
    k->lacks_worth = false;
    for (int way = 0; way < 3; way++) {
        *p = seams_of(k, c, way == 0);
        if (way == 2) keep_fitting(k, p);
        bool open = p->length != tried && !folds_sharply(k, c, p) && is_alike(k, c, p);
        if (open && is_worth(k, c, p) && lay_together(k, c, p)) return true;
        tried = p->length;
        qw_free(k->env, p->seam), p->seam = NULL;
    }
    return false;
}

/* ---- candidates */

static uint32_t chart_now(const maker *k, uint32_t a)
{
    while (k->made.chart[a].into != a) a = k->made.chart[a].into;
    return a;
}

static bool was_refused(const maker *k, uint32_t a, uint32_t b)
{
    for (uint32_t i = 0; i < k->made.chart[a].refusals; i++)
        if (chart_now(k, k->made.chart[a].refused[i].chart) == b) return true;
    return false;
}

static void refuse(maker *k, uint32_t a, uint32_t b, uint32_t faces)
{
    qw_chart *c = &k->made.chart[a];
    c->refused = qw_grow(k->env, c->refused, &c->room, c->refusals + (size_t)1, sizeof *c->refused);
    c->refused[c->refusals++] = (qw_refusal){b, faces};
}

/* Refusals of charts that are as they were, and would be no better now. */
static void keep_refusals(maker *k, uint32_t a)
{
    qw_chart *c = &k->made.chart[a];
    uint32_t kept = 0;
    for (uint32_t i = 0; i < c->refusals; i++) {
        qw_refusal r = c->refused[i];
        if (r.faces == c->count + k->made.chart[chart_now(k, r.chart)].count) c->refused[kept++] = r;
    }
    c->refusals = kept;
}

/* Whether the path goes on from a seam to the next: at the vertex between them the same chart lies across, and there,
   too, they follow one another. */
static bool goes_on(const maker *k, uint32_t h, uint32_t next, uint32_t b)
{
    const qw_atlas_mesh *m = k->m;
    if (m->twin[next] == QW_NONE || is_fixed(k, next) || k->chart_of[m->face[m->twin[next]]] != b) return false;
    return qw_next_seam(m, m->twin[next]) == m->twin[h];
}

/* The candidate whose path holds seam h of chart a: as long as it can be. Its key: how much of the shorter boundary
   goes. */
static void offer(maker *k, uint32_t a, uint32_t h, uint32_t length, double weight)
{
    uint32_t b = k->chart_of[k->m->face[k->m->twin[h]]];
    const qw_chart *ca = &k->made.chart[a], *cb = &k->made.chart[b];
    if (was_refused(k, a, b) || was_refused(k, b, a)) return;
    if (k->bounds.only_crumbs && !is_crumb(ca) && !is_crumb(cb)) return;
    if (k->bounds.only_loose && ca->is_loose == cb->is_loose) return;
    candidate c = {.a = a, .b = b, .stamp_a = ca->stamp, .stamp_b = cb->stamp, .first = h, .length = length};
    c.key = weight / fmin(ca->perimeter, cb->perimeter);
    push(k, c);
}

/* The paths of one loop of the boundary of chart a, which seam h is of. Seams that have been looked at are 2. */
static void offer_loop(maker *k, uint32_t a, uint32_t h)
{
    const qw_atlas_mesh *m = k->m;
    uint32_t first = h, b = QW_NONE, begin = QW_NONE, length = 0, last = QW_NONE;
    double weight = 0;
    /* begins where a path begins, if there is such a place */
    do {
        uint32_t next = qw_next_seam(m, h);
        uint32_t across = m->twin[h] == QW_NONE ? QW_NONE : k->chart_of[m->face[m->twin[h]]];
        if (across == QW_NONE || !goes_on(k, h, next, across)) {
            first = next;
            break;
        }
        h = next;
    } while (h != first);
    h = first;
    do {
        uint32_t across = m->twin[h] == QW_NONE || is_fixed(k, h) ? QW_NONE : k->chart_of[m->face[m->twin[h]]];
        if (length > 0 && !(across == b && goes_on(k, last, h, b))) {
            offer(k, a, begin, length, weight);
            length = 0;
        }
        if (across != QW_NONE && across != a) {
            if (length == 0) begin = h, b = across, weight = 0;
            assert(b == across);
            length++, weight += qw_seam_cost(k, h), last = h;
        }
        m->seam[h] = 2;
        h = qw_next_seam(m, h);
    } while (h != first);
    if (length > 0) offer(k, a, begin, length, weight);
}

static void offer_all(maker *k, uint32_t a)
{
    const qw_atlas_mesh *m = k->m;
    const qw_chart *c = &k->made.chart[a];
    for (uint32_t i = 0; i < c->count; i++)
        for (uint32_t e = m->begin[c->face[i]]; e < m->begin[c->face[i] + 1]; e++)
            if (m->seam[e] == 1) offer_loop(k, a, e);
    for (uint32_t i = 0; i < c->count; i++)
        for (uint32_t e = m->begin[c->face[i]]; e < m->begin[c->face[i] + 1]; e++)
            if (m->seam[e]) m->seam[e] = 1;
}

/* ---- joins */

static void measure(const maker *k, qw_chart *c)
{
    double size[2];
    qw_chart_size(k, c, size);
    c->box = size[0] * size[1], c->perimeter = qw_chart_perimeter(k, c);
}

/* Chart b becomes a part of a, with what it was refused; b is left empty. */
static void join(maker *k, uint32_t a, uint32_t b)
{
    qw_chart *to = &k->made.chart[a], *from = &k->made.chart[b];
    to->face = qw_resize(k->env, to->face, to->count + (size_t)from->count, sizeof *to->face);
    memcpy(to->face + to->count, from->face, from->count * sizeof *to->face);
    for (uint32_t i = 0; i < from->count; i++) k->chart_of[from->face[i]] = a;
    assert(to->into == a && from->into == b);
    to->count += from->count, to->stamp++, to->is_loose = false;
    measure(k, to);
    from->into = a, from->count = 0, from->stamp++;
    for (uint32_t i = 0; i < from->refusals; i++) refuse(k, a, from->refused[i].chart, from->refused[i].faces);
    k->made.joins++;
}

/* A join and what its two charts were before. */
typedef struct made_join {
    candidate c;
    path p;
    uint32_t of_a, of_b;
    double (*uv)[2];
} made_join;

static made_join begin_join(const maker *k, const candidate *c)
{
    const qw_chart *a = &k->made.chart[c->a], *b = &k->made.chart[c->b];
    uint32_t corners = corners_of(k, a);
    made_join j = {.c = *c, .of_a = a->count, .of_b = b->count};
    j.uv = qw_alloc(k->env, corners + corners_of(k, b), sizeof *j.uv);
    copy_uv(k, a, j.uv, true), copy_uv(k, b, j.uv + corners, true);
    return j;
}

static void end_join(const maker *k, made_join *j) { qw_free(k->env, j->p.seam), qw_free(k->env, j->uv); }

/* Takes a join back: the seams, the coordinates and what the two charts were. */
static void part(maker *k, const made_join *j)
{
    qw_chart *a = &k->made.chart[j->c.a], *b = &k->made.chart[j->c.b];
    copy_uv(k, a, j->uv, false);
    for (uint32_t i = j->of_a; i < a->count; i++) k->chart_of[a->face[i]] = j->c.b;
    set_path(k, &j->p, 1);
    a->count = j->of_a, b->count = j->of_b, b->into = j->c.b;
    a->stamp++, b->stamp++, k->made.joins--;
    measure(k, a), measure(k, b);
    offer_all(k, j->c.a), offer_all(k, j->c.b);
}

/* The same join on the other side. */
static bool join_opposite(maker *k, const path *p, made_join *j)
{
    candidate c = {.a = QW_NONE};
    path other = {.seam = QW_NEW(k->env, uint32_t, p->length), .length = p->length};
    bool good = true;
    for (uint32_t i = 0; i < p->length && good; i++) {
        uint32_t h = other.seam[i] = k->mirror[p->seam[i]];
        good = h != QW_NONE && k->m->twin[h] != QW_NONE && k->m->seam[h] && !is_fixed(k, h);
        if (!good) break;
        uint32_t a = k->chart_of[k->m->face[h]], b = k->chart_of[k->m->face[k->m->twin[h]]];
        if (i == 0) c.a = a, c.b = b;
        good = c.a == a && c.b == b && a != b;
    }
    if (good) align(k, other.seam, other.length, &other.of_b), *j = begin_join(k, &c);
    j->p = other;
    good = good && lay_together(k, &c, &other);
    if (good) join(k, c.a, c.b), offer_all(k, c.a);
    return good;
}

/* Joins the charts of a candidate, and on a symmetric surface those that lie opposite too, or none; and none where
   what they make is not wanted. */
static bool make_join(maker *k, const candidate *c)
{
    made_join j = begin_join(k, c), other = {.uv = NULL};
    bool is_twice = has_opposite(k, c), good = lay_candidate(k, c, &j.p);
    if (good) {
        join(k, c->a, c->b);
        bool has_both = is_twice && join_opposite(k, &j.p, &other);
        good = has_both == is_twice && (!k->suits || k->suits(k, c->a, has_both ? other.c.a : c->a));
        if (!good && has_both) part(k, &other);
        if (!good) part(k, &j);
    }
    end_join(k, &j), end_join(k, &other);
    return good;
}

void qw_join_charts(maker *k)
{
    for (uint32_t a = 0; a < k->made.count; a++) {
        if (k->made.chart[a].count == 0) continue;
        keep_refusals(k, a);
        measure(k, &k->made.chart[a]);
    }
    for (uint32_t a = 0; a < k->made.count; a++) offer_all(k, a); /* those that were joined have no faces left */
    while (k->held > 0) {
        candidate c = pop(k);
        assert(c.a != c.b && c.a < k->made.count && c.b < k->made.count);
        if (k->suits && k->looks_left <= 0) continue;
        if (k->made.chart[c.a].stamp != c.stamp_a || k->made.chart[c.b].stamp != c.stamp_b) continue;
        if (was_refused(k, c.a, c.b)) continue;
        if (make_join(k, &c)) {
            offer_all(k, c.a);
            continue;
        }
        uint32_t faces = k->lacks_worth ? 0 : k->made.chart[c.a].count + k->made.chart[c.b].count;
        refuse(k, c.a, c.b, faces), refuse(k, c.b, c.a, faces);
    }
}
