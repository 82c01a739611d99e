"""All bare scenes."""

from __future__ import annotations

from collections.abc import Mapping

from tests.bare.balls import BALLS
from tests.bare.beams import BEAMS
from tests.bare.blocks import BLOCKS
from tests.bare.holes import HOLES
from tests.bare.motion import MOTION
from tests.bare.rings import RINGS
from tests.bare.scene import Bare
from tests.bare.torsion import TORSION
from tests.bare.uniform import UNIFORM

SCENES: Mapping[str, Bare] = {
    scene.name: scene
    for scene in (*UNIFORM, *BEAMS, *BLOCKS, *RINGS, *HOLES, *TORSION, *BALLS, *MOTION)
}
