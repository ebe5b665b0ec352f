#include "switches.h"

#include "base/near.h"

#include <string.h>

enum command_set {
    REMESH = 1 << QW_COMMAND_REMESH | 1 << QW_COMMAND_ASSET,
    MEASURE = 1 << QW_COMMAND_MEASURE,
    RENDER = 1 << QW_COMMAND_RENDER,
    BATCH = 1 << QW_COMMAND_BATCH,
    ALL = REMESH | MEASURE | RENDER | BATCH
};

static const qw_switch_row switches[] = {
    {SWITCH_INPUT, ALL, "input", "i", "FILE", NULL, NULL,
     "the mesh to read; the same as naming it without a switch; - is standard input"},
    {SWITCH_OUTPUT, REMESH | RENDER, "output", "o", "FILE", NULL, NULL,
     "where the result goes; - is standard output, the default when the input is -; the ending names the format: .obj, "
     ".ply, .off, .stl (quads in two), .glb, .gltf, or for simulation .msh, .vtu, .inp or .bdf "
     "(render: .png)"},
    {SWITCH_OUTPUT, BATCH, "out", "o", "FOLDER", NULL, NULL, "batch: where quads, records and the report go"},
    {SWITCH_JOBS, BATCH, "jobs", "j", "N", NULL, NULL,
     "batch: processes at a time, 1 to 256; one a processor unless given"},
    {SWITCH_SHARD, BATCH, "shard", NULL, "I/N", NULL, NULL,
     "batch: only part I, from 0, of N of the models, by a hash of their names"},
    {SWITCH_RETRY, BATCH, "retry", NULL, NULL, NULL, NULL,
     "batch: do again what failed before, not only what was killed"},
    {SWITCH_FORCE, REMESH, "force", NULL, NULL, NULL, NULL,
     "let -o name the input itself, which is then replaced by its quads; refused without"},
    {SWITCH_FORCE, BATCH, "force", NULL, NULL, NULL, NULL,
     "batch: replace results in the folder that were made with other options; refused without"},
    {SWITCH_FORMAT, REMESH | BATCH, "format", NULL, "obj|ply|off|stl|glb|gltf|msh|vtu|inp|bdf", NULL, NULL,
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
     "along which the quads run, or, in one called rings 6, closed loops with six rings of quads on each side; "
     "docs/steering.md"},
    {SWITCH_REGION, REMESH, "region", NULL, "LABEL", NULL, NULL,
     "make quads of the faces of this group, material or object only (OBJ, GLB), or of a face property (PLY: part=3), "
     "and "
     "join "
     "them to the rest, which stays as it is; docs/steering.md"},
    {SWITCH_UNWRAP, REMESH | BATCH, "unwrap", NULL, NULL, NULL, NULL,
     "texture coordinates of the result's own, instead of those of the input: few charts, packed (OBJ, PLY, GLB, "
     "glTF); "
     "docs/asset.md"},
    {SWITCH_BAKE, REMESH | BATCH, "bake", NULL, "input|all|color,normal,orm,emission,occlusion,height", NULL, NULL,
     "maps of what the input looks like, on texture coordinates of the result's own (GLB, glTF; OBJ with an MTL and "
     "PNG "
     "files beside it): any of these, or as for the command asset normals and what the input's materials, textures and "
     "colours have"},
    {SWITCH_NO_ATTRIBUTES, REMESH | BATCH, "no-attributes", NULL, NULL, NULL, NULL,
     "leave texture coordinates, normals, colours, materials, groups and other attributes of the input behind"},
    {SWITCH_NORMALS, REMESH, "normals", NULL, "input|none|smooth|split", NULL, NULL,
     "normals of the result: those of the input where it has some, as without this switch; none; or those of the "
     "quads, "
     "smooth or split by the sharp edges that were kept (OBJ, GLB and glTF; PLY: smooth)"},
    {SWITCH_AGAINST, MEASURE | RENDER, "against", NULL, "FILE", NULL, NULL,
     "the surface that the mesh should follow; measure: for distances and angles to the shape; render: for --color "
     "follow"},
    {SWITCH_VISIBLE, MEASURE, "visible", NULL, NULL, NULL, NULL,
     "measure: against the part of the surface that is seen from outside only, through gaps wider than 1/200 of its "
     "diagonal; see --wrap"},
    {SWITCH_LIMIT, MEASURE | RENDER, "limit", NULL, NULL, NULL, NULL,
     "the surface that Catmull and Clark's subdivision makes of the quads, split four times, instead of the quads "
     "(render: of the first mesh), with the creases and corners that an OBJ file names in tags (t crease, t corner)"},
    {SWITCH_LEVELS, REMESH | BATCH, "levels", NULL, "N,N,...", NULL, NULL,
     "several meshes of the surface, of so many quads each, the most first: GLB and glTF hold them all, a node each "
     "(MSFT_lod), with the materials and textures of a glTF input; for other formats, and for reports, _LOD0, _LOD1, "
     "... come before the ending of the names (batch: GLB and glTF only, GLB unless --format says so)"},
    {SWITCH_SECOND_ORDER, REMESH, "second-order", NULL, NULL, NULL, NULL,
     "elements of second order, with eight nodes, those of their sides on the surface: for .msh, .vtu, .inp and .bdf"},
    {SWITCH_PATCHES, REMESH, "patches", NULL, "FILE", NULL, NULL,
     "write there the limit surface as STEP (AP214): a bicubic patch a quad, joined into one shell, a solid where it "
     "is "
     "closed; implies --fit limit"},
    {SWITCH_PATCHES_FROM, REMESH, "patches-from", NULL, "quads|blocks", NULL, NULL,
     "with --patches: a patch a quad, or few large ones: one for each block of quads between the lines that leave "
     "irregular vertices straight on, or for all that hang together on one plane, cylinder or cone of the part; a note "
     "says how many there are"},
    {SWITCH_COARSE, REMESH, "coarse", NULL, "FILE", NULL, NULL,
     "write there the quads that --subdivide has split: level 0 of the result"},
    {SWITCH_WIDTH, RENDER, "width", NULL, "N", NULL, NULL, "render: pixels across, 16 to 16384; 1600 unless given"},
    {SWITCH_HEIGHT, RENDER, "height", NULL, "N", NULL, NULL, "render: pixels down, 16 to 16384; 1200 unless given"},
    {SWITCH_VIEWS, RENDER, "views", NULL, "N", NULL, NULL,
     "render: 1, 2, 4 or 6 views of each mesh; unless given 4 of a single one, 1 of each of several"},
    {SWITCH_COLOR, RENDER, "color", NULL, "follow|own", NULL, NULL,
     "render: follow colours quads by the angle between their edges and the principal directions of the surface named "
     "by --against, from blue (0 degrees) to red (45), where these are clear; own shows the colours of the mesh's "
     "vertices, or where it has none a colour for each material, group or other label of its faces"},
    {SWITCH_LINES, RENDER, "lines", NULL, NULL, NULL, NULL,
     "render: draw the lines that leave irregular vertices straight on; they cut the quads into the patches that "
     "measure "
     "counts"},
    {SWITCH_CLOSED, RENDER, "closed", NULL, NULL, NULL, NULL,
     "render: draw the rings: loops of edges that go straight on, close and pass no vertex twice"},
    {SWITCH_CHORD, RENDER, "chord", NULL, "N", NULL, NULL,
     "render: colour one strip of quads, side by side; 1 is the worst: the longest of those that cross themselves, in "
     "red where it does, or "
     "of all if none does"},
    {SWITCH_AZIMUTH, RENDER, "azimuth", NULL, "N", NULL, NULL,
     "render: degrees by which the first view is to the right of the front (+z)"},
    {SWITCH_ELEVATION, RENDER, "elevation", NULL, "N", NULL, NULL,
     "render: degrees by which the first view is from above (+y)"},
    {SWITCH_DUMP_STAGE, REMESH, "dump-stage", NULL, "STAGE:FILE", NULL, NULL,
     "write the state after a stage; without -o the run ends there; may be given for several stages"},
    {SWITCH_FROM_STAGE, REMESH, "from-stage", NULL, "FILE", NULL, NULL,
     "go on from a state that --dump-stage wrote, instead of reading a mesh"},
    {SWITCH_PRESET, REMESH | BATCH, "preset", NULL, "NAME", NULL, NULL,
     "options that suit a kind of surface: scan, character, cad, game, print or soup (quadwright help presets); "
     "options that "
     "are given beside it win"},
    {SWITCH_SHARP, REMESH | BATCH, "sharp", NULL, "auto|none|marks|ANGLE", NULL, NULL,
     "which edges are sharp: those found by a suitable angle, none, those that the input marks, or those above an "
     "angle in degrees"},
    {SWITCH_MEMORY_LIMIT, REMESH | BATCH, "memory-limit", NULL, "SIZE", NULL, NULL,
     "fail, with nothing written, rather than hold more memory than that: 512M, 4G; without a unit megabytes, with a "
     "notice"},
    {SWITCH_TIME_LIMIT, REMESH | BATCH, "time-limit", NULL, "SECONDS", NULL, NULL,
     "fail, with nothing written, rather than take longer than that after reading (batch: for one model, reading "
     "included); 1 to 1000000; never changes a "
     "result that is in time"},
    {SWITCH_QUIET, ALL, "quiet", "q", NULL, NULL, NULL, "no progress and no summary; errors are still said"},
    {SWITCH_VERBOSE, REMESH, "verbose", "v", NULL, NULL, NULL, "say everything that the stages log"},
    {SWITCH_HELP, ALL, "help", "h", NULL, NULL, NULL, "the most used options, or what a command takes"},
    {SWITCH_VERSION, ALL, "version", "V", NULL, NULL, NULL, "the version"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "f", "N", "faces", NULL, "--faces N"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "sharp", NULL, "sharp_angle", "-1", "--sharp-angle -1"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "boundary", NULL, "align_boundary", "on", "--align-boundary"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "adaptive", NULL, "adaptive", "1", "--adaptive 1"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "mcf", NULL, "flow", "mcf", "--flow mcf"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "sat", NULL, "sat", "on", "--sat"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "seed", "N", "seed", NULL, "--seed N"},
};
const qw_switch_row *qw_switch_at(size_t index)
{
    return index < sizeof switches / sizeof *switches ? &switches[index] : NULL;
}

static const char *const command_names[QW_COMMAND_COUNT] = {"remesh", "asset",   "measure", "render",
                                                            "batch",  "options", "version", "help"};

const char *qw_command_name(qw_command command) { return command_names[command]; }

static const char *const stage_words[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) #name,
#include "quadwright/stages.def"
#undef QW_STAGE
};

const char *qw_stage_word(qw_stage stage, char word[QW_STAGE_WORD])
{
    size_t i = 0;
    for (const char *c = stage_words[stage]; *c && i < QW_STAGE_WORD - 1; c++, i++)
        word[i] = *c >= 'A' && *c <= 'Z' ? (char)(*c + 32) : *c;
    word[i] = 0;
    return word;
}

/* ---- names that are typed */

const char *qw_option_meant(const char *typed, unsigned *best)
{
    const char *found = NULL;
    const qw_switch_row *row;
    for (size_t i = 0; i < qw_option_count(); i++)
        if (qw_is_near(typed, qw_option_at(i)->name, best)) found = qw_option_at(i)->name;
    for (size_t i = 0; i < qw_asset_option_count(); i++)
        if (qw_is_near(typed, qw_asset_option_at(i)->name, best)) found = qw_asset_option_at(i)->name;
    for (size_t i = 0; (row = qw_switch_at(i)); i++)
        if (row->name && qw_is_near(typed, row->name, best)) found = row->name;
    return found;
}

bool qw_same_name(const char *a, const char *b)
{
    for (; *a && *b; a++, b++)
        if (*a != *b && !((*a == '-' || *a == '_') && (*b == '-' || *b == '_'))) return false;
    return *a == *b;
}
