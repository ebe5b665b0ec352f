/* What becomes of the feature curves, edge by edge of the working mesh: kept, or why not. Decided once, by the table
 * verdicts.def; later stages read it. */
#pragma once

#include <stdint.h>

typedef enum qw_curve_verdict {
#define QW_CURVE_VERDICT(name, word, reason) QW_CURVE_##name,
#include "remesh/features/verdicts.def"
    QW_CURVE_VERDICTS
} qw_curve_verdict;

typedef struct qw_curve_verdict_row {
    const char *word, *reason;
} qw_curve_verdict_row;
extern const qw_curve_verdict_row qw_curve_verdict_rows[QW_CURVE_VERDICTS];

/* Sets of verdicts. */
#define QW_VERDICT_BIT(verdict) (1u << (verdict))
enum { QW_ALL_CURVES = (1 << QW_CURVE_VERDICTS) - 1 - (1 << QW_CURVE_NONE) };
