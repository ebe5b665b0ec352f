#include "help.h"
#include "switches.h"

#include "base/near.h"

#include <string.h>

enum { HELP_INDENT = 10, HELP_WIDTH = 100 };

/* ---- what is said of the whole */

static const qw_usage_row usages[] = {
    {"quadwright IN -o OUT [--faces N] [OPTIONS]", "make quads of a surface"},
    {"quadwright asset IN... -o OUT.glb [--texture N]", "quads, texture coordinates and maps of the input"},
    {"quadwright measure MESH [--against SURFACE] [--json]", "every figure of a mesh"},
    {"quadwright render MESH... -o PICTURE.png", "pictures of one mesh, or of several side by side"},
    {"quadwright batch FOLDER|LIST|- --out FOLDER", "many models; goes on where it was ended"},
    {"quadwright options", "the options as a tab-separated table"},
    {"quadwright version", "the version, as --version and -V"},
    {"quadwright help [TOPIC|OPTION|all]", "the manual, or a part of it"},
};
enum { USAGE_COUNT = sizeof usages / sizeof usages[0], USAGE_WIDTH = 52 };

static const char *const examples[] = {
    "quadwright bunny.obj -o quads.obj --faces 5000",
    "quadwright bracket.stl -o quads.obj --preset cad --faces 3000",
    "quadwright asset scan.glb -o asset.glb --faces 5000 --texture 2048",
    "quadwright scan.ply -o quads.ply --edge-length 0.01 --json report.json",
    "cat part.stl | quadwright - --ratio 0.5 > quads.obj",
    "quadwright bunny.obj --dump-stage orientation:field.qws",
    "quadwright --from-stage field.qws -o quads.obj --flow mcf-mr",
    "quadwright batch models/ --out quads/ --faces 4000 --time-limit 600",
};

const qw_usage_row *qw_usage_at(size_t index) { return index < USAGE_COUNT ? &usages[index] : NULL; }
const char *qw_example_at(size_t index) { return index < sizeof examples / sizeof *examples ? examples[index] : NULL; }

/* ---- one option, one switch */

/* A text in lines of at most HELP_WIDTH columns, broken at blanks and indented. */
static void put_wrapped(FILE *file, const char *text)
{
    int column = HELP_INDENT;
    fprintf(file, "%*s", HELP_INDENT, "");
    while (*text) {
        int length = (int)strcspn(text, " ");
        if (column > HELP_INDENT && column + 1 + length > HELP_WIDTH) {
            fprintf(file, "\n%*s", HELP_INDENT, "");
            column = HELP_INDENT;
        } else if (column > HELP_INDENT) {
            fputc(' ', file);
            column++;
        }
        fprintf(file, "%.*s", length, text);
        column += length;
        text += length;
        while (*text == ' ') text++;
    }
    fputc('\n', file);
}

void qw_option_initial(const qw_option_info *info, char *text, size_t size)
{
    qw_options defaults;
    qw_asset_options of_asset;
    qw_options_init(&defaults), qw_asset_options_init(&of_asset);
    if (qw_option_get(&defaults, info->name, text, size) != QW_OK)
        qw_asset_option_get(&of_asset, info->name, text, size);
}

void qw_option_usage(const qw_option_info *info, char *text, size_t size)
{
    char name[64];
    snprintf(name, sizeof name, "%s", info->name);
    for (char *c = name; *c; c++)
        if (*c == '_') *c = '-';
    switch (info->kind) {
    case QW_KIND_FLAG: snprintf(text, size, "--[no-]%s", name); break;
    case QW_KIND_CHOICE: snprintf(text, size, "--%s %s", name, info->choices); break;
    case QW_KIND_COUNT: snprintf(text, size, "--%s N", name); break;
    case QW_KIND_REAL: snprintf(text, size, "--%s X", name); break;
    }
}

/* An option: how it is written, range, unit and initial value, and what it is for. */
static void put_option(FILE *file, const qw_option_info *info)
{
    char usage[256], initial[64] = "";
    qw_option_usage(info, usage, sizeof usage);
    qw_option_initial(info, initial, sizeof initial);
    fprintf(file, "  %s", usage);
    /* 0 leaves a target out, and is refused where it is typed */
    const char *unasked = strstr(info->help, " (0: not asked for)");
    if (info->kind == QW_KIND_COUNT || info->kind == QW_KIND_REAL) {
        bool is_real_target = unasked && info->kind == QW_KIND_REAL;
        fprintf(file, "  (%s%.15g to %.15g", is_real_target ? "above " : "",
                unasked && !is_real_target ? 1 : info->least, info->most);
        fprintf(file, strcmp(info->unit, "-") ? " %s)" : ")", info->unit);
    }
    fprintf(file, "  [%s]\n", unasked ? "not asked for" : initial);
    char help[1024];
    snprintf(help, sizeof help, "%.*s", (int)(unasked ? unasked - info->help : (ptrdiff_t)strlen(info->help)),
             info->help);
    put_wrapped(file, help);
}

static void put_switch(FILE *file, const qw_switch_row *row)
{
    fputs("  ", file);
    if (row->alias) fprintf(file, "-%s%s", row->alias, row->name ? ", " : "");
    if (row->name) fprintf(file, "--%s", row->name);
    fprintf(file, "%s%s\n", row->value ? " " : "", row->value ? row->value : "");
    put_wrapped(file, row->help);
}

/* Those of the library's options, or not, that a command of `commands` takes. */
static void put_switches(FILE *file, bool standing_for, int commands)
{
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++)
        if ((row->id == SWITCH_STANDS_FOR) == standing_for && (row->commands & commands)) put_switch(file, row);
}

/* ---- sections */

static void put_usage(FILE *file)
{
    for (int i = 0; i < USAGE_COUNT; i++) fprintf(file, "  %-*s  %s\n", USAGE_WIDTH, usages[i].line, usages[i].about);
}

static void put_formats(FILE *file)
{
    fputs(
        "  Reads OBJ, PLY, OFF, STL, GLB and glTF, judged by their contents. Writes OBJ, PLY, OFF, STL, GLB and glTF, "
        "whole or\n"
        "  not at all.\n"
        "  Without a target the result has a quarter as many quads as the input has triangles, from 100 to 20000.\n",
        file);
}

static void put_preset(FILE *file, const qw_preset_info *preset)
{
    fprintf(file, "  %-12s  %s\n", preset->name, preset->settings);
    put_wrapped(file, preset->help);
}

static void put_presets(FILE *file)
{
    for (size_t i = 0; qw_preset_at(i); i++) put_preset(file, qw_preset_at(i));
}

static void put_quadriflow(FILE *file)
{
    fputs("  -i and -o as of Quadwright, and\n", file);
    put_switches(file, true, ~0);
}

static void put_stages(FILE *file)
{
    for (int s = 0; s < QW_STAGE_COUNT; s++) {
        char word[QW_STAGE_WORD];
        fprintf(file, "  %-12s  %s\n", qw_stage_word((qw_stage)s, word), qw_stage_title((qw_stage)s));
    }
}

/* The command takes all that a remesh does. */
static void put_asset(FILE *file)
{
    for (int i = 0; i < USAGE_COUNT; i++)
        if (strncmp(usages[i].line, "quadwright asset ", 17) == 0) fprintf(file, "  %s\n", usages[i].line);
    put_wrapped(file, "with all options and switches of a remesh, and those below; docs/asset.md");
}

static void put_statuses(FILE *file)
{
    for (int s = 0; s < QW_STATUS_COUNT; s++)
        fprintf(file, "  %2d  %-18s %s\n", qw_status_exit_code((qw_status)s), qw_status_name((qw_status)s),
                qw_status_text((qw_status)s));
    fputs("   1  (batch)            some models failed; the report says which\n", file);
}

static void put_examples(FILE *file)
{
    for (size_t i = 0; i < sizeof examples / sizeof *examples; i++) fprintf(file, "  %s\n", examples[i]);
}

void qw_print_manual(FILE *file)
{
    fprintf(file, "quadwright %s: any triangle surface in, a clean all-quad mesh out\n\nUSAGE\n", qw_version());
    put_usage(file);
    fputc('\n', file);
    put_formats(file);
    fputs("\nSWITCHES\n", file);
    put_switches(file, false, ~0);
    fputs("\nOPTIONS (bounds) [default]\n", file);
    for (size_t i = 0; i < qw_option_count(); i++) put_option(file, qw_option_at(i));
    fputs("\nOPTIONS OF TEXTURE COORDINATES AND MAPS (bounds) [default]\n", file);
    for (size_t i = 0; i < qw_asset_option_count(); i++) put_option(file, qw_asset_option_at(i));
    fputs("\nPRESETS, for --preset\n", file);
    put_presets(file);
    fputs("\nQUADRIFLOW'S FLAGS\n", file);
    put_quadriflow(file);
    fputs("\nSTAGES, for --dump-stage\n", file);
    put_stages(file);
    fputs("\nEXIT STATUS\n", file);
    put_statuses(file);
    fputs("\nEXAMPLES\n", file);
    put_examples(file);
}

/* ---- topics */

typedef struct topic {
    const char *name, *about; /* about: a heading, for the list of topics too */
    const char *names;        /* options and switches of it, with spaces; "" for none */
    void (*more)(FILE *file); /* printed below the heading; NULL: nothing */
    qw_command command;       /* all its switches belong to the topic; QW_COMMAND_HELP: no command */
} topic;

static const topic topics[] = {
    {"size", "how many quads, and how large they are where",
     "faces vertices edge_length ratio adaptive density evenness", NULL, QW_COMMAND_HELP},
    {"shape", "what the quads follow",
     "preset sharp keep follow smoothness loops fit exact jacobian_min align_boundary relax sharp_angle "
     "sharp_marks keep_marks",
     NULL, QW_COMMAND_HELP},
    {"levels", "levels of detail, subdivision, limit surfaces",
     "levels subdivide coarse fit_to limit patches patches_from", NULL, QW_COMMAND_HELP},
    {"presets", "options that suit a kind of surface", "preset", put_presets, QW_COMMAND_HELP},
    {"symmetry", "both sides of a plane alike",
     "symmetry symmetry_follow symmetry_x symmetry_y symmetry_z symmetry_offset", NULL, QW_COMMAND_HELP},
    {"steering", "guides, fields and regions",
     "guides field_in field_out field_per region region_rim fix_boundary density", NULL, QW_COMMAND_HELP},
    {"wrap", "a skin around soups, gaps, holes and fragments first", "wrap wrap_distance wrap_quads fill_holes", NULL,
     QW_COMMAND_HELP},
    {"asset", "texture coordinates of the result's own, and maps on them",
     "unwrap bake texture margin tiles texel_density texel_focus stretch unwrap_grid samples cage", put_asset,
     QW_COMMAND_HELP},
    {"files", "what is read and written",
     "input output format second_order json provenance no_attributes normals force "
     "min_component outward",
     put_formats, QW_COMMAND_HELP},
    {"running", "time, memory, threads, what is said", "threads memory_limit time_limit seed quiet verbose version",
     NULL, QW_COMMAND_HELP},
    {"measure", "every figure of a mesh", "", NULL, QW_COMMAND_MEASURE},
    {"render", "pictures of meshes", "", NULL, QW_COMMAND_RENDER},
    {"batch", "many models; it also takes the options of the library", "", NULL, QW_COMMAND_BATCH},
    {"method", "how the integers are found, as in the paper and beyond", "flow cost sat repair", NULL, QW_COMMAND_HELP},
    {"stages", "the stages, to stop after and to go on from", "dump_stage from_stage", put_stages, QW_COMMAND_HELP},
    {"status", "exit codes", "", put_statuses, QW_COMMAND_HELP},
    {"quadriflow", "the flags of QuadriFlow, which work too", "", put_quadriflow, QW_COMMAND_HELP},
    {"examples", "commands to begin with", "", put_examples, QW_COMMAND_HELP},
};
enum { TOPIC_COUNT = sizeof topics / sizeof topics[0] };

const char *qw_topic_at(size_t index)
{
    return index < TOPIC_COUNT ? topics[index].name : index == TOPIC_COUNT ? "all" : NULL;
}

/* Prints the option, the preset and the switches of this name, and says whether there were any. */
static bool put_named(FILE *file, const char *name)
{
    bool any = false;
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++)
        if (row->name && qw_same_name(row->name, name)) {
            put_switch(file, row);
            any = true;
        }
    for (size_t i = 0; i < qw_option_count(); i++)
        if (qw_same_name(qw_option_at(i)->name, name)) {
            put_option(file, qw_option_at(i));
            any = true;
        }
    for (size_t i = 0; i < qw_asset_option_count(); i++)
        if (qw_same_name(qw_asset_option_at(i)->name, name)) {
            put_option(file, qw_asset_option_at(i));
            any = true;
        }
    for (size_t i = 0; qw_preset_at(i); i++)
        if (strcmp(qw_preset_at(i)->name, name) == 0) {
            fputs("a preset: --preset NAME\n\n", file);
            put_preset(file, qw_preset_at(i));
            any = true;
        }
    return any;
}

/* All that help says of a topic: what it is about, its options, and usage and switches of its command. */
static void put_topic(FILE *file, const topic *t)
{
    fprintf(file, "%s: %s\n\n", t->name, t->about);
    if (t->more) t->more(file);
    if (t->more && t->names[0]) fputc('\n', file);
    for (const char *at = t->names; *at;) {
        char name[32];
        size_t length = strcspn(at, " ");
        snprintf(name, sizeof name, "%.*s", (int)length, at);
        put_named(file, name);
        at += length + (at[length] == ' ');
    }
    if (t->command == QW_COMMAND_HELP) return;
    for (int i = 0; i < USAGE_COUNT; i++)
        if (strstr(usages[i].line, qw_command_name(t->command))) fprintf(file, "  %s\n\n", usages[i].line);
    put_switches(file, false, 1 << t->command);
}

static void put_topics(FILE *file)
{
    for (int i = 0; i < TOPIC_COUNT; i++) fprintf(file, "  %-12s  %s\n", topics[i].name, topics[i].about);
    fputs("  all           the whole manual\n", file);
}

void qw_print_screen(FILE *file)
{
    fprintf(file, "quadwright %s: any triangle surface in, a clean all-quad mesh out\n\n", qw_version());
    put_usage(file);
    fputs("\nReads OBJ, PLY, OFF, STL, GLB and glTF; writes OBJ, PLY, OFF, STL, GLB and glTF. Most used:\n"
          "  -o FILE        the result; the ending of its name says the format\n"
          "  --faces N      how many quads; or --edge-length X, --vertices N, --ratio X\n"
          "  --preset NAME  what suits a kind of surface: ",
          file);
    const qw_preset_info *preset;
    for (size_t i = 0; (preset = qw_preset_at(i)); i++) fprintf(file, "%s%s", i ? ", " : "", preset->name);
    fputs("\n  --adaptive X   0: quads of one size; to 1: small where there is much to see\n"
          "  --symmetry any          both sides alike\n"
          "  --sharp auto|none|30    which edges are sharp, by an angle in degrees\n"
          "  --keep seams,materials  edges of the result follow these borders\n"
          "\nquadwright help TOPIC, or help OPTION:\n",
          file);
    put_topics(file);
}

/* The topic, option or switch that was meant, or NULL. */
static const char *meant(const char *typed)
{
    unsigned best = QW_NEVER_NEAR;
    const char *found = NULL;
    for (int i = 0; i < TOPIC_COUNT; i++)
        if (qw_is_near(typed, topics[i].name, &best)) found = topics[i].name;
    const char *given = qw_option_meant(typed, &best);
    return given ? given : found;
}

bool qw_print_about(FILE *file, const char *name, char *message, size_t message_size)
{
    while (*name == '-') name++;
    if (strcmp(name, "all") == 0) return qw_print_manual(file), true;
    for (int i = 0; i < TOPIC_COUNT; i++)
        if (qw_same_name(topics[i].name, name)) return put_topic(file, &topics[i]), true;
    if (put_named(file, name) || (strncmp(name, "no-", 3) == 0 && put_named(file, name + 3))) return true;
    const char *near = meant(name);
    snprintf(message, message_size,
             near ? "no help on \"%.40s\"; did you mean \"%s\"?" : "no help on \"%.40s\"; quadwright help lists topics",
             name, near);
    return false;
}

void qw_print_options(FILE *file)
{
    static const char *const kinds[] = {"count", "real", "flag", "choice"};
    fputs("name\tkind\tdefault\tleast\tmost\tunit\tchoices\thelp\n", file);
    for (size_t i = 0; i < qw_option_count(); i++) {
        const qw_option_info *info = qw_option_at(i);
        char initial[64] = "";
        qw_option_initial(info, initial, sizeof initial);
        fprintf(file, "%s\t%s\t%s\t%.15g\t%.15g\t%s\t%s\t%s\n", info->name, kinds[info->kind], initial, info->least,
                info->most, info->unit, info->choices ? info->choices : "", info->help);
    }
}
