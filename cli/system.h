/* What differs between operating systems in the tool: signals, the terminal, the arguments. The library's share of that
 * is base/platform.h, pool.c, io/file.c and io/file_windows.c.
 *
 * On POSIX, signals that ask the process to end are blocked while the library works and looked for at each call of the
 * progress hook. So no handler runs and no variable is global, the library unwinds by itself, and no half-written file
 * is left. Those that are ignored when the tool starts (nohup, a job in the background) stay so. On Windows a handler
 * notes that Ctrl-C was pressed. */
#pragma once

#include <stdbool.h>

/* First in main: on Windows the arguments become UTF-8, and standard input and output binary. */
void qw_begin_tool(int *argc, char ***argv);

/* Whether standard error is a terminal. */
bool qw_is_terminal(void);

/* A closed pipe and a limit of file sizes are errors of the write that meets them, no end of the process. */
void qw_ignore_write_signals(void);
/* From here on, on this thread and those it starts, SIGINT, SIGTERM, SIGHUP and SIGXCPU wait for the progress hook. */
void qw_hold_interrupts(void);
/* What the signal that waits is called, "SIGINT (interrupted)", or NULL where none does. */
const char *qw_interrupted(void);
