/* Any bytes as a file of points: either a soup of triangles among them with attributes that hold, or a failure with a
 * sentence. */
#include "quadwright/quadwright.h"

#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const qw_host host = {.memory_limit = (size_t)256 << 20};
    qw_mesh *mesh;
    uint32_t count;
    qw_status status = qw_load_points_memory(data, size, &host, &mesh);
    qw_mesh_view view = qw_mesh_get(mesh);
    if (status != QW_OK && (!qw_mesh_message(mesh)[0] || view.face_count)) abort();
    for (size_t i = 0; i < 3 * (size_t)view.face_count; i++)
        if (view.corners[i] >= view.vertex_count) abort();
    for (size_t i = 0; i < 3 * (size_t)view.vertex_count; i++)
        if (!isfinite(view.positions[i])) abort();
    const qw_attribute *a = qw_mesh_attributes(mesh, &count);
    for (uint32_t n = 0; n < count; n++) {
        if (a[n].count != view.vertex_count) abort();
        for (size_t i = 0; a[n].values && i < (size_t)a[n].components * a[n].count; i++)
            if (!isfinite(a[n].values[i])) abort();
    }
    qw_mesh_destroy(mesh);
    return 0;
}
