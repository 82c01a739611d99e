"""Growing: an array that grows at its end, for an unknown number of portions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Growing:
    """Portions (k, ...) appended to one another.

    Joining a list of portions would take their memory twice. This array is moved as it grows, and
    the operating system moves a large one without copying it.
    """

    def __init__(self, *shape: int, dtype: str | type) -> None:
        """An empty array; `shape` is that of an entry."""
        self._data = np.empty((0, *shape), dtype=dtype)
        self._count = 0

    def extend(self, values: NDArray[Any]) -> None:
        """Append `values` (k, ...)."""
        end = self._count + len(values)
        if end > len(self._data):
            # An eighth more than needed limits what is ever copied to some times the whole.
            self._resize(end + end // 8)
        self._data[self._count : end] = values
        self._count = end

    def so_far(self) -> NDArray[Any]:
        """The entries so far, to be read or changed; drop the view before adding more."""
        return self._data[: self._count]

    def shorten(self, count: int) -> None:
        """Keep the first `count` entries."""
        self._count = count

    def array(self) -> NDArray[Any]:
        """All entries, (n, ...); nothing can be added afterwards."""
        self._resize(self._count)
        return self._data

    def _resize(self, count: int) -> None:
        # A view held while the array moves would refer to freed memory.
        self._data.resize((count, *self._data.shape[1:]), refcheck=False)
