# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker seen from Blender: one process, started at the first run, kept for the next, killed where it does not obey.

Nothing here waits for the worker but start(), which a thread calls. poll() gives what has come; a worker that ended by itself
is one event, {"kind": "died"}, with a sentence.
"""
import collections
import glob
import hashlib
import importlib.util
import os
import queue
import signal
import subprocess
import sys
import threading
import time
import zipfile

from . import messages

HERE = os.path.dirname(os.path.abspath(__file__))
READY = b"quadwright worker 1\n"
PATIENCE_S = 0.25  # from "cancel" to a kill
START_S = 120.0  # a worker that does not say hello in this time is given up


class NoWorker(Exception):
    """A sentence: why no worker can be started."""


def wheels():
    return sorted(glob.glob(os.path.join(HERE, "wheels", "*.whl")))


def library_folder(temporary):
    """The folder with the package quadwright: where Blender 4.2 and later installed the wheel, else the wheel unpacked in a folder of
    this session, which Blender removes when it ends."""
    found = importlib.util.find_spec("quadwright") if "quadwright" not in sys.modules else sys.modules["quadwright"].__spec__
    if found is not None and found.origin and os.path.exists(os.path.join(os.path.dirname(found.origin), "_attributes.py")):  # no older package
        return os.path.dirname(os.path.dirname(found.origin))
    for wheel in wheels():
        with open(wheel, "rb") as file:
            name = hashlib.sha256(file.read()).hexdigest()[:12]
        folder = os.path.join(temporary, f"quadwright-{name}")
        if not os.path.exists(os.path.join(folder, "whole")):
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(folder)
            open(os.path.join(folder, "whole"), "w").close()
        return folder
    raise NoWorker("the add-on's folder has no wheel of the library for this system; install the zip for it")


def commands(blender):
    """Commands that may run the worker, the best first: Python beside this one's library, then sys.executable, then Blender itself. sys.executable
    alone is not enough: some builds of Blender find there whatever python is first on the PATH."""
    script = os.path.join(HERE, "worker.py")
    name = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    tried = [os.path.join(sys.base_exec_prefix, "bin", name), os.path.join(sys.base_exec_prefix, "bin", "python.exe"), sys.executable]
    for python in dict.fromkeys(tried):
        if python and os.path.isfile(python) and "blender" not in os.path.basename(python).lower():
            yield [python, "-s", "-B", script]
    if blender:
        yield [blender, "-b", "--factory-startup", "-noaudio", "--python-use-system-env", "--python-exit-code", "1", "--python", script]


class Child:
    """One worker process. Made by start()."""

    def __init__(self, command, environment):
        flags = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, **flags)
        self.events = queue.Queue()
        self.outgoing = queue.Queue()
        self.log = collections.deque(maxlen=30)
        self.hello = threading.Event()
        self.kill_at = None  # time.monotonic()
        self.is_killed = False
        self.threads = [threading.Thread(target=f, daemon=True) for f in (self._listen, self._read, self._write)]
        for thread in self.threads:
            thread.start()

    def _read(self):
        pipe = self.process.stdout
        try:
            while True:  # Blender says hello first, where it is the one that runs the worker
                line = pipe.readline()
                if line == READY:
                    break
                if not line:
                    raise EOFError
            while True:
                header, arrays = messages.read(pipe)
                if header["kind"] == "hello":
                    self.hello.set()
                else:
                    self.events.put((header, arrays))
        except (EOFError, ValueError, OSError):
            pass
        pipe.close()
        code = self.process.wait()
        self.threads[0].join(1)
        if not self.is_killed:
            self.events.put(({"kind": "died", "message": self._obituary(code)}, {}))
        self.hello.set()

    def _write(self):
        try:
            while True:
                message = self.outgoing.get()
                if message is None:
                    break
                messages.write(self.process.stdin, *message)
        except (OSError, ValueError):
            pass  # it ended: _read says so
        try:
            self.process.stdin.close()
        except OSError:
            pass

    def _listen(self):
        for line in self.process.stderr:
            self.log.append(line.decode("utf-8", "replace").rstrip())
        self.process.stderr.close()

    def _obituary(self, code):
        how = f"exit status {code}"
        if code < 0:
            try:
                how = f"signal {-code}, {signal.strsignal(-code)}"
            except ValueError:
                how = f"signal {-code}"
        last = next((line for line in reversed(self.log) if line.strip()), "")
        return f"the process that makes the quads ended by itself ({how}); nothing was changed" + (f": {last}" if last else "")

    @property
    def is_alive(self):
        return not self.is_killed and self.process.poll() is None

    def send(self, header, arrays=None):
        self.outgoing.put((header, arrays))

    def cancel(self, job):
        """The worker has PATIENCE_S to obey; it is killed then (look())."""
        self.send({"kind": "cancel", "job": job})
        self.kill_at = time.monotonic() + PATIENCE_S

    def obeyed(self):
        self.kill_at = None

    def look(self):
        """To be called now and then after cancel()."""
        if self.kill_at is not None and time.monotonic() > self.kill_at:
            self.kill()

    def poll(self):
        """The events that have come: [(header, arrays)]."""
        came = []
        while True:
            try:
                came.append(self.events.get_nowait())
            except queue.Empty:
                return came

    def kill(self):
        """At once, and waits until it is gone. The threads end by themselves, as their pipes do, and close them."""
        self.is_killed = True
        self.kill_at = None
        self.outgoing.put(None)
        self.process.kill()
        self.process.wait()


def start(temporary, blender):
    """A Child that has said hello. temporary: a folder of this session. Raises NoWorker."""
    import numpy

    folder = library_folder(temporary)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    environment["PYTHONPATH"] = os.pathsep.join([HERE, folder, os.path.dirname(os.path.dirname(numpy.__file__))])
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    why = ""
    for command in commands(blender):
        try:
            child = Child(command, environment)
        except OSError as error:
            why = str(error)
            continue
        child.hello.wait(START_S)
        if child.hello.is_set() and child.is_alive:
            return child
        came = child.poll()
        why = next((header["message"] for header, _ in came if header["kind"] == "died"), "it did not answer")
        child.kill()
    raise NoWorker(f"the process that makes the quads could not be started: {why}")
