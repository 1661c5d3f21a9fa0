"""Two blocks of hexahedra that face each other node by node: what the static contact solver takes
(rail_fem/static_fe/solid_contact.py).

The faces are heights h(x, s) [m] over a common tangent plane, both touching it at the origin; x forward, s lateral, h
up. The pair is symmetric about x = 0, so that half of it is meshed. Both blocks share the same lines of nodes along x
and s; a block that ends earlier along s has a free side there, an edge.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bem.material import STEEL, Elastic
from bem.plane.body import Body
from bem.plane.outline import block_behind
from bem.slices.slices import Slices, slices_of_profiles
from geometry.meshing.axis import graded_line, growing_steps
from geometry.meshing.blocks import mesh_block
from geometry.meshing.hexmesh import HexMesh, MeshError

Height = Callable[[np.ndarray, np.ndarray], np.ndarray]  # h(x, s) [m]
_SAME = 1e-9  # lines nearer than this are one line [m]


@dataclass(frozen=True)
class BlockPair:
    """Two blocks about their first point of contact.

    lower, upper : faces;  length : both reach to +- this along x [m];  depth : behind the initial contact [m]
    lower_across, upper_across : (2,) from, to along s [m]
    """

    lower: Height
    upper: Height
    lower_across: tuple[float, float]
    upper_across: tuple[float, float]
    length: float = 0.030
    depth: float = 0.035
    lower_steel: Elastic = STEEL
    upper_steel: Elastic = STEEL

    @property
    def common(self) -> tuple[float, float]:
        """Range along s [m] where both have a face."""
        return max(self.lower_across[0], self.upper_across[0]), min(self.lower_across[1], self.upper_across[1])

    def gap(self, x: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Gap [m] at (x, s) [m], +inf where a block has no face, as bem.halfspace.normal takes it."""
        low, high = self.common
        there = (np.asarray(s) >= low - _SAME) & (np.asarray(s) <= high + _SAME) & (np.abs(x) <= self.length)
        return np.where(there, self.upper(x, np.clip(s, low, high)) - self.lower(x, np.clip(s, low, high)), np.inf)

    def slices(self, positions: int = 41, points: int = 481) -> Slices:
        """The same blocks for the slices of `bem`, prisms of their sections at x = 0 with the true gap. The lower face
        must not change along x."""
        lines = [np.linspace(*across, points) for across in (self.lower_across, self.upper_across)]
        faces = [np.column_stack([s, height(0 * s, s)]) for s, height in zip(lines, (self.lower, self.upper))]
        bodies = (
            Body(block_behind(faces[0], -self.depth), self.lower_steel),
            Body(block_behind(faces[1], self.depth), self.upper_steel),
        )
        x, s = np.linspace(-self.length, self.length, positions) / 2, lines[1]
        return slices_of_profiles(
            *bodies, x, upper_profiles=[np.column_stack([s, self.upper(0 * s + position, s)]) for position in x]
        )


@dataclass(frozen=True)
class FineZone:
    """Where elements have their size: 0 to `along` in x, `across` (2,) in s, `down` from the face [m].

    size, width : of elements along x and down, along s [m];  growth : of neighbouring elements outside, to be brought
        towards 1 with the size
    """

    along: float
    across: tuple[float, float]
    down: float
    size: float
    width: float
    growth: float = 1.2


@dataclass(frozen=True)
class LinedBlock:
    """A mesh whose nodes are numbered along lines x (a,), s (b,) and z (c,) [m] from the face, z fastest, then s; s
    counts from its node `first` where both blocks' faces begin."""

    mesh: HexMesh
    x: np.ndarray
    s: np.ndarray
    z: np.ndarray
    first: int

    def face(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Nodes on the face by number along x and along the common line of s."""
        return (i * len(self.s) + j + self.first) * len(self.z)


def facing_blocks(pair: BlockPair, zone: FineZone) -> tuple[LinedBlock, LinedBlock, np.ndarray]:
    """Lower and upper block, and the line s (m,) [m] that both share."""
    low, high = pair.common
    fine = max(zone.across[0], low), min(zone.across[1], high)
    if not fine[1] > fine[0]:
        raise MeshError(
            f"the fine zone {zone.across} m along s lies beside the faces' common range {pair.common} m: move it"
        )
    x = graded_line(0.0, pair.length, (0.0, min(zone.along, pair.length)), zone.size, zone.growth)
    z = graded_line(0.0, pair.depth, (0.0, min(zone.down, pair.depth)), zone.size, zone.growth)
    s = graded_line(low, high, fine, zone.width, zone.growth)
    blocks = []
    for height, across, facing in ((pair.lower, pair.lower_across, "up"), (pair.upper, pair.upper_across, "down")):
        line = _led_on(s, across, zone.growth)
        blocks.append(
            LinedBlock(mesh_block(height, x, line, z, facing, facing), x, line, z, int(np.argmin(np.abs(line - s[0]))))
        )
    return *blocks, s


def _led_on(s: np.ndarray, across: tuple[float, float], growth: float) -> np.ndarray:
    """The line s led on to both ends of `across` by growing steps."""
    before = growing_steps(s[1] - s[0], s[0] - across[0], growth, np.inf)
    after = growing_steps(s[-1] - s[-2], across[1] - s[-1], growth, np.inf)
    return np.concatenate([s[0] - np.cumsum(before)[::-1], s, s[-1] + np.cumsum(after)])
