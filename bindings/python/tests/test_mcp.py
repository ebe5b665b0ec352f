"""The server for agents, as a client of its protocol uses it: a process, messages on its standard streams."""
import base64
import json
import os
import pathlib
import queue
import re
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import quadwright
from conftest import torus


class Client:
    """A client: what it asks, and what it hears, in order."""

    def __init__(self, *folders):
        command = os.path.join(os.path.dirname(sys.executable), "quadwright-mcp")
        self.process = subprocess.Popen([command, *map(str, folders)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.heard, self.notes, self.number = queue.Queue(), [], 0
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.heard.put(json.loads(line))

    def send(self, **message):
        self.process.stdin.write(json.dumps({"jsonrpc": "2.0", **message}) + "\n")
        self.process.stdin.flush()

    def ask(self, method, **params):
        self.number += 1
        self.send(id=self.number, method=method, params=params)
        return self.number

    def answer(self, number, seconds=120):
        """The answer to a request; what is told meanwhile goes to `notes`."""
        while True:
            message = self.heard.get(timeout=seconds)
            if message.get("id") == number:
                return message
            self.notes.append(message)

    def call(self, tool, /, **arguments):
        return self.answer(self.ask("tools/call", name=tool, arguments=arguments))["result"]

    def start(self):
        told = self.answer(self.ask("initialize", protocolVersion="2025-06-18", capabilities={}, clientInfo={"name": "test", "version": "1"}))
        self.send(method="notifications/initialized")
        return told["result"]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "work").mkdir()
    points, faces = torus(64, 32)
    noise = np.random.default_rng(1).normal(scale=0.002, size=points.shape)
    colour = (points - points.min(axis=0)) / np.ptp(points, axis=0)
    quadwright.save(tmp_path / "work/scan.ply", points + noise, faces, attributes={"color": quadwright.Attribute(colour, "vertex", storage="uint8")})
    return tmp_path / "work"


@pytest.fixture
def client(folder):
    made = Client(folder)
    made.start()
    yield made
    made.process.stdin.close()
    assert made.process.wait(10) == 0


def test_a_session(folder, client):
    """Find the tool, look at the scan, make an asset of it, look at that, measure it."""
    tools = {tool["name"]: tool for tool in client.answer(client.ask("tools/list"))["result"]["tools"]}
    assert set(tools) == {"remesh", "asset", "measure", "render", "options", "batch"}
    assert "scan" in tools["asset"]["inputSchema"]["properties"]["preset"]["enum"] and not tools["asset"]["annotations"]["readOnlyHint"]
    [picture] = client.call("render", inputs=["scan.ply"], width=320, height=240)["content"]
    number = client.ask("tools/call", name="asset", arguments={"input": "scan.ply", "output": str(folder / "made.glb"), "faces": 2000, "preset": "scan", "texture": 256},
                        _meta={"progressToken": "asset"})
    result = client.answer(number)["result"]
    told = result["structuredContent"]
    assert not result.get("isError") and json.loads(result["content"][0]["text"]) == told
    assert abs(told["quads"] - 2000) < 100 and told["asset"]["charts"] > 0 and told["output"] == str(folder / "made.glb")
    progress = [note["params"] for note in client.notes if note["method"] == "notifications/progress"]
    values = [note["progress"] for note in progress]
    assert len(values) > 5 and values == sorted(set(values)) and all(note["progressToken"] == "asset" and 0 <= note["progress"] <= note["total"] for note in progress)
    assert values[0] < 1 < values[-1] and progress[0]["total"] == 3 and all(note["message"] for note in progress)
    [other] = client.call("render", inputs=["made.glb"], width=320, height=240)["content"]
    for image in (picture, other):
        assert image["type"] == "image" and image["mimeType"] == "image/png" and base64.b64decode(image["data"]).startswith(b"\x89PNG")
    assert picture["data"] != other["data"]
    client.call("remesh", input="scan.ply", output="new/folder/quads.obj", faces=100)
    assert (folder / "new/folder/quads.obj").exists()
    client.call("remesh", input="scan.ply", output="quads.obj", faces=300, preset="scan", options={"adaptive": 0.25})
    same = quadwright.remesh(quadwright.load(folder / "scan.ply"), faces=300, preset="scan", adaptive=0.25)
    assert np.array_equal(quadwright.load(folder / "quads.obj").faces, same.quads)
    figures = client.call("measure", input="quads.obj", against="scan.ply")["structuredContent"]
    assert figures["quads"] == len(same.quads) and figures["hausdorff"] > 0
    assert client.call("options", name="adaptive")["structuredContent"]["options"]["adaptive"] == json.loads(json.dumps(quadwright.options()["adaptive"]))


def test_a_long_run_is_cancelled(folder, client):
    points, faces = torus(500, 250)
    quadwright.save(folder / "large.obj", points, faces)
    number = client.ask("tools/call", name="remesh", arguments={"input": "large.obj", "output": "never.obj", "faces": 60000}, _meta={"progressToken": 7})
    first = client.heard.get(timeout=60)
    assert first["method"] == "notifications/progress" and first["params"]["progressToken"] == 7
    assert client.answer(client.ask("ping"), 5)["result"] == {}  # meanwhile the server hears
    client.send(method="notifications/cancelled", params={"requestId": number, "reason": "enough"})
    before = pathlib.Path(f"/proc/{client.process.pid}/stat").read_text().split()[13]
    time.sleep(1)
    at = time.monotonic()
    assert client.call("measure", input="scan.ply")["structuredContent"]["triangles"] == 4096
    assert time.monotonic() - at < 10
    time.sleep(2)
    rest = int(pathlib.Path(f"/proc/{client.process.pid}/stat").read_text().split()[13]) - int(before)
    assert rest < 400  # hundredths of a second of work: the run is given up, where it would go on for many
    assert not (folder / "never.obj").exists() and all(message.get("id") != number for message in client.notes)  # what was cancelled has no answer


def test_only_folders_that_were_named(folder, client, tmp_path):
    points, faces = torus(16, 8)
    outside = tmp_path / "secret.obj"
    quadwright.save(outside, points, faces)
    (folder / "link.obj").symlink_to(outside)
    (folder / "door").symlink_to(tmp_path)
    for name in (str(outside), "../secret.obj", "link.obj", "door/secret.obj", "../work2/x.obj"):
        for tool, arguments in (("measure", {"input": name}), ("render", {"inputs": [name]}), ("remesh", {"input": "scan.ply", "output": name}), ("batch", {"input": name, "output": "out"})):
            result = client.call(tool, **arguments)
            assert result["isError"] and re.search(f"outside the folders that this server may touch: {folder}$", result["content"][0]["text"]), (tool, name)
    (folder / "names.obj").write_text(f"mtllib {tmp_path}/other.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "textured.obj").write_text("mtllib textured.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
    (folder / "textured.mtl").write_text("newmtl a\nmap_Kd -s 1 1 1 ..\\my secret.png\n")
    (folder / "doc.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "door/secret.png"}]}))
    for name in ("names.obj", "textured.obj", "doc.gltf"):
        result = client.call("asset", input=name, output="x.glb")
        assert result["isError"] and "outside the folders" in result["content"][0]["text"], name
    (folder / "asset_color.png").symlink_to(tmp_path / "picture.png")
    (folder / "out").mkdir()
    (folder / "out/scan.ply.quads.obj").symlink_to(tmp_path / "quads.obj")
    result = client.call("asset", input="scan.ply", output="asset.obj", faces=100, texture=64)
    assert result["isError"] and "asset_color.png is outside" in result["content"][0]["text"]
    records = client.call("batch", input=".", output="out", faces=100)["structuredContent"]["records"]
    assert {r["name"]: r["status"] for r in records} == {"scan.ply": "PermissionError", "link.obj": "PermissionError", "names.obj": "PermissionError", "textured.obj": "PermissionError", "doc.gltf": "PermissionError"}
    assert not (folder / "x.glb").exists() and sorted(os.listdir(tmp_path)) == ["secret.obj", "work"]


def test_what_is_wrong_is_said(folder, client):
    for arguments, says in (({"input": "scan.ply"}, "remesh needs output"), ({"input": "scan.ply", "output": "a.obj", "adaptive": 1}, "no argument 'adaptive'.*into `options`"),
                            ({"input": "none.ply", "output": "a.obj"}, "FILE_MISSING: "), ({"input": "scan.ply", "output": "a.obj", "options": {"guides": "/etc/passwd"}}, "no option 'guides'"),
                            ({"input": "scan.ply", "output": "a.obj", "faces": "many"}, "^faces: must be a whole number"), ({"input": "scan.ply", "output": "a.fbx"}, "no format"),
                            ({"input": 3, "output": "a.obj"}, "input: must be the name"), ({"input": "scan.ply", "output": "a.obj", "time_limit": 1e-6}, "TIME_LIMIT: ")):
        result = client.call("remesh", **arguments)
        assert result["isError"] and re.search(says, result["content"][0]["text"]), result
    for message, code in ((dict(id="a", method="tools/call", params={"name": "fly"}), -32602), (dict(id="b", method="resources/list"), -32601), (dict(id="c", method=3), -32600),
                          (dict(id="d", method="tools/call", params=[1]), -32600), (dict(id="e", method="tools/call", params={"name": ["remesh"]}), -32602),
                          (dict(id="f", method="tools/call", params={"name": "options", "_meta": 3}), -32602)):
        client.send(**message)
        assert client.answer(message["id"])["error"]["code"] == code
    client.process.stdin.write("{nonsense\n")
    client.process.stdin.flush()
    assert client.answer(None)["error"]["code"] == -32700
    client.send(id=["x"], method="ping")
    assert client.answer(None)["error"]["code"] == -32600
    client.send(method="notifications/cancelled", params={"requestId": {}})
    assert client.answer(client.ask("ping"))["result"] == {}


def test_a_folder_of_models(folder, client):
    (folder / "models/sub").mkdir(parents=True)
    for i in range(3):
        quadwright.save(folder / f"models/{'sub/' if i else ''}m{i}.ply", torus(24, 12)[0] * (1 + i), torus(24, 12)[1])
    (folder / "models/bad.obj").write_text("v 0 0 0\nf 1 2 3\n")
    number = client.ask("tools/call", name="batch", arguments={"input": "models", "output": "models/out", "faces": 100}, _meta={"progressToken": 1})
    first = client.answer(number)["result"]["structuredContent"]
    values = [note["params"]["progress"] for note in client.notes if note["method"] == "notifications/progress"]
    assert values == sorted(set(values)) and values[-1] == 4 and 1 <= values[0] < 2  # the first model fails before it begins
    assert first["models"] == 4 and first["failed"] == 1
    assert [(r["name"], r["status"]) for r in first["records"]] == [("bad.obj", "INDEX_RANGE"), ("m0.ply", "OK"), ("sub/m1.ply", "OK"), ("sub/m2.ply", "OK")]
    times = {path: path.stat().st_mtime_ns for path in (folder / "models/out").rglob("*.obj")}
    assert len(times) == 3
    assert client.call("batch", input="models", output="models/out", faces=100)["structuredContent"] == first
    assert times == {path: path.stat().st_mtime_ns for path in (folder / "models/out").rglob("*.obj")}
    told = client.call("batch", input="models/sub", output="out3", faces=100, options={"wrap_quads": 2})["structuredContent"]["records"]
    assert all(r["warnings"] == ["option wrap_quads has no effect without wrap"] for r in told)
    assert client.call("batch", input="models", output="out2", faces=100, options={"adaptive": 7})["isError"]  # wrong for all


def test_versions_and_the_start(folder, tmp_path):
    client = Client(folder)
    for asked, given in (("2024-11-05", "2024-11-05"), ("2099-01-01", "2025-11-25")):
        told = client.answer(client.ask("initialize", protocolVersion=asked, capabilities={}))["result"]
        assert told["protocolVersion"] == given and told["serverInfo"]["version"] == quadwright.__version__ and str(folder) in told["instructions"]
    client.process.stdin.close()
    assert client.process.wait(10) == 0
    scripts = pathlib.Path(sys.executable).parent
    for arguments, says in (([], "quadwright-mcp FOLDER"), ([str(tmp_path / "none")], "is no folder")):
        told = subprocess.run([scripts / "quadwright-mcp", *arguments], capture_output=True, text=True, stdin=subprocess.DEVNULL)
        assert told.returncode == 1 and says in told.stderr and not told.stdout
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/quadwright").write_text("#!/bin/sh\necho program $1\n")
    (tmp_path / "bin/quadwright").chmod(0o755)
    told = subprocess.run([scripts / "quadwright", "x.obj"], capture_output=True, text=True, env={**os.environ, "PATH": f"{scripts}:{tmp_path}/bin:/usr/bin:/bin"})
    assert told.stdout == "program x.obj\n"  # that of the command line


def test_the_list_of_servers():
    root = pathlib.Path(os.environ.get("QUADWRIGHT_ROOT") or pathlib.Path(__file__).parents[3])
    if not (root / "bindings/python/server.json").exists():
        pytest.skip("no server.json beside these tests")
    told = json.loads((root / "bindings/python/server.json").read_text())
    [package] = told["packages"]
    assert told["version"] == package["version"] == quadwright.__version__ and len(told["description"]) <= 100
    assert f"mcp-name: {told['name']}" in (root / "bindings/python/README.md").read_text()
    assert re.fullmatch(r"[a-zA-Z0-9.-]+/[a-zA-Z0-9._-]+", told["name"]) and package["packageArguments"][0]["value"] == "mcp"
