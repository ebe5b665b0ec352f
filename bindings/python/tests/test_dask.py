"""Many models on a local cluster of three workers, one of which is killed in the middle."""
import os
import pathlib
import signal
import threading
import time

import pytest
import quadwright

distributed = pytest.importorskip("distributed")


def test_a_worker_is_killed(tmp_path, surface):
    from quadwright.dask import remesh_many

    os.environ["DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT"] = "10s"
    paths = []
    for i in range(60):
        paths.append(tmp_path / f"m{i:02}.obj")
        quadwright.save(paths[-1], surface[0] * (1 + i / 100), surface[1])
    paths[30].write_text("v 0 0 0\nf 1 2 3\n")
    out = tmp_path / "out"
    with distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            killed = []

            def kill():
                while len(list(out.glob("*.record.json"))) < 10:
                    time.sleep(0.01)
                killed.append(next(iter(client.run(os.getpid).values())))
                os.kill(killed[0], signal.SIGKILL)

            thread = threading.Thread(target=kill)
            thread.start()
            records = remesh_many(paths, out, client=client, faces_wanted=200)
            thread.join()
            assert killed
            before = {p: p.stat().st_mtime_ns for p in out.glob("*.record.json")}
            assert len(before) == 59
            again = remesh_many(paths, out, client=client, faces_wanted=200)
    assert [pathlib.Path(r["input"]) for r in records] == paths
    assert [r["status"] for r in records].count("OK") == 59
    assert records[30]["status"] == "INDEX_RANGE" and "m30.obj" in records[30]["message"]
    assert records == again and before == {p: p.stat().st_mtime_ns for p in out.glob("*.record.json")}
    fresh = quadwright.remesh(quadwright.load(paths[7]), faces_wanted=200)
    fresh.save(tmp_path / "fresh.obj")
    assert (tmp_path / "fresh.obj").read_bytes() == pathlib.Path(records[7]["output"]).read_bytes()
