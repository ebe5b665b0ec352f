/* Several threads in WebAssembly without emscripten's own JavaScript: worker.js begins Workers (thread.js) that share
 * the module's memory and call web_join_team, and the library's tasks are run by all of them. Only for modules that are
 * built with -pthread; elsewhere tasks run one after the other. */
#ifndef QW_WEB_TEAM_H
#define QW_WEB_TEAM_H

#include <stdint.h>

/* As qw_host.parallel. */
void team_run(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user);

#endif
