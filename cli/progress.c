#include "progress.h"

#include "base/platform.h"
#include "system.h"

#include <math.h>
#include <stdio.h>

enum { BAR_CELLS = 30 };
static const double frame_seconds = 0.06; /* a bar that is drawn more often than this only costs time */

void qw_meter_begin(qw_meter *meter, bool quiet, double limit)
{
    *meter = (qw_meter){.quiet = quiet,
                        .limit = limit,
                        .terminal = qw_is_terminal(),
                        .stage = -1,
                        .percent = -1,
                        .phases = 1,
                        .begin = qw_seconds_now()};
}

/* The bar in its line, drawn again where stage or percent have changed, and not more often than a frame. */
static void draw_bar(qw_meter *meter, qw_stage stage, int percent, double time)
{
    if (percent == meter->percent && (int)stage == meter->stage) return;
    if ((int)stage == meter->stage && time - meter->shown < frame_seconds) return;
    char bar[BAR_CELLS + 1];
    for (int i = 0; i < BAR_CELLS; i++) bar[i] = i * 100 < percent * BAR_CELLS ? '#' : '.';
    bar[BAR_CELLS] = 0;
    fprintf(stderr, "\r[%s] %3d %%  %-20s %6.1f s\033[K", bar, percent, qw_stage_title(stage), time - meter->begin);
    fflush(stderr);
    meter->shown = time;
    meter->stage = (int)stage;
    meter->percent = percent;
}

int qw_meter_progress(void *user, qw_stage stage, double fraction)
{
    qw_meter *meter = user;
    if (qw_interrupted()) return 1;
    if (meter->limit > 0 && qw_seconds_now() - meter->begin > meter->limit) meter->late = true;
    if (meter->late) return 1;
    if (fraction < meter->fraction && meter->phase + 1 < meter->phases) meter->phase++;
    meter->fraction = fraction;
    int percent = (int)fmax(meter->percent, 100 * (meter->phase + fraction) / meter->phases);
    if (meter->quiet || meter->ended) return 0;
    if (meter->terminal) draw_bar(meter, stage, percent, qw_seconds_now());
    return 0;
}

void qw_meter_end(qw_meter *meter)
{
    if (meter->terminal && !meter->quiet && !meter->ended && meter->stage >= 0) fputs("\r\033[K", stderr);
    meter->ended = true;
}
