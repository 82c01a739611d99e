"""One array over the steps of a record, read only where it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, overload

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.maths.arrays import Array


@attrs.frozen(eq=False)
class TimeSeries:
    """One array over the steps of a record; nothing that was read is kept.

    `series[i]` is (n, *components), from the end for negative i, and a slice (k, n, *components);
    `len`, `for` and `np.asarray` work too.

    Raises:
        IndexError: there is no such step.
        RecordError: the file is damaged or closed.
    """

    shape: tuple[int, ...]  # (steps, n, *components)
    unit: str
    _read: Callable[[int, int], Array]  # first and stop -> the steps between

    def __len__(self) -> int:
        return self.shape[0]

    @overload
    def __getitem__(self, index: int) -> Array: ...
    @overload
    def __getitem__(self, index: slice) -> Array: ...
    def __getitem__(self, index: int | slice) -> Array:
        if isinstance(index, slice):
            chosen = range(len(self))[index]
            if chosen.step == 1:
                return self._read(chosen.start, max(chosen.start, chosen.stop))
            series = np.empty((len(chosen), *self.shape[1:]))
            for place, step in enumerate(chosen):
                series[place] = self[step]
            return series
        try:
            step = range(len(self))[index]
        except IndexError:
            raise IndexError(f"no step {index} in a record of {len(self)} steps") from None
        first: Array = self._read(step, step + 1)[0]
        return first

    def __iter__(self) -> Iterator[Array]:
        return (self[step] for step in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype=dtype)
