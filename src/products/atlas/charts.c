#include "products/atlas/charts.h"

#include "base/lanes.h"
#include "base/elementary.h"
#include "base/vec.h"

#include <assert.h>
#include <string.h>

enum {
    RIGID_STEPS = 4,   /* of a merger: the parts lie flat before, and only what lies between them has to give way */
    STIFFENINGS = 2,   /* of a merger whose triangles give way too much */
    FEW_TRIANGLES = 8, /* that may be stiffened in any chart */
    CRUMB = 16,        /* faces of a chart that is joined to any other in the end, however that is shaped */
    FIRST_STEPS = 6,   /* of a patch by itself, from the circle */
    LOWER_STEPS = 40,  /* where those leave inverted triangles, and at the end */
    MOST_LANE_BYTES = 1 << 26,
    LANE_BYTES = 1024, /* a face, of the memory in which two charts are laid flat on a thread */
    GRID_BITS = 23     /* exact tests see the root of the surface's area as so many bits: finer than what is written */
};
static const double MOST_OF_ONE = 3;     /* a triangle may be stretched so much more than the mean of its chart */
static const double MOST_OF_CRUMBS = 8;  /* the same where a crumb is joined to a chart */
static const double STIFFENED = 0.02;    /* of the triangles, at most: where more give way, others would in turn */
static const double SMALL_CHART = 0.003; /* of the surface: what is smaller packs anyhow */
static const double SHARE_OF_FULL =
    8; /* more of the surface, times the square of how much more than `fill` is filled */
/* What charts must be like: larger and of freer shape each time. */
typedef struct bounds {
    double share;  /* most of the surface, in one chart */
    double length; /* most, in roots of the surface's area */
    double fill;   /* least, of the rectangle around it */
} bounds;
static const bounds levels[] = {{0.12, 0.6, 0.6},   {0.14, 0.65, 0.57}, {0.17, 0.72, 0.53}, {0.2, 0.8, 0.5},
                                {0.26, 0.95, 0.45}, {0.4, 1.2, 0.4},    {1, 3, 0.25}};
enum { LEVELS = sizeof levels / sizeof *levels };
static const double STUB = 1e-3; /* radius of faces that are laid as regular polygons, in the same roots */

typedef struct candidate {
    double key; /* larger: sooner */
    uint32_t a, b, stamp_a, stamp_b;
    uint32_t first, length; /* seams of a: from this one on along its boundary */
} candidate;

/* What came of looking whether two charts can be joined. */
typedef struct merger {
    candidate c;
    uint32_t *path, length; /* uint32_t[length]: seams that go; NULL: they cannot */
    double (*uv)[2];        /* double[corners of both][2] */
    uint32_t tries;
    bool is_known;
} merger;

typedef struct maker {
    qw_env *env;
    qw_atlas_mesh *m;
    qw_charts_made made;
    uint32_t *chart_of;     /* uint32_t[face_count] */
    uint32_t *local;        /* uint32_t[corner_count] */
    const double *weight;   /* may be NULL */
    const uint32_t *mirror; /* may be NULL */
    double most_stretch;
    double most_of_one; /* triangles may be stretched so much more than that */
    bool only_crumbs;   /* of two charts one has to be a crumb */
    double total;       /* area of the surface */
    bounds bounds;
    uint32_t joins_left; /* so many more are made */
    candidate *heap;
    uint32_t held;
    size_t capacity;
    qw_lane *lane;
    uint32_t lanes;              /* 0: candidates are looked at one by one */
    merger ahead[QW_MOST_LANES]; /* what was looked at together, in the memory of the run */
} maker;

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

/* Shares of the work on texture coordinates that are done then. */
static const double PATCHES_LAID = 0.2, CHARTS_JOINED = 0.6;

/* ---- laying flat */

static double grid_of(const maker *k, const qw_flat *t) { return sqrt(fmax(t->total, k->total)) / (1 << GRID_BITS); }

/* Whether a chart is of a shape that can be packed: not too large, not long, and not much less than the rectangle
 * around it, along its rows. What fills its rectangle may be longer
 * and larger: a sheet is one chart. Small ones may have any shape. */
static bool is_compact(const maker *k, const qw_flat *t)
{
    double size[2];
    qw_flat_box(t, qw_flat_angle(t), size);
    double fill = t->total / (size[0] * size[1]), root = sqrt(k->total), more = fmax(0, fill - k->bounds.fill);
    double most = k->bounds.share + SHARE_OF_FULL * more * more;
    if (fmax(size[0], size[1]) > (k->bounds.length + fmax(0, fill - 0.5)) * root) return false;
    return t->total <= most * k->total && (fill >= k->bounds.fill || t->total < SMALL_CHART * k->total);
}

static bool is_fair(const maker *k, const qw_flat *t)
{
    qw_stretch s = qw_flat_stretch(t);
    return is_compact(k, t) && s.inverted == 0 && s.mean <= k->most_stretch &&
           s.most <= k->most_of_one * k->most_stretch;
}

static void keep_uv(maker *k, const qw_flat *t)
{
    for (uint32_t i = 0; i < t->corner_count; i++) memcpy(k->made.uv[t->place[i]], t->at[t->vertex[i]], sizeof *t->at);
}

/* A patch by itself. */
static bool lay_patch(maker *k, const uint32_t *face, uint32_t count)
{
    qw_scope_begin(k->env);
    qw_flat t = qw_flat_of(k->env, k->m, face, count, k->local);
    qw_flat_on_circle(k->env, &t);
    double(*circle)[2] = qw_alloc(k->env, t.vertex_count, sizeof *circle);
    memcpy(circle, t.at, t.vertex_count * sizeof *circle);
    qw_flat_rigid(k->env, &t, FIRST_STEPS);
    if (qw_flat_stretch(&t).inverted > 0) {
        memcpy(t.at, circle, t.vertex_count * sizeof *circle);
        qw_flat_scale_best(&t);
        qw_flat_lower(k->env, &t, LOWER_STEPS);
    }
    bool fair = is_fair(k, &t) && qw_flat_is_simple(k->env, &t, grid_of(k, &t));
    keep_uv(k, &t);
    qw_scope_end(k->env);
    return fair;
}

/* What cannot lie flat as it is, as faces have no area or are folded over: on a regular polygon, large enough to be
   told from a point. */
static void lay_stub(maker *k, qw_chart *c)
{
    qw_scope_begin(k->env);
    qw_flat t = qw_flat_of(k->env, k->m, c->face, c->count, k->local);
    qw_flat_on_circle(k->env, &t);
    double radius = sqrt(t.total > 0 ? t.total / QW_PI : 1), least = STUB * sqrt(k->total);
    for (uint32_t v = 0; v < t.vertex_count; v++)
        for (int r = 0; r < 2; r++) t.at[v][r] *= fmax(radius, least) / radius;
    keep_uv(k, &t);
    c->is_stub = c->count == 1;
    qw_scope_end(k->env);
}

/* Turns and shifts the coordinates of chart b so that seams fit those of a, as least squares. */
static void align(const maker *k, const uint32_t *path, uint32_t length, double turn[2], double shift[2])
{
    double pa[2] = {0, 0}, pb[2] = {0, 0}, dot = 0, cross = 0, n = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t i = 0; i < length; i++) {
            uint32_t h = path[i], t = k->m->twin[h];
            const double *a[2] = {k->made.uv[h], k->made.uv[qw_atlas_next(k->m, h)]};
            const double *b[2] = {k->made.uv[qw_atlas_next(k->m, t)], k->made.uv[t]};
            for (int e = 0; e < 2; e++) {
                if (!pass) {
                    for (int r = 0; r < 2; r++) pa[r] += a[e][r], pb[r] += b[e][r];
                    n++;
                    continue;
                }
                double ax = a[e][0] - pa[0], ay = a[e][1] - pa[1], bx = b[e][0] - pb[0], by = b[e][1] - pb[1];
                dot += ax * bx + ay * by, cross += bx * ay - by * ax;
            }
        }
        for (int r = 0; r < 2 && !pass; r++) pa[r] /= n, pb[r] /= n;
    }
    double l = sqrt(dot * dot + cross * cross);
    turn[0] = l > 0 ? dot / l : 1, turn[1] = l > 0 ? cross / l : 0;
    shift[0] = pa[0] - (turn[0] * pb[0] - turn[1] * pb[1]), shift[1] = pa[1] - (turn[1] * pb[0] + turn[0] * pb[1]);
}

/* Coordinates to begin with: those of a, and of b as it was aligned; the mean where they meet. */
static void begin_at(const maker *k, qw_env *env, qw_flat *t, uint32_t of_a, const double turn[2],
                     const double shift[2])
{
    uint32_t *n = QW_NEW_ZERO(env, uint32_t, t->vertex_count);
    for (uint32_t i = 0; i < t->corner_count; i++) {
        const double *p = k->made.uv[t->place[i]];
        double x = p[0], y = p[1];
        if (i >= of_a) x = turn[0] * p[0] - turn[1] * p[1] + shift[0], y = turn[1] * p[0] + turn[0] * p[1] + shift[1];
        t->at[t->vertex[i]][0] += x, t->at[t->vertex[i]][1] += y, n[t->vertex[i]]++;
    }
    for (uint32_t v = 0; v < t->vertex_count; v++) t->at[v][0] /= n[v], t->at[v][1] /= n[v];
    qw_free(env, n);
}

static void set_path(const maker *k, const uint32_t *path, uint32_t length, uint8_t is_seam)
{
    for (uint32_t i = 0; i < length; i++) qw_set_seam(k->m, path[i], is_seam);
}

/* Seams of a candidate's path; with `all`, all between its charts, which may lie apart: what they make has holes then.
   uint32_t[]. */
static uint32_t *seams_of(const maker *k, qw_env *env, const candidate *c, bool all, uint32_t *length)
{
    const qw_atlas_mesh *m = k->m;
    uint32_t *path = NULL, h = c->first;
    *length = 0;
    size_t room = 0;
    for (uint32_t i = 0; i < c->length && !all; i++, h = qw_next_seam(m, h)) {
        path = qw_grow(env, path, &room, i + (size_t)1, sizeof *path);
        path[(*length)++] = h;
    }
    const qw_chart *a = &k->made.chart[c->a];
    for (uint32_t i = 0; i < a->count && all; i++)
        for (h = m->begin[a->face[i]]; h < m->begin[a->face[i] + 1]; h++) {
            if (!m->seam[h] || m->wall[h] || k->chart_of[m->face[m->twin[h]]] != c->b) continue;
            path = qw_grow(env, path, &room, *length + (size_t)1, sizeof *path);
            path[(*length)++] = h;
        }
    return path;
}

/* As rigid as possible, those triangles more that give way too much, as long as few do. */
static void lay_flat(const maker *k, qw_env *env, qw_flat *t)
{
    qw_flat_rigid(env, t, RIGID_STEPS);
    for (uint32_t round = 0; round < STIFFENINGS; round++) {
        uint32_t count = is_compact(k, t) ? qw_flat_stiffen(t, k->most_of_one * k->most_stretch) : 0;
        if (count == 0 || count > STIFFENED * t->triangle_count + FEW_TRIANGLES) return;
        qw_flat_rigid(env, t, RIGID_STEPS);
    }
}

/* double[corners of the two charts][2]: their coordinates where, joined along such seams, they lie flat fairly; NULL:
   they do not. Nothing changes but the seams, which are back in the end: charts that share none may be looked at on
   other threads. */
static double (*lie_together(const maker *k, qw_env *env, const candidate *c, const uint32_t *path, uint32_t length))[2]
{
    const qw_chart *a = &k->made.chart[c->a], *b = &k->made.chart[c->b];
    double turn[2], shift[2], (*uv)[2] = NULL;
    qw_scope_begin(env);
    uint32_t *face = QW_NEW(env, uint32_t, a->count + (size_t)b->count), of_a = 0;
    memcpy(face, a->face, a->count * sizeof *face), memcpy(face + a->count, b->face, b->count * sizeof *face);
    for (uint32_t i = 0; i < a->count; i++) of_a += k->m->begin[face[i] + 1] - k->m->begin[face[i]];
    align(k, path, length, turn, shift);
    set_path(k, path, length, 0);
    qw_flat t = qw_flat_of(env, k->m, face, a->count + b->count, k->local);
    bool good = qw_flat_is_planar(&t);
    if (good) {
        begin_at(k, env, &t, of_a, turn, shift);
        lay_flat(k, env, &t);
        good = is_fair(k, &t) && qw_flat_is_simple(env, &t, grid_of(k, &t));
    }
    if (good) {
        uv = qw_alloc(env, t.corner_count, sizeof *uv);
        for (uint32_t i = 0; i < t.corner_count; i++) memcpy(uv[i], t.at[t.vertex[i]], sizeof *uv);
        qw_keep(env, uv);
    }
    set_path(k, path, length, 1);
    qw_scope_end(env);
    return uv;
}

/* Looks whether the charts of t->c can be joined: along all seams between them, else along the path alone. */
static void look(const maker *k, qw_env *env, merger *t)
{
    for (int all = 1; all >= 0; all--) {
        t->path = seams_of(k, env, &t->c, all, &t->length);
        t->uv = lie_together(k, env, &t->c, t->path, t->length);
        t->tries++;
        if (t->uv) return;
        bool is_all = t->length == t->c.length;
        qw_free(env, t->path), t->path = NULL;
        if (is_all) return;
    }
}

/* Takes the coordinates of two charts that lie flat together, and the seams between them away. */
static void take_together(maker *k, const candidate *c, const uint32_t *path, uint32_t length, const double (*uv)[2])
{
    uint32_t n = 0;
    set_path(k, path, length, 0);
    for (int side = 0; side < 2; side++) {
        const qw_chart *of = &k->made.chart[side ? c->b : c->a];
        for (uint32_t i = 0; i < of->count; i++)
            for (uint32_t e = k->m->begin[of->face[i]]; e < k->m->begin[of->face[i] + 1]; e++)
                memcpy(k->made.uv[e], uv[n++], sizeof *uv);
    }
}

static bool join_along(maker *k, const candidate *c, const uint32_t *path, uint32_t length)
{
    double(*uv)[2] = lie_together(k, k->env, c, path, length);
    k->made.tries++;
    if (uv) take_together(k, c, path, length, (const double(*)[2])uv);
    qw_free(k->env, uv);
    return uv != NULL;
}

/* ---- candidates */

static bool was_refused(const maker *k, uint32_t a, uint32_t b)
{
    for (uint32_t i = 0; i < k->made.chart[a].refusals; i++) {
        uint32_t c = k->made.chart[a].refused[i];
        while (k->made.chart[c].into != c) c = k->made.chart[c].into;
        if (c == b) return true;
    }
    return false;
}

static void refuse(maker *k, uint32_t a, uint32_t b)
{
    qw_chart *c = &k->made.chart[a];
    c->refused = qw_grow(k->env, c->refused, &c->room, c->refusals + (size_t)1, sizeof *c->refused);
    c->refused[c->refusals++] = b;
}

static double seam_weight(const maker *k, uint32_t c)
{
    return qw_atlas_edge_length(k->m, c) * (k->weight ? k->weight[c] : 1);
}

/* Whether the path goes on from a seam to the next: at the vertex between them the same chart lies across, and there,
   too, they follow one another. */
static bool goes_on(const maker *k, uint32_t h, uint32_t next, uint32_t b)
{
    const qw_atlas_mesh *m = k->m;
    if (m->twin[next] == QW_NONE || m->wall[next] || k->chart_of[m->face[m->twin[next]]] != b) return false;
    return qw_next_seam(m, m->twin[next]) == m->twin[h];
}

/* The candidate whose path holds seam h of chart a: as long as it can be. Its key: how much of the shorter boundary
   goes. */
static void offer(maker *k, uint32_t a, uint32_t h, uint32_t length, double weight)
{
    uint32_t b = k->chart_of[k->m->face[k->m->twin[h]]];
    const qw_chart *ca = &k->made.chart[a], *cb = &k->made.chart[b];
    if (was_refused(k, a, b) || was_refused(k, b, a)) return;
    if (k->only_crumbs && ca->count >= CRUMB && cb->count >= CRUMB) return;
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
        uint32_t across = m->twin[h] == QW_NONE || m->wall[h] ? QW_NONE : k->chart_of[m->face[m->twin[h]]];
        if (length > 0 && !(across == b && goes_on(k, last, h, b))) {
            offer(k, a, begin, length, weight);
            length = 0;
        }
        if (across != QW_NONE && across != a) {
            if (length == 0) begin = h, b = across, weight = 0;
            length++, weight += seam_weight(k, h), last = h;
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

static double perimeter_of(const maker *k, const qw_chart *c)
{
    double sum = 0;
    for (uint32_t i = 0; i < c->count; i++)
        for (uint32_t e = k->m->begin[c->face[i]]; e < k->m->begin[c->face[i] + 1]; e++)
            if (k->m->seam[e]) sum += qw_atlas_edge_length(k->m, e);
    return sum;
}

static void join(maker *k, uint32_t a, uint32_t b)
{
    qw_chart *to = &k->made.chart[a], *from = &k->made.chart[b];
    to->face = qw_resize(k->env, to->face, to->count + (size_t)from->count, sizeof *to->face);
    memcpy(to->face + to->count, from->face, from->count * sizeof *to->face);
    for (uint32_t i = 0; i < from->count; i++) k->chart_of[from->face[i]] = a;
    to->count += from->count, to->area += from->area, to->stamp++;
    to->perimeter = perimeter_of(k, to);
    from->into = a, from->count = 0, from->stamp++;
    for (uint32_t i = 0; i < from->refusals; i++) refuse(k, a, from->refused[i]);
    k->made.joins++;
}

/* The chart that lies opposite to one, face by face; QW_NONE: there is none. */
static uint32_t chart_opposite(const maker *k, uint32_t a)
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
    uint32_t a = chart_opposite(k, c->a), b = chart_opposite(k, c->b);
    if (a == QW_NONE || b == QW_NONE) return false;
    return !(a == c->a && b == c->b) && !(a == c->b && b == c->a);
}

/* The same join on the other side. */
static bool join_opposite(maker *k, const uint32_t *path, uint32_t length)
{
    candidate c = {.a = QW_NONE};
    uint32_t *other = QW_NEW(k->env, uint32_t, length);
    bool good = length > 0;
    for (uint32_t i = 0; i < length && good; i++) {
        uint32_t h = other[i] = k->mirror[path[i]];
        good = h != QW_NONE && k->m->twin[h] != QW_NONE && k->m->seam[h] && !k->m->wall[h];
        if (!good) break;
        uint32_t a = k->chart_of[k->m->face[h]], b = k->chart_of[k->m->face[k->m->twin[h]]];
        if (i == 0) c.a = a, c.b = b;
        good = c.a == a && c.b == b && a != b;
    }
    good = good && join_along(k, &c, other, length);
    qw_free(k->env, other);
    if (good) join(k, c.a, c.b), offer_all(k, c.a);
    return good;
}

/* Takes a join back: the seams, the coordinates and what the two charts were. */
static void part(maker *k, const candidate *c, const uint32_t *path, uint32_t length, uint32_t of_a, uint32_t of_b,
                 const double (*uv)[2])
{
    qw_chart *a = &k->made.chart[c->a], *b = &k->made.chart[c->b];
    uint32_t n = 0;
    for (uint32_t i = 0; i < a->count; i++)
        for (uint32_t e = k->m->begin[a->face[i]]; e < k->m->begin[a->face[i] + 1]; e++, n++)
            memcpy(k->made.uv[e], uv[n], sizeof *uv);
    for (uint32_t i = of_a; i < a->count; i++) k->chart_of[a->face[i]] = c->b;
    set_path(k, path, length, 1);
    a->count = of_a, b->count = of_b, b->into = c->b;
    a->stamp++, b->stamp++, k->made.joins--;
    a->perimeter = perimeter_of(k, a), b->perimeter = perimeter_of(k, b);
    offer_all(k, c->a), offer_all(k, c->b);
}

/* Coordinates of the corners of two charts, one behind the other. */
static double (*copy_uv(maker *k, const candidate *c))[2]
{
    size_t room = 0;
    uint32_t n = 0;
    double(*uv)[2] = NULL;
    for (int side = 0; side < 2; side++) {
        const qw_chart *of = &k->made.chart[side ? c->b : c->a];
        for (uint32_t i = 0; i < of->count; i++)
            for (uint32_t e = k->m->begin[of->face[i]]; e < k->m->begin[of->face[i] + 1]; e++) {
                uv = qw_grow(k->env, uv, &room, n + (size_t)1, sizeof *uv);
                memcpy(uv[n++], k->made.uv[e], sizeof *uv);
            }
    }
    return uv;
}

/* ---- on threads: the candidates that would come next, of other charts, are looked at beside the first */

static void forget(maker *k, merger *t)
{
    qw_free(k->env, t->uv), qw_free(k->env, t->path);
    *t = (merger){0};
}

static bool is_open(const maker *k, const candidate *c)
{
    return k->made.chart[c->a].stamp == c->stamp_a && k->made.chart[c->b].stamp == c->stamp_b &&
           !was_refused(k, c->a, c->b);
}

/* Candidates for the lanes: the first, and of those that follow in the queue some that share no chart with others.
   Returns how many. */
static uint32_t choose_ahead(maker *k, const candidate *first)
{
    enum { MOST_PASSED = 8 };
    candidate passed[MOST_PASSED];
    uint32_t count = 0, taken = 0;
    k->ahead[count++].c = *first;
    while (count < k->lanes && taken < MOST_PASSED && k->held > 0) {
        candidate c = passed[taken++] = pop(k);
        bool is_apart = is_open(k, &c);
        for (uint32_t i = 0; i < count; i++) {
            const candidate *o = &k->ahead[i].c;
            is_apart = is_apart && c.a != o->a && c.a != o->b && c.b != o->a && c.b != o->b;
        }
        if (is_apart) k->ahead[count++].c = c;
    }
    while (taken > 0) push(k, passed[--taken]);
    return count;
}

typedef struct look_call {
    const maker *k;
    qw_env *env;
    merger *t;
} look_call;

static void look_body(void *user)
{
    look_call *call = user;
    look(call->k, call->env, call->t);
}

static void look_in_lanes(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    maker *k = user;
    (void)block;
    for (uint32_t i = begin; i < end; i++) {
        look_call call = {k, k->lane[i].env, &k->ahead[i]};
        if (!call.env) continue;
        qw_scope_begin(call.env);
        k->ahead[i].is_known = qw_protect(call.env, look_body, &call) == QW_OK;
    }
}

/* Where a lane ran out of memory it stopped half way: some seams of its two charts still have the mark 2 of the walk
   along the rim, and those between the two are missing. All of them are 1 again. */
static void mend_seams(const maker *k, const candidate *c)
{
    const qw_atlas_mesh *m = k->m;
    for (int side = 0; side < 2; side++) {
        const qw_chart *of = &k->made.chart[side ? c->b : c->a];
        for (uint32_t i = 0; i < of->count; i++)
            for (uint32_t e = m->begin[of->face[i]]; e < m->begin[of->face[i] + 1]; e++) {
                uint32_t w = m->twin[e];
                if (m->seam[e] || (w != QW_NONE && k->chart_of[m->face[w]] != k->chart_of[of->face[i]])) m->seam[e] = 1;
            }
    }
}

/* What a lane has found, in the memory of the run. */
static void take_over(maker *k, uint32_t i)
{
    merger *t = &k->ahead[i], found = *t;
    uint32_t corners = 0;
    t->path = NULL, t->uv = NULL;
    if (!found.is_known) mend_seams(k, &t->c);
    if (found.is_known && found.path) {
        for (int side = 0; side < 2; side++) {
            const qw_chart *of = &k->made.chart[side ? t->c.b : t->c.a];
            for (uint32_t f = 0; f < of->count; f++) corners += k->m->begin[of->face[f] + 1] - k->m->begin[of->face[f]];
        }
        t->path = QW_NEW(k->env, uint32_t, t->length), t->uv = qw_alloc(k->env, corners, sizeof *t->uv);
        memcpy(t->path, found.path, t->length * sizeof *t->path), memcpy(t->uv, found.uv, corners * sizeof *t->uv);
    }
    if (k->lane[i].env) qw_scope_end(k->lane[i].env);
}

static bool is_of(const merger *t, const candidate *c)
{
    return t->is_known && t->c.a == c->a && t->c.b == c->b && t->c.stamp_a == c->stamp_a &&
           t->c.stamp_b == c->stamp_b && t->c.first == c->first && t->c.length == c->length;
}

/* What there is to know of a candidate; the caller forgets it. */
static merger look_at(maker *k, const candidate *c)
{
    merger own = {.c = *c};
    for (int round = 0; round < 2 && k->lanes > 0; round++) {
        for (uint32_t i = 0; i < k->lanes; i++) {
            if (!is_of(&k->ahead[i], c)) continue;
            own = k->ahead[i], k->ahead[i] = (merger){0};
            return own;
        }
        if (round == 1) break;
        for (uint32_t i = 0; i < k->lanes; i++) forget(k, &k->ahead[i]);
        uint32_t count = choose_ahead(k, c);
        if (count == 1) break;
        qw_parallel(k->env, count, 1, look_in_lanes, k);
        for (uint32_t i = 0; i < count; i++) take_over(k, i);
    }
    look(k, k->env, &own);
    return own;
}

/* ---- joins */

/* Joins the charts of a candidate, and on a symmetric surface those that lie opposite too, or none. */
static bool make_join(maker *k, const candidate *c)
{
    uint32_t of_a = k->made.chart[c->a].count, of_b = k->made.chart[c->b].count;
    bool is_twice = has_opposite(k, c);
    double(*uv)[2] = is_twice ? copy_uv(k, c) : NULL;
    merger t = look_at(k, c);
    bool good = t.path != NULL;
    k->made.tries += t.tries;
    if (good) take_together(k, c, t.path, t.length, (const double(*)[2])t.uv), join(k, c->a, c->b);
    if (good && is_twice) {
        good = join_opposite(k, t.path, t.length);
        if (!good) part(k, c, t.path, t.length, of_a, of_b, (const double(*)[2])uv);
    }
    forget(k, &t), qw_free(k->env, uv);
    return good;
}

static void join_all(maker *k)
{
    for (uint32_t a = 0; a < k->made.count; a++) offer_all(k, a);
    while (k->held > 0) {
        candidate c = pop(k);
        if (!is_open(k, &c) || k->joins_left == 0) continue;
        if (make_join(k, &c)) {
            k->joins_left--;
            offer_all(k, c.a);
            continue;
        }
        refuse(k, c.a, c.b);
        refuse(k, c.b, c.a);
    }
    for (uint32_t i = 0; i < k->lanes; i++) forget(k, &k->ahead[i]); /* bounds may be others next time */
}

/* ---- patches */

static void take_charts(maker *k)
{
    uint32_t count, *begin;
    qw_free(k->env, k->chart_of);
    k->chart_of = qw_label_charts(k->env, k->m, &count);
    k->made.count = count, k->made.chart = QW_NEW_ZERO(k->env, qw_chart, count);
    begin = QW_NEW_ZERO(k->env, uint32_t, count);
    for (uint32_t f = 0; f < k->m->face_count; f++) k->made.chart[k->chart_of[f]].count++;
    for (uint32_t a = 0; a < count; a++)
        k->made.chart[a].into = a, k->made.chart[a].face = QW_NEW(k->env, uint32_t, k->made.chart[a].count);
    for (uint32_t f = 0; f < k->m->face_count; f++) k->made.chart[k->chart_of[f]].face[begin[k->chart_of[f]]++] = f;
    qw_free(k->env, begin);
    for (uint32_t a = 0; a < count; a++) k->made.chart[a].perimeter = perimeter_of(k, &k->made.chart[a]);
}

/* Splits patches until each lies flat fairly, or is a single face. */
static void lay_patches(maker *k)
{
    uint8_t *done = QW_NEW_ZERO(k->env, uint8_t, k->m->face_count); /* 1: the patch of this first face is settled */
    for (bool again = true; again;) {
        again = false;
        qw_free(k->env, k->made.chart);
        take_charts(k);
        for (uint32_t a = 0; a < k->made.count; a++) {
            const qw_chart *c = &k->made.chart[a];
            if (done[c->face[0]]) continue;
            if (lay_patch(k, c->face, c->count) || !qw_split_patch(k->env, k->m, c->face, c->count))
                done[c->face[0]] = 1;
            else again = true;
        }
    }
    qw_free(k->env, done);
}

/* ---- the end */

/* Lowers the energy of a chart; what then overlaps itself stays as it was, and what did before becomes a stub. */
static void finish_chart(maker *k, qw_chart *c)
{
    qw_scope_begin(k->env);
    qw_flat t = qw_flat_of(k->env, k->m, c->face, c->count, k->local);
    for (uint32_t i = 0; i < t.corner_count; i++) memcpy(t.at[t.vertex[i]], k->made.uv[t.place[i]], sizeof *t.at);
    bool simple = qw_flat_is_simple(k->env, &t, grid_of(k, &t));
    if (simple) {
        qw_flat_scale(&t);
        keep_uv(k, &t);
        qw_flat_lower(k->env, &t, LOWER_STEPS);
        qw_flat_scale(&t);
        if (qw_flat_is_simple(k->env, &t, grid_of(k, &t))) keep_uv(k, &t);
    }
    qw_scope_end(k->env);
    if (!simple) lay_stub(k, c);
}

static void drop_joined(maker *k)
{
    uint32_t kept = 0;
    for (uint32_t a = 0; a < k->made.count; a++)
        if (k->made.chart[a].into == a) k->made.chart[kept++] = k->made.chart[a];
    k->made.count = kept;
}

/* Of the triangles around its first corner. */
static double face_area(const qw_atlas_mesh *m, uint32_t f)
{
    double sum = 0;
    for (uint32_t c = m->begin[f] + 1; c + 1 < m->begin[f + 1]; c++) {
        const double *a = m->position + 3 * (size_t)m->corner[m->begin[f]], *b = m->position + 3 * (size_t)m->corner[c],
                     *d = m->position + 3 * (size_t)m->corner[c + 1];
        double u[3], v[3], n[3];
        for (int i = 0; i < 3; i++) u[i] = b[i] - a[i], v[i] = d[i] - a[i];
        qw_cross_doubles(u, v, n);
        sum += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
    }
    return sum;
}

/* ---- how large */

/* What a level has made: enough to go back to it. */
typedef struct state {
    double (*uv)[2]; /* double[corner_count][2] */
    uint8_t *seam;   /* uint8_t[corner_count] */
    uint8_t *stub;   /* uint8_t[face_count]: 1 where a face is one */
    bounds allowed;  /* of its charts */
    uint32_t joins;  /* that were made in it, each with its opposite */
    bool is_finished;
} state;

static void keep_state(const maker *k, state *s)
{
    size_t n = k->m->corner_count;
    memcpy(s->uv, k->made.uv, n * sizeof *s->uv), memcpy(s->seam, k->m->seam, n);
    for (uint32_t a = 0; a < k->made.count; a++) s->stub[k->made.chart[a].face[0]] = k->made.chart[a].is_stub;
}

static void add_state(const maker *k, state *s)
{
    size_t n = k->m->corner_count;
    *s = (state){.uv = qw_alloc(k->env, n, sizeof *s->uv), .seam = QW_NEW(k->env, uint8_t, n)};
    s->stub = QW_NEW_ZERO(k->env, uint8_t, k->m->face_count);
    keep_state(k, s);
}

/* Joins what the bounds allow, so many at most; false: nothing. */
static bool join_more(maker *k, bounds allowed, uint32_t most, state *s)
{
    uint32_t before = k->made.joins;
    k->bounds = allowed, k->joins_left = most;
    for (uint32_t a = 0; a < k->made.count; a++) k->made.chart[a].refusals = 0;
    join_all(k);
    drop_joined(k);
    if (k->made.joins == before) return false;
    add_state(k, s);
    s->allowed = allowed, s->joins = most - k->joins_left;
    qw_free(k->env, k->made.chart);
    take_charts(k);
    return true;
}

/* Its charts, finished. */
static void go_back(maker *k, state *s)
{
    size_t n = k->m->corner_count;
    memcpy(k->made.uv, s->uv, n * sizeof *s->uv), memcpy(k->m->seam, s->seam, n);
    qw_free(k->env, k->made.chart);
    take_charts(k);
    for (uint32_t a = 0; a < k->made.count; a++) {
        qw_chart *c = &k->made.chart[a];
        if (s->is_finished) c->is_stub = c->count == 1 && s->stub[c->face[0]];
        else finish_chart(k, c);
    }
    if (!s->is_finished) keep_state(k, s);
    s->is_finished = true;
}

/* Of the charts that were found to pack well those that are fewest. */
typedef struct choice {
    maker *k;
    qw_chart_judge *judge;
    void *user;
    state best;
} choice;

/* Whether they pack well. */
static bool try_charts(choice *c, state *s)
{
    go_back(c->k, s);
    if (!c->judge(c->user, &c->k->made)) return false;
    c->best = *s;
    return true;
}

/* From charts that pack well to those of the next level, which do not: as many of the joins between as still do.
   Bisection over their number. */
static void join_some(choice *c, const state *next)
{
    enum { STEPS = 3 };
    uint32_t low = 0, high = next->joins;
    for (int step = 0; step < STEPS && high - low > 1; step++) {
        state some;
        uint32_t middle = (low + high) / 2;
        go_back(c->k, &c->best);
        if (!join_more(c->k, next->allowed, middle - low, &some)) return;
        if (try_charts(c, &some)) low = middle;
        else high = middle;
    }
}

/* Joins what is left of crumbs to their neighbours. */
static void join_crumbs(maker *k)
{
    state s;
    k->only_crumbs = true, k->most_of_one = MOST_OF_CRUMBS;
    if (join_more(k, levels[LEVELS - 1], UINT32_MAX, &s)) go_back(k, &s);
}

/* Joins at every level, and takes the last whose charts pack well, else the first. */
static void join_at_levels(maker *k, qw_chart_judge *judge, void *user)
{
    state all[LEVELS + 1];
    choice c = {.k = k, .judge = judge, .user = user};
    uint32_t count = 1, low = 0, high;
    add_state(k, &all[0]);
    for (uint32_t level = 0; level < (judge ? LEVELS : 1); level++) {
        count += join_more(k, levels[level], UINT32_MAX, &all[count]);
        qw_progress_work(k->env, PATCHES_LAID + (CHARTS_JOINED - PATCHES_LAID) * (level + 1) / LEVELS);
    }
    if (count > 1) low = 1;
    c.best = all[low];
    /* bisection: those that are larger pack less well, on the whole */
    for (high = count; judge && high - low > 1;) {
        uint32_t middle = (low + high) / 2;
        if (try_charts(&c, &all[middle])) low = middle;
        else high = middle;
    }
    if (judge && low + 1 < count) join_some(&c, &all[low + 1]);
    go_back(k, &c.best);
    if (judge) join_crumbs(k);
}

qw_charts_made qw_make_charts(qw_env *env, qw_atlas_mesh *mesh, double most_stretch, const double *weight,
                              const uint32_t *mirror, qw_chart_judge *judge, void *user)
{
    maker k = {
        .env = env, .m = mesh, .most_stretch = most_stretch, .weight = weight, .mirror = mirror, .bounds = levels[0]};
    k.most_of_one = MOST_OF_ONE;
    k.made.uv = qw_alloc_zero(env, mesh->corner_count, sizeof *k.made.uv);
    k.local = QW_NEW(env, uint32_t, mesh->corner_count);
    uint32_t threads = qw_env_threads(env);
    k.lanes = threads == 1 ? 0 : threads < QW_MOST_LANES ? threads : QW_MOST_LANES;
    k.lane = qw_lanes_begin(env, k.lanes, (size_t)fmin(LANE_BYTES * (mesh->face_count + 100.0), MOST_LANE_BYTES));
    qw_cut_patches(env, mesh);
    for (uint32_t f = 0; f < mesh->face_count; f++) k.total += face_area(mesh, f);
    mesh->least = 1e-5 * sqrt(k.total); /* some steps of the grid on which coordinates are written */
    lay_patches(&k);
    k.made.patches = k.made.count;
    qw_progress_work(env, PATCHES_LAID);
    join_at_levels(&k, judge, user);
    qw_lanes_end(k.lane, k.lanes);
    qw_free(env, k.heap), qw_free(env, k.local), qw_free(env, k.chart_of);
    return k.made;
}
