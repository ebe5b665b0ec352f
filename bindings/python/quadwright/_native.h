/* What the sources of the extension share. */
#ifndef QUADWRIGHT_NATIVE_H
#define QUADWRIGHT_NATIVE_H

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030b0000
#include <Python.h>

#include "quadwright/quadwright.h"

#include <stdbool.h>

/* Raises the class of a status, unless an exception is set already. NULL. */
PyObject *native_raise(qw_status status, const char *message);

/* Holds a contiguous buffer whose items have one of these formats (of the struct module, a letter each) and this size
   in bytes; a TypeError that begins with the name else, and then buffer->obj is NULL. */
bool native_take_buffer(PyObject *object, Py_buffer *buffer, const char *formats, Py_ssize_t itemsize,
                        const char *name);

/* A copy of rows * columns items (columns 0: of one dimension) as an object with a buffer. format: a literal. */
PyObject *native_array(const void *data, const char *format, Py_ssize_t itemsize, Py_ssize_t rows, Py_ssize_t columns);

/* ---- _mesh.c */

/* Doubles ('d') or 32-bit integers ('i'), as native_array. */
PyObject *native_numbers(const void *data, char format, Py_ssize_t rows, Py_ssize_t columns);
/* The type of such objects. */
PyObject *native_make_array_type(void);

/* A mesh that comes in: (positions, face_size, sizes or None, corners, marks or None). */
typedef struct mesh_input {
    Py_buffer positions, sizes, corners, marks; /* obj NULL: not held */
    qw_mesh_view view;
} mesh_input;

/* in: to be released where true was returned. */
bool native_take_mesh(PyObject *mesh, mesh_input *in);
void native_release_mesh(mesh_input *in);
/* The same tuple, of copies. */
PyObject *native_give_mesh(const qw_mesh_view *view);

/* ---- _context.c */

PyObject *native_make_context_type(void);

/* ---- what files hold beside surfaces: _native.c */

/* Of a scene; NULL: None was given, or none. */
const qw_mesh *native_scene_mesh(PyObject *scene);

/* ---- hooks of the library */

typedef struct hooks {
    PyThreadState *released; /* NULL while this thread holds the GIL */
    PyObject *progress;      /* called with (stage, fraction); NULL: none */
    PyObject *log;           /* called with (level, message); NULL: none */
    int64_t last;            /* of the clock, ms */
} hooks;

int64_t native_now_ms(void);
/* A host that calls these hooks. */
qw_host native_host(hooks *h, size_t memory_limit);
/* Takes the GIL back where it was released; true where it was. */
bool native_take_gil(hooks *h);

static inline PyObject *native_or_null(PyObject *object) { return object == Py_None ? NULL : object; }

/* ---- _attributes.c */

/* Attributes that own all they refer to. */
typedef struct attribute_list {
    qw_attribute *attributes; /* qw_attribute[count] */
    uint32_t count;
} attribute_list;

/* From a list of tuples (name, domain, kind, components, items, groups or None, names or None, storage). *list is to be
   freed even where an exception is set. */
bool native_take_attributes(PyObject *tuples, attribute_list *list);
void native_free_attributes(attribute_list *list);
/* The same tuples, with the number of elements last. */
PyObject *native_give_attributes(const qw_attribute *attributes, uint32_t count);
/* (vertices, corners, lost vertices, lost corners, farthest). */
PyObject *native_give_provenance(const qw_provenance *provenance);

#endif
