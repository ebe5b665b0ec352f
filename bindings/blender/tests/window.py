"""The add-on in a real window, under Xvfb: the button by a click, Esc by a key of the X server, undo and redo, the slider that feels live, a crash,
and the pictures of docs/blender.md. Steps are generators that a timer goes on with, so that the interface is alive between them.

    blender --factory-startup -p 0 0 1280 960 -P window.py -- PICTURES
"""
import faulthandler
import json
import os
import signal
import subprocess
import sys
import time
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bmesh
import bpy

import character
import common
from common import fresh, module, places, quads, read, state_of, suzanne

PICTURES = sys.argv[sys.argv.index("--") + 1]
HEIGHT = 960
HANG_S = 600
figures = {}


def prepare():
    """What makes a window drawn by the processor bearable; the interface is otherwise as it comes."""
    preferences = bpy.context.preferences
    preferences.view.show_splash = False
    preferences.view.use_save_prompt = False
    preferences.view.smooth_view = 0
    preferences.system.viewport_aa = "OFF"
    preferences.system.use_region_overlap = False
    preferences.edit.undo_steps = 64
    preferences.themes[0].view_3d.space.gradients.background_type = "SINGLE_COLOR"  # pictures of half the size


def window():
    return bpy.context.window_manager.windows[0]


def view():
    return next(area for area in window().screen.areas if area.type == "VIEW_3D")


def region(kind):
    return next(r for r in view().regions if r.type == kind)


def here():
    return bpy.context.temp_override(window=window(), area=view(), region=region("WINDOW"))


def x11(*words):
    return subprocess.run(["xdotool", *map(str, words)], check=True, capture_output=True, text=True).stdout.split()


def click(x, y):
    """In pixels of the window, from its upper left corner."""
    x11("mousemove", x, y, "click", 1)


def escape():
    x11("windowfocus", x11("search", "--name", "Blender")[-1], "mousemove", 500, 400)
    begun = time.monotonic()
    x11("key", "Escape")
    return begun


def cancel_button():
    begun = time.monotonic()
    bpy.ops.object.quadwright_cancel()
    return begun


def press():
    """The button."""
    with here():
        return bpy.ops.object.quadwright_remesh("INVOKE_DEFAULT")


def save(name):
    with here():
        bpy.ops.screen.screenshot(filepath=os.path.join(PICTURES, name + ".png"))


def push(message):
    with here():
        bpy.ops.ed.undo_push(message=message)


def running():
    return module("state").running


def until(condition, what):
    """Waits with the interface alive, however long that takes on a machine that others use too; a hang ends."""
    end = time.monotonic() + HANG_S
    while not condition():
        assert time.monotonic() < end, f"{what} took more than {HANG_S} s"
        yield 0.01


def frame(obj, yaw=0.5, distance=None):
    from mathutils import Euler, Vector

    space = view().spaces[0]
    corners = [obj.matrix_world @ Vector(c) for c in obj.bound_box]
    space.region_3d.view_location = sum(corners, Vector()) / 8
    space.region_3d.view_rotation = Euler((1.35, 0, yaw)).to_quaternion()
    space.region_3d.view_distance = distance or 1.15 * max((a - b).length for a in corners for b in corners)
    space.region_3d.view_perspective = "PERSP"


def wires(are_on):
    overlay = view().spaces[0].overlay
    overlay.show_wireframes, overlay.wireframe_threshold = are_on, 1.0
    overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = overlay.show_cursor = False
    overlay.show_outline_selected = overlay.show_object_origins = False
    bpy.context.preferences.themes[0].view_3d.wire = (0.05, 0.05, 0.05)


def test_button_undo_redo():
    settings = fresh()
    obj, rig = character.make()
    rig.hide_set(True)
    settings.target, settings.faces, settings.symmetry = "FACES", 4000, "OFF"
    view().spaces[0].shading.color_type = "MATERIAL"
    frame(obj)
    wires(True)
    obj.select_set(False)  # it stays the active object; wires of selected ones are orange
    push("character")
    before = state_of(obj)
    yield 0.6
    save("before")
    ui = region("UI")
    click(ui.x + ui.width // 2, HEIGHT - (ui.y + ui.height) + 46)  # the button itself
    yield from until(lambda: running() is not None, "the click")
    yield from until(lambda: running().fraction > 0.2, "the first fifth")
    assert state_of(obj) == before, "the mesh changed before the end"
    save("progress")
    yield from until(lambda: running() is None, "the run")
    wires(True)
    assert abs(len(quads(obj.data)) / 4000 - 1) < 0.06
    settings.show_irregular = True
    yield 0.6
    save("quads")
    made = state_of(obj)
    view().spaces[0].shading.color_type = "VERTEX"
    wires(False)
    settings.show_irregular = False
    yield 0.5
    save("colors")
    view().spaces[0].shading.color_type = "MATERIAL"
    with here():
        bpy.ops.ed.undo()
    yield 0.3
    obj = bpy.data.objects["Character"]
    assert state_of(obj) == before, "one undo does not bring the character back"
    assert all(row[0] for row in character.kept(obj).values())
    with here():
        bpy.ops.ed.redo()
    yield 0.3
    assert state_of(bpy.data.objects["Character"]) == made, "redo"


def test_panel():
    """The fold-out and the steering, for the page."""
    settings = fresh()
    obj = suzanne(2)
    obj.vertex_groups.new(name="Dense")
    settings.density, settings.sharp, settings.guides = "GROUP", "ANGLE", "CURVE"
    settings.density_group = "Dense"
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.8)
    settings.guide_curve = bpy.context.object
    bpy.context.object.select_set(False)
    bpy.context.view_layer.objects.active = obj
    frame(obj)
    yield 0.5
    save("panel")
    settings = fresh()


def test_escape():
    """Esc, and once the panel's cancel button, during a long run: the operator is gone before its run is done, the worker's work too, and the scene is as before. How soon: docs/dev/results/blender.md."""
    fresh()
    obj = common.bumpy_sphere(900, 450)
    obj.display_type = "BOUNDS"  # drawn by the processor, 800,000 triangles would be what takes the time
    push("dense")
    before = state_of(obj)
    yield 0.5
    times, gaps = [], []
    for share in (0.02, 0.1, 0.2, 0.3, 0.4):
        press()
        last = time.monotonic()
        while running().fraction < share:
            assert running() is not None, "the run was too short"
            yield 0.01
            gaps.append(time.monotonic() - last)
            last = time.monotonic()
        begun = escape() if share < 0.4 else cancel_button()
        yield from until(lambda: running() is None, "Esc")
        times.append(time.monotonic() - begun)
        worker = module("state").child
        yield from until(lambda: not worker.is_alive or worker.kill_at is None, "the worker's end")
        assert state_of(obj) == before, "the scene changed"
        assert module("state").message == "Cancelled; nothing was changed"
    figures["esc_s"] = times
    figures["longest_pause_s"] = max(gaps[3:])
    print(
        f"    Esc: {', '.join(f'{t:.2f}' for t in times)} s; longest pause of the interface {max(gaps[3:]):.2f} s; load of the machine {os.getloadavg()[0]:.0f}"
    )
    obj.display_type = "TEXTURED"


def test_live():
    """A slider moves: the same surface again, of 100,000 triangles, and of what it was made of, not of the quads."""
    settings = fresh()
    obj = common.bumpy_sphere(320, 158)
    settings.target, settings.faces = "FACES", 3000
    push("sphere")
    obj.data.calc_loop_triangles()
    figures["live_triangles"] = len(obj.data.loop_triangles)
    yield 0.3
    begun = time.monotonic()
    press()
    yield from until(lambda: running() is None, "the first run")
    figures["first_s"] = time.monotonic() - begun
    settings.is_live = True
    figures["live_s"] = []
    for faces in (2500, 3500, 5000):
        begun = time.monotonic()
        with here():
            settings.faces = faces
        yield from until(lambda: abs(len(bpy.data.objects["Ball"].data.polygons) / faces - 1) < 0.06, f"{faces} faces")
        yield from until(lambda: running() is None, "the end")
        figures["live_s"].append(time.monotonic() - begun)
    for faces in range(2000, 3000, 100):  # a slider that moves on: runs give way to later ones
        with here():
            settings.faces = faces
        yield 0.06
    yield from until(lambda: abs(len(bpy.data.objects["Ball"].data.polygons) / 2900 - 1) < 0.06 and running() is None, "the last of them")
    assert module("state").message.startswith("draft: ") or not module("live").is_waiting()
    yield from until(lambda: running() is None and not module("live").is_waiting(), "the full run after the draft")
    assert not module("state").message.startswith("draft: ")
    settings.is_live = False
    assert len(module("state").sources) == 1


def test_crash():
    fresh()
    obj = suzanne(4)
    push("suzanne")
    before = state_of(obj)
    yield 0.3
    press()
    yield from until(lambda: running().fraction > 0.05, "the start")
    os.kill(module("state").child.process.pid, signal.SIGSEGV)
    yield from until(lambda: running() is None, "the end")
    assert "ended by itself (signal 11" in module("state").message, module("state").message
    assert state_of(obj) == before
    yield 0.3
    save("crash")


def test_edit_mode_undo():
    fresh()
    obj = suzanne(0)
    with here():
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.subdivide(number_cuts=2)
    push("edited")
    yield 0.3
    obj.update_from_editmode()
    count = len(obj.data.polygons)
    press()
    yield from until(lambda: running() is None, "the run")
    assert obj.mode == "EDIT", obj.mode
    obj.update_from_editmode()
    assert len(obj.data.polygons) != count
    with here():
        bpy.ops.ed.undo()
    yield 0.3
    obj = bpy.data.objects["Suzanne"]
    with here():
        if obj.mode == "EDIT":
            bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.polygons) == count, (len(obj.data.polygons), count)


def test_selected_faces_undo():
    """One step, back to the faces as they were and as they were selected."""
    fresh()
    obj = common.bumpy_sphere(48, 25)
    with here():
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="DESELECT")
        bpy.context.tool_settings.mesh_select_mode = (False, False, True)
        mesh = bmesh.from_edit_mesh(obj.data)
        for face in mesh.faces:
            face.select_set(face.calc_center_median().z > 0)
        bmesh.update_edit_mesh(obj.data)
    push("selected")
    yield 0.3
    obj.update_from_editmode()
    before, chosen = state_of(obj), read(obj.data.polygons, "select", bool)
    press()
    yield from until(lambda: running() is None, "the run")
    assert obj.mode == "EDIT", obj.mode
    obj.update_from_editmode()
    selected = read(obj.data.polygons, "select", bool)
    assert 0 < selected.sum() < chosen.sum() and (~selected).sum() == (~chosen).sum(), (selected.sum(), chosen.sum())
    with here():
        bpy.ops.ed.undo()
    yield 0.3
    obj = bpy.data.objects["Ball"]
    obj.update_from_editmode()
    assert state_of(obj) == before, "one undo does not bring the faces back"
    assert (read(obj.data.polygons, "select", bool) == chosen).all()
    with here():
        bpy.ops.object.mode_set(mode="OBJECT")


def test_paint_and_sculpt_modes():
    for mode in ("WEIGHT_PAINT", "VERTEX_PAINT", "SCULPT"):
        fresh()
        obj = suzanne(1, True)
        with here():
            bpy.ops.object.mode_set(mode=mode)
        yield 0.3
        press()
        yield from until(lambda: running() is None, "the run")
        assert obj.mode == mode, obj.mode
        assert len(quads(obj.data)) != 1968
        yield 0.3
        with here():
            bpy.ops.object.mode_set(mode="OBJECT")


def test_changed_meanwhile():
    """What changed while its quads were made is left alone, and that is no success."""
    fresh()
    obj = suzanne(4)
    yield 0.2
    press()
    yield from until(lambda: running().fraction > 0.02, "the start")
    obj.data.vertices[0].co.x += 1
    yield from until(lambda: running() is None, "the run")
    assert "changed while its quads were made" in module("state").message, module("state").message
    assert len(obj.data.polygons) == 500


TESTS = [test_button_undo_redo, test_panel, test_escape, test_live, test_crash, test_edit_mode_undo, test_selected_faces_undo, test_paint_and_sculpt_modes, test_changed_meanwhile]


def open_sidebar():
    view().spaces[0].show_region_ui = True
    yield 0.5
    ui = region("UI")
    x11("windowfocus", x11("search", "--name", "Blender")[-1])
    # The tabs stand at the right of the sidebar, from above: Item, Tool, View, Quads.
    click(ui.x + ui.width - 8, HEIGHT - (ui.y + ui.height) + 190)
    yield 0.5
    x11("mousemove", 400, 500)
    yield 0.3


def all_steps():
    ran = failed = 0
    yield 1.0
    yield from open_sidebar()
    for test in TESTS:
        if len(sys.argv) > sys.argv.index("--") + 2 and test.__name__ not in sys.argv:
            continue
        ran += 1
        begun = time.monotonic()
        faulthandler.dump_traceback_later(120, exit=True)
        try:
            yield from test()
        except Exception:
            failed += 1
            traceback.print_exc(file=sys.stdout)
            print(f"{test.__name__} ... FAIL", flush=True)
            if running() is not None:
                running().cancel()
                yield 0.5
        else:
            print(f"{test.__name__} ... ok, {time.monotonic() - begun:.1f} s", flush=True)
        faulthandler.cancel_dump_traceback_later()
    with open(os.path.join(PICTURES, "figures.json"), "w") as file:
        json.dump(figures, file)
    print(json.dumps({"ran": ran, "failed": failed}), flush=True)
    module("state").stop_child()
    bpy.ops.wm.quit_blender()


steps = None


def go_on():
    global steps
    steps = steps or all_steps()
    try:
        return next(steps)
    except StopIteration:
        return None
    except BaseException:
        traceback.print_exc(file=sys.stdout)
        sys.stdout.flush()
        os._exit(1)


prepare()
common.install()
bpy.app.timers.register(go_on, first_interval=0.5)
