"""A third party's pair term in one module: compiled into the loop, priced, put to sleep."""

from __future__ import annotations

import numpy as np
import pytest

from solidsph.costs.counted import counted
from solidsph.engines.compiled.time_loop.loop import CompiledLoop
from solidsph.interfaces.plan import SumMethod
from solidsph.registry.construct import construct
from solidsph.run.step_by_step import StepByStep
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import conformance
from tests.helpers.scenes import box

EFFECT = """
    from math import sqrt
    import attrs
    import numpy as np
    from solidsph.interfaces.compilable_terms import PairLoad, PairTable
    from solidsph.interfaces.effect import Effect

    @attrs.frozen
    class Springs(Effect):
        # A spring of stiffness k between any two neighbours of a body.

        conserves_momentum = True
        k: float = 10.0  # [N/m]

        def bind(self, model, label):
            tables = []
            for body in model.bodies:
                pairs = body.pairs()
                real = ~body.particles.ghosts
                acts = (pairs.distances > 0.0) & real[pairs.rows] & real[pairs.columns]
                counts = np.bincount(pairs.rows[acts], minlength=body.particles.count)
                columns = pairs.columns[acts] + body.extent.start
                tables.append((counts, columns, pairs.distances[acts]))
            counts, columns, lengths = (np.concatenate(one) for one in zip(*tables))
            table = PairTable(
                starts=np.concatenate([[0], np.cumsum(counts)]),
                columns=columns.astype(np.int32),
                values=np.column_stack([np.full(len(columns), self.k), lengths]),
            )
            # Gershgorin: twice the sum of a particle's springs over its mass.
            real = model.masses > 0.0
            most = (counts[real] / model.masses[real]).max()
            return Bound(label, table, sqrt(2.0 * self.k * most))

    @attrs.frozen(eq=False)
    class Bound(PairLoad):
        label: str
        pairs: PairTable
        stiffness_rate: float

        @staticmethod
        def pull(offset, velocity, values):
            square = 0.0
            for x in offset:
                square = square + x * x
            return values[0] * (1.0 - values[1] / np.sqrt(square))

        def report(self, observation):
            return {}
"""


@pytest.fixture
def springs(foreign) -> None:
    points = "[solidsph.effects]\nsprings = foreign_springs:Springs"
    foreign("foreign-springs", "foreign_springs", EFFECT, points)


def moving(cells: int = 6) -> SceneBuilder:
    return box(2, cells).effect("springs", k=50.0).initial(velocity={"x": "Y", "y": "X*Y"})


def test_whole_steps_are_compiled_with_it(springs: None) -> None:
    simulation = moving().engine("compiled").build()
    loop = simulation.time_loop()
    assert isinstance(loop, CompiledLoop)
    start, stop = simulation.start(), simulation.steps
    one = loop.advance(start, stop)
    other = StepByStep(simulation.dynamics, simulation.integrator).advance(start, stop)
    # Both add the same numbers in other orders.
    assert np.abs(one.positions - other.positions).max() < 1e-12
    assert one.work["springs"] == pytest.approx(other.work["springs"], rel=1e-9)
    assert one.work["springs"] != 0.0


def test_its_pairs_are_counted(springs: None) -> None:
    simulation = moving().engine("compiled").build()
    own = counted(simulation).operations[-1]
    assert own.method is SumMethod.PAIR_LOOPS
    assert own.pairs == simulation.dynamics.internal.pair_count - simulation.particles.count


def test_it_sleeps(springs: None) -> None:
    """Regions that nothing has reached leave it out: what moves is the same."""
    builder = moving(8).engine("matrix")
    plain = builder.build().run().state
    asleep = builder.sleep(slabs=4).build().run().state
    assert np.abs(asleep.positions - plain.positions).max() < 1e-9


def test_it_passes_the_kit(springs: None) -> None:
    results = conformance("effects", construct("effects", "springs"))
    assert [one for one in results if not one.passed] == []
