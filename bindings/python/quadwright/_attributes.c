/* Attributes and provenance, from and to Python. Attributes that come in are copied, as the mesh is: what the caller
 * does with the arrays later changes no run. */
#include "_native.h"

#include <stdlib.h>
#include <string.h>

/* Names in files need not be UTF-8. */
static PyObject *text_of(const char *bytes)
{
    return PyUnicode_DecodeUTF8(bytes, (Py_ssize_t)strlen(bytes), "surrogateescape");
}

/* ---- in */

static void *copy_of(const void *data, size_t size)
{
    void *copy = malloc(size ? size : 1);
    if (!copy) PyErr_NoMemory();
    else if (size) memcpy(copy, data, size);
    return copy;
}

static char *copy_text(PyObject *object)
{
    PyObject *bytes = PyUnicode_AsEncodedString(object, "utf-8",
                                                "surrogateescape"); /* a TypeError where it is no str */
    char *begin, *copy = NULL;
    Py_ssize_t size;
    if (bytes && PyBytes_AsStringAndSize(bytes, &begin, &size) == 0) copy = copy_of(begin, (size_t)size + 1);
    Py_XDECREF(bytes);
    return copy;
}

static void *copy_buffer(PyObject *object, const char *formats, const char *name, Py_ssize_t *items)
{
    Py_buffer buffer;
    if (!native_take_buffer(object, &buffer, formats, 4, name)) return NULL;
    *items = buffer.len / 4;
    void *copy = copy_of(buffer.buf, (size_t)buffer.len);
    PyBuffer_Release(&buffer);
    return copy;
}

static bool take_names(PyObject *names, qw_attribute *a)
{
    Py_ssize_t count = PyList_Size(names);
    if (count < 0) return false;
    char **copies = calloc((size_t)count + 1, sizeof *copies);
    if (!copies) return PyErr_NoMemory(), false;
    a->label_names = (const char *const *)copies;
    for (; a->label_count < (uint32_t)count; a->label_count++)
        if (!(copies[a->label_count] = copy_text(PyList_GetItem(names, a->label_count)))) return false;
    return true;
}

static bool take_one(PyObject *tuple, qw_attribute *a)
{
    PyObject *name, *data, *group, *names;
    int domain, kind, storage;
    unsigned components;
    Py_ssize_t items = 0, groups = 0;
    *a = (qw_attribute){.size = sizeof *a};
    if (!PyArg_ParseTuple(tuple, "OiiIOOOi", &name, &domain, &kind, &components, &data, &group, &names, &storage))
        return false;
    a->domain = (qw_domain)domain, a->kind = (qw_attribute_kind)kind, a->storage = (qw_storage)storage;
    a->components = components;
    if (!(a->name = copy_text(name))) return false;
    if (kind == QW_LABELS) a->labels = copy_buffer(data, "il", a->name, &items);
    else a->values = copy_buffer(data, "f", a->name, &items);
    if (!a->labels && !a->values) return false;
    if (group != Py_None && !(a->group = copy_buffer(group, "IL", a->name, &groups))) return false;
    if (components == 0 || items / components >= UINT32_MAX || items % components || (a->group && groups != items)) {
        PyErr_Format(PyExc_ValueError, "%s: %zd numbers of %u components, %zd groups", a->name, items, components,
                     groups);
        return false;
    }
    a->count = (uint32_t)(items / components);
    return names == Py_None || take_names(names, a);
}

bool native_take_attributes(PyObject *tuples, attribute_list *list)
{
    *list = (attribute_list){0};
    Py_ssize_t count = PyList_Size(tuples);
    if (count < 0) return false;
    list->attributes = calloc((size_t)count + 1, sizeof *list->attributes);
    if (!list->attributes) return PyErr_NoMemory(), false;
    for (Py_ssize_t i = 0; i < count; i++) {
        list->count++;
        if (!take_one(PyList_GetItem(tuples, i), &list->attributes[i])) return false;
    }
    return true;
}

void native_free_attributes(attribute_list *list)
{
    for (uint32_t i = 0; i < list->count; i++) {
        qw_attribute *a = &list->attributes[i];
        for (uint32_t k = 0; k < a->label_count; k++) free((void *)a->label_names[k]);
        free((void *)a->label_names), free((void *)a->name);
        free((void *)a->values), free((void *)a->group), free((void *)a->labels);
    }
    free(list->attributes);
    *list = (attribute_list){0};
}

/* ---- out */

static PyObject *give_names(const qw_attribute *a)
{
    if (!a->label_names) return Py_NewRef(Py_None);
    PyObject *names = PyList_New((Py_ssize_t)a->label_count);
    for (uint32_t k = 0; names && k < a->label_count; k++) {
        PyObject *name = text_of(a->label_names[k]);
        if (!name || PyList_SetItem(names, k, name) != 0) Py_CLEAR(names); /* SetItem takes name over */
    }
    return names;
}

static PyObject *give_one(const qw_attribute *a)
{
    Py_ssize_t rows = a->count, columns = a->components == 1 && a->kind != QW_WEIGHTS ? 0 : a->components;
    PyObject *name = text_of(a->name), *names = give_names(a);
    PyObject *data = a->kind == QW_LABELS ? native_array(a->labels, "i", 4, rows, 0)
                                          : native_array(a->values, "f", 4, rows, columns);
    PyObject *group = a->group ? native_array(a->group, "I", 4, rows, columns) : Py_NewRef(Py_None);
    if (name && names && data && group)
        return Py_BuildValue("NiiINNNiI", name, (int)a->domain, (int)a->kind, (unsigned)a->components, data, group,
                             names, (int)a->storage, (unsigned)a->count);
    Py_XDECREF(name), Py_XDECREF(names), Py_XDECREF(data), Py_XDECREF(group);
    return NULL;
}

PyObject *native_give_attributes(const qw_attribute *attributes, uint32_t count)
{
    PyObject *list = PyList_New(0);
    for (uint32_t i = 0; list && i < count; i++) {
        PyObject *one = give_one(&attributes[i]);
        if (!one || PyList_Append(list, one) != 0) Py_CLEAR(list);
        Py_XDECREF(one);
    }
    return list;
}

PyObject *native_give_provenance(const qw_provenance *p)
{
    static const char format[] = "T{i:face:(3)i:corner:(3)f:weight:}"; /* QW_NO_FACE reads as -1 */
    PyObject *vertices = native_array(p->vertices, format, sizeof(qw_origin), p->vertex_count, 0);
    PyObject *corners = native_array(p->corners, format, sizeof(qw_origin), p->corner_count, 0);
    if (vertices && corners)
        return Py_BuildValue("NNIId", vertices, corners, (unsigned)p->lost_vertices, (unsigned)p->lost_corners,
                             p->farthest);
    Py_XDECREF(vertices), Py_XDECREF(corners);
    return NULL;
}
_Static_assert(sizeof(qw_origin) == 28, "an origin is seven numbers of four bytes");
