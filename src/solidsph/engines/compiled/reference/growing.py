"""An array that grows at its end, for what comes in portions of which nobody knows how many."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Growing:
    """Portions (k, ...) put one behind the other.

    To join a list of portions takes their memory twice. This is one array that is moved as it
    grows, and the system moves a large one without copying it.
    """

    def __init__(self, *shape: int, dtype: str | type) -> None:
        """An empty one; `shape` is that of an entry."""
        self._data = np.empty((0, *shape), dtype=dtype)
        self._count = 0

    def extend(self, values: NDArray[Any]) -> None:
        """Put `values` (k, ...) behind those that are there."""
        end = self._count + len(values)
        if end > len(self._data):
            # An eighth more than needed: all that is ever copied is some times the whole.
            self._resize(end + end // 8)
        self._data[self._count : end] = values
        self._count = end

    def so_far(self) -> NDArray[Any]:
        """What is there, to be read or changed; let go of it before adding more."""
        return self._data[: self._count]

    def shorten(self, count: int) -> None:
        """Keep the first `count` entries."""
        self._count = count

    def array(self) -> NDArray[Any]:
        """All entries, (n, ...). Nothing can be added any more."""
        self._resize(self._count)
        return self._data

    def _resize(self, count: int) -> None:
        # Whoever held a view while the array moves would read what is no longer there.
        self._data.resize((count, *self._data.shape[1:]), refcheck=False)
