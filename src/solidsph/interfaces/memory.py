"""Memory: arrays that parts keep from one step to the next."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TypeAlias

from solidsph.maths.arrays import Array

Memory: TypeAlias = Mapping[str, Array]
"""`State.memory`: arrays by name. A part reads and writes names that begin with its own."""

NOTHING: Memory = MappingProxyType({})
"""The memory of a run that has not begun."""
