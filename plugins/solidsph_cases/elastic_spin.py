"""A free square that spins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, pi
from typing import final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import finished, vanishing
from solidsph_cases._energy import total_energy
from solidsph_cases._scene import box, check_all_positive, check_count, solid
from solidsph_cases.drawing.fields import LARGEST_STRESS, field, outline, principal_stress
from solidsph_cases.drawing.sheet import Bar, Panel, Sheet, line, mark

SIDE = 1.0  # [m]
RUBBER = NeoHookean(youngs_modulus=17e6, poissons_ratio=0.3, density=1100.0)
ANGULAR_VELOCITY = 105.0  # at the start [rad/s]

# Outputs a turn, and in all, which bounds the record: the phases of a long run fall anywhere.
_OUTPUTS_A_TURN = 20
_MOST_OUTPUTS = 500

# The square is never squeezed to half its length, so particles this close have clumped.
_CLOSEST = 0.5  # spacings


@final
@attrs.frozen
class ElasticSpin(Case):
    """A soft square starts as if it were rigid, stretches in its own rotation, and breathes.

    Nothing acts on it and nothing damps it. Its angular momentum must stay to rounding, since the
    forces derive from an energy that no rotation changes; its energy wavers with the square of the
    time step and must not drift; and its particles must not clump.
    """

    title = "A free elastic square that spins"
    source = "conservation of angular momentum and energy"
    sweep = {
        "across": (11, 21),
        "time_step_factor": (0.1, 0.2, 0.4, 0.6),
        "gradient": ("consistent", "quadratic", "corrected"),
    }
    trials = {
        "10 turns": Trial({"across": 11}, {"turns": 5.0}),
        "1000 turns": Trial({"turns": 1000.0, "across": 11}),
    }

    turns: float = number(default=10.0)  # duration, in turns of the rigid square
    across: int = 21  # particles along a side
    momentum_tolerance: float = number(default=1e-10)  # relative change that passes [-]
    energy_tolerance: float = number(default=1e-3)  # relative drift that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("elastic-spin", "across", self.across, 5)
        check_all_positive("elastic-spin", self, turns="turns")

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The drift of energy; angular momentum is kept to rounding at any cost."""
        return measurements[1]

    def scenes(self) -> Mapping[str, Scene]:
        w, spacing = ANGULAR_VELOCITY, SIDE / (self.across - 1)
        shape = box(SIDE, SIDE, origin=[-0.5 * SIDE, -0.5 * SIDE])
        builder = (
            solid(self.title, "square", shape, spacing, RUBBER)
            .initial(velocity={"x": f"-{w!r}*Y", "y": f"{w!r}*X"})
            .duration(self.turns * 2.0 * pi / w)
            .outputs(min(_MOST_OUTPUTS, ceil(_OUTPUTS_A_TURN * self.turns)))
        )
        return {"spin": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["spin"]
        momentum = angular_momentum(record)
        change = float(np.abs(momentum / momentum[0] - 1.0).max())
        closest = float(smallest_distance(record).min())
        over = f"over {self.turns:g} turns"
        return [
            vanishing(
                record,
                f"largest relative change of angular momentum {over}",
                change,
                self.momentum_tolerance,
                "isotropy of space",
            ),
            vanishing(
                record,
                f"relative drift of energy {over}",
                abs(_energy_drift(record)),
                self.energy_tolerance,
                "a symplectic scheme wavers, and does not drift",
            ),
            Measurement(
                "smallest distance of neighbours",
                closest,
                "spacings",
                verdict="clumped" if closest < _CLOSEST else "apart",
                passed=finished(record) and closest >= _CLOSEST,
            ),
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The square at the end; momentum, energy and distances over the turns."""
        record = records["spin"]
        turns = record.times * ANGULAR_VELOCITY / (2.0 * np.pi)
        body = Panel(
            field(record, -1, principal_stress(record, -1)),
            outline(record.positions[0][record.particles.tagged("surface")]),
            title=f"after {turns[-1]:.4g} turns (dots: at the start)",
            x="x [m]",
            y="y [m]",
        )
        momentum, total = angular_momentum(record), total_energy(record)
        curves = {
            "angular momentum\n(L - L$_0$) / L$_0$": momentum / momentum[0] - 1.0,
            "energy\n(E - E$_0$) / E$_0$": total / total[0] - 1.0,
            "smallest distance\n[spacings]": smallest_distance(record),
        }
        histories = [
            Panel(
                line(turns, values, linewidth=0.9),
                mark("ticklabel_format", axis="y", scilimits=(-2, 2), useMathText=True),
                x="" if row < 2 else "time [turns]",
                y=label,
                grid=True,
                xlim=(0.0, float(turns[-1])),
                ylim=(None, None) if row < 2 else (0.0, None),
            )
            for row, (label, values) in enumerate(curves.items())
        ]
        title = f"{self.title}: {record.particles.count} particles"
        rows = [[body, history] for history in histories]
        bars = [Bar(f"{LARGEST_STRESS} [MPa]", [body], {"location": "bottom"})]
        return {"elastic-spin": Sheet(rows, (11.0, 6.2), title, widths=(1.0, 1.5), bars=bars)}


def angular_momentum(record: Record) -> Array:
    """About the origin at every time, (t,) [kg m^2/s per metre]."""
    masses = RUBBER.density * record.particles.volumes
    x, v = record.positions[:], record.field("velocity")[:]
    return np.asarray((x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]) @ masses)


def _energy_drift(record: Record) -> float:
    """Change of the energy along the straight line that fits it best, over its start [-]."""
    total = total_energy(record)
    times = record.times - record.times.mean()
    slope = float(times @ total / (times @ times))
    return slope * float(np.ptp(record.times)) / float(total[0])


def smallest_distance(record: Record) -> Array:
    """Of any two particles at every time, (t,) [spacings]."""
    spacing = float(record.particles.spacings[0])
    nearest = (cKDTree(positions).query(positions, 2)[0] for positions in record.positions)
    return np.array([np.asarray(distances)[:, 1].min() / spacing for distances in nearest])
