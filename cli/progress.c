#define _XOPEN_SOURCE 700 /* SIGXCPU, SIGXFSZ */
#include "progress.h"

#include <signal.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

enum { BAR_CELLS = 30 };
static const double frame_seconds = 0.06; /* a bar that is drawn more often than this only costs time */

static const struct {
    int number;
    const char *name;
} signals[] = {{SIGINT, "SIGINT (interrupted)"},
               {SIGTERM, "SIGTERM (asked to end)"},
               {SIGHUP, "SIGHUP (the terminal is gone)"},
               {SIGXCPU, "SIGXCPU (the limit of processor time)"}};
enum { SIGNAL_COUNT = sizeof signals / sizeof *signals };

void qw_ignore_write_signals(void)
{
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
}

/* A signal that is blocked waits even where it is ignored. */
static bool is_ignored(int number)
{
    struct sigaction action;
    return sigaction(number, NULL, &action) == 0 && !(action.sa_flags & SA_SIGINFO) && action.sa_handler == SIG_IGN;
}

void qw_hold_interrupts(void)
{
    sigset_t set;
    sigemptyset(&set);
    for (int i = 0; i < SIGNAL_COUNT; i++)
        if (!is_ignored(signals[i].number)) sigaddset(&set, signals[i].number);
    sigprocmask(SIG_BLOCK, &set, NULL);
}

const char *qw_interrupted(void)
{
    sigset_t set;
    if (sigpending(&set) != 0) return NULL;
    for (int i = 0; i < SIGNAL_COUNT; i++)
        if (sigismember(&set, signals[i].number) == 1) return signals[i].name;
    return NULL;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void qw_meter_begin(qw_meter *meter, bool quiet, double limit)
{
    *meter = (qw_meter){.quiet = quiet,
                        .limit = limit,
                        .terminal = isatty(STDERR_FILENO) == 1,
                        .stage = -1,
                        .percent = -1,
                        .begin = now()};
}

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
    if (meter->limit > 0 && now() - meter->begin > meter->limit) meter->late = true;
    if (meter->late) return 1;
    int percent = (int)(100 * fraction);
    if (meter->quiet || meter->ended) return 0;
    if (meter->terminal) draw_bar(meter, stage, percent, now());
    else if ((int)stage != meter->stage) {
        fprintf(stderr, "%3d %%  %s\n", percent, qw_stage_title(stage));
        meter->stage = (int)stage;
    }
    return 0;
}

void qw_meter_end(qw_meter *meter)
{
    if (meter->terminal && !meter->quiet && !meter->ended && meter->stage >= 0) fputs("\r\033[K", stderr);
    meter->ended = true;
}
