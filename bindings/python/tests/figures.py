"""figures.py: what the package costs beside the library's own time, and how soon an interrupt is heard; the tables of docs/results/python.md.

Overhead: wall time of the whole call less the seconds that the library's report gives to the run, over these; median of five."""
import os
import signal
import statistics
import threading
import time

import numpy as np
import quadwright
from conftest import torus


def overhead(points, faces, runs=5, **arguments):
    shares, own = [], []
    for _ in range(runs):
        began = time.perf_counter()
        result = quadwright.remesh(points, faces, **arguments)
        wall = time.perf_counter() - began
        shares.append((wall - result.report["seconds"]) / result.report["seconds"])
        own.append(result.report["seconds"])
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
        ("with provenance", points, faces.astype(np.int32), {"provenance": True}),
        ("with texture coordinates, colours and labels", points, faces.astype(np.int32),
         {"attributes": {"uv": uv, "color": single, "part": np.zeros(len(faces), np.int32)}}),
    ]
    print(f"{len(faces)} triangles, one thread\n\n| input | quads | the library's seconds | overhead |\n|---|---|---|---|")
    for wanted in (1000, 25000):
        for name, p, f, more in rows:
            own, share = overhead(p, f, faces_wanted=wanted, threads=1, **more)
            print(f"| {name} | {wanted} | {own:.2f} | {share:.1f} % |", flush=True)


def print_second_runs():
    points, faces = torus(320, 160)
    print("\n| quads | first run, seconds | the same Remesher's next run, of a tenth more |\n|---|---|---|")
    for wanted in (1000, 25000):
        remesher = quadwright.Remesher(points, faces)
        times = []
        for count in (wanted, wanted + wanted // 10):
            began = time.perf_counter()
            remesher.remesh(faces_wanted=count, threads=1)
            times.append(time.perf_counter() - began)
        print(f"| {wanted} | {times[0]:.2f} | {times[1]:.2f} |", flush=True)


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
    for rings, sides, wanted in ((320, 160, 25000), (1000, 500, 50000)):
        points, faces = torus(rings, sides)
        began = time.perf_counter()
        quadwright.remesh(points, faces, faces_wanted=wanted, threads=1)
        whole = time.perf_counter() - began
        lates = []
        for i in range(24):
            try:
                late = late_by(points, faces, whole * (i + 0.5) / 24, faces_wanted=wanted, threads=1)
            except KeyboardInterrupt:  # after the run
                late = None
            if late is not None:
                lates.append(late)
        print(f"| {len(faces)} | {wanted} | {len(lates)} | {statistics.median(lates):.3f} s | {max(lates):.3f} s |", flush=True)


if __name__ == "__main__":
    print_overheads()
    print_second_runs()
    print_interrupts()
