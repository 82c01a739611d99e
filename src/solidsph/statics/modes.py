"""Natural frequencies and mode shapes, from the tangent and the lumped masses."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import LinearOperator, eigsh

from solidsph.errors import SceneError, SolidsphError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.factors import SingularError, factorised
from solidsph.statics.freedoms import freedoms
from solidsph.statics.tangent import is_symmetric, tangent

# The shift's frequency, in passages of a wave across the body a second: low beside elastic modes
# of compact bodies, yet high enough that rigid motions leave the shifted matrix well conditioned.
_SHIFT = 0.1

# Eigenvalues this far below zero, relative to the shift, are rounding and not instability.
_ROUNDING = 1e-4


@attrs.frozen(eq=False)
class Modes:
    """The slowest free vibrations."""

    angular_frequencies: Array  # (count,) rising [rad/s]; rigid motions near 0
    shapes: Array  # (count, n, d) displacements, the largest component of each 1
    smoothness: Array  # (count,) what the kernel's smoothing leaves of a shape [-]
    """Near 1 for a motion that the particles resolve, near 0 for one in which neighbours move
    against each other: a zero-energy mode of the gradient, whose frequency means nothing."""


def frequencies(simulation: BuiltScene, count: int, state: State | None = None) -> Modes:
    """The `count` smallest natural frequencies about `state`, by shift and invert.

    Loads count by their stiffness alone, damping not at all.

    Args:
        simulation: a built scene in the total Lagrangian form with an adjoint divergence.
        count: how many.
        state: an equilibrium to vibrate about; the reference configuration by default.

    Raises:
        SceneError: there are not so many modes.
        SolidsphError: the forces have no energy, or the state is unstable.
    """
    particles, model = simulation.particles, simulation.model
    own = freedoms(simulation.dynamics)
    if not (own.adjoint and is_symmetric(simulation)):
        raise SolidsphError(
            "natural frequencies need forces that derive from an energy; take divergence = "
            "'variational' and a motion that returns forces, or use studies.spectrum"
        )
    if not 1 <= count < own.count:
        raise SceneError(
            f"frequencies: count must lie between 1 and {own.count - 1}, one less than the free "
            f"degrees of freedom, got {count}"
        )
    u = np.zeros_like(particles.positions)
    if state is not None:
        u = state.positions - particles.positions
    K = own.reduced(tangent(simulation, u))
    mass = np.repeat(model.masses, particles.dimension)[own.free.ravel()]
    extent = float(np.ptp(particles.positions, axis=0).max())
    speed = min(body.material.wave_speed for body in model.bodies)
    shift = (_SHIFT * speed / extent) ** 2
    try:
        factors = factorised(csr_array(K + shift * diags_array(mass)), symmetric=True)
    except SingularError:
        raise _unstable() from None
    # A start that no symmetry of the body is blind to, the same at every call.
    start = np.random.default_rng(0).standard_normal(own.count)
    squares, vectors = eigsh(
        K,
        k=count,
        M=diags_array(mass),
        sigma=-shift,
        OPinv=LinearOperator(K.shape, matvec=factors.solve, dtype=np.float64),
        v0=start,
    )
    order = np.argsort(squares)
    if not factors.positive or squares[order[0]] < -_ROUNDING * shift:
        raise _unstable()
    shapes = np.stack([own.expanded(vectors[:, k]) for k in order])
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
        "the state is unstable: the tangent is not positive, so a deviation grows and has no "
        "frequency; studies.spectrum gives its rate"
    )


def _smoothness(simulation: BuiltScene, shapes: Array) -> Array:
    W = simulation.model.smoothing_matrix()
    sums = W.sum(axis=1)[:, None]
    return np.array([np.linalg.norm(W @ u / sums) / np.linalg.norm(u) for u in shapes])
