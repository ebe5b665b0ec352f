/* A stranger's program: only the installed header and library. Touches enough of the library for its dependencies to be
 * linked. */
#include <quadwright/quadwright.h>

#include <stdio.h>

int main(void)
{
    static const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const uint32_t corners[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    qw_mesh_view mesh = {sizeof mesh, 4, 4, 3, positions, NULL, corners};
    qw_options options;
    qw_options_init(&options);
    options.faces = 50;
    qw_result *result;
    qw_status status = qw_remesh(&mesh, &options, NULL, &result);
    printf("quadwright %s: %u quads %s\n", qw_version(), qw_result_mesh(result).face_count, qw_result_message(result));
    qw_result_destroy(result);
    return status != QW_OK;
}
