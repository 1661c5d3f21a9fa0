"""Loads one after the other on a section that yields: each brought to equilibrium, the zone grown as it spreads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bem.checks import point_text
from bem.exact.subsurface import von_mises
from bem.plane_plastic.increment import Increment, solve_increment
from bem.plane_plastic.section import PlasticSection, flat
from bem.plastic.increment import NoEquilibriumError
from bem.steel.hardening import nearly_incompressible
from bem.steel.return_map import advanced

_NEARLY = 0.98  # of the yield stress from which a cell takes part
_HALVINGS = 7  # of a load step that has no equilibrium


@dataclass
class Step:
    """A load in equilibrium. load : its factor; residuals : of Newton, of the last solution; active, flowing : cells
    that take part and that flow in it; peeq : (m,) equivalent plastic strain; warnings"""

    load: float
    residuals: list[float]
    active: int
    flowing: int
    peeq: np.ndarray
    warnings: tuple[str, ...] = field(default=())


def reach(
    section: PlasticSection,
    load_at: Callable[[float], Any],
    accept: Callable[[float, Increment, Any], None],
    describe: Callable[[float], str],
    tolerance: float,
) -> None:
    """Equilibrium along a load's way from share 0 (held now) to 1, in smaller steps where it must be.

    load_at : share -> load, as for `settle`; accept : takes what was found; describe : a share in words
    Errors: NoEquilibriumError with the last share in equilibrium, which was accepted; CellError.
    """
    reached, step = 0.0, 1.0
    while reached < 1.0:
        share = 1.0 if reached + step > 1.0 - 1e-9 else reached + step
        load = load_at(share)
        try:
            found = settle(section, load, tolerance)
        except NoEquilibriumError as failure:
            step /= 2
            if step < 0.5**_HALVINGS:
                raise NoEquilibriumError(
                    f"no equilibrium beyond {describe(reached)} on the way to {describe(1.0)}: the body carries no"
                    f" more, or the cells are too coarse (steps down to {2 * step:.2g} of the way tried; {failure})"
                ) from None
            continue
        accept(share, found, load)
        reached = share


def settle(section: PlasticSection, load, tolerance: float) -> Increment:
    """Equilibrium under a load, with as many cells as it takes. load : as in solve_increment, with `density` (2 n,) and
    `loads`, which after a call are those of the last plastic stress."""
    start = None
    while True:
        found = solve_increment(section, load, start, tolerance)
        flowing = np.zeros(section.cells.count, bool)
        flowing[section.active] = found.returned.along[:, 0, 0] > 0
        section.refuse_at_rim(flowing)
        wanted = section.cells.around(flowing) | _yielding(section, load, found)
        before = len(section.active)
        if not section.grow(wanted):
            return found
        so_far = 2 * section.elastic.shear * flat(section.state.strain[section.active[:before]])
        increment = (found.plastic - so_far).reshape(3, -1)
        start = np.zeros((3, len(section.active)))
        start[:, :before] = increment
        start = start.ravel()


def _yielding(section: PlasticSection, load, found: Increment) -> np.ndarray:
    """(m,) bool: cells that do not take part and whose stress nearly yields."""
    out = np.zeros(section.cells.count, bool)
    others = np.flatnonzero(section.position < 0)
    if len(others):
        load(found.plastic, False)
        deviator = section.strain_at(section.cells.centers[others], load.density, found.plastic, load.loads)
        out[others] = np.sqrt(1.5 * (deviator**2).sum(axis=0)) > _NEARLY * section.hardening.first_yield
    return out


def accepted(section: PlasticSection, found: Increment, load: float) -> Step:
    """The state moves on by an increment."""
    part = advanced(section.part(), found.returned, section.hardening)
    section.state.strain[section.active] = part.strain
    section.state.back[section.active] = part.back
    section.state.peeq[section.active] = part.peeq
    flowing = int((found.returned.along > 0).sum())
    peeq = section.state.peeq[:, 0, 0].copy()
    warnings = nearly_incompressible(section.elastic)
    return Step(load, found.residuals, len(section.active), flowing, peeq, warnings)


def unseen(section: PlasticSection, stress: np.ndarray) -> tuple[str, ...]:
    """A warning where nothing has yielded but cells (m,) at their end are loaded most, by stress (m, 4) as below."""
    worst = int(np.argmax(von_mises(np.insert(stress, [3, 3], 0.0, axis=1))))
    if section.state.peeq.any() or not (section.rim[worst] and stress.any()):
        return ()
    return (
        f"von Mises stress is largest at the end of the cells, near {point_text(section.cells.centers[worst])} m: steel"
        " behind it may yield and is not looked at; give cells over a larger region, or smaller ones",
    )


def section_stress(section: PlasticSection, density: np.ndarray, loads: tuple = ()) -> np.ndarray:
    """(m, 4) xx yy zz xy [Pa] of all cells under densities (2 n,) of the load."""
    plastic = section.plastic_stress()
    stress = np.empty((section.cells.count, 4))
    own = section.from_layers @ density + section.matrix @ plastic
    mean = None
    if nearly_incompressible(section.elastic):
        field = section.field_stress(section.cells.points(section.active), density, plastic, loads)
        mean = (1 + section.elastic.poisson) / 3 * field[:, :2].sum(axis=1).reshape(-1, 4).mean(axis=1)
    stress[section.active] = section.stress(own.reshape(3, -1), plastic.reshape(3, -1), mean)
    others = np.flatnonzero(section.position < 0)
    strain = section.strain_at(section.cells.centers[others], density, plastic, loads)
    stress[others] = section.stress(strain, np.zeros_like(strain))
    return stress
