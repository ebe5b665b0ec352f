"""The workbench in a real window, under Xvfb: freecad window.py. Steps are generators that a timer goes on with, so that the interface is alive between them: each
yields what it waits for. The last line is "N passed, N failed"; pictures go to QUADWRIGHT_PICTURES."""
import os
import time
import traceback

import FreeCAD
import FreeCADGui
from PySide import QtCore, QtGui

import quadwright_freecad as core

PICTURES = os.environ["QUADWRIGHT_PICTURES"]
HANG_S = 300


def part():
    document = FreeCAD.newDocument("Window")
    block, hole = document.addObject("Part::Box", "Block"), document.addObject("Part::Cylinder", "Hole")
    block.Length, block.Width, block.Height = 40, 30, 10
    hole.Radius, hole.Height, hole.Placement.Base = 6, 40, FreeCAD.Vector(20, 15, -5)
    cut = document.addObject("Part::Cut", "Part")
    cut.Base, cut.Tool = block, hole
    document.recompute()
    return cut


def command():
    """The workbench's own button in the toolbar."""
    (bar,) = [bar for bar in FreeCADGui.getMainWindow().findChildren(QtGui.QToolBar) if bar.windowTitle() == "Quadwright"]
    return bar.actions()[0]


def panel_of(window):
    """The task panel as it stands in the window, and its buttons."""
    (form,) = [w for w in window.findChildren(QtGui.QWidget) if w.windowTitle() == "Remesh to Quads" and w.findChildren(QtGui.QProgressBar)]
    (box,) = [b for b in window.findChildren(QtGui.QDialogButtonBox) if b.isVisible()]
    return form, box.button(QtGui.QDialogButtonBox.Ok), box.button(QtGui.QDialogButtonBox.Cancel)


def widget(form, label):
    """What stands beside a label."""
    for layout in form.findChildren(QtGui.QFormLayout):
        for row in range(layout.rowCount()):
            item = layout.itemAt(row, QtGui.QFormLayout.LabelRole)
            if item and item.widget().text() == label:
                return layout.itemAt(row, QtGui.QFormLayout.FieldRole).widget()
    raise AssertionError(label)


def picture(window, name):
    QtGui.QGuiApplication.primaryScreen().grabWindow(window.winId()).save(os.path.join(PICTURES, f"{name}.png"))
    assert os.path.getsize(os.path.join(PICTURES, f"{name}.png")) > 10000


def together():
    """The panel, the quads and the patches in one picture, for docs/freecad.md."""
    sheet = QtGui.QImage(1240, 330, QtGui.QImage.Format_RGB32)
    sheet.fill(QtCore.Qt.white)
    painter = QtGui.QPainter(sheet)
    painter.setRenderHint(QtGui.QPainter.SmoothPixmapTransform)
    shown = (("panel", QtCore.QRect(0, 140, 276, 530), QtCore.QRect(0, 0, 172, 330)),
             ("quads", QtCore.QRect(400, 150, 700, 440), QtCore.QRect(180, 0, 525, 330)), ("patches", QtCore.QRect(400, 150, 700, 440), QtCore.QRect(715, 0, 525, 330)))
    for name, of, to in shown:
        painter.drawImage(to, QtGui.QImage(os.path.join(PICTURES, f"{name}.png")), of)
    painter.end()
    sheet.save(os.path.join(PICTURES, "together.png"))


def open_panel(window, obj):
    FreeCADGui.Selection.clearSelection()
    assert not command().isEnabled() or not FreeCADGui.Command.get("Quadwright_Remesh").isActive()
    FreeCADGui.Selection.addSelection(obj)
    assert FreeCADGui.Command.get("Quadwright_Remesh").isActive()
    FreeCADGui.runCommand("Quadwright_Remesh")


def a_shape_becomes_quads_and_patches(window):
    """By the button, the fields and OK; undo takes all of it back."""
    obj = part()
    FreeCADGui.activeDocument().activeView().viewIsometric()
    names = [o.Name for o in obj.Document.Objects]
    yield 1
    open_panel(window, obj)
    yield 0.5
    form, ok, _ = panel_of(window)
    assert widget(form, "Preset").currentText() == "CAD" and widget(form, "Faces").text() == "Automatic"
    assert widget(form, "Adaptive").value() == 0 and widget(form, "Loops").value() == 1  # as that preset has them
    assert "auto finds the plane" in widget(form, "Symmetry").toolTip()
    widget(form, "Faces").setValue(500)
    FreeCADGui.SendMsgToActiveView("ViewFit")
    patches = widget(form, "Patches")
    patches.setCurrentIndex(patches.findText("Large patches"))
    yield 0.5
    picture(window, "panel")
    ok.click()
    yield lambda: not FreeCADGui.Control.activeDialog()
    quads, shape = obj.Document.Objects[-2:]
    same = core.make(core.surface_of(obj), faces=500, preset="cad", fit_to="limit").result
    assert quads.FemMesh.QuadrangleCount == len(same.quads)
    assert abs(quads.FemMesh.QuadrangleCount - 500) < 60 and shape.Shape.isValid() and len(shape.Shape.Solids) == 1
    assert not obj.ViewObject.Visibility and shape.ViewObject.Visibility
    shape.ViewObject.Visibility = False
    yield 0.5
    picture(window, "quads")
    shape.ViewObject.Visibility, quads.ViewObject.Visibility = True, False
    yield 0.5
    picture(window, "patches")
    together()
    FreeCADGui.runCommand("Std_Undo")
    assert [o.Name for o in obj.Document.Objects] == names
    FreeCADGui.runCommand("Std_Redo")
    assert len(obj.Document.Objects) == len(names) + 2


def cancel_ends_a_run(window):
    obj = part()
    yield 0.5
    open_panel(window, obj)
    yield 0.5
    form, ok, cancel = panel_of(window)
    assert widget(form, "Faces").value() == 500  # as it was left
    widget(form, "Faces").setValue(400000)
    bar = form.findChild(QtGui.QProgressBar)
    ok.click()
    yield lambda: bar.value() > 0
    assert bar.isVisible() and FreeCADGui.Control.activeDialog()
    begun = time.monotonic()
    cancel.click()
    yield lambda: not bar.isVisible()
    assert time.monotonic() - begun < 10
    assert FreeCADGui.Control.activeDialog() and [label for label in form.findChildren(QtGui.QLabel) if label.text() == "Cancelled."]
    assert len(obj.Document.Objects) == 3
    cancel.click()
    yield lambda: not FreeCADGui.Control.activeDialog()


def what_is_wrong_is_said_in_the_panel(window):
    obj = part()
    yield 0.5
    open_panel(window, obj)
    yield 0.5
    form, ok, cancel = panel_of(window)
    for label in ("Quads", "Patches"):
        widget(form, label).setCurrentIndex(widget(form, label).findText("None"))
    ok.click()
    assert [label for label in form.findChildren(QtGui.QLabel) if label.text().startswith("Neither")]
    widget(form, "Quads").setCurrentIndex(1)
    more = form.findChild(QtGui.QGroupBox)
    inner = more.findChild(QtGui.QWidget)
    assert not inner.isVisible()
    more.setChecked(True)
    yield 0.2
    assert inner.isVisible()
    widget(form, "Flow").setCurrentText("ilp")  # which this build has not
    widget(form, "Faces").setValue(200)
    ok.click()
    yield lambda: not form.findChild(QtGui.QProgressBar).isVisible()
    assert [label for label in form.findChildren(QtGui.QLabel) if "ilp" in label.text().lower() or "GLPK" in label.text()]
    widget(form, "Flow").setCurrentText("closed")
    ok.click()
    yield lambda: not FreeCADGui.Control.activeDialog()
    assert obj.Document.Objects[-1].Mesh.CountFacets > 300


TESTS = [a_shape_becomes_quads_and_patches, cancel_ends_a_run, what_is_wrong_is_said_in_the_panel]


class Runner:
    def __init__(self):
        self.window, self.left, self.failed, self.now = FreeCADGui.getMainWindow(), list(TESTS), 0, None
        self.window.resize(1240, 900)
        FreeCADGui.activateWorkbench("QuadwrightWorkbench")
        assert FreeCADGui.activeWorkbench().MenuText == "Quadwright"
        self.timer = QtCore.QTimer()
        self.timer.timeout.connect(self.step)
        self.timer.start(50)

    def begin(self):
        if not self.left:
            print(f"{len(TESTS) - self.failed} passed, {self.failed} failed", flush=True)
            os._exit(self.failed > 0)
        self.test = self.left.pop(0)
        self.now, self.waits, self.since = self.test(self.window), 0, time.monotonic()

    def step(self):
        try:
            if self.now is None:
                self.begin()
            waited = time.monotonic() - self.since
            if waited > HANG_S:
                raise TimeoutError("nothing comes of it")
            if not (self.waits() if callable(self.waits) else waited >= self.waits):
                return
            self.waits, self.since = next(self.now), time.monotonic()
        except StopIteration:
            self.end("ok")
        except Exception:
            self.failed += 1
            self.end(f"FAIL\n{traceback.format_exc()}")

    def end(self, told):
        print(f"{self.test.__name__} ... {told}", flush=True)
        self.now = None
        if FreeCADGui.Control.activeDialog():
            FreeCADGui.Control.closeDialog()


try:
    runner = Runner()
except Exception:
    traceback.print_exc()
    print("0 passed, 1 failed", flush=True)
    os._exit(1)
