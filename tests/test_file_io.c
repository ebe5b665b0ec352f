/* Paths and descriptors: what can be wrong with a file, and that a failing writer leaves nothing behind. */
#define _XOPEN_SOURCE 700

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "faults.h"
#include "suite.h"
#include "io/file.h"
#include "io/number.h"
#include "io/soup.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- helpers */

typedef struct job {
    qw_env *env;
    const char *path;
    qw_format format;
    const qw_mesh_view *mesh; /* NULL: read */
    qw_soup soup;
} job;

static void job_body(void *user)
{
    job *j = user;
    if (j->mesh) qw_write(j->env, j->path, j->format, j->mesh);
    else j->soup = qw_read(j->env, j->path);
}

static void expect(job *j, qw_status status, const char *says)
{
    qw_status got = qw_protect(j->env, job_body, j);
    if (got != status)
        fail_msg("%s: %s instead of %s: %s", j->path, qw_status_name(got), qw_status_name(status),
                 qw_env_message(j->env));
    if (!strstr(qw_env_message(j->env), says)) fail_msg("\"%s\" does not say \"%s\"", qw_env_message(j->env), says);
    if (status != QW_OK) assert_int_equal(qw_env_bytes(j->env), 0);
}

static void free_soup(job *j)
{
    qw_free(j->env, j->soup.position);
    qw_free(j->env, j->soup.face_begin);
    qw_free(j->env, j->soup.corner);
    qw_free(j->env, j->soup.mark);
}

static char folder[512];

static const char *in_folder(char path[1024], const char *name)
{
    snprintf(path, 1024, "%s/%s", folder, name);
    return path;
}

static int entries(void)
{
    int count = 0;
    DIR *directory = opendir(folder);
    while (readdir(directory)) count++;
    closedir(directory);
    return count - 2; /* the folder and its parent */
}

static void empty_folder(void)
{
    char path[1024];
    DIR *directory = opendir(folder);
    for (const struct dirent *e; (e = readdir(directory)) != NULL;)
        if (e->d_name[0] != '.' && remove(in_folder(path, e->d_name)) != 0) fail_msg("%s stays", path);
    closedir(directory);
}

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "%s/files-XXXXXX", QW_BINARY_DIR);
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    empty_folder();
    return rmdir(folder);
}

static int begin(void **state)
{
    *state = qw_env_create(NULL, 1);
    return 0;
}

static int end(void **state)
{
    qw_env_destroy(*state);
    empty_folder();
    return 0;
}

static void put_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_true(fwrite(text, 1, strlen(text), file) == strlen(text) && fclose(file) == 0);
}

static size_t get_file(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t got = fread(text, 1, size - 1, file);
    text[got] = 0;
    fclose(file);
    return got;
}

static const double awkward[] = {0.1,
                                 -0.0,
                                 1.0 / 3,
                                 5e-324,
                                 1.7976931348623157e308,
                                 2.2250738585072014e-308,
                                 9007199254740993.0,
                                 -123456.78901234567,
                                 1e22,
                                 1e23,
                                 0.30000000000000004,
                                 -2.2204460492503131e-16,
                                 4.35,
                                 1e-7,
                                 100,
                                 1e17,
                                 (double)0.1f,
                                 3.141592653589793};
static const uint32_t mixed_sizes[] = {3, 4, 5}, mixed_corners[] = {0, 1, 2, 2, 3, 4, 5, 5, 4, 3, 2, 1},
                      quads[] = {0, 1, 2, 3, 2, 3, 4, 5};
static const qw_mesh_view mixed = {.size = sizeof mixed,
                                   .vertex_count = 6,
                                   .face_count = 3,
                                   .positions = awkward,
                                   .face_sizes = mixed_sizes,
                                   .corners = mixed_corners};
static const qw_mesh_view quad_mesh = {.size = sizeof quad_mesh,
                                       .vertex_count = 6,
                                       .face_count = 2,
                                       .uniform_face_size = 4,
                                       .positions = awkward,
                                       .corners = quads};

/* ---- reading */

static void test_missing(void **state)
{
    char path[1024];
    expect(&(job){.env = *state, .path = in_folder(path, "none.obj")}, QW_FILE_MISSING,
           "none.obj: the file does not exist");
    expect(&(job){.env = *state, .path = ""}, QW_FILE_MISSING, "does not exist");
    put_file(in_folder(path, "file"), "v");
    expect(&(job){.env = *state, .path = in_folder(path, "file/below.obj")}, QW_FILE_MISSING, "does not exist");
}

static void test_directory(void **state)
{
    expect(&(job){.env = *state, .path = folder}, QW_FILE_IS_DIRECTORY, "is a directory");
}

static void test_unreadable(void **state)
{
    char path[1024];
    put_file(in_folder(path, "secret.obj"), "v 0 0 0\n");
    assert_int_equal(chmod(path, 0), 0);
    if (access(path, R_OK) != 0)
        expect(&(job){.env = *state, .path = path}, QW_FILE_UNREADABLE, "cannot be read"); /* root may */
    if (access("/proc/self/mem", R_OK) == 0)
        expect(&(job){.env = *state, .path = "/proc/self/mem"}, QW_FILE_UNREADABLE, "cannot be read: ");
}

static void test_empty(void **state)
{
    char path[1024];
    put_file(in_folder(path, "empty.obj"), "");
    expect(&(job){.env = *state, .path = path}, QW_FILE_EMPTY, "empty.obj: the file is empty");
    expect(&(job){.env = *state, .path = "/dev/null"}, QW_FILE_EMPTY, "/dev/null: ");
}

static void test_names_lie(void **state)
{
    char path[1024];
    put_file(in_folder(path, "truly.stl"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    job j = {.env = *state, .path = path};
    expect(&j, QW_OK, "");
    assert_int_equal(j.soup.face_count, 1);
}

/* The sentence survives a path that is longer than a message. */
static void test_long_path(void **state)
{
    char path[2000];
    size_t size = 0;
    while (size < 1500) size += (size_t)snprintf(path + size, sizeof path - size, "./");
    snprintf(path + size, sizeof path - size, "%s", "\xc3\xa4nd.obj");
    expect(&(job){.env = *state, .path = path}, QW_FILE_MISSING, "/\xc3\xa4nd.obj: the file does not exist");
}

static void test_standard_input(void **state)
{
    char path[1024];
    put_file(in_folder(path, "in.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    int saved = dup(STDIN_FILENO), file = open(path, O_RDONLY);
    dup2(file, STDIN_FILENO);
    job j = {.env = *state, .path = "-"};
    expect(&j, QW_OK, "");
    assert_int_equal(j.soup.face_count, 1);
    int pipe_ends[2];
    assert_int_equal(pipe(pipe_ends), 0);
    assert_int_equal(write(pipe_ends[1], "v 0 0 x\n", 8), 8);
    close(pipe_ends[1]);
    dup2(pipe_ends[0], STDIN_FILENO);
    free_soup(&j);
    expect(&(job){.env = *state, .path = "-"}, QW_FORMAT_SYNTAX, "standard input, line 1: \"x\"");
    dup2(saved, STDIN_FILENO);
    close(saved), close(file), close(pipe_ends[0]);
}

/* ---- writing */

static void check_same(const qw_soup *s, const qw_mesh_view *m)
{
    assert_int_equal(s->vertex_count, m->vertex_count);
    assert_int_equal(s->face_count, m->face_count);
    assert_memory_equal(s->position, m->positions, 3 * sizeof(double) * m->vertex_count);
    for (uint32_t f = 0; f < m->face_count; f++)
        assert_int_equal(s->face_begin[f + 1] - s->face_begin[f],
                         m->face_sizes ? m->face_sizes[f] : m->uniform_face_size);
    assert_memory_equal(s->corner, m->corners, sizeof(uint32_t) * s->face_begin[s->face_count]);
}

static void test_round_trip(void **state)
{
    static const char *const names[] = {"a.obj", "a.PLY", "a.Off"};
    static const qw_mesh_view *const meshes[] = {&mixed, &quad_mesh};
    for (size_t i = 0; i < 6; i++) {
        char path[1024];
        in_folder(path, names[i / 2]);
        expect(&(job){.env = *state, .path = path, .mesh = meshes[i % 2]}, QW_OK, "");
        job back = {.env = *state, .path = path};
        expect(&back, QW_OK, "");
        check_same(&back.soup, meshes[i % 2]);
    }
    assert_int_equal(entries(), 3);
}

static void test_large_round_trip(void **state)
{
    enum { VERTICES = 30000, BIG_FACE = 20000 };
    double *positions = malloc(sizeof(double) * 3 * VERTICES);
    uint32_t *corners = malloc(sizeof(uint32_t) * VERTICES), sizes[] = {BIG_FACE, 3, VERTICES - BIG_FACE - 3};
    for (size_t i = 0; i < 3 * VERTICES; i++) positions[i] = (double)(i * 2654435761u % 1000003) / 7;
    for (uint32_t i = 0; i < VERTICES; i++) corners[i] = i * 7919 % VERTICES;
    qw_mesh_view mesh = {.size = sizeof mesh,
                         .vertex_count = VERTICES,
                         .face_count = 3,
                         .positions = positions,
                         .face_sizes = sizes,
                         .corners = corners};
    static const char *const names[] = {"b.obj", "b.ply", "b.off"};
    for (int i = 0; i < 3; i++) {
        char path[1024];
        expect(&(job){.env = *state, .path = in_folder(path, names[i]), .mesh = &mesh}, QW_OK, "");
        job back = {.env = *state, .path = path};
        expect(&back, QW_OK, "");
        check_same(&back.soup, &mesh);
    }
    free(positions);
    free(corners);
}

/* Faces of 3, 4, 5, 3, ... corners and one of a thousand, over random vertices. */
static qw_mesh_view large_mesh(double **positions, uint32_t **sizes, uint32_t **corners)
{
    enum { VERTICES = 20000, FACES = 25000, BIG = 12345, BIG_SIZE = 1000 };
    qw_mesh_view mesh = {.size = sizeof mesh, .vertex_count = VERTICES, .face_count = FACES};
    mesh.positions = *positions = malloc(sizeof(double) * 3 * VERTICES);
    mesh.face_sizes = *sizes = malloc(sizeof(uint32_t) * FACES);
    mesh.corners = *corners = malloc(sizeof(uint32_t) * (5 * FACES + BIG_SIZE));
    for (size_t i = 0; i < 3 * VERTICES; i++) (*positions)[i] = (double)(i * 2654435761u % 1000003) / 7 - 50000;
    uint32_t count = 0;
    for (uint32_t f = 0; f < FACES; f++) count += (*sizes)[f] = f == BIG ? BIG_SIZE : 3 + f % 3;
    for (uint32_t c = 0; c < count; c++) (*corners)[c] = c * 7919 % VERTICES;
    return mesh;
}

/* As anyone would write it, on one thread and with no buffers. */
static void put_plainly(const char *path, const qw_mesh_view *mesh, bool obj)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    if (!obj) fprintf(file, "OFF\n%u %u 0\n", mesh->vertex_count, mesh->face_count);
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; i++) {
        char number[QW_NUMBER_SIZE];
        size_t size = qw_number_print(number, mesh->positions[i]);
        fprintf(file, "%s%.*s%c", obj && i % 3 == 0 ? "v " : "", (int)size, number, i % 3 < 2 ? ' ' : '\n');
    }
    const uint32_t *corner = mesh->corners;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        if (obj) fputc('f', file);
        else fprintf(file, "%u", mesh->face_sizes[f]);
        for (uint32_t i = 0; i < mesh->face_sizes[f]; i++) fprintf(file, " %u", *corner++ + obj);
        fputc('\n', file);
    }
    assert_int_equal(fclose(file), 0);
}

static void check_same_files(const char *path, const char *other)
{
    enum { SIZE = 1 << 22 };
    char *a = malloc(SIZE), *b = malloc(SIZE);
    size_t size = get_file(path, a, SIZE);
    assert_true(size > 0 && size < SIZE - 1);
    assert_int_equal(get_file(other, b, SIZE), size);
    assert_memory_equal(a, b, size);
    free(a);
    free(b);
}

/* More blocks than are formatted at once. */
static void test_threads_change_no_byte(void **state)
{
    static const char *const names[] = {"a.obj", "a.off", "a.ply"};
    static const uint32_t threads[] = {1, 2, 5};
    double *positions;
    uint32_t *sizes, *corners;
    qw_mesh_view mesh = large_mesh(&positions, &sizes, &corners);
    char path[1024], plain[1024];
    in_folder(plain, "plain");
    for (int i = 0; i < 3; i++) {
        if (i < 2) put_plainly(plain, &mesh, i == 0);
        else expect(&(job){.env = *state, .path = plain, .format = QW_FORMAT_PLY, .mesh = &mesh}, QW_OK, "");
        for (int t = 0; t < 3; t++) {
            qw_env *env = qw_env_create(NULL, threads[t]);
            job back = {.env = env, .path = in_folder(path, names[i])};
            expect(&(job){.env = env, .path = path, .mesh = &mesh}, QW_OK, "");
            assert_int_equal(qw_env_bytes(env), 0);
            check_same_files(path, plain);
            expect(&back, QW_OK, "");
            check_same(&back.soup, &mesh);
            qw_env_destroy(env);
        }
    }
    free(positions), free(sizes), free(corners);
}

static void test_text_forms(void **state)
{
    static const double square[] = {0, 0, 0, 1, 0, 0, 1, 1.5, 0, 0, 1, -0.25};
    static const uint32_t corners[] = {0, 1, 2, 3};
    qw_mesh_view mesh = {.size = sizeof mesh,
                         .vertex_count = 4,
                         .face_count = 1,
                         .uniform_face_size = 4,
                         .positions = square,
                         .corners = corners};
    char path[1024], text[512];
    expect(&(job){.env = *state, .path = in_folder(path, "s"), .format = QW_FORMAT_OBJ, .mesh = &mesh}, QW_OK, "");
    get_file(path, text, sizeof text);
    assert_string_equal(text, "v 0 0 0\nv 1 0 0\nv 1 1.5 0\nv 0 1 -0.25\nf 1 2 3 4\n");
    expect(&(job){.env = *state, .path = path, .format = QW_FORMAT_OFF, .mesh = &mesh}, QW_OK, "");
    get_file(path, text, sizeof text);
    assert_string_equal(text, "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1.5 0\n0 1 -0.25\n4 0 1 2 3\n");
}

static void test_refused_formats(void **state)
{
    char path[1024];
    expect(&(job){.env = *state, .path = in_folder(path, "a.xyz"), .mesh = &mixed}, QW_FORMAT_UNKNOWN, "a.xyz");
    expect(&(job){.env = *state, .path = "obj", .mesh = &mixed}, QW_FORMAT_UNKNOWN, "obj");
    expect(&(job){.env = *state, .path = "", .mesh = &mixed}, QW_FORMAT_UNKNOWN, "");
    assert_int_equal(entries(), 0);
}

static void test_unwritable(void **state)
{
    char path[1024];
    expect(&(job){.env = *state, .path = in_folder(path, "no/such/a.obj"), .mesh = &mixed}, QW_FILE_UNWRITABLE,
           "No such file");
    expect(&(job){.env = *state, .path = folder, .format = QW_FORMAT_OBJ, .mesh = &mixed}, QW_FILE_UNWRITABLE,
           "directory");
    put_file(in_folder(path, "kept.obj"), "kept");
    chmod(path, 0444);
    if (access(path, W_OK) != 0)
        expect(&(job){.env = *state, .path = path, .mesh = &mixed}, QW_FILE_UNWRITABLE, "denied"); /* root may */
    assert_int_equal(entries(), 1);
}

static void test_full_device(void **state)
{
    if (access("/dev/full", W_OK) == 0)
        expect(&(job){.env = *state, .path = "/dev/full", .format = QW_FORMAT_PLY, .mesh = &mixed}, QW_FILE_UNWRITABLE,
               "/dev/full: cannot be written: No space left");
    expect(&(job){.env = *state, .path = "/dev/null", .format = QW_FORMAT_PLY, .mesh = &mixed}, QW_OK, "");
    struct stat info;
    assert_true(stat("/dev/null", &info) == 0 && S_ISCHR(info.st_mode));
}

/* Single precision has steps of a half at five millions, and ends at 3.4e38. */
static void test_stl_tells_corners_apart(void **state)
{
    static const uint32_t sizes[] = {4}, corners[] = {0, 1, 2, 3};
    static const double far[] = {0, 5e6, 5e6, 4e38}, side[] = {0.2, 0.2, 2, 1};
    char path[1024];
    in_folder(path, "far.stl");
    for (int i = 0; i < 4; i++) {
        double x = far[i], y = x + side[i];
        const double positions[12] = {x, 0, 0, y, 0, 0, y, 1, 0, x, 1, 0};
        qw_mesh_view mesh = {.size = sizeof mesh,
                             .vertex_count = 4,
                             .face_count = 1,
                             .positions = positions,
                             .face_sizes = sizes,
                             .corners = corners};
        bool holds = i == 0 || i == 2;
        expect(&(job){.env = *state, .path = path, .mesh = &mesh}, holds ? QW_OK : QW_UNSUPPORTED, holds ? "" : "PLY");
        assert_int_equal(access(path, F_OK), holds ? 0 : -1);
        if (holds) unlink(path);
    }
}

/* A limit on the size of files stands in for a full disk. */
static void test_failing_write_leaves_nothing(void **state)
{
    char path[1024], text[64];
    put_file(in_folder(path, "old.obj"), "what was there");
    struct rlimit before, limit;
    getrlimit(RLIMIT_FSIZE, &before);
    for (rlim_t bytes = 0; bytes < 400; bytes += 50) {
        limit = before;
        limit.rlim_cur = bytes;
        setrlimit(RLIMIT_FSIZE, &limit);
        job j = {.env = *state, .path = path, .mesh = &mixed};
        qw_status status = qw_protect(j.env, job_body, &j);
        setrlimit(RLIMIT_FSIZE, &before); /* the tests' own output has it too */
        if (status == QW_OK) break;
        assert_int_equal(status, QW_FILE_UNWRITABLE);
        assert_non_null(strstr(qw_env_message(j.env), "old.obj: cannot be written: File too large"));
        assert_int_equal(qw_env_bytes(j.env), 0);
        assert_int_equal(entries(), 1);
        get_file(path, text, sizeof text);
        assert_string_equal(text, "what was there");
        assert_true(bytes < 350);
    }
    assert_int_equal(entries(), 1);
}

/* In the midst of the vertices and of the faces, on several threads. */
static void test_failing_write_in_the_midst(void **state)
{
    (void)state;
    static const char *const names[] = {"a.obj", "a.off", "a.ply"};
    double *positions;
    uint32_t *sizes, *corners;
    qw_mesh_view mesh = large_mesh(&positions, &sizes, &corners);
    qw_env *env = qw_env_create(NULL, 3);
    struct rlimit before, limit;
    getrlimit(RLIMIT_FSIZE, &before);
    for (int i = 0; i < 6; i++) {
        char path[1024];
        job j = {.env = env, .path = in_folder(path, names[i % 3]), .mesh = &mesh};
        limit = before;
        limit.rlim_cur = i < 3 ? 200000 : 800000;
        setrlimit(RLIMIT_FSIZE, &limit);
        qw_status status = qw_protect(env, job_body, &j);
        setrlimit(RLIMIT_FSIZE, &before);
        assert_int_equal(status, QW_FILE_UNWRITABLE);
        assert_non_null(strstr(qw_env_message(env), "cannot be written: File too large"));
        assert_int_equal(qw_env_bytes(env), 0);
        assert_int_equal(entries(), 0);
    }
    qw_env_destroy(env);
    free(positions), free(sizes), free(corners);
}

/* The host keeps its dispositions, its mask and a signal of its own that waits. */
static void test_signals_stay_the_hosts(void **state)
{
    char path[1024];
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    close(ends[0]);
    snprintf(path, sizeof path, "/dev/fd/%d", ends[1]);
    for (int waits = 0; waits < 2; waits++) {
        sigset_t pipe_set, before, after, waiting;
        sigemptyset(&pipe_set);
        sigaddset(&pipe_set, SIGPIPE);
        if (waits) {
            sigprocmask(SIG_BLOCK, &pipe_set, NULL);
            raise(SIGPIPE);
        }
        sigprocmask(SIG_BLOCK, NULL, &before);
        expect(&(job){.env = *state, .path = path, .format = QW_FORMAT_OBJ, .mesh = &mixed}, QW_FILE_UNWRITABLE,
               "Broken pipe");
        sigprocmask(SIG_BLOCK, NULL, &after);
        for (int s = 1; s < 32; s++) assert_int_equal(sigismember(&before, s), sigismember(&after, s));
        sigpending(&waiting);
        assert_int_equal(sigismember(&waiting, SIGPIPE), waits);
        if (!waits) continue;
        signal(SIGPIPE, SIG_IGN); /* drops it */
        signal(SIGPIPE, SIG_DFL);
        sigprocmask(SIG_UNBLOCK, &pipe_set, NULL);
    }
    close(ends[1]);
}

/* Neither end of a FIFO keeps the host waiting: one without a reader, one that is full, one without a writer. */
static void test_fifos_are_called_off(void **state)
{
    (void)state;
    char path[1024];
    double *positions;
    uint32_t *sizes, *corners;
    qw_mesh_view mesh = large_mesh(&positions, &sizes, &corners);
    assert_int_equal(mkfifo(in_folder(path, "fifo"), 0600), 0);
    for (int kind = 0; kind < 3; kind++) {
        faults f = {.allocations = FAULTS_NONE, .reports = 2};
        int reader = kind == 1 ? open(path, O_RDONLY | O_NONBLOCK) : -1;
        const qw_host host = faults_host(&f);
        job j = {
            .env = qw_env_create(&host, 1), .path = path, .format = QW_FORMAT_OBJ, .mesh = kind < 2 ? &mesh : NULL};
        expect(&j, QW_CANCELLED, "a file was read or written");
        qw_env_destroy(j.env);
        if (reader >= 0) close(reader);
    }
    assert_int_equal(entries(), 1);
    free(positions), free(sizes), free(corners);
}

/* A link to a file that does not exist yet stays a link. */
static void test_dangling_link(void **state)
{
    char link[1024], target[1024];
    assert_int_equal(symlink("later.obj", in_folder(link, "link.obj")), 0);
    expect(&(job){.env = *state, .path = link, .mesh = &mixed}, QW_OK, "");
    struct stat info;
    assert_true(lstat(link, &info) == 0 && S_ISLNK(info.st_mode));
    assert_true(lstat(in_folder(target, "later.obj"), &info) == 0 && S_ISREG(info.st_mode));
    assert_int_equal(symlink("round.obj", in_folder(link, "round.obj")), 0);
    expect(&(job){.env = *state, .path = link, .mesh = &mixed}, QW_FILE_UNWRITABLE, "symbolic links");
    assert_int_equal(entries(), 3);
}

static bool is_same(qw_env *env, const char *a, const char *b)
{
    char path[1024], other[1024];
    return qw_file_is_same(env, in_folder(path, a), in_folder(other, b)) &&
           qw_file_is_same(env, in_folder(path, b), in_folder(other, a));
}

static void test_same_files(void **state)
{
    qw_env *env = *state;
    char a[1024], b[1024];
    put_file(in_folder(a, "a"), "a");
    put_file(in_folder(b, "b"), "b");
    assert_false(is_same(env, "a", "b"));
    assert_true(is_same(env, "a", "./a"));
    assert_int_equal(symlink("a", in_folder(b, "soft")), 0);
    assert_true(is_same(env, "a", "soft"));
    assert_int_equal(link(a, in_folder(b, "hard")), 0);
    assert_true(is_same(env, "hard", "soft"));
    assert_int_equal(symlink("new", in_folder(b, "to_new")), 0);
    assert_true(is_same(env, "new", "to_new") && is_same(env, "new", ".//new") && is_same(env, "new", "NEW"));
    assert_false(is_same(env, "new", "newer"));
    assert_false(is_same(env, "new", "nowhere/new"));
    assert_false(is_same(env, "a", "new"));
    assert_false(qw_file_is_same(env, "/dev/null", "/dev/null"));
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    snprintf(a, sizeof a, "/dev/fd/%d", ends[1]);
    snprintf(b, sizeof b, "/proc/self/fd/%d", ends[1]);
    assert_true(qw_file_is_same(env, a, b));
    close(ends[0]), close(ends[1]);
}

/* Names in messages are UTF-8 without control characters. */
static void test_names_are_printable(void **state)
{
    expect(&(job){.env = *state, .path = "no\x1b[31mthing\xff\n\xc2\x9b\xe2\x82\xac.obj"}, QW_FILE_MISSING,
           "no\\x1b[31mthing\\xff\\x0a\\xc2\\x9b\xe2\x82\xac.obj");
}

static void test_link_and_mode_stay(void **state)
{
    char target[1024], link[1024];
    put_file(in_folder(target, "target.obj"), "old");
    chmod(target, 0640);
    assert_int_equal(symlink("target.obj", in_folder(link, "link.obj")), 0);
    expect(&(job){.env = *state, .path = link, .mesh = &mixed}, QW_OK, "");
    struct stat info;
    assert_true(lstat(link, &info) == 0 && S_ISLNK(info.st_mode));
    assert_true(lstat(target, &info) == 0 && S_ISREG(info.st_mode) && (info.st_mode & 0777) == 0640);
    job back = {.env = *state, .path = target};
    expect(&back, QW_OK, "");
    check_same(&back.soup, &mixed);
    assert_int_equal(entries(), 2);
}

static void test_temporary_names_taken(void **state)
{
    char path[1024], taken[1024 + 64];
    in_folder(path, "a.obj");
    for (int i = 0; i < 3; i++) {
        snprintf(taken, sizeof taken, "%s/quadwright-%ld-%d.part", folder, (long)getpid(), i);
        put_file(taken, "of another");
    }
    expect(&(job){.env = *state, .path = path, .mesh = &mixed}, QW_OK, "");
    assert_int_equal(entries(), 4);
}

static void test_standard_output(void **state)
{
    char path[1024];
    fflush(stdout);
    int saved = dup(STDOUT_FILENO), file = open(in_folder(path, "out"), O_WRONLY | O_CREAT, 0600);
    dup2(file, STDOUT_FILENO);
    job j = {.env = *state, .path = "-", .mesh = &mixed};
    qw_status status = qw_protect(j.env, job_body, &j);
    dup2(saved, STDOUT_FILENO);
    close(saved), close(file);
    assert_int_equal(status, QW_OK);
    job back = {.env = *state, .path = path};
    expect(&back, QW_OK, "");
    check_same(&back.soup, &mixed);
}

static void test_longest_name(void **state)
{
    char path[1024], name[256];
    memset(name, 'n', 251);
    strcpy(name + 251, ".obj");
    expect(&(job){.env = *state, .path = in_folder(path, name), .mesh = &mixed}, QW_OK, "");
    assert_int_equal(entries(), 1);
}

static int next_descriptor(void)
{
    int descriptor = open("/dev/null", O_RDONLY);
    close(descriptor);
    return descriptor;
}

static void test_memory_runs_out(void **state)
{
    (void)state;
    char path[1024];
    in_folder(path, "a.obj");
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE, .is_lasting = true};
    qw_host host = faults_host(&f);
    qw_env *env = qw_env_create(&host, 1);
    int before = next_descriptor();
    for (int i = 0; i < 2; i++) { /* written, then read */
        job j = {.env = env, .path = path, .mesh = i == 0 ? &mixed : NULL};
        qw_status status = QW_MEMORY;
        for (int64_t allowed = 0; status != QW_OK; allowed++) {
            f.allocations = (long)allowed;
            status = qw_protect(env, job_body, &j);
            assert_true(status == QW_OK || status == QW_MEMORY);
            assert_int_equal(next_descriptor(), before);
            assert_int_equal(entries(), i == 1 || status == QW_OK);
            if (status != QW_OK) assert_int_equal(qw_env_bytes(env), 0);
        }
    }
    qw_env_destroy(env);
}

/* Neither descriptors nor blocks are left by reading or writing, however it ends. */
static void test_descriptors_are_closed(void **state)
{
    char path[1024];
    int before = next_descriptor();
    for (int i = 0; i < 5; i++) {
        expect(&(job){.env = *state, .path = folder}, QW_FILE_IS_DIRECTORY, "");
        expect(&(job){.env = *state, .path = "/dev/null"}, QW_FILE_EMPTY, "");
        expect(&(job){.env = *state, .path = in_folder(path, "a.obj"), .mesh = &mixed}, QW_OK, "");
        if (access("/dev/full", W_OK) == 0)
            expect(&(job){.env = *state, .path = "/dev/full", .format = QW_FORMAT_OBJ, .mesh = &mixed},
                   QW_FILE_UNWRITABLE, "");
    }
    assert_int_equal(next_descriptor(), before);
    assert_int_equal(qw_env_bytes(*state), 0);
}

#define FILES_TEST(test) cmocka_unit_test_setup_teardown(test, begin, end)

QW_TEST_SUITE(file_io)
{
    const struct CMUnitTest tests[] = {
        FILES_TEST(test_missing),
        FILES_TEST(test_directory),
        FILES_TEST(test_unreadable),
        FILES_TEST(test_empty),
        FILES_TEST(test_names_lie),
        FILES_TEST(test_long_path),
        FILES_TEST(test_standard_input),
        FILES_TEST(test_round_trip),
        FILES_TEST(test_large_round_trip),
        FILES_TEST(test_threads_change_no_byte),
        FILES_TEST(test_stl_tells_corners_apart),
        FILES_TEST(test_text_forms),
        FILES_TEST(test_refused_formats),
        FILES_TEST(test_unwritable),
        FILES_TEST(test_full_device),
        FILES_TEST(test_failing_write_leaves_nothing),
        FILES_TEST(test_failing_write_in_the_midst),
        FILES_TEST(test_signals_stay_the_hosts),
        FILES_TEST(test_fifos_are_called_off),
        FILES_TEST(test_dangling_link),
        FILES_TEST(test_same_files),
        FILES_TEST(test_names_are_printable),
        FILES_TEST(test_link_and_mode_stay),
        FILES_TEST(test_temporary_names_taken),
        FILES_TEST(test_standard_output),
        FILES_TEST(test_longest_name),
        FILES_TEST(test_memory_runs_out),
        FILES_TEST(test_descriptors_are_closed),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
