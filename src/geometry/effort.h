/* How many samples a measure can afford.
 *
 * Effort is what the samples look at: triangles or segments. On a surface a sample looks at some ten of them, in a soup
 * whose triangles are as large as its box at nearly all. A few probes, spread over all samples, say how many it is, and
 * so many samples are taken that the whole effort stays within a multiple of their number, or within what takes a
 * fraction of a second. As it is counted in steps, the number of samples depends on the meshes alone.
 *
 *     qw_probes probes = {0};
 *     for (uint32_t i; qw_next_probe(&probes, wanted, &i);) probes.effort += of sample i;
 *     count = qw_affordable(&probes, wanted);
 */
#pragma once

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

enum {
    QW_EFFORT_A_SAMPLE = 100,      /* on the average, for as many samples as are wanted */
    QW_EFFORT_AT_LEAST = 10000000, /* that all samples together may always take */
    QW_LEAST_SAMPLES = 50,         /* that are taken, whatever they take */
    QW_PROBES = 64,                /* a power of two; fewer where these few take a quarter of what all may take */
    QW_PROBE_STEP = 37             /* odd: the first few are spread as well */
};

typedef struct qw_probes {
    uint64_t effort; /* of those so far */
    uint32_t count;
} qw_probes;

/* How many samples are wanted: `a_face` for each face of the finer of two surfaces, within bounds. */
static inline uint32_t qw_wanted_samples(uint32_t faces, uint32_t others, uint32_t a_face, uint32_t least,
                                         uint32_t most)
{
    assert(least <= most);
    uint64_t wanted = (uint64_t)a_face * (faces > others ? faces : others);
    return wanted < least ? least : wanted > most ? most : (uint32_t)wanted;
}

/* False: enough. sample: what the next one is. */
static inline bool qw_next_probe(qw_probes *p, uint32_t wanted, uint32_t *sample)
{
    if (wanted == 0 || p->count == QW_PROBES || p->effort > QW_EFFORT_AT_LEAST / 4) return false;
    *sample = (uint32_t)((uint64_t)(p->count++ * QW_PROBE_STEP % QW_PROBES) * wanted / QW_PROBES);
    return true;
}

/* Of the samples that are wanted, so many. */
static inline uint32_t qw_affordable(const qw_probes *p, uint32_t wanted)
{
    if (wanted <= QW_LEAST_SAMPLES) return wanted;
    assert(p->count > 0);
    double each = (double)p->effort / p->count, room = (double)QW_EFFORT_A_SAMPLE * wanted;
    if (room < QW_EFFORT_AT_LEAST) room = QW_EFFORT_AT_LEAST;
    if (each * wanted <= room) return wanted;
    uint32_t count = (uint32_t)(room / each);
    return count > QW_LEAST_SAMPLES ? count : QW_LEAST_SAMPLES;
}

/* The same as a distance between those that are taken. */
static inline uint32_t qw_affordable_step(const qw_probes *p, uint32_t wanted)
{
    uint32_t count = qw_affordable(p, wanted);
    return count == 0 ? 1 : (wanted + count - 1) / count;
}
