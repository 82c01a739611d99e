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
            # An eighth more than needed, so that what is copied adds up to some times the whole.
            self._resize(end + end // 8)
        self._data[self._count : end] = values
        self._count = end

    def array(self) -> NDArray[Any]:
        """All entries, (n, ...). Nothing can be added any more."""
        self._resize(self._count)
        return self._data

    def _resize(self, count: int) -> None:
        # No view of it is ever given away before it is complete.
        self._data.resize((count, *self._data.shape[1:]), refcheck=False)
