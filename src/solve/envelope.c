#include "solve/envelope.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- order */

typedef struct ordering {
    const uint32_t *first, *column;
    uint32_t *queue; /* uint32_t[count] */
    uint32_t *seen;  /* uint32_t[count]: round in which it was reached */
    uint32_t round;
} ordering;

static uint32_t degree(const ordering *o, uint32_t v) { return o->first[v + 1] - o->first[v]; }

/* Breadth first from a start, neighbours by rising degree. Returns how many were reached; the last is far away. */
static uint32_t reach(ordering *o, uint32_t start, uint32_t *queue)
{
    uint32_t count = 0;
    o->round++;
    queue[count++] = start, o->seen[start] = o->round;
    for (uint32_t at = 0; at < count; at++) {
        uint32_t begin = count;
        for (uint32_t k = o->first[queue[at]]; k < o->first[queue[at] + 1]; k++) {
            uint32_t w = o->column[k], slot = count;
            if (o->seen[w] == o->round) continue;
            o->seen[w] = o->round;
            for (; slot > begin && degree(o, queue[slot - 1]) > degree(o, w); slot--) queue[slot] = queue[slot - 1];
            queue[slot] = w, count++;
        }
    }
    return count;
}

/* Orders a connected part from an end of it: the last of a search is where the next begins, twice. */
static uint32_t order_part(ordering *o, uint32_t start, uint32_t *queue)
{
    uint32_t count = reach(o, start, queue);
    for (int i = 0; i < 2; i++) count = reach(o, queue[count - 1], queue);
    return count;
}

qw_envelope qw_envelope_of(qw_env *env, uint32_t count, const uint32_t *first, const uint32_t *column)
{
    qw_envelope e = {.count = count};
    ordering o = {.first = first, .column = column};
    e.place = QW_NEW(env, uint32_t, count), e.low = QW_NEW(env, uint32_t, count);
    e.begin = QW_NEW(env, size_t, count + (size_t)1), e.scratch = QW_NEW(env, double, count);
    o.queue = QW_NEW(env, uint32_t, count), o.seen = QW_NEW_ZERO(env, uint32_t, count);
    memset(e.place, 0xff, count * sizeof *e.place);
    for (uint32_t v = 0, done = 0; v < count; v++) {
        if (e.place[v] != QW_NONE) continue;
        uint32_t part = order_part(&o, v, o.queue);
        for (uint32_t k = 0; k < part; k++) e.place[o.queue[k]] = count - 1 - (done + k);
        done += part;
    }
    for (uint32_t v = 0; v < count; v++) {
        uint32_t low = e.place[v];
        for (uint32_t k = first[v]; k < first[v + 1]; k++)
            if (e.place[column[k]] < low) low = e.place[column[k]];
        assert(e.place[v] < count && low <= e.place[v]);
        e.low[e.place[v]] = low;
    }
    e.begin[0] = 0;
    for (uint32_t r = 0; r < count; r++) e.begin[r + 1] = e.begin[r] + (r - e.low[r]) + 1;
    e.value = QW_NEW_ZERO(env, double, e.begin[count]);
    qw_free(env, o.queue), qw_free(env, o.seen);
    return e;
}

/* ---- factor */

/* Four sums, which processors take at once; added up in one order. */
static double dot(const double *a, const double *b, size_t n)
{
    double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    size_t k = 0;
    for (; k + 4 <= n; k += 4) {
        s0 += a[k] * b[k], s1 += a[k + 1] * b[k + 1];
        s2 += a[k + 2] * b[k + 2], s3 += a[k + 3] * b[k + 3];
    }
    for (; k < n; k++) s0 += a[k] * b[k];
    return (s0 + s1) + (s2 + s3);
}

bool qw_envelope_factor(qw_envelope *e)
{
    for (uint32_t r = 0; r < e->count; r++) {
        double *row = e->value + e->begin[r];
        for (uint32_t c = e->low[r]; c < r; c++) {
            const double *other = e->value + e->begin[c];
            uint32_t from = e->low[r] > e->low[c] ? e->low[r] : e->low[c];
            double sum = from < c ? dot(row + (from - e->low[r]), other + (from - e->low[c]), c - from) : 0;
            row[c - e->low[r]] = (row[c - e->low[r]] - sum) / other[c - e->low[c]];
        }
        double pivot = row[r - e->low[r]] - dot(row, row, r - e->low[r]);
        if (!(pivot > 0)) return false;
        row[r - e->low[r]] = sqrt(pivot);
    }
    return true;
}

void qw_envelope_solve(const qw_envelope *e, double *x)
{
    double *y = e->scratch;
    for (uint32_t v = 0; v < e->count; v++) y[e->place[v]] = x[v];
    for (uint32_t r = 0; r < e->count; r++) {
        const double *row = e->value + e->begin[r];
        y[r] = (y[r] - dot(row, y + e->low[r], r - e->low[r])) / row[r - e->low[r]];
    }
    for (uint32_t r = e->count; r-- > 0;) {
        const double *row = e->value + e->begin[r];
        y[r] /= row[r - e->low[r]];
        for (uint32_t c = e->low[r]; c < r; c++) y[c] -= row[c - e->low[r]] * y[r];
    }
    for (uint32_t v = 0; v < e->count; v++) x[v] = y[e->place[v]];
}
