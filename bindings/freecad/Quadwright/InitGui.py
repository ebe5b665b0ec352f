"""The workbench, as FreeCAD reads it at its start: this file is executed, not imported, so that the rest is in a package beside it."""
import FreeCADGui


class QuadwrightWorkbench(FreeCADGui.Workbench):
    import quadwright_freecad

    MenuText = "Quadwright"
    ToolTip = "Meshes and shapes become quads, and smooth patches of these"
    Icon = quadwright_freecad.ICON

    def Initialize(self):
        from quadwright_freecad import panel

        names = panel.add_commands()
        self.appendToolbar("Quadwright", names)
        self.appendMenu("Quadwright", names)

    def GetClassName(self):
        return "Gui::PythonWorkbench"


FreeCADGui.addWorkbench(QuadwrightWorkbench())
