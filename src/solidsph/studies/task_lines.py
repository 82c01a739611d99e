"""Tasks, points and outcomes as JSON, for other processes and for the journal."""

from __future__ import annotations

import base64
import json
import pickle
import sys
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

import attrs

from solidsph.errors import SceneError, SolidsphError
from solidsph.registry.construct import construct, describe
from solidsph.studies.point import Point
from solidsph.studies.runner import Lost
from solidsph.studies.task import Task, plain


def encode_task(task: Task) -> str:
    """Line for `decode_task` in any process with the same software.

    A registered case is sent by name and parameters, any other is pickled, with the module path of
    this process.

    Raises:
        SceneError: no other process can import the class of the case, or a parameter of the case
            cannot be pickled.
    """
    return json.dumps({"key": task.key, **(_by_name(task) or _pickled(task))})


def decode_task(line: str | bytes) -> Task:
    """Task from a line of `encode_task`.

    Raises:
        SceneError: its key differs here, because the software is not the same.
    """
    table = json.loads(line)
    if "pickle" in table:
        sys.path += [place for place in table["path"] if place not in sys.path]
        task: Task = pickle.loads(base64.b64decode(table["pickle"]))
    else:
        task = _named(table["named"])
    if task.key != table["key"]:
        raise SceneError(
            f"{task.case.title!r} is a different case on the worker, where solidsph or a plugin "
            "has another version; install the same on both sides"
        )
    return task


def encode_outcome(outcome: Point | Lost) -> str:
    """Line for `decode_outcome`."""
    if isinstance(outcome, Lost):
        return json.dumps({"lost": outcome.cause})
    return json.dumps({"point": encode_point(outcome)})


def decode_outcome(line: str, task: Task) -> Point | Lost:
    """Outcome of `task`, from a line of `encode_outcome`."""
    table = json.loads(line)
    if "lost" in table:
        return Lost(str(table["lost"]))
    return decode_point(table["point"], task.settings)


def encode_point(point: Point) -> dict[str, Any]:
    """`point` as an object of JSON; its settings are only for reading."""
    table = attrs.asdict(point, recurse=False)
    numbers = {name: _number(value) for name, value in table.items() if isinstance(value, float)}
    seconds = [_number(value) for value in point.seconds]
    pairs = {name: [_number(value) for value in pair] for name, pair in point.values.items()}
    return {
        **table,
        **numbers,
        "settings": plain(point.settings),
        "seconds": seconds,
        "values": pairs,
    }


def decode_point(table: Mapping[str, Any], settings: Mapping[str, Any]) -> Point:
    """Point from the table of `encode_point`, with the settings of its task.

    Raises:
        KeyError, TypeError, ValueError: the table is not that of a point.
    """
    values = {field.name: table[field.name] for field in attrs.fields(Point)}
    return Point(**{**values, "settings": dict(settings)})


def _number(value: float) -> float | str:
    return value if isfinite(value) else str(value)  # JSON has no infinity


def _by_name(task: Task) -> dict[str, Any] | None:
    """Table of the task by names; None if that would not give the same task."""
    try:
        table = {
            "case": describe("cases", task.case),
            "settings": dict(task.settings),
            "repeat": task.repeat,
        }
        return {"named": table} if _named(json.loads(json.dumps(table))) == task else None
    except (SolidsphError, TypeError, ValueError):
        return None


def _named(table: dict[str, Any]) -> Task:
    return Task(construct("cases", table["case"]), table["settings"], table["repeat"])


def _pickled(task: Task) -> dict[str, Any]:
    cls = type(task.case)
    if cls.__module__ == "__main__" or "<" in cls.__qualname__:
        raise SceneError(
            f"no other process can find {cls.__module__}.{cls.__qualname__}; put the class at the "
            "top of a module that can be imported, or register it as a case"
        )
    try:
        content = base64.b64encode(pickle.dumps(task)).decode("ascii")
    except (pickle.PicklingError, TypeError, AttributeError) as cause:
        raise SceneError(
            f"{task.case.title!r} cannot be sent to another process: {cause}; leave such "
            "values out of its parameters"
        ) from cause
    return {"pickle": content, "path": [place or str(Path.cwd()) for place in sys.path]}
