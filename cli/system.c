#define _XOPEN_SOURCE 700 /* SIGXCPU, SIGXFSZ */
#include "system.h"

#include <stdio.h>

#ifdef _WIN32

#define WIN32_LEAN_AND_MEAN
#include <fcntl.h>
#include <io.h>
#include <stdlib.h>
#include <windows.h>
/* after windows.h */
#include <shellapi.h>

/* Windows runs the handler on a thread of its own: there is no signal that could wait. */
static volatile LONG interrupted;

static BOOL WINAPI note(DWORD event)
{
    if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT && event != CTRL_CLOSE_EVENT) return FALSE;
    InterlockedExchange(&interrupted, 1);
    return TRUE;
}

void qw_ignore_write_signals(void) {}
void qw_hold_interrupts(void) { SetConsoleCtrlHandler(note, TRUE); }
const char *qw_interrupted(void) { return interrupted ? "Ctrl-C (interrupted)" : NULL; }

bool qw_is_terminal(void) { return _isatty(_fileno(stderr)) != 0; }

static char *utf8_of(const wchar_t *wide)
{
    int size = WideCharToMultiByte(CP_UTF8, 0, wide, -1, NULL, 0, NULL, NULL);
    char *text = size > 0 ? malloc((size_t)size) : NULL;
    if (text) WideCharToMultiByte(CP_UTF8, 0, wide, -1, text, size, NULL, NULL);
    return text;
}

/* The arguments live as long as the process. */
void qw_begin_tool(int *argc, char ***argv)
{
    _setmode(_fileno(stdin), _O_BINARY);
    _setmode(_fileno(stdout), _O_BINARY);
    SetConsoleOutputCP(CP_UTF8);
    int count = 0;
    wchar_t **wide = CommandLineToArgvW(GetCommandLineW(), &count);
    char **list = wide ? calloc((size_t)count + 1, sizeof *list) : NULL;
    for (int i = 0; list && i < count; i++)
        if (!(list[i] = utf8_of(wide[i]))) return;
    if (list) *argc = count, *argv = list;
}

#else

#include <signal.h>
#include <unistd.h>

static const struct {
    int number;
    const char *name;
} signals[] = {{SIGINT, "SIGINT (interrupted)"},
               {SIGTERM, "SIGTERM (asked to end)"},
               {SIGHUP, "SIGHUP (the terminal is gone)"},
               {SIGXCPU, "SIGXCPU (the limit of processor time)"}};

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
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        if (!is_ignored(signals[i].number)) sigaddset(&set, signals[i].number);
    sigprocmask(SIG_BLOCK, &set, NULL);
}

const char *qw_interrupted(void)
{
    sigset_t set;
    if (sigpending(&set) != 0) return NULL;
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
        if (sigismember(&set, signals[i].number) == 1) return signals[i].name;
    return NULL;
}

bool qw_is_terminal(void) { return isatty(STDERR_FILENO) == 1; }

void qw_begin_tool(int *argc, char ***argv) { (void)argc, (void)argv; }

#endif
