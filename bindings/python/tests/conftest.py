"""Meshes made here; the command line tool, where QUADWRIGHT_TOOL names it."""
import os

import numpy as np
import pytest


def torus(rings=48, sides=24, radius=1.0, tube=0.4):
    """Triangles of a torus: float64 (n, 3), int64 (m, 3)."""
    u, v = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    a, b = 2 * np.pi * u / rings, 2 * np.pi * v / sides
    points = np.stack([(radius + tube * np.cos(b)) * np.cos(a), (radius + tube * np.cos(b)) * np.sin(a), tube * np.sin(b)], -1).reshape(-1, 3)

    def index(i, j):
        return (i % rings) * sides + j % sides

    p, q, r, s = index(u, v), index(u + 1, v), index(u + 1, v + 1), index(u, v + 1)
    faces = np.concatenate([np.stack([p, q, r], -1).reshape(-1, 3), np.stack([p, r, s], -1).reshape(-1, 3)])
    return points, faces


@pytest.fixture(scope="session")
def surface():
    return torus()


@pytest.fixture(scope="session")
def large():
    return torus(320, 160)


@pytest.fixture(scope="session")
def tool():
    path = os.environ.get("QUADWRIGHT_TOOL")
    if not path:
        pytest.skip("QUADWRIGHT_TOOL does not name the command line tool")
    return path
