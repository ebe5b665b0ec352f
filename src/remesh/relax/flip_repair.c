/* Each step of the table goes over the quads that it is for, by number. It takes the window around a quad, in ever more
 * rings, tries to place its vertices better, and keeps what has fewer faults.
 */
#include "remesh/relax/flip_repair.h"

#include "base/mechanisms.h"
#include "remesh/relax/quad_window.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* Cosine below which two quads beside one another are folded over. */
static const float FOLDED = -QW_SAME_SHEET;
/* A quad's area, in mean areas, counts as at least this where its distance from the surface is weighed. */
static const float LEAST_AREA = 0.05f;

/* ---- the table */

typedef enum remedy_for { FOR_CORNERS, FOR_DOUBTFUL, FOR_FLIPPED } remedy_for;

/* One step of repair. applies: to which quads, those with an inverted corner and all worse ones, doubtful ones and
   flipped ones, or flipped ones alone. rings: of the largest window that is tried while the quad has faults.
   least_area: share of the window's area that must be left. */
typedef struct remedy {
    qw_mechanism mechanism;
    const char *name;
    remedy_for applies;
    uint8_t rings;
    qw_placing placing;
    qw_freedom freedom;
    float least_area;
} remedy;

#define REMEDY(name, ...)                  \
    {                                      \
        QW_MECH_##name, #name, __VA_ARGS__ \
    }
static const remedy table[] = {
    REMEDY(MEMBRANE, FOR_FLIPPED, 3, QW_MEMBRANE, QW_ON_CURVES, 0.4f),
    REMEDY(MEMBRANE_DOUBT, FOR_DOUBTFUL, 3, QW_MEMBRANE, QW_ON_CURVES, 0.85f),
    REMEDY(MEMBRANE_SEARCH, FOR_DOUBTFUL, 3, QW_MEMBRANE_SEARCH, QW_ON_CURVES, 0),
    REMEDY(MEMBRANE_SLIDE, FOR_FLIPPED, 3, QW_MEMBRANE, QW_CORNERS_SLIDE, 0.4f),
    REMEDY(SEARCH_SLIDE, FOR_CORNERS, 2, QW_SEARCH, QW_CORNERS_SLIDE, 0),
};
enum { PASSES = 2 };
/* Each step may take so many steps of the budget (qw_repair_site), and so many for each quad. */
enum { BUDGET = 6000, BUDGET_A_QUAD = 4 };

typedef struct engine {
    qw_repair_site site;
    qw_faults *known; /* [faces] */
    uint8_t *failed;  /* [faces] 1: this step did not help, and nothing has changed there since */
    qw_window *window;
} engine;

static bool applies(const remedy *r, qw_faults known)
{
    return known.flipped > 0 || (r->applies <= FOR_DOUBTFUL && known.doubtful > 0) ||
           (r->applies == FOR_CORNERS && known.inverted > 0);
}

/* ---- one quad */

/* Tries the step on the window around quad f. Returns whether it left fewer faults, and keeps the result then. */
static bool repair_at(engine *g, uint32_t f, const remedy *r, uint32_t rings)
{
    assert(f < g->site.e.mesh.face_count);
    qw_window *p = g->window;
    qw_heartbeat(g->site.env);
    if (g->site.budget == 0) return false;
    qw_window_take(&g->site, p, g->site.e.mesh.corner + 4 * (size_t)f, 4, rings, r->freedom);
    qw_faults before = {0, 0, 0};
    for (uint32_t i = 0; i < p->quads.face_count; i++) qw_add_faults(&before, g->known[p->face[i]], 1);
    p->least_area = r->least_area, p->faults = before;
    qw_window_place(&g->site, p, r->placing);
    if (!qw_fewer_faults(p->faults, before)) return false;
    if (p->freedom != QW_ON_CURVES) qw_window_put_on_curves(&g->site, p);
    qw_window_put(&g->site, p);
    for (uint32_t i = 0; i < p->quads.face_count; i++)
        g->known[p->face[i]] = qw_window_faults_of(&g->site, p, i), g->failed[p->face[i]] = 0;
    return true;
}

/* Tries windows of more and more rings, as long as the quad has faults. Returns whether any helped. */
static bool repair_quad(engine *g, uint32_t f, const remedy *r)
{
    bool any = false;
    for (uint32_t rings = 1; rings <= r->rings; rings++)
        if (applies(r, g->known[f])) any |= repair_at(g, f, r, rings);
    return any;
}

/* ---- all of them */

/* Applies the step to all quads that it is for. Returns whether any was repaired. */
static bool repair_all(engine *g, const remedy *r, uint32_t *tried, uint32_t *kept)
{
    bool any = false;
    for (uint32_t f = 0; f < g->site.e.mesh.face_count && g->site.budget > 0; f++) {
        if (g->failed[f] || !applies(r, g->known[f])) continue;
        bool helped = repair_quad(g, f, r);
        any |= helped;
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
    for (const remedy *r = table; r < table + sizeof table / sizeof *table; r++) {
        uint32_t tried = 0, kept = 0;
        if (!qw_uses(g->site.env, r->mechanism)) continue;
        if (r->freedom == QW_CORNERS_SLIDE && !g->site.all_curves)
            g->site.all_curves = qw_all_curves(g->site.env, g->site.surface);
        memset(g->failed, 0, faces);
        g->site.budget = BUDGET + (uint64_t)BUDGET_A_QUAD * faces;
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

static void survey_block(void *user, uint32_t begin, uint32_t end)
{
    const survey *s = user;
    for (uint32_t f = begin; f < end; f++)
        s->known[f] = qw_faults_of_quad(s->judge, s->quads->position, s->ground, s->quads->corner + 4 * (size_t)f);
}

/* Whether there may be anything to repair. */
static bool has_suspects(const qw_quadmesh *q, const qw_flip_repair *repair)
{
    for (uint32_t f = 0; f < q->face_count; f++)
        if (is_suspect(q, repair->ground, f)) return true;
    return false;
}

static qw_flip_counts count_faults(const engine *g)
{
    qw_flip_counts c = {0};
    for (uint32_t f = 0; f < g->site.e.mesh.face_count; f++) {
        c.flipped_left += (uint32_t)g->known[f].flipped, c.doubtful_left += (uint32_t)g->known[f].doubtful;
        c.inverted_left += (uint32_t)g->known[f].inverted;
    }
    return c;
}

static void copy_flags(const engine *g, uint8_t *flipped)
{
    for (uint32_t f = 0; f < g->site.e.mesh.face_count; f++)
        flipped[f] = (uint8_t)(g->known[f].flipped ? QW_FLIPPED : g->known[f].doubtful ? QW_DOUBTFUL : QW_NOT_FLIPPED);
}

/* All that the repair needs, in the current scope: the faults of every quad are known afterwards. */
static engine *make_engine(qw_env *env, const qw_quadmesh *quads, const qw_flip_repair *repair, const qw_bvh *tree,
                           float edge)
{
    assert(edge > 0 && tree);
    uint32_t vertices = quads->vertex_count, faces = quads->face_count;
    engine *g = QW_NEW_ZERO(env, engine, 1);
    qw_repair_site *s = &g->site;
    g->window = QW_NEW_ZERO(env, qw_window, 1);
    g->known = QW_NEW(env, qw_faults, faces), g->failed = QW_NEW(env, uint8_t, faces);
    *s = (qw_repair_site){.env = env, .e = qw_quad_edit_open(env, quads), .surface = repair->surface, .tree = tree};
    s->edge = edge, s->stays = repair->stays;
    if (repair->curves) s->curves = *repair->curves;
    s->judge = (qw_flip_judge){.surface = repair->surface, .tree = tree, .edge = edge};
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
    qw_parallel(env, faces, QW_GRAIN_SEARCH, survey_block, &all);
    return g;
}

qw_flip_counts qw_repair_flips(qw_env *env, qw_quadmesh *quads, const qw_flip_repair *repair, uint8_t *flipped)
{
    assert(quads->twin && repair->surface);
    qw_flip_counts counts = {0};
    float edge = (float)(qw_sum_of_sides(quads) / fmax(4.0 * quads->face_count, 1));
    memset(flipped, QW_NOT_FLIPPED, quads->face_count);
    if (!(edge > 0) || !has_suspects(quads, repair)) return counts;
    qw_scope_begin(env);
    engine *g = make_engine(env, quads, repair, repair->tree ? repair->tree : qw_bvh_build(env, repair->surface), edge);
    qw_flip_counts before = count_faults(g);
    run_table(g);
    counts = count_faults(g);
    counts.flipped = before.flipped_left, counts.inverted = before.inverted_left;
    qw_log(env, QW_LOG_DEBUG, "flipped quads: %u, now %u and %u in doubt; inverted corners: %u, now %u", counts.flipped,
           counts.flipped_left, counts.doubtful_left, counts.inverted, counts.inverted_left);
    copy_flags(g, flipped);
    memcpy(quads->position, g->site.e.mesh.position, quads->vertex_count * sizeof *quads->position);
    qw_scope_end(env);
    return counts;
}
