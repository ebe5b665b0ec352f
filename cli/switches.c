#include "switches.h"

#include "base/near.h"

#include <stddef.h>
#include <string.h>

enum command_set {
    REMESH = 1 << QW_COMMAND_REMESH | 1 << QW_COMMAND_ASSET,
    MEASURE = 1 << QW_COMMAND_MEASURE,
    RENDER = 1 << QW_COMMAND_RENDER,
    BATCH = 1 << QW_COMMAND_BATCH,
    ALL = REMESH | MEASURE | RENDER | BATCH
};

#define AT(of_arguments)               .member = offsetof(qw_arguments, of_arguments)
#define NUMBER(of_arguments, from, to) AT(of_arguments), .least = from, .most = to
static const qw_switch_row switches[] = {
    {SWITCH_INPUT, ALL, "input", "i", "FILE",
     .help = "the mesh to read; the same as naming it without a switch; - is standard input"},
    {SWITCH_TEXT, REMESH | RENDER, "output", "o", "FILE",
     .help = "where the result goes; - is standard output, the default when the input is -; the ending names the "
             "format: .obj, "
             ".ply, .off, .stl (quads in two), .glb, .gltf, or for simulation .msh, .vtu, .inp or .bdf (render: .png)",
     AT(output)},
    {SWITCH_TEXT, BATCH, "out", "o", "FOLDER", .help = "batch: where quads, records and the report go", AT(output)},
    {SWITCH_WHOLE, BATCH, "jobs", "j", "N",
     .help = "batch: processes at a time, 1 to 256; one a processor unless given", NUMBER(jobs, 1, 256)},
    {SWITCH_SHARD, BATCH, "shard", NULL, "I/N",
     .help = "batch: only part I, from 0, of N of the models, by a hash of their names"},
    {SWITCH_FLAG, BATCH, "retry", NULL, NULL, .help = "batch: do again what failed before, not only what was killed",
     AT(retry)},
    {SWITCH_FLAG, REMESH, "force", NULL, NULL,
     .help = "let -o name the input itself, which is then replaced by its quads; refused without", AT(force)},
    {SWITCH_FLAG, BATCH, "force", NULL, NULL,
     .help = "batch: replace results in the folder that were made with other options; refused without", AT(force)},
    {SWITCH_FORMAT, REMESH | BATCH, "format", NULL, "obj|ply|off|stl|glb|gltf|msh|vtu|inp|bdf",
     .help = "format of the result, whatever its name"},
    {SWITCH_JSON, REMESH, "json", NULL, "FILE", .help = "write the whole report there; - is standard output"},
    {SWITCH_JSON, MEASURE, "json", NULL, NULL, .help = "measure: print the figures as JSON"},
    {SWITCH_TEXT, REMESH, "provenance", NULL, "FILE",
     .help = "write there where each vertex and corner of the result lies on the input: as JSON where the name ends in "
             ".json, "
             "else binary; docs/attributes.md",
     AT(provenance)},
    {SWITCH_KEEP, REMESH | BATCH, "keep", NULL, "seams,materials,groups,objects,NAME",
     .help = "edges of the result follow the seams of the texture, the borders of materials, groups or objects, or "
             "those of "
             "any attribute by its name, such as a face property of PLY, as they do sharp edges: any of these"},
    {SWITCH_TEXT, REMESH | BATCH, "density", NULL, "FILE|PROPERTY",
     .help =
         "how small the quads are to be where: a vertex property of the mesh (PLY), \"color\" for the grey of vertex "
         "colours (black 1, white 8), or a text file of one number for each vertex; edges are half as long where it is "
         "2 "
         "as where it is 1, and the number of quads stays",
     AT(density)},
    {SWITCH_TEXT, REMESH, "field-in", NULL, "FILE",
     .help =
         "a cross field that the quads follow instead of one of their own: a direction a vertex or a face of the input "
         "(.rosy); docs/steering.md",
     AT(field_in)},
    {SWITCH_TEXT, REMESH, "field-out", NULL, "FILE",
     .help = "write there the cross field that the quads follow, as --field-in reads it", AT(field_out)},
    {SWITCH_FIELD_PER, REMESH, "field-per", NULL, "vertex|face",
     .help = "what the directions of --field-out belong to; face unless given"},
    {SWITCH_TEXT, REMESH, "guides", NULL, "FILE",
     .help = "lines on the surface (OBJ v and l) on which edges of the result lie, or, in a group or object called "
             "direction, "
             "along which the quads run, or, in one called rings 6, closed loops with six rings of quads on each side; "
             "docs/steering.md",
     AT(guides)},
    {SWITCH_TEXT, REMESH, "region", NULL, "LABEL",
     .help = "make quads of the faces of this group, material or object only (OBJ, GLB), or of a face property (PLY: "
             "part=3), "
             "and join them to the rest, which stays as it is; docs/steering.md",
     AT(region)},
    {SWITCH_FLAG, REMESH | BATCH, "unwrap", NULL, NULL,
     .help =
         "texture coordinates of the result's own, instead of those of the input: few charts, packed (OBJ, PLY, GLB, "
         "glTF); docs/asset.md",
     AT(unwrap)},
    {SWITCH_BAKE, REMESH | BATCH, "bake", NULL, "input|all|color,normal,orm,emission,occlusion,height",
     .help = "maps of what the input looks like, on texture coordinates of the result's own (GLB, glTF; OBJ with an "
             "MTL and "
             "PNG files beside it): any of these, or as for the command asset normals and what the input's materials, "
             "textures "
             "and colours have"},
    {SWITCH_FLAG, REMESH | BATCH, "no-attributes", NULL, NULL,
     .help = "leave texture coordinates, normals, colours, materials, groups and other attributes of the input behind",
     AT(bare)},
    {SWITCH_NORMALS, REMESH, "normals", NULL, "input|none|smooth|split",
     .help =
         "normals of the result: those of the input where it has some, as without this switch; none; or those of the "
         "quads, smooth or split by the sharp edges that were kept (OBJ, GLB and glTF; PLY: smooth)"},
    {SWITCH_TEXT, MEASURE | RENDER, "against", NULL, "FILE",
     .help =
         "the surface that the mesh should follow; measure: for distances and angles to the shape; render: for --color "
         "follow",
     AT(against)},
    {SWITCH_FLAG, MEASURE, "visible", NULL, NULL,
     .help = "measure: against the part of the surface that is seen from outside only, through gaps wider than 1/200 "
             "of its "
             "diagonal; see --wrap",
     AT(visible)},
    {SWITCH_FLAG, MEASURE | RENDER, "limit", NULL, NULL,
     .help =
         "the surface that Catmull and Clark's subdivision makes of the quads, split four times, instead of the quads "
         "(render: of the first mesh), with the creases and corners that an OBJ file names in tags (t crease, t "
         "corner)",
     AT(limit)},
    {SWITCH_LEVELS, REMESH | BATCH, "levels", NULL, "N,N,...",
     .help = "several meshes of the surface, of so many quads each, the most first: GLB and glTF hold them all, a node "
             "each "
             "(MSFT_lod), with the materials and textures of a glTF input; for other formats, and for reports, _LOD0, "
             "_LOD1, "
             "... come before the ending of the names (batch: GLB and glTF only, GLB unless --format says so)"},
    {SWITCH_SECOND_ORDER, REMESH, "second-order", NULL, NULL,
     .help = "elements of second order, with eight nodes, those of their sides on the surface: for .msh, .vtu, .inp "
             "and .bdf"},
    {SWITCH_PATCHES, REMESH, "patches", NULL, "FILE",
     .help = "write there the limit surface as STEP (AP214): a bicubic patch a quad, joined into one shell, a solid "
             "where it "
             "is closed; implies --fit limit"},
    {SWITCH_PATCHES_FROM, REMESH, "patches-from", NULL, "quads|blocks",
     .help =
         "with --patches: a patch a quad, or few large ones: one for each block of quads between the lines that leave "
         "irregular vertices straight on, or for all that hang together on one plane, cylinder or cone of the part; a "
         "note "
         "says how many there are"},
    {SWITCH_TEXT, REMESH, "coarse", NULL, "FILE",
     .help = "write there the quads that --subdivide has split: level 0 of the result", AT(coarse)},
    {SWITCH_WHOLE, RENDER, "width", NULL, "N", .help = "render: pixels across, 16 to 16384; 1600 unless given",
     AT(width), 16, 16384},
    {SWITCH_WHOLE, RENDER, "height", NULL, "N", .help = "render: pixels down, 16 to 16384; 1200 unless given",
     AT(height), 16, 16384},
    {SWITCH_WHOLE, RENDER, "views", NULL, "N",
     .help = "render: 1, 2, 4 or 6 views of each mesh; unless given 4 of a single one, 1 of each of several",
     NUMBER(views, 1, 6)},
    {SWITCH_COLOR, RENDER, "color", NULL, "follow|own",
     .help =
         "render: follow colours quads by the angle between their edges and the principal directions of the surface "
         "named "
         "by --against, from blue (0 degrees) to red (45), where these are clear; own shows the colours of the mesh's "
         "vertices, or where it has none a colour for each material, group or other label of its faces"},
    {SWITCH_FLAG, RENDER, "lines", NULL, NULL,
     .help =
         "render: draw the lines that leave irregular vertices straight on; they cut the quads into the patches that "
         "measure counts",
     AT(lines)},
    {SWITCH_FLAG, RENDER, "closed", NULL, NULL,
     .help = "render: draw the rings: loops of edges that go straight on, close and pass no vertex twice", AT(closed)},
    {SWITCH_WHOLE, RENDER, "chord", NULL, "N",
     .help = "render: colour one strip of quads, side by side; 1 is the worst: the longest of those that cross "
             "themselves, in "
             "red where it does, or of all if none does",
     NUMBER(chord, 1, INT32_MAX)},
    {SWITCH_WHOLE, RENDER, "azimuth", NULL, "N",
     .help = "render: degrees by which the first view is to the right of the front (+z)", NUMBER(azimuth, -360, 360)},
    {SWITCH_WHOLE, RENDER, "elevation", NULL, "N", .help = "render: degrees by which the first view is from above (+y)",
     NUMBER(elevation, -90, 90)},
    {SWITCH_DUMP_STAGE, REMESH, "dump-stage", NULL, "STAGE:FILE",
     .help = "write the state after a stage; without -o the run ends there; may be given for several stages"},
    {SWITCH_TEXT, REMESH, "from-stage", NULL, "FILE",
     .help = "go on from a state that --dump-stage wrote, instead of reading a mesh", AT(from_stage)},
    {SWITCH_TEXT, REMESH | BATCH, "preset", NULL, "NAME",
     .help =
         "options that suit a kind of surface: scan, character, cad, game, print or soup (quadwright help presets); "
         "options that are given beside it win",
     AT(preset)},
    {SWITCH_SHARP, REMESH | BATCH, "sharp", NULL, "auto|none|marks|ANGLE",
     .help =
         "which edges are sharp: those found by a suitable angle, none, those that the input marks, or those above an "
         "angle in degrees"},
    {SWITCH_MEMORY_LIMIT, REMESH | BATCH, "memory-limit", NULL, "SIZE",
     .help = "fail, with nothing written, rather than hold more memory than that: 512M, 4G; without a unit megabytes, "
             "with a "
             "notice"},
    {SWITCH_WHOLE, REMESH | BATCH, "time-limit", NULL, "SECONDS",
     .help =
         "fail, with nothing written, rather than take longer than that after reading (batch: for one model, reading "
         "included); 1 to 1000000; never changes a result that is in time",
     NUMBER(time_limit, 1, 1000000)},
    {SWITCH_FLAG, ALL, "quiet", "q", NULL, .help = "no progress and no summary; errors are still said", AT(quiet)},
    {SWITCH_FLAG, REMESH, "verbose", "v", NULL, .help = "say everything that the stages log", AT(verbose)},
    {SWITCH_HELP, ALL, "help", "h", NULL, .help = "the most used options, or what a command takes"},
    {SWITCH_FLAG, ALL, "version", "V", NULL, .help = "the version", AT(version)},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "f", "N", .help = "--faces N", .option = "faces"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "sharp", NULL, .help = "--sharp-angle -1", .option = "sharp_angle",
     .fixed = "-1"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "boundary", NULL, .help = "--align-boundary", .option = "align_boundary",
     .fixed = "on"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "adaptive", NULL, .help = "--adaptive 1", .option = "adaptive",
     .fixed = "1"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "mcf", NULL, .help = "--flow mcf", .option = "flow", .fixed = "mcf"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "sat", NULL, .help = "--sat", .option = "sat", .fixed = "on"},
    {SWITCH_STANDS_FOR, REMESH | BATCH, NULL, "seed", "N", .help = "--seed N", .option = "seed"},
};
#undef AT
#undef NUMBER

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
