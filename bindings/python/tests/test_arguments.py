"""Bad input: an exception that names the argument, and nothing worse."""
import os
import pathlib
import signal
import threading
import time

import numpy as np
import pytest
import quadwright

POINTS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]


class Liar:
    """Says that it has a buffer, which it has not."""

    def __init__(self, **interface):
        self.__array_interface__ = {"version": 3, "typestr": "<f8", **interface}


class Raises:
    def __array__(self, *_, **__):
        raise RuntimeError("no array today")


@pytest.mark.parametrize("vertices, error, name", [
    ([[0, 0]], ValueError, "vertices"), ([0, 0, 0], ValueError, "vertices"), ("abc", TypeError, "vertices"), ([], ValueError, "vertices"),
    ([[0, 0, 0], [0, 0]], TypeError, "vertices"), ([[0, 0, float("nan")]] * 4, ValueError, "vertices: nan at row 0, column 2"),
    ([[0, 0, float("inf")]] * 4, ValueError, "vertices"), (np.zeros((4, 3), complex), TypeError, "vertices"),
    (np.zeros((4, 3), bool), TypeError, "vertices"), (np.full((4, 3), None), TypeError, "vertices"), ({"a": 1}, TypeError, "vertices"),
    (Raises(), TypeError, "vertices"), (Liar(shape=(4, 3)), TypeError, "vertices"), (Liar(shape=(4, 3), data=b"short"), TypeError, "vertices"),
])
def test_vertices(vertices, error, name):
    with pytest.raises(error, match=f"^{name}"):
        quadwright.remesh(vertices, FACES)


@pytest.mark.parametrize("faces, error", [
    ([[0, 1, -1]], IndexError), ([[0, 1, 4]], IndexError), ([[0, 1, 2**40]], IndexError), ([[0, 1, 2**32]], IndexError),
    (np.array([[0, 1, 2**63]], np.uint64), IndexError), ([[0.0, 1.0, 2.0]], TypeError), ([[0, 1]], ValueError), ([0, 1, 2], ValueError),
    ([[0, 1, 2, 3, 0]], ValueError), (np.zeros((2, 3, 3), int), ValueError), (Raises(), TypeError), ("faces", TypeError),
    (np.zeros((1, 3), bool), TypeError),
])
def test_faces(faces, error):
    with pytest.raises(error, match="^faces"):
        quadwright.remesh(POINTS, faces)


class Named:
    """An object with these attributes."""

    def __init__(self, **attributes):
        self.__dict__.update(attributes)


@pytest.mark.parametrize("mesh, says", [
    ("bunny.obj", "load"), (pathlib.Path("bunny.obj"), "load"), (b"bunny.obj", "load"), (Named(vertices=[], triangles=[]), "Open3D.*np.asarray"),
    (Named(vertex={}, triangle={}), "Open3D.*positions"), (Named(points=[], faces=[], extract_surface=None), r"mesh\.triangulate\(\).*regular_faces"),
    (Named(points=[], cells=np.zeros(4, int), extract_surface=None), r"extract_surface\(\)"), (Named(to_mesh=None, status=None), "to_mesh.*tri_verts"),
    (Named(vert_properties=[], tri_verts=[]), "tri_verts"), (Named(vertices=[], polygons=[]), "Blender"),
])
def test_meshes_of_others_get_a_hint(mesh, says):
    for call in (quadwright.remesh, quadwright.Remesher, quadwright.measure):
        with pytest.raises(TypeError, match=f"^vertices: .*{says}"):
            call(mesh)


def test_no_faces():
    with pytest.raises(quadwright.NoFacesError) as info:
        quadwright.remesh(POINTS, np.zeros((0, 3), int))
    assert info.value.status == "NO_FACES" and isinstance(info.value, ValueError)
    with pytest.raises(quadwright.OnlyDegenerateError):
        quadwright.remesh(np.zeros((4, 3)), FACES)
    with pytest.raises(TypeError, match="^faces: missing; points alone become a surface with wrap=True"):
        quadwright.remesh(POINTS)


@pytest.mark.parametrize("sizes, error", [([3, 3], ValueError), ([3, 3, 3, 2], ValueError), ([3.0] * 4, TypeError), ([[3] * 4], TypeError),
                                          ([2**31] * 4, ValueError), ([-3, 5, 5, 5], ValueError)])
def test_sizes(sizes, error):
    with pytest.raises(error, match="^face_sizes"):
        quadwright.remesh(POINTS, np.array(FACES).reshape(-1), face_sizes=sizes)


@pytest.mark.parametrize("marks, error", [([[0, 9]], IndexError), ([[0, -1]], IndexError), ([0, 1], ValueError), ([[0.5, 1]], TypeError)])
def test_marks(marks, error):
    with pytest.raises(error, match="^marked_edges"):
        quadwright.remesh(POINTS, FACES, marked_edges=marks)


@pytest.mark.parametrize("options, error, says", [
    ({"faces": -1}, quadwright.OptionError, "^faces: must be a whole number from 0"),
    ({"vertices": -1}, quadwright.OptionError, "^vertices: must be"), ({"edge_length": 1e-9}, quadwright.OptionError, "^edge_length: 1e-09"), ({"faces": 2.5}, TypeError, "faces"),
    ({"faces": True}, TypeError, "faces"), ({"faces": [[0, 1, 2]]}, TypeError, "faces: the number of quads"), ({"adaptiv": 1}, TypeError, "did you mean adaptive"), ({"preset": "cat"}, ValueError, "preset: must be scan, character"), ({"memory_limit": "4 cows"}, ValueError, "memory_limit: a memory limit is"), ({"adaptive": 2}, quadwright.OptionError, "^adaptive: must"),
    ({"wrap": "0.5 q"}, quadwright.OptionError, "^wrap: must be on, off"), ({"wrap": 0.7}, quadwright.OptionError, "wrap_distance"), ({"wrap": [1]}, TypeError, "^wrap"),
    ({"adaptive": float("nan")}, quadwright.OptionError, "adaptive"), ({"adaptive": "much"}, TypeError, "adaptive"), ({"sat": "on"}, TypeError, "sat"),
    ({"flow": "none"}, quadwright.OptionError, "^flow: must"), ({"flow": 3}, TypeError, "flow"), ({"nonsense": 1}, TypeError, "nonsense"),
    ({"faces": 10, "ratio": 0.5}, quadwright.OptionError, "only one of faces, vertices, edge_length and ratio"), ({"progress": 3}, TypeError, "progress"),
    ({"memory_limit": "1 GB"}, ValueError, "memory_limit"), ({"memory_limit": -1}, ValueError, "memory_limit"), ({"flow": "ilp"}, quadwright.UnsupportedError, ""),
])
def test_options(surface, options, error, says):
    with pytest.raises(error, match=says):
        quadwright.remesh(*surface, **options)


@pytest.mark.parametrize("name", ["target_faces", "n_faces", "quads"])
def test_words_of_others_get_a_hint(surface, name):
    with pytest.raises(TypeError, match=f"no option '{name}'; did you mean faces"):
        quadwright.remesh(*surface, **{name: 100})
    for count in (500, 5e2, np.int64(500)):
        with pytest.raises(TypeError, match="^faces: the number of quads wanted is given by name, faces=500"):
            quadwright.remesh(surface, count)


def test_options_without_effect_are_said(surface):
    report = quadwright.remesh(*surface, faces=100, texture=512, wrap_quads=2).report
    assert report["warnings"] == ["option wrap_quads has no effect without wrap", "option texture has no effect without unwrap or bake"]
    assert report["warning_count"] == 2
    assert quadwright.remesh(*surface, faces=100, texture=64, unwrap=True, adaptive=0).report["warnings"] == []


def test_whole_numbers_may_be_floats(surface):
    assert np.array_equal(quadwright.remesh(*surface, faces=2e2).vertices, quadwright.remesh(*surface, faces=200).vertices)


def test_faces_with_their_sizes_before_them(surface):
    points, faces = surface
    padded = np.column_stack([np.full(len(faces), 3), faces])
    quads = np.column_stack([np.full(len(faces), 4), faces, faces[:, :1]])
    for wrong, row in ((padded, 4), (padded.reshape(-1), 4), (quads, 5), (quads.reshape(-1), 5)):
        with pytest.raises(ValueError, match=rf"^faces: .*as PyVista has them: give faces.reshape\(-1, {row}\)\[:, 1:\]"):
            quadwright.remesh(points, wrong)
    fan = np.array([[3, 0, 1, 2], [3, 2, 4, 5], [3, 5, 6, 0]])  # about vertex 3, which a cube has
    corners = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]], float)
    assert quadwright.measure(corners, fan)["quads"] == 3


def test_time_limit(surface, large):
    began = time.monotonic()
    with pytest.raises(quadwright.TimeLimitError, match="^time_limit: 0.3 s are over") as info:
        quadwright.remesh(*large, faces=20000, time_limit=0.3, threads=1)
    assert isinstance(info.value, (quadwright.Cancelled, TimeoutError)) and info.value.status == "TIME_LIMIT"
    assert time.monotonic() - began < 30
    quadwright.remesh(*surface, faces=100, time_limit=1000)
    for wrong in (0, -1, "60", True, float("nan")):
        with pytest.raises(ValueError, match="^time_limit: must be"):
            quadwright.remesh(*surface, faces=100, time_limit=wrong)


def test_names_are_those_that_are_meant(surface):
    import pydoc

    assert [name for name in dir(quadwright) if not name.startswith("__")] == sorted(quadwright.__all__)
    text = pydoc.render_doc(quadwright.remesh)
    for row in quadwright.options().values():
        assert row["choices"] is None or ", ".join(row["choices"]) in text


def test_memory_limit(surface):
    with pytest.raises(quadwright.OutOfMemoryError) as info:
        quadwright.remesh(*surface, memory_limit=100000)
    assert isinstance(info.value, MemoryError)


def test_table_is_the_signature():
    import inspect

    names = inspect.signature(quadwright.remesh).parameters
    for name, row in quadwright.options().items():
        assert names[name].default == row["default"] and name in quadwright.remesh.__doc__
    stub = pathlib.Path(quadwright.__file__).with_name("__init__.pyi").read_text()
    assert all(f" {name}: " in stub for name in quadwright.options()) and "hausdorff_p999: float | None" in stub
    assert pathlib.Path(quadwright.__file__).with_name("py.typed").exists()


# ---- hooks


def test_old_names_still_work_with_a_notice(surface):
    new = quadwright.remesh(*surface, faces=200)
    with pytest.warns(DeprecationWarning, match="faces_wanted is now called faces") as caught:
        old = quadwright.remesh(*surface, faces_wanted=200)
    assert caught[0].filename == __file__
    assert np.array_equal(old.vertices, new.vertices)
    with pytest.warns(DeprecationWarning, match="return quadwright.CANCEL"), pytest.raises(quadwright.Cancelled):
        quadwright.remesh(*surface, faces=200, progress=lambda *_: False)
    quadwright.remesh(*surface, faces=200, progress=lambda *_: True)  # and anything else goes on


def test_presets(surface):
    settings = quadwright.presets()["cad"]["options"]
    assert settings["sharp_angle"] == "30" and len(quadwright.presets()) >= 5
    plain = quadwright.remesh(*surface, faces=200, sharp_angle=30.0, adaptive=0.0, loops=1.0, evenness=0.75, around=int(settings["around"]))
    assert np.array_equal(quadwright.remesh(*surface, faces=200, preset="cad", evenness=0.75).vertices, plain.vertices)
    quadwright.remesh(*surface, faces=100, memory_limit="1.5G")


def test_progress(surface):
    calls = []
    thread = threading.get_ident()
    quadwright.remesh(*surface, progress=lambda stage, fraction: calls.append((stage, fraction, threading.get_ident() == thread)))
    fractions = [c[1] for c in calls]
    assert fractions == sorted(fractions) and fractions[-1] == 1 and all(c[2] for c in calls)
    with pytest.raises(quadwright.Cancelled):
        quadwright.remesh(*surface, progress=lambda *_: quadwright.CANCEL)


def test_exceptions_of_hooks_pass(surface):
    class Own(Exception):
        pass

    def fail(stage, fraction):
        raise Own(stage)

    remesher = quadwright.Remesher(*surface)
    with pytest.raises(Own):
        remesher.remesh(progress=fail)
    assert len(remesher.remesh(faces=200).quads)


def test_bar(surface, capfd):
    quadwright.remesh(*surface, faces=100, progress=True)
    assert "100" in capfd.readouterr().err


@pytest.mark.parametrize("after", [0.1, 0.5])
def test_interrupt(large, after):
    def later():
        time.sleep(after)
        sent.append(time.process_time())
        os.kill(os.getpid(), signal.SIGINT)

    sent = []
    had = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    thread = threading.Thread(target=later)
    thread.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            quadwright.remesh(*large, faces=20000, threads=1)
    finally:
        signal.signal(signal.SIGINT, had)
    late = time.process_time() - sent[0]  # of processors, as others may have them meanwhile
    thread.join()
    assert late < 0.3 if not os.environ.get("QUADWRIGHT_BUSY") else late < 3


def test_the_lock_is_released(large):
    ticks = []
    done = threading.Event()

    def tick():
        while not done.wait(0.005):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    thread.start()
    quadwright.remesh(*large, faces=2000, threads=1)
    done.set(), thread.join()
    assert len(ticks) > 20
