/* Meshes to files.
 *
 * Vertices, then corners, are written in blocks of so many that their bytes fit into a buffer, several blocks at a time
 * on the run's threads; the buffers go to the file in order. Corners rather than faces, which may be of any size.
 */
#include "base/mesh_view.h"
#include "io/elements.h"
#include "io/file.h"
#include "io/formats.h"
#include "io/gltf/gltf.h"
#include "io/number.h"
#include "io/soup.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum {
    HEADER_SIZE = 512,
    INTEGER_SIZE = 10,
    MOST_CORNERS_IN_BYTE = 255,
    MAX_VERTEX_SIZE =
        2 + 3 * (QW_NUMBER_SIZE +
                 1), /* "v ", and after each number a blank or the end of the line; no less than three doubles */
    MAX_CORNER_SIZE =
        2 * (INTEGER_SIZE + 1), /* of a face's only corner in OFF: its size, a blank, the index, the end of the line */
    BLOCK_SIZE = 1 << 15,       /* in bytes, at most */
    VERTEX_GRAIN = BLOCK_SIZE / MAX_VERTEX_SIZE,
    CORNER_GRAIN = BLOCK_SIZE / MAX_CORNER_SIZE,
    BLOCKS_AT_ONCE = 32
};

/* Where a block of corners begins. */
typedef struct place {
    uint32_t face, corner; /* corner: of the face, from 0 */
} place;

typedef struct writer {
    qw_env *env;
    qw_file *file;
    const qw_mesh_view *mesh;
    qw_format format;
    const place *start; /* place[blocks of corners] */
    int length_size;    /* bytes of a face's length in PLY */
} writer;

/* Puts elements begin .. end - 1 at `at`, and returns where they end. */
typedef char *(*element_printer)(const writer *w, char *at, uint32_t begin, uint32_t end);

/* ---- elements */

static char *put_integer(char *at, uint32_t value)
{
    char digits[INTEGER_SIZE];
    int count = 0;
    do digits[count++] = (char)('0' + value % 10);
    while (value /= 10);
    while (count) *at++ = digits[--count];
    return at;
}

/* Little-endian on every machine. */
static char *put_binary(char *at, uint64_t bits, int size)
{
    for (int i = 0; i < size; i++) *at++ = (char)(bits >> 8 * i);
    return at;
}

static char *put_binary_vertices(const writer *w, char *at, uint32_t begin, uint32_t end)
{
    for (size_t i = 3 * (size_t)begin; i < 3 * (size_t)end; i++) {
        uint64_t bits;
        memcpy(&bits, &w->mesh->positions[i], sizeof bits);
        at = put_binary(at, bits, 8);
    }
    return at;
}

static char *put_text_vertices(const writer *w, char *at, uint32_t begin, uint32_t end)
{
    for (size_t v = begin; v < end; v++) {
        if (w->format != QW_FORMAT_OFF) *at++ = 'v', *at++ = ' ';
        for (int i = 0; i < 3; i++) {
            at += qw_number_print(at, w->mesh->positions[3 * v + i]);
            *at++ = i < 2 ? ' ' : '\n';
        }
    }
    return at;
}

static char *put_face_begin(const writer *w, char *at, uint32_t size)
{
    if (w->format == QW_FORMAT_PLY) return put_binary(at, size, w->length_size);
    if (w->format == QW_FORMAT_OFF) return put_integer(at, size);
    *at++ = 'f';
    return at;
}

/* Writes corners begin .. end of all faces at `at`, with what stands before and behind a face. Returns the end. */
static char *put_corners(const writer *w, char *at, uint32_t begin, uint32_t end)
{
    const uint32_t *corners = w->mesh->corners;
    place p = w->start[begin / CORNER_GRAIN];
    for (uint32_t c = begin; c < end; c++) {
        uint32_t size = qw_view_face_size(w->mesh, p.face);
        if (p.corner == 0) at = put_face_begin(w, at, size);
        bool last = ++p.corner == size;
        if (w->format == QW_FORMAT_PLY) {
            at = put_binary(at, corners[c], 4);
        } else {
            *at++ = ' ';
            at = put_integer(at, corners[c] + (w->format != QW_FORMAT_OFF));
            if (last) *at++ = '\n';
        }
        if (last) p = (place){p.face + 1, 0};
    }
    return at;
}

/* ---- blocks */

typedef struct batch {
    const writer *writer;
    element_printer print;
    uint32_t first; /* element */
    uint32_t grain; /* elements a block */
    size_t room;    /* bytes a block */
    char *bytes;    /* char[BLOCKS_AT_ONCE][room]; fewer where there are fewer blocks in all */
    size_t size[BLOCKS_AT_ONCE];
} batch;

static void print_block(void *user, uint32_t begin, uint32_t end)
{
    batch *b = user;
    uint32_t block = begin / b->grain;
    char *bytes = b->bytes + block * b->room;
    b->size[block] = (size_t)(b->print(b->writer, bytes, b->first + begin, b->first + end) - bytes);
    assert(b->size[block] <= b->room);
}

/* max_size: of an element, in bytes. */
static void put_elements(const writer *w, element_printer print, uint32_t count, uint32_t grain, size_t max_size)
{
    uint32_t blocks = qw_block_count(count, grain);
    batch b = {.writer = w, .print = print, .grain = grain, .room = max_size * (count < grain ? count : grain)};
    b.bytes = qw_alloc(w->env, blocks < BLOCKS_AT_ONCE ? blocks : BLOCKS_AT_ONCE, b.room);
    for (uint32_t left = count; left > 0;) {
        uint32_t n = left < BLOCKS_AT_ONCE * grain ? left : BLOCKS_AT_ONCE * grain;
        qw_parallel(w->env, n, grain, print_block, &b);
        for (uint32_t i = 0; i < qw_block_count(n, grain); i++) qw_file_put(w->file, b.bytes + i * b.room, b.size[i]);
        b.first += n, left -= n;
    }
    qw_free(w->env, b.bytes);
}

/* For each block of corners the face and the corner of it with which it begins, so that blocks are written side by
   side. */
static const place *find_starts(qw_env *env, const qw_mesh_view *mesh, uint32_t corner_count)
{
    place *start = QW_NEW(env, place, qw_block_count(corner_count, CORNER_GRAIN));
    uint64_t begin = 0, next = 0; /* corners: the face's first, the next block's first */
    uint32_t block = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint64_t end = begin + qw_view_face_size(mesh, f);
        for (; next < end; next += CORNER_GRAIN) start[block++] = (place){f, (uint32_t)(next - begin)};
        begin = end;
    }
    assert(begin == corner_count);
    return start;
}

/* ---- formats */

/* The length of a face is a byte in PLY, as most readers expect, where that is enough. */
static void put_header(const writer *w)
{
    const qw_mesh_view *mesh = w->mesh;
    char header[HEADER_SIZE];
    int size = 0;
    if (w->format == QW_FORMAT_OFF)
        size = snprintf(header, sizeof header, "OFF\n%" PRIu32 " %" PRIu32 " 0\n", mesh->vertex_count,
                        mesh->face_count);
    if (w->format == QW_FORMAT_PLY)
        size = snprintf(header, sizeof header,
                        "ply\nformat binary_little_endian 1.0\nelement vertex %" PRIu32
                        "\nproperty double x\nproperty double y\nproperty double z\nelement face %" PRIu32
                        "\nproperty list %s int vertex_indices\nend_header\n",
                        mesh->vertex_count, mesh->face_count, w->length_size > 1 ? "int" : "uchar");
    qw_file_put(w->file, header, (size_t)size);
}

/* Writes header, vertices and faces, in blocks on all threads. */
static void put_mesh(writer *w)
{
    const qw_mesh_view *mesh = w->mesh;
    uint32_t corner_count = 0, largest = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t size = qw_view_face_size(mesh, f);
        corner_count += size;
        if (size > largest) largest = size;
    }
    w->length_size = largest > MOST_CORNERS_IN_BYTE ? 4 : 1;
    w->start = find_starts(w->env, mesh, corner_count);
    put_header(w);
    put_elements(w, w->format == QW_FORMAT_PLY ? put_binary_vertices : put_text_vertices, mesh->vertex_count,
                 VERTEX_GRAIN, MAX_VERTEX_SIZE);
    put_elements(w, put_corners, corner_count, CORNER_GRAIN, MAX_CORNER_SIZE);
}

/* Marked edges as tags of OpenSubdiv's, which counts vertices from 0 there; 10 is without end. */
static void put_creases(const writer *w)
{
    const qw_mesh_view *m = w->mesh;
    char line[64];
    for (uint32_t i = 0; i < m->marked_edge_count; i++) {
        uint32_t a = m->marked_edges[2 * (size_t)i], b = m->marked_edges[2 * (size_t)i + 1];
        int size = a == b ? snprintf(line, sizeof line, "t corner 1/1/0 %" PRIu32 " 10\n", a)
                          : snprintf(line, sizeof line, "t crease 2/1/0 %" PRIu32 " %" PRIu32 " 10\n", a, b);
        qw_file_put(w->file, line, (size_t)size);
    }
}

/* By the name's extension. */
static qw_format format_of_path(qw_env *env, const char *path)
{
    static const struct {
        const char *extension;
        qw_format format;
    } formats[] = {{".obj", QW_FORMAT_OBJ}, {".ply", QW_FORMAT_PLY},   {".off", QW_FORMAT_OFF}, {".stl", QW_FORMAT_STL},
                   {".glb", QW_FORMAT_GLB}, {".gltf", QW_FORMAT_GLTF}, {".msh", QW_FORMAT_MSH}, {".vtu", QW_FORMAT_VTU},
                   {".inp", QW_FORMAT_INP}, {".bdf", QW_FORMAT_BDF}};
    if (strcmp(path, "-") == 0) return QW_FORMAT_OBJ;
    size_t size = strlen(path);
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
        size_t length = strlen(formats[i].extension), same = 0;
        if (size < length) continue;
        while (same < length && (path[size - length + same] | (same ? 0x20 : 0)) == formats[i].extension[same]) same++;
        if (same == length) return formats[i].format;
    }
    qw_fail(env, QW_FORMAT_UNKNOWN, -1,
            "%s: the name ends in none of .obj, .ply, .off, .stl, .glb and .gltf, so say which format to write",
            qw_path_for_messages(env, path, "-"));
}

void qw_write_with(qw_env *env, const char *path, qw_format format, const qw_mesh_view *mesh,
                   const qw_carried_along *along)
{
    if ((unsigned)format > QW_FORMAT_BDF) qw_fail(env, QW_ARGUMENT, -1, "there is no format %d to write", (int)format);
    if (format == QW_FORMAT_AUTO) format = format_of_path(env, path);
    qw_scope_begin(env);
    writer w = {.env = env, .file = qw_file_begin(env, path), .mesh = mesh, .format = format};
    if (format == QW_FORMAT_GLB || format == QW_FORMAT_GLTF)
        qw_put_gltf(env, w.file, format == QW_FORMAT_GLB, mesh, along->attributes, along->count, along->gltf);
    else if (format == QW_FORMAT_STL) qw_put_stl(env, w.file, mesh);
    else if (format >= QW_FORMAT_MSH)
        qw_put_elements(env, w.file, format, mesh, along->attributes, along->count, along->second_order);
    else if (along->count > 0 || along->library)
        qw_put_with(env, w.file, format, mesh, along->attributes, along->count, along->library);
    else put_mesh(&w);
    if (format == QW_FORMAT_OBJ) put_creases(&w);
    qw_file_finish(w.file);
    qw_scope_end(env);
}

void qw_write(qw_env *env, const char *path, qw_format format, const qw_mesh_view *mesh)
{
    qw_write_with(env, path, format, mesh, &(qw_carried_along){0});
}
