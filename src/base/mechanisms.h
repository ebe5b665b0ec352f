/* Which mechanisms of base/mechanisms.def are on, and how often each was asked, acted and was kept. Developers' builds
 * (the CMake option QW_SWITCHES) obey QW_WITHOUT=NAME,NAME and append a line of JSON, the counters of a run, to the
 * file that QW_MECHANISMS names; in what is handed out all of this compiles to nothing. bench/ablate reads both.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef struct qw_env qw_env;

typedef enum qw_mechanism {
#define QW_MECHANISM(name, file, what, without) QW_MECH_##name,
#include "base/mechanisms.def"
    QW_MECHANISMS,
} qw_mechanism;

#ifdef QW_SWITCHES
/* Whether the mechanism is on; counted as asked. */
bool qw_uses(qw_env *env, qw_mechanism m);
/* It has done something that may change the result, so often; and so often that stayed. On any thread. */
void qw_acted(qw_env *env, qw_mechanism m, int64_t times);
void qw_kept(qw_env *env, qw_mechanism m, int64_t times);
#else
static inline bool qw_uses(qw_env *env, qw_mechanism m) { return (void)env, (void)m, true; }
static inline void qw_acted(qw_env *env, qw_mechanism m, int64_t times) { (void)env, (void)m, (void)times; }
static inline void qw_kept(qw_env *env, qw_mechanism m, int64_t times) { (void)env, (void)m, (void)times; }
#endif

/* What is done at once and stays. */
static inline void qw_did(qw_env *env, qw_mechanism m, int64_t times)
{
    qw_acted(env, m, times), qw_kept(env, m, times);
}

/* ---- for base/env.c and base/lanes.c */

typedef struct qw_switches {
    bool off[QW_MECHANISMS];
    _Atomic int64_t asked[QW_MECHANISMS], acted[QW_MECHANISMS], kept[QW_MECHANISMS];
} qw_switches;

/* NULL where they are compiled out. Those of a lane are the run's. */
qw_switches *qw_env_switches(qw_env *env);
void qw_env_share_switches(qw_env *lane, qw_env *run);
void qw_switches_begin(qw_switches *s); /* zeroed */
void qw_switches_end(const qw_switches *s);
