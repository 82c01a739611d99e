"""Scenes with one flaw each, and scenes without; as users write them."""

from __future__ import annotations

from typing import NamedTuple

STEEL = "{type = 'linear-elastic', youngs_modulus = 210e9, poissons_ratio = 0.3, density = 7850.0}"
RUBBER = "{type = 'neo-hookean', youngs_modulus = 2e6, poissons_ratio = 0.45, density = 1100.0}"
SLENDER = "{type = 'neo-hookean', youngs_modulus = 200e9, poissons_ratio = 0.0, density = 8000.0}"


class Flawed(NamedTuple):
    """A scene, the warning that it deserves, and a word of the remedy."""

    name: str
    remedy: str
    toml: str


FLAWED = [
    Flawed(
        "several-faces",
        "where = 'top and (Y > 0.09)'",
        f"""
title = "a load on all particles of the upper row, those at its ends included"
duration = 0.05
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.2, 0.1]}}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "Y > 0.09"
traction = {{x = "5e3*min(t/0.02, 1)"}}
""",
    ),
    Flawed(
        "several-faces",
        "where = 'top and (surface and Y > 0.09)'",
        f"""
title = "a load on the surface above a height, the rims of both sides included"
duration = 0.05
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.2, 0.1]}}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "surface and Y > 0.09"
traction = {{x = "5e3*min(t/0.02, 1)"}}
""",
    ),
    Flawed(
        "several-faces",
        "where = 'right and (corner)'",
        f"""
title = "a load on a corner that is a tag of coordinates"
duration = 0.05
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.2, 0.1]}}
spacing = 0.01
tags = {{corner = "X > 0.19 and Y > 0.07"}}
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "pressure"
where = "corner"
pressure = "5e3*min(t/0.02, 1)"
""",
    ),
    Flawed(
        "several-faces",
        "where = 'foot.right', or 'foot.right or head.right'",
        f"""
title = "a load on the right of two bodies, one of which is joined to the other there"
duration = 0.05
material = {RUBBER}
[body.foot]
shape = {{type = "box", lengths = [0.1, 0.1]}}
spacing = 0.01
[body.head]
shape = {{type = "box", lengths = [0.1, 0.1], origin = [0.1, 0.0]}}
spacing = 0.01
[[effect]]
type = "joint"
[[boundary]]
type = "clamp"
where = "foot.left"
[[boundary]]
type = "traction"
where = "right"
traction = {{y = "5e3*min(t/0.02, 1)"}}
""",
    ),
    Flawed(
        "few-across",
        "spacing = 0.01",
        f"""
title = "a sharp corner, and a web far thinner than the body beside it"
duration = 0.01
material = {RUBBER}
[body.sheet]
spacing = 0.02
shape = {{type = "polygon", vertices = [[0, 0], [1, 0], [1, 0.4], [1.5, 0.4], [1.5, 0],
  [2.5, 1.0], [1.5, 1.0], [1.5, 0.45], [1, 0.45], [1, 1], [0, 1]]}}
[[boundary]]
type = "clamp"
where = "edge-10"
[[boundary]]
type = "traction"
where = "edge-5"
traction = {{y = "1e3*min(t/0.008, 1)"}}
""",
    ),
    Flawed(
        "few-across",
        "gradient = 'quadratic'",
        f"""
title = "a neck between two notches, nowhere parallel"
scheme = "corrected"
duration = 0.01
material = {RUBBER}
[body.sheet]
spacing = 0.025
[body.sheet.shape]
type = "difference"
of = {{type = "box", lengths = [2.0, 1.0]}}
minus = [{{type = "polygon", vertices = [[0.55, 1.1], [1.45, 1.1], [1.0, 0.55]]}},
  {{type = "polygon", vertices = [[0.55, -0.1], [1.45, -0.1], [1.0, 0.45]]}}]
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {{x = "1e3*min(t/0.008, 1)"}}
""",
    ),
    Flawed(
        "units",
        "density is in kg/m^3",
        """
title = "a block that sags under its weight, its density in g/cm^3"
duration = 1.0
statics = {}
material = {type = "neo-hookean", youngs_modulus = 2e6, poissons_ratio = 0.3, density = 1.1}
[body.block]
shape = {type = "box", lengths = [0.3, 0.2]}
spacing = 0.02
[[boundary]]
type = "clamp"
where = "bottom"
[[effect]]
type = "body-force"
acceleration = {y = -9.81}
""",
    ),
    Flawed(
        "few-across",
        "gradient = 'quadratic', which needs 3",
        f"""
title = "a steel ruler that swings, two particles thick"
scheme = "corrected"
duration = 0.1
material = {STEEL}
[body.ruler]
shape = {{type = "box", lengths = [0.2, 0.01]}}
spacing = 0.005
[[boundary]]
type = "clamp"
where = "left"
[[initial]]
velocity = {{y = "0.5*(X/0.2)**2"}}
""",
    ),
    Flawed(
        "few-across",
        "spacing = 0.00333",
        f"""
title = "a steel ruler of the recommended scheme, two spacings thick"
duration = 0.1
material = {STEEL}
[body.ruler]
shape = {{type = "box", lengths = [0.2, 0.01]}}
spacing = 0.005
[[boundary]]
type = "clamp"
where = "left"
[[initial]]
velocity = {{y = "0.5*(X/0.2)**2"}}
""",
    ),
    Flawed(
        "few-across",
        "gradient = 'quadratic'",
        f"""
title = "a thin ligament beside a hole"
scheme = "corrected"
duration = 0.01
material = {RUBBER}
[body.sheet]
spacing = 0.01
[body.sheet.shape]
type = "difference"
of = {{type = "box", lengths = [0.3, 0.2]}}
minus = {{type = "disc", radius = 0.08, centre = [0.15, 0.1]}}
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {{x = "1e4*min(t/0.005, 1)"}}
""",
    ),
    Flawed(
        "small-cover",
        "cover = 2.",
        f"""
title = "a kernel cut too close"
scheme = "corrected"
duration = 0.02
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.3, 0.2]}}
spacing = 0.02
[kernel]
type = "gaussian"
cover = 1.7
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "top"
traction = {{x = "2e4*min(t/0.01, 1)"}}
""",
    ),
    Flawed(
        "small-step",
        "cover = 2.6 gives each particle more",
        f"""
title = "eight neighbours for a quadratic fit that is to be consistent"
duration = 0.01
silence = ["small-cover"]
material = {RUBBER}
[body.plate]
shape = {{type = "box", lengths = [0.6, 0.12]}}
spacing = 0.01
[kernel]
type = "cubic-spline"
cover = 1.8
[formulation]
type = "total-lagrangian"
gradient = "consistent"
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {{y = "1e2*min(t/0.005, 1)"}}
""",
    ),
    Flawed(
        "large-cover",
        "cover = 2.6, or add [[effect]] 'hourglass-control'",
        """
title = "a spline as wide as the default of another kernel"
scheme = "corrected"
duration = 1.0
statics = {}
[body.bar]
shape = {type = "box", lengths = [2.0, 0.4]}
spacing = 0.033
[kernel]
type = "cubic-spline"
cover = 3.5
[material]
type = "linear-elastic"
youngs_modulus = 1e6
poissons_ratio = 0.0
density = 1000.0
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {x = 1000.0}
""",
    ),
    Flawed(
        "large-cover",
        "cover = 3",
        f"""
title = "six spacings in space"
duration = 0.01
material = {RUBBER}
[body.cube]
shape = {{type = "box", lengths = [0.1, 0.1, 0.1]}}
spacing = 0.0125
[kernel]
type = "gaussian"
cut = 6.0
cover = 6.0
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "top"
traction = {{y = "-2e4*min(t/0.005, 1)"}}
""",
    ),
    Flawed(
        "surface-rows",
        "the same discretisation for every body",
        """
title = "a block whose rows begin on its surface, and another whose rows begin inside"
duration = 1.0
statics = {}
[body.block]
shape = {type = "box", lengths = [1.0, 1.0]}
spacing = 0.1
discretisation = {type = "lattice", on_boundary = true}
[body.other]
shape = {type = "box", lengths = [1.0, 1.0], origin = [0.0, 2.0]}
spacing = 0.1
discretisation = "lattice"
[material]
type = "linear-elastic"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {x = 1000.0}
""",
    ),
    Flawed(
        "half-supports",
        "ghosts = 3",
        """
title = "a quarter of a sheet with a hole"
duration = 1.0
statics = {}
[body.sheet]
spacing = 0.05
discretisation = {type = "lattice", on_boundary = true, ghosts = 4, ghost_faces = ["bottom"]}
[body.sheet.shape]
type = "difference"
of = {type = "box", lengths = [1.0, 1.0]}
minus = {type = "disc", radius = 0.2}
[formulation]
type = "total-lagrangian"
gradient = "corrected"
[material]
type = "linear-elastic"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
[[boundary]]
type = "symmetry"
axis = "x"
[[boundary]]
type = "symmetry"
axis = "y"
[[boundary]]
type = "traction"
where = "right"
traction = {x = 1000.0}
""",
    ),
    Flawed(
        "near-incompressible",
        "hourglass-control",
        """
title = "a rubber bearing that is sheared"
scheme = "corrected"
duration = 0.05
[material]
type = "neo-hookean"
youngs_modulus = 2e6
poissons_ratio = 0.499
density = 1100.0
[body.bearing]
shape = {type = "box", lengths = [0.2, 0.1]}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "prescribed-motion"
where = "top"
displacement = {x = "0.02*(1-cos(pi*t/0.05))", y = 0}
""",
    ),
    Flawed(
        "unseen-motions",
        "hourglass-control",
        """
title = "a column thrown to the side"
duration = 0.5
[material]
type = "neo-hookean"
youngs_modulus = 17e6
poissons_ratio = 0.3
density = 1100.0
[body.column]
shape = {type = "box", lengths = [1.0, 3.0]}
spacing = 0.125
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "bottom"
[[initial]]
velocity = {x = "10*Y"}
""",
    ),
    Flawed(
        "bar-speed",
        "poissons_ratio = 0",
        f"""
title = "a pulse in a steel rod"
duration = 1e-4
material = {STEEL}
[body.rod]
shape = {{type = "interval", length = 0.5}}
spacing = 0.005
[[boundary]]
type = "traction"
where = "left"
traction = {{x = "1e6*sin(pi*min(t/3e-5, 1))**2"}}
""",
    ),
    Flawed(
        "sudden-load",
        "artificial-viscosity",
        f"""
title = "a hammer on a plate"
duration = 2e-5
material = {STEEL}
[body.plate]
shape = {{type = "box", lengths = [0.1, 0.05]}}
spacing = 0.0025
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "top"
traction = {{y = -3e8}}
""",
    ),
    Flawed(
        "sudden-load",
        "artificial-viscosity",
        f"""
title = "a bar that runs against a wall"
duration = 2e-5
material = {SLENDER}
[body.bar]
shape = {{type = "interval", length = 0.1}}
spacing = 0.001
[[boundary]]
type = "clamp"
where = "left"
[[initial]]
velocity = {{x = -300}}
""",
    ),
    Flawed(
        "slow-load",
        "[statics]",
        f"""
title = "a tension test of a minute"
duration = 60.0
material = {STEEL}
[body.specimen]
shape = {{type = "box", lengths = [0.1, 0.02]}}
spacing = 0.002
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {{x = "1e8*t/60"}}
""",
    ),
    Flawed(
        "slow-load",
        "[statics]",
        f"""
title = "a block that is damped until it rests"
duration = 20.0
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.3, 0.2]}}
spacing = 0.02
[[boundary]]
type = "clamp"
where = "bottom"
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
[[effect]]
type = "mass-damping"
rate = 200.0
""",
    ),
    Flawed(
        "pressed-at-start",
        "move them apart",
        f"""
title = "a block dropped into a table"
silence = ["unheld"]
duration = 0.1
material = {RUBBER}
[body.table]
shape = {{type = "box", lengths = [0.4, 0.1]}}
spacing = 0.01
[body.block]
shape = {{type = "box", lengths = [0.2, 0.2], origin = [0.1, 0.1]}}
spacing = 0.02
[[boundary]]
type = "clamp"
where = "table and Y < 0.01"
[[initial]]
where = "block"
displacement = {{y = -0.0003}}
[[effect]]
type = "contact"
""",
    ),
    Flawed(
        "pressed-at-start",
        "no clearance",
        f"""
title = "a block with particles on its lower side, on the ground"
silence = ["unheld"]
duration = 0.1
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.2, 0.2]}}
spacing = 0.02
discretisation = {{type = "lattice", on_boundary = true}}
[formulation]
type = "total-lagrangian"
gradient = "corrected"
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
[[effect]]
type = "rigid-wall"
point = {{y = 0}}
normal = {{y = 1}}
clearance = 0.5
""",
    ),
    Flawed(
        "bodies-meet",
        "solidsph plugins",
        f"""
title = "two rings that fly at each other"
duration = 0.02
material = {RUBBER}
[body.left]
shape = {{type = "annulus", inner_radius = 0.03, outer_radius = 0.05}}
spacing = 0.004
[body.right]
shape = {{type = "annulus", inner_radius = 0.03, outer_radius = 0.05, centre = [0.15, 0.0]}}
spacing = 0.004
[[initial]]
where = "left"
velocity = {{x = 5}}
[[initial]]
where = "right"
velocity = {{x = -5}}
""",
    ),
    Flawed(
        "bodies-meet",
        "move them apart",
        f"""
title = "a block laid on a table"
duration = 0.02
material = {RUBBER}
[body.table]
shape = {{type = "box", lengths = [0.4, 0.1]}}
spacing = 0.02
[body.block]
shape = {{type = "box", lengths = [0.2, 0.2], origin = [0.1, 0.1]}}
spacing = 0.02
[[boundary]]
type = "clamp"
where = "Y < 0.02"
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
where = "block"
""",
    ),
    Flawed(
        "deep-clamp",
        "shorten",
        f"""
title = "a beam of which half is in the wall"
duration = 0.02
material = {RUBBER}
[body.beam]
shape = {{type = "box", lengths = [1.0, 0.1]}}
spacing = 0.0125
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "X < 0.5"
[[boundary]]
type = "traction"
where = "right"
traction = {{x = "1e4*min(t/0.01, 1)"}}
""",
    ),
    Flawed(
        "units",
        "7850",
        """
title = "density in g/cm^3"
duration = 2e-5
[material]
type = "linear-elastic"
youngs_modulus = 70e9
poissons_ratio = 0.33
density = 2.7
[body.plate]
shape = {type = "box", lengths = [0.2, 0.1]}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {x = "1e6*min(t/1e-5, 1)"}
""",
    ),
    Flawed(
        "overloaded",
        "check the units",
        """
title = "a modulus in MPa under a traction in Pa"
duration = 0.5
[material]
type = "neo-hookean"
youngs_modulus = 210e3
poissons_ratio = 0.3
density = 7850.0
[body.plate]
shape = {type = "box", lengths = [0.2, 0.1]}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {x = "5e6*min(t/0.2, 1)"}
""",
    ),
    Flawed(
        "unheld",
        "clamp",
        f"""
title = "a plate that somebody forgot to hold"
duration = 10.0
material = {RUBBER}
[statics]
load_steps = 1
[body.plate]
shape = {{type = "box", lengths = [0.2, 0.1]}}
spacing = 0.01
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
""",
    ),
    Flawed(
        "nothing-happens",
        "add a load",
        f"""
title = "a load that is nothing"
duration = 0.02
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.2, 0.1]}}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {{x = 0.0}}
""",
    ),
    Flawed(
        "viscosity-unneeded",
        "leave the effect out",
        f"""
title = "a cantilever that swings gently"
duration = 1.0
material = {RUBBER}
[body.beam]
shape = {{type = "box", lengths = [0.5, 0.06]}}
spacing = 0.01
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "left"
[[initial]]
velocity = {{y = "0.2*(X/0.5)**2"}}
[[effect]]
type = "artificial-viscosity"
""",
    ),
    Flawed(
        "hourglass-unneeded",
        "leave the effect out",
        f"""
title = "a bar with a control of bending"
duration = 1e-4
material = {SLENDER}
[body.bar]
shape = {{type = "interval", length = 0.15}}
spacing = 0.0025
[[boundary]]
type = "traction"
where = "left"
traction = {{x = "1e6*sin(pi*min(t/3e-5, 1))**2"}}
[[effect]]
type = "hourglass-control"
""",
    ),
    Flawed(
        "overdamped",
        "rate = ",
        f"""
title = "a block in honey"
duration = 0.5
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.3, 0.2]}}
spacing = 0.02
[[boundary]]
type = "clamp"
where = "bottom"
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
[[effect]]
type = "mass-damping"
rate = 1e5
""",
    ),
    Flawed(
        "coarse-outputs",
        "outputs = ",
        f"""
title = "a tuning fork of which twenty pictures are kept"
duration = 0.2
outputs = 20
material = {STEEL}
[body.tine]
shape = {{type = "box", lengths = [0.1, 0.01]}}
spacing = 0.002
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "left"
[[initial]]
velocity = {{y = "0.5*(X/0.1)**2"}}
""",
    ),
    Flawed(
        "twice",
        "leave one out",
        f"""
title = "gravity by two files"
duration = 0.5
material = {RUBBER}
[body.beam]
shape = {{type = "box", lengths = [0.5, 0.06]}}
spacing = 0.01
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "left"
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
""",
    ),
    Flawed(
        "few-steps",
        "a longer duration",
        f"""
title = "milliseconds that were meant to be seconds"
duration = 1e-3
material = {RUBBER}
[body.beam]
shape = {{type = "box", lengths = [5.0, 0.6]}}
spacing = 0.1
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "left"
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
""",
    ),
]

SOUND = [
    """
title = "Cook's membrane at rest, of no unit: sharp corners, and 16 at its narrow end"
duration = 1.0
statics = {}
material = {type = "neo-hookean", youngs_modulus = 1.0, poissons_ratio = 0.3, density = 1.0}
[body.membrane]
shape = {type = "polygon", vertices = [[0, 0], [48, 44], [48, 60], [0, 44]]}
spacing = 2.0
[[boundary]]
type = "clamp"
where = "edge-3"
[[boundary]]
type = "traction"
where = "edge-1"
traction = {y = 1e-3}
""",
    f"""
title = "a sheet with corners of 20 degrees, 0.36 wide"
scheme = "corrected"
duration = 0.01
material = {RUBBER}
[body.sheet]
shape = {{type = "polygon", vertices = [[0, 0], [2, 0], [3, 0.364], [1, 0.364]]}}
spacing = 0.04
[[boundary]]
type = "clamp"
where = "edge-3"
[[boundary]]
type = "traction"
where = "edge-1"
traction = {{x = "1e3*min(t/0.008, 1)"}}
""",
    f"""
title = "two blocks made one, whose seam is no surface"
duration = 0.05
material = {RUBBER}
[body.block]
spacing = 0.02
shape = {{type = "union", of = [{{type = "box", lengths = [0.4, 0.08]}},
  {{type = "box", lengths = [0.4, 0.08], origin = [0.0, 0.08]}}]}}
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "top"
traction = {{x = "5e3*min(t/0.02, 1)"}}
""",
    f"""
title = "a quarter of a sheet, pulled: planes of symmetry with ghosts hold it"
duration = 1.0
statics = {{}}
material = {RUBBER}
[body.quarter]
shape = {{type = "box", lengths = [0.2, 0.2]}}
spacing = 0.02
discretisation = {{type = "lattice", ghosts = 4, ghost_faces = ["left", "bottom"]}}
[[boundary]]
type = "symmetry"
axis = "x"
[[boundary]]
type = "symmetry"
axis = "y"
[[boundary]]
type = "traction"
where = "right"
traction = {{x = 1e4}}
""",
    f"""
title = "a load on part of one face of two bodies that are joined"
duration = 0.05
material = {RUBBER}
[body.foot]
shape = {{type = "box", lengths = [0.1, 0.1]}}
spacing = 0.01
[body.head-1]
shape = {{type = "box", lengths = [0.1, 0.1], origin = [0.1, 0.0]}}
spacing = 0.01
[[effect]]
type = "joint"
[[boundary]]
type = "clamp"
where = "foot.left"
[[boundary]]
type = "traction"
where = "head-1.right and Y > 0.05"
traction = {{y = "5e3*min(t/0.02, 1)"}}
""",
    f"""
title = "a beam that sags and swings, fine enough"
duration = 2.0
outputs = 400
material = {RUBBER}
[body.beam]
shape = {{type = "box", lengths = [0.35, 0.02]}}
spacing = 0.004
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "left"
[[effect]]
type = "body-force"
acceleration = {{y = -2.0}}
[[effect]]
type = "hourglass-control"
""",
    f"""
title = "a smooth pulse in a slender bar"
duration = 1e-4
material = {SLENDER}
[body.bar]
shape = {{type = "interval", length = 0.15}}
spacing = 0.0025
[kernel]
type = "modified-mollifier"
cover = 3.5
[[boundary]]
type = "traction"
where = "left"
traction = {{x = "1e6*sin(pi*min(t/3e-5, 1))**2"}}
""",
    f"""
title = "a bar against a wall, with viscosity"
duration = 2e-5
material = {SLENDER}
[body.bar]
shape = {{type = "interval", length = 0.1}}
spacing = 0.001
[[boundary]]
type = "clamp"
where = "left"
[[initial]]
velocity = {{x = -300}}
[[effect]]
type = "artificial-viscosity"
""",
    f"""
title = "a disc that spins"
duration = 0.1
material = {RUBBER}
[body.disc]
shape = {{type = "disc", radius = 0.1}}
spacing = 0.01
[[initial]]
velocity = {{x = "-40*Y", y = "40*X"}}
""",
    """
title = "a slab that creeps under a slow load"
duration = 20.0
[material]
type = "viscoelastic"
youngs_modulus = 1e4
poissons_ratio = 0.4
density = 1000.0
prony = [{share = 0.5, time = 5.0}]
[body.slab]
shape = {type = "box", lengths = [0.2, 0.1]}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "top"
traction = {y = "-500*min(t/10, 1)"}
""",
    f"""
title = "a cube pressed in space"
duration = 0.02
material = {RUBBER}
[body.cube]
shape = {{type = "box", lengths = [0.1, 0.1, 0.1]}}
spacing = 0.0125
[kernel]
type = "cubic-spline"
cover = 2.6
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "top"
traction = {{y = "-1e5*min(t/0.01, 1)"}}
[[effect]]
type = "hourglass-control"
""",
    """
title = "a thick ring under its weight, at rest"
duration = 1.0
[statics]
load_steps = 2
[material]
type = "saint-venant-kirchhoff"
youngs_modulus = 1e6
poissons_ratio = 0.3
density = 1000.0
[body.ring]
shape = {type = "annulus", inner_radius = 0.1, outer_radius = 0.2}
spacing = 0.0125
[[boundary]]
type = "clamp"
where = "Y < -0.18"
[[effect]]
type = "body-force"
acceleration = {y = -9.81}
""",
    """
title = "a sheet with a hole, pulled quickly but smoothly"
duration = 0.004
[material]
type = "neo-hookean"
youngs_modulus = 7e7
poissons_ratio = 0.3
density = 1000.0
[body.sheet]
spacing = 0.025
[body.sheet.shape]
type = "difference"
of = {type = "box", lengths = [1.0, 0.6]}
minus = {type = "disc", radius = 0.15, centre = [0.5, 0.3]}
[[boundary]]
type = "clamp"
where = "left"
[[boundary]]
type = "traction"
where = "right"
traction = {x = "3e6*min(t/2e-3, 1)"}
""",
    """
title = "a rubber column thrown to the side, controlled"
duration = 0.5
[material]
type = "neo-hookean"
youngs_modulus = 17e6
poissons_ratio = 0.45
density = 1100.0
[body.column]
shape = {type = "box", lengths = [1.0, 3.0]}
spacing = 0.125
[formulation]
type = "total-lagrangian"
gradient = "quadratic"
[[boundary]]
type = "clamp"
where = "bottom"
[[initial]]
velocity = {x = "10*Y"}
[[effect]]
type = "hourglass-control"
""",
    """
title = "a rubber column thrown to the side, by the recommended scheme"
duration = 0.5
[material]
type = "neo-hookean"
youngs_modulus = 17e6
poissons_ratio = 0.3
density = 1100.0
[body.column]
shape = {type = "box", lengths = [1.0, 3.0]}
spacing = 0.125
[[boundary]]
type = "clamp"
where = "bottom"
[[initial]]
velocity = {x = "10*Y"}
""",
    f"""
title = "two blocks far apart, each held"
duration = 0.05
material = {RUBBER}
[body.near]
shape = {{type = "box", lengths = [0.2, 0.1]}}
spacing = 0.01
[body.far]
shape = {{type = "box", lengths = [0.2, 0.1], origin = [1.0, 0.0]}}
spacing = 0.01
[[boundary]]
type = "clamp"
where = "bottom"
[[boundary]]
type = "traction"
where = "top"
traction = {{x = "5e3*min(t/0.02, 1)"}}
""",
    f"""
title = "a plate swept by a wave from a ramp, in plane strain"
duration = 1e-4
material = {STEEL}
[body.plate]
shape = {{type = "polygon", vertices = [[0, 0], [0.2, 0], [0.2, 0.1], [0, 0.05]]}}
spacing = 0.005
[[boundary]]
type = "traction"
where = "(edge-0 or edge-2 or edge-3) and X < 1e-2"
traction = {{x = "1e7*sin(pi*min(t/4e-5, 1))**2"}}
""",
    f"""
title = "a block that comes to rest, damped at what is critical"
duration = 0.3
material = {RUBBER}
[body.block]
shape = {{type = "box", lengths = [0.3, 0.2]}}
spacing = 0.02
[[boundary]]
type = "clamp"
where = "bottom"
[[effect]]
type = "body-force"
acceleration = {{y = -9.81}}
[[effect]]
type = "mass-damping"
rate = 400.0
""",
    f"""
title = "a ball that falls freely"
duration = 0.05
material = {RUBBER}
[body.ball]
shape = {{type = "ball", radius = 0.05}}
spacing = 0.01
[[effect]]
type = "body-force"
acceleration = {{z = -9.81}}
""",
]
