"""The recipes of docs/python.md, one after another in one folder. QUADWRIGHT_PICTURES: the folder that their pictures are copied to."""
import os
import pathlib
import re
import shutil

import pytest


def test_recipes(tmp_path, monkeypatch):
    root = pathlib.Path(os.environ.get("QUADWRIGHT_ROOT") or pathlib.Path(__file__).parents[3])
    page = root / "docs/python.md"
    if not page.exists():
        pytest.skip("no docs/python.md beside these tests")
    monkeypatch.chdir(tmp_path)
    text = page.read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) >= 8
    names = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)
    pictures = re.findall(r"!\[[^]]*\]\(pictures/python-(.*?)\)", text)
    assert len(pictures) >= 3
    folder = os.environ.get("QUADWRIGHT_PICTURES")
    for name in pictures:
        drawn = tmp_path / name
        assert drawn.stat().st_size > 1000
        if folder:
            shutil.copy(drawn, pathlib.Path(folder) / f"python-{name}")
        assert (root / "docs/pictures" / f"python-{name}").exists()
