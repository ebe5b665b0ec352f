#include "without_effect.h"

#include <string.h>

static void say(FILE *file, const char *what, const char *without)
{
    fprintf(file, "note: --%s has no effect without %s\n", what, without);
}

void qw_say_idle(FILE *file, const qw_arguments *a)
{
    qw_asset_options initial;
    qw_asset_options_init(&initial);
    for (size_t i = 0; i < qw_asset_option_count() && !a->unwrap && !a->bake; i++) {
        char now[64] = "", before[64] = "", name[64];
        qw_asset_option_get(&a->asset, qw_asset_option_at(i)->name, now, sizeof now);
        qw_asset_option_get(&initial, qw_asset_option_at(i)->name, before, sizeof before);
        snprintf(name, sizeof name, "%s", qw_asset_option_at(i)->name);
        for (char *c = name; *c; c++)
            if (*c == '_') *c = '-';
        if (strcmp(now, before) != 0) say(file, name, "--bake or --unwrap, or the command asset");
    }
    if (a->field_per != QW_PER_FACE && !a->field_out) say(file, "field-per", "--field-out");
    if (a->blocks && !a->patches) say(file, "patches-from", "--patches");
}
