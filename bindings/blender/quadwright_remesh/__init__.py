# SPDX-License-Identifier: GPL-3.0-or-later
# Copyright (C) 2026 the authors of Quadwright
#
# This add-on's Python is free software under the GNU General Public License, version 3 or later. The library in wheels/ is under the MIT licence.
"""Quick Remesh to Quads: clean quads of any mesh, made in a process of its own."""
bl_info = {
    "name": "Quadwright",
    "author": "The authors of Quadwright",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Object > Quick Remesh to Quads; 3D View > Sidebar > Quads",
    "description": "Any triangle surface in, a clean all-quad mesh out",
    "doc_url": "https://github.com/quadwright/quadwright",
    "category": "Mesh",
}

from . import operators, overlay, panel, settings, state  # noqa: E402

_modules = (settings, operators, panel, overlay, state)


def register():
    for module in _modules:
        module.register()


def unregister():
    for module in reversed(_modules):
        module.unregister()
