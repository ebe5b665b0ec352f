"""The stubs say what the package has: checked by mypy's stubtest where it is installed, and by mypy on a program that uses it."""
import subprocess
import sys

import pytest

pytest.importorskip("mypy")
# A type of dictionaries; constructors that only the package calls.
ALLOWED = "quadwright.Measures\nquadwright.Provenance.__init__\nquadwright.Result.__init__\n"
PROGRAM = '''
import numpy as np
import quadwright

mesh = quadwright.load("a.obj")
result: quadwright.Result = quadwright.remesh(mesh.vertices, mesh.faces, faces=100, symmetry=(1.0, 0.0, 0.0, 0.0), flow="closed", keep="seams",
                                              attributes={"uv": np.zeros((3, 2)), "m": quadwright.Attribute([1, 2], "face", names=["a", "b"])},
                                              guides=[[[0, 0, 0], [1, 0, 0]]], density=[1.0, 2.0], progress=lambda stage, fraction: True)
irregular: int = result.measure()["irregular"]
if result.provenance is not None:
    print(result.provenance.farthest, result.attributes["uv"].values)
try:
    quadwright.Remesher(mesh).remesh(ratio=0.5, field_per="face")
except (quadwright.Cancelled, quadwright.OptionError) as error:
    print(error.status)
'''
WRONG = '''
import quadwright

quadwright.remesh([[0, 0, 0]], [[0, 0, 0]], faces="many")
quadwright.remesh([[0, 0, 0]], [[0, 0, 0]], flow="none")
quadwright.remesh([[0, 0, 0]], [[0, 0, 0]], nothing=1)
'''


def mypy(tmp_path, *arguments):
    told = subprocess.run([sys.executable, "-m", *arguments], cwd=tmp_path, capture_output=True, text=True,
                          env={"MYPY_CACHE_DIR": str(tmp_path / "cache"), "PATH": "/usr/bin:/bin"})
    return told.returncode, told.stdout + told.stderr


def test_stubs_are_the_package(tmp_path):
    (tmp_path / "allowed").write_text(ALLOWED)
    code, text = mypy(tmp_path, "mypy.stubtest", "quadwright", "--concise", "--ignore-missing-stub", "--allowlist", "allowed")
    assert code == 0, text


def test_a_program_that_uses_it(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    code, text = mypy(tmp_path, "mypy", "--strict", "program.py")
    assert code == 0, text
    (tmp_path / "wrong.py").write_text(WRONG)
    code, text = mypy(tmp_path, "mypy", "--strict", "wrong.py")
    assert code == 1 and text.count("wrong.py:") >= 3, text
