/* The commands of the tool. Each says what went wrong in one line on standard error and returns the exit code. */
#pragma once

#include "args.h"

int qw_command_remesh(const qw_arguments *arguments);
int qw_command_measure(const qw_arguments *arguments);
int qw_command_render(const qw_arguments *arguments);
int qw_command_batch(const qw_arguments *arguments); /* 1: some models failed */

/* "quadwright: <sentence>", printable (base/printable.h), on standard error; the exit code of status. */
int qw_complain(qw_status status, const char *sentence);
/* Loads a mesh or complains; the exit code, 0 when *mesh is there. */
int qw_load_or_complain(const char *path, const qw_host *host, qw_mesh **mesh);
/* What a file of points may be refused with where it is read as a surface. wraps: a wrap was asked for; where none was,
   a broken surface is not taken for points. */
bool qw_may_be_points(qw_status status, bool wraps);
/* Replaces the mesh by its limit surface, split four times, or complains. */
int qw_take_limit(const qw_host *host, qw_mesh **mesh);

/* Maps of the next level of detail have half as many texels along a side: it is seen from further off. */
void qw_halve_texture(qw_asset_options *options);
/* Refuses outputs that cannot be written, and those that would destroy one another or what is read: the exit code. */
int qw_check_paths_or_complain(const qw_arguments *arguments);
/* A qw_host log hook: warnings on standard error. */
void qw_say_warnings(void *user, qw_log_level level, const char *message);
