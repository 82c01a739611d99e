"""A third party's engine: its own module and one entry point, and no change of the core."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph import BuildError, Scene, Simulation
from solidsph.costs.counted import counted
from solidsph.costs.estimated import estimated
from solidsph.interfaces.plan import SumMethod
from solidsph.registry import registry
from tests.helpers.scenes import box

ENGINE = """
    import attrs
    import numpy as np
    from solidsph.interfaces.engine import Engine, InternalForces, StressFields

    @attrs.frozen(eq=False)
    class DenseBody:
        body: object
        gradient: np.ndarray  # (d, n, n)
        force: np.ndarray  # (n, d, n)

        def stress(self, H):
            form, material = self.body.formulation, self.body.material
            F = form.deformation_gradient(np.moveaxis(H, 0, -1))
            P = material.first_piola(F, material.params)
            return np.array(F), np.array(P), np.array(form.flux(F, P))

    @attrs.frozen(eq=False)
    class Dense(InternalForces):
        parts: list

        @property
        def pair_count(self):
            return sum(part.gradient[0].size for part in self.parts)

        def gradients(self, displacements):
            return np.concatenate(
                [
                    np.einsum("kpq,qi->pik", p.gradient, displacements[p.body.extent])
                    for p in self.parts
                ]
            )

        def spread(self, displacements, stress):
            return np.concatenate(
                [np.einsum("pkq,ikq->pi", p.force, stress[:, :, p.body.extent]) for p in self.parts]
            )

        def forces(self, time, displacements):
            H = self.gradients(displacements)
            T = [p.stress(H[p.body.extent])[2] for p in self.parts]
            return self.spread(displacements, np.concatenate(T, axis=-1))

        def fields(self, displacements):
            H, F, P, psi = self.gradients(displacements), [], [], []
            for p in self.parts:
                own, stress, _ = p.stress(H[p.body.extent])
                F.append(np.moveaxis(own, -1, 0))
                P.append(np.moveaxis(stress, -1, 0))
                psi.append(p.body.material.energy(own, p.body.material.params))
            return StressFields(np.concatenate(F), np.concatenate(P), np.concatenate(psi))

    @attrs.frozen
    class DenseEngine(Engine):
        def prepare(self, bodies, conditions, evaluations=1):
            parts = []
            for body in bodies:
                pairs, form, own = body.pairs(), body.formulation, body.particles
                slopes = body.smoothing.gradient(pairs.offsets, pairs.distances)
                g = form.gradient.weights(pairs, slopes, own.cells)
                d = form.divergence.weights(pairs, g, own.volumes)
                G, D = (np.stack([pairs.matrix(one).toarray() for one in w.T]) for w in (g, d))
                parts.append(DenseBody(body, G, np.moveaxis(D, 0, 1)))
            return Dense(parts)
"""


@pytest.fixture
def dense(foreign) -> None:
    points = "[solidsph.engines]\ndense = foreign_dense:DenseEngine"
    foreign("foreign-dense", "foreign_dense", ENGINE, points)


def scene(engine: str) -> Simulation:
    return (
        box(2, 6)
        .boundary("clamp", where="left")
        .effect("hourglass-control")
        .initial(velocity={"y": "X"})
        .engine(engine)
        .build()
    )


def test_it_is_listed_and_named_by_a_scene(dense: None) -> None:
    assert "dense" in registry.names("engines")
    text = scene("dense").scene.to_toml()
    assert 'engine = "dense"' in text
    assert Scene.from_toml(text).engine == "dense"


def test_it_runs_the_scene_as_the_reference_does(dense: None) -> None:
    """To rounding: the sums are the same, in another order."""
    own, reference = (scene(name).run().state.positions for name in ("dense", "matrix"))
    assert np.abs(own - reference).max() < 1e-12 * np.ptp(reference)


def test_its_plan_is_what_costs_read(dense: None) -> None:
    simulation = scene("dense")
    work, n = counted(simulation), simulation.particles.count
    assert work.operations[0].method is SumMethod.UNKNOWN
    assert work.operations[0].pairs == n * n
    assert not simulation.plan.compiles_steps
    assert estimated(simulation.scene).operations[0].method is SumMethod.UNKNOWN
    (entry,) = [one for one in simulation.parts if one.kind == "engines"]
    assert entry.distribution == "foreign-dense"


def test_a_name_that_no_engine_has(dense: None) -> None:
    with pytest.raises(BuildError, match=r"engine 'dens'.*'dense'"):
        Simulation.builder(scene("dense").scene).engine("dens").build()
