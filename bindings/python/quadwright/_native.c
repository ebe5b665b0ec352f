/* The C half of the Python package, on the limited API of CPython 3.11: failures, hooks, files, measuring, pictures,
 * and the tables of the library.
 *
 * Hooks of the library run on the thread that called it, with the GIL released around the call. A hook takes it back,
 * and leaves an exception set where one was raised; the library then unwinds, and the exception goes on to the caller.
 */
#include "_native.h"

#include "products/render/render.h"

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

int64_t native_now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

bool native_take_gil(hooks *h)
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
    int64_t now = native_now_ms();
    bool is_due = now - h->last >= PAUSE_MS || now < h->last || fraction >= 1;
    if (!is_due) return 0;
    h->last = now;
    bool was_released = native_take_gil(h);
    bool stops = PyErr_Occurred() || PyErr_CheckSignals() != 0;
    if (!stops && h->progress) stops = !tell_progress(h, stage, fraction);
    give_gil(h, was_released);
    return stops;
}

static void on_log(void *user, qw_log_level level, const char *message)
{
    hooks *h = user;
    if (!h->log) return;
    bool was_released = native_take_gil(h);
    if (!PyErr_Occurred()) {
        PyObject *text = PyUnicode_DecodeUTF8(message, (Py_ssize_t)strlen(message), "backslashreplace");
        PyObject *answer = text ? PyObject_CallFunction(h->log, "iO", (int)level, text) : NULL;
        Py_XDECREF(answer);
        Py_XDECREF(text);
        h->last = PyErr_Occurred() ? 0 : h->last; /* the next call of on_progress stops the run */
    }
    give_gil(h, was_released);
}

qw_host native_host(hooks *h, size_t memory_limit)
{
    return (qw_host){
        .memory_limit = memory_limit, .log = on_log, .log_user = h, .progress = on_progress, .progress_user = h};
}

/* ---- files, measuring, pictures */

/* ---- what files hold beside surfaces */

/* A mesh of a file, kept for its nodes, materials, images, skins and animations. */
typedef struct scene {
    PyObject_HEAD qw_mesh *mesh;
} scene;

static PyTypeObject *scene_type;

static void scene_free(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    qw_mesh_destroy(((scene *)self)->mesh);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    release(self);
    Py_DECREF(type);
}

static PyType_Slot scene_slots[] = {
    {Py_tp_dealloc, scene_free}, {Py_tp_doc, "What a file holds beside its surface."}, {0, NULL}};
static PyType_Spec scene_spec = {"quadwright._native.Scene", sizeof(scene), 0,
                                 Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION, scene_slots};

/* Takes the mesh over; without a scene it is destroyed. */
static PyObject *give_scene(qw_mesh *mesh, bool is_kept)
{
    allocfunc allocate = (allocfunc)PyType_GetSlot(scene_type, Py_tp_alloc);
    scene *s = is_kept ? (scene *)allocate(scene_type, 0) : NULL;
    if (s) s->mesh = mesh;
    else qw_mesh_destroy(mesh);
    return is_kept ? (PyObject *)s : Py_NewRef(Py_None);
}

const qw_mesh *native_scene_mesh(PyObject *object)
{
    return Py_TYPE(object) == scene_type ? ((scene *)object)->mesh : NULL;
}

/* ---- files */

/* (mesh, attributes, mtllib or None) */
static PyObject *give_loaded(const qw_mesh *mesh)
{
    qw_mesh_view view = qw_mesh_get(mesh);
    uint32_t count;
    const qw_attribute *attributes = qw_mesh_attributes(mesh, &count);
    const char *library = qw_mesh_library(mesh);
    PyObject *arrays = native_give_mesh(&view), *list = native_give_attributes(attributes, count);
    PyObject *names = library ? PyUnicode_DecodeUTF8(library, (Py_ssize_t)strlen(library), "surrogateescape")
                              : Py_NewRef(Py_None);
    if (arrays && list && names) return Py_BuildValue("NNN", arrays, list, names);
    Py_XDECREF(arrays), Py_XDECREF(list), Py_XDECREF(names);
    return NULL;
}

/* ((mesh, attributes, mtllib), scene) of files, by their names or, where data is not NULL, of a file's bytes. */
static PyObject *load(const char *const *path, uint32_t count, const Py_buffer *data, PyObject *log, bool has_scene)
{
    hooks h = {.log = native_or_null(log), .last = native_now_ms()};
    qw_host host = native_host(&h, 0);
    qw_mesh *mesh = NULL;
    h.released = PyEval_SaveThread();
    qw_status status = data ? qw_load_memory(data->buf, (size_t)data->len, &host, &mesh)
                            : qw_load_together(path, count, &host, &mesh);
    native_take_gil(&h);
    PyObject *result = status == QW_OK && !PyErr_Occurred() ? give_loaded(mesh)
                                                            : native_raise(status, qw_mesh_message(mesh));
    has_scene |= count > 1 || (path && qw_mesh_library(mesh)); /* what maps are baked from lies in or beside them */
    PyObject *rest = give_scene(mesh, result && has_scene);    /* the hooks are not called once the mesh is read */
    if (result && rest) return Py_BuildValue("NN", result, rest);
    Py_XDECREF(result), Py_XDECREF(rest);
    return NULL;
}

static PyObject *native_load(PyObject *self, PyObject *arguments)
{
    PyObject *list, *log, *result = NULL;
    int has_scene;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "O!Op", &PyList_Type, &list, &log, &has_scene)) return NULL;
    Py_ssize_t count = PyList_Size(list), taken = 0;
    PyObject **bytes = calloc((size_t)count + 1, sizeof *bytes);
    const char **path = calloc((size_t)count + 1, sizeof *path);
    if (!bytes || !path) PyErr_NoMemory();
    while (bytes && path && taken < count && PyUnicode_FSConverter(PyList_GetItem(list, taken), &bytes[taken]))
        path[taken] = PyBytes_AsString(bytes[taken]), taken++;
    if (taken == count && path) result = load(path, (uint32_t)count, NULL, log, has_scene);
    while (taken > 0) Py_DECREF(bytes[--taken]);
    free(bytes), free(path);
    return result;
}

static PyObject *native_load_memory(PyObject *self, PyObject *arguments)
{
    PyObject *log;
    Py_buffer data;
    int has_scene;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "y*Op", &data, &log, &has_scene)) return NULL;
    PyObject *result = load(NULL, 0, &data, log, has_scene);
    PyBuffer_Release(&data);
    return result;
}

/* What is done with a mesh and attributes of the caller. */
typedef struct wrapped {
    mesh_input in;
    attribute_list list;
    PyObject *library; /* bytes; NULL: none */
    qw_mesh *mesh;
    hooks hooks; /* of the mesh */
} wrapped;

static void wrapped_release(wrapped *w)
{
    qw_mesh_destroy(w->mesh);
    native_free_attributes(&w->list);
    native_release_mesh(&w->in);
    Py_XDECREF(w->library);
}

static bool wrap(wrapped *w, PyObject *mesh, PyObject *attributes, PyObject *library, PyObject *rest)
{
    *w = (wrapped){.hooks = {.last = native_now_ms()}};
    if (!native_take_mesh(mesh, &w->in) || !native_take_attributes(attributes, &w->list)) return false;
    if (library != Py_None && !(w->library = PyUnicode_AsEncodedString(library, "utf-8", "surrogateescape")))
        return false;
    const char *names = w->library ? PyBytes_AsString(w->library) : NULL;
    const qw_host host = native_host(&w->hooks, 0);
    const qw_mesh *source = NULL;
    if (rest != Py_None && Py_TYPE(rest) != scene_type) {
        PyErr_SetString(PyExc_TypeError, "scene: must be that of a mesh that was loaded, or None");
        return false;
    }
    if (rest != Py_None) source = ((scene *)rest)->mesh;
    qw_status status = qw_mesh_wrap(&w->in.view, w->list.attributes, w->list.count, names, source, &host, &w->mesh);
    return status == QW_OK ? true : (native_raise(status, qw_mesh_message(w->mesh)), false);
}

static PyObject *native_save(PyObject *self, PyObject *arguments)
{
    PyObject *mesh, *attributes, *library, *rest, *path, *result = NULL;
    int format;
    wrapped w;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OOOOO&i", &mesh, &attributes, &library, &rest, PyUnicode_FSConverter, &path,
                          &format))
        return NULL;
    if (wrap(&w, mesh, attributes, library, rest)) {
        const char *name = PyBytes_AsString(path);
        w.hooks.released = PyEval_SaveThread();
        qw_status status = qw_mesh_save(w.mesh, name, (qw_format)format);
        native_take_gil(&w.hooks);
        result = status == QW_OK && !PyErr_Occurred() ? Py_NewRef(Py_None)
                                                      : native_raise(status, qw_mesh_message(w.mesh));
    }
    wrapped_release(&w);
    Py_DECREF(path);
    return result;
}

/* Levels of detail, [(mesh, attributes)] with the finest first, in one file of glTF. */
static PyObject *native_save_levels(PyObject *self, PyObject *arguments)
{
    PyObject *list, *rest, *path, *result = NULL;
    int format;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "O!OO&i", &PyList_Type, &list, &rest, PyUnicode_FSConverter, &path, &format))
        return NULL;
    size_t count = (size_t)PyList_Size(list);
    wrapped *levels = calloc(count + 1, sizeof *levels);
    const qw_mesh **meshes = calloc(count + 1, sizeof *meshes);
    bool is_whole = levels && meshes;
    if (!is_whole) PyErr_NoMemory();
    for (size_t i = 0; is_whole && i < count; i++) {
        PyObject *mesh, *attributes;
        is_whole = PyArg_ParseTuple(PyList_GetItem(list, (Py_ssize_t)i), "OO", &mesh, &attributes) &&
                   wrap(&levels[i], mesh, attributes, Py_None, Py_None);
        if (is_whole) meshes[i] = levels[i].mesh;
    }
    if (is_whole) {
        char message[512];
        const char *name = PyBytes_AsString(path);
        const qw_mesh *source = native_scene_mesh(rest);
        PyThreadState *released = PyEval_SaveThread();
        qw_status status = qw_save_levels(meshes, (uint32_t)count, source, name, (qw_format)format, message,
                                          sizeof message);
        PyEval_RestoreThread(released);
        result = status == QW_OK ? Py_NewRef(Py_None) : native_raise(status, message);
    }
    for (size_t i = 0; levels && i < count; i++) wrapped_release(&levels[i]);
    free(levels), free(meshes);
    Py_DECREF(path);
    return result;
}

/* Edges at which attributes of these names ("uv,material") differ: int32 (n, 2). */
static PyObject *native_borders(PyObject *self, PyObject *arguments)
{
    PyObject *mesh, *attributes, *names, *result = NULL;
    wrapped w;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OOO", &mesh, &attributes, &names)) return NULL;
    if (wrap(&w, mesh, attributes, names, Py_None)) { /* the names go the way of a library's */
        qw_status status = qw_mesh_mark(w.mesh, PyBytes_AsString(w.library), NULL);
        qw_mesh_view view = qw_mesh_get(w.mesh);
        result = status == QW_OK ? native_numbers(view.marked_edges, 'i', view.marked_edge_count, 2)
                                 : native_raise(status, qw_mesh_message(w.mesh));
    }
    wrapped_release(&w);
    return result;
}

/* The faces that have a label, "arm" or "group=arm": uint8 (faces,). */
static PyObject *native_region(PyObject *self, PyObject *arguments)
{
    PyObject *mesh, *attributes, *label, *result = NULL;
    wrapped w;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OOO", &mesh, &attributes, &label)) return NULL;
    if (wrap(&w, mesh, attributes, label, Py_None)) { /* the label goes the way of a library */
        uint32_t faces = w.in.view.face_count;
        uint8_t *inside = calloc(faces + (size_t)1, 1);
        qw_status status = inside ? qw_mesh_region(w.mesh, PyBytes_AsString(w.library), inside) : QW_MEMORY;
        result = status == QW_OK ? native_array(inside, "B", 1, faces, 0)
                                 : native_raise(status, inside ? qw_mesh_message(w.mesh) : qw_status_text(status));
        free(inside);
    }
    wrapped_release(&w);
    return result;
}

/* Triangles that join points without faces to their neighbours: int32 (faces, 3). */
static PyObject *native_points(PyObject *self, PyObject *mesh)
{
    PyObject *result;
    mesh_input in;
    qw_mesh *points;
    (void)self;
    if (!native_take_mesh(mesh, &in)) return NULL;
    hooks h = {.last = native_now_ms()};
    const qw_host host = native_host(&h, 0);
    h.released = PyEval_SaveThread();
    qw_status status = qw_mesh_of_points(in.view.positions, in.view.vertex_count, NULL, 0, &host, &points);
    native_take_gil(&h);
    qw_mesh_view view = qw_mesh_get(points);
    if (status == QW_OK && !PyErr_Occurred()) result = native_numbers(view.corners, 'i', view.face_count, 3);
    else result = native_raise(status, points ? qw_mesh_message(points) : qw_status_text(status));
    qw_mesh_destroy(points);
    native_release_mesh(&in);
    return result;
}

/* The sentence of a failure of qw_measure_seen comes by way of its log. */
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
    mesh_input in, surface = {0};
    double gap;
    (void)self;
    if (!PyArg_ParseTuple(arguments, "OOd", &mesh, &against, &gap)) return NULL;
    if (!native_take_mesh(mesh, &in)) return NULL;
    if (against != Py_None && !native_take_mesh(against, &surface)) {
        native_release_mesh(&in);
        return NULL;
    }
    measuring m = {.hooks = {.last = native_now_ms()}};
    qw_host host = native_host(&m.hooks, 0);
    host.log = keep_message, host.log_user = &m;
    qw_topology topology;
    qw_quality quality;
    m.hooks.released = PyEval_SaveThread();
    const qw_mesh_view *other = against == Py_None ? NULL : &surface.view;
    qw_status status = qw_measure_seen(&in.view, other, gap, &host, &topology, &quality);
    native_take_gil(&m.hooks);
    if (status == QW_OK && !PyErr_Occurred()) {
        static char text[16384];
        size_t length = qw_measures_json(&topology, &quality, text, sizeof text);
        result = PyUnicode_FromStringAndSize(text, (Py_ssize_t)length);
    } else native_raise(status, m.message[0] ? m.message : qw_status_text(status));
    native_release_mesh(&in), native_release_mesh(&surface);
    return result;
}

enum { MOST_MESHES = 6 };

static PyObject *draw(PyObject *meshes, const render_options *options, PyObject *follow, const char *path)
{
    mesh_input in[MOST_MESHES], surface = {0};
    render_panel panels[MOST_MESHES];
    render_options o = *options;
    Py_ssize_t count = PyList_Size(meshes), taken = 0;
    PyObject *result = NULL;
    char message[512];
    if (count < 0 || count > MOST_MESHES) {
        if (count > 0) PyErr_SetString(PyExc_ValueError, "meshes: a picture holds at most 6");
        return NULL;
    }
    bool is_ready = follow == Py_None || native_take_mesh(follow, &surface);
    for (; is_ready && taken < count; taken += is_ready) {
        PyObject *mesh;
        const char *caption;
        is_ready = PyArg_ParseTuple(PyList_GetItem(meshes, taken), "Oz", &mesh, &caption) &&
                   native_take_mesh(mesh, &in[taken]);
        if (is_ready) panels[taken] = (render_panel){.mesh = &in[taken].view, .caption = caption};
    }
    if (is_ready) {
        hooks h = {.last = native_now_ms()};
        qw_host host = native_host(&h, 0);
        if (follow != Py_None) o.follow = &surface.view;
        h.released = PyEval_SaveThread();
        qw_status status = render_sheet(panels, (size_t)count, &o, path, &host, message, sizeof message);
        native_take_gil(&h);
        result = status == QW_OK && !PyErr_Occurred() ? Py_NewRef(Py_None) : native_raise(status, message);
    }
    for (Py_ssize_t i = 0; i < taken; i++) native_release_mesh(&in[i]);
    native_release_mesh(&surface);
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

static PyObject *list_options(size_t count, const qw_option_info *(*at)(size_t index))
{
    static const char *const kinds[] = {"count", "real", "flag", "choice"};
    PyObject *list = PyList_New(0);
    for (size_t i = 0; list && i < count; i++) {
        const qw_option_info *o = at(i);
        PyObject *row = Py_BuildValue("ssdddszs", o->name, kinds[o->kind], o->initial, o->least, o->most, o->unit,
                                      o->choices, o->help);
        if (!row || PyList_Append(list, row) != 0) Py_CLEAR(list);
        Py_XDECREF(row);
    }
    return list;
}

static PyObject *native_options(PyObject *self, PyObject *none)
{
    (void)self, (void)none;
    return list_options(qw_option_count(), qw_option_at);
}

static PyObject *native_asset_options(PyObject *self, PyObject *none)
{
    (void)self, (void)none;
    return list_options(qw_asset_option_count(), qw_asset_option_at);
}

/* The number of maps in words. */
static PyObject *native_maps(PyObject *self, PyObject *text)
{
    (void)self;
    char message[256];
    uint32_t maps;
    const char *utf8 = PyUnicode_AsUTF8AndSize(text, NULL);
    if (!utf8) return NULL;
    if (qw_maps_named(utf8, &maps, message, sizeof message) == QW_OK) return PyLong_FromUnsignedLong(maps);
    PyErr_SetString(PyExc_ValueError, message);
    return NULL;
}

static PyObject *native_presets(PyObject *self, PyObject *none)
{
    (void)self, (void)none;
    PyObject *list = PyList_New(0);
    const qw_preset_info *p;
    for (size_t i = 0; list && (p = qw_preset_at(i)); i++) {
        PyObject *row = Py_BuildValue("sss", p->name, p->settings, p->help);
        if (!row || PyList_Append(list, row) != 0) Py_CLEAR(list);
        Py_XDECREF(row);
    }
    return list;
}

static PyObject *native_memory_size(PyObject *self, PyObject *text)
{
    (void)self;
    char message[128];
    uint64_t bytes;
    const char *utf8 = PyUnicode_AsUTF8AndSize(text, NULL);
    if (!utf8) return NULL;
    if (qw_memory_size(utf8, &bytes, message, sizeof message) == QW_OK) return PyLong_FromUnsignedLongLong(bytes);
    PyErr_SetString(PyExc_ValueError, message);
    return NULL;
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
                                  {"save_levels", native_save_levels, METH_VARARGS, NULL},
                                  {"borders", native_borders, METH_VARARGS, NULL},
                                  {"region", native_region, METH_VARARGS, NULL},
                                  {"points", native_points, METH_O, NULL},
                                  {"measure", native_measure, METH_VARARGS, NULL},
                                  {"render", native_render, METH_VARARGS, NULL},
                                  {"options", native_options, METH_NOARGS, NULL},
                                  {"load_memory", native_load_memory, METH_VARARGS, NULL},
                                  {"asset_options", native_asset_options, METH_NOARGS, NULL},
                                  {"maps", native_maps, METH_O, NULL},
                                  {"presets", native_presets, METH_NOARGS, NULL},
                                  {"memory_size", native_memory_size, METH_O, NULL},
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
    PyObject *array_type = native_make_array_type(), *context_type = native_make_context_type();
    scene_type = (PyTypeObject *)PyType_FromSpec(&scene_spec);
    if (!array_type || !context_type || !scene_type || PyModule_AddObjectRef(m, "Array", array_type) != 0 ||
        PyModule_AddObjectRef(m, "Context", context_type) != 0 ||
        PyModule_AddStringConstant(m, "version", qw_version()) != 0)
        Py_CLEAR(m);
    return m;
}
