"""Natural frequencies and mode shapes from the tangent and the lumped masses."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph.errors import SceneError, SolidsphError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.static_solver import AUTOMATIC
from solidsph.statics.factors import SingularError
from solidsph.statics.linearised import UnsolvedError
from solidsph.statics.solvers import linear_system

# Frequency of the shift over wave speed / size of the body: low beside elastic modes of compact
# bodies, yet high enough for a well-conditioned matrix if rigid motions are free.
_SHIFT = 0.1

# Eigenvalues down to minus this fraction of the shift are rounding, not instability.
_ROUNDING = 1e-4


@attrs.frozen(eq=False)
class Modes:
    """Lowest modes of free vibration."""

    angular_frequencies: Array  # (count,) ascending [rad/s]; rigid motions near 0
    shapes: Array  # (count, n, d) displacements, the largest component of each 1
    smoothness: Array  # (count,) norm of each shape after smoothing by the kernel over before [-]
    """Near 1 for resolved modes, near 0 for zero-energy modes of the gradient, in which neighbours
    move against each other and whose frequency is meaningless."""


def frequencies(
    simulation: BuiltScene, count: int, state: State | None = None, solver: str = AUTOMATIC
) -> Modes:
    """The `count` lowest natural frequencies about `state`.

    Loads contribute the symmetric part of their stiffness; damping is neglected.

    Args:
        simulation: a built scene in the total Lagrangian form with an adjoint divergence.
        count: number of modes.
        state: equilibrium; the reference configuration by default.
        solver: "direct" factorises the tangent, and inverts it; "iterative" takes products with it;
            "automatic" what is faster.

    Raises:
        SceneError: there are fewer modes, or the scene does not allow iteration.
        SolidsphError: the forces have no energy, the state is unstable, or an iteration does not
            converge.
    """
    particles, model = simulation.particles, simulation.model
    system = linear_system(simulation, solver)
    free = system.freedoms
    if not system.symmetric:
        raise SolidsphError(
            "natural frequencies need forces that derive from an energy; use divergence = "
            "'variational' and constraints that return forces, or studies.spectrum"
        )
    if not 1 <= count < free.count:
        raise SceneError(
            f"frequencies: count must lie between 1 and {free.count - 1}, one less than the free "
            f"degrees of freedom, got {count}"
        )
    u = np.zeros_like(particles.positions)
    if state is not None:
        u = state.positions - particles.positions
    mass = np.repeat(model.masses, particles.dimension)[free.free.ravel()]
    extent = float(np.ptp(particles.positions, axis=0).max())
    speed = min(body.material.wave_speed for body in model.bodies)
    shift = (_SHIFT * speed / extent) ** 2
    try:
        squares, vectors = system.solver.lowest_modes(u, mass, shift, count)
    except SingularError:
        raise _unstable() from None
    except UnsolvedError as error:
        raise SolidsphError(
            f"natural frequencies: {error.iterations} iterations leave an error of "
            f"{error.left:.3g}; use solver = 'direct' if the body is small"
        ) from None
    order = np.argsort(squares)
    if squares[order[0]] < -_ROUNDING * shift:
        raise _unstable()
    shapes = np.stack([free.expanded(vectors[:, k]) for k in order])
    flat = shapes.reshape(count, -1)
    largest = np.take_along_axis(flat, np.abs(flat).argmax(axis=1)[:, None], axis=1)
    shapes /= largest[:, :, None]
    return Modes(
        angular_frequencies=np.sqrt(np.maximum(squares[order], 0.0)),
        shapes=shapes,
        smoothness=_smoothness(simulation, shapes),
    )


def _unstable() -> SolidsphError:
    return SolidsphError(
        "the state is unstable: the tangent is not positive definite, so a deviation grows and "
        "has no frequency; studies.spectrum gives its growth rate"
    )


def _smoothness(simulation: BuiltScene, shapes: Array) -> Array:
    W = simulation.model.smoothing_matrix()
    sums = W.sum(axis=1)[:, None]
    return np.array([np.linalg.norm(W @ u / sums) / np.linalg.norm(u) for u in shapes])
