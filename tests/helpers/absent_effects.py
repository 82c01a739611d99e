"""What a scene costs that does not name an effect: with that effect installed, and with it gone.

Run as a program it prints one line of JSON for each question on its input, a list of (effects that
are not there, leak, engine): every answer comes from a process that begins as the others do.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import tracemalloc
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np

from solidsph import Scene, Simulation
from solidsph.assembly.assembler import Assembler
from solidsph.registry import registry
from solidsph.run.dynamics import Dynamics
from solidsph.system.cache import CACHE

SCENE = """
duration = 0.01
outputs = 2
[body.block]
shape = {type = "box", lengths = [1.0, 0.5]}
spacing = 0.125
[material]
type = "neo-hookean"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {x = "1e3*min(t/0.005, 1)"}
"""

# Beside which others must be as absent as without it.
BUSY = ("body-force", "hourglass-control")
BESIDE = """
[[effect]]
type = "body-force"
acceleration = {y = -9.81}
[[effect]]
type = "hourglass-control"
"""

STEPS = 5

NUMPY = np.lib.tracemalloc_domain


def answer(hidden: list[str], leak: str | None, engine: str) -> dict[str, Any]:
    """Measure both scenes, as far as they can run, where `hidden` effects were never installed."""
    entry_points = registry.entry_points

    @cache  # what is installed does not change meanwhile
    def without(group: str) -> list[Any]:
        own = group == registry.PREFIX + "effects"
        return [one for one in entry_points(group=group) if not (own and one.name in hidden)]

    registry.entry_points = without  # type: ignore[assignment]
    if leak is not None:
        LEAKS[leak]()
    found = {"bare": measured(SCENE, engine)}
    if leak is None and not set(hidden) & set(BUSY) and engine == "matrix":
        found["busy"] = measured(SCENE + BESIDE, engine)
    return found


def measured(toml: str, engine: str) -> dict[str, Any]:
    """A run's results, bytes, instructions a step and code, and the modules that it loaded."""
    tracemalloc.start()
    simulation = Simulation.builder(Scene.from_toml(toml)).engine(engine).build()
    state = simulation.run().state
    taken = tracemalloc.take_snapshot().filter_traces([tracemalloc.DomainFilter(True, NUMPY)])
    held = sum(trace.size for trace in taken.traces)
    tracemalloc.stop()
    arrays = [state.positions, state.velocities, *state.memory.values(), *state.applied.values()]
    bits = b"".join(one.tobytes() for one in arrays) + repr(sorted(state.work.items())).encode()
    found: dict[str, Any] = {
        "results": hashlib.sha256(bits).hexdigest(),
        "bytes of arrays": held,
        "bytes of the engine": simulation.dynamics.internal.bytes,
        "modules": sorted(sys.modules),
    }
    if engine == "matrix":
        found["instructions"] = instructions(simulation)
    else:
        loop = simulation.time_loop()
        loop.advance(simulation.start(), STEPS)
        (text,) = loop.steps.all.inspect_llvm().values()  # type: ignore[attr-defined]
        found["lines of code"] = text.count("\n")
        found["loads"] = len(loop.loads)  # type: ignore[attr-defined]
    return found


def instructions(simulation: Simulation) -> int:
    """Of Python, in some steps of the loop that goes step by step."""
    loop, state = simulation.time_loop(), simulation.start()
    state = loop.advance(state, 1)  # what is made once is made
    count = 0

    def trace(frame: Any, event: str, argument: Any) -> Any:
        nonlocal count
        frame.f_trace_opcodes = True
        count += event == "opcode"
        return trace

    sys.settrace(trace)
    try:
        loop.advance(state, 1 + STEPS)
    finally:
        sys.settrace(None)
    return count


# What a careless core might do; each depends on an effect that nobody named.


def _import() -> None:
    plain = Assembler.assemble

    def importing(self: Assembler, kind: type[Simulation]) -> Simulation:
        for entry in registry.available("effects"):
            import_module(entry.target.partition(":")[0])
        return plain(self, kind)

    Assembler.assemble = importing  # type: ignore[method-assign]


def _branch() -> None:
    plain, installed = Dynamics.respond, registry.names("effects")

    def asking(self: Dynamics, *arguments: Any, **words: Any) -> Any:
        for _ in installed:
            pass
        return plain(self, *arguments, **words)

    Dynamics.respond = asking  # type: ignore[method-assign]


def _array() -> None:
    plain = Assembler.assemble
    kept = []

    def keeping(self: Assembler, kind: type[Simulation]) -> Simulation:
        kept.extend(np.zeros(8) for _ in registry.names("effects"))
        return plain(self, kind)

    Assembler.assemble = keeping  # type: ignore[method-assign]


def _result() -> None:
    plain, count = Dynamics.carry, len(registry.names("effects"))

    def slowing(self: Dynamics, time: float, velocities: Any) -> Any:
        return plain(self, time, velocities * (1.0 + count * 1e-15) + count * 1e-12)

    Dynamics.carry = slowing  # type: ignore[method-assign]


LEAKS = {"import": _import, "branch": _branch, "array": _array, "result": _result}


def in_a_child(question: list[Any]) -> str:
    """The answer of a process that has loaded what this one has, and nothing else."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        status = 1
        try:
            with os.fdopen(writing, "w") as pipe:
                pipe.write(json.dumps(answer(*question)))
            status = 0
        finally:
            os._exit(status)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    if status:
        raise SystemExit(f"{question}: the child failed")
    return text


if __name__ == "__main__":
    os.environ[CACHE] = os.devnull  # nothing is read from disk: what is compiled is counted
    for one in json.load(sys.stdin):
        print(in_a_child(one), flush=True)
