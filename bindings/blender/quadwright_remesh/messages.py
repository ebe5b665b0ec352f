# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages between the add-on and its worker, over pipes: a header as JSON, then the bytes of its arrays.

    4 bytes     length of the header, little-endian
    header      JSON: {"kind": ..., "arrays": [[name, dtype, shape], ...], ...}
    arrays      in that order, C order, nothing between them
"""
import json
import struct

import numpy as np

MOST_HEADER = 1 << 26  # bytes


def write(stream, header, arrays=None):
    """arrays: {name: array}."""
    arrays = {name: np.ascontiguousarray(array) for name, array in (arrays or {}).items()}
    header = dict(header, arrays=[[name, array.dtype.str, list(array.shape)] for name, array in arrays.items()])
    text = json.dumps(header).encode()
    stream.write(struct.pack("<I", len(text)) + text)
    for array in arrays.values():
        if array.size:
            stream.write(memoryview(array).cast("B"))
    stream.flush()


def _exactly(stream, size):
    data = bytearray(size)
    view, at = memoryview(data), 0
    while at < size:
        got = stream.readinto(view[at:])
        if not got:
            raise EOFError
        at += got
    return data


def read(stream):
    """(header, {name: array}); EOFError at the end."""
    (length,) = struct.unpack("<I", _exactly(stream, 4))
    if length > MOST_HEADER:
        raise ValueError("the header of a message is too long")
    header = json.loads(_exactly(stream, length))
    arrays = {}
    for name, dtype, shape in header.pop("arrays"):
        dtype = np.dtype(dtype)
        size = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        arrays[name] = np.frombuffer(_exactly(stream, size), dtype).reshape(shape)
    return header, arrays
