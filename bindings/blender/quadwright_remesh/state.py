# SPDX-License-Identifier: GPL-3.0-or-later
"""What outlives a run: the worker, the surfaces of the last run, its reports. Forgotten when another file is loaded."""
import bpy

from . import child as _child

child = None  # the worker, a child.Child, or None
running = None  # the job at work, or None
sources = {}  # mesh name: (Snapshot, fingerprint of its quads), of the last run
reports = {}  # mesh name: (fingerprint, [(icon, sentence)], (vertices, faces))
message = ""  # what the last run said in the status bar
irregular = None  # cache of the overlay


def stop_child():
    global child
    if child is not None:
        child.kill()
    child = None


def adopt(started):
    global child
    stop_child()  # one that ended by itself
    child = started


def live_child():
    """The worker, where it is alive."""
    return child if child is not None and child.is_alive else None


def forget():
    global irregular, message
    sources.clear()
    reports.clear()
    irregular, message = None, ""


@bpy.app.handlers.persistent
def _loaded(_):
    if running is None:
        forget()


def register():
    bpy.app.handlers.load_post.append(_loaded)


def unregister():
    if _loaded in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_loaded)
    stop_child()
    forget()


NoWorker = _child.NoWorker
