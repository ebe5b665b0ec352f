/* The C half of the Python package, on the limited API of CPython 3.11: contexts, files, measuring, pictures, and the
 * tables of the library.
 *
 * Arrays come in through the buffer protocol, contiguous and of the right type: __init__.py sees to that and checks
 * every index before. Here sizes and types are checked again, so that nothing but the contents of a buffer is taken on
 * trust, and those the library checks.
 *
 * Hooks of the library run on the thread that called it, with the GIL released around the call. A hook takes it back,
 * and leaves an exception set where one was raised; the library then unwinds, and the exception goes on to the caller.
 */
#include "_native.h"

#include "render.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static PyObject *error_classes; /* list: the exception class of each status, set by __init__.py */

/* ---- failures */

PyObject *native_raise(qw_status status, const char *message)
{
    if (PyErr_Occurred()) return NULL; /* from a hook, or an interrupt: it says more */
    PyObject *class = error_classes ? PyList_GetItem(error_classes, (Py_ssize_t)status) : NULL;
    if (!class) PyErr_Clear();
    PyObject *text = PyUnicode_DecodeUTF8(message, (Py_ssize_t)strlen(message), "backslashreplace");
    if (text) PyErr_SetObject(class ? class : PyExc_RuntimeError, text);
    Py_XDECREF(text);
    return NULL;
}

/* ---- hooks */

enum { PAUSE_MS = 20 }; /* between two looks at interrupts and two calls of the progress function */

typedef struct hooks {
    PyThreadState *released; /* NULL while this thread holds the GIL */
    PyObject *progress;      /* called with (stage, fraction); NULL: none */
    PyObject *log;           /* called with (level, message); NULL: none */
    int64_t last;            /* of the clock, ms */
} hooks;

static int64_t now_ms(void)
{
    struct timespec t;
    timespec_get(&t, TIME_UTC);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

static bool take_gil(hooks *h)
{
    bool was_released = h->released != NULL;
    if (was_released) PyEval_RestoreThread(h->released);
    h->released = NULL;
    return was_released;
}

static void give_gil(hooks *h, bool was_released)
{
    if (was_released) h->released = PyEval_SaveThread();
}

static bool tell_progress(hooks *h, qw_stage stage, double fraction)
{
    PyObject *answer = PyObject_CallFunction(h->progress, "sd", qw_stage_title(stage), fraction);
    bool goes_on = answer && answer != Py_False;
    Py_XDECREF(answer);
    return goes_on;
}

static int on_progress(void *user, qw_stage stage, double fraction)
{
    hooks *h = user;
    int64_t now = now_ms();
    bool is_due = now - h->last >= PAUSE_MS || now < h->last || fraction >= 1;
    if (!is_due) return 0;
    h->last = now;
    bool was_released = take_gil(h);
    bool stops = PyErr_Occurred() || PyErr_CheckSignals() != 0;
    if (!stops && h->progress) stops = !tell_progress(h, stage, fraction);
    give_gil(h, was_released);
    return stops;
}

static void on_log(void *user, qw_log_level level, const char *message)
{
    hooks *h = user;
    if (!h->log) return;
    bool was_released = take_gil(h);
    if (!PyErr_Occurred()) {
        PyObject *text = PyUnicode_DecodeUTF8(message, (Py_ssize_t)strlen(message), "backslashreplace");
        PyObject *answer = text ? PyObject_CallFunction(h->log, "iO", (int)level, text) : NULL;
        Py_XDECREF(answer);
        Py_XDECREF(text);
        h->last = PyErr_Occurred() ? 0 : h->last; /* the next call of on_progress stops the run */
    }
    give_gil(h, was_released);
}

static qw_host host_of(hooks *h, size_t memory_limit)
{
    return (qw_host){
        .memory_limit = memory_limit, .log = on_log, .log_user = h, .progress = on_progress, .progress_user = h};
}

static PyObject *or_null(PyObject *object) { return object == Py_None ? NULL : object; }

/* ---- arrays that go out */

typedef struct array {
    PyObject_HEAD void *data; /* malloc'ed; shape[0] * ... items of the format */
    Py_ssize_t shape[2], strides[2], itemsize;
    int dimensions;
    const char *format;
} array;

static PyTypeObject *array_type;

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

static PyObject *array_of(const void *data, char format, Py_ssize_t rows, Py_ssize_t columns)
{
    return format == 'd' ? native_array(data, "d", 8, rows, columns) : native_array(data, "i", 4, rows, columns);
}

/* ---- meshes that come in: (positions, face_size, sizes or None, corners, marks or None) */

typedef struct input {
    Py_buffer positions, sizes, corners, marks; /* obj NULL: not held */
    qw_mesh_view view;
} input;

static void input_release(input *in)
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

static bool take_arrays(input *in, PyObject *positions, unsigned face_size, PyObject *sizes, PyObject *corners,
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

static bool input_take(PyObject *mesh, input *in)
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
    input_release(in);
    return false;
}

static PyObject *give_mesh(const qw_mesh_view *view)
{
    Py_ssize_t corners = 0;
    for (uint32_t f = 0; view->face_sizes && f < view->face_count; f++) corners += view->face_sizes[f];
    if (!view->face_sizes) corners = (Py_ssize_t)view->face_count * view->uniform_face_size;
    PyObject *positions = array_of(view->positions, 'd', view->vertex_count, 3);
    PyObject *corner = view->face_sizes ? array_of(view->corners, 'i', corners, 0)
                                        : array_of(view->corners, 'i', view->face_count, view->uniform_face_size);
    PyObject *sizes = view->face_sizes ? array_of(view->face_sizes, 'i', view->face_count, 0) : Py_NewRef(Py_None);
    PyObject *marks = view->marked_edge_count ? array_of(view->marked_edges, 'i', view->marked_edge_count, 2)
                                              : Py_NewRef(Py_None);
    if (positions && corner && sizes && marks)
        return Py_BuildValue("NINNN", positions, (unsigned)view->uniform_face_size, sizes, corner, marks);
    Py_XDECREF(positions), Py_XDECREF(corner), Py_XDECREF(sizes), Py_XDECREF(marks);
    return NULL;
}

/* ---- options and JSON */

static bool set_options(PyObject *pairs, qw_options *options)
{
    char message[256];
    qw_options_init(options);
    Py_ssize_t count = PyList_Size(pairs);
    for (Py_ssize_t i = 0; i < count; i++) {
        const char *name, *value;
        if (!PyArg_ParseTuple(PyList_GetItem(pairs, i), "ss", &name, &value)) return false;
        qw_status status = qw_option_set(options, name, value, message, sizeof message);
        if (status != QW_OK) return native_raise(status, message), false;
    }
    qw_status status = count < 0 ? QW_OPTION : qw_options_validate(options, message, sizeof message);
    return status == QW_OK ? true : (native_raise(status, message), false);
}

static PyObject *report_text(const qw_report *report)
{
    size_t length = qw_report_json(report, NULL, 0);
    char *text = malloc(length + 1);
    if (!text) return PyErr_NoMemory();
    qw_report_json(report, text, length + 1);
    PyObject *object = PyUnicode_FromStringAndSize(text, (Py_ssize_t)length);
    free(text);
    return object;
}

/* ---- contexts */

typedef struct context {
    PyObject_HEAD qw_context *context;
    hooks hooks;
    bool is_busy;
    attribute_list attributes; /* of the surface, to be carried to each result */
} context;

static PyTypeObject *context_type;

static int context_init(PyObject *self, PyObject *arguments, PyObject *names)
{
    context *c = (context *)self;
    unsigned long long limit = 0;
    (void)names;
    if (!PyArg_ParseTuple(arguments, "|K", &limit)) return -1;
    if (c->context) {
        PyErr_SetString(PyExc_RuntimeError, "the context was made already");
        return -1;
    }
    qw_host host = host_of(&c->hooks, (size_t)limit);
    qw_status status = qw_create(&host, &c->context);
    return status == QW_OK ? 0 : (native_raise(status, qw_status_text(status)), -1);
}

static void context_free(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    qw_destroy(((context *)self)->context);
    native_free_attributes(&((context *)self)->attributes);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    release(self);
    Py_DECREF(type);
}

static bool begin(context *c, PyObject *progress, PyObject *log)
{
    if (!c->context || c->is_busy) {
        PyErr_SetString(PyExc_RuntimeError, c->context ? "this Remesher is at work in another thread; make one a thread"
                                                       : "the context was not made");
        return false;
    }
    c->is_busy = true;
    c->hooks = (hooks){.progress = or_null(progress), .log = or_null(log), .last = now_ms()};
    return true;
}

static void end(context *c)
{
    c->hooks = (hooks){0};
    c->is_busy = false;
}

/* The answer of a function that sets something of the context. */
static PyObject *settle(context *c, qw_status status)
{
    PyObject *result = status == QW_OK && !PyErr_Occurred() ? Py_NewRef(Py_None)
                                                            : native_raise(status, qw_message(c->context));
    end(c);
    return result;
}

/* Meshes and what steers them are copied with the GIL held: no other thread changes the arrays between the library's
 * check and its copy. */
static PyObject *context_set_mesh(PyObject *self, PyObject *mesh)
{
    context *c = (context *)self;
    input in;
    if (!input_take(mesh, &in)) return NULL;
    PyObject *result = begin(c, Py_None, Py_None) ? settle(c, qw_set_mesh(c->context, &in.view)) : NULL;
    input_release(&in);
    return result;
}

static PyObject *context_set_attributes(PyObject *self, PyObject *tuples)
{
    context *c = (context *)self;
    attribute_list list;
    bool is_taken = native_take_attributes(tuples, &list) && begin(c, Py_None, Py_None);
    if (is_taken) {
        attribute_list old = c->attributes;
        c->attributes = list, list = old;
        end(c);
    }
    native_free_attributes(&list);
    return is_taken ? Py_NewRef(Py_None) : NULL;
}

static PyObject *context_set_density(PyObject *self, PyObject *density)
{
    context *c = (context *)self;
    Py_buffer buffer = {0};
    if (density != Py_None && !native_take_buffer(density, &buffer, "f", 4, "density")) return NULL;
    PyObject *result = NULL;
    if (begin(c, Py_None, Py_None))
        result = settle(c, qw_set_density(c->context, buffer.obj ? buffer.buf : NULL, (uint32_t)(buffer.len / 4)));
    if (buffer.obj) PyBuffer_Release(&buffer);
    return result;
}

/* (float32 (n, 3), domain), the path of a file, or None. */
static PyObject *context_set_field(PyObject *self, PyObject *arguments)
{
    context *c = (context *)self;
    PyObject *what, *path = NULL, *result = NULL;
    int domain;
    if (!PyArg_ParseTuple(arguments, "Oi", &what, &domain)) return NULL;
    qw_cross_field field = {.size = sizeof field, .domain = (qw_domain)domain};
    Py_buffer buffer = {0};
    bool is_file = PyUnicode_Check(what) || PyBytes_Check(what);
    if (is_file && !PyUnicode_FSConverter(what, &path)) return NULL;
    if (!is_file && what != Py_None && !native_take_buffer(what, &buffer, "f", 4, "field")) return NULL;
    field.directions = buffer.obj ? buffer.buf : NULL, field.count = (uint32_t)(buffer.len / 12);
    if (begin(c, Py_None, Py_None))
        result = settle(c, is_file ? qw_load_field(c->context, PyBytes_AsString(path))
                                   : qw_set_field(c->context, buffer.obj ? &field : NULL));
    if (buffer.obj) PyBuffer_Release(&buffer);
    Py_XDECREF(path);
    return result;
}

static PyObject *set_guide_list(context *c, PyObject *list, qw_guide *guides, Py_buffer *buffers, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        PyObject *points;
        int kind, closed;
        if (!PyArg_ParseTuple(PyList_GetItem(list, i), "Oip", &points, &kind, &closed)) return NULL;
        if (!native_take_buffer(points, &buffers[i], "d", 8, "guides")) return NULL;
        guides[i] = (qw_guide){.size = sizeof *guides,
                               .kind = (qw_guide_kind)kind,
                               .closed = closed,
                               .point_count = (uint32_t)(buffers[i].len / 24),
                               .points = buffers[i].buf};
    }
    return begin(c, Py_None, Py_None) ? settle(c, qw_set_guides(c->context, count ? guides : NULL, count)) : NULL;
}

/* A list of (float64 (n, 3), kind, closed), or the path of a file. */
static PyObject *context_set_guides(PyObject *self, PyObject *what)
{
    context *c = (context *)self;
    PyObject *path = NULL, *result = NULL;
    if (!PyList_Check(what)) {
        if (!PyUnicode_FSConverter(what, &path)) return NULL;
        if (begin(c, Py_None, Py_None)) result = settle(c, qw_load_guides(c->context, PyBytes_AsString(path)));
        Py_DECREF(path);
        return result;
    }
    Py_ssize_t count = PyList_Size(what);
    qw_guide *guides = calloc((size_t)count + 1, sizeof *guides);
    Py_buffer *buffers = calloc((size_t)count + 1, sizeof *buffers);
    if (guides && buffers) result = set_guide_list(c, what, guides, buffers, (uint32_t)count);
    else PyErr_NoMemory();
    for (Py_ssize_t i = 0; buffers && i < count; i++)
        if (buffers[i].obj) PyBuffer_Release(&buffers[i]);
    free(guides), free(buffers);
    return result;
}

/* What a run is asked for beside the quads, and what it gives. */
typedef struct outcome {
    int wants_provenance, field_domain; /* 0 or 1; a qw_domain, or -1: no field */
    unsigned most_weights;
    qw_mesh_view mesh;
    const qw_attribute *carried; /* NULL: none */
    qw_transfer_report transfer;
    qw_provenance provenance;
    qw_cross_field field;
} outcome;

/* Without the GIL. */
static qw_status compute(context *c, const qw_options *options, outcome *o)
{
    qw_status status = qw_run(c->context, options);
    if (status == QW_OK && c->attributes.count > 0)
        status = qw_transfer(c->context, c->attributes.attributes, c->attributes.count, o->most_weights, &o->carried,
                             &o->transfer);
    if (status == QW_OK && (o->wants_provenance || c->attributes.count > 0))
        status = qw_get_provenance(c->context, &o->provenance);
    if (status == QW_OK && o->field_domain >= 0)
        status = qw_get_field(c->context, (qw_domain)o->field_domain, &o->field);
    return status == QW_OK ? qw_get_mesh(c->context, &o->mesh) : status;
}

/* (mesh, report, attributes, transfer report or None, provenance or None, field or None) */
static PyObject *give_outcome(const context *c, const outcome *o)
{
    PyObject *parts[] = {
        give_mesh(&o->mesh),
        report_text(qw_get_report(c->context)),
        native_give_attributes(o->carried, o->carried ? c->attributes.count : 0),
        o->carried ? Py_BuildValue("{sIsIsIsIsIsI}", "charts", o->transfer.charts, "straddling_quads",
                                   o->transfer.straddling_quads, "filled_vertices", o->transfer.filled_vertices,
                                   "filled_corners", o->transfer.filled_corners, "filled_faces",
                                   o->transfer.filled_faces, "dropped_weights", o->transfer.dropped_weights)
                   : Py_NewRef(Py_None),
        o->provenance.size ? native_give_provenance(&o->provenance) : Py_NewRef(Py_None),
        o->field.size ? native_array(o->field.directions, "f", 4, o->field.count, 3) : Py_NewRef(Py_None)};
    enum { PARTS = sizeof parts / sizeof *parts };
    bool is_whole = true;
    for (int i = 0; i < PARTS; i++) is_whole &= parts[i] != NULL;
    if (is_whole) return Py_BuildValue("NNNNNN", parts[0], parts[1], parts[2], parts[3], parts[4], parts[5]);
    for (int i = 0; i < PARTS; i++) Py_XDECREF(parts[i]);
    return NULL;
}

static PyObject *context_run(PyObject *self, PyObject *arguments)
{
    context *c = (context *)self;
    PyObject *pairs, *progress, *log, *result = NULL;
    qw_options options;
    outcome o = {0};
    if (!PyArg_ParseTuple(arguments, "OOOpIi", &pairs, &progress, &log, &o.wants_provenance, &o.most_weights,
                          &o.field_domain) ||
        !set_options(pairs, &options) || !begin(c, progress, log))
        return NULL;
    c->hooks.released = PyEval_SaveThread();
    qw_status status = compute(c, &options, &o);
    take_gil(&c->hooks);
    if (status == QW_OK && !PyErr_Occurred()) result = give_outcome(c, &o);
    else native_raise(status, qw_message(c->context));
    end(c);
    return result;
}

static PyMethodDef context_methods[] = {{"set_mesh", context_set_mesh, METH_O, "Copies a mesh into the context."},
                                        {"set_attributes", context_set_attributes, METH_O, "What is carried over."},
                                        {"set_density", context_set_density, METH_O, "One a vertex, or None."},
                                        {"set_field", context_set_field, METH_VARARGS, "Crosses, or a file's."},
                                        {"set_guides", context_set_guides, METH_O, "Polylines, or a file's."},
                                        {"run", context_run, METH_VARARGS, "Remeshes with these options."},
                                        {NULL, NULL, 0, NULL}};
static PyType_Slot context_slots[] = {{Py_tp_init, context_init},
                                      {Py_tp_dealloc, context_free},
                                      {Py_tp_methods, context_methods},
                                      {Py_tp_doc, "A context of the library."},
                                      {0, NULL}};
static PyType_Spec context_spec = {"quadwright._native.Context", sizeof(context), 0, Py_TPFLAGS_DEFAULT, context_slots};

/* ---- files, measuring, pictures */

/* (mesh, attributes, mtllib or None) */
static PyObject *give_loaded(const qw_mesh *mesh)
{
    qw_mesh_view view = qw_mesh_get(mesh);
    uint32_t count;
    const qw_attribute *attributes = qw_mesh_attributes(mesh, &count);
    const char *library = qw_mesh_library(mesh);
    PyObject *arrays = give_mesh(&view), *list = native_give_attributes(attributes, count);
    PyObject *names = library ? PyUnicode_DecodeUTF8(library, (Py_ssize_t)strlen(library), "surrogateescape")
                              : Py_NewRef(Py_None);
    if (arrays && list && names) return Py_BuildValue("NNN", arrays, list, names);
    Py_XDECREF(arrays), Py_XDECREF(list), Py_XDECREF(names);
    return NULL;
}

static PyObject *native_load(PyObject *self, PyObject *arguments)
{
    PyObject *path, *log;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "O&O", PyUnicode_FSConverter, &path, &log)) return NULL;
    hooks h = {.log = or_null(log), .last = now_ms()};
    qw_host host = host_of(&h, 0);
    qw_mesh *mesh = NULL;
    const char *name = PyBytes_AsString(path);
    h.released = PyEval_SaveThread();
    qw_status status = qw_load(name, &host, &mesh);
    take_gil(&h);
    PyObject *result = status == QW_OK && !PyErr_Occurred() ? give_loaded(mesh)
                                                            : native_raise(status, qw_mesh_message(mesh));
    qw_mesh_destroy(mesh);
    Py_DECREF(path);
    return result;
}

/* What is done with a mesh and attributes of the caller. */
typedef struct wrapped {
    input in;
    attribute_list list;
    PyObject *library; /* bytes; NULL: none */
    qw_mesh *mesh;
} wrapped;

static void wrapped_release(wrapped *w)
{
    qw_mesh_destroy(w->mesh);
    native_free_attributes(&w->list);
    input_release(&w->in);
    Py_XDECREF(w->library);
}

static bool wrap(wrapped *w, PyObject *mesh, PyObject *attributes, PyObject *library)
{
    *w = (wrapped){0};
    if (!input_take(mesh, &w->in) || !native_take_attributes(attributes, &w->list)) return false;
    if (library != Py_None && !(w->library = PyUnicode_AsEncodedString(library, "utf-8", "surrogateescape")))
        return false;
    const char *names = w->library ? PyBytes_AsString(w->library) : NULL;
    qw_status status = qw_mesh_wrap(&w->in.view, w->list.attributes, w->list.count, names, NULL, &w->mesh);
    return status == QW_OK ? true : (native_raise(status, qw_mesh_message(w->mesh)), false);
}

static PyObject *native_save(PyObject *self, PyObject *arguments)
{
    PyObject *mesh, *attributes, *library, *path, *result = NULL;
    int format;
    wrapped w;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OOOO&i", &mesh, &attributes, &library, PyUnicode_FSConverter, &path, &format))
        return NULL;
    if (wrap(&w, mesh, attributes, library)) {
        const char *name = PyBytes_AsString(path);
        qw_status status = qw_mesh_save(w.mesh, name, (qw_format)format);
        result = status == QW_OK ? Py_NewRef(Py_None) : native_raise(status, qw_mesh_message(w.mesh));
    }
    wrapped_release(&w);
    Py_DECREF(path);
    return result;
}

/* Edges at which attributes of these names ("uv,material") differ: int32 (n, 2). */
static PyObject *native_borders(PyObject *self, PyObject *arguments)
{
    PyObject *mesh, *attributes, *result = NULL;
    const char *names;
    wrapped w;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OOs", &mesh, &attributes, &names)) return NULL;
    if (wrap(&w, mesh, attributes, Py_None)) {
        qw_status status = qw_mesh_mark(w.mesh, names, NULL);
        qw_mesh_view view = qw_mesh_get(w.mesh);
        result = status == QW_OK ? array_of(view.marked_edges, 'i', view.marked_edge_count, 2)
                                 : native_raise(status, qw_mesh_message(w.mesh));
    }
    wrapped_release(&w);
    return result;
}

/* The sentence of a failure of qw_measure comes by way of its log. */
typedef struct measuring {
    hooks hooks;
    char message[512];
} measuring;

static void keep_message(void *user, qw_log_level level, const char *message)
{
    measuring *m = user;
    if (level == QW_LOG_WARNING) PyOS_snprintf(m->message, sizeof m->message, "%s", message);
}

static PyObject *native_measure(PyObject *self, PyObject *arguments)
{
    PyObject *mesh, *against, *result = NULL;
    input in, surface = {0};
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OO", &mesh, &against)) return NULL;
    if (!input_take(mesh, &in)) return NULL;
    if (against != Py_None && !input_take(against, &surface)) {
        input_release(&in);
        return NULL;
    }
    measuring m = {.hooks = {.last = now_ms()}};
    qw_host host = host_of(&m.hooks, 0);
    host.log = keep_message, host.log_user = &m;
    qw_topology topology;
    qw_quality quality;
    m.hooks.released = PyEval_SaveThread();
    qw_status status = qw_measure(&in.view, against == Py_None ? NULL : &surface.view, &host, &topology, &quality);
    take_gil(&m.hooks);
    if (status == QW_OK && !PyErr_Occurred()) {
        static char text[16384];
        size_t length = qw_measures_json(&topology, &quality, text, sizeof text);
        result = PyUnicode_FromStringAndSize(text, (Py_ssize_t)length);
    } else native_raise(status, m.message[0] ? m.message : qw_status_text(status));
    input_release(&in), input_release(&surface);
    return result;
}

enum { MOST_MESHES = 6 };

static PyObject *draw(PyObject *meshes, const render_options *options, PyObject *follow, const char *path)
{
    input in[MOST_MESHES], surface = {0};
    render_panel panels[MOST_MESHES];
    render_options o = *options;
    Py_ssize_t count = PyList_Size(meshes), taken = 0;
    PyObject *result = NULL;
    char message[512];
    if (count < 0 || count > MOST_MESHES) {
        if (count > 0) PyErr_SetString(PyExc_ValueError, "meshes: a picture holds at most 6");
        return NULL;
    }
    bool is_ready = follow == Py_None || input_take(follow, &surface);
    for (; is_ready && taken < count; taken += is_ready) {
        PyObject *mesh;
        const char *caption;
        is_ready = PyArg_ParseTuple(PyList_GetItem(meshes, taken), "Oz", &mesh, &caption) &&
                   input_take(mesh, &in[taken]);
        if (is_ready) panels[taken] = (render_panel){&in[taken].view, caption};
    }
    if (is_ready) {
        hooks h = {.last = now_ms()};
        qw_host host = host_of(&h, 0);
        if (follow != Py_None) o.follow = &surface.view;
        h.released = PyEval_SaveThread();
        qw_status status = render_sheet(panels, (size_t)count, &o, path, &host, message, sizeof message);
        take_gil(&h);
        result = status == QW_OK && !PyErr_Occurred() ? Py_NewRef(Py_None) : native_raise(status, message);
    }
    for (Py_ssize_t i = 0; i < taken; i++) input_release(&in[i]);
    input_release(&surface);
    return result;
}

static PyObject *native_render(PyObject *self, PyObject *arguments)
{
    PyObject *meshes, *path, *follow;
    render_options o;
    int wires, dots, labels, lines;
    (void)self;
    render_options_init(&o);
    if (!PyArg_ParseTuple(arguments, "OO&OIIIppppIdd", &meshes, PyUnicode_FSConverter, &path, &follow, &o.width,
                          &o.height, &o.views, &wires, &dots, &labels, &lines, &o.chord, &o.azimuth, &o.elevation))
        return NULL;
    o.wires = wires, o.dots = dots, o.labels = labels, o.lines = lines;
    PyObject *result = draw(meshes, &o, follow, PyBytes_AsString(path));
    Py_DECREF(path);
    return result;
}

/* ---- tables */

static PyObject *native_options(PyObject *self, PyObject *none)
{
    static const char *const kinds[] = {"count", "real", "flag", "choice"};
    (void)self, (void)none;
    PyObject *list = PyList_New(0);
    for (size_t i = 0; list && i < qw_option_count(); i++) {
        const qw_option_info *o = qw_option_at(i);
        PyObject *row = Py_BuildValue("ssdddszs", o->name, kinds[o->kind], o->initial, o->least, o->most, o->unit,
                                      o->choices, o->help);
        if (!row || PyList_Append(list, row) != 0) Py_CLEAR(list);
        Py_XDECREF(row);
    }
    return list;
}

static PyObject *native_fields(PyObject *self, PyObject *record)
{
    (void)self;
    long which = PyLong_AsLong(record);
    if (which == -1 && PyErr_Occurred()) return NULL;
    PyObject *list = PyList_New(0);
    const qw_field_info *f;
    for (size_t i = 0; list && (f = qw_field_at((qw_record)which, i)); i++) {
        PyObject *row = Py_BuildValue("ssiss", f->name, f->kind == QW_FIELD_WHOLE ? "int" : "float", (int)f->optional,
                                      f->unit, f->help);
        if (!row || PyList_Append(list, row) != 0) Py_CLEAR(list);
        Py_XDECREF(row);
    }
    return list;
}

static PyObject *native_statuses(PyObject *self, PyObject *none)
{
    (void)self, (void)none;
    PyObject *list = PyList_New(0);
    for (int s = 0; list && s < QW_STATUS_COUNT; s++) {
        PyObject *row = Py_BuildValue("ssi", qw_status_name((qw_status)s), qw_status_text((qw_status)s),
                                      qw_status_exit_code((qw_status)s));
        if (!row || PyList_Append(list, row) != 0) Py_CLEAR(list);
        Py_XDECREF(row);
    }
    return list;
}

static PyObject *native_set_errors(PyObject *self, PyObject *classes)
{
    (void)self;
    if (!PyList_Check(classes) || PyList_Size(classes) != QW_STATUS_COUNT) {
        PyErr_SetString(PyExc_TypeError, "one class a status");
        return NULL;
    }
    Py_XDECREF(error_classes);
    error_classes = Py_NewRef(classes);
    return Py_NewRef(Py_None);
}

static PyMethodDef functions[] = {
    {"load", native_load, METH_VARARGS, NULL},       {"save", native_save, METH_VARARGS, NULL},
    {"borders", native_borders, METH_VARARGS, NULL}, {"measure", native_measure, METH_VARARGS, NULL},
    {"render", native_render, METH_VARARGS, NULL},   {"options", native_options, METH_NOARGS, NULL},
    {"fields", native_fields, METH_O, NULL},         {"statuses", native_statuses, METH_NOARGS, NULL},
    {"set_errors", native_set_errors, METH_O, NULL}, {NULL, NULL, 0, NULL}};
static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, "quadwright._native", NULL, -1, functions, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__native(void)
{
    PyObject *m = PyModule_Create(&module);
    if (!m) return NULL;
    array_type = (PyTypeObject *)PyType_FromSpec(&array_spec);
    context_type = (PyTypeObject *)PyType_FromSpec(&context_spec);
    if (!array_type || !context_type || PyModule_AddObjectRef(m, "Array", (PyObject *)array_type) != 0 ||
        PyModule_AddObjectRef(m, "Context", (PyObject *)context_type) != 0 ||
        PyModule_AddStringConstant(m, "version", qw_version()) != 0)
        Py_CLEAR(m);
    return m;
}
