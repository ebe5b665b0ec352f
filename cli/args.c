#include "args.h"
#include "switches.h"

#include "base/near.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

typedef struct parser {
    qw_arguments *out;
    int argc, next;
    char **argv;
    char *message;
    size_t message_size;
} parser;

static qw_status refuse(parser *p, qw_status status, const char *format, ...) __attribute__((format(printf, 3, 4)));

static qw_status refuse(parser *p, qw_status status, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->message, p->message_size, format, arguments);
    va_end(arguments);
    return status;
}

/* ---- single words */

static char lower(char c) { return c >= 'A' && c <= 'Z' ? (char)(c + 32) : c; }

static bool same_text(const char *a, const char *b, bool fold)
{
    for (; *a && *b; a++, b++) {
        if (*a != *b && !(fold && lower(*a) == lower(*b))) return false;
    }
    return *a == *b;
}

const char *const qw_format_words[] = {"auto", "obj", "ply", "off", "stl", "glb", "gltf", "msh", "vtu", "inp", "bdf"};

/* STAGE:FILE: the file is put down as that of the stage's dump. */
static qw_status parse_dump(parser *p, const char *value)
{
    const char *colon = strchr(value, ':');
    char name[32] = "", word[QW_STAGE_WORD];
    if (colon && (size_t)(colon - value) < sizeof name) memcpy(name, value, (size_t)(colon - value));
    for (int s = 0; s < QW_STAGE_COUNT; s++)
        if (same_text(name, qw_stage_word((qw_stage)s, word), true) && colon[1]) {
            p->out->dump[s] = colon + 1;
            return QW_OK;
        }
    return refuse(
        p, QW_ARGUMENT,
        "--dump-stage needs STAGE:FILE with a stage such as orientation or quads (see quadwright help), not \"%.60s\"",
        value);
}

static qw_status parse_whole(parser *p, const qw_switch_row *row, const char *value, int64_t *number)
{
    char *end;
    long long v = strtoll(value, &end, 10);
    if (end == value || *end || v < row->least || v > row->most)
        return refuse(p, QW_ARGUMENT, "--%s must be a whole number from %lld to %lld, not \"%.40s\"", row->name,
                      (long long)row->least, (long long)row->most, value);
    *number = v;
    return QW_OK;
}

/* The next input, of as many as the command takes; one more is refused, with what was probably meant. */
static qw_status set_input(parser *p, const char *value)
{
    qw_arguments *out = p->out;
    bool is_render = out->command == QW_COMMAND_RENDER, is_asset = out->command == QW_COMMAND_ASSET;
    int64_t most = is_render ? QW_MOST_PANELS : is_asset ? QW_MOST_INPUTS : 1;
    if (out->input_count < most) {
        if (!out->input) out->input = value;
        out->inputs[out->input_count++] = value;
        return QW_OK;
    }
    if (is_render) return refuse(p, QW_ARGUMENT, "a picture holds at most %d meshes", QW_MOST_PANELS);
    if (is_asset) return refuse(p, QW_ARGUMENT, "an asset is made of at most %d files", QW_MOST_INPUTS);
    if (!out->output && out->command == QW_COMMAND_REMESH)
        return refuse(p, QW_ARGUMENT, "two inputs were named: %.80s and %.80s; the result is named by -o: -o %.80s",
                      out->input, value, value);
    return refuse(p, QW_ARGUMENT, "two inputs were named: %.80s and %.80s", out->input, value);
}

/* ---- options of the library */

/* NULL: none is called so. at: qw_option_at, or qw_asset_option_at for those of texture coordinates and maps. */
static const qw_option_info *option_named(const qw_option_info *(*at)(size_t), const char *name)
{
    const qw_option_info *info;
    for (size_t i = 0; (info = at(i)) && !qw_same_name(info->name, name);) i++;
    return info;
}

/* In the library a target of zero means "not asked for"; said aloud it is a mistake. */
static qw_status set_option(parser *p, const char *name, const char *value)
{
    static const char *const targets[] = {"faces", "vertices", "edge_length", "ratio"};
    qw_status status = qw_option_set(&p->out->options, name, value, p->message, p->message_size);
    const qw_option_info *info = option_named(qw_option_at, name);
    char now[64] = "";
    int i = 0;
    while (i < 4 && !(info && strcmp(info->name, targets[i]) == 0)) i++;
    if (i == 4) return status;
    qw_option_get(&p->out->options, targets[i], now, sizeof now);
    if (i < 2 && (status != QW_OK || strcmp(now, "0") == 0))
        return refuse(p, QW_OPTION, "option %s must be a whole number from 1 to %.0f, not \"%.40s\"", targets[i],
                      info->most, value);
    if (status == QW_OK && strcmp(now, "0") == 0) return refuse(p, QW_OPTION, "option %s must be above 0", targets[i]);
    return status;
}

static const char *following(parser *p, char *inline_value)
{
    if (inline_value) return inline_value;
    return p->next < p->argc ? p->argv[p->next++] : NULL;
}

/* Whether a word is a value of --wrap, which may have none: what is a number, or quads. */
static bool is_wrap_value(const qw_option_info *info, const char *word)
{
    return qw_same_name(info->name, "wrap") && strspn(word, ".0123456789") > 0 &&
           word[strspn(word, ".0123456789eE+-q")] == 0;
}

/* Where a switch belongs that this command does not take; NULL: no command has it. */
static const char *owner_of(const char *name)
{
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++)
        for (int c = 0; row->name && strcmp(row->name, name) == 0 && c < QW_COMMAND_COUNT; c++)
            if (row->commands & 1 << c) return qw_command_name((qw_command)c);
    return option_named(qw_option_at, name) || option_named(qw_asset_option_at, name)
               ? qw_command_name(QW_COMMAND_REMESH)
               : NULL;
}

/* Takes an option of the run, or of an asset, with its value, which may be the next word. */
static qw_status take_option(parser *p, const char *name, char *inline_value)
{
    const qw_option_info *info = option_named(qw_option_at, name),
                         *asset = info ? NULL : option_named(qw_asset_option_at, name);
    if (asset) {
        const char *value = following(p, inline_value);
        if (!value) return refuse(p, QW_ARGUMENT, "--%s needs a value", name);
        return qw_asset_option_set(&p->out->asset, name, value, p->message, p->message_size);
    }
    if (!info && strncmp(name, "no-", 3) == 0 && !inline_value) {
        info = option_named(qw_option_at, name + 3);
        if (info && info->kind == QW_KIND_FLAG) return set_option(p, info->name, "off");
        info = NULL;
    }
    if (!info && owner_of(name))
        return refuse(p, QW_ARGUMENT, "--%s belongs to the command %s: quadwright %s ...", name, owner_of(name),
                      owner_of(name));
    if (!info) {
        unsigned best = QW_NEVER_NEAR;
        const char *meant = qw_option_meant(name, &best);
        return refuse(p, QW_OPTION,
                      meant ? "unknown option \"%.40s\"; did you mean \"%s\"?" : "unknown option \"%.40s\"", name,
                      meant);
    }
    bool is_alone = info->kind == QW_KIND_FLAG && !inline_value;
    if (is_alone && !(p->next < p->argc && is_wrap_value(info, p->argv[p->next])))
        return set_option(p, info->name, "on");
    const char *value = following(p, inline_value);
    if (!value) return refuse(p, QW_ARGUMENT, "--%s needs a value", name);
    return set_option(p, info->name, value);
}

/* ---- switches */

/* "seams,part" becomes "uv,part". */
static qw_status parse_keep(parser *p, const char *value)
{
    static const char *const names[][2] = {
        {"seams", "uv"}, {"materials", "material"}, {"groups", "group"}, {"objects", "object"}};
    enum { NAMES = sizeof names / sizeof *names };
    char *keep = p->out->keep;
    size_t used = strlen(keep), room = sizeof p->out->keep;
    for (const char *at = value; *at;) {
        size_t size = strcspn(at, ","), i = 0;
        while (i < NAMES && (strlen(names[i][0]) != size || memcmp(names[i][0], at, size) != 0)) i++;
        const char *name = i < NAMES ? names[i][1] : at;
        size_t length = i < NAMES ? strlen(name) : size;
        if (length == 0 || used + length + 2 > room)
            return refuse(p, QW_ARGUMENT,
                          "--keep must be seams, materials, groups, objects, or names of attributes of the mesh, with "
                          "commas between them, not \"%.40s\"",
                          value);
        used += (size_t)snprintf(keep + used, room - used, "%s%.*s", used ? "," : "", (int)length, name);
        at += size + (at[size] == ',');
    }
    return set_option(p, "keep_marks", "on");
}

static qw_status parse_bake(parser *p, const char *value)
{
    char message[256];
    qw_status status = qw_maps_named(value, &p->out->maps, message, sizeof message);
    p->out->bake = true;
    return status == QW_OK ? status : refuse(p, status, "--%s", message);
}

/* Numbers of quads with commas between them, each less than the one before, go into out->level. */
static qw_status parse_levels(parser *p, const char *value)
{
    qw_arguments *out = p->out;
    out->level_count = 0;
    for (const char *at = value; at;) {
        char *end;
        long long faces = strtoll(at, &end, 10);
        bool falls = out->level_count == 0 || faces < out->level[out->level_count - 1];
        if (end == at || (*end && *end != ',') || faces < 1 || faces > 20000000 || !falls ||
            out->level_count == QW_MOST_LEVELS)
            return refuse(
                p, QW_ARGUMENT,
                "--levels must be up to %d numbers of quads from 1 to 20000000, each less than the one before, "
                "with commas between them, not \"%.40s\"",
                QW_MOST_LEVELS, value);
        out->level[out->level_count++] = faces;
        at = *end ? end + 1 : NULL;
    }
    return QW_OK;
}

/* One of the words of a switch, "a|b|c". */
static qw_status parse_choice(parser *p, const qw_switch_row *row, const char *value)
{
    char words[64] = "", word[16];
    int i = 0;
    for (const char *at = row->value; *at; i++) {
        size_t n = strcspn(at, "|"), used = strlen(words);
        snprintf(word, sizeof word, "%.*s", (int)n, at);
        if (same_text(value, word, true)) break;
        at += n + (at[n] == '|');
        snprintf(words + used, sizeof words - used, "%s%s", i == 0 ? "" : *at ? ", " : " or ", word);
        if (!*at) return refuse(p, QW_ARGUMENT, "--%s must be %s, not \"%.40s\"", row->name, words, value);
    }
    if (row->id == SWITCH_FORMAT) p->out->format = (qw_format)(i + 1);
    if (row->id == SWITCH_FIELD_PER) p->out->field_per = i ? QW_PER_FACE : QW_PER_VERTEX;
    if (row->id == SWITCH_NORMALS) p->out->normals = (qw_normals)i;
    if (row->id == SWITCH_PATCHES_FROM) p->out->blocks = i;
    if (row->id == SWITCH_COLOR) p->out->follow = !i, p->out->own_colours = i;
    return QW_OK;
}

static qw_status parse_sharp(parser *p, const char *value)
{
    bool marks = same_text(value, "marks", true);
    const char *angle = marks || same_text(value, "auto", true) ? "-1" : same_text(value, "none", true) ? "180" : value;
    char *end;
    strtod(angle, &end);
    if (end == angle || *end)
        return refuse(p, QW_ARGUMENT, "--sharp must be auto, none, marks or an angle in degrees, not \"%.40s\"", value);
    qw_status status = set_option(p, "sharp_marks", marks ? "on" : "off");
    return status == QW_OK ? set_option(p, "sharp_angle", angle) : status;
}

static qw_status parse_shard(parser *p, const char *value)
{
    char *slash, *end;
    long long shard = strtoll(value, &slash, 10), shards = *slash == '/' ? strtoll(slash + 1, &end, 10) : 0;
    if (slash == value || *slash != '/' || *end || shards < 1 || shards > 1000000 || shard < 0 || shard >= shards)
        return refuse(p, QW_ARGUMENT, "--shard must be I/N with I from 0 to N - 1, not \"%.40s\"", value);
    p->out->shard = shard, p->out->shards = shards;
    return QW_OK;
}

/* A bare number was megabytes before there were units, and still is, with a notice. */
static qw_status parse_memory(parser *p, const char *value)
{
    uint64_t bytes = 0;
    bool bare = value[strspn(value, "0123456789")] == 0;
    qw_status status = qw_memory_size(value, &bytes, p->message, p->message_size);
    if (status != QW_OK) return status;
    if (bare && bytes > UINT64_MAX >> 21) bytes = UINT64_MAX >> 21;
    if (bare) bytes <<= 20;
    if (bytes < 1 << 20) return refuse(p, QW_ARGUMENT, "--memory-limit must be at least 1M, not \"%.40s\"", value);
    p->out->memory_limit = bytes > SIZE_MAX ? SIZE_MAX : (size_t)bytes;
    p->out->bare_memory_limit = bare ? value : NULL;
    return QW_OK;
}

/* The value of a switch that has a way of its own to be read; else it is that of the option it stands for. */
static qw_status parse_value(parser *p, const qw_switch_row *row, const char *value)
{
    switch (row->id) {
    case SWITCH_INPUT: return set_input(p, value);
    case SWITCH_KEEP: return parse_keep(p, value);
    case SWITCH_BAKE: return parse_bake(p, value);
    case SWITCH_LEVELS: return parse_levels(p, value);
    case SWITCH_DUMP_STAGE: return parse_dump(p, value);
    case SWITCH_FORMAT:
    case SWITCH_FIELD_PER:
    case SWITCH_NORMALS:
    case SWITCH_PATCHES_FROM:
    case SWITCH_COLOR: return parse_choice(p, row, value);
    case SWITCH_SHARP: return parse_sharp(p, value);
    case SWITCH_MEMORY_LIMIT: return parse_memory(p, value);
    case SWITCH_SHARD: return parse_shard(p, value);
    default: return set_option(p, row->option, row->fixed ? row->fixed : value); /* SWITCH_STANDS_FOR */
    }
}

/* Puts what a switch says where its row of the table says. value: NULL where the switch takes none. */
static qw_status apply(parser *p, const qw_switch_row *row, const char *value)
{
    qw_arguments *out = p->out;
    void *member = (char *)out + row->member;
    if (row->id == SWITCH_FLAG) *(bool *)member = true;
    else if (row->id == SWITCH_TEXT) *(const char **)member = value;
    else if (row->id == SWITCH_WHOLE) return parse_whole(p, row, value, member);
    else if (row->id == SWITCH_HELP) { /* of a command what it takes; else the screen */
        out->input = out->command == QW_COMMAND_REMESH ? NULL : qw_command_name(out->command);
        out->command = QW_COMMAND_HELP;
    } else if (row->id == SWITCH_JSON) out->json = value ? value : "-";
    else if (row->id == SWITCH_SECOND_ORDER) out->second_order = true, out->options.subdivide = 1;
    else if (row->id == SWITCH_PATCHES) {
        out->patches = value;
        return set_option(p, "fit_to", "limit");
    } else return parse_value(p, row, value);
    return QW_OK;
}

static const qw_switch_row *switch_named(const parser *p, const char *name, bool two_dashes)
{
    const qw_switch_row *row;
    for (size_t i = 0; (row = qw_switch_at(i)); i++) {
        const char *own = two_dashes ? row->name : row->alias;
        if (own && strcmp(own, name) == 0 && (row->commands & 1 << p->out->command)) return row;
    }
    return NULL;
}

/* A word that begins with a dash: a switch of the command or an option, its value behind "=" or in the next word. */
static qw_status take_switch(parser *p, const char *word)
{
    bool two_dashes = word[1] == '-';
    const char *start = word + 1 + two_dashes;
    char name[64];
    size_t length = strcspn(start, "=");
    if (length == 0 || length >= sizeof name) return refuse(p, QW_ARGUMENT, "unknown switch \"%.60s\"", word);
    memcpy(name, start, length);
    name[length] = 0;
    char *inline_value = start[length] ? (char *)start + length + 1 : NULL;

    const qw_switch_row *row = switch_named(p, name, two_dashes);
    if (!row && two_dashes && (qw_takes_options(p->out->command))) return take_option(p, name, inline_value);
    if (!row && two_dashes && owner_of(name))
        return refuse(p, QW_ARGUMENT, "--%s belongs to the command %s, not to %s", name, owner_of(name),
                      qw_command_name(p->out->command));
    if (!row) return refuse(p, QW_ARGUMENT, "unknown switch \"%.60s\"; quadwright help lists them", word);
    const char *value = NULL;
    if (row->value) {
        value = following(p, inline_value);
        if (!value || !value[0])
            return refuse(p, QW_ARGUMENT, "%s%s needs a value: %s", two_dashes ? "--" : "-", name, row->value);
    } else if (inline_value) return refuse(p, QW_ARGUMENT, "%s%s takes no value", two_dashes ? "--" : "-", name);
    return apply(p, row, value);
}

/* ---- the whole command */

static qw_command command_named(const char *word, bool *found)
{
    *found = true;
    for (int i = 0; i < QW_COMMAND_COUNT; i++)
        if (strcmp(word, qw_command_name((qw_command)i)) == 0) return (qw_command)i;
    *found = false;
    return QW_COMMAND_REMESH;
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n > m && same_text(text + n - m, end, true);
}

/* Where --format is not given, the format is that of the ending of the output's name; OBJ for standard output. */
static qw_status settle_format(parser *p)
{
    qw_arguments *a = p->out;
    if (!a->output || a->format != QW_FORMAT_AUTO) return QW_OK;
    const char *dot = strrchr(a->output, '.');
    if (strcmp(a->output, "-") == 0) a->format = QW_FORMAT_OBJ;
    for (int i = QW_FORMAT_OBJ; i <= QW_FORMAT_BDF && dot && dot > a->output; i++)
        if (same_text(dot + 1, qw_format_words[i], true)) a->format = (qw_format)i;
    if (a->format != QW_FORMAT_AUTO) return QW_OK;
    return refuse(p, QW_FORMAT_UNKNOWN,
                  "the ending of %.200s names no format that can be written; use .obj, .ply, .off, .stl, .glb, .gltf, "
                  ".msh, .vtu, .inp or .bdf, or --format",
                  a->output);
}

static qw_status check_bake(parser *p)
{
    const qw_arguments *a = p->out;
    if (!a->bake || !a->output) return QW_OK;
    if (a->format != QW_FORMAT_GLB && a->format != QW_FORMAT_GLTF && a->format != QW_FORMAT_OBJ)
        return refuse(p, QW_ARGUMENT, "maps are written with GLB, glTF and OBJ only");
    if (a->format == QW_FORMAT_OBJ && strcmp(a->output, "-") == 0)
        return refuse(p, QW_ARGUMENT, "OBJ has its maps in files beside it: standard output has no folder; use GLB");
    if (a->from_stage) return refuse(p, QW_ARGUMENT, "maps are made of a mesh that is read, not of --from-stage");
    return QW_OK;
}

static qw_status check_unwrap(parser *p)
{
    const qw_arguments *a = p->out;
    bool holds = a->format == QW_FORMAT_AUTO || a->format == QW_FORMAT_OBJ || a->format == QW_FORMAT_PLY ||
                 a->format == QW_FORMAT_GLB || a->format == QW_FORMAT_GLTF;
    if (!a->unwrap || !a->output || holds) return QW_OK;
    return refuse(p, QW_ARGUMENT, "--unwrap: the format holds no texture coordinates; use OBJ, PLY, GLB or glTF");
}

/* What a format has no place for is refused rather than left out. */
static qw_status check_normals(parser *p)
{
    const qw_arguments *a = p->out;
    qw_status status = settle_format(p);
    if (status == QW_OK) status = check_bake(p);
    if (status == QW_OK) status = check_unwrap(p);
    if (status != QW_OK || !a->output || a->normals < QW_NORMALS_SMOOTH) return status;
    if (a->format == QW_FORMAT_OFF || a->format == QW_FORMAT_STL)
        return refuse(p, QW_ARGUMENT, "--normals: %s holds none of vertices; use OBJ, PLY or GLB",
                      a->format == QW_FORMAT_OFF ? "OFF" : "STL");
    if (a->format == QW_FORMAT_PLY && a->normals == QW_NORMALS_SPLIT)
        return refuse(p, QW_ARGUMENT, "--normals split: PLY holds one normal a vertex; use smooth, or OBJ or GLB");
    return QW_OK;
}

/* Names a result beside the input: "in.obj" becomes "in-quads.obj". */
static qw_status refuse_without_output(parser *p)
{
    const char *input = p->out->input ? p->out->input : "", *slash = strrchr(input, '/');
    const char *stem = slash ? slash + 1 : input, *dot = strrchr(stem, '.');
    const char *endings[] = {".obj", ".ply", ".off", ".glb", ".gltf"}, *ending = ".obj";
    for (size_t i = 0; dot && i < sizeof endings / sizeof *endings; i++)
        if (same_text(dot, endings[i], true)) ending = endings[i];
    int length = (int)(dot ? dot - stem : (ptrdiff_t)strlen(stem));
    if (length == 0 || length > 100) return refuse(p, QW_ARGUMENT, "no output was named: -o FILE is required");
    return refuse(p, QW_ARGUMENT, "no output was named: -o FILE is required, for example -o %.*s-quads%s", length, stem,
                  ending);
}

/* The first level is what the options ask for. */
static qw_status check_levels(parser *p)
{
    qw_options *o = &p->out->options;
    if (p->out->level_count == 0) return QW_OK;
    if (o->faces || o->vertices || o->edge_length > 0 || o->ratio > 0)
        return refuse(p, QW_ARGUMENT, "--levels says how many quads there are: no other option may");
    o->faces = p->out->level[0];
    return QW_OK;
}

/* Whether what was given for a remesh, or an asset, goes together; else says what does not. */
static qw_status check_remesh(parser *p)
{
    qw_arguments *a = p->out;
    bool dumps = false;
    for (int s = 0; s < QW_STAGE_COUNT; s++) dumps = dumps || a->dump[s];
    if (a->from_stage && a->input)
        return refuse(p, QW_ARGUMENT, "both an input and --from-stage were given; one is enough");
    if (a->from_stage && a->density)
        return refuse(p, QW_ARGUMENT,
                      "--density belongs to a mesh that is read, not to --from-stage, which has its own");
    if (a->from_stage && (a->field_in || a->guides || a->region))
        return refuse(p, QW_ARGUMENT, "%s belongs to a mesh that is read, not to --from-stage, which has its own",
                      a->field_in ? "--field-in"
                      : a->guides ? "--guides"
                                  : "--region");
    if (a->level_count > 0 && (dumps || a->from_stage || !a->output || strcmp(a->output, "-") == 0))
        return refuse(p, QW_ARGUMENT, "--levels goes from a mesh that is read to files: -o FILE, without stages");
    if (check_levels(p) != QW_OK) return QW_ARGUMENT;
    if (a->second_order && (settle_format(p) != QW_OK || a->format < QW_FORMAT_MSH || a->options.subdivide != 1))
        return refuse(p, QW_ARGUMENT, "--second-order is for .msh, .vtu, .inp and .bdf, without --subdivide");
    if (a->patches && !a->output) return refuse(p, QW_ARGUMENT, "--patches belongs to a result: -o FILE is required");
    if (a->coarse && a->options.subdivide == 0)
        return refuse(p, QW_ARGUMENT, "--coarse names the file of what --subdivide splits, which is not given");
    if (a->coarse && !a->output) return refuse(p, QW_ARGUMENT, "--coarse belongs to a result: -o FILE is required");
    if (a->field_out && !a->output)
        return refuse(p, QW_ARGUMENT, "--field-out tells the field of a result: -o FILE is required");
    if (!a->from_stage && !a->input) return refuse(p, QW_ARGUMENT, "no input was named; quadwright help says how");
    if (!a->output && a->input && strcmp(a->input, "-") == 0 && !dumps) a->output = "-";
    if (!a->output && a->input_count > 1)
        return refuse(p, QW_ARGUMENT, "%lld inputs were named; the result is named by -o: -o %.80s",
                      (long long)a->input_count, a->inputs[a->input_count - 1]);
    if (!a->output && !dumps) return refuse_without_output(p);
    if (a->json && a->output && strcmp(a->json, "-") == 0 && strcmp(a->output, "-") == 0)
        return refuse(p, QW_ARGUMENT, "the mesh and the report cannot both go to standard output");
    if (qw_options_validate(&a->options, p->message, p->message_size) != QW_OK) return QW_OPTION;
    return check_normals(p);
}

/* Whether the words that were given go together for their command; else says what does not. */
static qw_status check(parser *p)
{
    qw_arguments *a = p->out;
    if (a->version) return QW_OK;
    switch (a->command) {
    case QW_COMMAND_ASSET: a->bake = true; return check_remesh(p);
    case QW_COMMAND_REMESH: return check_remesh(p);
    case QW_COMMAND_BATCH:
        if (a->format == QW_FORMAT_AUTO) a->format = a->level_count > 0 ? QW_FORMAT_GLB : QW_FORMAT_OBJ;
        if (a->level_count > 0 && a->format != QW_FORMAT_GLB && a->format != QW_FORMAT_GLTF)
            return refuse(p, QW_ARGUMENT, "--levels of a batch are one file a model: --format glb or gltf");
        if (check_levels(p) != QW_OK) return QW_ARGUMENT;
        if (!a->input) return refuse(p, QW_ARGUMENT, "no folder and no list of models was named");
        if (!a->output) return refuse(p, QW_ARGUMENT, "no folder was named for the results: --out FOLDER is required");
        if (qw_options_validate(&a->options, p->message, p->message_size) != QW_OK) return QW_OPTION;
        return check_bake(p) == QW_OK ? check_unwrap(p) : QW_ARGUMENT;
    case QW_COMMAND_RENDER:
        if (!a->output) return refuse(p, QW_ARGUMENT, "no picture was named: -o FILE.png is required");
        if (strcmp(a->output, "-") != 0 && !ends_with(a->output, ".png"))
            return refuse(p, QW_ARGUMENT, "a picture must end in .png, not %.200s", a->output);
        if (a->views == 3 || a->views == 5) return refuse(p, QW_ARGUMENT, "--views must be 1, 2, 4 or 6");
        if (a->follow && !a->against)
            return refuse(p, QW_ARGUMENT, "--color follow needs the surface to be followed: --against FILE");
        return a->input ? QW_OK : refuse(p, QW_ARGUMENT, "no mesh was named to render");
    case QW_COMMAND_MEASURE: return a->input ? QW_OK : refuse(p, QW_ARGUMENT, "no mesh was named to measure");
    default: return QW_OK;
    }
}

/* A word that names no file and is nearly a command was meant as one: "mesure in.obj". */
static const char *command_meant(const char *word)
{
    unsigned best = 3;
    const char *found = NULL;
    if (word[0] == '-' || strpbrk(word, "./\\")) return NULL;
    for (int i = 0; i < QW_COMMAND_COUNT; i++)
        if (qw_is_near(word, qw_command_name((qw_command)i), &best)) found = qw_command_name((qw_command)i);
    FILE *file = found ? fopen(word, "rb") : NULL;
    if (file) fclose(file);
    return file ? NULL : found;
}

/* One pass over the words, on options that the preset has set. */
static qw_status parse_words(parser *p)
{
    bool only_files = false;
    qw_arguments *out = p->out;
    while (p->next < p->argc) {
        const char *word = p->argv[p->next++];
        qw_status status = QW_OK;
        if (!only_files && strcmp(word, "--") == 0) only_files = true;
        else if (only_files || word[0] != '-' || !word[1] || out->command == QW_COMMAND_HELP)
            status = set_input(p, word);
        else status = take_switch(p, word);
        if (status != QW_OK) return status;
        if (out->command == QW_COMMAND_HELP || out->command == QW_COMMAND_OPTIONS || out->command == QW_COMMAND_VERSION)
            return QW_OK;
    }
    return QW_OK;
}

static void begin(parser *p, qw_command command, int first)
{
    *p->out = (qw_arguments){
        .command = command, .field_per = QW_PER_FACE, .azimuth = QW_UNSET_ANGLE, .elevation = QW_UNSET_ANGLE};
    qw_options_init(&p->out->options);
    qw_asset_options_init(&p->out->asset);
    p->next = first;
}

/* The words are read again where they name a preset, whose options come first, so that those given win wherever
   they stand. */
qw_status qw_parse_arguments(int argc, char **argv, qw_arguments *arguments, char *message, size_t message_size)
{
    parser p = {.out = arguments, .argc = argc, .argv = argv, .message = message, .message_size = message_size};
    bool named = false;
    qw_command command = argc > 1 ? command_named(argv[1], &named) : QW_COMMAND_REMESH;
    message[0] = 0;
    begin(&p, command, 1 + named);
    const char *meant = argc > 1 && !named ? command_meant(argv[1]) : NULL;
    if (meant) return refuse(&p, QW_ARGUMENT, "unknown command \"%.40s\"; did you mean \"%s\"?", argv[1], meant);
    qw_status status = parse_words(&p);
    const char *preset = arguments->preset;
    if (status == QW_OK && preset && qw_takes_options(arguments->command)) {
        begin(&p, command, 1 + named);
        status = qw_options_preset(&arguments->options, preset, message, message_size);
        if (status == QW_OK) status = parse_words(&p);
    }
    return status == QW_OK ? check(&p) : status;
}
