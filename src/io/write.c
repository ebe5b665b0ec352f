/* Meshes to files. */
#include "io/file.h"
#include "io/number.h"
#include "io/soup.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { LINE_SIZE = 256, INTEGER_SIZE = 12, MOST_CORNERS_IN_BYTE = 255 };

static char *put_integer(char *at, uint32_t value)
{
    char digits[INTEGER_SIZE];
    int count = 0;
    do digits[count++] = (char)('0' + value % 10);
    while (value /= 10);
    while (count) *at++ = digits[--count];
    return at;
}

static uint32_t face_size(const qw_mesh_view *mesh, uint32_t face)
{
    return mesh->face_sizes ? mesh->face_sizes[face] : mesh->uniform_face_size;
}

static void put_text_vertices(qw_file *file, const qw_mesh_view *mesh, const char *before)
{
    size_t size = strlen(before);
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        char *line = qw_file_room(file, LINE_SIZE), *at = line;
        memcpy(at, before, size);
        at += size;
        for (int i = 0; i < 3; i++) {
            at += qw_number_print(at, mesh->positions[3 * v + i]);
            *at++ = i < 2 ? ' ' : '\n';
        }
        qw_file_filled(file, (size_t)(at - line));
    }
}

static void put_obj(qw_file *file, const qw_mesh_view *mesh)
{
    put_text_vertices(file, mesh, "v ");
    const uint32_t *corner = mesh->corners;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        *qw_file_room(file, 1) = 'f';
        qw_file_filled(file, 1);
        for (uint32_t size = face_size(mesh, f), i = 0; i < size; i++) {
            char *room = qw_file_room(file, LINE_SIZE), *at = room;
            *at++ = ' ';
            at = put_integer(at, *corner++ + 1);
            if (i + 1 == size) *at++ = '\n';
            qw_file_filled(file, (size_t)(at - room));
        }
    }
}

static void put_off(qw_file *file, const qw_mesh_view *mesh)
{
    char *header = qw_file_room(file, LINE_SIZE);
    qw_file_filled(file, (size_t)snprintf(header, LINE_SIZE, "OFF\n%" PRIu32 " %" PRIu32 " 0\n", mesh->vertex_count, mesh->face_count));
    put_text_vertices(file, mesh, "");
    const uint32_t *corner = mesh->corners;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t size = face_size(mesh, f);
        char *room = qw_file_room(file, LINE_SIZE);
        qw_file_filled(file, (size_t)(put_integer(room, size) - room));
        for (uint32_t i = 0; i < size; i++) {
            char *at = room = qw_file_room(file, LINE_SIZE);
            *at++ = ' ';
            at = put_integer(at, *corner++);
            if (i + 1 == size) *at++ = '\n';
            qw_file_filled(file, (size_t)(at - room));
        }
    }
}

static void store(char *at, uint64_t bits, int size)
{
    for (int i = 0; i < size; i++) at[i] = (char)(bits >> 8 * i);
}

/* Binary and little-endian on every machine. The length of a face is a byte, as most readers expect, where that is enough. */
static void put_ply(qw_file *file, const qw_mesh_view *mesh)
{
    bool wide = false;
    for (uint32_t f = 0; f < mesh->face_count; f++) wide |= face_size(mesh, f) > MOST_CORNERS_IN_BYTE;
    char *header = qw_file_room(file, 2 * LINE_SIZE);
    qw_file_filled(file, (size_t)snprintf(header, 2 * LINE_SIZE,
                                          "ply\nformat binary_little_endian 1.0\nelement vertex %" PRIu32
                                          "\nproperty double x\nproperty double y\nproperty double z\nelement face %" PRIu32
                                          "\nproperty list %s int vertex_indices\nend_header\n",
                                          mesh->vertex_count, mesh->face_count, wide ? "int" : "uchar"));
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; i++) {
        uint64_t bits;
        memcpy(&bits, &mesh->positions[i], sizeof bits);
        store(qw_file_room(file, 8), bits, 8);
        qw_file_filled(file, 8);
    }
    const uint32_t *corner = mesh->corners;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        uint32_t size = face_size(mesh, f);
        store(qw_file_room(file, 4), size, wide ? 4 : 1);
        qw_file_filled(file, wide ? 4 : 1);
        for (uint32_t i = 0; i < size; i++) {
            store(qw_file_room(file, 4), *corner++, 4);
            qw_file_filled(file, 4);
        }
    }
}

qw_format qw_format_of_path(qw_env *env, const char *path)
{
    static const struct {
        const char *extension;
        qw_format format;
    } formats[] = {{".obj", QW_FORMAT_OBJ}, {".ply", QW_FORMAT_PLY}, {".off", QW_FORMAT_OFF}, {".stl", QW_FORMAT_STL}};
    if (strcmp(path, "-") == 0) return QW_FORMAT_OBJ;
    size_t size = strlen(path);
    for (size_t i = 0; i < sizeof formats / sizeof *formats && size >= 4; i++) {
        size_t same = 0;
        while (same < 4 && (path[size - 4 + same] | (same ? 0x20 : 0)) == formats[i].extension[same]) same++;
        if (same == 4) return formats[i].format;
    }
    qw_fail(env, QW_FORMAT_UNKNOWN, -1, "%s: the name ends in none of .obj, .ply and .off, so say which format to write",
            qw_path_for_messages(env, path, "-"));
}

void qw_write(qw_env *env, const char *path, qw_format format, const qw_mesh_view *mesh)
{
    if (format == QW_FORMAT_AUTO) format = qw_format_of_path(env, path);
    if (format == QW_FORMAT_STL) qw_fail(env, QW_UNSUPPORTED, -1, "STL holds no quads and is not written; use OBJ, PLY or OFF");
    qw_scope_begin(env);
    qw_file *file = qw_file_begin(env, path);
    if (format == QW_FORMAT_PLY)
        put_ply(file, mesh);
    else if (format == QW_FORMAT_OFF)
        put_off(file, mesh);
    else
        put_obj(file, mesh);
    qw_file_finish(file);
    qw_scope_end(env);
}
