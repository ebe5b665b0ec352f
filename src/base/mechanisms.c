#include "base/mechanisms.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef QW_SWITCHES

static const char *const names[QW_MECHANISMS] = {
#define QW_MECHANISM(name, file, what, without) #name,
#include "base/mechanisms.def"
};

/* A name that no mechanism has would measure nothing. */
static void switch_off(qw_switches *s, const char *name, size_t length)
{
    for (int m = 0; m < QW_MECHANISMS; m++)
        if (strlen(names[m]) == length && memcmp(names[m], name, length) == 0) {
            s->off[m] = true;
            return;
        }
    fprintf(stderr, "QW_WITHOUT: no mechanism is called %.*s (src/base/mechanisms.def)\n", (int)length, name);
    abort();
}

void qw_switches_begin(qw_switches *s)
{
    const char *name = getenv("QW_WITHOUT");
    while (name && *name) {
        size_t length = strcspn(name, ",");
        if (length > 0) switch_off(s, name, length);
        name += length + (name[length] != '\0');
    }
}

void qw_switches_end(const qw_switches *s)
{
    const char *path = getenv("QW_MECHANISMS"), *before = "{";
    FILE *file = NULL;
    for (int m = 0; path && m < QW_MECHANISMS; m++) {
        if (s->asked[m] + s->acted[m] == 0) continue;
        if (!file && !(file = fopen(path, "a"))) return;
        fprintf(file, "%s\"%s\": [%lld, %lld, %lld]", before, names[m], (long long)s->asked[m], (long long)s->acted[m],
                (long long)s->kept[m]);
        before = ", ";
    }
    if (file) fprintf(file, "}\n"), fclose(file);
}

bool qw_uses(qw_env *env, qw_mechanism m)
{
    qw_switches *s = qw_env_switches(env);
    s->asked[m]++;
    return !s->off[m];
}

void qw_acted(qw_env *env, qw_mechanism m, int64_t times) { qw_env_switches(env)->acted[m] += times; }
void qw_kept(qw_env *env, qw_mechanism m, int64_t times) { qw_env_switches(env)->kept[m] += times; }

#endif
