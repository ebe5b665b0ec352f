#include "products/atlas/charts.h"

#include "base/elementary.h"
#include "base/vec.h"

#include <assert.h>
#include <string.h>

enum {
    FIRST_STEPS = 6,  /* of a patch by itself, from the circle */
    LOWER_STEPS = 40, /* where those leave inverted triangles, and at the end */
    LEVELS = 7,       /* of what room around charts is worth */
    MOST_LOOKS = 300, /* at a chart, to see how all pack: then no more are joined, or shared out */
    MOST_PATCHES = 12 /* of a chart that is shared out: more hardly ever all find a neighbour */
};
/* Of a chart, in roots of the surface's area: what a square has that is filled to 0.7. */
static const double MOST_LENGTH = 1.2;
static const double MOST_OF_ONE = 3;    /* a triangle may be stretched so much more than the mean of its chart */
static const double MOST_OF_CRUMBS = 8; /* the same where a crumb is joined to a chart */
static const double FIRST_WASTE = 32;   /* of the levels: each next one has half of that, the last none */
static const double STUB = 1e-3; /* radius of faces that are laid as regular polygons, in roots of the surface's area */

typedef qw_joiner maker;

/* Shares of the work on texture coordinates that are done then. */
static const double PATCHES_LAID = 0.2, CHARTS_JOINED = 0.6;

/* ---- patches */

static void keep_uv(maker *k, const qw_flat *t)
{
    for (uint32_t i = 0; i < t->corner_count; i++) memcpy(k->made.uv[t->place[i]], t->at[t->vertex[i]], sizeof *t->at);
}

/* A patch by itself. */
static bool lay_patch(maker *k, const qw_chart *c)
{
    double size[2];
    qw_scope_begin(k->env);
    qw_flat t = qw_flat_of(k->env, k->m, c->face, c->count, k->local);
    qw_flat_on_circle(k->env, &t);
    double(*circle)[2] = qw_alloc(k->env, t.vertex_count, sizeof *circle);
    memcpy(circle, t.at, t.vertex_count * sizeof *circle);
    qw_flat_rigid(k->env, &t, FIRST_STEPS);
    if (qw_flat_stretch(&t).inverted > 0) {
        memcpy(t.at, circle, t.vertex_count * sizeof *circle);
        qw_flat_scale_best(&t);
        qw_flat_lower(k->env, &t, LOWER_STEPS);
    }
    bool fair = qw_lies_fair(k, &t);
    keep_uv(k, &t);
    qw_scope_end(k->env);
    qw_chart_size(k, c, size);
    return fair && !qw_is_too_long(k, size);
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

/* Lists the faces of each chart, as the seams divide them now. */
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
}

/* Leaves out those that were joined to others. */
static void take_charts_again(maker *k)
{
    qw_free(k->env, k->made.chart);
    take_charts(k);
}

/* Splits patches until each lies flat fairly, or is a single face. */
static void lay_patches(maker *k)
{
    uint8_t *done = QW_NEW_ZERO(k->env, uint8_t, k->m->face_count); /* 1: the patch of this first face is settled */
    for (bool again = true; again;) {
        again = false;
        take_charts_again(k);
        for (uint32_t a = 0; a < k->made.count; a++) {
            const qw_chart *c = &k->made.chart[a];
            assert(c->count > 0);
            if (done[c->face[0]]) continue;
            if (lay_patch(k, c) || !qw_split_patch(k->env, k->m, c->face, c->count)) done[c->face[0]] = 1;
            else again = true;
        }
    }
    qw_free(k->env, done);
}

/* ---- the end */

static bool keep_if_fair(maker *k, qw_flat *t)
{
    qw_flat_scale(t);
    bool fair = qw_lies_fair(k, t);
    if (fair) keep_uv(k, t);
    return fair;
}

static void fetch_uv(const maker *k, qw_flat *t)
{
    for (uint32_t i = 0; i < t->corner_count; i++) memcpy(t->at[t->vertex[i]], k->made.uv[t->place[i]], sizeof *t->at);
}

/* So that its rows run along the axes. */
static void turn_chart(maker *k, const qw_chart *c)
{
    qw_scope_begin(k->env);
    qw_flat t = qw_flat_of(k->env, k->m, c->face, c->count, k->local);
    fetch_uv(k, &t), qw_flat_scale(&t), qw_flat_turn(&t), keep_uv(k, &t);
    qw_scope_end(k->env);
}

/* Lowers the energy of a chart, then lays rows of its border along the axes: all that nearly are, or where the chart
   becomes unfair by that, those that are nearer, or none. What covered a point twice before becomes a stub. */
static void finish_chart(maker *k, qw_chart *c)
{
    static const double bulge[] = {0.25, 0.1};
    qw_scope_begin(k->env);
    qw_flat t = qw_flat_of(k->env, k->m, c->face, c->count, k->local);
    fetch_uv(k, &t);
    bool simple = qw_covers_once(k, &t), done = !simple;
    if (simple) {
        qw_flat_scale(&t), qw_flat_turn(&t);
        keep_uv(k, &t);
        qw_flat_lower(k->env, &t, LOWER_STEPS);
        qw_flat_turn(&t);
        keep_if_fair(k, &t);
    }
    for (uint32_t i = 0; i < sizeof bulge / sizeof *bulge && !done; i++) {
        fetch_uv(k, &t);
        done = !qw_flat_straighten(k->env, &t, bulge[i], LOWER_STEPS) || keep_if_fair(k, &t);
    }
    qw_scope_end(k->env);
    if (!simple) lay_stub(k, c);
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

/* Of all seams. */
static double cost_of_seams(const maker *k)
{
    double sum = 0;
    for (uint32_t c = 0; c < k->m->corner_count; c++)
        if (k->m->seam[c] && k->m->twin[c] != QW_NONE && c < k->m->twin[c]) sum += qw_seam_cost(k, c);
    return sum;
}

/* What a level has made: enough to go back to it. */
typedef struct state {
    double (*uv)[2]; /* double[corner_count][2] */
    uint8_t *seam;   /* uint8_t[corner_count] */
} state;

static void keep_state(const maker *k, state *s)
{
    size_t n = k->m->corner_count;
    memcpy(s->uv, k->made.uv, n * sizeof *s->uv), memcpy(s->seam, k->m->seam, n);
}

static void add_state(const maker *k, state *s)
{
    size_t n = k->m->corner_count;
    *s = (state){.uv = qw_alloc(k->env, n, sizeof *s->uv), .seam = QW_NEW(k->env, uint8_t, n)};
    keep_state(k, s);
}

/* Joins what is worth it; false: nothing. */
static bool join_more(maker *k, double waste, state *s)
{
    uint32_t before = k->made.joins;
    k->bounds.waste = waste;
    qw_join_charts(k);
    if (k->made.joins == before) return false;
    add_state(k, s);
    return true;
}

static void go_back(maker *k, const state *s)
{
    size_t n = k->m->corner_count;
    memcpy(k->made.uv, s->uv, n * sizeof *s->uv), memcpy(k->m->seam, s->seam, n);
    take_charts_again(k);
}

/* Who says whether charts pack well. */
typedef struct choice {
    qw_chart_judge *judge;
    void *user;
} choice;

/* Whether the charts that are not empty pack well; takes as many looks from those left. */
static bool packs_well(maker *k)
{
    const choice *c = k->user;
    qw_charts_made some = {.uv = k->made.uv};
    some.chart = qw_alloc(k->env, k->made.count, sizeof *some.chart);
    for (uint32_t a = 0; a < k->made.count; a++)
        if (k->made.chart[a].count > 0) some.chart[some.count++] = k->made.chart[a];
    bool good = c->judge(c->user, &some);
    k->looks_left -= some.count;
    qw_free(k->env, some.chart);
    return good;
}

static void go_back_turned(maker *k, const state *s)
{
    go_back(k, s);
    for (uint32_t a = 0; a < k->made.count; a++) turn_chart(k, &k->made.chart[a]);
}

/* Whether all charts pack well with one that has been joined, and its opposite. */
static bool try_join(maker *k, uint32_t a, uint32_t b)
{
    turn_chart(k, &k->made.chart[a]);
    if (b != a) turn_chart(k, &k->made.chart[b]);
    return packs_well(k);
}

/* Patches find other charts. */
typedef struct sharer {
    const state *patches;  /* each by itself */
    const uint32_t *patch; /* uint32_t[face_count]: of each face */
    uint8_t *mark;         /* uint8_t[face_count]: of patches that are shared out */
    state kept, first;
    bool is_bold; /* whether all charts pack well is not asked */
} sharer;

/* Lays patches that are marked apart again. */
static void loosen(maker *k, const sharer *s)
{
    for (uint32_t e = 0; e < k->m->corner_count; e++) {
        if (!s->mark[k->m->face[e]]) continue;
        if (s->patches->seam[e]) qw_set_seam(k->m, e, 1);
        memcpy(k->made.uv[e], s->patches->uv[e], sizeof *k->made.uv);
    }
}

/* Shares out the patches that are marked among the charts beside them, where all charts pack well then: all of them, or
   none. They make at most so many more charts, and then no more seams than cost so much. */
static bool share_out(maker *k, sharer *s, uint32_t most_more, double most_cost)
{
    uint32_t before = k->made.count;
    keep_state(k, &s->kept);
    loosen(k, s);
    take_charts_again(k);
    bool is_shared = k->made.count <= before + most_more; /* charts that are used up are counted no more */
    for (uint32_t i = 0; i < k->made.count && is_shared; i++)
        k->made.chart[i].is_loose = s->mark[k->made.chart[i].face[0]];
    k->bounds.only_loose = true;
    if (is_shared) qw_join_charts(k);
    k->bounds.only_loose = false;
    for (uint32_t i = 0; i < k->made.count; i++) is_shared &= k->made.chart[i].count == 0 || !k->made.chart[i].is_loose;
    is_shared = is_shared && cost_of_seams(k) < most_cost;
    for (uint32_t i = 0; i < k->made.count && is_shared; i++)
        if (k->made.chart[i].count > 0 && k->made.chart[i].stamp > 0) turn_chart(k, &k->made.chart[i]);
    is_shared = is_shared && (s->is_bold || packs_well(k));
    if (is_shared) take_charts_again(k);
    else go_back(k, &s->kept);
    return is_shared;
}

/* The smallest chart above a size; QW_NONE: none. */
static uint32_t next_larger(const maker *k, uint32_t size)
{
    uint32_t found = QW_NONE;
    for (uint32_t a = 0; a < k->made.count; a++) {
        uint32_t count = k->made.chart[a].count;
        if (count > size && (found == QW_NONE || count < k->made.chart[found].count)) found = a;
    }
    return found;
}

/* Shares out small charts, each with its opposite: the smallest first. */
static void share_out_small(maker *k, sharer *s)
{
    for (uint32_t size = 0, a; k->looks_left > 0 && (a = next_larger(k, size)) != QW_NONE;) {
        uint32_t b = k->mirror ? qw_chart_opposite(k, a) : QW_NONE, charts = b != QW_NONE && b != a ? 2 : 1;
        size = k->made.chart[a].count;
        for (uint32_t f = 0; f < k->m->face_count; f++) s->mark[f] = k->chart_of[f] == a || k->chart_of[f] == b;
        share_out(k, s, charts * MOST_PATCHES - 1, INFINITY);
    }
}

/* The patch that lies opposite to one, face by face; QW_NONE: there is none. */
static uint32_t opposite_patch(const maker *k, const uint32_t *patch, uint32_t p)
{
    uint32_t q = QW_NONE, faces = 0;
    for (uint32_t f = 0; f < k->m->face_count; f++) {
        if (patch[f] != p) continue;
        uint32_t h = k->mirror[k->m->begin[f]], to = h == QW_NONE ? QW_NONE : patch[k->m->face[h]];
        if (to == QW_NONE || (faces > 0 && to != q)) return QW_NONE;
        q = to, faces++;
    }
    for (uint32_t f = 0; f < k->m->face_count; f++) faces -= patch[f] == q;
    return faces == 0 ? q : QW_NONE;
}

/* Marks a patch and its opposite. Returns how many these are; 0: the chart has an opposite, but not the patch. */
static uint32_t mark_patch(const maker *k, const sharer *s, uint32_t p)
{
    uint32_t q = k->mirror ? opposite_patch(k, s->patch, p) : p, a = QW_NONE;
    for (uint32_t f = 0; f < k->m->face_count; f++) {
        s->mark[f] = s->patch[f] == p || s->patch[f] == q;
        if (s->patch[f] == p) a = k->chart_of[f];
    }
    if (q == QW_NONE) return qw_chart_opposite(k, a) == QW_NONE;
    return q == p ? 1 : 2;
}

/* Whether less of a patch's border would be a seam in other charts: double[patches], above 0. */
static void find_gains(const maker *k, const sharer *s, double *gain, uint32_t patches)
{
    memset(gain, 0, patches * sizeof *gain);
    for (uint32_t e = 0; e < k->m->corner_count; e++) {
        uint32_t f = k->m->face[e], g = k->m->twin[e] == QW_NONE ? f : k->m->face[k->m->twin[e]];
        if (s->patch[f] == s->patch[g]) continue;
        if (!k->m->seam[e]) gain[s->patch[f]] -= qw_seam_cost(k, e);
        else if (k->chart_of[f] != k->chart_of[g] && k->m->wall[e] < QW_WALL_SHARP)
            gain[s->patch[f]] += qw_seam_cost(k, e);
    }
}

/* Gives patches to other charts where seams cost less then. gain: double[patches]. */
static bool give_patches(maker *k, sharer *s, double *gain, uint32_t patches)
{
    bool any = false;
    find_gains(k, s, gain, patches);
    for (uint32_t p = 0; p < patches && k->looks_left > 0; p++) {
        uint32_t count = gain[p] > 0 ? mark_patch(k, s, p) : 0;
        if (count == 0 || !share_out(k, s, count, cost_of_seams(k))) continue;
        find_gains(k, s, gain, patches);
        any = true;
    }
    return any;
}

/* All of them, or where charts do not pack well then, one by one as long as they do. */
static bool give_all(maker *k, sharer *s, uint32_t patches)
{
    double *gain = QW_NEW(k->env, double, patches);
    keep_state(k, &s->first);
    s->is_bold = true;
    bool any = give_patches(k, s, gain, patches);
    s->is_bold = false;
    if (any && !packs_well(k)) go_back(k, &s->first), any = give_patches(k, s, gain, patches);
    qw_free(k->env, gain);
    return any;
}

/* Gives patches to other charts, joins charts and shares out small ones as long as all pack well, until no patch is
   given. */
static void rearrange(maker *k, sharer *s, uint32_t patches)
{
    k->looks_left = MOST_LOOKS;
    for (uint32_t looks = MOST_LOOKS; give_all(k, s, patches) || looks == MOST_LOOKS; looks /= 2) {
        k->suits = try_join, k->looks_left = looks;
        qw_join_charts(k);
        k->suits = NULL, k->looks_left = looks;
        take_charts_again(k);
        share_out_small(k, s);
        k->looks_left = looks;
    }
}

/* Joins at every level, goes back to the last whose charts pack well, else the first, and joins on as long as they do;
   then crumbs to their neighbours. */
static void join_at_levels(maker *k, qw_chart_judge *judge, void *user)
{
    state all[LEVELS + 1];
    choice c = {judge, user};
    uint32_t count = 1, low = 0, high, patches = k->made.count;
    k->user = &c;
    uint32_t *patch = QW_NEW(k->env, uint32_t, k->m->face_count);
    memcpy(patch, k->chart_of, k->m->face_count * sizeof *patch);
    add_state(k, &all[0]);
    double waste = FIRST_WASTE;
    for (uint32_t level = 0; level < (judge ? LEVELS : 1); level++, waste /= 2) {
        count += join_more(k, level + 1 < LEVELS ? waste : 0, &all[count]);
        qw_progress_work(k->env, PATCHES_LAID + (CHARTS_JOINED - PATCHES_LAID) * (level + 1) / LEVELS);
    }
    if (count > 1) low = 1;
    /* bisection: those that are larger pack less well, on the whole */
    for (high = count; judge && high - low > 1;) {
        uint32_t middle = (low + high) / 2;
        go_back_turned(k, &all[middle]);
        if (packs_well(k)) low = middle;
        else high = middle;
    }
    assert(low < count && count <= LEVELS + 1);
    go_back_turned(k, &all[low]);
    if (judge) {
        sharer s = {.patches = &all[0], .patch = patch, .mark = QW_NEW(k->env, uint8_t, k->m->face_count)};
        add_state(k, &s.kept), add_state(k, &s.first);
        rearrange(k, &s, patches);
        k->bounds.only_crumbs = true, k->bounds.most_of_one = MOST_OF_CRUMBS;
        qw_join_charts(k);
    }
    take_charts_again(k);
    for (uint32_t a = 0; a < k->made.count; a++) finish_chart(k, &k->made.chart[a]);
}

qw_charts_made qw_make_charts(qw_env *env, qw_atlas_mesh *mesh, double most_stretch, double longest,
                              const double *weight, const uint32_t *mirror, qw_chart_judge *judge, void *user)
{
    maker k = {.env = env, .m = mesh, .weight = weight, .mirror = mirror};
    k.bounds = (qw_join_bounds){.most_stretch = most_stretch, .most_of_one = MOST_OF_ONE};
    k.made.uv = qw_alloc_zero(env, mesh->corner_count, sizeof *k.made.uv);
    k.local = QW_NEW(env, uint32_t, mesh->corner_count);
    qw_cut_patches(env, mesh);
    for (uint32_t f = 0; f < mesh->face_count; f++) k.total += face_area(mesh, f);
    k.bounds.longest = fmin(MOST_LENGTH * sqrt(k.total), longest);
    mesh->least = 1e-5 * sqrt(k.total); /* some steps of the grid on which coordinates are written */
    lay_patches(&k);
    k.made.patches = k.made.count;
    qw_progress_work(env, PATCHES_LAID);
    join_at_levels(&k, judge, user);
    qw_free(env, k.heap), qw_free(env, k.local), qw_free(env, k.chart_of);
    return k.made;
}
