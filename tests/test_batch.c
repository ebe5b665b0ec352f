/* Batches as a user meets them: killed and begun again, with a bad model among good ones, in shards. */
#define _POSIX_C_SOURCE 200809L
#include "suite.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#define TOOL "../quadwright "
enum { MODELS = 24 };

static char own_folder[] = QW_BINARY_DIR "/test-batch-XXXXXX";

static int shell(const char *command)
{
    int status = system(command);
    int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return code;
}

/* The number that a command prints. */
static long number(const char *command)
{
    FILE *pipe = popen(command, "r");
    long value = -1;
    if (pipe && fscanf(pipe, "%ld", &value) != 1) value = -1;
    if (pipe) pclose(pipe);
    return value;
}

/* A cube of twelve triangles takes hundredths of a second. */
#define CUBE                                                                                                          \
    "CUBE='v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 " \
    "8\n"                                                                                                             \
    "f 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n';"

static int set_up(void **state)
{
    char command[512];
    (void)state;
    if (!mkdtemp(own_folder) || chdir(own_folder) != 0) return -1;
    snprintf(command, sizeof command,
             CUBE " mkdir -p models/more && printf '%%s' \"$CUBE\" > one.obj && for i in $(seq %d); do cp one.obj "
                  "models/more/m$i.obj; done"
                  " && printf 'v 0 0 0\\nf 1 2 3\\n' > models/bad.obj && touch models/not-a-mesh.txt",
             MODELS - 1);
    return shell(command);
}

static int tear_down(void **state)
{
    char command[512];
    (void)state;
    snprintf(command, sizeof command, "rm -rf '%s'", own_folder);
    return chdir(QW_BINARY_DIR) == 0 ? shell(command) : -1;
}

#define RUN     TOOL "batch models --out out" OPTIONS
#define OPTIONS " --faces 24 --no-relax -q --jobs 2 2> stderr"

static long done(void) { return number("find out -name '*.record.json' 2> /dev/null | wc -l"); }

/* Killed once it has done some: what it had done is not done again, and nothing is left that is torn. Both jobs wait
 * for pipes that nobody writes to, at places `some` and `some` + 1 in the order of names, and so it cannot have done
 * more. */
static void kill_after(long some)
{
    char command[1024];
    snprintf(command, sizeof command,
             "held=$(ls models/more | LC_ALL=C sort | sed -n '%ld,%ldp');"
             " for m in $held; do mv models/more/$m held-$m && mkfifo models/more/$m || exit 1; done;"
             " cd models && ls bad.obj more/*.obj > ../list; { ../" TOOL "batch ../list --out ../out" OPTIONS
             " & } ; p=$!; cd ..; while [ $(find out -name '*.record.json' 2> /dev/null | wc -l) -lt %ld ]; do sleep "
             "0.02; done;"
             " kill -9 $p; wait $p 2> /dev/null; sleep 0.3;" /* its children end with it */
             " for m in $held; do mv held-$m models/more/$m || exit 1; done",
             some, some + 1, some);
    assert_int_equal(shell(command), 0);
}

static void killed_twice_each_is_done_once(void **state)
{
    (void)state;
    kill_after(6);
    long first = done();
    assert_int_equal(first, 6);
    assert_int_equal(shell("sleep 0.1; touch mark-1; sleep 0.1"), 0);
    kill_after(12);
    long second = done();
    assert_int_equal(second, 12);
    assert_int_equal(number("find out -name '*.record.json' -newer mark-1 | wc -l"), second - first);
    assert_int_equal(shell("sleep 0.1; touch mark-2; sleep 0.1"), 0);
    assert_int_equal(shell(RUN), 1); /* the bad one */
    assert_int_equal(done(), MODELS);
    assert_int_equal(number("find out -name '*.record.json' -newer mark-2 | wc -l"), MODELS - second);
    assert_int_equal(number("wc -l < out/report.jsonl"), MODELS);
    assert_int_equal(number("grep -c '\"status\": \"OK\"' out/report.jsonl"), MODELS - 1);
    assert_int_equal(
        number("grep -c '\"name\": \"bad.obj\", \"status\": \"INDEX_RANGE\", \"exit_code\": 11' out/report.jsonl"), 1);
    assert_int_equal(number("cut -d, -f1 out/report.jsonl | sort | uniq | wc -l"), MODELS);
    assert_int_equal(number("find out -name '*.part' | wc -l"), 0);
    assert_int_equal(shell("test -s out/summary.html && grep -q bad.obj out/summary.html"), 0);
    assert_int_equal(number("grep -c '^<tr><td>' out/summary.html"), MODELS);
    assert_int_equal(
        shell("grep -q \"<td><a href='$PWD/models/bad.obj'>bad.obj</a></td><td>INDEX_RANGE, earlier</td>\" "
              "out/summary.html"),
        0);
    assert_int_equal(number("find out/pictures -name '*.png' -size +1k | wc -l"), MODELS - 1);
    assert_int_equal(number("grep -c \"^<tr><td><a href='more/m[0-9]*.obj.quads.obj'><img loading='lazy' "
                            "src='pictures/more/m[0-9]*.obj.png'\" out/summary.html"),
                     MODELS - 1);
    assert_int_equal(number("find out -name '*.png' | grep -vc '^out/pictures/'"), 0);
    assert_int_equal(shell("grep -q '<h2>12 done by an earlier run</h2><p><a ' out/summary.html && "
                           "grep -q '<h2>No models, by their endings: [12]</h2><p>not-a-mesh.txt' out/summary.html && "
                           "grep -q 'Pictures: the input, and beside it the quads' out/summary.html"),
                     0);
    assert_int_equal(shell("grep -q 'Options: faces = 24, relax = off' out/summary.html"), 0);
    assert_int_equal(shell("grep -q \"models, 1 failed.* $(date -u +%Y)-\" out/summary.html"), 0);
    assert_int_equal(shell(TOOL "one.obj -o one-quads.obj --faces 24 --no-relax -q"), 0);
    assert_int_equal(shell("for f in out/more/*.quads.obj; do cmp -s $f one-quads.obj || exit 1; done"), 0);
}

/* Of what was done, that whose output, record, input or options changed is done again, and nothing else. */
static void what_is_torn_is_done_again(void **state)
{
    (void)state;
    assert_int_equal(shell("sleep 0.1; touch mark-3; sleep 0.1"), 0);
    assert_int_equal(
        shell("truncate -s 100 out/more/m7.obj.quads.obj && rm out/more/m8.obj.quads.obj && truncate -s 50 "
              "out/more/m9.obj.record.json && touch models/more/m10.obj"),
        0);
    assert_int_equal(shell(RUN), 1);
    assert_int_equal(number("find out -name '*.record.json' -newer mark-3 | wc -l"), 4);
    assert_int_equal(shell("for i in 7 8 9 10; do cmp -s out/more/m$i.obj.quads.obj one-quads.obj || exit 1; done"), 0);
    assert_int_equal(shell("sleep 0.1; touch mark-4; sleep 0.1"), 0);
    assert_int_equal(shell(TOOL "batch models --out out --faces 24 --no-relax -q --retry 2> stderr"), 1);
    assert_int_equal(number("find out -name '*.record.json' -newer mark-4 | wc -l"), 1);
}

/* A model whose process was killed from outside, as a cluster does it, is done again by the next run; one that crashed
 * is not. */
static void what_was_killed_is_done_again(void **state)
{
    (void)state;
    assert_int_equal(shell("sleep 0.1; touch mark-5; sleep 0.1"), 0);
    assert_int_equal(shell("sed -i 's/\"status\": \"OK\"/\"status\": \"KILLED\"/' out/more/m11.obj.record.json &&"
                           "sed -i 's/\"status\": \"OK\"/\"status\": \"CRASHED\"/' out/more/m12.obj.record.json &&"
                           "touch -d '1 hour ago' out/more/m1[12].obj.record.json"),
                     0);
    assert_int_equal(shell(RUN), 1);
    assert_int_equal(number("find out -name '*.record.json' -newer mark-5 | wc -l"), 1);
    assert_int_equal(number("grep -c '\"status\": \"OK\"' out/more/m11.obj.record.json"), 1);
    assert_int_equal(number("grep -c '\"status\": \"CRASHED\"' out/report.jsonl"), 1);
}

/* As the command line does it: the same bytes, with the attributes or without. */
static void attributes_come_along(void **state)
{
    (void)state;
    assert_int_equal(
        shell("mkdir dressed && sed 's/^f 5 6 7/usemtl skin\\nf 5 6 7/; 1i mtllib a.mtl' one.obj > dressed/a.obj"), 0);
    static const char *const flags[] = {"", "--no-attributes", "--keep materials"};
    for (int i = 0; i < 3; i++) {
        char command[512];
        snprintf(command, sizeof command,
                 TOOL
                 "batch dressed --out worn --faces 54 -q --force %s && " TOOL
                 "dressed/a.obj -o dressed.quads.obj --faces 54 -q %s"
                 " && cmp worn/a.obj.quads.obj dressed.quads.obj && grep -c 'usemtl skin' dressed.quads.obj > count",
                 flags[i], flags[i]);
        assert_int_equal(shell(command), i == 1);
    }
    assert_int_equal(number("grep -c '\"attributes\": {' worn/report.jsonl"), 1);
}

/* Each model is in one shard, and stays there when others come. */
static void shards_part_the_models(void **state)
{
    (void)state;
    assert_int_equal(
        shell("find models/more -name 'm1*.obj' | sort > some && find models/more -name 'm[2-9]*.obj' | sort > others"),
        0);
    assert_int_equal(shell("for i in 0 1 2; do " TOOL
                           "batch some --out parts --shard $i/3 --faces 24 --no-relax -q || exit 1; done"),
                     0);
    long all = number("wc -l < some");
    assert_int_equal(number("cat parts/report-?-of-3.jsonl | wc -l"), all);
    assert_int_equal(number("cat parts/report-?-of-3.jsonl | cut -d, -f1 | sort -u | wc -l"), all);
    assert_true(number("wc -l < parts/report-0-of-3.jsonl") > 0);
    assert_int_equal(shell("cut -d, -f1 parts/report-1-of-3.jsonl > before"), 0);
    assert_int_equal(shell("cat some others | " TOOL "batch - --out parts --shard 1/3 --faces 24 --no-relax -q"), 0);
    assert_int_equal(
        shell("cut -d, -f1 parts/report-1-of-3.jsonl > after; grep -vxFf after before > moved; test ! -s moved"), 0);
    assert_true(number("wc -l < after") > number("wc -l < before"));
}

/* A model that takes too long, and one whose process is killed. */
static void limits_end_one_model(void **state)
{
    (void)state;
    assert_int_equal(
        shell("mkdir slow && ../quadwright-shapes lattice 100000 slow/big.obj && cp one.obj slow/small.obj"), 0);
    /* a pipe that nobody writes to is never read to its end; the other has ample time on a busy machine too */
    assert_int_equal(shell("mkfifo never.obj && printf 'never.obj\\none.obj\\n' | " TOOL
                           "batch - --out late --faces 24 --time-limit 3 -q 2> stderr"),
                     1);
    assert_int_equal(number("grep -c '\"name\": \"never.obj\", \"status\": \"TIME_LIMIT\"' late/report.jsonl"), 1);
    assert_int_equal(number("grep -c '\"name\": \"one.obj\", \"status\": \"OK\"' late/report.jsonl"), 1);
    assert_int_equal(shell(TOOL "batch slow --out little --faces 24 --memory-limit 5 -q 2> stderr"), 1);
    assert_int_equal(number("grep -c '\"name\": \"big.obj\", \"status\": \"MEMORY\"' little/report.jsonl"), 1);
    assert_int_equal(shell("{ " TOOL "batch slow --out killed --faces 24 --jobs 1 -q 2> stderr & } ; p=$!; "
                           "while ! pgrep -P $p > /dev/null; do sleep 0.02; done;"
                           " pkill -9 -P $p; wait $p"),
                     1);
    assert_int_equal(
        number("grep -c '\"name\": \"big.obj\", \"status\": \"KILLED\", \"exit_code\": 137' killed/report.jsonl"), 1);
    assert_int_equal(number("grep -c '\"name\": \"small.obj\", \"status\": \"OK\"' killed/report.jsonl"), 1);
}

/* Files that a model names, or that steer it, are part of it, whether they are there or not. */
static void files_beside_count(void **state)
{
    (void)state;
    assert_int_equal(shell("mkdir scenes && " TOOL
                           "one.obj -o scenes/plain.obj --faces 24 -q && yes 1 | head -26 > densities && " TOOL
                           "one.obj -o scenes/a.gltf --faces 24 -q && sed -i "
                           "'s|\"uri\":\"data:application/octet-stream;base64,|&\\n|' "
                           "scenes/a.gltf && sed -n '2s|\"}]}$||p' scenes/a.gltf | base64 -d > scenes/a.bin && "
                           "sed -i '1s|\"data:.*|\"a.bin\"}],\"images\":[{\"uri\":\"skin.png\"}]}|; 2,$d' "
                           "scenes/a.gltf && cp scenes/a.bin a.bin"),
                     0);
    static const struct {
        const char *change;
        long done; /* models that it does again */
        int code;
    } steps[] = {{"true", 2, 0},
                 {"true", 0, 0},
                 {"touch scenes/a.bin", 1, 0},
                 {"echo picture > scenes/skin.png", 1, 0},
                 {"echo other picture > scenes/skin.png", 1, 0},
                 {"rm scenes/a.bin", 1, 1},
                 {"true", 0, 1},
                 {"cp a.bin scenes/a.bin", 1, 0},
                 {"touch densities", 2, 0},
                 {"true", 0, 0}};
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        char command[256];
        assert_int_equal(shell("sleep 0.02; touch mark-beside; sleep 0.02"), 0);
        assert_int_equal(shell(steps[i].change), 0);
        snprintf(command, sizeof command,
                 TOOL "batch scenes --out seen --faces 24 --no-relax --density densities -q 2> stderr");
        int code = shell(command);
        long redone = number("find seen -name '*.record.json' -newer mark-beside | wc -l");
        if (code != steps[i].code || redone != steps[i].done)
            print_error("%s: exit code %d, %ld done\n", steps[i].change, code, redone);
        assert_int_equal(code, steps[i].code);
        assert_int_equal(redone, steps[i].done);
    }
}

/* Assets of a folder: as the command asset makes them, textures beside them; materials and textures are part of the
 * model. */
static void assets_are_made_of_a_folder(void **state)
{
    static const char run[] = TOOL "batch clothed --out assets --faces 24 --bake input --texture 64 --tiles 1 -q";
    static const char *const changes[] = {"touch clothed/a.mtl", "echo picture > clothed/skin.png",
                                          "echo other picture > clothed/skin.png"};
    (void)state;
    assert_int_equal(shell("mkdir clothed && sed '1i mtllib a.mtl\\nusemtl red' one.obj > clothed/a.obj && "
                           "printf 'newmtl red\nKd 1 0 0\nmap_Ke -s 1 1 1 skin.png\n' > clothed/a.mtl"),
                     0);
    assert_int_equal(shell(run), 0);
    assert_int_equal(shell(TOOL "asset clothed/a.obj -o a.obj.quads.obj --faces 24 --texture 64 -q && cd assets && "
                                "for i in .obj .mtl _color.png _normal.png; do cmp a.obj.quads$i ../a.obj.quads$i || "
                                "exit 1; done"),
                     0);
    assert_int_equal(number("grep -c '\"asset\": {\"charts\": [1-9]' assets/a.obj.record.json"), 1);
    for (int i = 0; i < 6; i++) { /* each change is seen once */
        assert_int_equal(shell("sleep 0.02; touch mark-asset; sleep 0.02"), 0);
        assert_int_equal(shell(i % 2 ? "true" : changes[i / 2]), 0);
        assert_int_equal(shell(run), 0);
        assert_int_equal(number("find assets -name '*.record.json' -newer mark-asset | wc -l"), i % 2 ? 0 : 1);
    }
    assert_int_equal(shell(TOOL "batch clothed --out assets --faces 24 --bake input --texture 32 -q 2> stderr"), 2);
    assert_int_equal(shell("grep -q 'another set of switches' stderr"), 0);
    assert_int_equal(shell(TOOL "batch clothed --out assets --faces 24 --bake input --format off 2> stderr"), 2);
    assert_int_equal(shell(TOOL "batch clothed --out unwrapped --faces 24 --unwrap --texture 64 -q && " TOOL
                                "clothed/a.obj -o unwrapped.obj --faces 24 --unwrap --texture 64 -q && "
                                "cmp unwrapped.obj unwrapped/a.obj.quads.obj"),
                     0);
}

/* Closed holes are marked in a batch as in a single run. */
static void closed_holes_are_marked(void **state)
{
    static const char *const formats[] = {"obj", "ply", "glb"};
    (void)state;
    assert_int_equal(shell("mkdir open && grep -v '^f 1 [34]' one.obj > open/a.obj"), 0);
    for (int i = 0; i < 3; i++) {
        char command[512];
        snprintf(command, sizeof command,
                 TOOL "batch open --out shut --faces 54 --fill-holes 8 --format %s -q --force && " TOOL
                      "open/a.obj -o shut.%s --faces 54 --fill-holes 8 -q && cmp shut.%s shut/a.obj.quads.%s && "
                      "grep -aq filled shut.%s",
                 formats[i], formats[i], formats[i], formats[i], formats[i]);
        assert_int_equal(shell(command), 0);
    }
}

/* Each format that can be written, under its own ending. */
static void formats_have_their_endings(void **state)
{
    static const char *const formats[] = {"off", "stl", "gltf", "msh", "vtu", "inp", "bdf"};
    (void)state;
    assert_int_equal(shell("mkdir plain && cp one.obj plain"), 0);
    for (int i = 0; i < 7; i++) {
        char command[512];
        snprintf(command, sizeof command,
                 TOOL "batch plain --out formats --faces 24 --format %s -q --force && " TOOL
                      "one.obj -o one.%s --faces 24 -q && cmp one.%s formats/one.obj.quads.%s",
                 formats[i], formats[i], formats[i], formats[i]);
        assert_int_equal(shell(command), 0);
    }
}

/* The levels of a model are one file, the bytes of a single run; the record tells how many quads each has. */
static void levels_are_one_file_a_model(void **state)
{
    (void)state;
    assert_int_equal(shell("mkdir detailed && cp one.obj detailed && " TOOL
                           "batch detailed --out levels --levels 96,24 --bake normal --texture 64 -q && " TOOL
                           "one.obj -o one.glb --levels 96,24 --bake normal --texture 64 -q && "
                           "cmp one.glb levels/one.obj.quads.glb"),
                     0);
    assert_int_equal(number("grep -c '\"levels\": \\[96, *24\\]' levels/one.obj.record.json"), 1);
    assert_int_equal(shell(TOOL "batch detailed --out levels --levels 96,48 --bake normal -q 2> stderr"), 2);
    assert_int_equal(shell("grep -q 'another set of switches' stderr"), 0);
    assert_int_equal(shell(TOOL "batch detailed --out level --levels 96,24 --format obj 2> stderr"), 2);
    assert_int_equal(shell(TOOL "batch detailed --out level --levels 96,24 --faces 9 2> stderr"), 2);
}

/* Points without faces are models where they are wrapped, as in a single run. */
static void points_are_models(void **state)
{
    (void)state;
    assert_int_equal(
        shell("mkdir points && cp " QW_TEST_DATA "/points/ball.xyz " QW_TEST_DATA "/points/ball.ply points"), 0);
    assert_int_equal(shell(TOOL "batch points --out wrapped --faces 100 --wrap 0.1 -q && " TOOL
                                "points/ball.xyz -o ball.obj --faces 100 --wrap 0.1 -q && "
                                "cmp ball.obj wrapped/ball.xyz.quads.obj && test -s wrapped/ball.ply.quads.obj"),
                     0);
    assert_int_equal(shell(TOOL "batch points --out by_default --faces 100 -q && " TOOL
                                "points/ball.xyz -o ball.obj --faces 100 -q && "
                                "cmp ball.obj by_default/ball.xyz.quads.obj && test -s by_default/ball.ply.quads.obj"),
                     0);
}

/* Of what failed in an earlier run a later one says so, by number and name, and its exit code agrees. */
static void counts_of_a_resumed_run_agree(void **state)
{
    (void)state;
    assert_int_equal(shell("mkdir mixed && cp one.obj mixed && cp models/bad.obj mixed/bad.obj"), 0);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(shell(TOOL "batch mixed --out both --faces 24 --no-relax 2> stderr"), 1);
        assert_int_equal(
            shell(i == 0 ? "grep -q '^2 of 2 done, 1 failed$' stderr"
                         : "grep -q '^2 of 2 done, 1 failed; 2 of them in an earlier run, of which 1 failed$' "
                           "stderr"),
            0);
        assert_int_equal(
            shell(i == 0 ? "grep -q '1 of 2 models failed: bad.obj (INDEX_RANGE); both/report.jsonl' stderr"
                         : "grep -q '1 of 2 models failed: bad.obj (INDEX_RANGE, in an earlier run);' stderr"),
            0);
    }
    assert_int_equal(shell("cp one.obj mixed/bad.obj && " TOOL "batch mixed --out both --faces 24 --no-relax -q"), 0);
}

static void other_options_replace_nothing(void **state)
{
    (void)state;
    assert_int_equal(shell("mkdir few && cp one.obj few && " TOOL "batch few --out kept --faces 24 -q"), 0);
    assert_int_equal(shell("cp kept/one.obj.quads.obj before.obj"), 0);
    assert_int_equal(shell(TOOL "batch few --out kept --faces 54 -q 2> stderr"), 2);
    assert_int_equal(
        shell("grep -q 'kept holds 1 results of other options (faces was 24 and is 54 now)' stderr && cmp -s "
              "before.obj kept/one.obj.quads.obj"),
        0);
    assert_int_equal(shell(TOOL "batch few --out kept --faces 24 --no-attributes -q 2> stderr"), 2);
    assert_int_equal(shell("grep -q 'another set of switches' stderr"), 0);
    assert_int_equal(shell(TOOL "batch few --out kept --faces 24 --threads 2 --jobs 1 --time-limit 99 -q"), 0);
    assert_int_equal(shell(TOOL "batch few --out kept --faces 54 -q --force"), 0);
    assert_int_equal(shell("cmp -s before.obj kept/one.obj.quads.obj"), 1);
}

/* While one batch is at work in a folder, another is refused there, but for other shards; once it is dead, however it
 * ended, nothing of it is in the way. The first waits for a pipe that nobody writes to. */
static void one_batch_at_a_time(void **state)
{
    (void)state;
    static const struct {
        const char *first, *second;
        int code;
    } cases[] = {{"", "", 16},
                 {"", "--shard 0/1", 16},
                 {"--shard 0/1", "", 16},
                 {"--shard 0/1", "--shard 0/1", 16},
                 {"--shard 0/1", "--shard 1/2", 0}};
    assert_int_equal(shell("mkfifo held.obj"), 0);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char command[1024];
        snprintf(command, sizeof command,
                 "rm -rf shared; { echo held.obj | " TOOL "batch - --out shared --faces 24 -q %s & } ; "
                 "p=; while [ -z \"$p\" ]; do p=$(pgrep -P $$ quadwright | head -1); done; " /* it has the lock once it
                                                                                                has a child */
                 "while ! pgrep -P $p > /dev/null; do sleep 0.02; done; "
                 "echo one.obj | " TOOL
                 "batch - --out shared --faces 24 -q %s 2> stderr; code=$?; kill -9 $p; wait 2> /dev/null; "
                 "[ $code -eq 0 ] || grep -q 'another batch is at work' stderr || exit 99; exit $code",
                 cases[i].first, cases[i].second);
        assert_int_equal(shell(command), cases[i].code);
        assert_int_equal(shell("echo one.obj | " TOOL "batch - --out shared --faces 24 -q"), 0);
    }
}

/* The library's own sentence stands in the record and on the page, for what fails in the run as for what fails before.
 */
static void reasons_are_told(void **state)
{
    (void)state;
    assert_int_equal(shell("mkdir flat && printf 'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n' > flat/line.obj && "
                           "echo > flat/empty.ply && cp models/bad.obj 'flat/a \"b\" <c>.obj'"),
                     0);
    assert_int_equal(shell(TOOL "batch flat --out told --faces 24 -q 2> stderr"), 1);
    assert_int_equal(shell("grep -q '\"message\": \"none of 1 triangles has an area\"' told/line.obj.record.json"), 0);
    assert_int_equal(
        shell("grep -q \"line.obj</a></b> <a href='line.obj.record.json'>ONLY_DEGENERATE</a>: none of 1 "
              "triangles\" told/summary.html && "
              "grep -q \"empty.ply</a></b> <a href='empty.ply.record.json'>[A-Z_]*</a>: \" told/summary.html"),
        0);
    /* A sentence with marks of JSON and of HTML reads as it was meant, and its links lead to the files. */
    assert_int_equal(
        shell("grep -q 'record.json.>INDEX_RANGE</a>: flat/a &quot;b&quot; &lt;c>.obj' told/summary.html && "
              "grep -q '/flat/a%20%22b%22%20%3Cc%3E.obj.>a &quot;b&quot; &lt;c>.obj</a>' told/summary.html"),
        0);
}

static void bad_command_lines(void **state)
{
    (void)state;
    assert_int_equal(shell(TOOL "batch one.obj --out out 2> stderr"), 2);
    assert_int_equal(shell("grep -q 'one.obj is a model: a batch takes a folder' stderr"), 0);
    assert_int_equal(shell("echo 'ISO-10303-21;' > part.STP && " TOOL "batch part.STP --out out 2> stderr"), 2);
    assert_int_equal(shell("grep -q 'gmsh FILE.step -2 -o FILE.stl' stderr"), 0);
    assert_int_equal(shell(TOOL "batch 2> stderr"), 2);
    assert_int_equal(shell(TOOL "batch models 2> stderr && exit 99; grep -q -- '--out FOLDER is required' stderr"), 0);
    assert_int_equal(shell(TOOL "batch nothing --out out 2> stderr"), 4);
    assert_int_equal(shell(TOOL "batch models --out out --shard 3/3 2> stderr"), 2);
    assert_int_equal(shell(TOOL "batch models --out out --shard 1 2> stderr"), 2);
    assert_int_equal(shell(TOOL "batch models --out out --jobs 0 2> stderr"), 2);
    assert_int_equal(shell(TOOL "batch models --out one.obj/out 2> stderr"), 16);
    assert_int_equal(shell("mkdir inside && cd inside && cp ../one.obj ../two.obj && cp ../one.obj two.obj && "
                           "printf 'two.obj\\n../two.obj\\n' | ../" TOOL "batch - --out out 2> ../stderr"),
                     2);
    assert_int_equal(shell("grep -q 'would both become two.obj' stderr"), 0);
    assert_int_equal(shell("printf 'one.obj\\n./one.obj\\n' | " TOOL "batch - --out once --faces 24 -q"), 0);
    /* a list that names what would be written */
    assert_int_equal(shell("cp one.obj once/one.obj.quads.obj && printf 'one.obj\\nonce/one.obj.quads.obj\\n' | " TOOL
                           "batch - --out once --faces 24 -q 2> stderr"),
                     2);
    assert_int_equal(
        shell("grep -q 'would write over once/one.obj.quads.obj' stderr && cmp -s one.obj once/one.obj.quads.obj"), 0);
    assert_int_equal(number("wc -l < once/report.jsonl"), 1);
}

QW_TEST_SUITE(batch)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(killed_twice_each_is_done_once),
        cmocka_unit_test(what_is_torn_is_done_again),
        cmocka_unit_test(what_was_killed_is_done_again),
        cmocka_unit_test(attributes_come_along),
        cmocka_unit_test(shards_part_the_models),
        cmocka_unit_test(limits_end_one_model),
        cmocka_unit_test(files_beside_count),
        cmocka_unit_test(assets_are_made_of_a_folder),
        cmocka_unit_test(closed_holes_are_marked),
        cmocka_unit_test(formats_have_their_endings),
        cmocka_unit_test(levels_are_one_file_a_model),
        cmocka_unit_test(points_are_models),
        cmocka_unit_test(counts_of_a_resumed_run_agree),
        cmocka_unit_test(other_options_replace_nothing),
        cmocka_unit_test(one_batch_at_a_time),
        cmocka_unit_test(reasons_are_told),
        cmocka_unit_test(bad_command_lines),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
