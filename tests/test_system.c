/* The tool against the system around it: signals, limits, full and slow outputs, links, devices, names, and a user
 * without rights. Each run ends with a sentence and leaves nothing behind that is not whole. */
#define _XOPEN_SOURCE 700
#include "suite.h"
#include "quadwright/quadwright.h"

#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

enum { MOST_SAID = 8192, PATIENCE = 600 /* seconds: ends hangs only */ };

static char own_folder[] = "/tmp/quadwright-system-XXXXXX"; /* where an ordinary user may go */

static int shell(const char *command)
{
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* "./tool ARGUMENTS" in the folder of the tests; what it says on standard error, and its exit code. */
static int tool(char said[MOST_SAID], const char *format, ...)
{
    char arguments[2048], command[4096];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    snprintf(command, sizeof command, "./tool %s 2> said", arguments);
    int code = shell(command);
    FILE *file = fopen("said", "rb");
    assert_non_null(file);
    said[fread(said, 1, MOST_SAID - 1, file)] = 0;
    fclose(file);
    remove("said");
    return code;
}

static void expect(int code, qw_status status, const char *said, const char *says)
{
    if (code != qw_status_exit_code(status) || !strstr(said, says))
        fail_msg("exit %d instead of %d, said \"%s\", not \"%s\"", code, qw_status_exit_code(status), said, says);
}

static bool exists(const char *name)
{
    struct stat info;
    return lstat(name, &info) == 0;
}

static void nothing_unfinished(void)
{
    if (shell("ls | grep -E '\\.part$|\\.tmp$'") == 0) fail_msg("something is left behind");
}

static int set_up(void **state)
{
    (void)state;
    if (!mkdtemp(own_folder) || chmod(own_folder, 0777) != 0 || chdir(own_folder) != 0) return -1;
    return shell("cp '" QW_BINARY_DIR "/quadwright' tool && '" QW_BINARY_DIR "/quadwright-shapes' knot 1200 in.obj"
                 " && chmod 755 tool && chmod 644 in.obj");
}

static int tear_down(void **state)
{
    char command[512];
    (void)state;
    snprintf(command, sizeof command, "chmod -R u+w '%s' && rm -rf '%s'", own_folder, own_folder);
    return chdir("/") == 0 ? shell(command) : -1;
}

/* ---- limits */

static void a_file_size_limit(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *names;
    } runs[] = {{"in.obj -q -f 900 -o big.obj", "big.obj"},
                {"in.obj -q -f 900 -o big.ply --json r.json", "r.json"},
                {"in.obj -q -f 900 --dump-stage clean:big.qws", "big.qws"},
                {"render in.obj -o big.png", "big.png"}};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        char command[256];
        snprintf(command, sizeof command, "ulimit -f 2; ./tool %s 2> said", runs[i].arguments);
        int code = shell(command);
        char said[MOST_SAID] = "";
        FILE *file = fopen("said", "rb");
        said[fread(said, 1, MOST_SAID - 1, file)] = 0;
        fclose(file);
        expect(code, QW_FILE_UNWRITABLE, said, "cannot be written: File too large");
        assert_non_null(strstr(said, runs[i].names));
        assert_int_equal(shell("ls | grep -q -e ^big -e ^r.json"), 1);
        nothing_unfinished();
    }
}

static void full_devices(void **state)
{
    (void)state;
    static const char *const runs[] = {"help > /dev/full",
                                       "options > /dev/full",
                                       "--version > /dev/full",
                                       "measure in.obj > /dev/full",
                                       "measure in.obj --json > /dev/full",
                                       "in.obj -q -f 100 -o - > /dev/full",
                                       "in.obj -q -f 100 -o a.obj --json - > /dev/full",
                                       "in.obj -q -f 100 -o a.obj --json /dev/full",
                                       "render in.obj -o - > /dev/full",
                                       "in.obj -q -f 100 --dump-stage clean:/dev/full"};
    if (access("/dev/full", W_OK) != 0) skip();
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        char said[MOST_SAID];
        expect(tool(said, "%s", runs[i]), QW_FILE_UNWRITABLE, said, "cannot be written: No space left");
        assert_false(exists("a.obj"));
        nothing_unfinished();
    }
}

static void a_closed_pipe(void **state)
{
    (void)state;
    static const char *const runs[] = {"in.obj -q -f 2000 -o - --json r.json", "in.obj -q -f 2000 -o r.obj --json -",
                                       "render in.obj -o -", "measure in.obj", "help"};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        char said[MOST_SAID], run[256];
        snprintf(run, sizeof run, "%s | true", runs[i]);
        /* a FIFO whose reader is gone: no race with "true" */
        snprintf(run, sizeof run, "%s > gone", runs[i]);
        assert_int_equal(mkfifo("gone", 0600), 0);
        int reader = open("gone", O_RDONLY | O_NONBLOCK), writer = open("gone", O_WRONLY);
        close(reader);
        char command[300];
        snprintf(command, sizeof command, "%s >&%d", runs[i], writer);
        expect(tool(said, "%s", command), QW_FILE_UNWRITABLE, said, "cannot be written: Broken pipe");
        close(writer);
        remove("gone");
        assert_false(exists("r.json") || exists("r.obj"));
        nothing_unfinished();
    }
}

/* ---- signals */

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void pause_for(double seconds)
{
    nanosleep(
        &(struct timespec){.tv_sec = (time_t)seconds, .tv_nsec = (long)(1e9 * (seconds - (double)(time_t)seconds))},
        NULL);
}

typedef struct child {
    pid_t pid;
    int said; /* its standard error */
} child;

static child start(bool ignores, const char *const *arguments)
{
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    child c = {fork(), ends[0]};
    if (c.pid == 0) {
        dup2(ends[1], STDERR_FILENO);
        close(ends[0]), close(ends[1]);
        if (ignores) signal(SIGINT, SIG_IGN), signal(SIGHUP, SIG_IGN);
        execv("./tool", (char *const *)arguments);
        _exit(127);
    }
    close(ends[1]);
    return c;
}

/* Until signals wait for the tool to look: one that came before would end the process, as it should. */
static void wait_until_held(child c)
{
    char path[64], line[256];
    snprintf(path, sizeof path, "/proc/%ld/status", (long)c.pid);
    for (double begin = now(); now() - begin < PATIENCE; pause_for(0.01)) {
        unsigned long long blocked = 0;
        FILE *file = fopen(path, "r");
        while (file && fgets(line, sizeof line, file))
            if (sscanf(line, "SigBlk: %llx", &blocked) == 1) break;
        if (file) fclose(file);
        if (blocked >> (SIGTERM - 1) & 1) return;
    }
    fail_msg("the tool holds no signals");
}

/* The exit code, or minus the signal that ended it; -1000 where it had to be. */
static int finish(child c, char said[MOST_SAID])
{
    int status = 0, code = 0;
    for (double begin = now(); waitpid(c.pid, &status, WNOHANG) == 0;) {
        if (now() - begin > PATIENCE) {
            kill(c.pid, SIGKILL);
            waitpid(c.pid, &status, 0);
            code = -1000;
            break;
        }
        pause_for(0.01);
    }
    size_t length = 0;
    for (ssize_t n; (n = read(c.said, said + length, MOST_SAID - 1 - length)) > 0;) length += (size_t)n;
    said[length] = 0;
    close(c.said);
    return code ? code : WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

/* What waits for a FIFO that nobody reads, or that nobody reads on, or writes to. */
static void slow_pipes_are_heard(void **state)
{
    (void)state;
    static const struct {
        int number;
        const char *name;
    } signals[] = {{SIGINT, "SIGINT"}, {SIGTERM, "SIGTERM"}, {SIGHUP, "SIGHUP"}, {SIGXCPU, "SIGXCPU"}};
    static const char *const runs[][12] = {
        {"tool", "in.obj", "-q", "-f", "300", "-o", "fifo", "--format", "obj", "--json", "r.json", NULL},
        {"tool", "in.obj", "-q", "-f", "300", "--dump-stage", "clean:fifo", NULL},
        {"tool", "in.obj", "-q", "-f", "300", "-o", "a.obj", "--json", "fifo", NULL},
        {"tool", "--from-stage", "fifo", "-q", "-o", "a.obj", NULL},
        {"tool", "render", "in.obj", "-o", "fifo.png", NULL}};
    assert_true(mkfifo("fifo", 0600) == 0 && mkfifo("fifo.png", 0600) == 0);
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++)
        for (int reads = 0; reads < (i == 3 ? 1 : 2); reads++) {
            const char *name = i == 4 ? "fifo.png" : "fifo";
            int end = reads ? open(name, O_RDWR | O_NONBLOCK) : -1;
            char filling[4096] = {0}, said[MOST_SAID];
            while (reads && write(end, filling, sizeof filling) > 0) {} /* until it is full */
            child c = start(false, runs[i]);
            wait_until_held(c);
            pause_for(0.3); /* it may be at work, or wait already */
            assert_int_equal(waitpid(c.pid, NULL, WNOHANG), 0);
            kill(c.pid, signals[(i + (size_t)reads) % 4].number);
            int code = finish(c, said);
            expect(code, QW_CANCELLED, said, signals[(i + (size_t)reads) % 4].name);
            if (end >= 0) close(end);
            assert_false(exists("a.obj") || exists("r.json"));
            nothing_unfinished();
        }
    remove("fifo"), remove("fifo.png");
}

static void a_time_limit_while_waiting(void **state)
{
    (void)state;
    static const char *const run[] = {"tool", "in.obj",   "-q",  "-f",           "300", "-o",
                                      "fifo", "--format", "obj", "--time-limit", "1",   NULL};
    char said[MOST_SAID];
    assert_int_equal(mkfifo("fifo", 0600), 0);
    int code = finish(start(false, run), said);
    expect(code, QW_CANCELLED, said, "the time limit of 1 s was reached");
    remove("fifo");
}

/* In the background of a script, or under nohup. */
static void ignored_signals_stay_so(void **state)
{
    (void)state;
    static const char *const run[] = {"tool", "in.obj", "-q", "-f", "3000", "-o", "ignored.obj", NULL};
    char said[MOST_SAID];
    child c = start(true, run);
    pause_for(0.2);
    kill(c.pid, SIGINT), kill(c.pid, SIGHUP);
    expect(finish(c, said), QW_OK, said, "");
    assert_true(exists("ignored.obj"));
}

/* The exact flow alone may take minutes: it hears the time limit and interrupts. */
static void an_integer_program_is_heard(void **state)
{
    (void)state;
    static const char *const late[] = {"tool", "slow.obj", "-q",      "-f",           "20000", "--flow",
                                       "ilp",  "-o",       "ilp.obj", "--time-limit", "4",     NULL};
    static const char *const run[] = {"tool", "slow.obj", "-q", "-f", "20000", "--flow", "ilp", "-o", "ilp.obj", NULL};
    char said[MOST_SAID];
    if (tool(said, "in.obj -q -f 100 --flow ilp -o small.obj") == qw_status_exit_code(QW_UNSUPPORTED)) skip();
    assert_int_equal(shell("'" QW_BINARY_DIR "/quadwright-shapes' lattice 60000 slow.obj"), 0);
    expect(finish(start(false, late), said), QW_CANCELLED, said, "the time limit of 4 s was reached");
    child c = start(false, run);
    wait_until_held(c);
    pause_for(4);
    kill(c.pid, SIGTERM);
    expect(finish(c, said), QW_CANCELLED, said, "SIGTERM");
    assert_false(exists("ilp.obj"));
    nothing_unfinished();
}

/* ---- paths */

static void outputs_that_would_meet(void **state)
{
    (void)state;
    char said[MOST_SAID];
    assert_int_equal(shell("mkdir -p sub && cp in.obj copy.obj && ln -sf copy.obj soft.obj && ln -f copy.obj hard.obj"
                           " && ln -sf out.obj to_out && ./tool in.obj -q --dump-stage clean:state.qws -f 300"),
                     0);
    static const char *const runs[] = {"-o out.obj --json out.obj",
                                       "-o out.obj --json ./out.obj",
                                       "-o out.obj --json sub/../out.obj",
                                       "-o out.obj --json to_out",
                                       "-o out.obj --json OUT.obj",
                                       "-o out.obj --dump-stage quads:out.obj",
                                       "--json out.obj --dump-stage quads:to_out",
                                       "--dump-stage clean:x --dump-stage quads:./x",
                                       "-o x.obj --json copy.obj",
                                       "-o x.obj --json soft.obj",
                                       "-o x.obj --json hard.obj",
                                       "--dump-stage quads:soft.obj",
                                       "-o - --dump-stage quads:-",
                                       "-o /dev/stdout --format obj --json -",
                                       "-o - --json both > both",
                                       "-o /dev/fd/1 --format obj --json /dev/stdout",
                                       "-o copy.obj",
                                       "-o sub/../copy.obj",
                                       "-o soft.obj",
                                       "-o hard.obj",
                                       "-o - --format obj >> copy.obj",
                                       "-o x.obj --force --json copy.obj"};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        int code = tool(said, "copy.obj -q -f 100 %s", runs[i]);
        if (!strstr(said, "would")) fail_msg("%s: %s", runs[i], said);
        expect(code, QW_ARGUMENT, said, "would");
        assert_false(exists("out.obj") || exists("x.obj") || exists("x") || exists("OUT.obj"));
        assert_int_equal(shell("cmp -s in.obj copy.obj"), 0);
    }
    expect(tool(said, "--from-stage state.qws -q -f 100 -o x.obj --json state.qws"), QW_ARGUMENT, said, "--from-stage");
    expect(tool(said, "--from-stage state.qws -q -f 100 --dump-stage quads:./state.qws"), QW_ARGUMENT, said, "would");
    expect(tool(said, "- -q -f 100 -o x.obj --json copy.obj < copy.obj"), QW_ARGUMENT, said, "the input");
    assert_int_equal(shell("cp in.obj view.png"), 0);
    expect(tool(said, "render view.png -o ./view.png"), QW_ARGUMENT, said, "the input");
    assert_int_equal(shell("cmp -s in.obj view.png"), 0);
    expect(tool(said, "- -q -f 100 -o soft.obj < copy.obj"), QW_ARGUMENT, said, "--force allows it");
    assert_int_equal(shell("for i in $(seq 3000); do echo 1; done > thick"), 0);
    expect(tool(said, "copy.obj -q -f 100 -o x.obj --density thick --json thick"), QW_ARGUMENT, said, "--density");
    assert_int_equal(shell("cmp -s in.obj copy.obj && test -L soft.obj"), 0);
    expect(tool(said, "copy.obj -q -f 100 -o copy.obj --force"), QW_OK, said, "");
    assert_int_equal(shell("cmp -s in.obj copy.obj"), 1);
    expect(tool(said, "in.obj -q -f 100 -o /dev/null --format obj --json /dev/null"), QW_OK, said, "");
}

static void names_are_escaped(void **state)
{
    (void)state;
    char said[MOST_SAID], report[MOST_SAID];
    expect(tool(said, "in.obj -f 300 -o \"$(printf 'a\\001\\377\\033[31m.obj')\" --json odd.json"), QW_OK, said,
           "a\\x01\\xff\\x1b[31m.obj");
    for (const char *c = said; *c; c++)
        assert_true(((unsigned char)*c >= ' ' && (unsigned char)*c < 0x7f) || *c == '\n');
    FILE *file = fopen("odd.json", "rb");
    assert_non_null(file);
    report[fread(report, 1, sizeof report - 1, file)] = 0;
    fclose(file);
    assert_non_null(strstr(report, "\"output\": \"a\\u0001\\\\xff\\u001b[31m.obj\""));
    expect(tool(said, "\"$(printf 'no\\033thing\\377.obj')\" -o x.obj"), QW_FILE_MISSING, said,
           "no\\x1bthing\\xff.obj");
    expect(tool(said, "in.obj -o x.obj \"$(printf -- '--\\033[2J')\""), QW_OPTION, said, "\\x1b[2J");
}

static void reader_notes_are_told(void **state)
{
    (void)state;
    char said[MOST_SAID];
    assert_int_equal(
        shell("printf 'o a\\nv 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\no b\\nv 5 0 0\\nv 6 0 0\\nv 6 1 0\\nf 1 2 3\\n'"
              " > from_one.obj"),
        0);
    expect(tool(said, "from_one.obj -f 20 -o one.obj --json one.json"), QW_OK, said,
           "note: from_one.obj: each of its 2 objects");
    assert_int_equal(shell("grep -q 'each of its 2 objects' one.json"), 0);
    assert_int_equal(shell("printf 'v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nusemtl gr\\374n\\nf 1 2 3\\n' > latin.obj"), 0);
    expect(tool(said, "latin.obj -f 20 -o latin.glb"), QW_OK, said, "written as if they were Latin-1");
}

/* ---- an ordinary user */

/* As nobody, where these tests run as root. What that user cannot do stands in the script's exit code. */
static void without_rights(void **state)
{
    (void)state;
    static const char script[] =
        "set -e\n"
        "mkdir -p mine locked && cd mine\n"
        "for o in /dev/stdout /dev/null /dev/stderr; do ../tool ../in.obj -q -f 100 -o $o --format obj > o.obj 2> "
        "e.obj; done\n"
        "test -s o.obj || test -s e.obj\n"
        "../tool ../in.obj -q -f 100 -o /dev/stdout --format obj | ../tool measure - > /dev/null\n"
        "../tool ../in.obj -q -f 100 -o /dev/null --format obj --json /dev/stdout | grep -q '\"report\"'\n"
        "../tool ../in.obj -q -f 100 --dump-stage clean:/dev/stdout | ../tool --from-stage /dev/stdin -f 100 -q -o "
        "r.obj\n"
        "../tool render ../in.obj -o - | head -c 4 | grep -q PNG\n"
        "../tool ../in.obj -q -f 100 -o - > direct.obj && cmp direct.obj r.obj\n"
        "rm -f r.obj; cd ..\n"
        /* links from a folder that takes no files into one that does */
        "for n in m.obj r.json s.qws p.png; do ln -sf ../mine/$n locked/$n; done\n"
        "chmod 555 locked\n"
        "./tool in.obj -q -f 100 -o locked/m.obj --json locked/r.json\n"
        "./tool in.obj -q -f 100 --dump-stage clean:locked/s.qws\n"
        "./tool render in.obj -o locked/p.png\n"
        "for n in m.obj r.json s.qws p.png; do test -L locked/$n && test -s mine/$n; done\n"
        /* and over them, as they exist now */
        "./tool in.obj -q -f 100 -o locked/m.obj --json locked/r.json\n"
        "cmp mine/m.obj mine/direct.obj\n"
        "chmod 755 locked\n";
    FILE *file = fopen("script.sh", "wb");
    assert_non_null(file);
    fputs(script, file);
    fclose(file);
    const char *as = geteuid() == 0 ? "setpriv --reuid=65534 --regid=65534 --clear-groups " : "";
    if (*as && shell("setpriv --reuid=65534 --regid=65534 --clear-groups true 2> /dev/null") != 0) skip();
    char command[256];
    snprintf(command, sizeof command, "%sbash -x script.sh > trace 2>&1", as);
    int code = shell(command);
    if (code != 0) (void)shell("tail -5 trace >&2");
    assert_int_equal(code, 0);
    /* what it may not do is said before the work */
    char said[MOST_SAID];
    snprintf(command, sizeof command,
             "mkdir -p closed && chmod 555 closed && %s./tool in.obj -q -o closed/x.obj 2> said", as);
    code = shell(command);
    file = fopen("said", "rb");
    said[fread(said, 1, sizeof said - 1, file)] = 0;
    fclose(file);
    expect(code, QW_FILE_UNWRITABLE, said, "its folder takes no new files");
}

QW_TEST_SUITE(system)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_size_limit),
        cmocka_unit_test(full_devices),
        cmocka_unit_test(a_closed_pipe),
        cmocka_unit_test(slow_pipes_are_heard),
        cmocka_unit_test(a_time_limit_while_waiting),
        cmocka_unit_test(ignored_signals_stay_so),
        cmocka_unit_test(an_integer_program_is_heard),
        cmocka_unit_test(outputs_that_would_meet),
        cmocka_unit_test(names_are_escaped),
        cmocka_unit_test(reader_notes_are_told),
        cmocka_unit_test(without_rights),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
