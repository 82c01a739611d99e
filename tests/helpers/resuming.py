"""Runs that are stopped, killed and gone on with, for tests of what they leave.

As a program it kills: `python resuming.py FOLDER COUNT SEED` runs a scene in processes of its own
that are killed (SIGKILL) at random moments, goes on with each in the same way until it is finished,
and holds what is left against the record of a run that nobody killed.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import sys
import time
from math import inf
from pathlib import Path

import h5py
import numpy as np

from solidsph import Record, Simulation, resume
from solidsph.results import checkpointer
from solidsph.run.hooks import implementation
from solidsph.run.outcome import FINISHED
from solidsph.scene.scene_builder import SceneBuilder

OFTEN, NEVER = 1e9, 0.0  # shares of the time for checkpoints


class Stop:
    """Stops a run at one of its outputs."""

    def __init__(self, output: int, error: type[BaseException] = KeyboardInterrupt) -> None:
        self._left = output
        self._error = error

    @implementation
    def solidsph_step_end(self, simulation, observation) -> None:
        self._left -= 1
        if self._left == 0:
            raise self._error


def content(path: Path) -> dict[str, bytes]:
    """Every dataset and attribute of an HDF5 file, as bytes."""
    found: dict[str, bytes] = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        for key, value in item.attrs.items():
            found[f"{name}@{key}"] = np.asarray(value).tobytes()
        if isinstance(item, h5py.Dataset):
            found[name] = np.asarray(item[()]).tobytes()

    with h5py.File(path) as file:
        file.visititems(visit)
    return found


def assert_same_record(one: Path, other: Path) -> None:
    """All that is in two records, to the bit."""
    a, b = content(one), content(other)
    assert a.keys() == b.keys()
    assert [name for name in a if a[name] != b[name]] == []


def killed_scene() -> SceneBuilder:
    """Some half a second, with conditions that change in time and that see velocities."""
    return (
        Simulation.builder()
        .body("plate", shape={"type": "box", "lengths": [1.0, 0.5]}, spacing=1 / 24)
        .kernel("modified-mollifier", cover=3.0)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": "-1e4*sin(300*t)"})
        .effect("mass-damping", rate=20.0)
        .effect("hourglass-control")
        .duration(0.12)
        .outputs(60)
    )


def _in_a_process(act, seconds: float) -> bool:
    """Whether `act` got to its end in a process of its own before that was killed."""
    child = os.fork()
    if child == 0:
        try:
            act()
            os._exit(0)
        except BaseException as cause:
            print(f"{type(cause).__name__}: {cause}", flush=True)
            os._exit(1)
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            assert status == 0, f"ended with {status}"
            return True
        time.sleep(1e-3)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or status == 0, f"ended with {status}"
    return status == 0


def main(folder: Path, count: int, seed: int) -> None:
    """Kill `count` times; prints what it did."""
    chance = random.Random(seed)
    simulation = killed_scene().build()
    whole, path = folder / "whole.h5", folder / "killed.h5"
    begun = time.monotonic()
    simulation.run(record=whole)
    took = time.monotonic() - begun
    kills = runs = lost = 0
    while kills < count:
        runs += 1
        for old in folder.glob("killed*"):
            old.unlink()
        checkpointer.SHARE = chance.choice([NEVER, 0.01, 0.2, OFTEN])

        def begin() -> None:
            simulation.run(record=path)

        def go_on() -> None:
            resume(path, simulation=simulation)

        act, had = begin, 0
        # The last one is left alone: without checkpoints a run might else never get to its end.
        left = chance.randint(1, 4)
        while not _in_a_process(act, chance.uniform(0.0, took) if left else inf):
            kills += 1
            left -= 1
            if path.exists():
                with Record(path) as record:
                    lost += record.count < had
                    had = record.count
                    over = record.outcome == FINISHED
                if over:  # killed on its way out
                    break
                act = go_on
        assert_same_record(whole, path)
    print(f"kills {kills} runs {runs} lost {lost} seconds of a run {took:.2f}")


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):
        main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
