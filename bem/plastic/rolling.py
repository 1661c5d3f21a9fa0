"""Rolling over an elastic-plastic half-space: a window that travels with the patch over a track that remembers.

The track keeps plastic strain, back stress, residual stress and residual surface of all its columns; the window holds
the columns under the patch now. A step solves the window's plastic strain, and what this adds to the residual stress
and surface is added over a stretch of the track, a `reach` ahead and behind. A periodic track is a ring: the wheel
meets its own track again.
Source: the idea of repeated semi-analytical steps is that of Nelias, Antaluca, Boucly and Cretu, J. Tribol. 129 (2007)
761 (not looked at). Error: stress beyond `reach` is left out; it falls with the square of the reach over the depth of
the zone (tests/bem/plastic/test_rolling.py).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bem.patch import ContactInputError, Grid
from bem.plastic.body import Box, PlasticBody, Trial
from bem.plastic.contact import Agreed, PlasticHalfSpace
from bem.plastic.influence import MOST_MEMORY, Cells
from bem.plastic.surface import SurfaceDisplacement
from bem.steel.return_map import PlasticState


class PlasticTrack:
    """The track under a travelling window.

    body     : the window; its grid's x is counted from the patch
    columns  : of the track, at least the window's
    reach    : columns ahead and behind of a step's plastic strain in which its stress is felt
    state, residual, surface : as of PlasticBody, over all columns
    """

    def __init__(self, body: PlasticBody, columns: int, reach: int, periodic: bool = False) -> None:
        if columns < body.grid.nx or reach < 1:
            raise ContactInputError(
                f"track of {columns} columns with a reach of {reach}: give at least the window's {body.grid.nx}"
                " columns and a reach of 1"
            )
        if periodic and reach > columns // 2:
            raise ContactInputError(f"reach of {reach} columns on a ring of {columns}: give at most half the ring")
        self.body, self.columns, self.reach, self.periodic = body, int(columns), int(reach), periodic
        ny, nz = body.grid.ny, body.layers
        self.state = PlasticState.virgin((nz, 5, columns, ny), body.hardening.back_stresses)
        self.residual = np.zeros((nz, 5, columns, ny))
        self.surface = np.zeros((columns, ny))
        self.known: Box | None = None  # layers and cells across with `residual` known; None where nothing has yielded
        self._surface_kernel: tuple[int, SurfaceDisplacement] | None = None

    @property
    def last(self) -> int:
        """Largest column at which the window can stand (a ring has no such)."""
        return self.columns - 1 if self.periodic else self.columns - self.body.grid.nx

    def stand(self, column: int) -> None:
        """Put the window's first column on a column of the track."""
        if not 0 <= column <= self.last:
            raise ContactInputError(f"column {column} of the track: the window can stand at 0 to {self.last}")
        at = np.arange(column, column + self.body.grid.nx) % self.columns
        body = self.body
        body.state = PlasticState(self.state.strain[:, :, at], self.state.back[:, :, at], self.state.peeq[:, at])
        body.residual, body.surface = self.residual[:, :, at], self.surface[at]
        self.column, self._at = column, at

    def widened(self) -> bool:
        """Whether the window's box has grown across or in depth since the last step that was accepted: then residual
        stress was not known in all of it. It is now, and the step has to be solved again."""
        box, known = self.body.box, self.known
        if known is None or box is None or (box.y == known.y and box.layers == known.layers):
            return False
        self.known = box
        self._feel_again(box)
        return True

    def accept(self, trial: Trial | None) -> None:
        """The window's step becomes the track's."""
        if trial is None or not (trial.returned.along > 0).any():
            return
        body, at, box = self.body, self._at, trial.box
        self.known = box
        body.accept(trial)
        self.state.strain[:, :, at], self.state.back[:, :, at] = body.state.strain, body.state.back
        self.state.peeq[:, at] = body.state.peeq
        self._feel(box, trial.returned.increment, self.column + box.x.start)

    def remembered(self) -> dict[str, np.ndarray]:
        """All that a later step depends on, to be kept in a file while no step is being solved."""
        boxes = {"box": self.body.box, "known": self.known}
        return {
            "strain": self.state.strain, "back": self.state.back, "peeq": self.state.peeq, "residual": self.residual,
            "surface": self.surface, **{name: _numbers(box) for name, box in boxes.items()},
        }  # fmt: skip

    def recall(self, kept: dict[str, np.ndarray]) -> None:
        """Take up what `remembered` of a track of the same cells has told."""
        own = self.remembered()
        wrong = [name for name in own if name in kept and own[name].ndim > 1 and own[name].shape != kept[name].shape]
        if wrong or own.keys() - kept.keys():
            raise ContactInputError(f"track: {', '.join(wrong) or 'arrays'} of another track or missing")
        self.state = PlasticState(kept["strain"], kept["back"], kept["peeq"])
        self.residual, self.surface = kept["residual"], kept["surface"]
        self.body.box, self.known = _box(kept["box"]), _box(kept["known"])
        self.stand(0)

    def know_around(self, across: int, deep: int) -> bool:
        """Let the residual stress be known so many cells farther across and deeper than the steps needed it. False, and
        nothing is changed, where nothing has yielded or the kernels would be too large."""
        box, grid = self.known, self.body.grid
        if box is None:
            return False
        y = slice(max(box.y.start - across, 0), min(box.y.stop + across, grid.ny))
        wider = Box(box.x, y, min(box.layers + deep, self.body.layers))
        if self._wide(wider, box.x.stop - box.x.start).kernel_memory > MOST_MEMORY:
            return False
        self.body.box = self.known = wider
        self._feel_again(wider)
        return True

    def mean_residual(self) -> np.ndarray:
        """(nz, columns, ny) mean stress by the plastic strain [Pa], where `residual` is known."""
        mean, box = np.zeros(self.state.peeq.shape), self.known
        if box is None:
            return mean
        for first, part in self._stretches(box):
            cells = self._wide(box, part.shape[2])
            stress = self.body.influence(cells).mean(self._in_middle(cells, part))
            for k, column in self._felt(first, part.shape[2]):
                mean[: box.layers, column, box.y] += stress[:, k]
        return mean

    def _wide(self, box: Box, count: int) -> Cells:
        """Cells of a box across and in depth, `count` columns long and a reach ahead and behind."""
        grid = self.body.grid
        return Cells(
            grid.dx, grid.dy, self.body.thickness, count + 2 * self.reach, box.y.stop - box.y.start, box.layers
        )

    def _in_middle(self, cells: Cells, increment: np.ndarray) -> np.ndarray:
        """Plastic strain (nz, 5, nx, ny) in the middle of such cells."""
        wide = np.zeros(cells.shape)
        wide[:, :, self.reach : self.reach + increment.shape[2]] = increment
        return wide

    def _felt(self, first: int, count: int) -> Iterator[tuple[int, int]]:
        """Of `count` columns from `first`: columns of the wide cells, and those of the track that they are."""
        low, high = first - self.reach, first + count + self.reach
        for k, column in enumerate(range(low, high)):
            if self.periodic or 0 <= column < self.columns:
                yield k, column % self.columns

    def _feel(self, box: Box, increment: np.ndarray, first: int) -> None:
        """Adds stress and surface by an increment (nz, 5, nx, ny) of plastic strain that begins at column `first`."""
        count = increment.shape[2]
        cells = self._wide(box, count)
        stress = self.body.influence(cells).rough_deviator(self._in_middle(cells, increment))
        full = np.zeros((cells.nz, 5, cells.nx, self.body.grid.ny))
        full[:, :, self.reach : self.reach + count, box.y] = increment
        lowered = self._surface_of(cells.nx)(full)
        for k, column in self._felt(first, count):
            self.residual[: box.layers, :, column, box.y] += stress[:, :, k]
            self.surface[column] += lowered[k]

    def _surface_of(self, count: int) -> SurfaceDisplacement:
        grid = self.body.grid
        if self._surface_kernel is None or self._surface_kernel[0] != count:
            wide = Grid(0.0, grid.y_first, grid.dx, grid.dy, count, grid.ny)
            kernel = SurfaceDisplacement(wide, self.body.layers, self.body.thickness, self.body.elastic)
            self._surface_kernel = count, kernel
        return self._surface_kernel[1]

    def _feel_again(self, box: Box) -> None:
        """The residual stress and surface of the whole track anew, in a larger box."""
        self.residual[:], self.surface[:] = 0.0, 0.0
        for first, part in self._stretches(box):
            self._feel(box, part, first)
        self.body.residual, self.body.surface = self.residual[:, :, self._at], self.surface[self._at]

    def _stretches(self, box: Box) -> Iterator[tuple[int, np.ndarray]]:
        """The plastic strain of the track in stretches of a box's length: first column, (nz, 5, nx, ny)."""
        width = box.x.stop - box.x.start
        for first in range(0, self.columns, width):
            part = self.state.strain[: box.layers, :, first : first + width, box.y]
            if part.any():
                increment = np.zeros((box.layers, 5, width, part.shape[3]))
                increment[:, :, : part.shape[2]] = part
                yield first, increment


def _numbers(box: Box | None) -> np.ndarray:
    """A box as (5,) numbers, none as (0,)."""
    return np.array([] if box is None else [box.x.start, box.x.stop, box.y.start, box.y.stop, box.layers], int)


def _box(numbers: np.ndarray) -> Box | None:
    if not len(numbers):
        return None
    x0, x1, y0, y1, layers = (int(n) for n in numbers)
    return Box(slice(x0, x1), slice(y0, y1), layers)


def agree_on(
    track: PlasticTrack, contact: PlasticHalfSpace, gap: np.ndarray, load: float, tolerance: float, guess: Trial | None
) -> Agreed:
    """Pressure and plastic strain of a contact whose body is the track's window, where it stands, nothing accepted.

    gap, load, tolerance, guess, errors : as of PlasticHalfSpace.agree
    """
    agreed = contact.agree(gap, load, tolerance, guess)
    while track.widened():
        agreed = contact.agree(gap, load, tolerance, agreed.trial)
    return agreed
