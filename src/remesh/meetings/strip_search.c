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
/* MOST_COUNTS: times that each search counts strips. TRIES: moves that are tried, for each: most of those that are
   tried again from the same offsets are known to fail. SLIPPING: the search that slips. */
enum { MOST_COUNTS = 2000, TRIES = 4, SLIPPING = QW_STRIP_SEARCHES - 1 };

/* What a move does to one edge, in the edge's own frame. */
typedef struct change {
    uint32_t edge;
    qw_int2 by;
} change;

/* Changes that together keep Eq. (3). */
typedef struct move {
    const change *change;
    uint32_t count;
} move;

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

/* What is known of a move from some offsets: its score is not below this bound, or it has faults. */
typedef struct outcome {
    uint32_t offsets; /* their number */
    double least;
} outcome;

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
    outcome *known;             /* outcome[2 moves], of a move and its opposite */
    uint32_t offsets, counts;   /* offsets kept, with the first; times that strips were counted */
    /* of the search that slips: the changes of the step at hand, and the places of a strip */
    change *step; /* change[step_count] */
    uint32_t step_count, *place;
    size_t step_room, place_room;
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

static void make_move(strip_search *s, move m, int32_t sign)
{
    for (uint32_t k = 0; k < m.count; k++) {
        qw_int2 *d = &s->c->d[m.change[k].edge], by = m.change[k].by;
        d->x += sign * by.x, d->y += sign * by.y;
    }
}

/* Adds the slip along the strip through a place: what lies on one side of it goes on by so many quads along it, so
   lines that cross it meet others. The strip crosses a component of an edge; what is added to the edge is a quarter
   turn ahead. Adds nothing where that would turn an edge that is fixed. */
static void add_slip(strip_search *s, uint32_t place, int32_t quads)
{
    uint32_t had = s->step_count, count = qw_list_strip(&s->room, place, s->place);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t v = qw_component_of_place(s->c, &s->room, s->place[i]), e = v / 2;
        qw_int2 d = s->c->d[e],
                by = v & 1u ? (qw_int2){d.y > 0 ? -quads : quads, 0} : (qw_int2){0, d.x > 0 ? quads : -quads};
        s->step[s->step_count++] = (change){e, by};
        if (!qw_is_fixed(s->c->fixed[e], v ^ 1u)) continue;
        s->step_count = had;
        return;
    }
}

static move circuit(const moves *m, uint32_t i)
{
    return (move){&m->change[m->begin[i]], m->begin[i + 1] - m->begin[i]};
}

static void add_circuit(strip_search *s, uint32_t i, int32_t sign)
{
    move m = circuit(&s->moves, i);
    for (uint32_t k = 0; k < m.count; k++)
        s->step[s->step_count++] = (change){m.change[k].edge, qw_turn(sign > 0 ? 0 : 2, m.change[k].by)};
}

/* A circuit, or a slip by one quad, by two half as often, and so on. */
static move mixed_step(qw_env *env, strip_search *s, uint64_t random)
{
    uint32_t components = 2 * s->c->edge_count, places = s->room.first[components];
    s->place = qw_grow(env, s->place, &s->place_room, places, sizeof *s->place);
    s->step = qw_grow(env, s->step, &s->step_room, (size_t)places + components, sizeof *s->step);
    s->step_count = 0;
    random = qw_mix(random);
    uint32_t which = (uint32_t)(random >> 32), v = which % components;
    int32_t sign = random & 1u ? 1 : -1, quads = sign;
    for (uint32_t more = (uint32_t)random >> 2; more & 1u; more >>= 1) quads += sign;
    if (random & 2u) add_circuit(s, which % s->moves.count, sign);
    else if (s->room.places[v] > 0) add_slip(s, s->room.first[v] + which / components % s->room.places[v], quads);
    return (move){s->step, s->step_count};
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
static void open_faces(strip_search *s, move m, uint32_t number)
{
    s->face_count = 0;
    for (uint32_t k = 0; k < 2 * m.count; k++) {
        uint32_t h = s->c->side[2 * m.change[k / 2].edge + k % 2], f = h / 3;
        if (h == QW_NONE || s->seen[f] == number) continue;
        s->seen[f] = number;
        s->had[s->face_count] = s->energy[f], s->face[s->face_count++] = f;
        s->now.energy -= s->energy[f], s->now.area -= area_of(s->c, f);
    }
}

/* Adds them again, as they are now. Returns whether the move has inverted none, and no edge has lost its length or got
   one that had none at first. */
static bool close_faces(strip_search *s, move m)
{
    bool sound = true;
    for (uint32_t k = 0; k < s->face_count && sound; k++) {
        uint32_t f = s->face[k];
        double area = area_of(s->c, f);
        s->energy[f] = qw_triangle_energy(s->c, f);
        s->now.energy += s->energy[f], s->now.area += area;
        sound = area >= 0;
    }
    for (uint32_t k = 0; k < m.count && sound; k++) {
        uint32_t e = m.change[k].edge;
        sound = qw_int2_is_zero(s->c->d[e]) == qw_int2_is_zero(s->terms->first[e]);
    }
    return sound;
}

/* Whether the offsets as they are now, with faces open, may be kept, and their score is below a bound. */
static bool is_below(qw_env *env, strip_search *s, double bound, outcome *known)
{
    const qw_meeting_terms *t = s->terms;
    known->least = INFINITY;
    if (qw_area_beyond(t->least_promised, t->most_promised, s->now.area) > 0) return false;
    s->now.crossing = 0;
    double others = score_of(t, &s->now);
    known->least = bound;
    if (others >= bound) return false;
    s->now.crossing = qw_change_strips(env, s->c, &s->room, s->face, s->face_count, bound - others);
    s->now.score = score_of(t, &s->now);
    s->counts++;
    if (s->now.crossing > bound - others || s->now.score >= bound) return false;
    known->least = INFINITY;
    return qw_count_odd_curves(&t->curves, s->c->d) <= t->odd &&
           qw_count_touching(env, t->component, s->c->d) <= t->touching;
}

/* Makes a move, or its opposite; takes it back unless it may be kept. number: of the try, from 1 on. */
static bool try_move(qw_env *env, strip_search *s, move m, int32_t sign, uint32_t number, double bound, outcome *known)
{
    state had = s->now;
    uint32_t counts = s->counts;
    if (m.count == 0 || (known->offsets == s->offsets && known->least >= bound)) return false;
    *known = (outcome){s->offsets, INFINITY};
    open_faces(s, m, number);
    make_move(s, m, sign);
    if (close_faces(s, m) && is_below(env, s, bound, known)) {
        qw_keep_strips(&s->room);
        return true;
    }
    make_move(s, m, -sign);
    if (s->counts > counts) qw_undo_strips(env, s->c, &s->room, s->face, s->face_count);
    for (uint32_t k = 0; k < s->face_count; k++) s->energy[s->face[k]] = s->had[k];
    s->now = had;
    return false;
}

/* One of several searches from the same offsets, in memory of its own. */
typedef struct chain {
    const qw_meeting_terms *terms;
    const moves *moves;
    qw_env *env; /* NULL where it is still to be run */
    qw_complex c;
    const qw_int2 *from; /* qw_int2[edges]: the first offsets */
    uint32_t number, most_counts;
    qw_strip_find found;
} chain;

/* A search that begins with the integers of a link of the chain: its moves, and energy, area and score there. */
static strip_search begin_search(chain *k)
{
    qw_env *env = k->env;
    qw_complex *c = &k->c;
    c->d = memcpy(QW_NEW(env, qw_int2, c->edge_count), k->from, c->edge_count * sizeof *c->d);
    memcpy(k->found.d, k->from, c->edge_count * sizeof *c->d);
    strip_search s = {.terms = k->terms, .c = c, .moves = *k->moves};
    s.energy = QW_NEW(env, double, c->face_count), s.had = QW_NEW(env, double, c->face_count);
    s.known = QW_NEW_ZERO(env, outcome, 2 * (size_t)s.moves.count), s.offsets = 1;
    s.seen = QW_NEW_ZERO(env, uint32_t, c->face_count), s.face = QW_NEW(env, uint32_t, c->face_count);
    for (uint32_t f = 0; f < c->face_count; f++) s.now.energy += s.energy[f] = qw_triangle_energy(c, f);
    s.now.area = qw_complex_area(c), s.now.crossing = qw_count_strips(env, c, &s.room).crossing_area;
    s.now.score = score_of(k->terms, &s.now);
    return s;
}

/* Tries the step that a random number names, or its opposite. */
static bool try_random(qw_env *env, strip_search *s, bool slips, uint64_t random, uint32_t number, double bound)
{
    outcome unknown = {0};
    if (slips) return try_move(env, s, mixed_step(env, s, random), 1, number, bound, &unknown);
    uint32_t i = (uint32_t)((random >> 1 & 0x7fffffff) % s->moves.count);
    bool opposite = !(random & 1u);
    return try_move(env, s, circuit(&s->moves, i), opposite ? -1 : 1, number, bound, &s->known[2 * i + !opposite]);
}

/* Chain 1 begins with a threshold twice as high as the others'. */
static void run_chain(void *user)
{
    chain *k = user;
    qw_complex *c = &k->c;
    strip_search s = begin_search(k);
    state first = s.now, best = first;
    uint32_t tries = TRIES * k->most_counts;
    k->found.tried = k->found.kept = 0;
    for (uint32_t i = 0; i < tries && s.counts < k->most_counts && best.crossing > 0; i++) {
        qw_heartbeat(k->env);
        uint64_t random = qw_mix((uint64_t)k->number * tries + i);
        double left = fmin(1 - (double)i / tries, 1 - (double)s.counts / k->most_counts);
        double threshold = FIRST_THRESHOLD * (1 + (k->number == 1)) * left * (double)(random >> 40) * 0x1p-24;
        k->found.tried++;
        if (!try_random(k->env, &s, k->number == SLIPPING, random, i + 1, s.now.score + threshold)) continue;
        k->found.kept++, s.offsets++;
        if (s.now.score >= best.score) continue;
        best = s.now;
        memcpy(k->found.d, c->d, c->edge_count * sizeof *c->d);
    }
    k->found.freed = first.crossing - best.crossing, k->found.score = best.score;
}

static void run_in_lane(void *user, uint32_t begin, uint32_t end)
{
    (void)end;
    chain *k = &((chain *)user)[begin];
    if (k->env && qw_protect(k->env, run_chain, k) != QW_OK) k->env = NULL;
}

/* Runs all chains, side by side where there is memory for that. */
static void run_chains(qw_env *env, chain *chains, uint32_t count, size_t lane_bytes)
{
    uint32_t lanes = qw_env_threads(env) > 1 && lane_bytes > 0 ? count : 0;
    qw_lane *lane = qw_lanes_begin(env, lanes, lane_bytes);
    for (uint32_t i = 0; i < lanes; i++) chains[i].env = lane[i].env;
    if (lanes > 0) qw_parallel(env, count, 1, run_in_lane, chains);
    for (uint32_t i = 0; i < count; i++) {
        if (chains[i].env) continue;
        qw_scope_begin(env);
        chains[i].env = env;
        run_chain(&chains[i]);
        qw_scope_end(env);
    }
    qw_lanes_end(lane, lanes);
}

uint32_t qw_search_strips(qw_env *env, const qw_meeting_terms *terms, const qw_complex *c, double share,
                          size_t lane_bytes, qw_strip_find found[QW_STRIP_SEARCHES])
{
    assert(c->d && c->real && terms->first && share >= 0);
    uint32_t most = (uint32_t)(share * MOST_COUNTS), edges = c->edge_count;
    if (2 * (double)edges > most) return 0;                           /* there are more moves than counts */
    uint32_t count = edges * edges <= most ? SLIPPING + 1 : SLIPPING; /* pairs of moves are as few as counts */
    chain chains[QW_STRIP_SEARCHES];
    for (uint32_t i = 0; i < count; i++) {
        chains[i] = (chain){.terms = terms, .c = *c, .from = c->d, .number = i, .most_counts = most};
        chains[i].found.d = QW_NEW(env, qw_int2, c->edge_count);
    }
    qw_scope_begin(env);
    moves all = find_moves(env, c);
    for (uint32_t i = 0; i < count; i++) chains[i].moves = &all;
    if (all.count > 0) run_chains(env, chains, count, lane_bytes);
    qw_scope_end(env);
    for (uint32_t i = 0; i < count; i++) found[i] = chains[i].found;
    return all.count > 0 ? count : 0;
}
