#include "remesh/meetings/strip_search.h"

#include "base/constants.h"
#include "base/hash.h"
#include "remesh/meetings/strips.h"
#include "remesh/quantise/circuits.h"
#include "remesh/quantise/touching.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Quads of strips that cross themselves by which there must be fewer for a quad that lines must become shorter by in a
   meeting: the search comes when meetings have used up most of what distortion may be had for. */
static const double LEFT_WORTH = 6;
/* Quads by which a move may make the score worse at first. */
static const double FIRST_THRESHOLD = 20;
/* Moves that are tried. */
enum { MOST_TRIES = 2000 };

/* What a move does to one edge, in the edge's own frame. */
typedef struct change {
    uint32_t edge;
    qw_int2 by;
} change;

/* Closed moves: those of move i are change[begin[i]] .. change[begin[i + 1] - 1]. */
typedef struct moves {
    uint32_t count;
    uint32_t *begin; /* uint32_t[count + 1] */
    change *change;
    size_t changes, room;
} moves;

/* What is known of the offsets at hand. */
typedef struct state {
    double energy, area, crossing; /* of the map; quads; quads in strips that cross themselves */
    double score;                  /* what the search lowers */
} state;

typedef struct strip_search {
    const qw_meeting_terms *terms;
    qw_complex *c;
    moves moves;
    qw_strip_room room;
    state now;
    double *energy; /* double[faces] */
    uint32_t *seen; /* uint32_t[faces]: the number of the last try whose move changes the face */
    /* of the move at hand: the faces that it changes, and their energies before */
    uint32_t *face, face_count; /* uint32_t[faces] */
    double *had;                /* double[faces] */
} strip_search;

/* ---- moves */

static void add_move(qw_env *env, moves *m, const qw_complex *c, const qw_int2 *had)
{
    for (uint32_t e = 0; e < c->edge_count; e++) {
        qw_int2 by = qw_int2_sub(c->d[e], had[e]);
        if (qw_int2_is_zero(by)) continue;
        m->change = qw_grow(env, m->change, &m->room, m->changes + 1, sizeof *m->change);
        m->change[m->changes++] = (change){e, by};
    }
    m->begin[++m->count] = (uint32_t)m->changes;
}

/* For each component that is not held the cheapest circuit through it, as if all offsets were the real ones: so a move
   costs as much as its opposite. */
static moves find_moves(qw_env *env, const qw_complex *of)
{
    moves m = {.begin = QW_NEW_ZERO(env, uint32_t, 2 * (size_t)of->edge_count + 1)};
    qw_complex c = *of;
    c.at_least = NULL, c.weight = QW_NEW(env, float, c.edge_count);
    qw_complex_weigh(&c);
    c.d = QW_NEW(env, qw_int2, c.edge_count), c.real = QW_NEW(env, qw_real2, c.edge_count);
    for (uint32_t e = 0; e < c.edge_count; e++) c.real[e] = (qw_real2){(float)of->d[e].x, (float)of->d[e].y};
    for (uint32_t v = 0; v < 2 * c.edge_count; v++) {
        memcpy(c.d, of->d, c.edge_count * sizeof *c.d);
        if (!qw_is_fixed(of->fixed[v / 2], v) && qw_step_offsets(env, &c, v, 1, QW_LONGEST_WALK, QW_MOST_WALK_COST))
            add_move(env, &m, &c, of->d);
    }
    return m;
}

static void make_move(strip_search *s, uint32_t i, int32_t sign)
{
    for (uint32_t k = s->moves.begin[i]; k < s->moves.begin[i + 1]; k++) {
        qw_int2 *d = &s->c->d[s->moves.change[k].edge], by = s->moves.change[k].by;
        d->x += sign * by.x, d->y += sign * by.y;
    }
}

/* ---- what is lowered */

static double area_of(const qw_complex *c, uint32_t f)
{
    return (double)qw_int2_det(qw_steps_along(c, 3 * f), qw_steps_along(c, 3 * f + 1)) / 2;
}

static double score_of(const qw_meeting_terms *t, const state *s)
{
    return s->crossing + LEFT_WORTH * (t->worth * s->energy + qw_area_beyond(t->least_area, t->most_area, s->area));
}

/* Lists the faces beside the move's edges and takes their energies and areas out of the sums. */
static void open_faces(strip_search *s, uint32_t i, uint32_t number)
{
    s->face_count = 0;
    for (uint32_t k = 2 * s->moves.begin[i]; k < 2 * s->moves.begin[i + 1]; k++) {
        uint32_t h = s->c->side[2 * s->moves.change[k / 2].edge + k % 2], f = h / 3;
        if (h == QW_NONE || s->seen[f] == number) continue;
        s->seen[f] = number;
        s->had[s->face_count] = s->energy[f], s->face[s->face_count++] = f;
        s->now.energy -= s->energy[f], s->now.area -= area_of(s->c, f);
    }
}

/* Adds them again, as they are now. Returns whether the move has inverted none, and no edge has lost its length or got
   one that had none at first. */
static bool close_faces(strip_search *s, uint32_t i)
{
    bool sound = true;
    for (uint32_t k = 0; k < s->face_count && sound; k++) {
        uint32_t f = s->face[k];
        double area = area_of(s->c, f);
        s->energy[f] = qw_triangle_energy(s->c, f);
        s->now.energy += s->energy[f], s->now.area += area;
        sound = area >= 0;
    }
    for (uint32_t k = s->moves.begin[i]; k < s->moves.begin[i + 1] && sound; k++) {
        uint32_t e = s->moves.change[k].edge;
        sound = qw_int2_is_zero(s->c->d[e]) == qw_int2_is_zero(s->terms->first[e]);
    }
    return sound;
}

/* Whether the offsets as they are now may be kept, and their score is below a bound. */
static bool is_below(qw_env *env, strip_search *s, double bound)
{
    const qw_meeting_terms *t = s->terms;
    if (qw_area_beyond(t->least_promised, t->most_promised, s->now.area) > 0) return false;
    s->now.crossing = 0;
    if (score_of(t, &s->now) >= bound) return false;
    s->now.crossing = qw_count_strips(env, s->c, &s->room).crossing_area;
    s->now.score = score_of(t, &s->now);
    return s->now.score < bound && qw_count_odd_curves(&t->curves, s->c->d) <= t->odd &&
           qw_count_touching(env, t->component, s->c->d) <= t->touching;
}

/* Makes a move, or its opposite; takes it back unless it may be kept. number: of the try, from 1 on. */
static bool try_move(qw_env *env, strip_search *s, uint32_t i, int32_t sign, uint32_t number, double threshold)
{
    state had = s->now;
    open_faces(s, i, number);
    make_move(s, i, sign);
    if (close_faces(s, i) && is_below(env, s, had.score + threshold)) return true;
    make_move(s, i, -sign);
    for (uint32_t k = 0; k < s->face_count; k++) s->energy[s->face[k]] = s->had[k];
    s->now = had;
    return false;
}

static strip_search begin_search(qw_env *env, const qw_meeting_terms *terms, qw_complex *c)
{
    strip_search s = {.terms = terms, .c = c, .moves = find_moves(env, c)};
    s.energy = QW_NEW(env, double, c->face_count), s.had = QW_NEW(env, double, c->face_count);
    s.seen = QW_NEW_ZERO(env, uint32_t, c->face_count), s.face = QW_NEW(env, uint32_t, c->face_count);
    for (uint32_t f = 0; f < c->face_count; f++) s.now.energy += s.energy[f] = qw_triangle_energy(c, f);
    s.now.area = qw_complex_area(c), s.now.crossing = qw_count_strips(env, c, &s.room).crossing_area;
    s.now.score = score_of(terms, &s.now);
    return s;
}

qw_strip_search_counts qw_search_strips(qw_env *env, const qw_meeting_terms *terms, qw_complex *c, double share)
{
    assert(c->d && c->real && terms->first && share >= 0);
    qw_strip_search_counts counts = {0};
    uint32_t most = (uint32_t)(share * MOST_TRIES);
    if (2 * (double)c->edge_count > most) return counts; /* there are more moves than are tried */
    qw_scope_begin(env);
    strip_search s = begin_search(env, terms, c);
    state first = s.now, best = first;
    qw_int2 *found = memcpy(QW_NEW(env, qw_int2, c->edge_count), c->d, c->edge_count * sizeof *c->d);
    for (uint32_t i = 0; i < most && s.moves.count > 0 && best.crossing > 0; i++) {
        qw_heartbeat(env);
        uint64_t random = qw_mix(i);
        double threshold = FIRST_THRESHOLD * (most - i) / most * (double)(random >> 40) * 0x1p-24;
        uint32_t move = (uint32_t)((random >> 1 & 0x7fffffff) % s.moves.count);
        counts.tried++;
        if (!try_move(env, &s, move, random & 1u ? 1 : -1, i + 1, threshold)) continue;
        counts.kept++;
        if (s.now.score >= best.score) continue;
        best = s.now;
        memcpy(found, c->d, c->edge_count * sizeof *c->d);
    }
    memcpy(c->d, found, c->edge_count * sizeof *c->d);
    counts.freed = first.crossing - best.crossing;
    qw_scope_end(env);
    return counts;
}
