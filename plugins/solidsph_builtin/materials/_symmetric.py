"""Symmetric tensors as tuples of components, the form in which a history holds them."""

from __future__ import annotations

from collections.abc import Sequence

from solidsph.interfaces.history import History
from solidsph.maths.arrays import Tensor


def component_count(dimension: int) -> int:
    """Number of components of a symmetric tensor."""
    return dimension * (dimension + 1) // 2


def names(dimension: int) -> Sequence[str]:
    """Names of the components of a symmetric tensor, in order."""
    return {1: ("xx",), 2: ("xx", "yy", "xy"), 3: ("xx", "yy", "zz", "yz", "xz", "xy")}[dimension]


def components(A: Tensor) -> History:
    """The components of a symmetric tensor."""
    if len(A) == 1:
        return (A[0][0],)
    if len(A) == 2:
        return (A[0][0], A[1][1], A[0][1])
    return (A[0][0], A[1][1], A[2][2], A[1][2], A[0][2], A[0][1])


def symmetric(values: History, like: Tensor) -> Tensor:
    """The symmetric tensor with these components, of the dimension of another."""
    if len(like) == 1:
        return ((values[0],),)
    if len(like) == 2:
        return ((values[0], values[2]), (values[2], values[1]))
    return (
        (values[0], values[5], values[4]),
        (values[5], values[1], values[3]),
        (values[4], values[3], values[2]),
    )


def first_components(values: History, like: Tensor) -> History:
    """As many of the values as a symmetric tensor has components."""
    if len(like) == 1:
        return values[:1]
    if len(like) == 2:
        return values[:3]
    return values[:6]


def later(values: History, like: Tensor) -> History:
    """The values after those."""
    if len(like) == 1:
        return values[1:]
    if len(like) == 2:
        return values[3:]
    return values[6:]
