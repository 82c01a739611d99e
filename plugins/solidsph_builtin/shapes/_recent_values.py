"""RecentValues: values that take long to make, of which a few are kept in memory."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar, final

import attrs

T = TypeVar("T")


@final
@attrs.define(eq=False)
class RecentValues(Generic[T]):
    """The values made last, by keys of all that they depend on."""

    most: int  # values that are kept
    _kept: dict[Hashable, T] = attrs.field(factory=dict, init=False)

    def value(self, key: Hashable, make: Callable[[], T]) -> T:
        """The value of a key, made if it is not kept; the one made first gives it its place."""
        if key not in self._kept:
            made = make()
            while len(self._kept) >= self.most:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = made
        return self._kept[key]
