#include "args.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum {
    REMESH = 1 << QW_COMMAND_REMESH,
    MEASURE = 1 << QW_COMMAND_MEASURE,
    RENDER = 1 << QW_COMMAND_RENDER,
    BATCH = 1 << QW_COMMAND_BATCH,
    ALL = REMESH | MEASURE | RENDER | BATCH
};

typedef enum switch_id {
    SWITCH_HELP,
    SWITCH_VERSION,
    SWITCH_INPUT,
    SWITCH_OUTPUT,
    SWITCH_FORMAT,
    SWITCH_JSON,
    SWITCH_PROVENANCE,
    SWITCH_KEEP,
    SWITCH_DENSITY,
    SWITCH_FIELD_IN,
    SWITCH_FIELD_OUT,
    SWITCH_FIELD_PER,
    SWITCH_GUIDES,
    SWITCH_REGION,
    SWITCH_NO_ATTRIBUTES,
    SWITCH_NORMALS,
    SWITCH_AGAINST,
    SWITCH_QUIET,
    SWITCH_VERBOSE,
    SWITCH_DUMP_STAGE,
    SWITCH_FROM_STAGE,
    SWITCH_WIDTH,
    SWITCH_HEIGHT,
    SWITCH_VIEWS,
    SWITCH_COLOR,
    SWITCH_LINES,
    SWITCH_CHORD,
    SWITCH_AZIMUTH,
    SWITCH_ELEVATION,
    SWITCH_SHARP,
    SWITCH_MEMORY_LIMIT,
    SWITCH_TIME_LIMIT,
    SWITCH_JOBS,
    SWITCH_SHARD,
    SWITCH_RETRY,
    SWITCH_FORCE,
    SWITCH_PRESET /* stands for an option of the library with a fixed or a given value */
} switch_id;

typedef struct switch_row {
    switch_id id;
    int commands;                /* bits of the commands that take it */
    const char *name, *alias;    /* after "--" and after "-"; NULL: none */
    const char *value;           /* what follows, for the manual; NULL: nothing follows */
    const char *option, *preset; /* SWITCH_PRESET: sets option to preset, or to what follows */
    const char *help;
} switch_row;

static const switch_row switches[] = {
    {SWITCH_INPUT, ALL, "input", "i", "FILE", NULL, NULL,
     "the mesh to read; the same as naming it without a switch; - is standard input"},
    {SWITCH_OUTPUT, REMESH | RENDER, "output", "o", "FILE", NULL, NULL,
     "where the result goes; - is standard output, the default when the input is -; the ending names the format: .obj, "
     ".ply, .off, .glb or .gltf "
     "(render: .png)"},
    {SWITCH_OUTPUT, BATCH, "out", "o", "FOLDER", NULL, NULL, "batch: where quads, records and the report go"},
    {SWITCH_JOBS, BATCH, "jobs", "j", "N", NULL, NULL, "batch: processes at a time, 1 to 256; one a core unless given"},
    {SWITCH_SHARD, BATCH, "shard", NULL, "I/N", NULL, NULL,
     "batch: only part I, from 0, of N of the models, by a hash of their names"},
    {SWITCH_RETRY, BATCH, "retry", NULL, NULL, NULL, NULL,
     "batch: do again what failed before, not only what was killed"},
    {SWITCH_FORCE, REMESH, "force", NULL, NULL, NULL, NULL,
     "let -o name the input itself, which is then replaced by its quads; refused without"},
    {SWITCH_FORCE, BATCH, "force", NULL, NULL, NULL, NULL,
     "batch: replace results in the folder that were made with other options; refused without"},
    {SWITCH_FORMAT, REMESH | BATCH, "format", NULL, "obj|ply|off|glb|gltf", NULL, NULL,
     "format of the result, whatever its name"},
    {SWITCH_JSON, REMESH, "json", NULL, "FILE", NULL, NULL, "write the whole report there; - is standard output"},
    {SWITCH_JSON, MEASURE, "json", NULL, NULL, NULL, NULL, "measure: print the figures as JSON"},
    {SWITCH_PROVENANCE, REMESH, "provenance", NULL, "FILE", NULL, NULL,
     "write there where each vertex and corner of the result lies on the input: as JSON where the name ends in .json, "
     "else binary; docs/attributes.md"},
    {SWITCH_KEEP, REMESH | BATCH, "keep", NULL, "seams,materials,groups,objects,NAME", NULL, NULL,
     "edges of the result follow the seams of the texture, the borders of materials, groups or objects, or those of "
     "any "
     "attribute by its name, such as a face property of PLY, as they do sharp edges: any of these"},
    {SWITCH_DENSITY, REMESH | BATCH, "density", NULL, "FILE|PROPERTY", NULL, NULL,
     "how small the quads are to be where: a vertex property of the mesh (PLY), \"color\" for the grey of vertex "
     "colours "
     "(black 1, white 8), or a text file of one number for each vertex; edges are half as long where it is 2 as where "
     "it "
     "is 1, and the number of quads stays"},
    {SWITCH_FIELD_IN, REMESH, "field-in", NULL, "FILE", NULL, NULL,
     "a cross field that the quads follow instead of one of their own: a direction a vertex or a face of the input "
     "(.rosy); docs/steering.md"},
    {SWITCH_FIELD_OUT, REMESH, "field-out", NULL, "FILE", NULL, NULL,
     "write there the cross field that the quads follow, as --field-in reads it"},
    {SWITCH_FIELD_PER, REMESH, "field-per", NULL, "vertex|face", NULL, NULL,
     "what the directions of --field-out belong to; face unless given"},
    {SWITCH_GUIDES, REMESH, "guides", NULL, "FILE", NULL, NULL,
     "lines on the surface (OBJ v and l) on which edges of the result lie, or, in a group or object called direction, "
     "along which the quads run; docs/steering.md"},
    {SWITCH_REGION, REMESH, "region", NULL, "LABEL", NULL, NULL,
     "make quads of the faces of this group, material or object only (OBJ, GLB), or of a face property (PLY: part=3), "
     "and "
     "join "
     "them to the rest, which stays as it is; docs/steering.md"},
    {SWITCH_NO_ATTRIBUTES, REMESH | BATCH, "no-attributes", NULL, NULL, NULL, NULL,
     "leave texture coordinates, normals, colours, materials, groups and other attributes of the input behind"},
    {SWITCH_NORMALS, REMESH, "normals", NULL, "input|none|smooth|split", NULL, NULL,
     "normals of the result: those of the input where it has some, as without this switch; none; or those of the "
     "quads, "
     "smooth or split by the sharp edges that were kept (OBJ, GLB and glTF; PLY: smooth)"},
    {SWITCH_AGAINST, MEASURE | RENDER, "against", NULL, "FILE", NULL, NULL,
     "the surface that the mesh should follow; measure: for distances and angles to the shape; render: for --color "
     "follow"},
    {SWITCH_WIDTH, RENDER, "width", NULL, "N", NULL, NULL, "render: pixels across, 16 to 16384; 1600 unless given"},
    {SWITCH_HEIGHT, RENDER, "height", NULL, "N", NULL, NULL, "render: pixels down, 16 to 16384; 1200 unless given"},
    {SWITCH_VIEWS, RENDER, "views", NULL, "N", NULL, NULL,
     "render: 1, 2, 4 or 6 views of each mesh; unless given 4 of a single one, 1 of each of several"},
    {SWITCH_COLOR, RENDER, "color", NULL, "follow", NULL, NULL,
     "render: colour quads by the angle between their edges and the principal directions of the surface named by "
     "--against, from blue (0 degrees) to red (45), where these are clear"},
    {SWITCH_LINES, RENDER, "lines", NULL, NULL, NULL, NULL,
     "render: draw the lines that leave irregular vertices straight on; they cut the quads into the patches that "
     "measure "
     "counts"},
    {SWITCH_CHORD, RENDER, "chord", NULL, "N", NULL, NULL,
     "render: colour one strip of quads, side by side; 1 is the longest; where it crosses itself it is red"},
    {SWITCH_AZIMUTH, RENDER, "azimuth", NULL, "N", NULL, NULL,
     "render: degrees by which the first view is to the right of the front (+z)"},
    {SWITCH_ELEVATION, RENDER, "elevation", NULL, "N", NULL, NULL,
     "render: degrees by which the first view is from above (+y)"},
    {SWITCH_DUMP_STAGE, REMESH, "dump-stage", NULL, "STAGE:FILE", NULL, NULL,
     "write the state after a stage; without -o the run ends there; may be given for several stages"},
    {SWITCH_FROM_STAGE, REMESH, "from-stage", NULL, "FILE", NULL, NULL,
     "go on from a state that --dump-stage wrote, instead of reading a mesh"},
    {SWITCH_SHARP, REMESH | BATCH, "sharp", NULL, "auto|none|marks|ANGLE", NULL, NULL,
     "which edges are sharp: those found by a suitable angle, none, those that the input marks, or those above an "
     "angle in degrees"},
    {SWITCH_MEMORY_LIMIT, REMESH | BATCH, "memory-limit", NULL, "MB", NULL, NULL,
     "fail, with nothing written, rather than hold more memory than that; 1 to 1000000"},
    {SWITCH_TIME_LIMIT, REMESH | BATCH, "time-limit", NULL, "SECONDS", NULL, NULL,
     "fail, with nothing written, rather than take longer than that after reading (batch: for one model, reading "
     "included); 1 to 1000000; never changes a "
     "result that is in time"},
    {SWITCH_QUIET, ALL, "quiet", "q", NULL, NULL, NULL, "no progress and no summary; errors are still said"},
    {SWITCH_VERBOSE, REMESH, "verbose", "v", NULL, NULL, NULL, "say everything that the stages log"},
    {SWITCH_HELP, ALL, "help", "h", NULL, NULL, NULL, "this text"},
    {SWITCH_VERSION, ALL, "version", NULL, NULL, NULL, NULL, "the version"},
    {SWITCH_PRESET, REMESH | BATCH, NULL, "f", "N", "faces", NULL, "--faces N"},
    {SWITCH_PRESET, REMESH | BATCH, NULL, "sharp", NULL, "sharp_angle", "-1", "--sharp-angle -1"},
    {SWITCH_PRESET, REMESH | BATCH, NULL, "boundary", NULL, "align_boundary", "on", "--align-boundary"},
    {SWITCH_PRESET, REMESH | BATCH, NULL, "adaptive", NULL, "adaptive", "1", "--adaptive 1"},
    {SWITCH_PRESET, REMESH | BATCH, NULL, "mcf", NULL, "flow", "mcf", "--flow mcf"},
    {SWITCH_PRESET, REMESH | BATCH, NULL, "sat", NULL, "sat", "on", "--sat"},
    {SWITCH_PRESET, REMESH | BATCH, NULL, "seed", "N", "seed", NULL, "--seed N"},
};
enum { SWITCH_COUNT = sizeof switches / sizeof switches[0] };

static const char *const stage_names[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) #name,
#include "quadwright/stages.def"
#undef QW_STAGE
};

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

static qw_status parse_format(parser *p, const char *value)
{
    static const char *const names[] = {"auto", "obj", "ply", "off", NULL, "glb", "gltf"}; /* as qw_format has them */
    for (int i = 0; i <= QW_FORMAT_GLTF; i++)
        if (names[i] && same_text(value, names[i], true)) {
            p->out->format = (qw_format)i;
            return QW_OK;
        }
    return refuse(p, QW_ARGUMENT, "--format must be obj, ply, off, glb or gltf, not \"%.40s\"", value);
}

static qw_status parse_dump(parser *p, const char *value)
{
    const char *colon = strchr(value, ':');
    char name[32] = "";
    if (colon && (size_t)(colon - value) < sizeof name) memcpy(name, value, (size_t)(colon - value));
    for (int s = 0; s < QW_STAGE_COUNT; s++)
        if (same_text(name, stage_names[s], true) && colon[1]) {
            p->out->dump[s] = colon + 1;
            return QW_OK;
        }
    return refuse(
        p, QW_ARGUMENT,
        "--dump-stage needs STAGE:FILE with a stage such as orientation or quads (see quadwright help), not \"%.60s\"",
        value);
}

static qw_status parse_whole(parser *p, const char *name, const char *value, int64_t least, int64_t most,
                             int64_t *number)
{
    char *end;
    long long v = strtoll(value, &end, 10);
    if (end == value || *end || v < least || v > most)
        return refuse(p, QW_ARGUMENT, "--%s must be a whole number from %lld to %lld, not \"%.40s\"", name,
                      (long long)least, (long long)most, value);
    *number = v;
    return QW_OK;
}

static qw_status set_input(parser *p, const char *value)
{
    qw_arguments *out = p->out;
    if (out->input && out->command == QW_COMMAND_RENDER && out->beside_count < QW_MOST_PANELS - 1) {
        out->beside[out->beside_count++] = value;
        return QW_OK;
    }
    if (out->input && out->command == QW_COMMAND_RENDER)
        return refuse(p, QW_ARGUMENT, "a picture holds at most %d meshes", QW_MOST_PANELS);
    if (out->input) return refuse(p, QW_ARGUMENT, "two inputs were named: %.80s and %.80s", out->input, value);
    out->input = value;
    return QW_OK;
}

/* ---- options of the library */

/* A plane in one word, NX,NY,NZ,OFFSET: five options of the library. */
static qw_status set_plane(parser *p, const char *value)
{
    static const char *const parts[] = {"symmetry_x", "symmetry_y", "symmetry_z", "symmetry_offset"};
    qw_options *o = &p->out->options;
    for (int i = 0; i < 4; i++) {
        char number[64];
        size_t length = strcspn(value, ",");
        if (length >= sizeof number || (value[length] == ',') != (i < 3))
            return refuse(p, QW_OPTION, "a plane of symmetry is four numbers, NX,NY,NZ,OFFSET");
        memcpy(number, value, length), number[length] = 0;
        if (qw_option_set(o, parts[i], number, p->message, p->message_size) != QW_OK) return QW_OPTION;
        value += length + (i < 3);
    }
    if (o->symmetry_x == 0 && o->symmetry_y == 0 && o->symmetry_z == 0)
        return refuse(p, QW_OPTION, "the normal of the plane of symmetry is 0,0,0");
    return qw_option_set(o, "symmetry", "plane", p->message, p->message_size);
}

/* In the library a target of zero means "not asked for"; said aloud it is a mistake. */
static qw_status set_option(parser *p, const char *name, const char *value)
{
    if (strcmp(name, "symmetry") == 0 && strchr(value, ',')) return set_plane(p, value);
    qw_status status = qw_option_set(&p->out->options, name, value, p->message, p->message_size);
    if (status != QW_OK) return status;
    static const char *const targets[] = {"faces", "vertices", "edge_length", "ratio"};
    for (int i = 0; i < 4; i++) {
        char now[64] = "";
        qw_option_get(&p->out->options, targets[i], now, sizeof now);
        if (strcmp(now, "0") != 0) continue;
        bool this_one = true;
        for (size_t k = 0; targets[i][k] || name[k]; k++)
            if (targets[i][k] != (name[k] == '-' ? '_' : name[k])) {
                this_one = false;
                break;
            }
        if (!this_one) continue;
        if (i < 2)
            return refuse(p, QW_OPTION, "option %s must be a whole number from 1 to 20000000, not 0", targets[i]);
        return refuse(p, QW_OPTION, "option %s must be above 0", targets[i]);
    }
    return QW_OK;
}

static const qw_option_info *option_named(const char *name)
{
    for (size_t i = 0; i < qw_option_count(); i++) {
        const char *a = qw_option_at(i)->name, *b = name;
        while (*a && (*a == *b || (*a == '_' && *b == '-'))) a++, b++;
        if (*a == *b) return qw_option_at(i);
    }
    return NULL;
}

static const char *following(parser *p, char *inline_value)
{
    if (inline_value) return inline_value;
    return p->next < p->argc ? p->argv[p->next++] : NULL;
}

static qw_status take_option(parser *p, const char *name, char *inline_value)
{
    const qw_option_info *info = option_named(name);
    if (!info && strncmp(name, "no-", 3) == 0 && !inline_value) {
        info = option_named(name + 3);
        if (info && info->kind == QW_KIND_FLAG) return set_option(p, info->name, "off");
        info = NULL;
    }
    if (!info) {
        qw_status status = set_option(p, name, "");
        return status == QW_OK ? refuse(p, QW_OPTION, "unknown option \"%.40s\"", name) : status;
    }
    if (info->kind == QW_KIND_FLAG && !inline_value) return set_option(p, info->name, "on");
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

static qw_status parse_field_per(parser *p, const char *value)
{
    bool face = same_text(value, "face", true);
    if (!face && !same_text(value, "vertex", true))
        return refuse(p, QW_ARGUMENT, "--field-per must be vertex or face, not \"%.40s\"", value);
    p->out->field_per = face ? QW_PER_FACE : QW_PER_VERTEX;
    return QW_OK;
}

static qw_status parse_normals(parser *p, const char *value)
{
    static const char *const names[] = {"input", "none", "smooth", "split"}; /* as qw_normals has them */
    for (int i = 0; i < 4; i++)
        if (same_text(value, names[i], true)) {
            p->out->normals = (qw_normals)i;
            return QW_OK;
        }
    return refuse(p, QW_ARGUMENT, "--normals must be input, none, smooth or split, not \"%.40s\"", value);
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

static qw_status apply(parser *p, const switch_row *row, const char *value)
{
    qw_arguments *out = p->out;
    switch (row->id) {
    case SWITCH_HELP: out->command = QW_COMMAND_HELP; break;
    case SWITCH_VERSION: out->version = true; break;
    case SWITCH_INPUT: return set_input(p, value);
    case SWITCH_OUTPUT: out->output = value; break;
    case SWITCH_FORMAT: return parse_format(p, value);
    case SWITCH_JSON: out->json = value ? value : "-"; break;
    case SWITCH_PROVENANCE: out->provenance = value; break;
    case SWITCH_KEEP: return parse_keep(p, value);
    case SWITCH_DENSITY: out->density = value; break;
    case SWITCH_FIELD_IN: out->field_in = value; break;
    case SWITCH_FIELD_OUT: out->field_out = value; break;
    case SWITCH_FIELD_PER: return parse_field_per(p, value);
    case SWITCH_GUIDES: out->guides = value; break;
    case SWITCH_REGION: out->region = value; break;
    case SWITCH_NO_ATTRIBUTES: out->bare = true; break;
    case SWITCH_NORMALS: return parse_normals(p, value);
    case SWITCH_AGAINST: out->against = value; break;
    case SWITCH_QUIET: out->quiet = true; break;
    case SWITCH_VERBOSE: out->verbose = true; break;
    case SWITCH_DUMP_STAGE: return parse_dump(p, value);
    case SWITCH_FROM_STAGE: out->from_stage = value; break;
    case SWITCH_WIDTH: return parse_whole(p, row->name, value, 16, 16384, &out->width);
    case SWITCH_HEIGHT: return parse_whole(p, row->name, value, 16, 16384, &out->height);
    case SWITCH_VIEWS: return parse_whole(p, row->name, value, 1, 6, &out->views);
    case SWITCH_COLOR:
        if (!same_text(value, "follow", true))
            return refuse(p, QW_ARGUMENT, "--color must be follow, not \"%.40s\"", value);
        out->follow = true;
        break;
    case SWITCH_LINES: out->lines = true; break;
    case SWITCH_CHORD: return parse_whole(p, row->name, value, 1, INT32_MAX, &out->chord);
    case SWITCH_AZIMUTH: return parse_whole(p, row->name, value, -360, 360, &out->azimuth);
    case SWITCH_ELEVATION: return parse_whole(p, row->name, value, -90, 90, &out->elevation);
    case SWITCH_SHARP: return parse_sharp(p, value);
    case SWITCH_MEMORY_LIMIT: return parse_whole(p, row->name, value, 1, 1000000, &out->memory_limit);
    case SWITCH_TIME_LIMIT: return parse_whole(p, row->name, value, 1, 1000000, &out->time_limit);
    case SWITCH_JOBS: return parse_whole(p, row->name, value, 1, 256, &out->jobs);
    case SWITCH_SHARD: return parse_shard(p, value);
    case SWITCH_RETRY: out->retry = true; break;
    case SWITCH_FORCE: out->force = true; break;
    case SWITCH_PRESET: return set_option(p, row->option, row->preset ? row->preset : value);
    }
    return QW_OK;
}

static const switch_row *switch_named(const parser *p, const char *name, bool two_dashes)
{
    for (int i = 0; i < SWITCH_COUNT; i++) {
        const char *own = two_dashes ? switches[i].name : switches[i].alias;
        if (own && strcmp(own, name) == 0 && (switches[i].commands & 1 << p->out->command)) return &switches[i];
    }
    return NULL;
}

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

    const switch_row *row = switch_named(p, name, two_dashes);
    if (!row && two_dashes && (1 << p->out->command & (REMESH | BATCH))) return take_option(p, name, inline_value);
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
    static const char *const names[] = {"remesh", "measure", "render", "batch", "options", "help"};
    *found = true;
    for (int i = 0; i < 6; i++)
        if (strcmp(word, names[i]) == 0) return (qw_command)i;
    *found = false;
    return QW_COMMAND_REMESH;
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n > m && same_text(text + n - m, end, true);
}

static qw_status settle_format(parser *p)
{
    qw_arguments *a = p->out;
    if (!a->output || a->format != QW_FORMAT_AUTO) return QW_OK;
    a->format = QW_FORMAT_OBJ;
    if (strcmp(a->output, "-") == 0 || ends_with(a->output, ".obj")) return QW_OK;
    if (ends_with(a->output, ".ply")) a->format = QW_FORMAT_PLY;
    else if (ends_with(a->output, ".off")) a->format = QW_FORMAT_OFF;
    else if (ends_with(a->output, ".glb")) a->format = QW_FORMAT_GLB;
    else if (ends_with(a->output, ".gltf")) a->format = QW_FORMAT_GLTF;
    else
        return refuse(p, QW_FORMAT_UNKNOWN,
                      "the ending of %.200s names no format that can be written; use .obj, .ply, .off, .glb or .gltf, "
                      "or --format",
                      a->output);
    return QW_OK;
}

/* What a format has no place for is refused rather than left out. */
static qw_status check_normals(parser *p)
{
    const qw_arguments *a = p->out;
    qw_status status = settle_format(p);
    if (status != QW_OK || !a->output || a->normals < QW_NORMALS_SMOOTH) return status;
    if (a->format == QW_FORMAT_OFF) return refuse(p, QW_ARGUMENT, "--normals: OFF holds none; use OBJ, PLY or GLB");
    if (a->format == QW_FORMAT_PLY && a->normals == QW_NORMALS_SPLIT)
        return refuse(p, QW_ARGUMENT, "--normals split: PLY holds one normal a vertex; use smooth, or OBJ or GLB");
    return QW_OK;
}

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
    if (a->field_out && !a->output)
        return refuse(p, QW_ARGUMENT, "--field-out tells the field of a result: -o FILE is required");
    if (!a->from_stage && !a->input) return refuse(p, QW_ARGUMENT, "no input was named; quadwright help says how");
    if (!a->output && a->input && strcmp(a->input, "-") == 0 && !dumps) a->output = "-";
    if (!a->output && !dumps) return refuse(p, QW_ARGUMENT, "no output was named: -o FILE is required");
    if (a->json && a->output && strcmp(a->json, "-") == 0 && strcmp(a->output, "-") == 0)
        return refuse(p, QW_ARGUMENT, "the mesh and the report cannot both go to standard output");
    if (qw_options_validate(&a->options, p->message, p->message_size) != QW_OK) return QW_OPTION;
    return check_normals(p);
}

static qw_status check(parser *p)
{
    qw_arguments *a = p->out;
    if (a->version) return QW_OK;
    switch (a->command) {
    case QW_COMMAND_REMESH: return check_remesh(p);
    case QW_COMMAND_BATCH:
        if (a->format == QW_FORMAT_AUTO) a->format = QW_FORMAT_OBJ;
        if (!a->input) return refuse(p, QW_ARGUMENT, "no folder and no list of models was named");
        if (!a->output) return refuse(p, QW_ARGUMENT, "no folder was named for the results: --out FOLDER is required");
        return qw_options_validate(&a->options, p->message, p->message_size) == QW_OK ? QW_OK : QW_OPTION;
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

qw_status qw_parse_arguments(int argc, char **argv, qw_arguments *arguments, char *message, size_t message_size)
{
    *arguments = (qw_arguments){
        .command = QW_COMMAND_REMESH, .field_per = QW_PER_FACE, .azimuth = QW_UNSET_ANGLE, .elevation = QW_UNSET_ANGLE};
    qw_options_init(&arguments->options);
    message[0] = 0;
    parser p = {
        .out = arguments, .argc = argc, .next = 1, .argv = argv, .message = message, .message_size = message_size};
    bool named = false, only_files = false;
    if (argc > 1) arguments->command = command_named(argv[1], &named);
    if (named) p.next = 2;
    while (p.next < argc) {
        const char *word = argv[p.next++];
        qw_status status = QW_OK;
        if (!only_files && strcmp(word, "--") == 0) only_files = true;
        else if (only_files || word[0] != '-' || !word[1]) status = set_input(&p, word);
        else status = take_switch(&p, word);
        if (status != QW_OK) return status;
        if (arguments->command == QW_COMMAND_HELP || arguments->command == QW_COMMAND_OPTIONS) return QW_OK;
    }
    return check(&p);
}

/* ---- manual */

enum { HELP_INDENT = 10, HELP_WIDTH = 100 };

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

static void put_dashed(FILE *file, const char *name)
{
    for (; *name; name++) fputc(*name == '_' ? '-' : *name, file);
}

static void put_option(FILE *file, const qw_option_info *info)
{
    qw_options defaults;
    char initial[64] = "";
    qw_options_init(&defaults);
    qw_option_get(&defaults, info->name, initial, sizeof initial);
    fputs(info->kind == QW_KIND_FLAG ? "  --[no-]" : "  --", file);
    put_dashed(file, info->name);
    if (info->kind == QW_KIND_CHOICE) fprintf(file, " %s", info->choices);
    if (info->kind == QW_KIND_COUNT || info->kind == QW_KIND_REAL) {
        fputs(info->kind == QW_KIND_COUNT ? " N" : " X", file);
        fprintf(file, "  (%.15g to %.15g", info->least, info->most);
        fprintf(file, strcmp(info->unit, "-") ? " %s)" : ")", info->unit);
    }
    fprintf(file, "  [%s]\n", initial);
    put_wrapped(file, info->help);
}

static void put_switches(FILE *file, bool presets)
{
    for (int i = 0; i < SWITCH_COUNT; i++) {
        const switch_row *row = &switches[i];
        if ((row->id == SWITCH_PRESET) != presets) continue;
        fputs("  ", file);
        if (row->alias) fprintf(file, "-%s%s", row->alias, row->name ? ", " : "");
        if (row->name) fprintf(file, "--%s", row->name);
        fprintf(file, "%s%s\n", row->value ? " " : "", row->value ? row->value : "");
        put_wrapped(file, row->help);
    }
}

static void put_stages(FILE *file)
{
    for (int s = 0; s < QW_STAGE_COUNT; s++) {
        char name[32];
        size_t n = strlen(stage_names[s]);
        for (size_t k = 0; k <= n; k++) name[k] = lower(stage_names[s][k]);
        fprintf(file, "  %-12s  %s\n", name, qw_stage_title((qw_stage)s));
    }
}

void qw_print_help(FILE *file)
{
    fprintf(file, "quadwright %s: any triangle surface in, a clean all-quad mesh out\n\n", qw_version());
    fputs("USAGE\n"
          "  quadwright IN -o OUT [--faces N] [OPTIONS]            make quads of a surface\n"
          "  quadwright measure MESH [--against SURFACE] [--json]  every figure of a mesh\n"
          "  quadwright render MESH... -o PICTURE.png              a sheet of views of one mesh, or of several side by "
          "side\n"
          "  quadwright batch FOLDER|LIST|- --out FOLDER           many models, a process each; goes on where it was "
          "ended\n"
          "  quadwright options                                    the options as a tab-separated table\n"
          "  quadwright help                                       this text\n\n"
          "  Reads OBJ, PLY, OFF, STL, GLB and glTF, judged by their contents. Writes OBJ, PLY, OFF, GLB and glTF, "
          "whole or\n"
          "  not at all.\n"
          "  Without a target the result has a quarter as many quads as the input has triangles, from 100 to 20000.\n\n"
          "SWITCHES\n",
          file);
    put_switches(file, false);
    fputs("\nOPTIONS (bounds) [default]\n", file);
    for (size_t i = 0; i < qw_option_count(); i++) put_option(file, qw_option_at(i));
    fputs("\nQUADRIFLOW'S FLAGS\n  -i and -o as above, and\n", file);
    put_switches(file, true);
    fputs("\nSTAGES, for --dump-stage\n", file);
    put_stages(file);
    fputs("\nEXIT STATUS\n", file);
    for (int s = 0; s < QW_STATUS_COUNT; s++)
        fprintf(file, "  %2d  %-18s %s\n", qw_status_exit_code((qw_status)s), qw_status_name((qw_status)s),
                qw_status_text((qw_status)s));
    fputs("   1  (batch)            some models failed; the report says which\n", file);
    fputs("\nEXAMPLES\n"
          "  quadwright bunny.obj -o quads.obj --faces 5000\n"
          "  quadwright scan.ply -o quads.ply --edge-length 0.01 --json report.json\n"
          "  cat part.stl | quadwright - --ratio 0.5 > quads.obj\n"
          "  quadwright bunny.obj --dump-stage orientation:field.qws\n"
          "  quadwright --from-stage field.qws -o quads.obj --flow ilp\n"
          "  quadwright batch models/ --out quads/ --faces 4000 --time-limit 600\n",
          file);
}

void qw_print_options(FILE *file)
{
    static const char *const kinds[] = {"count", "real", "flag", "choice"};
    qw_options defaults;
    qw_options_init(&defaults);
    fputs("name\tkind\tdefault\tleast\tmost\tunit\tchoices\thelp\n", file);
    for (size_t i = 0; i < qw_option_count(); i++) {
        const qw_option_info *info = qw_option_at(i);
        char initial[64] = "";
        qw_option_get(&defaults, info->name, initial, sizeof initial);
        fprintf(file, "%s\t%s\t%s\t%.15g\t%.15g\t%s\t%s\t%s\n", info->name, kinds[info->kind], initial, info->least,
                info->most, info->unit, info->choices ? info->choices : "", info->help);
    }
}
