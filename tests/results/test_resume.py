"""A run that is stopped at any moment goes on as if nothing had happened, to the last bit."""

from __future__ import annotations

import errno
import hashlib
import importlib
import io
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import attrs
import numpy as np
import pytest

from solidsph import (
    DivergedError,
    Record,
    RecordError,
    Scene,
    Simulation,
    SolidsphError,
    State,
    resume,
)
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.results import checkpointer
from solidsph.results.checkpoint import checkpoint_path, read_checkpoint, write_checkpoint
from solidsph.resumption import pending
from solidsph.run.hooks import implementation
from solidsph.scene.scene_builder import SceneBuilder
from tests.commands.test_cli import solidsph
from tests.helpers.resuming import NEVER, OFTEN, Stop, assert_same_record, content
from tests.helpers.scenes import REFERENCE_ONLY, SCENE_TOML, box, with_effect
from tests.helpers.waiting import HANG

SOLIDSPH = str(Path(sys.executable).with_name("solidsph"))
OUTPUTS = 4

# Bodies with what each kind of boundary needs. A new kind needs a line here.
GHOSTS = {"type": "lattice", "on_boundary": True, "ghosts": 3}


def _plain() -> SceneBuilder:
    # The plain divergence has no energy near a surface: these runs are not sound, but repeatable.
    builder = box(1, 12, discretisation=GHOSTS).energy_tolerance("off")
    return builder.formulation("total-lagrangian", divergence="plain")


def _dirichlet(kind: str) -> SceneBuilder:
    moved = {"x": "0.01*sin(500*t)"}
    return (
        _plain()
        .boundary(kind, where="left", displacement=moved, ghosts="left-ghosts")
        .boundary("ghost-extension", where="right-ghosts")
    )


BOUNDARIES: Mapping[str, Callable[[], SceneBuilder]] = {
    "clamp": lambda: box(2).boundary("clamp", where="left"),
    # A jump of the velocity by two thirds of the wave speed, which a few steps resolve to 2 %.
    "prescribed-motion": lambda: (
        box(2)
        .energy_tolerance(0.05)
        .boundary("prescribed-motion", where="left", displacement={"x": "0.05*sin(500*t)"})
    ),
    "pressure": lambda: box(2).boundary("pressure", where="right", pressure="1e4*t"),
    "traction": lambda: box(2).boundary("traction", where="right", traction={"y": "1e4*t"}),
    "symmetry": lambda: box(2, 8, discretisation={**GHOSTS, "ghost_faces": ["left"]}).boundary(
        "symmetry", axis="x"
    ),
    "ghost-extension": lambda: _plain().boundary("ghost-extension"),
    "exact-dirichlet": lambda: _dirichlet("exact-dirichlet"),
    "full-dirichlet": lambda: _dirichlet("full-dirichlet"),
    "literal-dirichlet": lambda: _dirichlet("literal-dirichlet"),
    "approximate-neumann": lambda: (
        _plain()
        .boundary("ghost-extension")
        .boundary("approximate-neumann", where="left", traction={"x": "1e4*sin(500*t)"})
    ),
}


@pytest.fixture(autouse=True)
def _not_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """A checkpoint where a run is stopped, and none because it takes long."""
    monkeypatch.setattr(checkpointer, "SHARE", NEVER)


@pytest.fixture
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """A checkpoint at every output, whatever it costs."""
    monkeypatch.setattr(checkpointer, "SHARE", OFTEN)


def moving(builder: SceneBuilder) -> SceneBuilder:
    # Steps short enough for jumps: the residual that they leave falls with the square of the step.
    builder = builder.integrator("velocity-verlet", time_step_factor=0.5)
    return builder.initial(velocity={"x": "3*sin(2*X)"}).outputs(OUTPUTS)


# Outputs at which a run is stopped, and whether the checkpoint of that output is kept.
BRIEFLY = ((2, True), (3, False))
EVERYWHERE = ((1, False), (2, True), (3, True), (3, False), (4, True))
at_outputs = pytest.mark.parametrize(
    "stops",
    [
        pytest.param(BRIEFLY, id="briefly"),
        pytest.param(EVERYWHERE, id="everywhere", marks=pytest.mark.validation),
    ],
)


def assert_goes_on(
    builder: SceneBuilder,
    folder: Path,
    stops: Sequence[tuple[int, bool]] = EVERYWHERE,
    *,
    simulation: bool = True,
) -> None:
    """Stopped at each of these outputs, with and without the checkpoint of that output."""
    whole, path = folder / "whole.h5", folder / "stopped.h5"
    made = builder.build()
    made.run(record=whole)
    with Record(whole) as record:
        assert record.count == OUTPUTS + 1
        # Something happens, or the same bits would say nothing.
        assert len(np.unique(record.history["kinetic energy [J]"])) == OUTPUTS + 1
    for output, kept in stops:
        with pytest.raises(KeyboardInterrupt):
            made.run(record=path, observers=[Stop(output)])
        with Record(path) as record:
            assert record.outcome == "interrupted"
            assert record.count == output
        # What stops the run at an output keeps its state from being a checkpoint.
        assert checkpoint_path(path).exists() == (output > 1)
        if not kept:
            checkpoint_path(path).unlink(missing_ok=True)
        resume(path, simulation=made if simulation else None)
        assert_same_record(whole, path)


@pytest.mark.usefixtures("often")
@at_outputs
@pytest.mark.parametrize("formulation", registry.names("formulations"))
@pytest.mark.parametrize(
    "gradient",
    [
        # A gradient has no state of its own.
        pytest.param(name, marks=() if name == "corrected" else pytest.mark.validation)
        for name in registry.names("gradients")
    ],
)
def test_every_formulation(
    tmp_path: Path, stops: Sequence[tuple[int, bool]], formulation: str, gradient: str
) -> None:
    if formulation != "total-lagrangian" and gradient in REFERENCE_ONLY:
        pytest.skip("the gradient is refused in this form")
    builder = box(2).formulation(formulation, gradient=gradient).energy_tolerance("off")
    assert_goes_on(moving(builder), tmp_path, stops)


@pytest.mark.usefixtures("often")
@at_outputs
@pytest.mark.parametrize("integrator", registry.names("integrators"))
def test_every_integrator(
    tmp_path: Path, stops: Sequence[tuple[int, bool]], integrator: str
) -> None:
    builder = box(2).boundary("clamp", where="left").integrator(integrator)
    assert_goes_on(moving(builder), tmp_path, stops)


@pytest.mark.usefixtures("often")
@at_outputs
@pytest.mark.parametrize("effect", registry.names("effects"))
def test_every_effect(tmp_path: Path, stops: Sequence[tuple[int, bool]], effect: str) -> None:
    assert_goes_on(moving(with_effect(effect, 2)), tmp_path, stops)


def test_every_boundary_has_a_scene() -> None:
    assert set(BOUNDARIES) == set(registry.names("boundaries"))


@pytest.mark.usefixtures("often")
@at_outputs
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_every_boundary(tmp_path: Path, stops: Sequence[tuple[int, bool]], boundary: str) -> None:
    assert_goes_on(moving(BOUNDARIES[boundary]()), tmp_path, stops)


@pytest.mark.usefixtures("often")
@at_outputs
@pytest.mark.parametrize("d", [1, pytest.param(2, marks=pytest.mark.validation)])
@pytest.mark.parametrize("form", registry.names("formulations"))
@pytest.mark.parametrize(
    "engine", ["compiled", pytest.param("compiled-float32", marks=pytest.mark.validation)]
)
def test_every_engine(
    tmp_path: Path, stops: Sequence[tuple[int, bool]], engine: str, form: str, d: int
) -> None:
    """The compiled loop too, whose forces of ghosts are found anew from a state."""
    ghosts = {**GHOSTS, "ghost_faces": ["left"]}
    builder = box(d, 8, discretisation=ghosts).formulation(form).boundary("symmetry", axis="x")
    assert_goes_on(
        moving(builder.effect("mass-damping", rate=20.0).engine(engine)), tmp_path, stops
    )


@pytest.mark.usefixtures("often")
def test_the_scene_is_built_from_the_record(tmp_path: Path) -> None:
    scene = Scene.from_toml(SCENE_TOML)
    assert_goes_on(Simulation.builder(scene).outputs(OUTPUTS), tmp_path, simulation=False)


def test_an_equilibrium_goes_on(tmp_path: Path) -> None:
    builder = (
        box(2)
        .boundary("clamp", where="left")
        .boundary("traction", where="right", traction={"y": 1e4})
        .statics(load_steps=3)
    )
    whole, path = tmp_path / "whole.h5", tmp_path / "stopped.h5"
    from solidsph import solve

    solve(builder.build(), record=whole)
    with pytest.raises(KeyboardInterrupt):
        solve(builder.build(), record=path, observers=[Stop(2)])
    resume(path)
    assert_same_record(whole, path)


# Listeners


class Counter:
    """A listener with a state of its own."""

    def __init__(self) -> None:
        self.energies: list[float] = []

    @implementation
    def solidsph_step_end(self, simulation, observation) -> None:
        self.energies.append(float(observation.energy_densities.sum()))

    @implementation
    def solidsph_keep(self, simulation, kept) -> None:
        kept["counter energies"] = np.array(self.energies)

    @implementation
    def solidsph_resume(self, simulation, observation, kept) -> None:
        self.energies = kept["counter energies"].tolist()


@pytest.mark.usefixtures("often")
def test_a_listener_gets_back_what_it_kept(tmp_path: Path) -> None:
    simulation = moving(box(2)).build()
    whole, first, second = Counter(), Counter(), Counter()
    simulation.run(record=tmp_path / "whole.h5", observers=[whole])
    with pytest.raises(KeyboardInterrupt):
        # The stop is heard first, so that the output it falls on is the first to be made up for.
        simulation.run(record=tmp_path / "run.h5", observers=[first, Stop(3)])
    resume(tmp_path / "run.h5", simulation=simulation, observers=[second])
    assert second.energies == whole.energies
    assert len(second.energies) == OUTPUTS + 1


# Longer than it was asked for


@pytest.mark.usefixtures("often")
def test_an_extended_run_is_one_that_was_never_stopped(tmp_path: Path) -> None:
    short = moving(box(2)).integrator("velocity-verlet", time_step=2.5e-4).build()
    # Powers of two: both have the same step to the bit.
    short, long = (
        moving(box(2)).integrator("velocity-verlet", time_step=2.0**-12).duration(T).outputs(k)
        .build()
        for T, k in ((2.0**-7, 4), (2.0**-6, 8))
    )  # fmt: skip
    assert short.step_size == long.step_size == 2.0**-12
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    long.run(record=whole)
    short.run(record=path)
    resume(path, simulation=short, until=2.0**-6)
    a, b = content(whole), content(path)
    assert b.pop("solidsph@notes").rstrip(b"\0") == b"extended to t = 0.015625 s"
    assert [name for name in a if a[name] != b[name]] == ["solidsph@digest", "solidsph/scene"]
    # And stopped in its extension.
    short.run(record=path)
    with pytest.raises(KeyboardInterrupt):
        resume(path, simulation=short, until=2.0**-6, observers=[Stop(2)])
    resume(path, simulation=short)
    c = content(path)
    assert [name for name in b if b[name] != c[name]] == []


def test_a_finished_run_says_so(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    simulation = moving(box(1)).build()
    simulation.run(record=path)
    assert pending(path, simulation=simulation) is None
    with pytest.raises(RecordError, match="is over; give `until`"):
        resume(path)
    with pytest.raises(RecordError, match=r"until = 0\.001 s is before the end"):
        resume(path, until=1e-3)


# What does not fit


def stopped(path: Path, builder: SceneBuilder | None = None) -> Simulation:
    """A run that was stopped at its third output, with its record and its checkpoint."""
    if builder is None:
        simulation, record, checkpoint = _stopped_bar()
        path.write_bytes(record)
        checkpoint_path(path).write_bytes(checkpoint)
        return simulation
    simulation = builder.build()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(record=path, observers=[Stop(3)])
    return simulation


@cache
def _stopped_bar() -> tuple[Simulation, bytes, bytes]:
    """Run once: many tests start from what it leaves."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        simulation = stopped(path, moving(box(1)))
        return simulation, path.read_bytes(), checkpoint_path(path).read_bytes()


def assert_refused(path: Path, message: str, unchanged: bool = True, **others: object) -> None:
    before = path.read_bytes()
    with pytest.raises(RecordError, match=message) as caught:
        resume(path, **others)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == before or not unchanged


@pytest.mark.parametrize("kept", [True, False])
def test_other_versions_and_plugins_are_refused_unless_forced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: bool
) -> None:
    path = tmp_path / "run.h5"
    simulation = stopped(path)
    if not kept:
        checkpoint_path(path).unlink()
    from solidsph.results import environment

    real = environment.metadata.version
    monkeypatch.setattr(
        environment.metadata, "version", lambda name: "0.0.1" if name == "scipy" else real(name)
    )
    monkeypatch.setattr(
        registry,
        "_entries",
        lambda *key, real=registry._entries: tuple(_renamed(entry) for entry in real(*key)),
    )
    assert_refused(
        path, r"scipy was .*, is 0\.0\.1; .*kernel modified-mollifier was .*is solidsph 9\.9"
    )
    resume(path, force=True)
    monkeypatch.undo()
    simulation.run(record=tmp_path / "whole.h5")
    # The versions are the record's own; nothing that was computed differs.
    a, b = content(tmp_path / "whole.h5"), content(path)
    assert {name for name in a if a[name] != b[name]} <= {
        *("solidsph/plugins", "solidsph/versions", "solidsph@digest")
    }


def _renamed(entry: registry.Entry) -> registry.Entry:
    import attrs

    return attrs.evolve(entry, version="9.9") if entry.name == "modified-mollifier" else entry


def test_another_scene_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    stopped(path)
    assert_refused(path, "of another scene", simulation=moving(box(1, 8)).build())


def test_a_scene_of_objects_needs_the_objects(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    builder = moving(box(1)).effect("body-force", acceleration={"x": lambda X, t: X[:, 0] + t})
    simulation = stopped(path, builder)
    assert_refused(path, "composed of Python objects")
    resume(path, simulation=simulation)
    simulation.run(record=tmp_path / "whole.h5")
    assert_same_record(tmp_path / "whole.h5", path)


def test_a_run_that_does_not_repeat_its_record_is_stopped(tmp_path: Path) -> None:
    """A condition in which something changes that no state holds."""
    path, strength = tmp_path / "run.h5", {"now": 1.0}
    builder = moving(box(1)).effect(
        "body-force", acceleration={"x": lambda X, t: strength["now"] + 0.0 * X[:, 0]}
    )
    simulation = stopped(path, builder)
    checkpoint_path(path).unlink()
    with Record(path) as record:
        before = record.positions[:]
    strength["now"] = 2.0
    with pytest.raises(RecordError, match=r"does not repeat its record .* force it"):
        resume(path, simulation=simulation)
    with Record(path) as record:
        np.testing.assert_array_equal(record.positions[:], before)
    resume(path, simulation=simulation, force=True)
    with Record(path) as record:
        np.testing.assert_array_equal(record.positions[: len(before)], before)
        assert record.count == OUTPUTS + 1


def test_a_diverged_run_diverges_again(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    builder = (
        box(1, 20)
        .boundary("prescribed-motion", where="left", displacement={"x": "200*t"})
        .boundary("clamp", where="right")
        .duration(0.05)
        .outputs(50)
    )
    errors = []
    for run in (lambda: builder.build().run(record=path), lambda: resume(path)):
        with pytest.raises(DivergedError) as caught:
            run()
        errors.append(str(caught.value))
    assert errors[0] == errors[1]


# Damaged checkpoints


def test_every_damage_of_a_checkpoint_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    stopped(path)
    file = checkpoint_path(path)
    data, recorded = file.read_bytes(), path.read_bytes()
    read_checkpoint(file)
    random = np.random.default_rng(0)
    broken = [data[:size] for size in (*range(120), len(data) // 2, len(data) - 1)]
    for place in random.integers(0, len(data), size=150):
        other = bytearray(data)
        other[place] ^= int(random.integers(1, 256))
        broken.append(bytes(other))
    for damaged in broken:
        file.write_bytes(damaged)
        with pytest.raises(RecordError, match="checkpoint"):
            read_checkpoint(file)
    assert_refused(path, "checkpoint .* is damaged; delete it")
    file.write_bytes(data.replace(b"checkpoint 1 ", b"checkpoint 2 ", 1))
    assert_refused(path, "has format 2, this solidsph reads 1; update")
    file.write_bytes(data.replace(b"checkpoint 1 ", b"checkpoint 0 ", 1))
    assert_refused(path, "has format 0, this solidsph reads 1; delete it")
    file.unlink()
    resume(path)
    with Record(path) as record:
        assert record.count == OUTPUTS + 1
    assert recorded != path.read_bytes()


def test_a_checkpoint_of_another_run_is_refused(tmp_path: Path) -> None:
    path, other = tmp_path / "run.h5", tmp_path / "other.h5"
    stopped(path)
    stopped(other, moving(box(1, 9)))
    checkpoint_path(other).replace(checkpoint_path(path))
    assert_refused(path, "of another scene than the record")


def test_a_new_run_takes_the_place_of_the_old(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    stopped(path)
    old = read_checkpoint(checkpoint_path(path))
    moving(box(1)).build().run(record=path)
    assert read_checkpoint(checkpoint_path(path)).state.step > old.state.step


class Ticking:
    """A clock by which outputs are a second apart and writing a checkpoint takes an eighth."""

    def __init__(self) -> None:
        self.now, self.outputs = 0.0, 0
        self.written_at: list[int] = []

    def perf_counter(self) -> float:
        return self.now

    @implementation
    def solidsph_step_end(self, simulation, observation) -> None:
        self.now += 1.0
        self.outputs += 1

    def write(self, path, checkpoint) -> None:
        self.now += 0.125
        self.written_at.append(self.outputs)


def test_checkpoints_take_a_hundredth_of_the_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Ticking()
    monkeypatch.undo()  # the share that checkpoints have
    monkeypatch.setattr(checkpointer, "clock", clock)
    monkeypatch.setattr(checkpointer, "write_checkpoint", clock.write)
    simulation = moving(box(1)).duration(0.1).outputs(40).build()
    simulation.run(record=tmp_path / "run.h5", observers=[clock])
    assert clock.outputs == 41
    # Writing is thought to take 0.02 s, so the first comes after 2 s; the others after 12.5 s, and
    # the last at the end, from which `--until` goes on.
    assert clock.written_at == [3, 16, 29, 41]


# What the record does not hold


def points_scene(folder: Path, offset: float = 0.0) -> str:
    """Points in a file that the scene names from its folder; cells of a lattice, a little aside."""
    x = (np.arange(12) + 0.5) / 12
    points = np.array([(a, b) for a in x for b in x[:6]])
    points[7, 0] += offset
    folder.mkdir(exist_ok=True)
    np.savetxt(folder / "points.csv", points, delimiter=",", fmt="%.17g")
    return """
duration = 0.01
outputs = 4
[body.plate]
shape = {type = "box", lengths = [1.0, 0.5]}
spacing = 0.0833
discretisation = {type = "points", file = "points.csv"}
[material]
type = "neo-hookean"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
[[initial]]
velocity = {x = "3*sin(2*X)"}
"""


def stopped_at_points(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    text = points_scene(folder)
    monkeypatch.chdir(folder)
    path = folder / "out" / "run.h5"
    with pytest.raises(KeyboardInterrupt):
        Simulation.builder(Scene.from_toml(text)).build().run(record=path, observers=[Stop(3)])
    return path


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize(
    ("change", "difference"),
    [
        ("moved", r"positions differ for 1 of 72, first for 7: \[.*\] in the record, \[.*\] now"),
        ("fewer", "72 particles were recorded, now there are 71"),
        ("in another order", "positions differ for 72 of 72"),
        ("gone", "points.csv"),
    ],
)
def test_other_points_in_the_file_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str, difference: str, force: bool
) -> None:
    """The positions of the record belong to the points that it was begun with: forced or not."""
    path = stopped_at_points(tmp_path / "work", monkeypatch)
    file = tmp_path / "work" / "points.csv"
    lines = file.read_text().splitlines()
    if change == "moved":
        points_scene(tmp_path / "work", offset=1e-3)
    elif change == "gone":
        file.unlink()
    else:
        file.write_text("\n".join(lines[:-1] if change == "fewer" else lines[::-1]))
    before = path.read_bytes()
    with pytest.raises(SolidsphError, match=difference) as caught:
        resume(path, force=force)
    assert "points.csv" in str(caught.value)
    assert path.read_bytes() == before


def test_a_relative_path_is_the_one_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From another folder, even one with another file of that name."""
    path = stopped_at_points(tmp_path / "work", monkeypatch)
    text = points_scene(tmp_path / "other", offset=1e-3)
    monkeypatch.chdir(tmp_path / "other")
    resume(path)
    monkeypatch.chdir(tmp_path / "work")
    Simulation.builder(Scene.from_toml(text)).build().run(record=tmp_path / "whole.h5")
    assert_same_record(tmp_path / "whole.h5", path)


def test_other_particles_of_an_object_are_refused(tmp_path: Path) -> None:
    """An object has no form that could be compared with the record's; its particles have."""
    shape = {"type": "interval", "length": 1.0}

    def scene(positions: list[float]) -> Simulation:
        points = {"type": "points", "positions": [[x] for x in positions]}
        builder = Simulation.builder().body(
            "bar", shape=shape, spacing=0.25, discretisation=construct("discretisations", points)
        )
        builder.material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1e3)
        builder.kernel("modified-mollifier", cover=3.0).initial(velocity={"x": "X"})
        builder.effect("body-force", acceleration={"x": lambda X, t: X[:, 0]})
        return builder.duration(0.01).outputs(4).build()

    path = tmp_path / "run.h5"
    with pytest.raises(KeyboardInterrupt):
        scene([0.125, 0.375, 0.625, 0.875]).run(record=path, observers=[Stop(3)])
    assert_refused(
        path, "scene no longer gives the part|of another scene",
        simulation=scene([0.125, 0.375, 0.625, 0.880]),
    )  # fmt: skip


def test_a_material_that_answers_otherwise_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its code has changed, and its version has not: what was recorded tells."""
    path = tmp_path / "run.h5"
    stopped(path)
    kind = registry.load("materials", "neo-hookean")
    law = kind.first_piola
    monkeypatch.setattr(
        kind, "first_piola", staticmethod(lambda F, p: law(F, (1.001 * p[0], p[1])))
    )
    assert_refused(path, "gives other stresses than were recorded")
    resume(path, force=True)


@pytest.mark.parametrize("changed", ["spring.py", "_law.py", "laws/deep.py"])
def test_code_that_changed_under_one_version_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changed: str
) -> None:
    """In the module of a part, or in one that it calls."""
    package = tmp_path / "springs_of_mine"
    (package / "laws").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "_law.py").write_text("FACTOR = 1.0\n")
    (package / "laws" / "deep.py").write_text("FACTOR = 1.0\n")
    (package / "spring.py").write_text(
        "from solidsph_builtin.integrators.velocity_verlet import VelocityVerlet\n"
        "class Mine(VelocityVerlet):\n    pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    for name in [one for one in sys.modules if one.startswith("springs_of_mine")]:
        monkeypatch.delitem(sys.modules, name)
    mine = importlib.import_module("springs_of_mine.spring").Mine()
    path = tmp_path / "run.h5"
    own = stopped(path, box(1, 12).initial(velocity={"x": "3*sin(2*X)"}).integrator(mine))
    with (package / changed).open("a") as file:
        file.write("# changed\n")
    assert_refused(path, r"code of springs_of_mine was \w+, is \w+", simulation=own)
    resume(path, force=True, simulation=own)


# From the end


@pytest.mark.parametrize("kept", [True, False])
def test_a_finished_run_is_extended_from_its_end(tmp_path: Path, kept: bool) -> None:
    """A run of any length leaves a checkpoint of its end; without one all is repeated."""
    path, heard = tmp_path / "run.h5", Heard()
    moving(box(1)).build().run(record=path)
    if not kept:
        checkpoint_path(path).unlink()
    found = pending(path, until=0.02)
    assert (found.since.state is not None) == kept
    assert not kept or found.since.state.time == pytest.approx(0.01, rel=1e-9)
    found.solve([heard])
    with Record(path) as record:
        assert record.count == 2 * OUTPUTS + 1
        assert record.times[-1] >= 0.02 * (1.0 - 1e-6)
        assert len(heard.times) == (OUTPUTS if kept else record.count)
        assert heard.times[-1] == record.times[-1]


class Heard:
    """The times of all outputs."""

    def __init__(self) -> None:
        self.times: list[float] = []

    @implementation
    def solidsph_step_end(self, simulation, observation) -> None:
        self.times.append(observation.state.time)


def test_an_interrupted_run_is_extended_from_where_it_was(tmp_path: Path) -> None:
    path, heard = tmp_path / "run.h5", Heard()
    stopped(path)
    resume(path, until=0.02, observers=[heard])
    with Record(path) as record:
        assert record.count == 2 * OUTPUTS + 1
        assert heard.times == record.times[2:].tolist()
    resume(path, until=0.03, observers=[heard])
    assert len(set(heard.times)) == len(heard.times)


def test_an_end_that_never_comes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    stopped(path)
    for until in (1e30, 1e12):
        assert_refused(path, "steps away, at most 1e.10 are allowed", until=until)


# Checkpoints that are whole, and not what a run has left


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"positions": lambda x: x[:-1]}, "damaged"),
        ({"positions": lambda x: x.astype(np.float32)}, "damaged"),
        ({"velocities": lambda v: np.full_like(v, np.nan)}, "damaged"),
        ({"accelerations": lambda a: a[:, 0]}, "damaged"),
        ({"applied": lambda a: {"mine": np.zeros((12, 1))}}, "another scene|damaged"),
        ({"work": lambda w: {"mine": 1.0}}, "another scene"),
        ({"work": lambda w: dict.fromkeys(w or {"mine": 0}, "much")}, "damaged"),
        ({"time": lambda t: "soon"}, "damaged"),
        ({"step": lambda n: -1}, "damaged"),
        ({"step": lambda n: 10**9}, "damaged"),
        ({"memory": lambda m: {"mine": np.array(["text"])}}, "damaged"),
        ({"positions": lambda x: x + 1e-9}, "is not its output at t"),
        ({"velocities": lambda v: v * (1.0 + 1e-12)}, "is not its output at t"),
        ({"steps": lambda n: 10**18}, "damaged"),
        ({"halvings": lambda n: 10**9}, "damaged"),
        ({"step_size": lambda h: 0.0}, "damaged"),
        ({"environment": lambda e: {"numpy": 3}}, "damaged"),
        *(
            ({"kept": lambda k, name=name, wrong=wrong: {**k, name: wrong}}, "delete it and resume")
            for name in ("soundness", "soundness rises")
            for wrong in (np.array(1.0), np.empty(0), np.ones((1, 4)), np.ones((2, 2, 2)))
        ),
        ({"kept": lambda k: {"soundness": k["soundness"]}}, "how the energy residual"),
    ],
)
def test_a_forged_checkpoint_is_refused(
    tmp_path: Path, changes: Mapping[str, Callable[[object], object]], message: str
) -> None:
    """Its digest is right: somebody has written it so."""
    path = tmp_path / "run.h5"
    stopped(path)
    whole = read_checkpoint(checkpoint_path(path))
    of_state = {field.name for field in attrs.fields(State)}
    for name, change in changes.items():
        holder = whole.state if name in of_state else whole
        changed = attrs.evolve(holder, **{name: change(getattr(holder, name))})
        whole = attrs.evolve(whole, state=changed) if name in of_state else changed
    write_checkpoint(checkpoint_path(path), whole)
    assert_refused(path, message)


def test_a_checkpoint_that_claims_to_be_large_is_refused(tmp_path: Path) -> None:
    """Zeros compress a thousandfold; what a run leaves is not compressed."""
    path = tmp_path / "run.h5"
    stopped(path)
    packed = io.BytesIO()
    np.savez_compressed(packed, facts=np.zeros(10**7, dtype=np.uint8))
    body = packed.getvalue()
    digest = hashlib.blake2b(body, digest_size=32).hexdigest()
    checkpoint_path(path).write_bytes(f"solidsph checkpoint 1 {digest}\n".encode() + body)
    assert_refused(path, "damaged.*claims more bytes")


def test_a_checkpoint_that_is_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    stopped(path)
    checkpoint_path(path).unlink()
    os.mkfifo(checkpoint_path(path))
    assert_refused(path, "it is a pipe, not a regular file")


# Devices that fail

FULL = """
import resource, signal, sys
sys.path.insert(0, {root!r})
from pathlib import Path
from solidsph import RecordError, resume
from solidsph.results import checkpointer
from tests.helpers.resuming import killed_scene
checkpointer.SHARE = {share}
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, resource.RLIM_INFINITY))
try:
    killed_scene().outputs(40).build().run(record=Path({path!r}))
except RecordError as error:
    print(error)
"""


FULL_AGAIN = """
import resource, signal, sys
sys.path.insert(0, {root!r})
from solidsph import RecordError, resume
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, resource.RLIM_INFINITY))
try:
    resume({path!r})
except RecordError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ("limit", "share"),
    [
        pytest.param(900_000, NEVER, marks=pytest.mark.validation),
        (900_000, OFTEN),
        (200_000, NEVER),
    ],
)
def test_what_a_full_disk_stops_goes_on(tmp_path: Path, limit: int, share: float) -> None:
    """Amid the outputs, with and without a checkpoint; and before the first of them."""
    from tests.helpers.resuming import killed_scene

    path, root = tmp_path / "run.h5", str(Path(__file__).parents[2])
    code = FULL.format(root=root, path=str(path), limit=limit, share=share)
    child = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=HANG
    )
    assert (child.returncode, child.stderr) == (0, "")
    assert re.fullmatch(r"cannot (write|create) .*File too large.*\n", child.stdout)
    assert path.exists() == (limit > 300_000)
    if path.exists():
        with Record(path) as record:
            assert 5 <= record.count <= 40
        resume(path)
        killed_scene().outputs(40).build().run(record=tmp_path / "whole.h5")
        assert_same_record(tmp_path / "whole.h5", path)
    assert not list(tmp_path.glob("*.partial"))


def test_a_full_disk_while_a_record_is_taken_over(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    simulation = stopped(path, moving(box(2, 10)))
    before, checkpoint = path.read_bytes(), checkpoint_path(path).read_bytes()
    root = str(Path(__file__).parents[2])
    code = FULL_AGAIN.format(root=root, path=str(path), limit=len(before) // 2)
    child = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=HANG
    )
    assert (child.returncode, child.stderr) == (0, "")
    assert re.fullmatch(r"cannot .*File too large.*\n", child.stdout)
    assert path.read_bytes() == before
    assert checkpoint_path(path).read_bytes() == checkpoint
    assert not list(tmp_path.glob("*.partial"))
    resume(path, simulation=simulation)


def test_a_checkpoint_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.h5"
    simulation = stopped(path)
    checkpoint = checkpoint_path(path).read_bytes()

    def full(number: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert_refused(path, "cannot write the checkpoint .*: No space left", unchanged=False)
    assert checkpoint_path(path).read_bytes() == checkpoint
    assert not list(tmp_path.glob("*.partial"))
    resume(path)
    simulation.run(record=tmp_path / "whole.h5")
    assert_same_record(tmp_path / "whole.h5", path)


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(RecordError, match=r"cannot create .*choose"):
        moving(box(1)).build().run(record=tmp_path / "file" / "run.h5")
    assert (tmp_path / "file").read_text() == "in the way"


# The command, interrupted and killed


def command(*words: str, **others: object) -> subprocess.Popen[str]:
    return started([SOLIDSPH, *words], **others)


def started(words: Sequence[str], **others: object) -> subprocess.Popen[str]:
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen(words, text=True, **pipes, **others)


def scene_file(folder: Path, outputs: int = 60) -> Path:
    path = folder / "scene.toml"
    text = SCENE_TOML.replace("outputs = 5", f"outputs = {outputs}")
    path.write_text(text.replace("duration = 0.01", "duration = 0.1"))
    return path


# The command, which at an output says so and stays there until it is stopped.
HELD = """
import sys
from solidsph.cli import main
from solidsph.results.record_writer import RecordWriter
append, left = RecordWriter.append, [{outputs}]
def held(self, *values):
    append(self, *values)
    left[0] -= 1
    if left[0] == 0:
        print("held", flush=True)
        sys.stdin.read()
RecordWriter.append = held
main()
"""


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGTERM,
        *(
            pytest.param(one, marks=pytest.mark.validation)
            for one in (signal.SIGINT, signal.SIGKILL)
        ),
    ],
)
def test_a_command_that_is_stopped_can_be_resumed(tmp_path: Path, number: signal.Signals) -> None:
    folder, scene = tmp_path / "out", scene_file(tmp_path)
    held = [sys.executable, "-c", HELD.format(outputs=20), "run", str(scene), "--quiet"]
    with started([*held, "--output", str(folder)]) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        process.send_signal(number)
        _, errors = process.communicate(timeout=HANG)
    if number is signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == 130
        last = errors.strip().splitlines()[-1]  # warnings of the scene may come before
        assert last.startswith("interrupted; the outputs so far are readable")
        assert "Traceback" not in errors
    with Record(folder / "record.h5") as record:
        assert record.outcome == ("running" if number is signal.SIGKILL else "interrupted")
        assert record.count == 20
        assert (folder / "record.checkpoint").exists() or number is signal.SIGKILL
    with command("resume", str(folder), "--json") as process:
        text, errors = process.communicate(timeout=HANG)
    assert (process.returncode, errors) == (0, "")
    (run,) = json.loads(text)["runs"]
    assert run["outcome"] == "finished"
    Simulation.builder(Scene.read(scene)).build().run(record=tmp_path / "whole.h5")
    assert_same_record(tmp_path / "whole.h5", folder / "record.h5")
    again = solidsph("resume", str(folder), cwd=tmp_path)
    assert again.returncode == 0
    assert "is finished; --until T extends it" in again.stdout


@pytest.mark.parametrize("target", ["missing.h5", "empty", "scene.toml"])
def test_what_cannot_be_resumed_is_one_message(tmp_path: Path, target: str) -> None:
    (tmp_path / "empty").mkdir()
    scene_file(tmp_path)
    done = solidsph("resume", target, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert len(done.stderr.splitlines()) == 1


def killing(folder: Path, count: int, seed: int) -> None:
    script = Path(__file__).parents[1] / "helpers/resuming.py"
    child = subprocess.run(
        [sys.executable, str(script), str(folder), str(count), str(seed)],
        capture_output=True,
        text=True,
        check=False,
        timeout=HANG,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert (child.returncode, child.stderr) == (0, "")
    print(child.stdout)
    told = re.fullmatch(r"kills (\d+) runs (\d+) lost (\d+) seconds.*\n", child.stdout)
    assert told, child.stdout
    assert int(told[1]) >= count
    assert int(told[3]) == 0


def test_killed_at_random_moments(tmp_path: Path) -> None:
    killing(tmp_path, 4, seed=1)


@pytest.mark.validation
def test_killed_two_hundred_times(tmp_path: Path) -> None:
    killing(tmp_path, 200, seed=2)
