/* Names and texts of failures and stages, from their tables; of maps, and the version. */
#include "quadwright/quadwright.h"

typedef struct error_row {
    const char *name, *text;
    int exit_code;
} error_row;

static const error_row errors[QW_STATUS_COUNT] = {
#define QW_ERROR(name, exit_code, text) {#name, text, exit_code},
#include "quadwright/errors.def"
};

static const char *const stage_titles[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) title,
#include "quadwright/stages.def"
};

static const error_row *row_of(qw_status status)
{
    return (unsigned)status < QW_STATUS_COUNT ? &errors[status] : &errors[QW_INTERNAL];
}

const char *qw_status_name(qw_status status) { return row_of(status)->name; }
const char *qw_status_text(qw_status status) { return row_of(status)->text; }
int qw_status_exit_code(qw_status status) { return row_of(status)->exit_code; }
const char *qw_stage_title(qw_stage stage)
{
    if (stage == QW_STAGE_COUNT) return "texture coordinates and maps";
    return (unsigned)stage < QW_STAGE_COUNT ? stage_titles[stage] : "?";
}

const char *qw_map_name(qw_map map)
{
    static const char *const names[QW_MAP_COUNT] = {"color", "normal", "orm", "emission", "occlusion", "height"};
    return (unsigned)map < QW_MAP_COUNT ? names[map] : NULL;
}

#define QW_STRING_(x) #x
#define QW_STRING(x)  QW_STRING_(x)

const char *qw_version(void)
{
    return QW_STRING(QW_VERSION_MAJOR) "." QW_STRING(QW_VERSION_MINOR) "." QW_STRING(QW_VERSION_PATCH);
}
