#include "commands.h"

#include "base/printable.h"

#include <stdio.h>

enum { SENTENCE_SIZE = 2048 };

int qw_complain(qw_status status, const char *sentence)
{
    char shown[SENTENCE_SIZE];
    qw_printable(shown, sizeof shown, sentence && sentence[0] ? sentence : qw_status_text(status));
    fprintf(stderr, "quadwright: %s\n", shown);
    return qw_status_exit_code(status);
}

int qw_load_or_complain(const char *path, const qw_host *host, qw_mesh **mesh)
{
    qw_status status = qw_load(path, host, mesh);
    if (status == QW_OK) return 0;
    int code = qw_complain(status, qw_mesh_message(*mesh));
    qw_mesh_destroy(*mesh);
    *mesh = NULL;
    return code;
}

void qw_say_warnings(void *user, qw_log_level level, const char *message)
{
    (void)user;
    if (level == QW_LOG_WARNING) (void)qw_complain(QW_OK, message);
}
