/* For each quad that is certainly turned over, by number: the quads of some rings around it are taken out as a mesh of
 * their own, the plot, whose inner vertices search for better places (qw_straighten_patch); first as they are, then
 * after each legal move near by, then after each second move upon the best of those. The first that leaves none turned
 * over there is kept, else the best if it has fewer.
 */
#include "quad/mend.h"

#include "quad/moves.h"
#include "quad/straighten.h"

#include <math.h>
#include <string.h>

enum {
    RINGS = 2,        /* around what changes */
    MOST_FACES = 150, /* of a plot */
    DEPTH = 2,
    BEAM = 12, /* moves one upon another; trials that a second one is tried upon */
    MOST_SEEDS = 4 + 6 * DEPTH,
    MOST_VERTICES = 4 * MOST_FACES + MOST_SEEDS,
    MOST_MOVES = 512,  /* tried around a quad at a time */
    MOST_FAILURES = 8, /* quads in a row for which nothing helped: an input that contradicts itself has thousands */
    MOST_CORNERS = 4,  /* that may be turned over for a quad that is no more, where nothing else helps */
    LEAST_TRIALS = 400,
    QUADS_A_TRIAL = 40 /* of 2 to 30 ms each */
};
/* In squares of the mean edge: a smaller quad alone is nothing to be mended. */
static const float SLIVER = 0.01f;
/* In mean edges: quads that a mending changes are no farther than this from the one that asks for it: of the surface
   around one that is, less is known, so that it sooner counts as turned over. */
static const float AROUND = 12;
/* Cosine below which two quads beside one another make both of them suspects. */
static const float FOLDED = -0.2f;

typedef struct faults {
    int8_t certain, perhaps, corners; /* turned over: the quad certainly, perhaps; how many of its corners */
} faults;

typedef struct mender {
    qw_env *env;
    qw_quad_edit e;
    qw_untangling rough; /* on the surface where vertices search, as relaxation has it */
    qw_untangling look;  /* on the whole surface, by which is judged */
    qw_near near;        /* the triangles of that around the quad that is looked at */
    float edge;
    int64_t least, trials, reserve; /* trials: left; as many as the reserve are for later */
    uint8_t
        *tried; /* [faces] the pass in which nothing helped, counted from 1; 0: none since something changed there */
    uint32_t *vertex_in, *face_in, round; /* [vertices], [faces]: the last plot that they were in */
    uint32_t *number, *face_number;       /* [vertices], [faces] in the plot */
    faults *known;                        /* [faces] */
} mender;

/* The quads around a place as a mesh of their own. */
typedef struct plot {
    uint32_t faces[MOST_FACES], vertices[MOST_VERTICES], corner[4 * MOST_FACES], twin[4 * MOST_FACES];
    uint32_t begin[MOST_VERTICES + 2], around[4 * MOST_FACES], bound[MOST_VERTICES];
    qw_vec3 position[MOST_VERTICES], home[MOST_VERTICES];
    uint8_t kind[MOST_VERTICES], held[MOST_VERTICES];
    qw_quadmesh quads;
    qw_curve_binding curves;
    qw_untangling rough;
} plot;

/* ---- what is turned over */

static qw_vec3 diagonals_cross(const qw_quadmesh *q, uint32_t f)
{
    const uint32_t *c = q->corner + 4 * (size_t)f;
    return qw_cross(qw_sub(q->position[c[2]], q->position[c[0]]), qw_sub(q->position[c[3]], q->position[c[1]]));
}

/* Cheap, and true of a quad beside each edge over which the quads turn to the other side. */
static bool is_suspect(const qw_untangling *u, uint32_t f)
{
    if (qw_turned_corners(u, f) > 0) return true;
    qw_vec3 n = qw_normalize(diagonals_cross(u->quads, f));
    for (uint32_t h = 4 * f; h < 4 * f + 4; h++) {
        uint32_t t = u->quads->twin[h];
        if (t != QW_NONE && qw_dot(n, qw_normalize(diagonals_cross(u->quads, t / 4))) < FOLDED) return true;
    }
    return false;
}

/* What is needed of `u` to see where the quads lie on the surface: what is asked about flipped quads is asked of that.
 */
static void look_at(qw_env *env, qw_untangling *u, const qw_trimesh *surface)
{
    u->surface = surface;
    u->tree = qw_bvh_build(env, surface);
}

static qw_vec3 middle_of(const qw_quadmesh *q, uint32_t f)
{
    const uint32_t *c = q->corner + 4 * (size_t)f;
    return qw_scale(qw_add(qw_add(q->position[c[0]], q->position[c[1]]), qw_add(q->position[c[2]], q->position[c[3]])),
                    0.25f);
}

/* So far from its middle f and all within an edge of it. */
static float reach_of(const qw_quadmesh *q, uint32_t f, float edge)
{
    float most = 0;
    for (uint32_t i = 0; i < 4; i++)
        most = fmaxf(most, qw_distance(q->position[q->corner[4 * f + i]], middle_of(q, f)));
    return most + edge;
}

bool qw_has_flipped(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const qw_trimesh *whole)
{
    qw_untangling rough = {.quads = quads, .position = quads->position}, u = rough;
    bool found = false;
    qw_scope_begin(env);
    float edge = qw_mean_edge(&u);
    uint32_t *list = NULL;
    for (uint32_t f = 0; f < quads->face_count && !found; f++) {
        if (qw_length(diagonals_cross(quads, f)) < 2 * SLIVER * edge * edge || !is_suspect(&u, f)) continue;
        if (!rough.tree) look_at(env, &rough, surface);
        qw_break_silence(env);
        if (!qw_is_opposed(&rough, f)) continue;
        if (!u.tree) look_at(env, &u, whole), list = QW_NEW(env, uint32_t, whole->face_count);
        qw_near near = {.middle = middle_of(quads, f), .reach = reach_of(quads, f, edge), .list = list};
        found = qw_is_turned_over(&u, edge, f, &near);
    }
    qw_scope_end(env);
    return found;
}

/* ---- plots */

static bool is_inside(const mender *m, uint32_t v)
{
    uint32_t first = m->e.out[v], h = first;
    do {
        if (m->face_in[h / 4] != m->round) return false;
        h = qw_quad_around(&m->e.mesh, h);
    } while (h != QW_NONE && h != first);
    return true;
}

static void add_vertex(mender *m, plot *p, uint32_t v)
{
    if (m->vertex_in[v] == m->round) return;
    m->vertex_in[v] = m->round, m->number[v] = p->quads.vertex_count;
    p->vertices[p->quads.vertex_count++] = v;
}

/* The quads at v and their vertices; false where there is no room. */
static bool add_around(mender *m, plot *p, uint32_t v)
{
    uint32_t first = m->e.out[v], h = first;
    do {
        if (m->face_in[h / 4] != m->round) {
            if (p->quads.face_count == MOST_FACES) return false;
            m->face_in[h / 4] = m->round, m->face_number[h / 4] = p->quads.face_count,
                           p->faces[p->quads.face_count++] = h / 4;
            for (uint32_t i = 0; i < 4; i++) add_vertex(m, p, m->e.mesh.corner[(h & ~3u) + i]);
        }
        h = qw_quad_around(&m->e.mesh, h);
    } while (h != QW_NONE && h != first);
    return true;
}

static void index_plot(plot *p)
{
    uint32_t n = p->quads.vertex_count, sides = 4 * p->quads.face_count;
    memset(p->begin, 0, (n + 2) * sizeof *p->begin);
    for (uint32_t h = 0; h < sides; h++) p->begin[p->corner[h] + 2]++;
    for (uint32_t v = 0; v < n; v++) p->begin[v + 2] += p->begin[v + 1];
    for (uint32_t h = 0; h < sides; h++) p->around[p->begin[p->corner[h] + 1]++] = h;
}

/* RINGS around the vertices, as many quads as there is room for. */
static void take_plot(mender *m, plot *p, const uint32_t *vertices, uint32_t count)
{
    const qw_quadmesh *q = &m->e.mesh;
    m->round++;
    p->quads = (qw_quadmesh){.position = p->position, .corner = p->corner, .twin = p->twin, .kind = p->kind};
    for (uint32_t i = 0; i < count; i++) add_vertex(m, p, vertices[i]);
    bool fits = true;
    for (uint32_t ring = 0, done = 0; ring < RINGS; ring++)
        for (uint32_t end = p->quads.vertex_count; fits && done < end; done++)
            fits = add_around(m, p, p->vertices[done]);
    for (uint32_t i = 0; i < p->quads.vertex_count; i++) {
        uint32_t v = p->vertices[i];
        p->position[i] = q->position[v], p->kind[i] = q->kind[v], p->held[i] = !is_inside(m, v), p->bound[i] = QW_NONE;
    }
    for (uint32_t h = 0; h < 4 * p->quads.face_count; h++) {
        uint32_t at = 4 * p->faces[h / 4] + h % 4, t = q->twin[at];
        p->corner[h] = m->number[q->corner[at]];
        p->twin[h] = t != QW_NONE && m->face_in[t / 4] == m->round ? 4 * m->face_number[t / 4] + t % 4 : QW_NONE;
    }
    index_plot(p);
    p->curves = (qw_curve_binding){.surface = m->rough.surface, .edge = p->bound};
    p->rough = m->rough;
    p->rough.quads = &p->quads, p->rough.position = p->position, p->rough.curves = &p->curves;
    p->rough.begin = p->begin, p->rough.around = p->around;
}

/* Into the whole. */
static void place_plot(mender *m, const plot *p)
{
    for (uint32_t i = 0; i < p->quads.vertex_count; i++)
        if (!p->held[i]) qw_quad_edit_place(&m->e, p->vertices[i], p->position[i]);
}

static faults faults_of(mender *m, uint32_t f)
{
    const qw_untangling *u = &m->look;
    bool turned = qw_is_turned_over(u, m->edge, f, &m->near);
    return (faults){turned, !turned && qw_flip_degree(u, m->edge, f) > 0, (int8_t)qw_turned_corners(u, f)};
}

/* ---- trials */

/* What is asked next is asked within that reach of f. */
static void look_around(mender *m, uint32_t f, float reach)
{
    m->near = (qw_near){.middle = middle_of(&m->e.mesh, f), .reach = reach, .list = m->near.list};
}

typedef struct trial {
    qw_quad_move list[DEPTH];
    uint32_t length;
    int32_t certain, perhaps, corners; /* by how much the faults change */
    bool clean;                        /* nothing in the plot is certainly turned over */
} trial;

static int32_t others(const trial *t) { return 4 * t->perhaps + t->corners; }

static bool is_better(const trial *a, const trial *b)
{
    return a->certain != b->certain ? a->certain < b->certain : others(a) < others(b);
}

/* corners: so many may be turned over instead of each quad. */
static bool is_gain(const trial *t, int32_t corners)
{
    return t->certain < 0 && t->certain + t->perhaps <= 0 && t->corners <= -corners * t->certain;
}

static void add_faults(const faults *f, int32_t sign, trial *t)
{
    t->certain += sign * f->certain, t->perhaps += sign * f->perhaps, t->corners += sign * f->corners;
}

static void add_seed(const mender *m, uint32_t *seeds, uint32_t *n, uint32_t v)
{
    if (m->e.gone[m->e.out[v] / 4] || m->e.mesh.corner[m->e.out[v]] != v) return;
    for (uint32_t i = 0; i < *n; i++)
        if (seeds[i] == v) return;
    seeds[(*n)++] = v;
}

/* A collapse by whichever of the two corners can stay. */
static bool make_move(mender *m, qw_quad_move move)
{
    if (move.kind == QW_COLLAPSE && (int64_t)m->e.live_faces <= m->least) return false;
    if (qw_make_quad_move(&m->e, move, false)) return true;
    move.half = qw_quad_next(qw_quad_next(move.half));
    return move.kind == QW_COLLAPSE && qw_make_quad_move(&m->e, move, false);
}

/* Makes the moves, and in `p` the plot around them and quad f with its vertices where they go. False, and nothing,
 * where a move is not legal. */
static bool make_trial(mender *m, plot *p, uint32_t f, trial *t)
{
    size_t writes = m->e.writes;
    uint32_t seeds[MOST_SEEDS], n = 0, changed[6 * DEPTH + 4], many = 4;
    memcpy(changed, m->e.mesh.corner + 4 * (size_t)f, 4 * sizeof *changed);
    t->certain = t->perhaps = t->corners = 0, t->clean = true;
    for (uint32_t i = 0; i < t->length; i++) {
        many += qw_changed_by_move(&m->e.mesh, t->list[i], changed + many);
        if (m->e.gone[t->list[i].half / 4] || !make_move(m, t->list[i])) {
            qw_quad_edit_undo(&m->e, writes);
            return false;
        }
        if (t->list[i].kind == QW_COLLAPSE) add_faults(&m->known[t->list[i].half / 4], -1, t);
    }
    for (uint32_t i = 0; i < many; i++) add_seed(m, seeds, &n, changed[i]);
    take_plot(m, p, seeds, n);
    memcpy(p->home, p->position, p->quads.vertex_count * sizeof *p->home);
    qw_straighten_patch(m->env, &p->rough, p->held, m->edge);
    place_plot(m, p);
    for (uint32_t i = 0; i < p->quads.face_count; i++) {
        faults now = faults_of(m, p->faces[i]);
        add_faults(&m->known[p->faces[i]], -1, t), add_faults(&now, 1, t);
        t->clean &= now.certain == 0;
    }
    return true;
}

static bool try_trial(mender *m, plot *p, uint32_t f, trial *t)
{
    size_t writes = m->e.writes;
    qw_break_silence(m->env);
    if (m->trials <= m->reserve || !make_trial(m, p, f, t)) return false;
    m->trials--;
    qw_quad_edit_undo(&m->e, writes);
    return true;
}

static void keep_trial(mender *m, plot *p, uint32_t f, trial *t)
{
    if (!make_trial(m, p, f, t)) return;
    size_t writes = m->e.writes;
    int32_t change = 0;
    qw_put_on_curves(m->env, &p->rough, p->held, m->edge, p->home);
    place_plot(m, p);
    for (uint32_t i = 0; i < p->quads.face_count; i++)
        change += faults_of(m, p->faces[i]).certain - m->known[p->faces[i]].certain;
    if (change > t->certain)
        qw_quad_edit_undo(&m->e, writes); /* it went by what opposes the surface, not by the measure */
    for (uint32_t i = 0; i < p->quads.face_count; i++)
        m->known[p->faces[i]] = faults_of(m, p->faces[i]), m->tried[p->faces[i]] = 0;
    m->e.writes = 0;
}

/* Those that change the edges at v and are not listed yet. */
static void add_moves(const mender *m, uint32_t v, qw_quad_move *list, uint32_t *n)
{
    qw_quad_move at[QW_MOVES_AT];
    bool open;
    if (m->e.gone[m->e.out[v] / 4] || m->e.mesh.corner[m->e.out[v]] != v ||
        qw_quad_valence(&m->e.mesh, m->e.out[v], &open) > QW_MAX_VALENCE)
        return;
    for (uint32_t i = 0, found = qw_quad_moves_at(&m->e, v, at); i < found && *n < MOST_MOVES; i++) {
        uint32_t h = at[i].half, other = at[i].kind == QW_COLLAPSE ? qw_quad_next(qw_quad_next(h)) : m->e.mesh.twin[h],
                 k = 0;
        if (other < h) at[i].half = other;
        while (k < *n && (list[k].half != at[i].half || list[k].kind != at[i].kind)) k++;
        if (k == *n) list[(*n)++] = at[i];
    }
}

/* All moves at the corners of f, and at those that `after` changes once it is made. */
static uint32_t list_moves(mender *m, uint32_t f, const trial *after, qw_quad_move list[MOST_MOVES])
{
    size_t writes = m->e.writes;
    uint32_t n = 0, changed[6 * DEPTH + 4], many = 4;
    memcpy(changed, m->e.mesh.corner + 4 * (size_t)f, 4 * sizeof *changed);
    for (uint32_t i = 0; i < after->length; i++) {
        many += qw_changed_by_move(&m->e.mesh, after->list[i], changed + many);
        make_move(m, after->list[i]);
    }
    for (uint32_t i = 0; i < many; i++) add_moves(m, changed[i], list, &n);
    qw_quad_edit_undo(&m->e, writes);
    return n;
}

/* The best few, the best first. */
static void enter(trial *beam, uint32_t *n, const trial *t)
{
    uint32_t at = *n;
    while (at > 0 && is_better(t, &beam[at - 1])) at--;
    if (at == BEAM) return;
    if (*n < BEAM) (*n)++;
    for (uint32_t i = *n - 1; i > at; i--) beam[i] = beam[i - 1];
    beam[at] = *t;
}

/* What is tried in a pass. */
typedef struct effort {
    uint32_t depth;  /* moves in a row */
    int32_t corners; /* that may be turned over for each quad that is no more */
    uint32_t share;  /* of all trials, one in so many is kept for later passes; 0: none */
} effort;

/* The cheap ones first. A quad that is turned over is worse than corners that are, but these stay where there is
 * another way. */
static const effort efforts[] = {{0, 0, 2}, {1, 0, 2}, {2, 0, 3}, {1, MOST_CORNERS, 0}, {2, MOST_CORNERS, 0}};
enum { PASSES = sizeof efforts / sizeof *efforts };

/* Each move after each trial of `from`; the best of all into `best`, the best few into `next`. Returns how many those
 * are. */
static uint32_t go_deeper(mender *m, plot *p, uint32_t f, const trial *from, uint32_t from_count, int32_t corners,
                          trial *best, trial *next)
{
    uint32_t next_count = 0;
    for (uint32_t i = 0; i < from_count; i++) {
        qw_quad_move list[MOST_MOVES];
        uint32_t n = list_moves(m, f, &from[i], list);
        for (uint32_t k = 0; k < n; k++) {
            if (best->clean && is_gain(best, 0)) return next_count;
            trial t = from[i];
            t.list[t.length++] = list[k];
            if (!try_trial(m, p, f, &t)) continue;
            enter(next, &next_count, &t);
            bool gains = is_gain(&t, corners), gained = is_gain(best, corners);
            if (gains > gained || (gains == gained && is_better(&t, best))) *best = t;
        }
    }
    return next_count;
}

/* Whether quad f, or another near it, is turned over no more. */
static bool mend(mender *m, plot *p, uint32_t f, const effort *e)
{
    trial best = {.length = 0}, from[BEAM] = {{.length = 0}}, next[BEAM];
    uint32_t count = 1;
    look_around(m, f, reach_of(&m->e.mesh, f, AROUND * m->edge));
    if (!try_trial(m, p, f, &best)) return false;
    for (uint32_t depth = 0; depth < e->depth && !is_gain(&best, e->corners); depth++) {
        count = go_deeper(m, p, f, from, count, e->corners, &best, next);
        memcpy(from, next, count * sizeof *next);
    }
    if (!is_gain(&best, e->corners)) return false;
    keep_trial(m, p, f, &best);
    return true;
}

/* ---- all of them */

/* What is known of all quads at first. */
static void survey(mender *m)
{
    for (uint32_t f = 0; f < m->e.mesh.face_count; f++) {
        look_around(m, f, reach_of(&m->e.mesh, f, m->edge));
        m->known[f] = faults_of(m, f);
        qw_break_silence(m->env);
    }
}

static mender *make_mender(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const qw_trimesh *whole,
                           int64_t least)
{
    mender *m = QW_NEW_ZERO(env, mender, 1);
    *m = (mender){.env = env,
                  .e = qw_quad_edit_open(env, quads),
                  .least = least,
                  .trials = LEAST_TRIALS + quads->face_count / QUADS_A_TRIAL};
    m->e.keeps_journal = true;
    m->rough = m->look = (qw_untangling){.quads = &m->e.mesh, .position = m->e.mesh.position};
    m->edge = qw_mean_edge(&m->look);
    look_at(env, &m->rough, surface), look_at(env, &m->look, whole);
    m->vertex_in = QW_NEW_ZERO(env, uint32_t, quads->vertex_count),
    m->face_in = QW_NEW_ZERO(env, uint32_t, quads->face_count);
    m->number = QW_NEW(env, uint32_t, quads->vertex_count), m->face_number = QW_NEW(env, uint32_t, quads->face_count);
    m->known = QW_NEW(env, faults, quads->face_count), m->tried = QW_NEW_ZERO(env, uint8_t, quads->face_count);
    m->near.list = QW_NEW(env, uint32_t, whole->face_count);
    survey(m);
    return m;
}

static uint32_t count_certain(const mender *m)
{
    uint32_t n = 0;
    for (uint32_t f = 0; f < m->e.mesh.face_count; f++) n += !m->e.gone[f] && m->known[f].certain;
    return n;
}

/* Whether any was mended. */
static bool mend_all(mender *m, plot *p, uint32_t pass)
{
    bool any = false;
    for (uint32_t f = 0, failures = 0; f < m->e.mesh.face_count && failures < MOST_FAILURES; f++) {
        while (!m->e.gone[f] && m->known[f].certain && m->tried[f] <= pass) {
            if (mend(m, p, f, &efforts[pass])) failures = 0, any = true;
            else m->tried[f] = (uint8_t)(pass + 1), failures++;
        }
    }
    return any;
}

uint32_t qw_mend_flipped(qw_env *env, qw_quadmesh *quads, const qw_trimesh *surface, const qw_trimesh *whole,
                         int64_t least, uint8_t **flipped)
{
    qw_scope_begin(env);
    mender *m = make_mender(env, quads, surface, whole, least);
    plot *p = QW_NEW(env, plot, 1);
    uint32_t before = count_certain(m);
    int64_t all = m->trials;
    for (uint32_t pass = 0; pass < PASSES && before > 0; pass++) {
        m->reserve = efforts[pass].share ? all / efforts[pass].share : 0;
        while (mend_all(m, p, pass)) {}
    }
    uint32_t left = count_certain(m);
    qw_log(env, QW_LOG_DEBUG, "mended quads turned over: %u, now %u", before, left);
    if (left < before) {
        uint8_t *now = QW_NEW_ZERO(env, uint8_t, quads->face_count);
        uint32_t faces = 0;
        for (uint32_t f = 0; f < quads->face_count; f++)
            if (!m->e.gone[f]) now[faces++] = (uint8_t)(m->known[f].certain ? QW_CERTAINLY_FLIPPED : 0);
        qw_quad_edit_pack(&m->e);
        qw_quad_edit_keep(&m->e);
        *quads = m->e.mesh;
        *flipped = now;
        qw_keep(env, now);
    }
    qw_scope_end(env);
    return before - left;
}
