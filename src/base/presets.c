/* Presets by their one table, presets.def. Settings are text, so that a preset may name any option of options.def. */
#include "base/near.h"
#include "quadwright/quadwright.h"

#include <stdio.h>
#include <string.h>

static const qw_preset_info infos[] = {
#define QW_PRESET(name, settings, help) {#name, settings, help},
#include "quadwright/presets.def"
};

enum { PRESET_COUNT = sizeof infos / sizeof infos[0] };

size_t qw_preset_count(void) { return PRESET_COUNT; }
const qw_preset_info *qw_preset_at(size_t index) { return index < PRESET_COUNT ? &infos[index] : NULL; }

static const qw_preset_info *find(const char *name)
{
    for (size_t i = 0; i < PRESET_COUNT; i++)
        if (strcmp(infos[i].name, name) == 0) return &infos[i];
    return NULL;
}

/* "there is no preset "cat"; there are scan, character, ...; did you mean "cad"?" */
static qw_status refuse(const char *name, char *message, size_t message_size)
{
    if (!message || message_size == 0) return QW_OPTION;
    int used = snprintf(message, message_size, "there is no preset \"%.40s\"; there are", name ? name : "");
    for (size_t i = 0; i < PRESET_COUNT && used >= 0 && (size_t)used < message_size; i++)
        used += snprintf(message + used, message_size - (size_t)used, "%s %s", i ? "," : "", infos[i].name);
    const char *meant = NULL;
    unsigned best = QW_NEVER_NEAR;
    for (size_t i = 0; i < PRESET_COUNT && name; i++)
        if (qw_is_near(name, infos[i].name, &best)) meant = infos[i].name;
    if (meant && used >= 0 && (size_t)used < message_size)
        snprintf(message + used, message_size - (size_t)used, "; did you mean \"%s\"?", meant);
    return QW_OPTION;
}

qw_status qw_options_preset(qw_options *options, const char *name, char *message, size_t message_size)
{
    const qw_preset_info *preset = name ? find(name) : NULL;
    if (!options || !preset) return refuse(name, message, message_size);
    for (const char *at = preset->settings; *at;) {
        char setting[QW_SETTING_SIZE];
        size_t length = strcspn(at, " ");
        snprintf(setting, sizeof setting, "%.*s", (int)length, at);
        char *equals = strchr(setting, '=');
        if (!equals) return refuse(name, message, message_size);
        *equals = 0;
        qw_status status = qw_option_set(options, setting, equals + 1, message, message_size);
        if (status != QW_OK) return status;
        at += length + (at[length] == ' ');
    }
    return QW_OK;
}
