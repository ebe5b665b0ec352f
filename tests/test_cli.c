/* The command line tool as a user meets it: exit codes, sentences, pipes, and nothing left behind by a run that fails.
 */
#define _POSIX_C_SOURCE 200809L
#include "suite.h"
#include "quadwright/quadwright.h"

#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#define FOLDER                                                                                                  \
    "." /* one of this process, which set_up goes to: two runs of these tests at once are none of one another's \
           business */
#define TOOL QW_BINARY_DIR "/quadwright "

/* Runs "quadwright ARGUMENTS" in a shell inside FOLDER; the texts of both streams are kept. */
typedef struct outcome {
    int code;
    char out[65536], err[8192];
} outcome;

static void slurp(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    if (!file) print_error("%s: cannot be read\n", path);
    size_t length = file ? fread(text, 1, size - 1, file) : 0;
    if (file) fclose(file);
    text[length] = 0;
}

static int shell(const char *command)
{
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static outcome *tool(const char *format, ...)
{
    static outcome result;
    char arguments[2048], command[4096];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    snprintf(command, sizeof command, "cd " FOLDER " && " TOOL "%s > stdout 2> stderr", arguments);
    result.code = shell(command);
    slurp(FOLDER "/stdout", result.out, sizeof result.out);
    slurp(FOLDER "/stderr", result.err, sizeof result.err);
    return &result;
}

static bool exists(const char *name)
{
    char path[512];
    snprintf(path, sizeof path, FOLDER "/%s", name);
    return access(path, F_OK) == 0;
}

/* Files in FOLDER whose names hold `part`: what a temporary file would leave. */
static bool any_like(const char *part)
{
    char command[512];
    snprintf(command, sizeof command, "ls " FOLDER " | grep -q '%s'", part);
    return shell(command) == 0;
}

static char own_folder[] = QW_BINARY_DIR "/test-cli-XXXXXX";

static int set_up(void **state)
{
    (void)state;
    if (!mkdtemp(own_folder) || chdir(own_folder) != 0) return -1;
    return shell("../quadwright-shapes bracket 3000 in.obj"
                 " && printf 'v 0 0 0\\nf 1 2 3\\n' > range.obj && : > empty.obj"
                 " && printf 'v 0 0 0\\nv 1 0 0\\nv 2 0 0\\nf 1 2 3\\n' > flat.obj"
                 " && printf 'v 0 0 0\\nv 1 0 0\\nv 1 1 0\\nv 0 1 0\\nf 1 2 3 4\\n' > sheet.obj");
}

static int tear_down(void **state)
{
    char command[512];
    (void)state;
    snprintf(command, sizeof command, "rm -rf '%s'", own_folder);
    return chdir(QW_BINARY_DIR) == 0 ? shell(command) : -1;
}

static void refused(const char *arguments, qw_status status, const char *says)
{
    outcome *o = tool("%s", arguments);
    if (o->code != qw_status_exit_code(status) || !strstr(o->err, says))
        print_error("%s: exit %d, said %s", arguments, o->code, o->err);
    assert_int_equal(o->code, qw_status_exit_code(status));
    assert_non_null(strstr(o->err, says));
    const char *last = strstr(o->err, "quadwright: "); /* one line, the last */
    assert_non_null(last);
    assert_ptr_equal(strchr(last, '\n') + 1, last + strlen(last));
    assert_string_equal(o->out, "");
    assert_false(any_like("^bad"));
}

static void bad_command_lines(void **state)
{
    (void)state;
    refused("", QW_ARGUMENT, "no input");
    refused("in.obj", QW_ARGUMENT, "-o FILE is required");
    refused("in.obj in.obj -o bad.obj", QW_ARGUMENT, "two inputs");
    refused("in.obj -o", QW_ARGUMENT, "needs a value");
    refused("in.obj -o bad.obj --no-such-thing 3", QW_OPTION, "no-such-thing");
    refused("in.obj -o bad.obj --face 3", QW_OPTION, "did you mean \"faces\"");
    refused("in.obj -o bad.obj -zz", QW_ARGUMENT, "-zz");
    refused("in.obj -o bad.obj --quiet=yes", QW_ARGUMENT, "takes no value");
    refused("in.obj -o bad.obj --format png", QW_ARGUMENT, "obj, ply, off, stl, glb, gltf, msh, vtu, inp or bdf");
    refused("in.obj -o bad.fbx", QW_FORMAT_UNKNOWN, ".obj, .ply, .off, .stl, .glb, .gltf, .msh, .vtu, .inp or .bdf");
    refused("in.obj -o bad", QW_FORMAT_UNKNOWN, ".obj, .ply, .off, .stl, .glb, .gltf, .msh, .vtu, .inp or .bdf");
    refused("in.obj sheet.obj", QW_ARGUMENT, "the result is named by -o: -o sheet.obj");
    refused("in.obj -o bad.obj --retry", QW_ARGUMENT, "belongs to the command batch");
    refused("in.obj -o bad.obj --views 2", QW_ARGUMENT, "belongs to the command render");
    refused("in.obj -o bad.stl --normals smooth", QW_ARGUMENT, "STL holds none");
    refused("in.obj --dump-stage nothing:bad", QW_ARGUMENT, "STAGE:FILE");
    refused("in.obj --dump-stage quads", QW_ARGUMENT, "STAGE:FILE");
    refused("in.obj --from-stage x -o bad.obj", QW_ARGUMENT, "--from-stage");
    refused("- -o - --json - < in.obj", QW_ARGUMENT, "standard output");
    refused("in.obj -o bad.obj --faces 9 --ratio 2", QW_OPTION, "only one of");
    refused("measure", QW_ARGUMENT, "no mesh");
    refused("measure in.obj --faces 4", QW_ARGUMENT, "--faces");
    refused("render in.obj", QW_ARGUMENT, "-o FILE.png");
    refused("render in.obj -o bad.jpg", QW_ARGUMENT, ".png");
    refused("render in.obj -o bad.png --width 5", QW_ARGUMENT, "from 16 to");
    refused("render in.obj -o bad.png --color follow", QW_ARGUMENT, "--against");
    refused("render in.obj -o bad.png --color blue", QW_ARGUMENT, "must be follow");
    refused("render in.obj -o bad.png --chord 0", QW_ARGUMENT, "from 1 to");
    refused("render in.obj -o bad.png --views 3", QW_ARGUMENT, "1, 2, 4 or 6");
}

static void absurd_targets(void **state)
{
    (void)state;
    refused("in.obj -o bad.obj --faces 0", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj -f 0", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj --faces=0", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj --vertices 0", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj --edge-length 0", QW_OPTION, "above 0");
    refused("in.obj -o bad.obj --ratio 0", QW_OPTION, "above 0");
    refused("in.obj -o bad.obj --faces -5", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj --faces 1e30", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj --faces many", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj --faces ''", QW_OPTION, "from 1 to 20000000");
    refused("in.obj -o bad.obj --faces nan", QW_OPTION, "to 20000000");
    refused("in.obj -o bad.obj --faces 20000001", QW_OPTION, "to 20000000");
    refused("in.obj -o bad.obj --edge-length inf", QW_OPTION, "edge_length");
    refused("in.obj -o bad.obj --sharp-angle 181", QW_OPTION, "to 180");
}

/* Each option that takes a number, by its name in the table, so that a new one is asked as well. */
static void no_number(void **state)
{
    (void)state;
    static const char *const texts[] = {"nan", "-inf", "1e999"};
    for (size_t i = 0; i < qw_option_count(); i++) {
        const qw_option_info *info = qw_option_at(i);
        if (info->kind != QW_KIND_REAL) continue;
        for (size_t k = 0; k < sizeof texts / sizeof texts[0]; k++) {
            char command[128];
            snprintf(command, sizeof command, "in.obj -o bad.obj --%s %s", info->name, texts[k]);
            refused(command, QW_OPTION, info->name);
        }
    }
    refused("in.obj -o bad.obj --sharp nan", QW_OPTION, "sharp_angle");
    refused("in.obj -o bad.obj --symmetry nan,0,0,1", QW_OPTION, "symmetry_x");
    refused("in.obj -o bad.obj --symmetry 1,0,0,inf", QW_OPTION, "symmetry_offset");
}

static void bad_files(void **state)
{
    (void)state;
    refused("nothing.obj -o bad.obj", QW_FILE_MISSING, "nothing.obj");
    refused(". -o bad.obj", QW_FILE_IS_DIRECTORY, ".");
    refused("empty.obj -o bad.obj", QW_FILE_EMPTY, "empty.obj");
    refused("range.obj -o bad.obj", QW_INDEX_RANGE, "range.obj");
    refused("flat.obj -o bad.obj -q", QW_ONLY_DEGENERATE, "");
    refused("in.obj -o nowhere/bad.obj", QW_FILE_UNWRITABLE, "nowhere/bad.obj");
    refused("in.obj -o . --format obj", QW_FILE_UNWRITABLE, "directory");
    refused("in.obj -o bad.obj --json nowhere/bad.json", QW_FILE_UNWRITABLE, "nowhere/bad.json");
    refused("measure nothing.obj", QW_FILE_MISSING, "nothing.obj");
    refused("measure in.obj --against nothing.obj", QW_FILE_MISSING, "nothing.obj");
    refused("render nothing.obj -o bad.png", QW_FILE_MISSING, "nothing.obj");
    refused("--from-stage nothing -o bad.obj", QW_FILE_MISSING, "nothing");
    refused("--from-stage in.obj -o bad.obj", QW_FORMAT_UNKNOWN, "in.obj");
}

/* The value of "name value" among the measures. */
static double figure(const outcome *o, const char *name)
{
    char line[64];
    snprintf(line, sizeof line, "%s ", name);
    const char *at = strstr(o->out, line);
    assert_non_null(at);
    return strtod(at + strlen(line), NULL);
}

/* Of the back of a sheet nothing faces as it does: where it is seen too, its quads are not flipped. */
static void measure_visible(void **state)
{
    (void)state;
    assert_int_equal(tool("sheet.obj -o sheet_quads.obj --wrap --faces 100 -q")->code, 0);
    outcome *o = tool("measure sheet_quads.obj --against sheet.obj --visible");
    assert_int_equal(o->code, 0);
    assert_true(figure(o, "flipped_faces") == 0 && figure(o, "chamfer") < 0.02);
    assert_true(figure(tool("measure sheet_quads.obj --against sheet.obj"), "flipped_faces") > 20);
    refused("measure in.obj --visible", QW_ARGUMENT, "--against");
}

/* What changes nothing is said, and so is an edge that is longer than the model. */
static void without_effect(void **state)
{
    (void)state;
    assert_non_null(strstr(tool("sheet.obj -o idle.obj --texture 512")->err, "--texture has no effect without --bake"));
    assert_non_null(strstr(tool("sheet.obj -o idle.obj --texel-density 9")->err, "--texel-density has no effect"));
    assert_null(strstr(tool("sheet.obj -o idle.glb --bake normal --texture 64")->err, "no effect"));
    assert_non_null(strstr(tool("sheet.obj -o idle.obj --wrap-quads 2")->err, "wrap_quads has no effect without wrap"));
    assert_non_null(strstr(tool("sheet.obj -o idle.obj --region-rim free")->err, "without a region"));
    assert_non_null(strstr(tool("sheet.obj -o idle.obj --symmetry-x 1")->err, "without symmetry plane"));
    assert_null(strstr(tool("sheet.obj -o idle.obj --symmetry 1,0,0,0.5")->err, "no effect"));
    assert_non_null(strstr(tool("sheet.obj -o idle.obj --patches-from blocks")->err, "without --patches"));
    const char *said = strstr(tool("sheet.obj -o idle.obj --patches idle.step --patches-from blocks")->err,
                              "note: the STEP file has ");
    unsigned blocks = 0;
    char patches[32];
    assert_non_null(said);
    assert_int_equal(sscanf(said, "note: the STEP file has %*u faces, of %u blocks", &blocks), 1);
    snprintf(patches, sizeof patches, "\"patches\": %u,", blocks); /* which render --limit --lines counts too */
    assert_non_null(strstr(tool("measure idle.obj --json")->out, patches));
    assert_null(strstr(tool("sheet.obj -o idle.obj --texture 512 --quiet")->err, "no effect"));
    assert_non_null(
        strstr(tool("sheet.obj -o idle.obj --edge-length 50")->err, "edges of 50 were asked for, longer than"));
}

/* Quads go into STL in two; what is read again is the same surface. */
static void stl_is_written(void **state)
{
    (void)state;
    assert_int_equal(tool("in.obj -o whole.obj --faces 600 --preset print")->code, 0);
    assert_int_equal(tool("in.obj -o whole.stl --faces 600 --preset print")->code, 0);
    double quads = figure(tool("measure whole.obj"), "quads");
    outcome *o = tool("measure whole.stl --against whole.obj");
    assert_true(figure(o, "triangles") == 2 * quads && figure(o, "flipped_faces") == 0);
    assert_true(figure(o, "euler") == -10 && figure(o, "chamfer") < 0.1);
}

static void said_of_words(void **state)
{
    (void)state;
    assert_memory_equal(tool("version")->out, "quadwright 0.", 13);
    assert_memory_equal(tool("-V")->out, "quadwright 0.", 13);
    assert_non_null(strstr(tool("help cad")->out, "a preset: --preset NAME"));
    assert_non_null(strstr(tool("help soup")->out, "a preset: --preset NAME"));
    assert_non_null(strstr(tool("--help")->out, "print, soup"));
    assert_non_null(strstr(tool("help faces")->out, "(1 to 20000000 faces)  [not asked for]"));
    assert_int_equal(shell("printf 'ISO-10303-21;\\n' > part.step"), 0);
    refused("part.step -o bad.obj", QW_FORMAT_UNKNOWN, "gmsh FILE.step -2 -o FILE.stl");
}

static void main_job(void **state)
{
    (void)state;
    outcome *o = tool("in.obj -o out.ply --faces 600 --json report.json");
    assert_int_equal(o->code, 0);
    assert_string_equal(o->out, "");
    assert_memory_equal(o->err, "in: ", 4); /* no progress, as this is no terminal */
    assert_null(strchr(o->err, '\r'));
    assert_non_null(strstr(o->err, "600 asked for"));
    assert_null(strstr(o->err, " 0 quads")); /* the report is of the result */
    assert_true(exists("report.json"));
    assert_false(any_like("part"));
    o = tool("measure out.ply --against in.obj");
    assert_int_equal(o->code, 0);
    assert_true(figure(o, "triangles") == 0 && figure(o, "other_polygons") == 0);
    assert_true(figure(o, "euler") == -10 && figure(o, "boundary_loops") == 0);
    assert_true(figure(o, "quads") >= 570 && figure(o, "quads") <= 630);
    assert_true(figure(o, "chamfer") < 0.5);
    assert_true(figure(o, "follow") > 0 && figure(o, "follow") < 22.5 && figure(o, "chords") > 0);
    static char report[65536];
    slurp("report.json", report, sizeof report);
    assert_non_null(strstr(report, "\"follow\": ")); /* of the result against the input */
    assert_null(strstr(report, "\"follow\": null"));
    o = tool("render out.ply --color follow --against in.obj --lines --chord 1 -o out.png --width 64 --height 64");
    assert_int_equal(o->code, 0);
    o = tool("measure out.ply --json");
    assert_int_equal(o->code, 0);
    assert_non_null(strstr(o->out, "\"chamfer\": null"));
    o = tool("in.obj -o out.obj --faces 600 --quiet");
    assert_int_equal(o->code, 0);
    assert_string_equal(o->err, "");
}

static void pipes_give_the_same_bytes(void **state)
{
    (void)state;
    assert_int_equal(tool("in.obj -o a.obj -f 600 -q")->code, 0);
    char command[1024];
    snprintf(command, sizeof command,
             "cd " FOLDER " && cat in.obj | " TOOL "- -f 600 2> stderr > b.obj && cmp a.obj b.obj");
    assert_int_equal(shell(command), 0);
    for (int threads = 1; threads <= 3; threads++) {
        assert_int_equal(tool("-i in.obj -o c.obj -f 600 -q --threads %d", threads)->code, 0);
        assert_int_equal(shell("cd " FOLDER " && cmp a.obj c.obj"), 0);
    }
    assert_int_equal(shell("cd " FOLDER " && cp a.obj before.obj"), 0);
    assert_int_not_equal(tool("empty.obj -o a.obj")->code, 0);
    assert_int_equal(shell("cd " FOLDER " && cmp a.obj before.obj"), 0); /* an older result survives a failure */
}

static void flags_of_quadriflow(void **state)
{
    (void)state;
    outcome *o = tool("-sharp -boundary -adaptive -mcf -sat -seed 3 -i in.obj -o qf.obj -f 600 --json qf.json -q");
    assert_int_equal(o->code, 0);
    static char report[65536];
    slurp(FOLDER "/qf.json", report, sizeof report);
    assert_non_null(strstr(report, "\"flow\": \"mcf\""));
    assert_non_null(strstr(report, "\"adaptive\": 1,"));
    assert_non_null(strstr(report, "\"seed\": 3"));
    assert_non_null(strstr(report, "\"faces\": 600,"));
}

/* A sphere of triangles painted in three ways gives the same quads: a property of PLY, the grey of colours, a file. */
static void density_from_three_places(void **state)
{
    (void)state;
    /* the 300 vertices of a closed tube; the painted ones are white, of density 8 */
    const char *make =
        "cd " FOLDER " && awk 'BEGIN { n = 20; m = 15; f = 2 * n * (m - 1); pi = 3.14159265358979;"
        " ply = \"d.ply\"; obj = \"d.obj\"; txt = \"d.txt\";"
        " print \"ply\\nformat ascii 1.0\\nelement vertex \" n * m \"\\nproperty double x\\nproperty double "
        "y\\nproperty double z\\n"
        "property float detail\\nelement face \" f \"\\nproperty list uchar int vertex_indices\\nend_header\" > ply;"
        " for (j = 0; j < m; j++) for (i = 0; i < n; i++) { a = 2 * pi * i / n; w = j < 5; p = cos(a) \" \" sin(a) \" "
        "\" j / 2;"
        " print p, w ? 8 : 1 > ply; print \"v\", p, w, w, w > obj; print w ? 8 : 1 > txt }"
        " for (j = 0; j + 1 < m; j++) for (i = 0; i < n; i++) { a = j * n + i; b = j * n + (i + 1) % n; c = b + n; d = "
        "a + n;"
        " print 3, a, b, c > ply; print 3, a, c, d > ply; print \"f\", a + 1, b + 1, c + 1 > obj; print \"f\", a + 1, "
        "c + 1, d + 1 > obj } }'";
    assert_int_equal(shell(make), 0);
    const char *bare = "-q -f 1500 --no-attributes";
    assert_int_equal(tool("d.obj -o none.obj %s", bare)->code, 0);
    assert_int_equal(tool("d.ply -o ply.obj %s --density detail", bare)->code, 0);
    assert_int_equal(tool("d.obj -o grey.obj %s --density color", bare)->code, 0);
    assert_int_equal(tool("d.obj -o file.obj %s --density d.txt", bare)->code, 0);
    assert_int_equal(
        shell("cd " FOLDER " && cmp ply.obj file.obj && cmp grey.obj file.obj && ! cmp -s none.obj file.obj"), 0);
    refused("d.obj -q -o bad.obj --density nowhere", QW_FILE_MISSING, "no vertex property \"nowhere\"");
    assert_int_equal(shell("cd " FOLDER " && head -7 d.txt > few.txt && sed 's/^8$/-8/' d.txt > less.txt"), 0);
    refused("d.obj -q -o bad.obj --density few.txt", QW_ARGUMENT, "7 densities for 300 vertices");
    refused("d.obj -q -o bad.obj --density less.txt", QW_ARGUMENT, "the density of vertex 0 is -8");
    refused("d.obj -q -o bad.obj --density d.obj", QW_FORMAT_SYNTAX, "line 1");
}

static void sharp_in_words(void **state)
{
    (void)state;
    static const struct {
        const char *word, *marks, *angle;
    } cases[] = {{"none", "false", "180"}, {"auto", "false", "-1"}, {"37.5", "false", "37.5"}, {"marks", "true", "-1"}};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(tool("in.obj -o sharp.obj -f 300 --sharp %s --json sharp.json -q", cases[i].word)->code, 0);
        static char report[65536];
        char text[64];
        slurp(FOLDER "/sharp.json", report, sizeof report);
        snprintf(text, sizeof text, "\"sharp_angle\": %s,", cases[i].angle);
        assert_non_null(strstr(report, text));
        snprintf(text, sizeof text, "\"sharp_marks\": %s,", cases[i].marks);
        assert_non_null(strstr(report, text));
    }
    refused("in.obj -o bad.obj --sharp soft", QW_ARGUMENT, "auto, none, marks or an angle");
    refused("in.obj -o bad.obj --sharp 181", QW_OPTION, "to 180");
}

static void stages_are_written_and_resumed(void **state)
{
    (void)state;
    assert_int_equal(tool("in.obj -o whole.obj -f 600 -q")->code, 0);
    static const char *const stages[] = {"clean", "Orientation", "POSITION", "regular", "quads"};
    for (int s = 0; s < 5; s++) {
        assert_int_equal(tool("in.obj --dump-stage %s:state.bin -f 600 -q", stages[s])->code, 0);
        assert_int_equal(tool("--from-stage state.bin -o resumed.obj -f 600 -q")->code, 0);
        assert_int_equal(shell("cd " FOLDER " && cmp whole.obj resumed.obj"), 0);
    }
    /* what the surface holds for sizes to come */
    assert_int_equal(tool("in.obj -o whole.obj -f 600 -q --around 24 --rings 1")->code, 0);
    assert_int_equal(tool("in.obj --dump-stage surface:state.bin -f 600 -q --around 24 --rings 1")->code, 0);
    assert_int_equal(tool("--from-stage state.bin -o resumed.obj -f 600 -q --around 24 --rings 1")->code, 0);
    assert_int_equal(shell("cd " FOLDER " && cmp whole.obj resumed.obj"), 0);
}

static int64_t lines_of(const char *text)
{
    int64_t lines = 0;
    for (; *text; text++) lines += *text == '\n';
    return lines;
}

static void manual_and_table(void **state)
{
    (void)state;
    outcome *o = tool("help all");
    assert_int_equal(o->code, 0);
    for (size_t i = 0; i < qw_option_count(); i++) {
        char name[64] = "";
        snprintf(name, sizeof name, "%s", qw_option_at(i)->name);
        for (char *c = name; *c; c++)
            if (*c == '_') *c = '-';
        assert_non_null(strstr(o->out, name));
    }
    for (int s = 0; s < QW_STATUS_COUNT; s++) assert_non_null(strstr(o->out, qw_status_name((qw_status)s)));
    assert_int_equal(tool("options")->code, 0);
    assert_non_null(strstr(tool("options")->out, "edge_length\treal\t0\t0\t1e+300\tinput units"));
    assert_non_null(strstr(tool("--version")->out, "quadwright 0."));
}

/* Help is one screen; each topic that it names has something to say, and so has each option. */
static void help_in_parts(void **state)
{
    (void)state;
    char screen[8192];
    outcome *o = tool("--help");
    assert_int_equal(o->code, 0);
    assert_true(lines_of(o->out) <= 40);
    snprintf(screen, sizeof screen, "%.8000s", o->out);
    assert_string_equal(tool("help")->out, screen);
    assert_string_equal(tool("in.obj --help")->out, screen);
    assert_string_equal(tool("-h")->out, screen);
    int topics = 0;
    for (const char *at = strstr(screen, "help OPTION:\n"); at && (at = strstr(at, "\n  ")); topics++) {
        char name[32];
        assert_int_equal(sscanf(at += 3, "%31s", name), 1);
        o = tool("help %s", name);
        assert_int_equal(o->code, 0);
        assert_true(lines_of(o->out) >= 4);
    }
    assert_true(topics >= 10);
    for (size_t i = 0; i < qw_option_count(); i++) {
        o = tool("help %s", qw_option_at(i)->name);
        assert_int_equal(o->code, 0);
        assert_non_null(strstr(o->out, "--"));
    }
    assert_non_null(strstr(tool("help --no-sat")->out, "SAT solver"));
    assert_non_null(strstr(tool("measure --help")->out, "--against"));
    o = tool("help adaptiv");
    assert_int_equal(o->code, qw_status_exit_code(QW_ARGUMENT));
    assert_non_null(strstr(o->err, "did you mean \"adaptive\"?"));
}

/* What was nearly right says what would be. */
static void advice(void **state)
{
    (void)state;
    assert_non_null(strstr(tool("mesure in.obj")->err, "unknown command \"mesure\"; did you mean \"measure\"?"));
    assert_non_null(strstr(tool("in.obj --presett cad")->err, "did you mean \"preset\"?"));
    assert_non_null(strstr(tool("in.obj --preset cda")->err, "did you mean \"cad\"?"));
    assert_non_null(strstr(tool("in.obj")->err, "-o in-quads.obj"));
    assert_non_null(strstr(tool("some/where/cow.v2.ply -f 100")->err, "-o cow.v2-quads.ply"));
    assert_non_null(strstr(tool("part.stl")->err, "-o part-quads.obj"));
    assert_int_equal(shell("cd " FOLDER " && cp in.obj mesure"), 0);
    assert_int_equal(tool("mesure -o named.obj -f 200 -q")->code, 0);
}

/* Points become a surface as with --wrap, and that is said; a broken surface is not taken for points. */
static void points_are_wrapped(void **state)
{
    (void)state;
    outcome *o = tool(QW_TEST_DATA "/points/ball.xyz -o points_a.obj -f 100");
    assert_int_equal(o->code, 0);
    assert_non_null(strstr(o->err, "note: points without faces are wrapped at the default distance; --wrap sets it"));
    o = tool(QW_TEST_DATA "/points/ball.xyz -o points_b.obj -f 100 --wrap");
    assert_int_equal(o->code, 0);
    assert_null(strstr(o->err, "are wrapped at"));
    assert_int_equal(shell("cd " FOLDER " && cmp points_a.obj points_b.obj"), 0);
    assert_int_equal(
        shell("cd " FOLDER " && printf 'OFF\\n4 1 0\\n0 0 0\\n1 0 0\\n1 1 0\\n0 1 0\\n4 0 1 2 7\\n' > bent.off"), 0);
    assert_int_not_equal(tool("bent.off -o none.obj -f 100")->code, 0);
    assert_false(exists("none.obj"));
    static const char *const written_only[] = {"inp", "msh", "vtu", "bdf"}; /* they have lines of three numbers */
    for (size_t i = 0; i < sizeof written_only / sizeof *written_only; i++) {
        char line[80];
        snprintf(line, sizeof line, "in.obj -o elements.%s -f 100 -q", written_only[i]);
        assert_int_equal(tool(line)->code, 0);
        snprintf(line, sizeof line, "elements.%s -o none.obj -f 100", written_only[i]);
        assert_non_null(strstr(tool(line)->err, "is written, not read"));
        assert_false(exists("none.obj"));
    }
}

/* The count that is said is that of the elements, of which each is four quads of the result. */
static void second_order_counts_elements(void **state)
{
    (void)state;
    outcome *o = tool("in.obj -o second.inp -f 100 --second-order --json second.json");
    assert_int_equal(o->code, 0);
    char text[1 << 14];
    slurp(FOLDER "/second.json", text, sizeof text);
    const char *quads = strstr(text, "\"quads\": "), *out = strstr(o->err, "second.inp, ");
    assert_true(quads && out);
    int elements = atoi(out + strlen("second.inp, "));
    assert_true(elements > 0 && 4 * elements == atoi(quads + strlen("\"quads\": ")));
    assert_non_null(strstr(o->err, " elements of second order (100 asked for)"));
}

/* A preset is its settings, and what is given beside it wins wherever it stands. */
static void presets(void **state)
{
    (void)state;
    assert_int_equal(tool("in.obj -o a.obj -q -f 300 --preset cad")->code, 0);
    assert_int_equal(
        tool("in.obj -o b.obj -q -f 300 --sharp-angle 30 --adaptive 0 --loops 1 --evenness 0.25 --around 12")->code, 0);
    assert_int_equal(shell("cd " FOLDER " && cmp a.obj b.obj"), 0);
    assert_int_equal(tool("in.obj -o a.obj -q -f 300 --evenness 0.75 --preset cad --loops 0")->code, 0);
    assert_int_equal(
        tool("in.obj -o b.obj -q -f 300 --sharp-angle 30 --adaptive 0 --loops 0 --evenness 0.75 --around 12")->code, 0);
    assert_int_equal(shell("cd " FOLDER " && cmp a.obj b.obj"), 0);
    outcome *o = tool("in.obj -o none.obj --preset cat");
    assert_int_equal(o->code, qw_status_exit_code(QW_OPTION));
    assert_non_null(strstr(o->err, "there is no preset \"cat\"; there are scan, character, cad, game, print"));
    assert_non_null(strstr(o->err, "; did you mean \"cad\"?"));
    assert_false(exists("none.obj"));
}

/* A field that was written steers a run, which writes the same bytes; guides and fields that are wrong leave nothing.
 */
static void steered(void **state)
{
    (void)state;
    const char *steps[] = {"in.obj -o first.obj --faces 300 --field-out first.rosy -q",
                           "in.obj -o again.obj --faces 300 --field-in first.rosy --field-out again.rosy -q",
                           "in.obj -o vertex.obj --faces 300 --field-out vertex.rosy --field-per vertex -q",
                           "in.obj -o plain.obj --faces 300 -q"};
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) assert_int_equal(tool("%s", steps[i])->code, 0);
    assert_int_equal(
        shell("cmp -s first.rosy again.rosy && ! cmp -s first.rosy vertex.rosy && cmp -s first.obj plain.obj"), 0);
    assert_int_equal(
        shell("printf 'v 9e3 9e3 9e3\nv 9e3 9e3 8e3\nl 1 2\n' > far.obj && printf '3\n4\n1 0 0\n' > short.rosy"), 0);
    refused("in.obj -o bad.obj --guides far.obj -q", QW_ARGUMENT, "guide 0 is off the surface");
    refused("in.obj -o bad.obj --guides missing.obj -q", QW_FILE_MISSING, "missing.obj");
    refused("in.obj -o bad.obj --field-in short.rosy -q", QW_FORMAT_TRUNCATED, "short.rosy");
    refused("in.obj -o bad.obj --field-in vertex.obj -q", QW_FORMAT_SYNTAX, "vertex.obj");
    refused("in.obj -o bad.obj --field-per corner", QW_ARGUMENT, "--field-per must be vertex or face");
    refused("--from-stage x.qws -o bad.obj --guides far.obj", QW_ARGUMENT, "--guides belongs to a mesh");
    assert_int_equal(
        shell("{ cat in.obj; } | awk '/^f/ { print (n++ < 60 ? \"g one\" : \"g two\") } { print }' > groups.obj"), 0);
    assert_int_equal(tool("groups.obj -o joined.obj --region one --faces 40 -q")->code, 0);
    assert_int_equal(tool("groups.obj -o fixed.obj --fix-boundary --faces 300 -q")->code, 0);
    assert_int_equal(shell("grep -q '^g two' joined.obj && grep -q '^g one' joined.obj"), 0);
    refused("groups.obj -o bad.obj --region three -q", QW_ARGUMENT, "no face has the label \"three\"; the labels are ");
    refused("in.obj -o bad.obj --region three -q", QW_ARGUMENT, "the mesh has no labels of faces");
    refused("--from-stage x.qws -o bad.obj --region one", QW_ARGUMENT, "--region belongs to a mesh");
    refused("in.obj -o bad.obj --field-in in.rosy --field-out in.rosy", QW_ARGUMENT, "would write over");
}

/* Interrupts a run once it has said that it is at work. */
static void interrupt_leaves_nothing(void **state)
{
    (void)state;
    assert_int_equal(shell("cd " FOLDER " && ../quadwright-shapes lattice 200000 big.obj"), 0);
    static const int signals[] = {SIGINT, SIGTERM};
    for (int s = 0; s < 2; s++) {
        int ends[2];
        assert_int_equal(pipe(ends), 0);
        pid_t child = fork();
        if (child == 0) {
            dup2(ends[1], STDERR_FILENO);
            close(ends[0]);
            if (chdir(FOLDER) == 0)
                execl(QW_BINARY_DIR "/quadwright", "quadwright", "big.obj", "-o", "cut.obj", "--json", "cut.json", "-f",
                      "60000", "-v", (char *)NULL);
            _exit(127);
        }
        close(ends[1]);
        char said[4096];
        size_t length = 0;
        assert_true(read(ends[0], said, 1) == 1); /* the first stage has begun */
        nanosleep(&(struct timespec){.tv_nsec = 150000000}, NULL);
        kill(child, signals[s]);
        for (ssize_t n; (n = read(ends[0], said + length, sizeof said - 1 - length)) > 0;) length += (size_t)n;
        said[length] = 0;
        close(ends[0]);
        int status = 0;
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), qw_status_exit_code(QW_CANCELLED));
        assert_non_null(strstr(said, "quadwright: "));
        assert_false(any_like("^cut"));
    }
}

static void coordinates_need_a_place(void **state)
{
    (void)state;
    refused(" in.obj --unwrap -o out.off", QW_ARGUMENT, "--unwrap");
    refused(" in.obj --unwrap -o out.msh", QW_ARGUMENT, "--unwrap");
}

/* One command from a surface to an asset: what lies there afterwards, what is told, and what is refused. */
static void assets(void **state)
{
    (void)state;
    assert_int_equal(tool("asset in.obj -o asset.glb --faces 100 --texture 64 --json asset.json -q")->code, 0);
    assert_int_equal(shell("head -c 4 asset.glb | grep -q glTF && grep -aq 'image/png' asset.glb && "
                           "grep -aq TANGENT asset.glb && grep -q '\"charts\": [1-9]' asset.json && "
                           "grep -q '\"missed_texels\": [0-9]' asset.json"),
                     0);
    assert_int_equal(tool("in.obj -o again.glb --bake input --faces 100 --texture 64 --threads 1 -q")->code, 0);
    assert_int_equal(shell("cmp asset.glb again.glb"), 0);
    assert_int_equal(tool("asset in.obj -o asset.obj --bake normal,height --faces 100 --texture 64 -q")->code, 0);
    assert_int_equal(shell("grep -q '^mtllib asset.mtl' asset.obj && grep -q 'asset_normal.png' asset.mtl && "
                           "head -c 8 asset_height.png | grep -aq PNG && test ! -e asset_color.png && "
                           "test $(grep '^f' asset.obj | awk '{ print NF }' | sort -u) = 5"),
                     0);
    /* objects of one file share a square, and keep their names */
    assert_int_equal(shell("cp in.obj two.obj && awk 'BEGIN{print \"o second\"} /^v /{n++; print "
                           "\"v\",$2+9,$3,$4} /^f /{f[++k]=$0} END{for(i=1;i<=k;i++){split(f[i],c,\" \"); print "
                           "\"f\",c[2]+n,c[3]+n,c[4]+n}}' in.obj >> two.obj && sed -i '1i o first' two.obj"),
                     0);
    assert_int_equal(tool("asset two.obj -o both.obj --faces 300 --texture 128 -q --json both.json")->code, 0);
    assert_int_equal(
        shell("grep -q '^o first' both.obj && grep -q '^o second' both.obj && [ $(grep -c usemtl both.obj) = 1 ] && "
              "grep -q '\"overlapping_charts\": 0' both.json && ! ls | grep -q 'both.*1001'"),
        0);
    /* a block that fills the square: corners at u = 1 are not of the next tile */
    assert_int_equal(
        tool("asset %s/regress/unit_square.obj -o block.obj --faces 16 --texture 64 --unwrap-grid 16 -q", QW_TEST_DATA)
            ->code,
        0);
    assert_int_equal(shell("test $(grep -c '^vt' block.obj) = 25 && test $(grep -c usemtl block.obj) = 1"), 0);
    /* several files in one square, each an object */
    assert_int_equal(tool("asset in.obj sheet.obj -o set.glb --faces 300 --texture 128 -q --json set.json")->code, 0);
    assert_int_equal(
        shell("grep -aq '\"nodes\":\\[{\"mesh\":0,\"name\":\"in\"},{\"mesh\":1,\"name\":\"sheet\"}' set.glb && "
              "test $(grep -ao image/png set.glb | wc -l) = 1 && "
              "grep -q '\"overlapping_charts\": 0' set.json"),
        0);
    refused("asset in.obj sheet.obj", QW_ARGUMENT, "2 inputs were named; the result is named by -o: -o sheet.obj");
    refused("asset in.obj missing.obj -o bad.glb", QW_FILE_MISSING, "missing.obj");
    refused("asset in.obj sheet.obj -o sheet.obj", QW_ARGUMENT, "--force allows it");
    assert_int_equal(tool("asset in.obj -o levels.glb --levels 200,60 --texture 128 -q --json levels.json")->code, 0);
    assert_int_equal(shell("grep -aq MSFT_lod levels.glb && grep -aq '\"name\":\"asset LOD1\"' levels.glb && "
                           "test $(grep -ao image/png levels.glb | wc -l) = 2 && "
                           "grep -q '\"charts\": [1-9]' levels_LOD0.json levels_LOD1.json"),
                     0);
    assert_int_equal(tool("levels.glb -o again.obj --faces 60 -q")->code, 0); /* its first level is a mesh */
    assert_int_equal(tool("asset in.obj -o lod.obj --levels 200,60 --texture 128 -q")->code, 0);
    assert_int_equal(shell("for i in 0 1; do cmp lod_LOD${i}.mtl /dev/null 2> /dev/null && exit 1; "
                           "head -c 24 lod_LOD${i}_normal.png | tail -c 4 | od -An -tu1 | grep -q \"$((128 >> i))\" || "
                           "exit 1; done"),
                     0);
    assert_non_null(strstr(tool("asset --help")->out, "quadwright asset IN... -o OUT.glb"));
    refused("asset in.obj -o bad.ply", QW_ARGUMENT, "maps are written with GLB, glTF and OBJ only");
    refused("asset in.obj", QW_ARGUMENT, "-o FILE");
    refused("asset in.obj -o bad.glb --bake normals", QW_ARGUMENT, "--bake must be input, all, or any of color");
    refused("asset in.obj -o bad.glb --bake normal,normal", QW_ARGUMENT, "none twice");
    refused("asset in.obj -o bad.glb --texture 7", QW_OPTION, "texture");
    refused("asset in.obj -o - --format obj", QW_ARGUMENT, "standard output has no folder");
    refused("asset in.obj -o bad.glb -q --texture 16 --margin 16", QW_ARGUMENT, "have no room");
}

/* A folder has the name of the second level's file. */
static void levels_are_all_or_none(void **state)
{
    (void)state;
    assert_int_equal(shell("mkdir -p " FOLDER "/level_LOD1.obj"), 0);
    outcome *o = tool(" in.obj -q --levels 400,200 -o level.obj --json level.json");
    assert_int_equal(o->code, qw_status_exit_code(QW_FILE_UNWRITABLE));
    assert_false(exists("level_LOD0.obj"));
    assert_false(exists("level_LOD0.json"));
    assert_int_equal(shell("rmdir " FOLDER "/level_LOD1.obj"), 0);
    assert_int_equal(tool(" in.obj -q --levels 400,200 -o level.obj")->code, 0);
    assert_true(exists("level_LOD0.obj") && exists("level_LOD1.obj"));
    setenv("MALLOC_PERTURB_", "165", 1); /* glibc: what is freed is overwritten; normals were before the last file */
    assert_int_equal(tool(" in.obj -q --levels 400,200 -o level.glb --normals smooth --provenance from.json")->code, 0);
    unsetenv("MALLOC_PERTURB_");
}

static void limits_leave_nothing(void **state)
{
    (void)state;
    assert_int_equal(shell("cd " FOLDER " && ../quadwright-shapes lattice 200000 big.obj"), 0);
    refused("in.obj -q -o bad.obj --memory-limit 1", QW_MEMORY, "memory limit");
    refused("big.obj -q -o bad.obj --json bad.json -f 200000 --time-limit 1", QW_CANCELLED, "the time limit of 1 s");
    refused("in.obj -o bad.obj --time-limit 0", QW_ARGUMENT, "from 1 to");
    assert_int_equal(tool("in.obj -q -o sharp.obj -f 300 --sharp 30 --memory-limit 1000 --time-limit 1000")->code, 0);
    refused("in.obj -q -o bad.obj --memory-limit 4cows", QW_ARGUMENT, "such as 4G, not \"4cows\"");
    assert_non_null(strstr(tool("in.obj -o limited.obj -f 300 --memory-limit 1000")->err, "means 1000M; say so"));
    assert_null(strstr(tool("in.obj -o limited.obj -f 300 --memory-limit 1.5G")->err, "say so"));
    assert_int_equal(tool("in.obj -q -o angle.obj -f 300 --sharp-angle 30")->code, 0);
    assert_int_equal(shell("cd " FOLDER " && cmp -s sharp.obj angle.obj"), 0);
}

QW_TEST_SUITE(cli)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_command_lines),
        cmocka_unit_test(absurd_targets),
        cmocka_unit_test(no_number),
        cmocka_unit_test(bad_files),
        cmocka_unit_test(main_job),
        cmocka_unit_test(without_effect),
        cmocka_unit_test(stl_is_written),
        cmocka_unit_test(said_of_words),
        cmocka_unit_test(measure_visible),
        cmocka_unit_test(manual_and_table),
        cmocka_unit_test(help_in_parts),
        cmocka_unit_test(advice),
        cmocka_unit_test(points_are_wrapped),
        cmocka_unit_test(second_order_counts_elements),
        cmocka_unit_test(presets),
        cmocka_unit_test(pipes_give_the_same_bytes),
        cmocka_unit_test(flags_of_quadriflow),
        cmocka_unit_test(steered),
        cmocka_unit_test(interrupt_leaves_nothing),
        cmocka_unit_test(density_from_three_places),
        cmocka_unit_test(sharp_in_words),
        cmocka_unit_test(coordinates_need_a_place),
        cmocka_unit_test(assets),
        cmocka_unit_test(levels_are_all_or_none),
        cmocka_unit_test(limits_leave_nothing),
        cmocka_unit_test(stages_are_written_and_resumed),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
