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
#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030b0000
#include <Python.h>

#include "quadwright/quadwright.h"
#include "render.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static PyObject *error_classes; /* list: the exception class of each status, set by __init__.py */

/* ---- failures */

static PyObject *raise(qw_status status, const char *message)
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
    PyObject_HEAD void *data; /* malloc'ed; shape[0] * ... elements of the format */
    Py_ssize_t shape[2], strides[2], itemsize;
    int dimensions;
    char format[2];
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
                        .format = flags & PyBUF_FORMAT ? a->format : NULL,
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

/* A copy of rows * columns elements (columns 0: of one dimension). */
static PyObject *array_of(const void *data, char format, Py_ssize_t rows, Py_ssize_t columns)
{
    allocfunc allocate = (allocfunc)PyType_GetSlot(array_type, Py_tp_alloc);
    array *a = (array *)allocate(array_type, 0);
    if (!a) return NULL;
    a->itemsize = format == 'd' ? 8 : 4;
    a->format[0] = format;
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

static bool take_buffer(PyObject *object, Py_buffer *buffer, const char *formats, Py_ssize_t itemsize, const char *name)
{
    if (PyObject_GetBuffer(object, buffer, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) {
        buffer->obj = NULL;
        return false;
    }
    const char *format = buffer->format ? buffer->format : "B";
    if (*format == '@' || *format == '=') format++;
    if (buffer->itemsize == itemsize && format[0] && !format[1] && strchr(formats, format[0])) return true;
    PyErr_Format(PyExc_TypeError, "%s: the buffer has items of format %s", name, buffer->format ? buffer->format : "B");
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
    if (!take_buffer(positions, &in->positions, "d", 8, "vertices")) return false;
    if (!take_buffer(corners, &in->corners, "IiLl", 4, "faces")) return false;
    if (sizes != Py_None && !take_buffer(sizes, &in->sizes, "IiLl", 4, "face_sizes")) return false;
    if (marks != Py_None && !take_buffer(marks, &in->marks, "IiLl", 4, "marked_edges")) return false;
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
        if (status != QW_OK) return raise(status, message), false;
    }
    qw_status status = count < 0 ? QW_OPTION : qw_options_validate(options, message, sizeof message);
    return status == QW_OK ? true : (raise(status, message), false);
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
    return status == QW_OK ? 0 : (raise(status, qw_status_text(status)), -1);
}

static void context_free(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    qw_destroy(((context *)self)->context);
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

static PyObject *context_set_mesh(PyObject *self, PyObject *mesh)
{
    context *c = (context *)self;
    input in;
    if (!input_take(mesh, &in)) return NULL;
    PyObject *result = NULL;
    if (begin(c, Py_None, Py_None)) {
        /* with the GIL held: no other thread changes the arrays between the library's check and its copy */
        qw_status status = qw_set_mesh(c->context, &in.view);
        result = status == QW_OK && !PyErr_Occurred() ? Py_NewRef(Py_None) : raise(status, qw_message(c->context));
        end(c);
    }
    input_release(&in);
    return result;
}

static PyObject *context_run(PyObject *self, PyObject *arguments)
{
    context *c = (context *)self;
    PyObject *pairs, *progress, *log, *result = NULL;
    qw_options options;
    if (!PyArg_ParseTuple(arguments, "OOO", &pairs, &progress, &log) || !set_options(pairs, &options)) return NULL;
    if (!begin(c, progress, log)) return NULL;
    c->hooks.released = PyEval_SaveThread();
    qw_status status = qw_run(c->context, &options);
    take_gil(&c->hooks);
    qw_mesh_view view;
    if (status == QW_OK && !PyErr_Occurred()) status = qw_get_mesh(c->context, &view);
    if (status == QW_OK && !PyErr_Occurred()) {
        PyObject *mesh = give_mesh(&view), *report = report_text(qw_get_report(c->context));
        if (mesh && report) result = Py_BuildValue("NN", mesh, report);
        else Py_XDECREF(mesh), Py_XDECREF(report);
    } else raise(status, qw_message(c->context));
    end(c);
    return result;
}

static PyMethodDef context_methods[] = {{"set_mesh", context_set_mesh, METH_O, "Copies a mesh into the context."},
                                        {"run", context_run, METH_VARARGS, "Remeshes with these options."},
                                        {NULL, NULL, 0, NULL}};
static PyType_Slot context_slots[] = {{Py_tp_init, context_init},
                                      {Py_tp_dealloc, context_free},
                                      {Py_tp_methods, context_methods},
                                      {Py_tp_doc, "A context of the library."},
                                      {0, NULL}};
static PyType_Spec context_spec = {"quadwright._native.Context", sizeof(context), 0, Py_TPFLAGS_DEFAULT, context_slots};

/* ---- files, measuring, pictures */

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
    qw_mesh_view view = qw_mesh_get(mesh);
    PyObject *result = status == QW_OK && !PyErr_Occurred() ? give_mesh(&view) : raise(status, qw_mesh_message(mesh));
    qw_mesh_destroy(mesh);
    Py_DECREF(path);
    return result;
}

static PyObject *native_save(PyObject *self, PyObject *arguments)
{
    PyObject *mesh, *path;
    int format;
    input in;
    char message[512];
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OO&i", &mesh, PyUnicode_FSConverter, &path, &format)) return NULL;
    PyObject *result = NULL;
    if (input_take(mesh, &in)) {
        const char *name = PyBytes_AsString(path);
        qw_status status = qw_save(&in.view, name, (qw_format)format, message, sizeof message);
        result = status == QW_OK ? Py_NewRef(Py_None) : raise(status, message);
        input_release(&in);
    }
    Py_DECREF(path);
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
    } else raise(status, m.message[0] ? m.message : qw_status_text(status));
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
        result = status == QW_OK && !PyErr_Occurred() ? Py_NewRef(Py_None) : raise(status, message);
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

static PyMethodDef functions[] = {{"load", native_load, METH_VARARGS, NULL},
                                  {"save", native_save, METH_VARARGS, NULL},
                                  {"measure", native_measure, METH_VARARGS, NULL},
                                  {"render", native_render, METH_VARARGS, NULL},
                                  {"options", native_options, METH_NOARGS, NULL},
                                  {"fields", native_fields, METH_O, NULL},
                                  {"statuses", native_statuses, METH_NOARGS, NULL},
                                  {"set_errors", native_set_errors, METH_O, NULL},
                                  {NULL, NULL, 0, NULL}};
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
