"""C beside Python: built where it is used, with the compiler that is there."""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

_FLAGS = ["-O3", "-march=native", "-fopenmp", "-shared", "-fPIC"]


def library(source: str) -> ctypes.CDLL:
    """The library made from a C file of this folder."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "library.so"
        path = Path(__file__).with_name(source)
        compiler = os.environ.get("CC", "cc")
        subprocess.run([compiler, *_FLAGS, str(path), "-o", str(target), "-lm"], check=True)
        return ctypes.CDLL(str(target))


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Where an array that is contiguous begins."""
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)
