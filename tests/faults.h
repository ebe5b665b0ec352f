/* A host that fails on purpose: an allocation that is refused, a report at which the run is cancelled; and copies of
 * files cut short.
 *
 * The loops of the tests let 0, 1, 2, ... calls succeed until the whole succeeds, and then ask that nothing is left.
 */
#ifndef QW_TESTS_FAULTS_H
#define QW_TESTS_FAULTS_H

#include "quadwright/quadwright.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct faults {
    long allocations;  /* so many succeed before one fails; below zero: all do, and so it is after that one */
    long reports;      /* so many go by before one cancels; below zero likewise */
    bool is_lasting;   /* after the first refused allocation all are refused */
    long blocks;       /* that are held */
    size_t held, most; /* bytes, and the most there ever were */
} faults;

enum { FAULTS_NONE = -1 };

static inline void *faults_resize(void *user, void *block, size_t old_size, size_t new_size)
{
    faults *f = user;
    if (new_size && f->allocations == 0) {
        f->allocations -= !f->is_lasting;
        return NULL;
    }
    if (new_size && f->allocations > 0) f->allocations--;
    void *fresh = NULL;
    if (new_size == 0) free(block);
    else fresh = realloc(block, new_size);
    f->blocks += (new_size && !block) - (!new_size && block);
    f->held += new_size - old_size;
    if (f->held > f->most) f->most = f->held;
    return fresh;
}

static inline int faults_progress(void *user, qw_stage stage, double fraction)
{
    (void)stage, (void)fraction;
    faults *f = user;
    if (f->reports < 0) return 0;
    return f->reports-- == 0;
}

static inline qw_host faults_host(faults *f)
{
    return (qw_host){.resize = faults_resize, .resize_user = f, .progress = faults_progress, .progress_user = f};
}

/* The first `size` bytes in a block of their own, so that a sanitizer sees a step too far. */
static inline char *faults_cut(const char *bytes, size_t size)
{
    char *cut = malloc(size ? size : 1);
    memcpy(cut, bytes, size);
    return cut;
}

#endif
