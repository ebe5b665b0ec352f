#include "remesh/offsets/inversions.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

uint32_t *qw_offset_outgoing(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->corner && m->twin);
    uint32_t *out = QW_NEW(env, uint32_t, m->vertex_count);
    memset(out, 0xff, m->vertex_count * sizeof *out);
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (out[m->corner[h]] == QW_NONE || m->twin[h] == QW_NONE) out[m->corner[h]] = h;
    return out;
}

void qw_star_at(qw_env *env, const qw_offset_mesh *m, uint32_t outgoing, qw_star *star)
{
    assert(outgoing < 3 * m->face_count);
    uint32_t h = outgoing;
    unsigned turn = 0;
    star->count = 0;
    star->movable = true;
    do {
        if (star->count == star->capacity) {
            size_t wanted = 2 * star->capacity + 16;
            star->out = qw_resize(env, star->out, wanted, sizeof *star->out);
            star->turn = qw_resize(env, star->turn, wanted, sizeof *star->turn);
            star->capacity = wanted;
        }
        star->out[star->count] = h;
        star->turn[star->count++] = (uint8_t)turn;
        uint32_t in = qw_prev(h), across = m->twin[in];
        if (across == QW_NONE) return;
        /* the same edge vector is R2(rot[in]) d here and -R2(rot[across]) d there */
        turn = (turn + m->rot[across] + 2u + 4u - m->rot[in]) & 3u;
        h = across;
    } while (h != outgoing);
    star->movable = turn == 0;
}

/* How an edge at the vertex changes when the vertex moves by t (in the frame of the star's first triangle): h leaves
 * the vertex. */
static qw_int2 moved_out(const qw_offset_mesh *m, uint32_t h, unsigned turn, qw_int2 t)
{
    assert(h < 3 * m->face_count);
    return qw_int2_sub(m->d[m->edge[h]], qw_turn(turn + 4u - m->rot[h], t));
}
static qw_int2 moved_in(const qw_offset_mesh *m, uint32_t h, unsigned turn, qw_int2 t)
{
    assert(h < 3 * m->face_count);
    return qw_int2_add(m->d[m->edge[h]], qw_turn(turn + 4u - m->rot[h], t));
}

static bool allowed(const qw_offset_mesh *m, uint32_t e, qw_int2 d)
{
    if (d.x < -1 || d.x > 1 || d.y < -1 || d.y > 1) return false;
    return !((m->fixed[e] & QW_FIXED_X) && d.x) && !((m->fixed[e] & QW_FIXED_Y) && d.y);
}

typedef struct verdict {
    bool allowed;
    int32_t inverted; /* sum of inverted areas around the vertex after the move */
    int32_t spread;   /* sum of squared lengths after the move: less is more compact */
} verdict;

/* What a move of the star's centre by t leads to: whether no edge gets longer than it may, the area that is
 * inverted, and how long its edges are. */
static verdict judge_move(const qw_offset_mesh *m, const qw_star *star, qw_int2 t)
{
    verdict v = {.allowed = true};
    for (uint32_t i = 0; i < star->count; i++) {
        uint32_t h = star->out[i], in = qw_prev(h);
        qw_int2 a = moved_out(m, h, star->turn[i], t), b = moved_in(m, in, star->turn[i], t);
        if (!allowed(m, m->edge[h], a) || !allowed(m, m->edge[in], b)) return (verdict){0};
        qw_int2 u = qw_turn(m->rot[h], a), w = qw_turn(m->rot[in], b);
        int32_t det = qw_int2_det(w, u); /* in then out around the vertex: the same area */
        if (det < 0) v.inverted -= det;
        v.spread += u.x * u.x + u.y * u.y;
    }
    return v;
}

void qw_star_move(qw_offset_mesh *m, const qw_star *star, qw_int2 t)
{
    assert(m->d && star->out);
    for (uint32_t i = 0; i < star->count; i++) {
        uint32_t h = star->out[i], e = m->edge[h];
        m->d[e] = moved_out(m, h, star->turn[i], t);
        uint32_t in = qw_prev(h); /* the last edge of an open fan is seen only from its incoming side */
        if (m->twin[in] == QW_NONE) m->d[m->edge[in]] = moved_in(m, in, star->turn[i], t);
    }
}

/* The best single step of the star's vertex that lowers the inverted area, if any. */
static bool improve_vertex(qw_offset_mesh *m, const qw_star *star)
{
    verdict now = judge_move(m, star, (qw_int2){0, 0}), best = now;
    qw_int2 move = {0, 0};
    if (!now.allowed || now.inverted == 0) return false;
    for (int32_t y = -1; y <= 1; y++)
        for (int32_t x = -1; x <= 1; x++) {
            verdict v = judge_move(m, star, (qw_int2){x, y});
            if (!v.allowed || v.inverted > best.inverted) continue;
            if (v.inverted == best.inverted && (v.spread >= best.spread || best.inverted == now.inverted)) continue;
            best = v, move = (qw_int2){x, y};
        }
    if (qw_int2_is_zero(move)) return false;
    qw_star_move(m, star, move);
    return true;
}

void qw_remove_inversions_greedy(qw_env *env, qw_offset_mesh *m, qw_inversion_counts *counts)
{
    assert(m->d && m->twin && counts);
    qw_scope_begin(env);
    uint32_t *outgoing = qw_offset_outgoing(env, m), *queue = QW_NEW(env, uint32_t, m->face_count);
    uint8_t *queued = QW_NEW_ZERO(env, uint8_t, m->face_count);
    qw_star star = {0};
    uint32_t head = 0, waiting = 0;
    for (uint32_t f = 0; f < m->face_count; f++)
        if (qw_offset_det(m, f) < 0) queue[waiting++] = f, queued[f] = 1;
    counts->inverted_before = waiting;
    for (uint32_t step = 0; waiting > 0; step++) { /* a face is tried again only after the inverted area has fallen */
        uint32_t f = queue[head];
        if (step % QW_GRAIN_HEAVY == 0) qw_heartbeat(env);
        head = head + 1 == m->face_count ? 0 : head + 1;
        waiting--;
        queued[f] = 0;
        for (uint32_t i = 0; i < 3 && qw_offset_det(m, f) < 0; i++) {
            qw_star_at(env, m, outgoing[m->corner[3 * f + i]], &star);
            if (!star.movable || !improve_vertex(m, &star)) continue;
            counts->moves++;
            for (uint32_t k = 0; k < star.count; k++) {
                uint32_t g = star.out[k] / 3;
                if (queued[g] || qw_offset_det(m, g) >= 0) continue;
                uint32_t at = head + waiting;
                queue[at >= m->face_count ? at - m->face_count : at] = g;
                queued[g] = 1;
                waiting++;
            }
        }
    }
    for (uint32_t f = 0; f < m->face_count; f++) counts->inverted_after_greedy += qw_offset_det(m, f) < 0;
    counts->inverted_after = counts->inverted_after_greedy;
    qw_scope_end(env);
}
