"""What a filter of the dilatation adds to an evaluation in the compiled loop."""

from __future__ import annotations

from solidsph.interfaces.plan import Operations, SumMethod, vectors

# Products of a field, with R and with R*, each twice.
_PRODUCTS = 4

# Passes over stresses that are not kept in a block, with a logarithm, in evaluations of a law.
_LAWS = 2

_ENTRY = 12  # bytes of a weight and its offset


def filter_operations(
    particles: int, pairs: int, dimension: int, own_rows: int, *, threaded: bool
) -> Operations:
    """Operations of a body.

    Args:
        particles: of the body.
        pairs: entries of R, shared ones counted each time.
        dimension: of the scene.
        own_rows: entries of R of particles that share no stencil.
        threaded: whether several threads share the work.
    """
    # A pair of an evaluation is d^2 products that gather, and as many that scatter.
    alike = _PRODUCTS * pairs // (2 * dimension**2)
    held = 2 * _ENTRY * own_rows
    touched = 2 * held + _LAWS * vectors(particles, dimension)
    return Operations(
        SumMethod.STENCILS, alike, _LAWS * particles, touched, held, threaded=threaded
    )
