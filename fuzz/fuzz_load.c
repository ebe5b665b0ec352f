/* Any bytes as a file: either a mesh whose indices hold, or a failure with a sentence. */
#include "quadwright/quadwright.h"

#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const qw_host host = {.memory_limit = (size_t)256 << 20};
    qw_mesh *mesh;
    qw_status status = qw_load_memory(data, size, &host, &mesh);
    qw_mesh_view view = qw_mesh_get(mesh);
    if (status != QW_OK && (!qw_mesh_message(mesh)[0] || view.face_count)) abort();
    size_t corner = 0;
    for (uint32_t f = 0; f < view.face_count; f++) {
        uint32_t corners = view.face_sizes ? view.face_sizes[f] : view.uniform_face_size;
        if (corners < 3) abort();
        for (uint32_t i = 0; i < corners; i++)
            if (view.corners[corner++] >= view.vertex_count) abort();
    }
    for (size_t i = 0; i < 3 * (size_t)view.vertex_count; i++)
        if (!isfinite(view.positions[i])) abort();
    qw_mesh_destroy(mesh);
    return 0;
}
