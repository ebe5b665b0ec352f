"""What the tests in Blender share."""
import ctypes
import glob
import os
import struct
import sys
import time

import bpy
import numpy as np

OUT = os.environ["QUADWRIGHT_BLENDER_OUT"]
NAME = "quadwright_remesh"


def install():
    """The zip as a user installs it, and the add-on's modules."""
    bpy.ops.preferences.addon_install(filepath=glob.glob(os.path.join(OUT, "*.zip"))[0], overwrite=True)
    assert bpy.ops.preferences.addon_enable(module=NAME) == {"FINISHED"}


def module(name):
    return sys.modules[f"{NAME}.{name}"]


def fresh():
    """An empty scene with default settings: those."""
    if bpy.context.object and bpy.context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.curves, bpy.data.armatures, bpy.data.materials):
        for block in list(collection):
            collection.remove(block)
    for library in list(bpy.data.libraries):
        bpy.data.libraries.remove(library)
    scene = bpy.context.scene
    scene.property_unset("quadwright")
    if "quadwright" in scene:
        del scene["quadwright"]
    module("state").forget()
    return scene.quadwright


def read(collection, name, dtype, width=1):
    array = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, array)
    return array.reshape(-1, width) if width > 1 else array


def places(mesh):
    return read(mesh.vertices, "co", np.float32, 3).astype(float)


def quads(mesh):
    assert (read(mesh.polygons, "loop_total", np.int32) == 4).all(), "not all faces are quads"
    return read(mesh.loops, "vertex_index", np.int32).reshape(-1, 4)


def edge_lengths(obj):
    """In the scene."""
    matrix = np.array(obj.matrix_world)[:3, :3]
    points = places(obj.data) @ matrix.T
    ends = read(obj.data.edges, "vertices", np.int32, 2)
    return np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)


def state_of(obj):
    """All of an object that a failed run must leave alone, as bytes."""
    mesh = obj.data
    parts = [
        mesh.name,
        obj.name,
        repr([m.name for m in obj.modifiers]),
        repr([g.name for g in obj.vertex_groups]),
        repr([m.name if m else None for m in mesh.materials]),
        repr([layer.name for layer in mesh.uv_layers]),
        repr(obj.mode),
        repr(sorted(o.name for o in bpy.data.objects)),
        repr(sorted(m.name for m in bpy.data.meshes)),
        repr([k.name for k in mesh.shape_keys.key_blocks] if mesh.shape_keys else None),
    ]
    return "\n".join(parts).encode() + places(mesh).tobytes() + read(mesh.loops, "vertex_index", np.int32).tobytes()


def suzanne(levels=2, apply=False):
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.object
    if levels:
        obj.modifiers.new("Subdivision", "SUBSURF").levels = levels
        if apply:
            bpy.ops.object.modifier_apply(modifier="Subdivision")
    return obj


def sphere(radius=1.0, segments=96, rings=48):
    """Its faces in an order of their own: Blender's operator makes another in each process."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=segments, ring_count=rings)
    mesh = bpy.context.object.data
    at, uvs = places(mesh), read(mesh.uv_layers[0].data, "uv", np.float32, 2)
    faces = [list(zip(f.vertices, uvs[f.loop_start : f.loop_start + f.loop_total].tolist())) for f in mesh.polygons]
    faces = sorted(f[i:] + f[:i] for f in faces for i in [f.index(min(f))])
    mesh.clear_geometry()
    mesh.from_pydata(at, [], [[v for v, _ in f] for f in faces])
    mesh.uv_layers.new().data.foreach_set("uv", np.array([uv for f in faces for _, uv in f], np.float32).reshape(-1))
    return bpy.context.object


def bumpy_sphere(segments, rings, height=0.08):
    """Made of arrays: Blender's own operator takes minutes for as many."""
    u, v = np.meshgrid(np.arange(segments), np.arange(1, rings), indexing="ij")
    a, b = 2 * np.pi * u / segments, np.pi * v / rings
    points = np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(segments), np.arange(rings - 2), indexing="ij")
    at = lambda i, j: (i % segments) * (rings - 1) + j  # noqa: E731
    faces = np.stack([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)], -1).reshape(-1)
    points *= 1 + height * np.sin(5 * points[:, :1]) * np.cos(4 * points[:, 1:2])
    mesh = bpy.data.meshes.new("Ball")
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
    mesh.loops.add(len(faces))
    mesh.loops.foreach_set("vertex_index", faces.astype(np.int32))
    mesh.polygons.add(len(faces) // 4)
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(faces), 4, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(len(faces) // 4, 4, np.int32))
    mesh.update(calc_edges=True)
    obj = bpy.data.objects.new("Ball", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    return obj


def grid(count=50, size=2.0):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=count, y_subdivisions=count, size=size)
    return bpy.context.object


def remesh():
    """The button, in a script: the sentence of a refusal is raised as a RuntimeError."""
    return bpy.ops.object.quadwright_remesh()


def write_obj(path, mesh):
    """The mesh with its polygons, in decimals that give the same doubles back."""
    with open(path, "w") as file:
        for point in places(mesh).tolist():
            file.write("v {!r} {!r} {!r}\n".format(*point))
        corners = read(mesh.loops, "vertex_index", np.int32).tolist()
        at = 0
        for size in read(mesh.polygons, "loop_total", np.int32).tolist():
            file.write("f " + " ".join(str(v + 1) for v in corners[at : at + size]) + "\n")
            at += size


def read_ply(path):
    """(vertices float64 (n, 3), quads (m, 4)) of the command line's binary PLY."""
    with open(path, "rb") as file:
        data = file.read()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    vertices = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    faces = next(int(line.split()[2]) for line in lines if line.startswith("element face"))
    assert "property double x" in head.decode(), head
    points = np.frombuffer(body[: 24 * vertices], "<f8").reshape(-1, 3)
    size = struct.unpack_from("<B", body, 24 * vertices)[0]
    assert size == 4
    rows = np.frombuffer(body[24 * vertices : 24 * vertices + 17 * faces], np.dtype([("n", "u1"), ("v", "<i4", 4)]))
    return points, rows["v"]


def children():
    """Processes whose parent is this one: those that live, by their command lines."""
    found = {}
    for entry in os.listdir("/proc"):
        if not entry.isdigit():
            continue
        try:
            with open(f"/proc/{entry}/stat") as file:
                fields = file.read().rsplit(")", 1)[1].split()
            if int(fields[1]) == os.getpid():
                with open(f"/proc/{entry}/cmdline") as file:
                    found[int(entry)] = (fields[0], file.read().replace("\0", " "))
        except OSError:
            pass
    return found


def give_back():
    """What the process has freed goes back to the system now, if its allocator can be told so: Debian's Blender has jemalloc. Whether it can."""
    call = getattr(ctypes.CDLL(None), "mallctl", None)
    names = [b"thread.tcache.flush", b"arena.4096.purge"]  # of all arenas
    return call is not None and all(call(name, None, None, None, ctypes.c_size_t(0)) == 0 for name in names)


def resident(process="self"):
    """Bytes."""
    with open(f"/proc/{process}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def files_below(*folders):
    return sorted(os.path.join(folder, name) for top in folders for folder, _, names in os.walk(top) for name in names if not name.endswith(".pyc"))


def wait_until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    return condition()
