"""What the strength of hourglass control costs in accuracy, and what it gives in stability.

    python benchmarks/hourglass_strength.py            print the tables, as Markdown
    python benchmarks/hourglass_strength.py --write    put them into docs/hourglass.md

Everything is deterministic; it takes some ten minutes on one core.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Iterator, Sequence
from math import pi
from pathlib import Path

import attrs
import numpy as np
from scipy.linalg import eigh

from solidsph import Simulation
from solidsph.errors import SolidsphError
from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.statics import equilibrium, frequencies, tangent
from solidsph_builtin.effects.hourglass_control import HourglassControl

STRENGTHS = (0.0, 0.01, 0.03, 0.1, 0.3, 0.5, 1.0, 3.0)
KERNELS = (("modified-mollifier", 3.0), ("modified-mollifier", 3.5), ("cubic-spline", 2.6))
GRADIENTS = ("corrected", "quadratic")
SCHEMES = [(kernel, cover, gradient) for kernel, cover in KERNELS for gradient in GRADIENTS]
PAGE = Path(__file__).parents[1] / "docs/hourglass.md"
MARK = "<!-- What follows is written by benchmarks/hourglass_strength.py --write. -->\n"

# A mode of which the kernel's smoothing leaves less than this is not resolved.
ROUGH = 0.5


def scheme(
    builder: SceneBuilder, kernel: str, cover: float, gradient: str, strength: float
) -> SceneBuilder:
    builder = builder.kernel(kernel, cover=cover)
    builder = builder.formulation("total-lagrangian", gradient=gradient)
    return builder.effect("hourglass-control", strength=strength) if strength else builder


def elastic(builder: SceneBuilder, nu: float) -> SceneBuilder:
    return builder.material("neo-hookean", youngs_modulus=1e6, poissons_ratio=nu, density=1000.0)


# Accuracy


def beam(across: int, nu: float) -> SceneBuilder:
    """The Turek-Hron beam, clamped at a straight edge, under its weight."""
    return (
        Simulation.builder()
        .body(
            "beam",
            shape={"type": "box", "lengths": [0.35, 0.02], "origin": [0.0, -0.01]},
            spacing=0.02 / (across - 1),
            discretisation={
                "type": "fitted-moments",
                "of": {"type": "lattice", "on_boundary": True},
            },
            tags={"tip": "X > 0.35 - 1e-6 and abs(Y) < 1e-6"},
        )
        .material("saint-venant-kirchhoff", youngs_modulus=1.4e6, poissons_ratio=nu, density=1e3)
        .boundary("clamp", where="left")
        .effect("body-force", acceleration={"y": -2.0})
        .duration(0.5)
    )


def answers(builder: SceneBuilder) -> Array:
    """Deflection at rest [m] and first natural frequency [Hz]."""
    simulation = builder.build()
    (tip,) = simulation.particles.tagged("tip")
    moved = equilibrium(simulation).state.positions - simulation.particles.positions
    modes = frequencies(simulation, 2)
    return np.array([moved[tip, 1], modes.angular_frequencies[0] / (2.0 * pi)])


def changes(across: int, nu: float, own: tuple[str, float, str], strengths: Sequence[float]) -> str:
    free = answers(scheme(beam(across, nu), *own, 0.0))
    row = [f"{1e3 * free[0]:.2f} mm, {free[1]:.3f} Hz"]
    for strength in strengths:
        u, f = 100.0 * (answers(scheme(beam(across, nu), *own, strength)) / free - 1.0)
        row.append(f"{u:+.2f}, {f:+.2f}")
    return " | ".join(row)


def accuracy() -> Iterator[str]:
    yield "### Accuracy: the Turek-Hron beam\n"
    yield (
        "Deflection at rest and first natural frequency without control, and their change by it in "
        "per cent. The right deflection at nu = 0.4 is -65.57 mm.\n"
    )
    strengths = STRENGTHS[1:]
    yield from head("across", "nu", "kernel", "gradient", "without", *strengths)
    for across in (5, 9):
        for own in SCHEMES:
            row = changes(across, 0.4, own, strengths)
            yield f"| {across} | 0.4 | {own[0]} {own[1]:g} | {own[2]} | {row} |"
    yield ""
    yield (
        "The same at other Poisson's ratios, and at the strength of 0.1 times M = lambda + 2 mu "
        "in place of mu.\n"
    )
    yield from head("across", "nu", "gradient", "without", 0.1, 0.3, 0.5, 1.0, 3.0, "0.1 M")
    for nu in (0.3, 0.45, 0.4999):
        for gradient in GRADIENTS:
            # M / mu = (2 - 2 nu) / (1 - 2 nu)
            strong = 0.1 * (2.0 - 2.0 * nu) / (1.0 - 2.0 * nu)
            own = ("modified-mollifier", 3.5, gradient)
            row = changes(5, nu, own, (0.1, 0.3, 0.5, 1.0, 3.0, strong))
            yield f"| 5 | {nu:g} | {gradient} | {row} |"
    yield ""


# Motions that the gradient does not see


def box(d: int, cells: int, nu: float = 0.3) -> SceneBuilder:
    """A free box of unit length."""
    builder = Simulation.builder().body(
        "box", shape={"type": "box", "lengths": [1.0] * d}, spacing=1.0 / cells
    )
    return elastic(builder, nu).duration(1e-2)


def rough_modes(simulation: Simulation) -> Iterator[tuple[float, float]]:
    """Of each strength: the lowest frequency of a rough mode, and the highest of any.

    The first in units of shear speed over spacing, the second of the confined speed over it.
    """
    particles, (body,) = simulation.particles, simulation.model.bodies
    n, d = particles.positions.shape
    K = tangent(simulation, np.zeros((n, d))).toarray()
    control = HourglassControl(strength=1.0).bind(simulation.model, "control")
    penalty = control.stiffness(np.zeros((n, d))).toarray()  # type: ignore[attr-defined]
    scaling = 1.0 / np.sqrt(np.repeat(simulation.model.masses, d))
    W = simulation.model.smoothing_matrix()
    sums = W.sum(axis=1)[:, None]
    spacing = float(particles.spacings[0])
    shear_speed = np.sqrt(body.material.lame_parameters[1] / body.material.density)
    for strength in STRENGTHS:
        squares, vectors = eigh(scaling[:, None] * (K + strength * penalty) * scaling)
        shapes = (scaling[:, None] * vectors).T.reshape(-1, n, d)
        left = np.array([np.linalg.norm(W @ u / sums) / np.linalg.norm(u) for u in shapes])
        w = np.sqrt(np.maximum(squares, 0.0)) * spacing
        yield w[left < ROUGH].min() / shear_speed, w.max() / body.material.wave_speed


def spectra() -> Iterator[str]:
    yield "### The slowest motion that is not resolved, and the fastest of all\n"
    yield (
        "Free boxes of 14 x 14 and 7 x 7 x 7 particles. First the lowest frequency of a mode of "
        "which the kernel's smoothing leaves less than half, in units of shear speed over spacing "
        "(a true shear wave of ten spacings has 0.63); then by how many per cent the highest "
        "frequency rises, which the critical step falls by.\n"
    )
    yield from head("d", "nu", "kernel", "gradient", *STRENGTHS)
    for d, cells, nus in ((2, 14, (0.3, 0.4999)), (3, 7, (0.3,))):
        for nu in nus:
            for own in SCHEMES:
                pairs = list(rough_modes(scheme(box(d, cells, nu), *own, 0.0).build()))
                highest = pairs[0][1]
                row = " | ".join(f"{low:.3f}, {100 * (h / highest - 1):+.1f}" for low, h in pairs)
                yield f"| {d} | {nu:g} | {own[0]} {own[1]:g} | {own[2]} | {row} |"
    yield ""


# Runs


def roughness(simulation: Simulation, values: Array) -> Array:
    """What smoothing takes from values (n, d), (n,)."""
    W = simulation.model.smoothing_matrix()
    return np.linalg.norm(values - W @ values / W.sum(axis=1)[:, None], axis=1)


def noise(d: int, cells: int, own: tuple[str, float, str], strength: float) -> float:
    """How a checkerboard with noise, 1e-3 spacings high, has grown after 10 000 steps."""
    simulation = scheme(box(d, cells).outputs(1), *own, strength).build()
    X, spacing = simulation.particles.positions, 1.0 / cells
    signs = np.where(np.rint(X / spacing - 0.5).sum(axis=1) % 2, -1.0, 1.0)
    random = np.random.default_rng(0).standard_normal(X.shape)
    u = 1e-3 * spacing * (signs[:, None] + random)
    start = attrs.evolve(simulation.initial, positions=X + u)
    run = attrs.evolve(simulation, initial=start, steps=10_000)
    end = run.run().state.positions - X
    before, after = (float(np.linalg.norm(roughness(simulation, v))) for v in (u, end))
    return after / before


def column(nu: float, own: tuple[str, float, str], strength: float) -> str:
    """A column thrown to the side: how far a particle ends from what its neighbours do."""
    across = 9
    builder = (
        Simulation.builder()
        .body("column", shape={"type": "box", "lengths": [1.0, 3.0]}, spacing=1.0 / across)
        .material("neo-hookean", youngs_modulus=17e6, poissons_ratio=nu, density=1100.0)
        .boundary("clamp", where="bottom")
        .initial(velocity={"x": "10*Y"})
        .duration(0.5)
    )
    simulation = scheme(builder, *own, strength).build()
    try:
        end = simulation.run().state.positions
    except SolidsphError:
        return "diverged"
    away = roughness(simulation, end - simulation.particles.positions)
    return f"{across * away.max():.2f}"


def runs() -> Iterator[str]:
    yield "### Noise over 10 000 steps\n"
    yield (
        "A checkerboard with as much noise, 1e-3 spacings high, in free boxes: what is rough in "
        "the displacement at the end over that at the start. Nothing damps it, so it stays.\n"
    )
    yield from head("d", "kernel", "gradient", *STRENGTHS)
    for d, cells in ((2, 8), (3, 5)):
        for gradient in GRADIENTS:
            own = ("modified-mollifier", 3.5, gradient)
            row = " | ".join(f"{noise(d, cells, own, strength):.2f}" for strength in STRENGTHS)
            yield f"| {d} | {own[0]} {own[1]:g} | {gradient} | {row} |"
    yield ""
    yield "### A column thrown to the side\n"
    yield (
        "Plane strain, 1 m x 3 m, 9 particles across, clamped below, E = 17 MPa, density 1100, "
        "neo-Hookean, with a velocity of 30 m/s at the free end, after 0.5 s: the largest "
        "distance of a particle from where smoothing would have it, in spacings.\n"
    )
    yield from head("nu", "kernel", "gradient", *STRENGTHS)
    for nu in (0.3, 0.45):
        for own in SCHEMES:
            row = " | ".join(column(nu, own, strength) for strength in STRENGTHS)
            yield f"| {nu:g} | {own[0]} {own[1]:g} | {own[2]} | {row} |"
    yield ""


def head(*names: object) -> Iterator[str]:
    yield "| " + " | ".join(str(name) for name in names) + " |"
    yield "| " + " | ".join("---" for _ in names) + " |"


SECTIONS: Sequence[Callable[[], Iterator[str]]] = (accuracy, spectra, runs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--write", action="store_true", help="put the tables into docs/hourglass.md"
    )
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", UserWarning)  # a linear fit in places, where it is too thin
    lines = []
    for section in SECTIONS:
        for line in section():
            print(line, flush=True)
            lines.append(line)
    if chosen.write:
        text = PAGE.read_text(encoding="utf-8").split(MARK)[0]
        PAGE.write_text(text + MARK + "\n" + "\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
