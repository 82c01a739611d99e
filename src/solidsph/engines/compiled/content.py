"""The content of a function: everything that its compiled code depends on, as one digest.

Functions of equal content compile to the same code, in whichever process. The digest covers
instructions and constants and, in turn, the content of every global, closure cell and default that
a function refers to. What is not known here has no content, and its code is not kept.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from functools import singledispatch
from itertools import chain
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic

from solidsph.errors import PortableError

# What belongs to these is known by its name; their versions are part of the key of an entry.
_BY_NAME = frozenset(("builtins", "cmath", "llvmlite", "math", "numba", "numpy", "operator"))

Digest = Callable[[Any], bytes]


class UnknownContentError(PortableError):
    """A function refers to something that has no content here, or to itself."""


def content(*values: Any) -> str:
    """Digest of the content of values, as hexadecimal digits.

    Raises:
        UnknownContentError: one has none.
    """
    # By identity, with the value, which keeps its identity as long as it is held.
    known: dict[int, tuple[Any, bytes | None]] = {}

    def digest(value: Any) -> bytes:
        if id(value) not in known:
            known[id(value)] = value, None
            sha = hashlib.sha256(type(value).__qualname__.encode())
            for part in _parts(value, digest):
                sha.update(len(part).to_bytes(8, "little") + part)
            known[id(value)] = value, sha.digest()
        found = known[id(value)][1]
        if found is None:
            raise UnknownContentError(f"{value!r} refers to itself")
        return found

    return digest(values).hex()


@singledispatch
def _parts(value: Any, digest: Digest) -> Iterator[bytes]:
    """What a value consists of."""
    if not _is_known_by_name(value):
        raise UnknownContentError(f"{value!r} of type {type(value).__qualname__}")
    yield _name(value)


@_parts.register(
    int | float | complex | str | bytes | type(None) | type(...) | np.dtype | range | slice
)
def _(value: Any, digest: Digest) -> Iterator[bytes]:
    yield repr(value).encode()


@_parts.register(np.generic | np.ndarray)
def _(value: Any, digest: Digest) -> Iterator[bytes]:
    if value.dtype.hasobject:
        raise UnknownContentError(f"an array of objects, {value!r}")
    yield repr((value.dtype, value.shape)).encode()
    yield value.tobytes()


@_parts.register(tuple | list)
def _(value: Any, digest: Digest) -> Iterator[bytes]:
    yield from map(digest, value)


@_parts.register(set | frozenset)
def _(value: Any, digest: Digest) -> Iterator[bytes]:
    yield from sorted(map(digest, value))


@_parts.register
def _(value: dict, digest: Digest) -> Iterator[bytes]:  # type: ignore[type-arg]
    yield from sorted(digest(key) + digest(inner) for key, inner in value.items())


@_parts.register
def _(value: ModuleType, digest: Digest) -> Iterator[bytes]:
    # What a function takes from it is a part of that function.
    yield value.__name__.encode()


@_parts.register
def _(value: CodeType, digest: Digest) -> Iterator[bytes]:
    yield value.co_code
    yield value.co_exceptiontable
    yield repr((value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount)).encode()
    yield repr((value.co_flags, value.co_names, value.co_varnames)).encode()
    yield repr((value.co_cellvars, value.co_freevars)).encode()
    yield digest(value.co_consts)


@_parts.register
def _(value: FunctionType, digest: Digest) -> Iterator[bytes]:
    if _is_known_by_name(value):
        yield _name(value)
        return
    yield digest(value.__code__)
    yield digest(value.__defaults__)
    yield digest(value.__kwdefaults__)
    names = set(_names(value.__code__))
    held = {name: value.__globals__[name] for name in names if name in value.__globals__}
    held |= dict(zip(value.__code__.co_freevars, _cells(value), strict=True))
    for name in sorted(held):
        yield name.encode()
        yield digest(held[name])
        if isinstance(held[name], ModuleType) and not _is_known_by_name(held[name]):
            inside: Mapping[str, Any] = vars(held[name])
            taken = sorted(names & inside.keys())
            yield from chain.from_iterable((n.encode(), digest(inside[n])) for n in taken)


@_parts.register
def _(value: Dispatcher, digest: Digest) -> Iterator[bytes]:
    yield digest(value.targetoptions)
    yield digest(value.py_func)


@_parts.register
def _(value: _Intrinsic, digest: Digest) -> Iterator[bytes]:
    yield digest(value._defn)


@_parts.register
def _(value: type, digest: Digest) -> Iterator[bytes]:
    yield _name(value)
    # The source of the engine, with its types for the compiler, is part of the key of an entry.
    of_engine = issubclass(value, types.Type) and value.__module__.startswith(__package__)
    if not of_engine and not _is_known_by_name(value):
        # A named tuple, which compiled code sees as a tuple with names.
        if not (issubclass(value, tuple) and hasattr(value, "_fields")):
            raise UnknownContentError(f"class {value!r}")
        yield digest(value._fields)


@_parts.register
def _(value: types.Type, digest: Digest) -> Iterator[bytes]:
    yield str(value).encode()
    if isinstance(value, types.Callable):
        raise UnknownContentError(f"a function as argument, {value!r}")
    if isinstance(value, types.BaseNamedTuple):
        yield digest(value.instance_class)
    if isinstance(value, types.BaseTuple):
        yield from map(digest, value.types)


def _cells(function: FunctionType) -> Iterator[Any]:
    for cell in function.__closure__ or ():
        try:
            yield cell.cell_contents
        except ValueError:
            raise UnknownContentError(f"an empty cell of {function!r}") from None


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _is_known_by_name(value: Any) -> bool:
    module = value if isinstance(value, str) else getattr(value, "__module__", None)
    if isinstance(value, ModuleType):
        module = value.__name__
    return isinstance(module, str) and module.partition(".")[0] in _BY_NAME


def _name(value: Any) -> bytes:
    name = getattr(value, "__qualname__", None) or getattr(value, "__name__", None)
    if name is None:
        raise UnknownContentError(f"{value!r} has no name")
    return f"{value.__module__}.{name}".encode()
