# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that makes the quads: it alone loads the library, so that a crash there is no crash of the host.

Reads messages from standard input and answers on standard output (messages.py), after a line that says it is there. It ends when its
input ends, which is when the host does, also in the middle of a run. It writes no file.

    surface   key, arrays             keeps a surface under this key; answers only where a run asks for it
    run       key, job, options...    "progress" (stage, fraction)..., then "done" with arrays and report, or "failed" (status, message)
    cancel    job                     that run fails with status CANCELLED
    forget    key                     drops the surface

PYTHONPATH names the folders of the library, of NumPy and of this file.
"""
import os
import queue
import shutil
import sys
import threading
import traceback

import messages

READY = b"quadwright worker 1\n"


class Worker:
    def __init__(self, source, sink):
        self.source, self.sink = source, sink
        self.tasks = queue.Queue()
        self.cancelled = set()  # jobs
        self.surfaces = {}  # key: a Surface, or the exception that its making raised

    def listen(self):
        """On a thread of its own, so that "cancel" and the end of the host are seen during a run."""
        try:
            while True:
                header, arrays = messages.read(self.source)
                if header["kind"] == "cancel":
                    self.cancelled.add(header["job"])
                else:
                    self.tasks.put((header, arrays))
        except BaseException:
            os._exit(0)

    def work(self):
        while True:
            header, arrays = self.tasks.get()
            getattr(self, header["kind"])(header, arrays)

    def surface(self, header, arrays):
        import surface

        self.surfaces.pop(header["key"], None)
        try:
            self.surfaces[header["key"]] = surface.Surface(header, arrays)
        except Exception as error:
            self.surfaces[header["key"]] = error

    def forget(self, header, arrays):
        self.surfaces.pop(header["key"], None)

    def run(self, header, arrays):
        import quadwright

        job = header["job"]
        last = [None]

        def progress(stage, fraction):
            now = (stage, int(200 * fraction))
            if now != last[0]:
                last[0] = now
                messages.write(self.sink, {"kind": "progress", "job": job, "stage": stage, "fraction": fraction})
            return quadwright.CANCEL if job in self.cancelled else None

        try:
            found = self.surfaces.get(header["key"])
            if isinstance(found, Exception):
                raise found
            if found is None:
                raise KeyError(f"there is no surface {header['key']}")
            reply, out = found.run(header, arrays, progress)
        except Exception as error:
            name = getattr(error, "status", type(error).__name__)
            if name == type(error).__name__ and not isinstance(error, (ValueError, TypeError, IndexError, MemoryError)):
                traceback.print_exc()
            messages.write(self.sink, {"kind": "failed", "job": job, "status": name, "message": str(error) or name})
        else:
            messages.write(self.sink, dict(reply, kind="done", job=job), out)


def main():
    source = os.fdopen(os.dup(0), "rb", buffering=1 << 16)
    sink = os.fdopen(os.dup(1), "wb", buffering=1 << 16)
    os.dup2(2, 1)  # what anybody prints goes to the log
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    if hasattr(os, "nice"):
        os.nice(5)  # the interface of the host comes first
    if "bpy" in sys.modules:  # Blender runs this: its folder for temporary files would be left when it is ended
        shutil.rmtree(sys.modules["bpy"].app.tempdir, ignore_errors=True)
    sink.write(READY)
    sink.flush()
    worker = Worker(source, sink)
    threading.Thread(target=worker.listen, daemon=True).start()
    import quadwright

    messages.write(sink, {"kind": "hello", "version": quadwright.__version__, "process": os.getpid(), "python": sys.version.split()[0]})
    worker.work()


if __name__ == "__main__":
    main()
