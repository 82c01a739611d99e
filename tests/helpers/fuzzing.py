"""Scenes and files that are wrong in any way, from those that are right."""

from __future__ import annotations

import random
import signal
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from typing import Any

import tomli_w

from solidsph import Scene, Simulation, SolidsphError
from tests.helpers.scenes import SCENE_TOML

# What may stand anywhere: of every type that TOML has, extreme, or nearly right.
VALUES: list[Any] = [
    0, 1, -1, 2, 3, 7, 10**6, 10**30, -(10**30), 2**63, 0.0, -0.0, 0.5, 1.0, -1.5, 1e-300, 1e300,
    5e-324, float("inf"), float("-inf"), float("nan"), True, False, "", "x", "left", "right", "all",
    "ghosts", "surface", "nowhere", "t", "X", "X+", "1/0", "X/0", "2**9999", "sqrt(-X)", "log(0)",
    "exp(1e9)", "__import__('os').system('false')", "().__class__", "X.real", "lambda: 0", "[1]",
    "'a'*10**9", "(" * 300, "1" * 5000, "9**9**9**9", "x" * 3000, "\u0000", "Ünïcode", "a b", "-",
    "../../x", "/dev/null", "%s{}", [], [1.0], [1.0, 0.5], [[]], [0.0, 0.0], [1.0, 1.0, 1.0], {},
    {"x": 1.0}, {"x": "1e3*t"}, {"w": 1}, {"type": "lattice"}, {"type": "box"}, {"type": 3},
    {"type": "neo-hookean"}, {"type": "consistent", "gradient": "consistent"},
    "stress xx", "von-mises", "resultant", {"from": [0.0, 0.0], "to": [1.0, 0.5]},
]  # fmt: skip

WORDS = [
    "body", "kernel", "material", "formulation", "boundary", "effect", "initial", "integrator",
    "statics", "duration", "outputs", "engine", "title", "type", "where", "shape", "spacing",
    "discretisation", "gradient", "divergence", "ghosts", "cover", "time_step", "time_step_factor",
    "label", "tags", "lengths", "x", "y", "z", "rate", "strength", "density", "poissons_ratio",
    "youngs_modulus", "displacement", "velocity", "traction", "acceleration", "axis", "at",
    "load_steps", "radius", "points", "file", "seed", "amount", "parts", "on_boundary", "silence",
    "probe", "quantity", "point", "line", "from", "to", "count", "account", "about",
]  # fmt: skip

PARTS = [
    "cubic-spline", "gaussian", "mollifier", "linear-elastic", "saint-venant-kirchhoff", "disc",
    "annulus", "ball", "interval", "polygon", "union", "difference", "points", "jittered",
    "jittered-lattice", "mapped", "conforming-lattice", "fitted-moments", "updated-lagrangian",
    "standard", "difference", "corrected", "quadratic", "skewed", "consistent", "plain",
    "variational", "velocity-verlet", "mass-damping", "body-force", "hourglass-control",
    "artificial-viscosity", "clamp", "symmetry", "ghost-extension", "exact-dirichlet",
    "full-dirichlet", "literal-dirichlet", "approximate-neumann", "prescribed-motion", "traction",
    "compiled", "matrix", "auto",
]  # fmt: skip

SCENES = [
    SCENE_TOML,
    SCENE_TOML
    + """
[[probe]]
label = "tip"
quantity = "displacement"
point = [1.0, 0.25]
[[probe]]
label = "end"
quantity = "von-mises"
where = "right"
[[probe]]
label = "cut"
quantity = "stress xy"
line = {from = [0.5, 0.0], to = [0.5, 0.5], count = 5}
body = "block"
[[probe]]
label = "hold"
quantity = "resultant"
account = "clamp left"
about = [0.0, 0.25]
""",
    SCENE_TOML.replace('gradient = "corrected"', 'gradient = "consistent"').replace(
        "[integrator]", '[[effect]]\ntype = "hourglass-control"\n\n[integrator]'
    ),
    """
duration = 0.01
[body.bar]
shape = {type = "interval", length = 1.0}
spacing = 0.1
discretisation = {type = "lattice", ghosts = 3, on_boundary = true}
tags = {middle = "X > 0.4 and X < 0.6"}
[kernel]
cover = 3.0
[material]
type = "linear-elastic"
youngs_modulus = 1e6
poissons_ratio = 0.0
density = 1000.0
[formulation]
type = "total-lagrangian"
divergence = "plain"
[[boundary]]
type = "ghost-extension"
[[boundary]]
type = "approximate-neumann"
where = "right"
traction = {x = "1e3*sin(t)"}
ghosts = "right-ghosts"
[[initial]]
where = "middle"
velocity = {x = "sin(pi*X)"}
""",
    """
duration = 1.0
[body.a]
shape = {type = "disc", radius = 0.5}
spacing = 0.2
[body.b]
shape = {type = "difference", base = {type = "box", lengths = [1.0, 1.0], origin = [2.0, 0.0]}, \
holes = [{type = "disc", radius = 0.2, centre = [2.5, 0.5]}]}
spacing = 0.2
discretisation = "conforming-lattice"
[material]
type = "neo-hookean"
youngs_modulus = 1e3
poissons_ratio = 0.3
density = 1000.0
[[effect]]
type = "mass-damping"
rate = 3.0
where = "a"
[[effect]]
type = "body-force"
acceleration = {y = -9.81}
[[boundary]]
type = "clamp"
where = "b"
""",
]


def fuzzed(chance: random.Random) -> bytes:
    """A scene file that somebody or something has spoilt."""
    text = chance.choice(SCENES)
    if chance.random() < 0.25:
        return _scrambled(text.encode(), chance)
    table = tomllib.loads(text)
    if chance.random() < 0.4:
        for _ in range(chance.choice((1, 2, 4))):
            _nudge(table, chance)
        return tomli_w.dumps(table).encode()
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        _spoil(table, chance)
    try:
        written = tomli_w.dumps(table).encode("utf-8", errors="surrogatepass")
    except (TypeError, ValueError, RecursionError):
        return _scrambled(text.encode(), chance)
    return _scrambled(written, chance) if chance.random() < 0.05 else written


def _scrambled(data: bytes, chance: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(chance.choice((1, 2, 5, 40))):
        place = chance.randrange(len(changed) + 1)
        kind = chance.random()
        if kind < 0.4 and place < len(changed):
            changed[place] = chance.randrange(256)
        elif kind < 0.6:
            del changed[place : place + chance.choice((1, 3, 50))]
        elif kind < 0.8:
            changed[place:place] = bytes(chance.randrange(256) for _ in range(3))
        else:
            start = chance.randrange(len(data))
            changed[place:place] = data[start : start + 60]
    return bytes(changed)


def _nudge(table: dict[str, Any], chance: random.Random) -> None:
    """A change that may well be right."""
    numbers = [(h, k) for h, k in _places(table) if isinstance(h[k], float)]
    types = [(h, k) for h, k in _places(table) if isinstance(h[k], str)]
    if chance.random() < 0.7:
        holder, key = chance.choice(numbers)
        holder[key] *= chance.uniform(0.3, 3.0)
    else:
        holder, key = chance.choice(types)
        holder[key] = chance.choice(PARTS)


def _spoil(table: dict[str, Any], chance: random.Random) -> None:
    places = list(_places(table))
    holder, key = chance.choice(places)
    kind = chance.random()
    if kind < 0.15:
        del holder[key]
    elif kind < 0.3 and isinstance(holder, dict):
        holder[chance.choice(WORDS)] = deepcopy(chance.choice([*VALUES, *PARTS]))
    elif kind < 0.4 and isinstance(holder, dict):
        holder[chance.choice(WORDS)] = holder.pop(key)
    elif kind < 0.55:
        other, place = chance.choice(places)
        if place in other if isinstance(other, dict) else place < len(other):
            # By value, since a table within itself is no TOML.
            holder[key] = tomllib.loads(tomli_w.dumps({"value": other[place]}))["value"]
    elif kind < 0.75:
        holder[key] = chance.choice(PARTS)
    elif isinstance(holder[key], float) and kind < 0.9:
        holder[key] *= chance.choice((-1.0, 1e-9, 1e-3, 0.1, 3.0, 1e3, 1e9))
    else:
        holder[key] = deepcopy(chance.choice(VALUES))


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every holder and key in a table, at any depth."""
    items = (
        value.items() if isinstance(value, dict)
        else enumerate(value) if isinstance(value, list) else ()
    )  # fmt: skip
    for key, one in list(items):
        yield value, key
        yield from _places(one)


class HangError(BaseException):
    """Something took much longer than it should; it is nothing that a part may handle."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """HangError if the block takes longer."""

    def late(number: int, frame: object) -> None:
        raise HangError

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def tried(data: bytes, seconds: float) -> str:
    """What becomes of a scene: "built", "refused", or what else happened."""
    try:
        with within(seconds):
            text = data.decode("utf-8")
            scene = Scene.from_toml(text)
            Simulation.builder(scene).build()
    except UnicodeDecodeError:
        return "refused"  # Scene.read says so
    except SolidsphError as cause:
        message = str(cause)
        return "refused" if message and "failed: " not in message else f"FAULT {message}"
    except BaseException as cause:
        return f"{type(cause).__name__}: {cause}"
    return "built"


def campaign(
    count: int, seed: int, seconds: float, heard: Callable[[bytes, str], None]
) -> dict[str, int]:
    """Try so many scenes; `heard` is told of all that were neither built nor refused."""
    chance = random.Random(seed)
    counts = {"built": 0, "refused": 0, "other": 0}
    for _ in range(count):
        data = fuzzed(chance)
        told = tried(data, seconds)
        counts[told if told in counts else "other"] += 1
        if told not in counts:
            heard(data, told)
    return counts
