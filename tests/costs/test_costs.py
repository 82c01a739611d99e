"""What a run costs: counted by hand, estimated, priced, predicted and scored."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from itertools import count
from math import inf, pi
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from solidsph import Simulation
from solidsph.commands import prediction as predictions
from solidsph.costs import calibration, microbenchmarks, timing
from solidsph.costs.calibration import Calibration
from solidsph.costs.cluster import Cluster, estimate_on_cluster
from solidsph.costs.coefficients import REFERENCE
from solidsph.costs.count import ITERATIONS, count_work, expected_products
from solidsph.costs.effect_shares import effect_shares, without
from solidsph.costs.estimate import ball, cut_off, estimate_work, lattice_neighbours
from solidsph.costs.factorisation import estimate_dissection, estimate_factorisation
from solidsph.costs.model import Built, coefficient, predict
from solidsph.costs.prediction import predict_run
from solidsph.costs.timing import time_uncounted
from solidsph.costs.work import Loop
from solidsph.errors import SceneError
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.plan import CompilationUnit, SumMethod
from solidsph.interfaces.terms import Load
from solidsph.registry.construct import construct
from solidsph.run.cfl_step import cfl_step
from solidsph.system.cache import CACHE
from tests.commands.test_cli import solidsph
from tests.helpers.scenes import SCENE_TOML, SOFT
from tests.helpers.waiting import HANG


def bar(engine: str = "matrix", formulation: str = "total-lagrangian"):
    """Ten particles in a row; within 2.1 spacings there are two on either side."""
    return (
        Simulation.builder()
        .scheme("corrected")
        .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.1)
        .kernel("modified-mollifier", cover=2.1)
        .material("neo-hookean", **SOFT)
        .formulation(formulation)
        .engine(engine)
        .duration(1e-2)
        .outputs(3)
    )


# Ten particles themselves, nine neighbours one spacing apart and eight two apart, both ways.
PAIRS = 10 + 2 * 9 + 2 * 8


def block(cells: int, d: int, cover: float = 2.6, **body):
    shape = {"type": "interval", "length": 1.0} if d == 1 else {"type": "box", "lengths": [1.0] * d}
    return (
        Simulation.builder()
        .scheme("corrected")
        .body("block", shape=shape, spacing=1.0 / cells, **body)
        .kernel("cubic-spline", cover=cover)
        .material("neo-hookean", **SOFT)
        .engine("matrix")
        .duration(1e-2)
    )


def test_a_bar_is_counted_as_by_hand() -> None:
    simulation = bar().build()
    work = count_work(simulation)
    (part,) = work.operations
    assert (work.particles, work.pairs, work.visited) == (10, PAIRS, PAIRS)
    assert work.evaluations == simulation.steps + 1  # one a step, and one at the start
    assert work.pair_evaluations == PAIRS * (simulation.steps + 1)
    assert work.outputs == 4
    # Two matrices of a number and an index for each pair, and where each of ten rows begins.
    matrices = 2 * (PAIRS * (8 + 8) + 11 * 8)
    assert part.method is SumMethod.PRODUCTS
    assert part.held == work.held == simulation.dynamics.internal.bytes == matrices
    assert work.touched == matrices + 2 * 10 * 8  # displacements and forces
    assert work.traffic == work.touched * work.evaluations
    assert work.loop is Loop.STEPS
    assert work.compilations == frozenset()


def test_moving_neighbours_are_counted_at_the_start() -> None:
    (part,) = count_work(bar(formulation="updated-lagrangian").build()).operations
    assert (part.method, part.pairs) == (SumMethod.PRODUCTS_ANEW, PAIRS)
    assert part.held == 10 * 8  # the sums of the kernel; all else is formed anew


@pytest.mark.parametrize(("engine", "bytes_each"), [("compiled", 8), ("compiled-float32", 4)])
def test_the_compiled_engine_visits_the_same_pairs(engine: str, bytes_each: int) -> None:
    simulation = bar(engine).build()
    work = count_work(simulation)
    stencils, rows = work.operations
    assert (stencils.method, rows.method) == (SumMethod.STENCILS, SumMethod.ROWS)
    assert stencils.pairs + rows.pairs == work.pairs == PAIRS
    assert stencils.particles + rows.particles == 10
    assert {part.precision for part in work.operations} == {bytes_each}
    assert work.held == sum(part.bytes for part in simulation.dynamics.internal.parts)
    assert work.loop is Loop.COMPILED
    pieces = {one.unit for one in work.compilations}
    assert pieces == {
        CompilationUnit.ENGINE,
        CompilationUnit.FORCES,
        CompilationUnit.FIELDS,
        CompilationUnit.STEPS,
    }


def test_effects_add_the_pairs_that_they_visit() -> None:
    plain, viscous = bar().build(), bar().effect("artificial-viscosity").build()
    # Each pair but the ten of a particle with itself.
    assert count_work(viscous).visited == count_work(plain).visited + PAIRS - 10
    held = count_work(bar().effect("hourglass-control").build())
    assert held.visited > 3 * PAIRS  # the gradient's twice, and the nearest between
    assert held.operations[-1].method is SumMethod.HOURGLASS_PRODUCTS


def test_counts_are_the_same_every_time(tmp_path: Path) -> None:
    def twice(builder):
        return count_work(builder().build()), count_work(builder().build())

    for builder in (bar, lambda: block(8, 3).effect("hourglass-control")):
        first, second = twice(builder)
        assert first == second
    (tmp_path / "pull.toml").write_text(SCENE_TOML)
    columns = []
    for _ in range(2):
        done = solidsph("explain", "pull.toml", "--json", cwd=tmp_path)
        (facts,) = json.loads(done.stdout)["scenes"].values()
        columns.append(facts["work"])
    assert columns[0] == columns[1]


def test_a_statics_scene_counts_iterations_and_what_its_factors_take() -> None:
    simulation = block(10, 2).boundary("clamp", where="left").statics(load_steps=2).build()
    statics = count_work(simulation).statics
    assert statics is not None
    assert statics.freedoms == 2 * 90  # a hundred particles, ten of them clamped
    assert statics.iterations == 2 * ITERATIONS
    linear = block(10, 2).material("linear-elastic", **SOFT).statics().build()
    assert count_work(linear).statics.iterations == 1  # its forces are linear


def test_what_nothing_separates_is_a_full_block() -> None:
    full = estimate_dissection((4.0, 3.0), reach=4.0, components=2)
    assert full.fill == (2 * 12) ** 2
    assert full.multiplications == (2 * 12) ** 3 // 3


def test_a_band_is_as_wide_as_the_layers_that_are_coupled() -> None:
    band = estimate_factorisation((100.0, 3.0), reach=4.0, components=2)
    assert band.banded
    assert band.fill == 600 * (24 + 1)
    assert band.multiplications == 600 * 24**2 // 2
    assert estimate_factorisation((4.0, 3.0), reach=9.0, components=1).fill == 12 * 12  # full
    wide = (300.0, 300.0)  # more than half a gigabyte
    assert estimate_factorisation(wide, 5.0, 2) == estimate_dissection(wide, 5.0, 2)


def test_products_grow_towards_incompressibility() -> None:
    """Measured: 147 and 626 with 8281 particles in space."""
    few, many = (
        expected_products(
            construct("materials", {"type": "neo-hookean", **SOFT, "poissons_ratio": nu})
        )
        for nu in (0.3, 0.49)
    )
    assert few == pytest.approx(147, rel=0.3)
    assert many == pytest.approx(626, rel=0.3)


def test_dissection_grows_as_the_theory_says() -> None:
    """n log n entries and n^(3/2) multiplications in the plane, n^(4/3) and n^2 in space."""
    for d, (entries, work) in {2: (1.0, 1.5), 3: (4.0 / 3.0, 2.0)}.items():
        small, large = (estimate_dissection((side,) * d, 1.0, 1) for side in (4096.0, 8192.0))
        grown = 2.0**d
        # The logarithm is what is left of the plane's entries: 13/12 at these sizes.
        assert large.fill / small.fill == pytest.approx(grown**entries, rel=0.12)
        assert large.multiplications / small.multiplications == pytest.approx(grown**work, rel=0.02)


@pytest.mark.parametrize(("cover", "d", "count"), [(2.6, 1, 5), (1.0, 2, 5), (1.5, 3, 19)])
def test_lattice_neighbours_by_hand(cover: float, d: int, count: int) -> None:
    assert lattice_neighbours(cover, d) == count


def test_the_ball_and_what_a_surface_cuts_off() -> None:
    assert ball(2.0, 3) == pytest.approx(4.0 / 3.0 * pi * 8.0)
    # The cap beyond a plane at z from the centre, integrated over z by Simpson's rule.
    z = np.linspace(0.0, 2.0, 2001)
    cap = pi * (2.0 - z) ** 2 * (4.0 + z) / 3.0
    assert cut_off(2.0, 3) == pytest.approx(np.trapezoid(cap, z), rel=1e-6)


@pytest.mark.parametrize(("d", "cells"), [(1, 400), (2, 60), (3, 24)])
@pytest.mark.parametrize(
    # The lattice is counted but for its surface, which is taken to be flat and continuous; a
    # jittered one is taken to be a ball's volume, in which a lattice's shells are washed out.
    ("discretisation", "share"),
    [
        ("lattice", 0.05),
        ({"type": "lattice"}, 0.05),
        ({"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}, 0.12),
    ],
)
def test_the_estimate_is_near_the_count(d: int, cells: int, discretisation, share: float) -> None:
    builder = block(cells, d, discretisation=discretisation)
    work, about = count_work(builder.build()), estimate_work(builder.scene())
    assert not about.counted
    assert about.particles == pytest.approx(work.particles, rel=0.01)
    assert about.pairs == pytest.approx(work.pairs, rel=share)
    assert about.steps == pytest.approx(work.steps, abs=1)
    assert about.held == pytest.approx(work.held, rel=share)


BILLION = """
duration = 1.0
outputs = 10
engine = "compiled"
[body.block]
shape = {type = "box", lengths = [10.0, 10.0, 10.0]}
spacing = 0.01
[kernel]
type = "cubic-spline"
cover = 2.6
[material]
type = "neo-hookean"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
"""


def test_a_billion_particles_are_priced_and_not_built(tmp_path: Path) -> None:
    (tmp_path / "large.toml").write_text(BILLION)
    done = solidsph("explain", "large.toml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (facts,) = json.loads(done.stdout)["scenes"].values()
    numbers = {row["quantity"]: row["value"] for row in facts["numbers"]}
    work = {row["quantity"]: row["value"] for row in facts["work"]}
    there = {row["quantity"]: row for row in facts["on a cluster"]}
    assert numbers["particles"] == 10**9
    # 81 points of a lattice are within 2.6 spacings; six faces take some away.
    assert 80.5e9 < work["pairs"] < 81e9
    assert there["nodes"]["value"] >= 2
    assert "MORE THAN THIS MACHINE HAS" in there["memory [GiB]"]["why"]
    for word in ("cores", "network", "efficiency", "bandwidth", "latency", "storage", "usable"):
        assert any(word in row["why"] for row in there.values()), word
    more = solidsph(
        "explain", "large.toml", "--json", "--cluster", "memory=64", "--cluster", "cores=16",
        cwd=tmp_path,
    )  # fmt: skip
    (facts,) = json.loads(more.stdout)["scenes"].values()
    other = {row["quantity"]: row for row in facts["on a cluster"]}
    assert other["nodes"]["value"] > 3 * there["nodes"]["value"]
    assert solidsph("explain", "large.toml", cwd=tmp_path).returncode == 0
    for wrong, expected in (("nodes=2", "unknown 'nodes'"), ("cores=-1", "positive number")):
        refused = solidsph("explain", "large.toml", "--cluster", wrong, cwd=tmp_path)
        assert refused.returncode == 2
        assert expected in refused.stderr


def test_a_cluster_by_hand() -> None:
    from solidsph import Scene

    work = estimate_work(Scene.from_toml(BILLION))
    paper = predict(work, REFERENCE)
    price = estimate_on_cluster(paper, REFERENCE, Cluster())
    side = (1e9 / price.nodes) ** (1.0 / 3.0)
    halo = (side + 2.0 * 2.6) ** 3 - side**3
    assert price.halo == pytest.approx(halo, rel=1e-6)
    assert price.exchanged == pytest.approx(2 * 3 * 8 * halo, rel=1e-6)
    assert price.bytes_a_particle == pytest.approx((paper.memory - REFERENCE.bare) / 1e9)
    # As many as hold it, and hardly more: halos are a small part of such cubes.
    least = price.bytes_a_particle * 1e9 / (0.8 * 256 * 2**30)
    assert least <= price.nodes <= 1.1 * least + 2
    # A cluster of one node of one core has this machine's time, on one thread.
    alone = Cluster(cores=1, efficiency=1.0, memory=1e9, bandwidth=1e9)
    single = attrs.evolve(REFERENCE, threads=1)
    here = predict(work, single)
    there = estimate_on_cluster(here, single, alone)
    assert (there.nodes, there.halo, there.exchanging) == (1, 0, 0.0)
    assert there.computing * work.evaluations == pytest.approx(here.steps)


def test_a_faster_machine_is_predicted_to_be_faster() -> None:
    work = count_work(block(10, 2).build())
    double = Calibration(
        **{
            name: value if name in ("threads", "bare") else 0.5 * value
            for name, value in attrs.asdict(REFERENCE).items()
        }
    )
    slow, fast = predict(work, REFERENCE), predict(work, double)
    assert fast.seconds == pytest.approx(0.5 * slow.seconds)
    assert fast.memory == slow.memory
    assert slow.limit in slow.parts


def test_what_was_built_or_compiled_before_is_not_predicted_again() -> None:
    work = count_work(bar("compiled").build())
    first = predict(work, REFERENCE)
    built = Built(seconds=1.25, peak=10**9, left=10**6)
    again = predict(work, REFERENCE, built=built, compiled=work.compilations)
    assert first.compiling > 0.0 == again.compiling
    assert again.build == 1.25
    assert again.memory == 10**9  # the peak of the build, which the run stays below


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(CACHE, str(tmp_path / "own"))
    calibration.this_machine.cache_clear()
    yield calibration.cache_file()
    calibration.this_machine.cache_clear()


def test_a_calibration_does_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many rounds as take about a second; `benchmarks/predictions.py` measures how long."""
    rounds: list[int] = []

    def once(task: Callable[[], object], repeats: int, ticks: object = None) -> float:
        rounds.append(repeats)
        task()
        return 1.0

    monkeypatch.setattr(microbenchmarks, "best", once)
    found = microbenchmarks.measure()
    # Of a round, since each takes a second here. What is copied is 16 MiB a thread, of four calls.
    assert (found.compiling, found.sparse) == (1.0, 1.0 / 30_000)
    assert (found.copying, found.filing) == (1.0 / 2**24, 1.0 / (2**17 * 24))
    assert len(rounds) <= 7
    assert sum(rounds) <= 150


def test_a_calibration_is_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibration, "_LONGEST", HANG)
    found = calibration.this_machine()
    monkeypatch.setattr(calibration, "measure_calibration", lambda: pytest.fail("measured again"))
    assert calibration.this_machine() is found  # of the process
    calibration.this_machine.cache_clear()
    assert calibration.this_machine() == found  # of the file
    assert list(cache.parent.iterdir()) == [cache]


@pytest.mark.parametrize(
    "broken", ["", "{", "[]", "{}", '{"sparse": 1}', REFERENCE.to_json().replace(": ", ": -")]
)
def test_a_broken_cache_is_ignored(
    broken: str, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache.parent.mkdir(parents=True)
    cache.write_text(broken)
    assert calibration.cached_calibration() is None
    monkeypatch.setattr(calibration, "measure_calibration", lambda: REFERENCE)
    assert calibration.this_machine() is REFERENCE
    assert calibration.cached_calibration() == REFERENCE  # and replaced


def test_an_old_cache_is_ignored(cache: Path) -> None:
    cache.parent.mkdir(parents=True)
    cache.write_text(REFERENCE.to_json())
    assert calibration.cached_calibration() == REFERENCE
    written = cache.stat().st_mtime
    # An hour ahead is the clock of a file server; days ahead are a clock that was put right.
    for later, found in ((3600.0, REFERENCE), (-2 * 86400.0, None), (2 * 86400.0, None)):
        os.utime(cache, (written + later, written + later))
        assert calibration.cached_calibration() == found


def test_without_a_place_for_the_cache_nothing_fails(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache.parent.write_text("a file where the folder would be")
    monkeypatch.setattr(calibration, "measure_calibration", lambda: REFERENCE)
    assert calibration.this_machine() is REFERENCE


def test_a_machine_too_busy_to_be_calibrated_is_said_to_be(
    cache: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(calibration, "_LONGEST", 0.0)  # what any machine is too slow for
    assert predictions.this_machine() is REFERENCE
    assert "could not be calibrated" in capsys.readouterr().err
    assert not cache.exists()


def test_run_and_explain_tell_what_was_predicted_and_what_it_took(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pull.toml").write_text(SCENE_TOML)
    facts = json.loads(solidsph("run", "pull.toml", "--json", cwd=tmp_path).stdout)
    for quantity in ("wall time [s]", "peak memory [MiB]"):
        assert facts[quantity] > 0.0
        assert facts[f"predicted {quantity}"] > 0.0
    assert facts["predicted over measured time [-]"] == pytest.approx(
        facts["predicted wall time [s]"] / facts["wall time [s]"]
    )
    # A process of some 100 MiB of which most are imports: within a factor of two at any rate.
    assert 0.5 < facts["predicted over measured memory [-]"] < 2.0
    for long, announced in ((0.0, True), (inf, False)):  # a short run is not
        monkeypatch.setattr(predictions, "LONG", long)
        shown = solidsph("run", "pull.toml", cwd=tmp_path)
        assert "predicted over measured time" in shown.stdout
        assert ("predicted:" in shown.stdout) == announced
    told_before = json.loads(solidsph("explain", "pull.toml", "--json", cwd=tmp_path).stdout)
    (scene,) = told_before["scenes"].values()
    cost = {row["quantity"].strip(): row["value"] for row in scene["cost"]}
    parts = [cost[f"{name} [s]"] for name in ("build", "compile", "steps", "outputs")]
    assert sum(parts) == pytest.approx(cost["predicted wall time [s]"])
    assert told_before["predicted"]["wall time [s]"] == cost["predicted wall time [s]"]
    assert cost["predicted peak memory [MiB]"] > 0.0
    work = {row["quantity"]: row["value"] for row in scene["work"]}
    assert work["pair evaluations"] == facts["pair evaluations"]


def test_an_equilibrium_is_scored_by_the_iterations_that_it_took(tmp_path: Path) -> None:
    static = SCENE_TOML.replace("[[boundary]]", "[statics]\nload_steps = 2\n\n[[boundary]]", 1)
    static = static.replace('[integrator]\ntype = "central-difference"\n', "")
    (tmp_path / "pull.toml").write_text(static)
    facts = json.loads(solidsph("run", "pull.toml", "--json", cwd=tmp_path).stdout)
    evaluations = facts["iterations"] + facts["load steps"]
    assert facts["pair evaluations"] == facts["pairs"] * evaluations


def test_a_case_is_the_sum_of_its_scenes(tmp_path: Path) -> None:
    done = solidsph(
        "explain", "tensile-instability", "--set", "stretches=[]", "--json", cwd=tmp_path
    )
    facts = json.loads(done.stdout)
    each = [
        {row["quantity"]: row["value"] for row in scene["cost"]}["predicted wall time [s]"]
        for scene in facts["scenes"].values()
    ]
    assert len(each) == 2
    assert facts["predicted"]["wall time [s]"] == pytest.approx(sum(each))


def test_a_prediction_is_never_why_a_run_fails() -> None:
    assert predictions.try_prediction(None, None) is None  # type: ignore[arg-type]
    assert predictions.comparison(None, 1.0, 1) == {}


@attrs.frozen
class Wind(Effect):
    """A third party's effect, of a kind that nobody has declared."""

    def bind(self, model, label: str) -> Load:
        return _Blowing(label, np.arange(model.particles.count))


@attrs.frozen(eq=False)
class _Blowing(Load):
    label: str
    particles: np.ndarray

    def forces(self, time, positions, velocities):
        return np.zeros_like(positions)

    def report(self, observation):
        return {}


def test_what_is_not_known_is_priced_by_defaults() -> None:
    simulation = bar().effect(Wind()).build()
    work = count_work(simulation)
    assert work.operations[-1].method is SumMethod.UNKNOWN
    assert work.visited == PAIRS  # it says of no pairs that it visits them
    prediction = predictions.try_prediction(simulation, None)
    assert prediction is not None
    assert prediction.steps > 0.0
    assert coefficient("UNKNOWN 2D pair") >= coefficient("PRODUCTS 2D pair") > 0.0
    assert coefficient("PAIR_LOOPS 2D float32 pair") == coefficient("PAIR_LOOPS 2D pair")


def test_a_cluster_refuses_what_is_no_number() -> None:
    with pytest.raises(SceneError, match="memory must be a positive number, got 'much'"):
        Cluster(memory="much")  # type: ignore[arg-type]


def test_a_load_in_the_compiled_loop_costs_by_the_particles_that_it_acts_on() -> None:
    def load_on(where: str):
        builder = block(20, 2).engine("compiled")
        return builder.effect("mass-damping", rate=1.0, where=where, label="drag").build()

    everywhere, few = (
        effect_shares(load_on(where), REFERENCE)["drag"].time for where in ("all", "X < 0.1")
    )
    # A tenth of the particles: two columns of twenty. Shares are of what differs by themselves.
    assert few / (1.0 - few) == pytest.approx(0.1 * everywhere / (1.0 - everywhere), rel=1e-9)


def test_shares_are_of_what_the_effects_add() -> None:
    builder = bar().effect("artificial-viscosity", label="v").effect("mass-damping", rate=9.0)
    simulation = builder.build()
    found = effect_shares(simulation, REFERENCE)
    assert 0.0 < found["mass-damping"].time < found["v"].time < 1.0
    # The stable step is 2 over the sum of frequency and rates, of which damping has 9 1/s.
    viscous = bar().effect("artificial-viscosity").build()
    assert found["mass-damping"].step == pytest.approx(
        cfl_step(simulation.integrator, simulation.dynamics.loads, simulation.model.bodies)
        / cfl_step(viscous.integrator, viscous.dynamics.loads, viscous.model.bodies)
    )
    assert found["v"].step < 0.9 < found["mass-damping"].step < 1.0
    assert without(simulation, "v").step_size == simulation.step_size


# --- What counts cannot price --------------------------------------------------------------------


def heated(conductivity: float | None) -> Simulation:
    builder = (
        Simulation.builder()
        .body("block", shape={"type": "box", "lengths": [1.0, 0.5]}, spacing=0.05)
        .kernel("cubic-spline", cover=2.6)
        .material("neo-hookean", youngs_modulus=1e6, poissons_ratio=0.3, density=1000.0)
        .effect("mass-damping", rate=1.0)
        .engine("matrix")
        .duration(0.01)
    )
    if conductivity is not None:
        builder.effect("heat", conductivity=conductivity, heat_capacity=1.0, expansion=1e-5)
    return builder.build()


def test_only_what_is_of_no_declared_kind_is_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    # Of a clock by which whatever is time_uncounted takes a second.
    monkeypatch.setattr(timing, "time", SimpleNamespace(perf_counter=count().__next__))
    plain, hot = heated(None), heated(1.0)
    assert time_uncounted(plain, count_work(plain)).loads == {}
    found = time_uncounted(hot, count_work(hot))
    assert list(found.loads) == ["heat"]
    assert found.seconds == 1.0  # of one evaluation
    assert found.without("heat").seconds == 0.0
    # What is time_uncounted is not counted as well.
    ways = {part.method for part in found.without_timed(count_work(hot), hot).operations}
    assert SumMethod.UNKNOWN in {part.method for part in count_work(hot).operations}
    assert not any(
        p.method is SumMethod.UNKNOWN and p.pairs
        for p in found.without_timed(count_work(hot), hot).operations
    )
    assert SumMethod.PRODUCTS in ways


def test_what_was_timed_is_in_the_prediction() -> None:
    hot = heated(1.0)
    work = count_work(hot)
    rest = predict(time_uncounted(hot, work).without_timed(work, hot), REFERENCE)
    more = predict(time_uncounted(hot, work).without_timed(work, hot), REFERENCE, extra=1e-3)
    assert more.steps - rest.steps == pytest.approx(1e-3 * work.evaluations)
    assert predict_run(hot, REFERENCE).steps > rest.steps
    assert predict_run(hot, REFERENCE).work == work
