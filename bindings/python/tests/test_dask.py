"""Many models on a local cluster of three workers, one of which is killed in the middle."""
import os
import pathlib
import signal
import threading
import time

import pytest
import quadwright
from conftest import torus

MODELS = 300  # one of them bad
distributed = pytest.importorskip("distributed")


def times(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.record.json")}


def test_a_worker_is_killed(tmp_path):
    from quadwright.dask import remesh_many

    points, faces = torus(24, 12)
    os.environ["DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT"] = "10s"
    paths = []
    for i in range(MODELS):
        paths.append(tmp_path / f"m{i:03}.obj")
        quadwright.save(paths[-1], points * (1 + i / 100), faces)
    paths[30].write_text("v 0 0 0\nf 1 2 3\n")
    out = tmp_path / "out"
    with distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            killed = []

            def kill():
                while len(times(out)) < 40:
                    time.sleep(0.01)
                victim = next(iter(client.run(os.getpid).values()))
                os.kill(victim, signal.SIGKILL)
                killed.append((victim, times(out)))

            thread = threading.Thread(target=kill)
            thread.start()
            records = remesh_many(paths, out, client=client, faces=200)
            thread.join()
            victim, done = killed[0]
            before = times(out)
            assert len(before) == MODELS - 1 and 40 <= len(done) < MODELS - 1
            assert all(before[name] == done[name] for name in done)  # nothing is done twice
            again = remesh_many(paths, out, client=client, faces=200)
    assert [pathlib.Path(r["input"]) for r in records] == paths
    assert [r["status"] for r in records].count("OK") == MODELS - 1
    assert any(r.get("process") == victim for r in records)  # what the victim had done stays
    assert not [p for p in out.iterdir() if p.suffix == ".part"] or len([p for p in out.iterdir() if p.suffix == ".part"]) == 1  # at most its last
    assert records[30]["status"] == "INDEX_RANGE" and "m030.obj" in records[30]["message"]
    assert records == again and before == times(out)
    fresh = quadwright.remesh(quadwright.load(paths[7]), faces=200)
    fresh.save(tmp_path / "fresh.obj")
    assert (tmp_path / "fresh.obj").read_bytes() == pathlib.Path(records[7]["output"]).read_bytes()
