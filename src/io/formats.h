/* The readers and writers of the single formats. Readers fail, or return a soup in the caller's scope. */
#pragma once

#include "io/file.h"
#include "io/soup.h"

/* bytes.at[bytes.size] is 0 for all of them. */
qw_soup qw_read_obj(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_ply(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_ply_points(qw_env *env, const char *name, qw_bytes bytes); /* without faces */
bool qw_is_pcd(qw_bytes bytes);
qw_soup qw_read_pcd(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_xyz(qw_env *env, const char *name, qw_bytes bytes); /* lines of numbers, or the vertices of an OBJ */
qw_soup qw_read_off(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_stl_text(qw_env *env, const char *name, qw_bytes bytes);
qw_soup qw_read_stl_binary(qw_env *env, const char *name, qw_bytes bytes);

/* Do the contents look like it? The first sure sign counts, so the order of the questions matters: see read.c. */
bool qw_is_stl_binary(qw_bytes bytes);      /* of exactly the announced length */
bool qw_is_stl_binary_bent(qw_bytes bytes); /* cut or continued, but with a sound first triangle */
bool qw_is_stl_text(qw_env *env, qw_bytes bytes);
bool qw_is_ply(qw_bytes bytes);
bool qw_is_off(qw_env *env, qw_bytes bytes);
bool qw_is_off_bare(qw_env *env, qw_bytes bytes); /* without its first word: three counts */
bool qw_is_obj(qw_env *env, qw_bytes bytes);

/* Binary STL: quads in two along their shorter diagonals. */
void qw_put_stl(qw_env *env, qw_file *file, const qw_mesh_view *mesh);

/* OBJ, PLY or OFF with attributes of the mesh: write_attributes.c. In the caller's scope. */
void qw_put_with(qw_env *env, qw_file *file, qw_format format, const qw_mesh_view *mesh, const qw_attribute *attributes,
                 uint32_t count, const char *library);
