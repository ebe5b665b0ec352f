/* Each step of the table goes over the quads that it is for, by number. It takes the window around a quad, in ever more
 * rings, tries to place its vertices better, and keeps what has fewer faults. The steps of the last resort do so after
 * each legal move near by as well.
 */
#include "remesh/relax/flip_repair.h"

#include "base/mechanisms.h"
#include "geometry/quad_moves.h"
#include "remesh/relax/quad_window.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    MOST_CHANGED = 10, /* vertices at a quad and a move */
    MOST_MOVES = 512,  /* moves listed around a quad */
    MOST_FAILURES = 8, /* a step of the last resort ends in a component after so many failures in a row: an input that
                          contradicts itself has thousands of flipped quads */
    GRAIN = 64,
    SEARCHED = 256 /* quads that are looked at side by side until one is found flipped */
};
/* Squares of the mean edge: the last resort is not begun for flipped quads of a smaller area. */
static const float SLIVER = 0.01f;
/* Cosine below which two quads beside one another are folded over. */
static const float FOLDED = -QW_SAME_SHEET;
/* A quad's area, in mean areas, counts as at least this where its distance from the surface is weighed. */
static const float LEAST_AREA = 0.05f;

/* ---- the table */

typedef enum remedy_for { FOR_CORNERS, FOR_DOUBTFUL, FOR_FLIPPED } remedy_for;

/* One step of repair. applies: to which quads, those with an inverted corner and all worse ones, doubtful ones and
   flipped ones, or flipped ones alone. rings: of the first window, and of the largest that is tried while the quad has
   faults. moves: one is made before vertices are placed. least_area: share of the window's area that must be left.
   budget: in steps (qw_repair_site), at least and for each quad of the mesh. */
typedef struct remedy {
    qw_mechanism mechanism;
    const char *name;
    bool last_resort;
    remedy_for applies;
    uint8_t rings[2];
    bool moves;
    qw_placing placing;
    qw_freedom freedom;
    float least_area;
    uint32_t budget[2];
} remedy;

#define REMEDY(name, ...)                  \
    {                                      \
        QW_MECH_##name, #name, __VA_ARGS__ \
    }
static const remedy table[] = {
    REMEDY(MEMBRANE, false, FOR_FLIPPED, {1, 3}, false, QW_MEMBRANE, QW_ON_CURVES, 0.4f, {6000, 4}),
    REMEDY(MEMBRANE_DOUBT, false, FOR_DOUBTFUL, {1, 3}, false, QW_MEMBRANE, QW_ON_CURVES, 0.85f, {6000, 4}),
    REMEDY(SEARCH, false, FOR_CORNERS, {1, 2}, false, QW_SEARCH, QW_ON_CURVES, 0, {6000, 4}),
    REMEDY(MEMBRANE_SEARCH, false, FOR_DOUBTFUL, {1, 3}, false, QW_MEMBRANE_SEARCH, QW_ON_CURVES, 0, {6000, 4}),
    REMEDY(MEMBRANE_SLIDE, false, FOR_FLIPPED, {1, 3}, false, QW_MEMBRANE, QW_CORNERS_SLIDE, 0.4f, {6000, 4}),
    REMEDY(SEARCH_SLIDE, false, FOR_CORNERS, {1, 2}, false, QW_SEARCH, QW_CORNERS_SLIDE, 0, {6000, 4}),
    REMEDY(OFF_CURVES, true, FOR_FLIPPED, {2, 2}, false, QW_SEARCH_BOTH, QW_OFF_CURVES, 0, {15000, 5}),
    REMEDY(ONE_MOVE, true, FOR_FLIPPED, {2, 2}, true, QW_SEARCH_BOTH, QW_OFF_CURVES, 0, {15000, 15}),
};
enum { REMEDIES = sizeof table / sizeof *table, PASSES = 2 };

typedef struct engine {
    qw_repair_site site;
    const qw_flip_repair *repair;
    int64_t least;
    qw_faults *known; /* [faces] */
    uint8_t *failed;  /* [faces] 1: this step did not help, and nothing has changed there since */
    qw_window *window;
} engine;

static bool applies(const remedy *r, qw_faults known)
{
    return known.flipped > 0 || (r->applies <= FOR_DOUBTFUL && known.doubtful > 0) ||
           (r->applies == FOR_CORNERS && known.inverted > 0);
}

/* ---- tries */

typedef struct repair_try {
    qw_quad_move move;
    bool moves;
    qw_faults change; /* of the mesh's faults */
    bool clean;       /* nothing in the window is flipped */
} repair_try;

/* The last resort may leave no more corners inverted, and one more quad in doubt for each that is repaired. */
static bool is_gain(const repair_try *t, const remedy *r)
{
    int32_t fewer = -t->change.flipped, lesser = qw_lesser_faults(t->change);
    if (fewer <= 0) return fewer == 0 && lesser < 0;
    return !r->last_resort || (t->change.doubtful <= fewer && t->change.inverted <= 0);
}

static bool is_gone(const qw_quad_edit *e, uint32_t v)
{
    return e->gone[e->out[v] / 4] || e->mesh.corner[e->out[v]] != v;
}

static void add_seed(const qw_quad_edit *e, uint32_t *seeds, uint32_t *n, uint32_t v)
{
    if (is_gone(e, v)) return;
    for (uint32_t i = 0; i < *n; i++)
        if (seeds[i] == v) return;
    seeds[(*n)++] = v;
}

/* Makes a move; a collapse onto whichever of the two corners may stay. */
static bool make_move(engine *g, qw_quad_move move)
{
    assert(move.half < 4 * g->site.e.mesh.face_count);
    if (g->site.e.gone[move.half / 4]) return false;
    if (move.kind == QW_COLLAPSE && (int64_t)g->site.e.live_faces <= g->least) return false;
    if (qw_make_quad_move(&g->site.e, move, false)) return true;
    move.half = qw_quad_next(qw_quad_next(move.half));
    return move.kind == QW_COLLAPSE && qw_make_quad_move(&g->site.e, move, false);
}

/* Makes the move of a try, if it has one; returns false where it is not legal. changed: the vertices at the move and
   at quad f. */
static bool make_move_of(engine *g, repair_try *t, uint32_t f, uint32_t changed[MOST_CHANGED], uint32_t *count)
{
    memcpy(changed, g->site.e.mesh.corner + 4 * (size_t)f, 4 * sizeof *changed);
    *count = 4;
    if (!t->moves) return true;
    *count += qw_changed_by_move(&g->site.e.mesh, t->move, changed + *count);
    if (!make_move(g, t->move)) return false;
    if (t->move.kind == QW_COLLAPSE) qw_add_faults(&t->change, g->known[t->move.half / 4], -1);
    return true;
}

static bool has_corner_among(const qw_window *p, uint32_t f, const uint32_t *vertex, uint32_t count)
{
    for (uint32_t k = 0; k < 4 * count; k++)
        if (p->vertex[p->corner[4 * f + k % 4]] == vertex[k / 4]) return true;
    return false;
}

/* Of a window as it was taken: quads are judged anew only where moves have changed them. */
static qw_faults faults_as_taken(engine *g, const qw_window *p, const uint32_t *changed, uint32_t count)
{
    qw_faults sum = {0, 0, 0};
    for (uint32_t i = 0; i < p->quads.face_count; i++) {
        bool anew = has_corner_among(p, i, changed, count);
        qw_add_faults(&sum, anew ? qw_window_faults_of(&g->site, p, i) : g->known[p->face[i]], 1);
    }
    return sum;
}

/* Makes the move, and finds positions for the window around it and around quad f. The move stays made; false where it
   is not legal. */
static bool make_try(engine *g, uint32_t f, const remedy *r, uint32_t rings, repair_try *t)
{
    assert(f < g->site.e.mesh.face_count);
    uint32_t changed[MOST_CHANGED], count, seeds[QW_WINDOW_SEEDS], n = 0;
    qw_window *p = g->window;
    t->change = (qw_faults){0, 0, 0};
    if (!make_move_of(g, t, f, changed, &count)) return false;
    for (uint32_t i = 0; i < count; i++) add_seed(&g->site.e, seeds, &n, changed[i]);
    qw_window_take(&g->site, p, seeds, n, rings, r->freedom);
    p->least_area = r->least_area, p->faults = faults_as_taken(g, p, changed, t->moves ? count : 0);
    qw_window_place(&g->site, p, r->placing);
    qw_add_faults(&t->change, p->faults, 1);
    for (uint32_t i = 0; i < p->quads.face_count; i++) qw_add_faults(&t->change, g->known[p->face[i]], -1);
    t->clean = p->faults.flipped == 0;
    return true;
}

static bool try_remedy(engine *g, uint32_t f, const remedy *r, uint32_t rings, repair_try *t)
{
    size_t writes = g->site.e.writes;
    qw_heartbeat(g->site.env);
    if (g->site.budget == 0 || !make_try(g, f, r, rings, t)) return false;
    qw_quad_edit_undo(&g->site.e, writes);
    return true;
}

/* Writes the window into the mesh, after its moves. */
static void keep_window(engine *g)
{
    qw_window *p = g->window;
    if (p->freedom != QW_ON_CURVES) qw_window_put_on_curves(&g->site, p);
    qw_window_put(&g->site, p);
    for (uint32_t i = 0; i < p->quads.face_count; i++)
        g->known[p->face[i]] = qw_window_faults_of(&g->site, p, i), g->failed[p->face[i]] = 0;
    g->site.e.writes = 0;
}

/* ---- moves */

/* Those that change the edges at v and are not listed yet. */
static void add_moves(const qw_quad_edit *e, uint32_t v, qw_quad_move *list, uint32_t *n)
{
    qw_quad_move at[QW_MOVES_AT];
    bool open;
    if (is_gone(e, v) || qw_valence_at(e, v, &open) > QW_MAX_VALENCE) return;
    for (uint32_t i = 0, found = qw_quad_moves_at(e, v, at); i < found && *n < MOST_MOVES; i++) {
        uint32_t h = at[i].half, k = 0,
                 other = at[i].kind == QW_COLLAPSE ? qw_quad_next(qw_quad_next(h)) : e->mesh.twin[h];
        if (other < h) at[i].half = other;
        while (k < *n && (list[k].half != at[i].half || list[k].kind != at[i].kind)) k++;
        if (k == *n) list[(*n)++] = at[i];
    }
}

/* Tries each move at the corners of f; writes the best try of all into `best`. */
static void try_moves(engine *g, uint32_t f, const remedy *r, repair_try *best)
{
    qw_quad_move list[MOST_MOVES];
    uint32_t n = 0, corner[4];
    memcpy(corner, g->site.e.mesh.corner + 4 * (size_t)f, sizeof corner);
    for (uint32_t i = 0; i < 4; i++) add_moves(&g->site.e, corner[i], list, &n);
    for (uint32_t k = 0; k < n && !(best->clean && is_gain(best, r)); k++) {
        repair_try t = {.move = list[k], .moves = true};
        if (!try_remedy(g, f, r, r->rings[0], &t)) continue;
        bool gains = is_gain(&t, r), gained = is_gain(best, r);
        if (gains > gained || (gains == gained && qw_fewer_faults(t.change, best->change))) *best = t;
    }
}

/* ---- one quad */

/* Tries the step on the window around quad f. Returns whether it left fewer faults, and keeps the result then. */
static bool repair_at(engine *g, uint32_t f, const remedy *r, uint32_t rings)
{
    assert(f < g->site.e.mesh.face_count);
    repair_try best = {.moves = false};
    if (!try_remedy(g, f, r, rings, &best)) return false;
    if (r->moves && !is_gain(&best, r)) try_moves(g, f, r, &best);
    if (!is_gain(&best, r) || (best.moves && !make_try(g, f, r, rings, &best))) return false;
    if (!is_gain(&best, r)) { /* the budget ended meanwhile */
        qw_quad_edit_undo(&g->site.e, 0);
        return false;
    }
    keep_window(g);
    return true;
}

/* Tries windows of more and more rings, as long as the quad has faults. Returns whether any helped. */
static bool repair_quad(engine *g, uint32_t f, const remedy *r)
{
    bool any = false;
    for (uint32_t rings = r->rings[0]; rings <= r->rings[1]; rings++)
        if (!g->site.e.gone[f] && applies(r, g->known[f])) any |= repair_at(g, f, r, rings);
    return any;
}

/* ---- all of them */

static uint32_t component_of(const engine *g, uint32_t f)
{
    const qw_quadmesh *q = &g->site.e.mesh;
    return q->component ? q->component[q->corner[4 * (size_t)f]] : 0;
}

/* Applies the step to all quads that it is for. Returns whether any was repaired. */
static bool repair_all(engine *g, const remedy *r, uint32_t *tried, uint32_t *kept)
{
    bool any = false;
    for (uint32_t f = 0, failures = 0, last = 0; f < g->site.e.mesh.face_count && g->site.budget > 0; f++) {
        if (g->site.e.gone[f] || g->failed[f] || !applies(r, g->known[f])) continue;
        if (component_of(g, f) != last) last = component_of(g, f), failures = 0;
        if (r->last_resort && failures >= MOST_FAILURES) continue;
        bool helped = repair_quad(g, f, r);
        any |= helped, failures = helped ? 0 : failures + 1;
        ++*tried, *kept += helped;
        g->failed[f] = !helped;
    }
    return any;
}

/* Goes through the table of remedies, each within its own budget. */
static void run_table(engine *g)
{
    assert(g->site.tree && g->known && g->failed);
    uint32_t faces = g->site.e.mesh.face_count;
    for (const remedy *r = table; r < table + REMEDIES; r++) {
        uint32_t tried = 0, kept = 0;
        if (r->last_resort != g->repair->last_resort || !qw_uses(g->site.env, r->mechanism)) continue;
        if (r->freedom == QW_CORNERS_SLIDE && !g->site.all_curves)
            g->site.all_curves = qw_all_curves(g->site.env, g->site.surface);
        memset(g->failed, 0, faces);
        g->site.budget = r->budget[0] + (uint64_t)r->budget[1] * faces;
        for (int pass = 0; pass < PASSES && repair_all(g, r, &tried, &kept); pass++) {}
        qw_acted(g->site.env, r->mechanism, tried), qw_kept(g->site.env, r->mechanism, kept);
        if (tried > 0) qw_log(g->site.env, QW_LOG_DEBUG, "%s: %u of %u quads helped", r->name, kept, tried);
    }
}

/* ---- what there is to repair */

/* Whether a quad may be flipped, where the surface's normal is not known: true of a quad beside an edge across which
   the quads fold over. */
static bool is_suspect(const qw_quadmesh *q, const qw_vec3 *ground, uint32_t f)
{
    assert(f < q->face_count);
    const uint32_t *c = q->corner + 4 * (size_t)f;
    if (ground) return qw_may_be_flipped(q->position, ground, c);
    qw_vec3 n = qw_quad_normal(q, f);
    for (uint32_t h = 4 * f; h < 4 * f + 4; h++)
        if (q->twin[h] != QW_NONE && qw_dot(n, qw_quad_normal(q, q->twin[h] / 4)) < FOLDED) return true;
    return qw_inverted_corners(q->position, c) > 0;
}

typedef struct survey {
    const qw_quadmesh *quads;
    const qw_flip_judge *judge;
    const qw_vec3 *ground; /* NULL: all quads are judged */
    qw_faults *known;
} survey;

static void survey_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const survey *s = user;
    for (uint32_t f = begin; f < end; f++)
        s->known[f] = qw_faults_of_quad(s->judge, s->quads->position, s->ground, s->quads->corner + 4 * (size_t)f);
}

/* Whether there may be anything to repair. The last resort is for flipped quads that are worth it. */
static bool has_suspects(const qw_quadmesh *q, const qw_flip_repair *repair, float edge)
{
    for (uint32_t f = 0; f < q->face_count; f++) {
        bool is_sliver = repair->last_resort &&
                         qw_length(qw_quad_cross(q->position, q->corner + 4 * (size_t)f)) < 2 * SLIVER * edge * edge;
        if (!is_sliver && is_suspect(q, repair->ground, f)) return true;
    }
    return false;
}

typedef struct suspect_task {
    const qw_quadmesh *quads;
    const qw_flip_judge *judge;
    const qw_vec3 *ground;
    uint32_t from;
    uint8_t *found; /* uint8_t[SEARCHED] */
} suspect_task;

/* Looks for flipped quads among some. */
static void search_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const suspect_task *t = user;
    const qw_quadmesh *q = t->quads;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t f = t->from + i;
        t->found[i] = is_suspect(q, t->ground, f) &&
                      qw_flip_of_quad(t->judge, q->position, q->corner + 4 * (size_t)f) != QW_NOT_FLIPPED;
    }
}

/* Whether any suspect is, or may be, flipped as the surface has it. */
static bool finds_flipped(qw_env *env, const qw_quadmesh *q, const qw_flip_judge *judge, const qw_flip_repair *repair)
{
    uint8_t found[SEARCHED];
    suspect_task t = {q, judge, repair->ground, 0, found};
    for (; t.from < q->face_count; t.from += SEARCHED) {
        uint32_t count = q->face_count - t.from < SEARCHED ? q->face_count - t.from : SEARCHED;
        qw_parallel(env, count, GRAIN, search_block, &t);
        for (uint32_t i = 0; i < count; i++)
            if (found[i]) return true;
    }
    return false;
}

static qw_flip_counts count_faults(const engine *g)
{
    qw_flip_counts c = {0};
    for (uint32_t f = 0; f < g->site.e.mesh.face_count; f++) {
        if (g->site.e.gone[f]) continue;
        c.flipped_left += (uint32_t)g->known[f].flipped, c.doubtful_left += (uint32_t)g->known[f].doubtful;
        c.inverted_left += (uint32_t)g->known[f].inverted;
    }
    return c;
}

static void copy_flags(const engine *g, uint8_t *flipped)
{
    uint32_t n = 0;
    for (uint32_t f = 0; f < g->site.e.mesh.face_count; f++)
        if (!g->site.e.gone[f])
            flipped[n++] = (uint8_t)(g->known[f].flipped    ? QW_FLIPPED
                                     : g->known[f].doubtful ? QW_DOUBTFUL
                                                            : QW_NOT_FLIPPED);
}

/* All that the repair needs, in the current scope: the faults of every quad are known afterwards. */
static engine *make_engine(qw_env *env, const qw_quadmesh *quads, const qw_flip_repair *repair, const qw_bvh *tree,
                           float edge)
{
    assert(edge > 0 && tree);
    uint32_t vertices = quads->vertex_count, faces = quads->face_count;
    engine *g = QW_NEW_ZERO(env, engine, 1);
    qw_repair_site *s = &g->site;
    g->repair = repair, g->least = repair->least, g->window = QW_NEW_ZERO(env, qw_window, 1);
    g->known = QW_NEW(env, qw_faults, faces), g->failed = QW_NEW(env, uint8_t, faces);
    *s = (qw_repair_site){.env = env, .e = qw_quad_edit_open(env, quads), .surface = repair->surface, .tree = tree};
    s->e.keeps_journal = true, s->edge = edge;
    if (repair->curves) s->curves = *repair->curves;
    s->judge = (qw_flip_judge){.surface = repair->surface, .tree = tree, .edge = edge};
    if (repair->whole && repair->whole != repair->surface)
        s->judge.surface = repair->whole, s->judge.tree = qw_bvh_build(env, repair->whole);
    s->home = memcpy(QW_NEW(env, qw_vec3, vertices), quads->position, vertices * sizeof(qw_vec3));
    s->ground = QW_NEW_ZERO(env, qw_vec3, vertices);
    if (repair->ground) memcpy(s->ground, repair->ground, vertices * sizeof(qw_vec3));
    s->vertex_in = QW_NEW_ZERO(env, uint32_t, vertices), s->number = QW_NEW(env, uint32_t, vertices);
    s->face_in = QW_NEW_ZERO(env, uint32_t, faces), s->face_number = QW_NEW(env, uint32_t, faces);
    s->least_area = FLT_MIN;
    for (uint32_t f = 0; f < faces; f++)
        s->least_area += LEAST_AREA * qw_length(qw_quad_cross(quads->position, quads->corner + 4 * (size_t)f)) /
                         (float)faces;
    survey all = {quads, &s->judge, repair->ground, g->known};
    qw_parallel(env, faces, GRAIN, survey_block, &all);
    return g;
}

/* Writes the result: after relaxation into the caller's arrays, as only positions have changed; as the last resort
   into new ones. */
static void take_result(engine *g, qw_quadmesh *quads)
{
    if (!g->repair->last_resort) {
        memcpy(quads->position, g->site.e.mesh.position, quads->vertex_count * sizeof *quads->position);
        return;
    }
    qw_quad_edit_pack(&g->site.e);
    qw_quad_edit_keep(&g->site.e);
    *quads = g->site.e.mesh;
}

qw_flip_counts qw_repair_flips(qw_env *env, qw_quadmesh *quads, const qw_flip_repair *repair, uint8_t *flipped)
{
    assert(quads->twin && repair->surface);
    qw_flip_counts counts = {0};
    float edge = (float)(qw_sum_of_sides(quads) / fmax(4.0 * quads->face_count, 1));
    memset(flipped, QW_NOT_FLIPPED, quads->face_count);
    if (!(edge > 0) || !has_suspects(quads, repair, edge)) return counts;
    qw_scope_begin(env);
    const qw_bvh *tree = repair->tree ? repair->tree : qw_bvh_build(env, repair->surface);
    qw_flip_judge judge = {.surface = repair->surface, .tree = tree, .edge = edge};
    if (!repair->last_resort || finds_flipped(env, quads, &judge, repair)) {
        engine *g = make_engine(env, quads, repair, tree, edge);
        qw_flip_counts before = count_faults(g);
        run_table(g);
        counts = count_faults(g);
        counts.flipped = before.flipped_left, counts.inverted = before.inverted_left;
        qw_log(env, QW_LOG_DEBUG, "flipped quads: %u, now %u and %u in doubt; inverted corners: %u, now %u",
               counts.flipped, counts.flipped_left, counts.doubtful_left, counts.inverted, counts.inverted_left);
        copy_flags(g, flipped);
        take_result(g, quads);
    }
    qw_scope_end(env);
    return counts;
}
