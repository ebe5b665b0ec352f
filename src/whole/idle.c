#include "whole/idle.h"

#include <math.h>

#include <stdio.h>
#include <string.h>

typedef struct idle_rule {
    const char *name;      /* an option that only works with another one */
    const char *of;        /* that one, or NULL: a region that is set */
    const char *value;     /* of it */
    bool is_idle_with;     /* idle with that value; else with every other */
    const char *condition; /* what would have to be, for the sentence */
} idle_rule;

static const idle_rule rules[] = {
    {"wrap_distance", "wrap", "on", false, "wrap"},
    {"wrap_quads", "wrap", "on", false, "wrap"},
    {"symmetry_x", "symmetry", "plane", false, "symmetry plane"},
    {"symmetry_y", "symmetry", "plane", false, "symmetry plane"},
    {"symmetry_z", "symmetry", "plane", false, "symmetry plane"},
    {"symmetry_offset", "symmetry", "plane", false, "symmetry plane"},
    {"symmetry_follow", "symmetry", "none", true, "symmetry"},
    {"evenness", "relax", "on", false, "relax"},
    {"region_rim", NULL, NULL, false, "a region"},
};

/* Whether an option was set but does nothing, by this rule. */
static bool is_idle(const qw_run_state *run, const idle_rule *rule)
{
    qw_options initial;
    char now[64] = "", before[64] = "", other[64] = "";
    qw_options_init(&initial);
    qw_option_get(&run->options, rule->name, now, sizeof now);
    qw_option_get(&initial, rule->name, before, sizeof before);
    if (strcmp(now, before) == 0) return false;
    if (!rule->of) return run->steering.region == NULL;
    qw_option_get(&run->options, rule->of, other, sizeof other);
    return (strcmp(other, rule->value) == 0) == rule->is_idle_with;
}

void qw_warn_of_idle(qw_run_state *run)
{
    char text[sizeof run->report->warnings[0]];
    for (size_t i = 0; i < sizeof rules / sizeof *rules; i++) {
        if (!is_idle(run, &rules[i])) continue;
        snprintf(text, sizeof text, "option %s has no effect without %s", rules[i].name, rules[i].condition);
        qw_warn_once(run, text);
    }
    double edge = run->options.edge_length, whole = sqrt(run->whole.area) / run->whole.clean.frame.scale;
    if (edge <= whole) return;
    snprintf(text, sizeof text,
             "edges of %g were asked for, longer than those of one square as large as the whole surface, %.3g", edge,
             whole);
    qw_warn_once(run, text);
}
