"""The command and its task panel. The run is on a thread of its own, which touches nothing of FreeCAD; a timer shows how far it is and takes what it has made."""
import threading

import FreeCAD
import FreeCADGui
import quadwright
from PySide import QtCore, QtGui

import quadwright_freecad as core

FIRST = ("faces", "preset", "symmetry", "adaptive", "follow", "loops", "sharp_angle")  # the rest of the table is folded
HIDDEN = {"vertices", "edge_length", "ratio", "symmetry_x", "symmetry_y", "symmetry_z", "symmetry_offset", "fix_boundary", "region_rim", "keep_marks", "sharp_marks"}
MOST = 2**31 - 1
PREFERENCES = "User parameter:BaseApp/Preferences/Mod/Quadwright"


def title(name):
    return name.replace("_", " ").capitalize()


def narrow(widget):
    """Fields take the width that the panel has, not what their longest value would."""
    widget.setSizePolicy(QtGui.QSizePolicy.Ignored, QtGui.QSizePolicy.Fixed)
    widget.setMinimumWidth(60)
    return widget


class Field:
    """A widget for an option."""

    def __init__(self, name, row):
        self.kind, self.row = row["kind"], row
        if self.kind == "flag":
            self.widget = QtGui.QCheckBox()
            self.widget.setChecked(row["default"])
        elif self.kind == "choice":
            self.widget = QtGui.QComboBox()
            self.widget.addItems([choice for choice in row["choices"] if choice != "plane"])
            self.widget.setCurrentText(row["default"])
        elif self.kind == "count":
            self.widget = QtGui.QSpinBox()
            self.widget.setRange(int(row["least"]), int(min(row["most"], MOST)))
            self.widget.setValue(row["default"] or 0)
            self.widget.setGroupSeparatorShown(True)
        else:
            self.widget = QtGui.QDoubleSpinBox()
            self.widget.setDecimals(3)
            self.widget.setSingleStep(0.05)
            self.widget.setRange(max(row["least"], -1e9), min(row["most"], 1e9))
            self.widget.setValue(row["default"] or 0.0)
        unit = f" ({row['unit']})" if row["unit"] not in ("", "-") else ""
        self.widget.setToolTip(f"{row['help'][0].upper()}{row['help'][1:]}{unit}")
        self.initial = self.value()
        narrow(self.widget)

    def value(self):
        if self.kind == "flag":
            return self.widget.isChecked()
        return self.widget.currentText() if self.kind == "choice" else self.widget.value()

    def set(self, value):
        if self.kind == "flag":
            self.widget.setChecked(value)
        elif self.kind == "choice":
            self.widget.setCurrentText(value)
        else:
            self.widget.setValue(int(value) if self.kind == "count" else float(value))


class Choice(QtGui.QComboBox):
    def __init__(self, rows, chosen):
        super().__init__()
        for name, words in rows.items():
            self.addItem(words, name)
        self.setCurrentIndex(max(0, self.findData(chosen)))
        narrow(self)

    def chosen(self):
        return self.itemData(self.currentIndex())


class Panel:
    """What FreeCAD's task view shows: `form`, with its own buttons OK and Cancel."""

    def __init__(self, objects):
        self.objects, self.document = objects, objects[0].Document
        self.kept = FreeCAD.ParamGet(PREFERENCES)
        self.form = QtGui.QWidget()
        self.form.setWindowTitle("Remesh to Quads")
        self.form.setWindowIcon(QtGui.QIcon(core.ICON))
        self.table, self.fields = quadwright.options(), {}
        layout, top = QtGui.QVBoxLayout(self.form), QtGui.QFormLayout()
        words = QtGui.QLabel(", ".join(obj.Label for obj in objects))
        words.setWordWrap(True)
        top.addRow("Of", words)
        is_shape = not hasattr(objects[0], "Mesh")
        presets = {"none": "None", **{name: "CAD" if name == "cad" else title(name) for name in quadwright.presets()}}
        self.preset = Choice(presets, "none")
        for i, row in enumerate(quadwright.presets().values()):
            self.preset.setItemData(i + 1, row["help"], QtCore.Qt.ToolTipRole)
        for name in FIRST:
            top.addRow("Preset" if name == "preset" else title(name), self.preset if name == "preset" else self.field(name))
        self.fields["faces"].widget.setSpecialValueText("Automatic")
        self.fields["faces"].widget.setValue(self.kept.GetInt("Faces", 0))
        self.mesh, self.patches = Choice(core.MESHES, self.kept.GetString("Mesh", "fem")), Choice(core.PATCHES, self.kept.GetString("Patches", "none"))
        top.addRow("Quads", self.mesh)
        top.addRow("Patches", self.patches)
        layout.addLayout(top)
        layout.addWidget(self.rest())
        self.bar, self.told = QtGui.QProgressBar(), QtGui.QLabel("")
        self.bar.hide()
        self.told.setWordWrap(True)
        layout.addWidget(self.bar)
        layout.addWidget(self.told)
        self.preset.currentIndexChanged.connect(lambda _: self.take_preset())
        if is_shape:
            self.preset.setCurrentIndex(self.preset.findData("cad"))
        self.run, self.timer = None, QtCore.QTimer(self.form)
        self.timer.setInterval(50)
        self.timer.timeout.connect(self.look)

    def field(self, name):
        self.fields[name] = Field(name, self.table[name])
        return self.fields[name].widget

    def rest(self):
        """The other options of a run, folded away."""
        box = QtGui.QGroupBox("More options")
        box.setCheckable(True)
        box.setChecked(False)
        inner, form = QtGui.QWidget(), QtGui.QFormLayout()
        inner.setLayout(form)
        of_maps = list(self.table)[list(self.table).index("texture") :]
        for name in self.table:
            if name not in FIRST and name not in HIDDEN and name not in of_maps:
                form.addRow(title(name), self.field(name))
        inner.setVisible(False)
        box.toggled.connect(inner.setVisible)
        outer = QtGui.QVBoxLayout(box)
        outer.addWidget(inner)
        return box

    def take_preset(self):
        """Sets what the preset names; what another one may have set goes back to its default. What is changed afterwards wins."""
        presets = quadwright.presets()
        own = presets.get(self.preset.chosen(), {"options": {}})["options"]
        for name in {name for row in presets.values() for name in row["options"]}:
            field = self.fields[name]
            field.set(field.initial if name not in own else own[name] != "off" if field.kind == "flag" else own[name])

    def options(self):
        return {name: field.value() for name, field in self.fields.items() if field.value() != field.initial}

    # ---- what FreeCAD calls

    def getStandardButtons(self):
        return int(QtGui.QDialogButtonBox.Ok | QtGui.QDialogButtonBox.Cancel)

    def accept(self):
        """Begins; the panel closes when the run has ended well."""
        if self.run is not None:
            return False
        if self.mesh.chosen() == "none" and self.patches.chosen() == "none":
            self.told.setText("Neither quads nor patches are asked for.")
            return False
        self.kept.SetInt("Faces", self.fields["faces"].value())
        self.kept.SetString("Mesh", self.mesh.chosen())
        self.kept.SetString("Patches", self.patches.chosen())
        try:
            surfaces = [core.surface_of(obj) for obj in self.objects]
        except Exception as error:
            self.told.setText(str(error))
            return False
        self.run = Run(surfaces, self.patches.chosen(), self.options())
        self.bar.show()
        self.told.setText("")
        self.timer.start()
        return False

    def reject(self):
        """Cancels a run, or closes the panel."""
        if self.run is not None:
            self.run.is_cancelled = True
            return False
        FreeCADGui.Control.closeDialog()
        return True

    # ---- the run

    def look(self):
        run = self.run
        self.bar.setValue(int(100 * run.fraction))
        self.told.setText(run.stage)
        if run.is_alive():
            return
        self.timer.stop()
        self.bar.hide()
        self.run = None
        if run.error is None:
            try:
                core.in_one_step(self.document, lambda: [core.add(obj, outcome, self.mesh.chosen()) for obj, outcome in zip(self.objects, run.outcomes)])
            except Exception as error:
                run.error = error
        for outcome in run.outcomes:
            outcome.forget()
        if run.error is not None:
            self.told.setText("Cancelled." if isinstance(run.error, quadwright.Cancelled) else str(run.error))
            core.show(self.told.text(), True)
            return
        for obj, outcome in zip(self.objects, run.outcomes):
            sentence, warnings = core.said(outcome.result)
            core.show(f"{obj.Label}: {sentence}")
            for warning in warnings:
                core.show(f"{obj.Label}: {warning}", True)
            obj.ViewObject.Visibility = False
        FreeCADGui.Control.closeDialog()


class Run(threading.Thread):
    """Objects one after another. `outcomes`, or `error`."""

    def __init__(self, surfaces, patches, options):
        super().__init__(daemon=True)
        self.surfaces, self.patches, self.given = surfaces, patches, options
        self.outcomes, self.error, self.is_cancelled, self.stage, self.fraction = [], None, False, "", 0.0
        self.start()

    def run(self):
        try:
            for surface in self.surfaces:
                self.outcomes.append(core.make(surface, self.patches, progress=self.progress, **self.given))
        except Exception as error:
            self.error = error

    def progress(self, stage, fraction):
        self.stage, self.fraction = stage, (len(self.outcomes) + fraction) / len(self.surfaces)
        return quadwright.CANCEL if self.is_cancelled else None


class Remesh:
    """The command, of what is selected."""

    def GetResources(self):
        return {"Pixmap": core.ICON, "MenuText": "Remesh to Quads", "ToolTip": "Makes quads, or smooth patches of quads, of the meshes and shapes that are selected"}

    def chosen(self):
        return [obj for obj in FreeCADGui.Selection.getSelection() if core.is_surface(obj)]

    def IsActive(self):
        return FreeCAD.ActiveDocument is not None and bool(self.chosen()) and not FreeCADGui.Control.activeDialog()

    def Activated(self):
        FreeCADGui.Control.showDialog(Panel(self.chosen()))


def add_commands():
    FreeCADGui.addCommand("Quadwright_Remesh", Remesh())
    return ["Quadwright_Remesh"]
