"""figures.py [overhead|again|interrupts]...: what the package costs beside the library's own run, what a second run costs, and how soon an interrupt is
heard; the tables of docs/dev/results/python.md. Processor seconds where the machine is not idle."""
import os
import signal
import statistics
import sys
import threading
import time

import numpy as np
import quadwright
from conftest import torus


class Timed:
    """A context of the extension whose runs are timed."""

    def __init__(self, context):
        self.context, self.seconds = context, 0

    def __getattr__(self, name):
        return getattr(self.context, name)

    def run(self, *arguments):
        began = time.process_time()
        try:
            return self.context.run(*arguments)
        finally:
            self.seconds = time.process_time() - began


def overhead(points, faces, runs=7, attributes=None, **arguments):
    """Processor seconds of the library's run, and what all around it takes, as a share of that: medians."""
    shares, own = [], []
    for _ in range(runs):
        began = time.process_time()
        remesher = quadwright.Remesher(points, faces, attributes=attributes)
        remesher._context = Timed(remesher._context)
        remesher.remesh(**arguments)
        whole = time.process_time() - began
        own.append(remesher._context.seconds)
        shares.append((whole - own[-1]) / own[-1])
    return statistics.median(own), 100 * statistics.median(shares)


def print_overheads():
    points, faces = torus(320, 160)
    single = points.astype(np.float32)
    uv = points[faces][:, :, :2].astype(np.float32)
    rows = [
        ("float64 and int32, C order", points, faces.astype(np.int32), {}),
        ("float32 and int64", single, faces, {}),
        ("Fortran order", np.asfortranarray(points), np.asfortranarray(faces), {}),
        ("lists", points.tolist(), faces.tolist(), {}),
        ("a progress function", points, faces.astype(np.int32), {"progress": lambda stage, fraction: None}),
        ("provenance asked for", points, faces.astype(np.int32), {"provenance": True}),
        ("texture coordinates, colours and labels", points, faces.astype(np.int32),
         {"attributes": {"uv": uv, "color": single, "part": np.zeros(len(faces), np.int32)}}),
    ]
    print(f"{len(faces)} triangles, one thread\n\n| input | quads | the library's processor seconds | overhead |\n|---|---|---|---|")
    for wanted in (1000, 25000):
        for name, p, f, more in rows:
            own, share = overhead(p, f, faces=wanted, threads=1, **more)
            print(f"| {name} | {wanted} | {own:.2f} | {share:.1f} % |", flush=True)


def print_second_runs():
    points, faces = torus(320, 160)
    print("\n| quads | first run, processor seconds | the same Remesher's next run, of a tenth more | the same again, with relax=False |\n|---|---|---|---|")
    for wanted in (1000, 25000):
        remesher = quadwright.Remesher(points, faces)
        times = []
        for count, relax in ((wanted, True), (wanted + wanted // 10, True), (wanted + wanted // 10, False)):
            began = time.process_time()
            remesher.remesh(faces=count, threads=1, relax=relax)
            times.append(time.process_time() - began)
        print(f"| {wanted} | {times[0]:.2f} | {times[1]:.2f} | {times[2]:.2f} |", flush=True)


def late_by(points, faces, after, **arguments):
    """Seconds from an interrupt to its exception; None where the run ended before it."""
    sent = []

    def later():
        time.sleep(after)
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=later)
    thread.start()
    late = None
    try:
        quadwright.remesh(points, faces, **arguments)
        thread.join()
        time.sleep(0.1)
    except KeyboardInterrupt:
        late = time.monotonic() - sent[0] if thread.is_alive() or sent else None
    thread.join()
    return late


def print_interrupts():
    print("\n| triangles | quads | interrupts | heard after, median | the longest |\n|---|---|---|---|---|")
    for rings, sides, wanted, count in ((320, 160, 25000, 24), (1000, 500, 20000, 8)):
        points, faces = torus(rings, sides)
        began = time.perf_counter()
        quadwright.remesh(points, faces, faces=wanted, threads=1)
        whole = time.perf_counter() - began
        lates = []
        for i in range(count):
            try:
                late = late_by(points, faces, whole * (i + 0.5) / count, faces=wanted, threads=1)
            except KeyboardInterrupt:  # after the run
                late = None
            if late is not None:
                lates.append(late)
        print(f"| {len(faces)} | {wanted} | {len(lates)} | {statistics.median(lates):.3f} s | {max(lates):.3f} s |", flush=True)


PARTS = {"overhead": print_overheads, "again": print_second_runs, "interrupts": print_interrupts}

if __name__ == "__main__":
    for part in sys.argv[1:] or PARTS:
        PARTS[part]()
