/* Arrays that go out, as objects with a buffer of memory of their own; meshes that come in through the buffer protocol.
 *
 * __init__.py sees to it that arrays are contiguous and of the right type, and checks every index before. Here sizes
 * and types are checked again, so that nothing but the contents of a buffer is taken on trust, and those the library
 * checks. */
#include "_native.h"

#include <stdlib.h>
#include <string.h>

/* ---- arrays that go out */

typedef struct array {
    PyObject_HEAD void *data; /* malloc'ed; shape[0] * ... items of the format */
    Py_ssize_t shape[2], strides[2], itemsize;
    int dimensions;
    const char *format;
} array;

static PyTypeObject *array_type; /* made by native_make_array_type */

static int array_get(PyObject *self, Py_buffer *view, int flags)
{
    array *a = (array *)self;
    (void)flags; /* the array is contiguous and may be written to: every request can be met */
    *view = (Py_buffer){.buf = a->data,
                        .obj = self,
                        .len = a->itemsize * a->shape[0] * (a->dimensions == 2 ? a->shape[1] : 1),
                        .itemsize = a->itemsize,
                        .ndim = a->dimensions,
                        .format = flags & PyBUF_FORMAT ? (char *)a->format : NULL,
                        .shape = flags & PyBUF_ND ? a->shape : NULL,
                        .strides = (flags & PyBUF_STRIDES) == PyBUF_STRIDES ? a->strides : NULL};
    Py_INCREF(self);
    return 0;
}

static void array_free(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    free(((array *)self)->data);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    release(self);
    Py_DECREF(type);
}

static PyType_Slot array_slots[] = {{Py_bf_getbuffer, array_get},
                                    {Py_tp_dealloc, array_free},
                                    {Py_tp_doc, "Memory of a result, as a buffer."},
                                    {0, NULL}};
static PyType_Spec array_spec = {"quadwright._native.Array", sizeof(array), 0,
                                 Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION, array_slots};

PyObject *native_make_array_type(void)
{
    array_type = (PyTypeObject *)PyType_FromSpec(&array_spec);
    return (PyObject *)array_type;
}

PyObject *native_array(const void *data, const char *format, Py_ssize_t itemsize, Py_ssize_t rows, Py_ssize_t columns)
{
    allocfunc allocate = (allocfunc)PyType_GetSlot(array_type, Py_tp_alloc);
    array *a = (array *)allocate(array_type, 0);
    if (!a) return NULL;
    a->itemsize = itemsize;
    a->format = format;
    a->dimensions = columns ? 2 : 1;
    a->shape[0] = rows, a->shape[1] = columns;
    a->strides[0] = a->itemsize * (columns ? columns : 1), a->strides[1] = a->itemsize;
    size_t size = (size_t)a->strides[0] * (size_t)rows;
    a->data = malloc(size ? size : 1);
    if (!a->data) {
        Py_DECREF(a);
        return PyErr_NoMemory();
    }
    if (size) memcpy(a->data, data, size);
    return (PyObject *)a;
}

PyObject *native_numbers(const void *data, char format, Py_ssize_t rows, Py_ssize_t columns)
{
    return format == 'd' ? native_array(data, "d", 8, rows, columns) : native_array(data, "i", 4, rows, columns);
}

/* ---- meshes that come in: (positions, face_size, sizes or None, corners, marks or None) */

void native_release_mesh(mesh_input *in)
{
    Py_buffer *all[] = {&in->positions, &in->sizes, &in->corners, &in->marks};
    for (int i = 0; i < 4; i++)
        if (all[i]->obj) PyBuffer_Release(all[i]);
}

bool native_take_buffer(PyObject *object, Py_buffer *buffer, const char *formats, Py_ssize_t itemsize, const char *name)
{
    if (PyObject_GetBuffer(object, buffer, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) {
        buffer->obj = NULL;
        return false;
    }
    const char *format = buffer->format ? buffer->format : "B";
    if (*format == '@' || *format == '=') format++;
    if (buffer->itemsize == itemsize && format[0] && !format[1] && strchr(formats, format[0])) return true;
    PyErr_Format(PyExc_TypeError, "%s: the buffer has items of format %s", name, buffer->format ? buffer->format : "B");
    PyBuffer_Release(buffer);
    return false;
}

static bool too_many(const char *name)
{
    PyErr_Format(PyExc_ValueError, "%s: more than 32 bits can count", name);
    return false;
}

static bool take_arrays(mesh_input *in, PyObject *positions, unsigned face_size, PyObject *sizes, PyObject *corners,
                        PyObject *marks)
{
    if (!native_take_buffer(positions, &in->positions, "d", 8, "vertices")) return false;
    if (!native_take_buffer(corners, &in->corners, "IiLl", 4, "faces")) return false;
    if (sizes != Py_None && !native_take_buffer(sizes, &in->sizes, "IiLl", 4, "face_sizes")) return false;
    if (marks != Py_None && !native_take_buffer(marks, &in->marks, "IiLl", 4, "marked_edges")) return false;
    Py_ssize_t vertices = in->positions.len / 24, corner_count = in->corners.len / 4, mark_count = in->marks.len / 8;
    if (vertices >= UINT32_MAX) return too_many("vertices");
    if (corner_count >= UINT32_MAX || in->sizes.len / 4 >= UINT32_MAX) return too_many("faces");
    if (mark_count >= UINT32_MAX) return too_many("marked_edges");
    in->view = (qw_mesh_view){.size = sizeof in->view,
                              .vertex_count = (uint32_t)vertices,
                              .uniform_face_size = sizes == Py_None ? face_size : 0,
                              .positions = in->positions.buf,
                              .corners = in->corners.buf,
                              .marked_edges = marks == Py_None ? NULL : in->marks.buf,
                              .marked_edge_count = (uint32_t)mark_count};
    if (sizes == Py_None) {
        in->view.face_count = face_size ? (uint32_t)(corner_count / face_size) : 0;
        return true;
    }
    in->view.face_sizes = in->sizes.buf;
    in->view.face_count = (uint32_t)(in->sizes.len / 4);
    uint64_t sum = 0;
    for (uint32_t f = 0; f < in->view.face_count; f++) sum += in->view.face_sizes[f];
    if (sum == (uint64_t)corner_count) return true;
    PyErr_Format(PyExc_ValueError, "face_sizes: the sizes sum to %llu, but faces has %zd corners",
                 (unsigned long long)sum, corner_count);
    return false;
}

bool native_take_mesh(PyObject *mesh, mesh_input *in)
{
    PyObject *positions, *sizes, *corners, *marks;
    unsigned face_size;
    memset(in, 0, sizeof *in);
    if (!PyTuple_Check(mesh)) {
        PyErr_SetString(PyExc_TypeError, "a mesh is a tuple of five here");
        return false;
    }
    if (!PyArg_ParseTuple(mesh, "OIOOO", &positions, &face_size, &sizes, &corners, &marks)) return false;
    if (take_arrays(in, positions, face_size, sizes, corners, marks)) return true;
    native_release_mesh(in);
    return false;
}

PyObject *native_give_mesh(const qw_mesh_view *view)
{
    Py_ssize_t corners = 0;
    for (uint32_t f = 0; view->face_sizes && f < view->face_count; f++) corners += view->face_sizes[f];
    if (!view->face_sizes) corners = (Py_ssize_t)view->face_count * view->uniform_face_size;
    PyObject *positions = native_numbers(view->positions, 'd', view->vertex_count, 3);
    PyObject *corner = view->face_sizes ? native_numbers(view->corners, 'i', corners, 0)
                                        : native_numbers(view->corners, 'i', view->face_count, view->uniform_face_size);
    PyObject *sizes = view->face_sizes ? native_numbers(view->face_sizes, 'i', view->face_count, 0)
                                       : Py_NewRef(Py_None);
    PyObject *marks = view->marked_edge_count ? native_numbers(view->marked_edges, 'i', view->marked_edge_count, 2)
                                              : Py_NewRef(Py_None);
    if (positions && corner && sizes && marks)
        return Py_BuildValue("NINNN", positions, (unsigned)view->uniform_face_size, sizes, corner, marks);
    Py_XDECREF(positions), Py_XDECREF(corner), Py_XDECREF(sizes), Py_XDECREF(marks);
    return NULL;
}
