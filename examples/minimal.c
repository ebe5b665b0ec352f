/* The shortest useful program: a mesh in memory becomes quads. */
#include <quadwright/quadwright.h>
#include <stdio.h>

static const double positions[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
static const uint32_t corners[][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                      {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};

int main(void)
{
    qw_mesh_view cube = {.size = sizeof cube,
                         .vertex_count = 8,
                         .face_count = 12,
                         .uniform_face_size = 3,
                         .positions = positions[0],
                         .corners = corners[0]};
    qw_options options;
    qw_options_init(&options);
    options.faces = 600;
    options.symmetry = QW_SYMMETRY_NONE; /* each choice has a constant: quadwright/options.h */

    qw_result *result;
    qw_status status = qw_remesh(&cube, &options, NULL, &result);
    if (status == QW_OK) printf("%u quads\n", qw_result_mesh(result).face_count);
    else fprintf(stderr, "%s\n", qw_result_message(result));
    qw_result_destroy(result);
    return status != QW_OK;
}
