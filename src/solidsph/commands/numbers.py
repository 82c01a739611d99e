"""The numbers that `solidsph explain` shows of a scene, each with its reason."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from solidsph.commands.prediction import Row, rows
from solidsph.interfaces.shape import Shape
from solidsph.registry.construct import construct
from solidsph.run.cfl_step import cfl_step
from solidsph.scene.default_cover import cover_of
from solidsph.scene.graded_spacing import is_graded, predicted_count, spacing_field
from solidsph.scene.scene import Scene
from solidsph.scene.static_solver import DIRECT, ITERATIVE, iterates
from solidsph.simulation import Simulation
from solidsph.statics import critical_step
from solidsph.statics.freedoms import freedoms


def sizes(scene: Scene) -> Iterator[tuple[str, str, str]]:
    """The size of each body: a file that was read in another unit is seen by it."""
    for name, body in scene.bodies.items():
        shape: Shape = construct("shapes", body.shape)
        low, high = shape.bounds()
        lengths = " x ".join(f"{length:.4g}" for length in (high - low).tolist())
        if not is_graded(body):
            about = f"of the box around it; its spacing is {body.spacing:g}"
            yield f"size of {name} [m]", lengths, about
            continue
        field = spacing_field(body, shape)
        yield f"size of {name} [m]", lengths, "of the box around it; its spacing varies"
        count = predicted_count(field, shape)
        yield (
            f"spacing of {name} [m]",
            f"{field.least:.4g} to {field.greatest:.4g}",
            f"least and greatest; about {count:.3g} particles",
        )


def numbers(simulation: Simulation) -> list[Row]:
    """Numbers of a built scene, each with its reason."""
    scene, model = simulation.scene, simulation.model
    particles, internal = model.particles, simulation.dynamics.internal
    speed = max(body.material.wave_speed for body in model.bodies)
    cover = "named by the scene"
    if scene.cover is None:
        cover = "the kernel's default, the largest that holds neighbours in a row"
    hidden = sum(len(body.hidden.keys) for body in model.bodies if body.hidden is not None) // 2
    gaps = ("pairs across gaps", hidden, "near, but not neighbours: the line leaves the body")
    filtered = ", ".join(body.name for body in model.bodies if body.dilatation_filter is not None)
    smooth = "nearly incompressible: else the pressure would alternate between neighbours"
    return rows(
        ("dimensions", particles.dimension, "1 is uniaxial strain, 2 is plane strain"),
        *sizes(scene),
        ("particles", int((~particles.ghosts).sum()), "from shapes and spacings"),
        ("ghosts", int(particles.ghosts.sum()), "complete the support of those near a surface"),
        (
            "neighbours",
            internal.pair_count / particles.count - 1.0,
            "average number within the support",
        ),
        ("cover [spacings]", cover_of(scene), f"support radius, {cover}"),
        *([gaps] if hidden else []),
        *([("filter of the dilatation", filtered, smooth)] if filtered else []),
        ("confined wave speed [m/s]", speed, "sqrt((lambda + 2 mu) / rho), of the fastest body"),
        ("engine", type(internal).__name__, f'engine = "{scene.engine}"'),
        *(_of_motion(simulation) if scene.statics is None else _of_statics(simulation)),
    )


def _of_motion(simulation: Simulation) -> Iterator[tuple[str, Any, str]]:
    scene = simulation.scene
    limit = cfl_step(simulation.integrator, simulation.dynamics.loads, simulation.model.bodies)
    of = "the CFL step, by wave speed and spacing, as the critical step is longer"
    if simulation.safe is not None and simulation.safe.step <= limit:
        of = "the critical step"
    step = f"{scene.time_step_factor:g} of {of}"
    if scene.time_step is not None:
        step = "set by the scene"
    yield "time step [s]", simulation.step_size, f"{step}; cut where bodies grow stiffer"
    margin = critical_step(simulation).margin
    source = "from the highest frequency of the discrete system at the start"
    yield "critical step over it", margin, source
    yield "steps", simulation.steps, f"for {scene.duration:g} s"
    if (sleep := scene.sleep) is not None:
        slow = f"slabs slower than {sleep.tolerance:g} of the largest speed sleep, and cost nothing"
        yield "sleep", f"up to {sleep.slabs} slabs", slow
    if simulation.plan.compiles_steps:
        called = ", ".join(simulation.plan.called)
        how = f"but for {called}, called at every step" if called else "whole steps"
        yield "time loop", "compiled", how
    else:
        yield "time loop", "step by step", "by the parts themselves, which works for all kinds"


def _of_statics(simulation: Simulation) -> Iterator[tuple[str, Any, str]]:
    statics = simulation.scene.statics
    assert statics is not None
    unknowns = freedoms(simulation.dynamics).count
    yield "free displacements", unknowns, "unknowns of Newton's method"
    iterated = iterates(statics.solver, simulation.particles.dimension, unknowns)
    yield (
        "solver",
        ITERATIVE if iterated else DIRECT,
        "of its linear systems; direct in any case with ghosts, or without an energy",
    )
    doubled = "" if simulation.remembers else ", doubled on success"
    yield "load steps", simulation.load_steps, f"at first: halved on failure{doubled}"
    yield "tolerance", statics.tolerance, "imbalance of forces over loads and reactions"
