#include "remesh/working/passes.h"

#include "remesh/working/mesh_blocks.h"

#include <assert.h>

enum {
    SCAN = 1 << 14,       /* faces between two calls of qw_progress, splits between two signs of life */
    FEW = 64,             /* of so many faces one */
    MOST_SPLITS = 1 << 20 /* for one face: each makes an edge shorter, so this is never met; but it is a bound */
};

static void tell(const qw_pass *p, uint32_t f, uint32_t count)
{
    if (f % SCAN == 0) qw_progress(p->env, p->from + (p->to - p->from) * f / (count ? count : 1));
}

/* What a pass on one thread has to look at, asked of all faces beforehand by all threads. */
typedef bool (*face_test)(const qw_edit *e, uint32_t f, const void *user);

typedef struct flagging {
    const qw_edit *edit;
    face_test test;
    const void *user;
    uint8_t *flag;
} flagging;

static void flag_block(void *user, uint32_t begin, uint32_t end)
{
    const flagging *a = user;
    for (uint32_t f = begin; f < end; f++) a->flag[f] = !qw_edit_dead(a->edit, f) && a->test(a->edit, f, a->user);
}

/* uint8_t[face_count], of the current scope; 0 for dead faces. */
static uint8_t *flag_faces(const qw_edit *e, face_test test, const void *user)
{
    flagging a = {e, test, user, QW_NEW(e->env, uint8_t, e->face_count)};
    qw_parallel(e->env, e->face_count, QW_GRAIN_LIGHT, flag_block, &a);
    return a.flag;
}

static bool has_long_edge(const qw_edit *e, uint32_t f, const void *user)
{
    const float *above = user;
    return fmaxf(fmaxf(qw_edge_ratio2(e, 4 * f), qw_edge_ratio2(e, 4 * f + 1)), qw_edge_ratio2(e, 4 * f + 2)) >
           *above * *above;
}

static bool has_seam_to_flip(const qw_edit *e, uint32_t f, const void *user)
{
    (void)user;
    for (uint32_t h = 4 * f; h < 4 * f + 3; h++)
        if (qw_is_first_side(e, h) && !qw_blocks_can_flip(e, h)) return true;
    return false;
}

static bool has_chord(const qw_edit *e, uint32_t f, const void *user)
{
    (void)user;
    const uint32_t *c = e->face[f].corner;
    return (e->vertex[c[0]].kind != QW_VERTEX_FREE) + (e->vertex[c[1]].kind != QW_VERTEX_FREE) +
               (e->vertex[c[2]].kind != QW_VERTEX_FREE) >=
           2;
}

static bool is_sliver(const qw_edit *e, uint32_t f, const void *user)
{
    (void)user;
    return qw_reshape_is_sliver(e, f);
}

typedef struct collapse_rule {
    float below, longest; /* in target lengths: edges that go, and edges that shall not arise */
} collapse_rule;

static bool has_seam_to_collapse(const qw_edit *e, uint32_t f, const void *user)
{
    const collapse_rule *rule = user;
    for (uint32_t h = 4 * f; h < 4 * f + 3; h++)
        if (qw_is_first_side(e, h) && !qw_blocks_can_collapse(e, h) && qw_edge_ratio2(e, h) < rule->below * rule->below)
            return true;
    return false;
}

/* Collapses the edges of f that the rule calls short. inner: those that a block may collapse by itself, or the
 * others. Returns how many. */
static uint32_t collapse_face(qw_reshape *r, uint32_t f, const collapse_rule *rule, bool inner)
{
    assert(f < r->edit.face_count);
    qw_edit *e = &r->edit;
    uint32_t done = 0;
    for (uint32_t h = 4 * f; h < 4 * f + 3 && !qw_edit_dead(e, f); h++)
        if (qw_is_first_side(e, h) && qw_blocks_can_collapse(e, h) == inner &&
            qw_edge_ratio2(e, h) < rule->below * rule->below)
            done += qw_reshape_collapse(r, h, rule->longest);
    return done;
}

static uint32_t collapse_block(void *user, qw_reshape *r, const qw_blocks *blocks, uint32_t block)
{
    uint32_t done = 0;
    for (uint32_t i = blocks->begin[block]; i < blocks->begin[block + 1]; i++)
        done += collapse_face(r, blocks->item[i], user, true);
    return done;
}

static bool has_short_edge(const qw_edit *e, uint32_t f, const void *user)
{
    const collapse_rule *rule = user;
    for (uint32_t h = 4 * f; h < 4 * f + 3; h++)
        if (qw_is_first_side(e, h) && qw_edge_ratio2(e, h) < rule->below * rule->below) return true;
    return false;
}

/* So few that blocks for them take longer than one thread with all of them. */
static bool are_few(const uint8_t *flag, uint32_t count)
{
    uint32_t flagged = 0;
    for (uint32_t f = 0; f < count; f++) flagged += flag[f];
    return flagged < count / FEW;
}

uint32_t qw_collapse_pass(qw_reshape *r, float below, float longest, qw_pass p)
{
    qw_edit *e = &r->edit;
    collapse_rule rule = {below, longest};
    qw_scope_begin(e->env);
    const uint8_t *flag = flag_faces(e, has_short_edge, &rule);
    bool few = are_few(flag, e->face_count);
    qw_blocks blocks = few ? qw_blocks_none(e) : qw_blocks_of_faces(e);
    uint32_t done = qw_blocks_run(r, &blocks, collapse_block, &rule);
    if (!few) flag = flag_faces(e, has_seam_to_collapse, &rule);
    for (uint32_t f = 0; f < e->face_count; f++) {
        tell(&p, f, e->face_count);
        if (flag[f]) done += collapse_face(r, f, &rule, false);
    }
    qw_scope_end(e->env);
    return done;
}

uint32_t qw_longest_edge(const qw_edit *e, uint32_t f, float *longest2)
{
    float a = qw_edge_ratio2(e, 4 * f), b = qw_edge_ratio2(e, 4 * f + 1), c = qw_edge_ratio2(e, 4 * f + 2);
    *longest2 = a > b ? (a > c ? a : c) : b > c ? b : c;
    return 4 * f + (*longest2 == a ? 0 : *longest2 == b ? 1 : 2);
}

/* Splits edges until those of the face are at most `above` long. An edge is split only where it is the longest of both
   its faces, which is found by going from face to face over their longest edges: so no face gets thinner than half of
   what there was (Rivara, New Longest-Edge Algorithms for the Refinement and/or Improvement of Unstructured
   Triangulations, 1997). */
static uint32_t split_face(qw_reshape *r, uint32_t f, float above)
{
    assert(f < r->edit.face_count);
    qw_edit *e = &r->edit;
    for (uint32_t done = 0;; done++) {
        float length2, beyond2;
        if (done == MOST_SPLITS) return done;
        if (done % SCAN == SCAN - 1) qw_heartbeat(e->env);
        uint32_t h = qw_longest_edge(e, f, &length2);
        if (!(length2 > above * above)) return done;
        for (uint32_t t = qw_edit_twin(e, h); t != QW_NONE; t = qw_edit_twin(e, h)) {
            uint32_t next = qw_longest_edge(e, t >> 2, &beyond2);
            if (!(beyond2 > length2)) break;
            h = next, length2 = beyond2;
        }
        if (!qw_reshape_split(r, h)) return done;
    }
}

uint32_t qw_split_pass(qw_reshape *r, float above, qw_pass p)
{
    uint32_t done = 0, count = r->edit.face_count;
    uint8_t *flag = flag_faces(&r->edit, has_long_edge, &above);
    for (uint32_t f = 0; f < count; f++) {
        tell(&p, f, count);
        if (flag[f]) done += split_face(r, f, above);
    }
    qw_free(r->edit.env, flag);
    return done;
}

static uint32_t flip_face(qw_reshape *r, uint32_t f, bool inner)
{
    qw_edit *e = &r->edit;
    uint32_t done = 0;
    for (uint32_t h = 4 * f; h < 4 * f + 3; h++)
        if (qw_is_first_side(e, h) && qw_blocks_can_flip(e, h) == inner) done += qw_reshape_flip(r, h);
    return done;
}

static uint32_t flip_block(void *user, qw_reshape *r, const qw_blocks *blocks, uint32_t block)
{
    (void)user;
    uint32_t done = 0;
    for (uint32_t i = blocks->begin[block]; i < blocks->begin[block + 1]; i++)
        done += flip_face(r, blocks->item[i], true);
    return done;
}

uint32_t qw_flip_pass(qw_reshape *r, qw_pass p)
{
    qw_edit *e = &r->edit;
    qw_scope_begin(e->env);
    qw_blocks blocks = qw_blocks_of_faces(e);
    uint32_t done = qw_blocks_run(r, &blocks, flip_block, NULL);
    const uint8_t *flag = flag_faces(e, has_seam_to_flip, NULL);
    for (uint32_t f = 0; f < e->face_count; f++) {
        tell(&p, f, e->face_count);
        if (flag[f]) done += flip_face(r, f, false);
    }
    qw_scope_end(e->env);
    return done;
}

static uint32_t smooth_block(void *user, qw_reshape *r, const qw_blocks *blocks, uint32_t block)
{
    (void)user;
    uint32_t done = 0;
    for (uint32_t i = blocks->begin[block]; i < blocks->begin[block + 1]; i++)
        done += qw_reshape_smooth(r, blocks->item[i]);
    return done;
}

void qw_smooth_pass(qw_reshape *r, qw_pass p)
{
    qw_edit *e = &r->edit;
    qw_scope_begin(e->env);
    qw_blocks blocks = qw_blocks_of_vertices(e);
    qw_blocks_run(r, &blocks, smooth_block, NULL);
    for (uint32_t v = 0; v < e->vertex_count; v++) {
        tell(&p, v, e->vertex_count);
        if (!e->vertex[v].inner) qw_reshape_smooth(r, v);
    }
    qw_scope_end(e->env);
}

void qw_sliver_pass(qw_reshape *r, qw_pass p)
{
    qw_edit *e = &r->edit;
    uint8_t *flag = flag_faces(e, is_sliver, NULL);
    for (uint32_t f = 0, count = e->face_count; f < count; f++) {
        tell(&p, f, count);
        if (flag[f] && !qw_edit_dead(e, f)) qw_reshape_sliver(r, f);
    }
    qw_free(e->env, flag);
}

void qw_free_faces(qw_reshape *r, qw_pass p)
{
    qw_edit *e = &r->edit;
    uint8_t *flag = flag_faces(e, has_chord, NULL);
    for (uint32_t f = 0, count = e->face_count; f < count; f++) {
        tell(&p, f, count);
        if (!flag[f]) continue;
        const uint32_t *c = e->face[f].corner;
        uint32_t longest = QW_NONE;
        float longest2 = 0;
        bool bound = true;
        for (uint32_t i = 0; i < 3; i++) bound &= e->vertex[c[i]].kind != QW_VERTEX_FREE;
        if (!bound) continue;
        for (uint32_t h = 4 * f; h < 4 * f + 3; h++)
            if (!qw_edit_on_curve(e, h) && qw_edge_ratio2(e, h) > longest2)
                longest = h, longest2 = qw_edge_ratio2(e, h);
        if (longest == QW_NONE || !qw_reshape_split(r, longest)) {
            qw_vec3 q = qw_scale(
                qw_add(qw_add(e->vertex[c[0]].position, e->vertex[c[1]].position), e->vertex[c[2]].position), 1 / 3.0f);
            float t = (e->vertex[c[0]].target + e->vertex[c[1]].target + e->vertex[c[2]].target) / 3;
            qw_edit_split_face(e, f, q, t, e->vertex[c[0]].home);
        }
    }
    qw_free(e->env, flag);
}

/* Splits edges longer than half a target whose ends are both of this kind or of one beyond it, along curves or across
   faces. */
static void split_edges(qw_reshape *r, qw_pass p, qw_vertex_kind least, bool on_curve)
{
    qw_edit *e = &r->edit;
    uint8_t *flag = flag_faces(e, has_chord, NULL);
    for (uint32_t f = 0, count = e->face_count; f < count; f++) {
        tell(&p, f, count);
        if (!flag[f]) continue;
        for (uint32_t h = 4 * f; h < 4 * f + 3; h++) {
            bool ends = e->vertex[qw_edit_tail(e, h)].kind >= least && e->vertex[qw_edit_head(e, h)].kind >= least;
            if (ends && qw_is_first_side(e, h) && qw_edit_on_curve(e, h) == on_curve &&
                qw_edge_ratio2(e, h) > 0.5f * 0.5f)
                qw_reshape_split(r, h);
        }
    }
    qw_free(e->env, flag);
}

void qw_split_short_curves(qw_reshape *r, qw_pass p) { split_edges(r, p, QW_VERTEX_CORNER, true); }

void qw_split_between_curves(qw_reshape *r, qw_pass p) { split_edges(r, p, QW_VERTEX_CURVE, false); }
