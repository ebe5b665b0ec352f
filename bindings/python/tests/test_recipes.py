"""The recipes of docs/python.md as a reader saves them: one script of all, and one of each that makes processes, which begin with the script again.
QUADWRIGHT_PICTURES: the folder that their pictures are copied to."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest


def test_recipes(tmp_path):
    root = pathlib.Path(os.environ.get("QUADWRIGHT_ROOT") or pathlib.Path(__file__).parents[3])
    page = root / "docs/python.md"
    if not page.exists():
        pytest.skip("no docs/python.md beside these tests")
    text = page.read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) >= 8
    guarded = [block for block in blocks if "__main__" in block]
    assert guarded
    for i, script in enumerate(["".join(block for block in blocks if block not in guarded), *guarded]):
        (tmp_path / f"recipe{i}.py").write_text(script)
        told = subprocess.run([sys.executable, f"recipe{i}.py"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert told.returncode == 0, told.stderr
    pictures = re.findall(r"!\[[^]]*\]\(pictures/python-(.*?)\)", text)
    assert len(pictures) >= 3
    folder = os.environ.get("QUADWRIGHT_PICTURES")
    for name in pictures:
        drawn = tmp_path / name
        assert drawn.stat().st_size > 1000
        if folder:
            shutil.copy(drawn, pathlib.Path(folder) / f"python-{name}")
        assert (root / "docs/pictures" / f"python-{name}").exists()
