"""A section's mesh while it is built: its nodes, its quads by kind, and the shape that each quad should have."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from geometry.meshing.hexmesh import MeshError
from geometry.meshing.section.curve import SectionCurve
from geometry.meshing.section.smoothing import Smoother, corner_targets

Made = TypeVar("Made")
GROWTH, DEPTH_GROWTH = 1.3, 1.15  # of neighbouring sizes away from the block, of neighbouring layers in it
KINDS = ("fine", "strip", "coarse")
# below this depth of a crossing's section [m] sizes may grow by a share of what lies deeper: a field spreads over the
# depth it has come to
DEEPER_FROM, DEEPER = 0.065, 0.2
TRIPLE_LIMIT = 0.85  # three fine sizes over the coarse one up to which the triple ring pays


@dataclass(frozen=True)
class SectionSizes:
    """Sizes of a section's mesh, lengths in m.

    fine : element size under the band;  depth : of the fine zone;  coarse : largest size down to
        deeper_from [m] below the section's top
    triple_ring : whether sizes triple along the outline in a ring round the block
    """

    fine: float
    depth: float
    coarse: float
    triple_ring: bool = True
    deeper_from: float = DEEPER_FROM

    def largest(self, below: np.ndarray) -> np.ndarray:
        """Largest size at depths below the section's top (k,) [m]."""
        return self.coarse + DEEPER * np.maximum(below - self.deeper_from, 0.0)


def size_errors(fine: float, coarse: float, depth: float) -> list[str]:
    """What is wrong with sizes [m]."""
    return [
        f"{what} {size * 1e3:.2f} mm is below the element size {fine * 1e3:.2f} mm: take smaller elements or a {remedy}"
        for what, size, remedy in (("coarse size", coarse, "larger one"), ("fine_depth", depth, "deeper fine zone"))
        if size < fine
    ]


def try_sizes(
    make: Callable[[SectionSizes], Made], fine: float, depth: float, coarse: float, deeper_from: float = DEEPER_FROM
) -> Made:
    """What `make` makes with the triple ring where that pays, or without it where it fails or does not pay; lengths in
    m.

    Raises the first MeshError where nothing succeeds.
    """
    errors = []
    for triple_ring in (True, False) if 3 * fine <= TRIPLE_LIMIT * coarse else (False,):
        try:
            return make(SectionSizes(fine, depth, coarse, triple_ring=triple_ring, deeper_from=deeper_from))
        except MeshError as error:
            errors.append(error)
    raise errors[0]


@dataclass
class SectionParts:
    """What of a section is there so far.

    points : node positions [m];  arc : arc length [m] of each node on the outline
    cells, ideal, size_weight : by kind, lists of node numbers (k, 4) (strip: (k, 6), see QuadSection), of ideal corner
        positions
    (k, 4, 2) [m] and of weights (k,)
    """

    curve: SectionCurve
    sizes: SectionSizes
    points: list = field(default_factory=list)
    arc: dict[int, float] = field(default_factory=dict)
    cells: dict[str, list] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    ideal: dict[str, list] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    size_weight: dict[str, list] = field(default_factory=lambda: {kind: [] for kind in KINDS})

    def add_nodes(self, points: np.ndarray) -> np.ndarray:
        """Numbers (k,) of new nodes at points (k, 2)."""
        numbers = np.arange(len(self.points), len(self.points) + len(points))
        self.points += list(points)
        return numbers

    def add_on_outline(self, arcs: np.ndarray) -> np.ndarray:
        """Numbers (k,) of new nodes on the outline at arc lengths (k,)."""
        numbers = self.add_nodes(self.curve.at(arcs))
        self.arc |= dict(zip(numbers.tolist(), np.asarray(arcs, dtype=float).tolist()))
        return numbers

    def add_chain(self, points: np.ndarray, arcs: tuple[float, float]) -> np.ndarray:
        """Numbers of new nodes along a chain (k, 2) whose two ends lie on the outline at arcs."""
        return np.concatenate(
            [
                self.add_on_outline(np.array(arcs[:1])),
                self.add_nodes(points[1:-1]),
                self.add_on_outline(np.array(arcs[1:])),
            ]
        )

    def add_cells(self, kind: str, cells: np.ndarray, ideal: np.ndarray, size_weight: float) -> None:
        """Add quads of a kind with their ideal corner positions (k, 4, 2) [m]; size_weight as in Smoother."""
        self.cells[kind].append(cells)
        self.ideal[kind].append(ideal)
        self.size_weight[kind].append(np.full(len(cells), size_weight))

    def at(self, numbers: np.ndarray) -> np.ndarray:
        """Positions (k, 2) of nodes (k,)."""
        return np.array([self.points[number] for number in numbers])

    def all_of(self, kind: str) -> np.ndarray:
        """All cells of a kind so far."""
        return (
            np.concatenate(self.cells[kind])
            if self.cells[kind]
            else np.zeros((0, 6 if kind == "strip" else 4), dtype=int)
        )

    def smooth(self, base: np.ndarray, rounds: tuple[float, ...]) -> Smoother:
        """Move the nodes inside the body to good shapes; outline, base nodes and the strips' middles stay. Returns the
        smoother."""
        quads = np.concatenate([self.all_of("fine"), self.all_of("strip")[:, [0, 4, 5, 1]], self.all_of("coarse")])
        ideal, weight = (
            np.concatenate([part for kind in KINDS for part in column[kind]])
            for column in (self.ideal, self.size_weight)
        )
        free = np.zeros(len(self.points), dtype=bool)
        free[quads] = True
        free[list(self.arc)] = free[base] = False
        smoother = Smoother(quads, corner_targets(ideal), weight, free)
        self.points = list(smoother.smooth(np.array(self.points), rounds))
        return smoother


def rectangle(width: float, height: float) -> np.ndarray:
    """Corner positions (4, 2) of a rectangle, from the top left one anticlockwise."""
    return np.array([[0, 0], [0, -height], [width, -height], [width, 0]])
