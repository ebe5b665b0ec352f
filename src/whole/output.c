#include "whole/output.h"

#include "whole/written.h"

/* Coordinates in the centred frame are meaningful down to this share of the box's diagonal. */
static const double LEAST_DIGIT = 1e-9;

enum { MOST_PLACES = 22 }; /* a higher power of ten is no double */

/* Reciprocal of the power of ten to which coordinates are rounded, so that they can be written with few digits. 0
   where they are not rounded: the power would be no exact double, or whole numbers are fine enough. */
static double decimal_unit(const qw_frame *frame)
{
    double least = frame->scale / LEAST_DIGIT, unit = 1;
    if (!(least > 0.1)) return 0;
    for (int places = 0; places < MOST_PLACES && unit < least; places++) unit *= 10;
    return unit >= least ? unit : 0;
}

void qw_settle_output(const qw_run_state *run, const qw_clean *clean, const qw_quadmesh *quads, double *output,
                      uint32_t *flat)
{
    uint32_t moved;
    *flat = qw_settle_written(run->env, quads, decimal_unit(&clean->frame), output, &moved);
    if (moved) qw_log(run->env, QW_LOG_DEBUG, "vertices were pushed %u times, as quads had no area", moved);
}

double *qw_output_positions(const qw_run_state *run, const qw_clean *clean, const qw_quadmesh *quads, uint32_t *flat)
{
    double *output = QW_NEW(run->env, double, (size_t)3 * quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++)
        qw_place_in_input(clean, quads->position[v], output + 3 * (size_t)v);
    qw_settle_output(run, clean, quads, output, flat);
    return output;
}
