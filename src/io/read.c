/* Which format it is, and the reading of it. */
#include "io/formats.h"
#include "io/gltf/gltf.h"

#include <string.h>

#define QW_WRITTEN_ONLY(format) format " is written, not read; save the surface as STL, PLY or OBJ"

/* What people hand in that is none of ours, so that the message can say more than "unknown"; NULL: who knows. */
static const char *stranger(qw_bytes bytes)
{
    static const struct {
        const char *begin, *what;
    } strangers[] = {
        {"\x1f\x8b", "it is compressed by gzip; unpack it first"},
        {"PK\x03\x04", "it is a zip archive (or 3MF); unpack it first"},
        {"Kaydara FBX", "it is FBX"},
        {"BLENDER", "it is a Blender file"},
        {"version https://git-lfs", "it only points to a file in Git LFS"},
        {"<", "it is XML or HTML"},
        {"<?xml version=\"1.0\"?>\n<VTKFile", QW_WRITTEN_ONLY("VTU")},
        {"<VTKFile", QW_WRITTEN_ONLY("VTU")},
        {"$", QW_WRITTEN_ONLY("Nastran's .bdf")},
        {"$MeshFormat", QW_WRITTEN_ONLY("Gmsh's .msh")},
        {"*", QW_WRITTEN_ONLY("Abaqus' .inp")},
        {"BEGIN BULK", QW_WRITTEN_ONLY("Nastran's .bdf")},
        {"# vtk DataFile", "it is VTK's own format; save the surface as STL, PLY or OBJ"},
        {"MeshVersionFormatted", "it is a .mesh of Medit; save the surface as STL, PLY or OBJ"},
        {"    -1\n", "it is a universal file (.unv); save the surface as STL, PLY or OBJ"},
        {"ISO-10303-21", "STEP is written, not read; an STL of it is made by: gmsh FILE.step -2 -o FILE.stl"},
    };
    const char *what = NULL;
    for (size_t i = 0; i < sizeof strangers / sizeof *strangers; i++)
        if (strncmp(bytes.at, strangers[i].begin, strlen(strangers[i].begin)) == 0) what = strangers[i].what;
    return what;
}

static _Noreturn void fail_unknown(qw_env *env, const char *name, const char *what)
{
    qw_fail(env, QW_FORMAT_UNKNOWN, -1, "%s: the format is unknown: %s", name,
            what ? what : "it is neither OBJ, PLY, OFF, STL, GLB nor glTF");
}

/* From the surest sign to the weakest. A text that is as long as it would be as binary STL has some eight billion
   bytes, for the count would be four printable characters. */
static qw_soup read_any(qw_env *env, const char *name, const char *path, qw_bytes bytes)
{
    if (bytes.size == 0) qw_fail(env, QW_FILE_EMPTY, -1, "%s: the file is empty", name);
    if (qw_is_stl_binary(bytes)) return qw_read_stl_binary(env, name, bytes);
    if (qw_is_glb(bytes) || qw_is_gltf(bytes)) return qw_read_gltf(env, name, path, bytes);
    if (qw_is_ply(bytes)) return qw_read_ply(env, name, bytes);
    if (qw_is_off(env, bytes)) return qw_read_off(env, name, bytes);
    if (qw_is_stl_binary_bent(bytes)) return qw_read_stl_binary(env, name, bytes);
    if (qw_is_stl_text(env, bytes)) return qw_read_stl_text(env, name, bytes);
    if (qw_is_off_bare(env, bytes)) return qw_read_off(env, name, bytes);
    if (qw_is_obj(env, bytes)) return qw_read_obj(env, name, bytes);
    fail_unknown(env, name, stranger(bytes));
}

/* Lets a soup and all it points at live on as the scope of reading ends. */
static qw_soup keep(qw_env *env, qw_soup soup)
{
    qw_keep(env, soup.position);
    qw_keep(env, soup.face_begin);
    qw_keep(env, soup.corner);
    qw_keep(env, soup.mark);
    qw_keep(env, soup.library);
    qw_keep(env, soup.attribute);
    for (uint32_t i = 0; i < soup.attribute_count; i++) {
        const qw_attribute *a = &soup.attribute[i];
        qw_keep(env, (void *)a->name), qw_keep(env, (void *)a->values), qw_keep(env, (void *)a->labels);
        qw_keep(env, (void *)a->group), qw_keep(env, (void *)a->label_names);
        if (a->label_names) qw_keep(env, (void *)a->label_names[0]); /* the names are one block */
    }
    qw_gltf_each_block(env, soup.gltf, qw_keep);
    qw_scope_end(env);
    return soup;
}

qw_soup qw_read(qw_env *env, const char *path)
{
    qw_scope_begin(env);
    const char *name = qw_path_for_messages(env, path, "standard input");
    return keep(env, read_any(env, name, path, qw_file_read(env, path, name)));
}

/* With zeros behind them, as a file is read. */
static qw_bytes copied(qw_env *env, const void *bytes, size_t size, const char *name)
{
    if (size > SIZE_MAX / 4) qw_fail(env, QW_TOO_LARGE, -1, "%s: %zu bytes are more than can be addressed", name, size);
    char *copy = qw_alloc(env, size + QW_ZEROS, 1);
    if (size) memcpy(copy, bytes, size);
    memset(copy + size, 0, QW_ZEROS);
    return (qw_bytes){copy, size};
}

qw_soup qw_read_memory(qw_env *env, const void *bytes, size_t size, const char *name)
{
    qw_scope_begin(env);
    return keep(env, read_any(env, name, NULL, copied(env, bytes, size, name)));
}

/* Ends the scope that was begun. */
static qw_soup read_points(qw_env *env, const char *name, qw_bytes bytes)
{
    if (bytes.size == 0) qw_fail(env, QW_FILE_EMPTY, -1, "%s: the file is empty", name);
    if (qw_is_ply(bytes)) return keep(env, qw_read_ply_points(env, name, bytes));
    if (qw_is_pcd(bytes)) return keep(env, qw_read_pcd(env, name, bytes));
    if (qw_is_stl_binary(bytes) || qw_is_glb(bytes) || qw_is_gltf(bytes) || qw_is_off(env, bytes) ||
        qw_is_stl_text(env, bytes))
        qw_fail(env, QW_FORMAT_UNKNOWN, -1, "%s: points are read from PLY, PCD, OBJ and XYZ only", name);
    if (stranger(bytes)) fail_unknown(env, name, stranger(bytes)); /* which may have lines of three numbers */
    return keep(env, qw_read_xyz(env, name, bytes));
}

qw_soup qw_read_points(qw_env *env, const char *path)
{
    qw_scope_begin(env);
    const char *name = qw_path_for_messages(env, path, "standard input");
    return read_points(env, name, qw_file_read(env, path, name));
}

qw_soup qw_read_points_memory(qw_env *env, const void *bytes, size_t size, const char *name)
{
    qw_scope_begin(env);
    return read_points(env, name, copied(env, bytes, size, name));
}
