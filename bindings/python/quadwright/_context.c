/* Contexts of the library: a surface, what steers its quads, and runs. */
#include "_native.h"

#include <stdlib.h>
#include <string.h>

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

static bool set_asset_options(PyObject *pairs, qw_asset_options *options)
{
    char message[256];
    qw_asset_options_init(options);
    Py_ssize_t count = PyList_Size(pairs);
    for (Py_ssize_t i = 0; i < count; i++) {
        const char *name, *value;
        if (!PyArg_ParseTuple(PyList_GetItem(pairs, i), "ss", &name, &value)) return false;
        qw_status status = qw_asset_option_set(options, name, value, message, sizeof message);
        if (status != QW_OK) return native_raise(status, message), false;
    }
    return count >= 0;
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

static PyObject *asset_text(const qw_asset_report *report)
{
    char text[4096];
    size_t length = qw_asset_json(report, text, sizeof text);
    return PyUnicode_FromStringAndSize(text, (Py_ssize_t)(length < sizeof text ? length : sizeof text - 1));
}

/* ---- contexts */

typedef struct context {
    PyObject_HEAD qw_context *context;
    hooks hooks;
    bool is_busy;
    attribute_list attributes;   /* of the surface, to be carried to each result */
    const qw_attribute *carried; /* qw_attribute[attributes.count]: of the last run, for what it saves; NULL: none */
    unsigned long runs;          /* so far */
} context;

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
    qw_host host = native_host(&c->hooks, (size_t)limit);
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
    c->hooks = (hooks){.progress = native_or_null(progress), .log = native_or_null(log), .last = native_now_ms()};
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
    mesh_input in;
    if (!native_take_mesh(mesh, &in)) return NULL;
    PyObject *result = begin(c, Py_None, Py_None) ? settle(c, qw_set_mesh(c->context, &in.view)) : NULL;
    native_release_mesh(&in);
    return result;
}

static PyObject *context_set_attributes(PyObject *self, PyObject *tuples)
{
    context *c = (context *)self;
    attribute_list list;
    PyObject *result = NULL;
    if (native_take_attributes(tuples, &list) && begin(c, Py_None, Py_None)) {
        attribute_list old = c->attributes;
        c->attributes = list, list = old;
        result = settle(c, qw_set_motion(c->context, c->attributes.attributes, c->attributes.count));
    }
    native_free_attributes(&list);
    return result;
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
        unsigned rings;
        if (!PyArg_ParseTuple(PyList_GetItem(list, i), "OipI", &points, &kind, &closed, &rings)) return NULL;
        if (!native_take_buffer(points, &buffers[i], "d", 8, "guides")) return NULL;
        guides[i] = (qw_guide){.size = sizeof *guides,
                               .kind = (qw_guide_kind)kind,
                               .closed = closed,
                               .point_count = (uint32_t)(buffers[i].len / 24),
                               .points = buffers[i].buf,
                               .rings = rings};
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

/* uint8 (faces,), or None. */
static PyObject *context_set_region(PyObject *self, PyObject *inside)
{
    context *c = (context *)self;
    Py_buffer buffer = {0};
    if (inside != Py_None && !native_take_buffer(inside, &buffer, "B", 1, "region")) return NULL;
    PyObject *result = NULL;
    if (begin(c, Py_None, Py_None))
        result = settle(c, qw_set_region(c->context, buffer.obj ? buffer.buf : NULL, (uint32_t)buffer.len));
    if (buffer.obj) PyBuffer_Release(&buffer);
    return result;
}

/* Texture coordinates of the result's own, and maps on them. */
typedef struct asset {
    int is_wanted, bakes;
    unsigned maps;
    qw_asset_options options;
    mesh_input in; /* the surface, where it is baked */
    qw_mesh *mesh; /* the same with its attributes and what its file holds */
    hooks hooks;   /* of the mesh */
    qw_attribute uv;
    qw_asset_report report;
    const qw_image *image; /* qw_image[images] */
    uint32_t images;
} asset;

/* What a run is asked for beside the quads, and what it gives. */
typedef struct outcome {
    int wants_provenance, field_domain; /* 0 or 1; a qw_domain, or -1: no field */
    int shading;                        /* a qw_shading, or -1: no normals of the quads */
    qw_attribute own[2];                /* normals where these are wanted; which faces lie in holes that were closed */
    uint32_t owned;
    unsigned most_weights;
    qw_mesh_view mesh, coarse;   /* coarse.size: 0 where nothing was split */
    const qw_attribute *carried; /* NULL: none */
    qw_transfer_report transfer;
    qw_provenance provenance;
    qw_cross_field field;
    asset asset;
} outcome;

/* what: None, or (options, maps or -1, mesh, scene or None). */
static bool take_asset(context *c, PyObject *what, asset *a)
{
    PyObject *pairs, *mesh, *rest;
    long maps;
    if (what == Py_None) return true;
    if (!PyArg_ParseTuple(what, "OlOO", &pairs, &maps, &mesh, &rest)) return false;
    if (!set_asset_options(pairs, &a->options)) return false;
    a->is_wanted = 1, a->bakes = maps >= 0, a->maps = maps < 0 ? 0 : (unsigned)maps;
    if (!a->bakes) return true;
    if (!native_take_mesh(mesh, &a->in)) return false;
    const qw_host host = native_host(&a->hooks, 0);
    qw_status status = qw_mesh_wrap(&a->in.view, c->attributes.attributes, c->attributes.count, NULL,
                                    native_scene_mesh(rest), &host, &a->mesh);
    return status == QW_OK ? true : (native_raise(status, qw_mesh_message(a->mesh)), false);
}

static void release_asset(asset *a)
{
    qw_mesh_destroy(a->mesh);
    native_release_mesh(&a->in);
}

/* Without the GIL. Labels of materials are borders of charts, unless maps make one material of all. */
static qw_status unwrap(context *c, asset *a, const qw_attribute *carried)
{
    const int32_t *borders = NULL;
    for (uint32_t i = 0; carried && !a->bakes && i < c->attributes.count; i++)
        if (carried[i].kind == QW_LABELS && carried[i].domain == QW_PER_FACE && !strcmp(carried[i].name, "material"))
            borders = carried[i].labels;
    qw_status status = qw_unwrap(c->context, &a->options, borders, &a->uv, &a->report);
    if (status == QW_OK && a->bakes) status = qw_bake(c->context, a->mesh, a->maps, &a->image, &a->images, &a->report);
    return status;
}

static bool has_attribute(const context *c, const char *name)
{
    for (uint32_t i = 0; i < c->attributes.count; i++)
        if (!strcmp(c->attributes.attributes[i].name, name)) return true;
    return false;
}

/* Without the GIL. */
static qw_status compute(context *c, const qw_options *options, outcome *o)
{
    qw_status status = qw_run(c->context, options);
    if (status == QW_OK && c->attributes.count > 0)
        status = qw_transfer(c->context, c->attributes.attributes, c->attributes.count, o->most_weights, &o->carried,
                             &o->transfer);
    if (status == QW_OK && (o->wants_provenance || c->attributes.count > 0))
        status = qw_get_provenance(c->context, &o->provenance);
    if (status == QW_OK && qw_get_report(c->context)->filled_holes > 0 && !has_attribute(c, "filled"))
        status = qw_get_filled(c->context, &o->own[o->owned++]);
    if (status == QW_OK && o->field_domain >= 0)
        status = qw_get_field(c->context, (qw_domain)o->field_domain, &o->field);
    if (status == QW_OK && o->asset.is_wanted) status = unwrap(c, &o->asset, o->carried);
    if (status == QW_OK && o->shading >= 0) /* with maps those that they bend */
        status = qw_get_normals(c->context, (qw_shading)o->shading, &o->own[o->owned++]);
    if (status == QW_OK && qw_get_report(c->context)->coarse_faces > 0) status = qw_get_coarse(c->context, &o->coarse);
    return status == QW_OK ? qw_get_mesh(c->context, &o->mesh) : status;
}

/* [(map, tile, height, width, channels, array of height rows)] */
static PyObject *give_images(const asset *a)
{
    PyObject *list = PyList_New(0);
    for (uint32_t i = 0; list && i < a->images; i++) {
        const qw_image *m = &a->image[i];
        PyObject *one = Py_BuildValue("sIIIIN", qw_map_name(m->map), m->tile, m->height, m->width, m->channels,
                                      native_array(m->pixels, m->bits == 16 ? "H" : "B", m->bits / 8, m->height,
                                                   (Py_ssize_t)m->width * m->channels));
        if (!one || PyList_Append(list, one) != 0) Py_CLEAR(list);
        Py_XDECREF(one);
    }
    return list;
}

/* (texture coordinates, report, images, number of the run), or None */
static PyObject *give_asset(const context *c, const asset *a)
{
    if (!a->is_wanted) return Py_NewRef(Py_None);
    PyObject *uv = native_give_attributes(&a->uv, 1), *text = asset_text(&a->report), *images = give_images(a);
    if (uv && text && images) return Py_BuildValue("NNNk", uv, text, images, c->runs);
    Py_XDECREF(uv), Py_XDECREF(text), Py_XDECREF(images);
    return NULL;
}

/* (mesh, report, attributes, transfer report or None, provenance or None, field or None, attributes of its own, asset
   or None, coarse mesh or None) */
static PyObject *give_outcome(const context *c, const outcome *o)
{
    PyObject *parts[] = {
        native_give_mesh(&o->mesh),
        report_text(qw_get_report(c->context)),
        native_give_attributes(o->carried, o->carried ? c->attributes.count : 0),
        o->carried ? Py_BuildValue("{sIsIsIsIsIsI}", "charts", o->transfer.charts, "straddling_quads",
                                   o->transfer.straddling_quads, "filled_vertices", o->transfer.filled_vertices,
                                   "filled_corners", o->transfer.filled_corners, "filled_faces",
                                   o->transfer.filled_faces, "dropped_weights", o->transfer.dropped_weights)
                   : Py_NewRef(Py_None),
        o->provenance.size ? native_give_provenance(&o->provenance) : Py_NewRef(Py_None),
        o->field.size ? native_array(o->field.directions, "f", 4, o->field.count, 3) : Py_NewRef(Py_None),
        native_give_attributes(o->own, o->owned),
        give_asset(c, &o->asset),
        o->coarse.size ? native_give_mesh(&o->coarse) : Py_NewRef(Py_None)};
    enum { PARTS = sizeof parts / sizeof *parts };
    bool is_whole = true;
    for (int i = 0; i < PARTS; i++) is_whole &= parts[i] != NULL;
    if (is_whole)
        return Py_BuildValue("NNNNNNNNN", parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], parts[6],
                             parts[7], parts[8]);
    for (int i = 0; i < PARTS; i++) Py_XDECREF(parts[i]);
    return NULL;
}

static PyObject *run(context *c, PyObject *progress, PyObject *log, const qw_options *options, outcome *o)
{
    PyObject *result = NULL;
    if (!begin(c, progress, log)) return NULL;
    c->carried = NULL, c->runs++;
    c->hooks.released = PyEval_SaveThread();
    qw_status status = compute(c, options, o);
    native_take_gil(&c->hooks);
    c->carried = o->carried;
    if (status == QW_OK && !PyErr_Occurred()) result = give_outcome(c, o);
    else native_raise(status, qw_message(c->context));
    end(c);
    return result;
}

static PyObject *context_run(PyObject *self, PyObject *arguments)
{
    PyObject *pairs, *progress, *log, *of_asset, *result = NULL;
    qw_options options;
    outcome o = {0};
    if (!PyArg_ParseTuple(arguments, "OOOpIiiO", &pairs, &progress, &log, &o.wants_provenance, &o.most_weights,
                          &o.field_domain, &o.shading, &of_asset) ||
        !set_options(pairs, &options))
        return NULL;
    if (take_asset((context *)self, of_asset, &o.asset)) result = run((context *)self, progress, log, &options, &o);
    release_asset(&o.asset);
    return result;
}

/* The last run's result with its maps, as a file. */
static PyObject *context_save_asset(PyObject *self, PyObject *arguments)
{
    context *c = (context *)self;
    PyObject *path, *result = NULL;
    int format;
    unsigned long number;
    if (!PyArg_ParseTuple(arguments, "kO&i", &number, PyUnicode_FSConverter, &path, &format)) return NULL;
    if (number != c->runs)
        PyErr_SetString(PyExc_RuntimeError,
                        "the Remesher has made another result since: its maps are saved before that");
    else if (begin(c, Py_None, Py_None)) {
        const char *name = PyBytes_AsString(path);
        c->hooks.released = PyEval_SaveThread();
        qw_status status = qw_save_asset(c->context, c->carried, c->carried ? c->attributes.count : 0, name,
                                         (qw_format)format);
        native_take_gil(&c->hooks);
        result = settle(c, status);
    }
    Py_DECREF(path);
    return result;
}

/* The limit surface of the last run's result, a patch a quad or a grid of them. */
static PyObject *context_save_patches(PyObject *self, PyObject *arguments)
{
    context *c = (context *)self;
    PyObject *path, *result = NULL;
    int of_blocks;
    if (!PyArg_ParseTuple(arguments, "O&p", PyUnicode_FSConverter, &path, &of_blocks)) return NULL;
    if (begin(c, Py_None, Py_None)) {
        const char *name = PyBytes_AsString(path);
        c->hooks.released = PyEval_SaveThread();
        qw_status status = qw_save_patches_from(c->context, name,
                                                of_blocks ? QW_PATCHES_OF_BLOCKS : QW_PATCHES_OF_QUADS);
        native_take_gil(&c->hooks);
        result = settle(c, status);
    }
    Py_DECREF(path);
    return result;
}

static PyMethodDef context_methods[] = {
    {"set_mesh", context_set_mesh, METH_O, "Copies a mesh into the context."},
    {"set_attributes", context_set_attributes, METH_O, "What is carried over."},
    {"set_density", context_set_density, METH_O, "One a vertex, or None."},
    {"set_field", context_set_field, METH_VARARGS, "Crosses, or a file's."},
    {"set_region", context_set_region, METH_O, "1 inside, 0 outside; or None."},
    {"set_guides", context_set_guides, METH_O, "Polylines, or a file's."},
    {"run", context_run, METH_VARARGS, "Remeshes with these options."},
    {"save_asset", context_save_asset, METH_VARARGS, "A result with its maps."},
    {"save_patches", context_save_patches, METH_VARARGS, "Its limit surface, as STEP."},
    {NULL, NULL, 0, NULL}};
static PyType_Slot context_slots[] = {{Py_tp_init, context_init},
                                      {Py_tp_dealloc, context_free},
                                      {Py_tp_methods, context_methods},
                                      {Py_tp_doc, "A context of the library."},
                                      {0, NULL}};
static PyType_Spec context_spec = {"quadwright._native.Context", sizeof(context), 0, Py_TPFLAGS_DEFAULT, context_slots};

PyObject *native_make_context_type(void) { return PyType_FromSpec(&context_spec); }
