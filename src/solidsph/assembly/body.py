"""Discrete bodies from the parts of a scene."""

from __future__ import annotations

import attrs

from solidsph.assembly.visibility import hidden_pairs
from solidsph.errors import BuildError
from solidsph.interfaces.body import Body
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.model.dilatation_filter import DilatationFilter
from solidsph.model.smooth_part import REACH, SmoothPart
from solidsph.registry.registry import entry_of
from solidsph.scene.part_maker import Parts
from solidsph.system.build_log import BUILD


def plain_body(name: str, parts: Parts, extent: slice) -> Body:
    """Body `name` of complete `parts`, with the rows `extent` of all particles.

    Without lines of sight and with the gradient that the scene names, whose weights are not formed:
    what a picture of the scene needs.
    """
    kernel, cover, formulation = parts.kernel, parts.cover, parts.formulation
    assert kernel is not None
    assert cover is not None
    assert formulation is not None
    shape, particles = parts.shapes[name], parts.sets[name]
    radius = cover * float(particles.spacings.max())
    radii = cover * particles.spacings if particles.graded else None
    return Body(
        name=name,
        shape=shape,
        extent=extent,
        particles=particles,
        smoothing=smoothing_kernel(kernel, particles.dimension, radius, radii),
        material=parts.materials[name],
        formulation=formulation,
    )


def make_body(name: str, parts: Parts, extent: slice) -> Body:
    """The body as a run needs it; arguments as for `plain_body`."""
    body = plain_body(name, parts, extent)
    formulation, particles = body.formulation, body.particles
    moving = formulation.configuration is Configuration.CURRENT
    smoothing = body.smoothing
    if moving and smoothing.radii is not None:
        raise BuildError(
            [
                f"body {name!r}: its spacing varies, from {particles.spacings.min():.4g} to "
                f"{particles.spacings.max():.4g} m, which sums in the current configuration do not "
                "follow; use the formulation 'total-lagrangian', or one spacing"
            ]
        )
    reach = smoothing.support_radius if smoothing.radii is None else smoothing.radii
    if not body.shape.convex:
        BUILD.info("body %r: which neighbours see each other", name)
    hidden = hidden_pairs(body.shape, particles, reach, moving=moving)
    body = attrs.evolve(body, hidden=hidden)
    own = entry_of("gradients", formulation.gradient).name or type(formulation.gradient).__name__
    BUILD.info("body %r: gradient %r", name, own)
    gradient = formulation.gradient.of_body(
        name, particles, body.smoothing, body.pairs, moving=moving
    )
    body = attrs.evolve(body, formulation=formulation.with_gradient(gradient))
    return attrs.evolve(body, dilatation_filter=_dilatation_filter(body))


def _dilatation_filter(body: Body) -> DilatationFilter | None:
    """The filter of a body's dilatation, if its formulation has one for its material."""
    particles, material = body.particles, body.material
    modulus = body.formulation.filtered_modulus(material, particles.dimension)
    if modulus <= 0.0 or material.dilatation is None:
        return None
    BUILD.info("body %r: filter of the dilatation", body.name)
    reach = min(REACH * float(particles.spacings.max()), body.smoothing.support_radius)
    smooth_part = SmoothPart.of(
        body.pairs(reach), particles.spacings, particles.volumes, ~particles.ghosts
    )
    return DilatationFilter(material.dilatation, smooth_part, modulus)
