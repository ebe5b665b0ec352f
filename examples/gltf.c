/* A GLB file to the same file with quads: nodes, materials, textures and rigs as they were. With a file of one's own:
 *     example_gltf IN.glb OUT.glb FACES
 * Without, a box is written first. Normals of the result are split by its sharp edges. */
#include <quadwright/quadwright.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 64 }; /* attributes */

static int fail(const char *what)
{
    fprintf(stderr, "%s\n", what);
    return 1;
}

/* A unit box as GLB. */
static qw_status write_box(const char *path)
{
    static const double positions[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                           {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const uint32_t corners[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                           {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    const qw_mesh_view box = {.size = sizeof box,
                              .vertex_count = 8,
                              .face_count = 6,
                              .uniform_face_size = 4,
                              .positions = positions[0],
                              .corners = corners[0]};
    char message[512];
    qw_status status = qw_save(&box, path, QW_FORMAT_GLB, message, sizeof message);
    if (status != QW_OK) fprintf(stderr, "%s\n", message);
    return status;
}

/* Quads of a loaded mesh to a file, with what it carries but its normals. */
static qw_status make_quads(qw_context *context, const qw_mesh *input, const qw_options *options, const char *path)
{
    qw_attribute list[MOST + 1], wanted[MOST];
    uint32_t count, kept = 0;
    const qw_attribute *has = qw_mesh_attributes(input, &count), *carried;
    qw_mesh_view view = qw_mesh_get(input);
    for (uint32_t i = 0; i < count && kept < MOST; i++)
        if (has[i].kind != QW_NORMALS) wanted[kept++] = has[i];
    qw_status status = qw_set_mesh(context, &view);
    if (status == QW_OK) status = qw_run(context, options);
    if (status == QW_OK) status = qw_transfer(context, wanted, kept, 0, &carried, NULL);
    for (uint32_t i = 0; i < kept && status == QW_OK; i++) list[i] = carried[i];
    if (status == QW_OK) status = qw_get_normals(context, QW_SHADING_SPLIT, &list[kept]);
    return status == QW_OK ? qw_save_from(context, list, kept + 1, input, path, QW_FORMAT_GLB) : status;
}

int main(int argc, char **argv)
{
    const char *in = argc > 3 ? argv[1] : "example_box.glb", *out = argc > 3 ? argv[2] : "example_quads.glb";
    qw_options options;
    qw_options_init(&options);
    options.faces = argc > 3 ? atoi(argv[3]) : 150;
    if (argc <= 3 && write_box(in) != QW_OK) return 1;

    qw_mesh *input, *output;
    qw_context *context;
    if (qw_load(in, NULL, &input) != QW_OK) return fail(qw_mesh_message(input));
    if (qw_create(NULL, &context) != QW_OK) return fail("out of memory");
    if (make_quads(context, input, &options, out) != QW_OK) return fail(qw_message(context));
    if (qw_load(out, NULL, &output) != QW_OK) return fail(qw_mesh_message(output));
    qw_mesh_view quads = qw_mesh_get(output);
    printf("%s: %u faces of %u corners\n", out, quads.face_count, quads.uniform_face_size);
    int wrong = quads.uniform_face_size != 4; /* FB_ngon_encoding: they come back as quads */
    qw_mesh_destroy(input), qw_mesh_destroy(output);
    qw_destroy(context);
    return wrong;
}
