"""Wear laws: how deep one passing patch wears each of its strips, from pressure, traction and slip of its cells.

A rail point under strip y is passed by the whole strip, so that d(y) is a sum along x. Every law gives the worn area
per pass A = sum d(y) dy [m2], which is also the worn volume per metre rolled; over the friction work per metre rolled
it is the law's specific wear [m3/J], by which the laws can be compared (field practice: ug/J).
Where patches change along the rail a point is passed by parts of several: `cells` says what each cell wears while the
patch rolls on by its length, of which a strip is the sum.
A law takes one patch or a row of k (bem.halfspace.rolled_ellipses); arrays then begin with k.
Nothing here knows of lubrication or climate: the study multiplies by its calibration factor.
"""

from dataclasses import dataclass, field

import numpy as np

from bem.halfspace.rolled_ellipses import RolledEllipses
from bem.patch import Patch
from rail_fem.damage.cell_mean import means_over_cells
from rail_fem.settings.damage import DamageSettings

Patches = Patch | RolledEllipses
DENSITY = 7850.0  # of rail steel, by which laws that give mass are turned into volume [kg/m3]
NEAR_BORDER = 0.1  # of a border of the wear map: wear from cells so near to one is reported


class WearError(ValueError):
    """A wear law that cannot be, or an input that it cannot answer: what, how large, what to do."""


class WearLaw:
    """label : what figures and tables call it. Laws of the same numbers are one, so that what comes of them is kept."""

    label: str

    def cells(self, patch: Patches, speed: float) -> np.ndarray:
        """(..., nx, ny) depth [m] worn off under each cell of a patch while it rolls on by a cell's length, at a
        rolling speed [m/s]."""
        raise NotImplementedError

    def depth(self, patch: Patches, speed: float) -> np.ndarray:
        """(..., ny) depth [m] worn off each strip of a rolling patch by one pass at a rolling speed [m/s]: the sum of
        its cells."""
        return self.cells(patch, speed).sum(axis=-2)


def refuse_unsolved(patch: Patches, speed: float) -> None:
    """Raise WearError for a patch without tractions and slip, or a speed of no rolling."""
    _traction_and_slip(patch)
    if not (np.isfinite(speed) and speed != 0):
        raise WearError(f"speed {speed!r} m/s: wear of a rolling patch needs a finite speed other than zero")


def _traction_and_slip(patch: Patches) -> tuple[np.ndarray, np.ndarray]:
    if patch.traction is None or patch.slip is None:
        raise WearError(f"{patch.method}: tractions and slip are not solved; wear needs both")
    return patch.traction, patch.slip


def to_cells(value: float | np.ndarray) -> np.ndarray:
    """A number of each patch () or (k,), to be multiplied with fields of their cells (..., nx, ny)."""
    return np.asarray(value)[..., None, None]


def ratio(part: float | np.ndarray, whole: float | np.ndarray) -> np.ndarray:
    """part / whole, 0 where the whole is not above 0."""
    part, whole = np.asarray(part, float), np.asarray(whole, float)
    return np.divide(part, whole, out=np.zeros(np.broadcast(part, whole).shape), where=whole > 0)


def slip_size(patch: Patches) -> np.ndarray:
    """(..., nx, ny) slip per metre rolled [1]. Errors: WearError for a patch without tractions and slip."""
    _, slip = _traction_and_slip(patch)
    return np.sqrt(slip[..., 0] ** 2 + slip[..., 1] ** 2)


def friction_density(patch: Patches) -> np.ndarray:
    """(..., nx, ny) friction work per area and metre rolled [Pa]. Errors: as `slip_size`."""
    traction, slip = _traction_and_slip(patch)
    return np.maximum(-(traction[..., 0] * slip[..., 0] + traction[..., 1] * slip[..., 1]), 0.0)


def friction_work_of_cells(patch: Patches) -> np.ndarray:
    """(..., nx, ny) friction work per area under each cell while the patch rolls on by its length [J/m2]."""
    return friction_density(patch) * to_cells(patch.grid.dx)


def friction_work(patch: Patches) -> np.ndarray:
    """(..., ny) friction work per area of each strip by one pass [J/m2]: the integral of traction times slip along
    x."""
    return friction_work_of_cells(patch).sum(axis=-2)


def tgamma(patch: Patch) -> float:
    """Tractive forces times creepages without the spin moment [N]: thesis 2.3.3's T gamma. Errors: WearError
    for a patch without creepage."""
    if patch.creepage is None:
        raise WearError(f"{patch.method}: has no creepage; T gamma needs a rolling patch")
    force, creepage = patch.tangential_force, patch.creepage
    return float(-(force[0] * creepage.longitudinal + force[1] * creepage.lateral)) + 0.0  # no -0


def spread_as_work(patch: Patches, area: float | np.ndarray) -> np.ndarray:
    """(..., nx, ny) depths [m] in proportion to the friction work of the cells, whose sum over the strips' widths is
    `area`."""
    work = friction_work_of_cells(patch)
    return work * to_cells(ratio(area, work.sum(axis=(-2, -1)) * patch.grid.dy))


@dataclass(frozen=True)
class WearMap:
    """Archard's coefficient by region: pressure over hardness and slip velocity.

    pressure : (m,) borders of p / H [1], growing;  velocity : (n,) borders [m/s], growing
    least, most : (m + 1, n + 1) scatter of the coefficient in each region [1], rows by pressure
    """

    pressure: tuple[float, ...]
    velocity: tuple[float, ...]
    least: tuple[tuple[float, ...], ...]
    most: tuple[tuple[float, ...], ...]
    source: str = ""

    def coefficient(self, pressure: np.ndarray, velocity: np.ndarray, share: float) -> np.ndarray:
        """Coefficient at p / H and slip velocity [m/s]; share of the scatter: 0 the least, 0.5 the middle, 1 the
        most."""
        row = np.searchsorted(np.array(self.pressure), pressure, side="left")
        column = np.searchsorted(np.array(self.velocity), velocity, side="left")
        least, most = np.array(self.least), np.array(self.most)
        return (least + share * (most - least))[row, column]

    def cell_means(self, pressure: np.ndarray, velocity: np.ndarray, share: float) -> np.ndarray:
        """(..., nx, ny) coefficient of cells at whose centres p / H and velocity are known: its mean over each cell.
        Error: second order in the cell where a border runs smoothly (tests/damage/test_wear_laws.py); first where
        it is the coefficient at the centres."""
        least, most = np.array(self.least), np.array(self.most)
        out = np.empty(np.shape(pressure))
        cells = (-1, *out.shape[-2:])
        means_over_cells(
            np.reshape(pressure, cells),
            np.reshape(velocity, cells),
            np.array(self.pressure),
            np.array(self.velocity),
            least + share * (most - least),
            out.reshape(cells),
        )
        return out

    def near_border(self, pressure: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Whether a point lies within NEAR_BORDER of a border of the map."""
        close = np.zeros(np.broadcast(pressure, velocity).shape, bool)
        for value, borders in ((pressure, self.pressure), (velocity, self.velocity)):
            for border in borders:
                close |= np.abs(value / border - 1) < NEAR_BORDER
        return close


# Regions: mild below 0.2 m/s, severe to 0.7 m/s, mild (oxidative) above, seizure above 0.8 H. Dry.
JENDEL = WearMap(
    (0.8,),
    (0.2, 0.7),
    ((1e-4, 30e-4, 1e-4), (300e-4, 300e-4, 300e-4)),
    ((10e-4, 40e-4, 10e-4), (400e-4, 400e-4, 400e-4)),
    "Jendel, Wear 253 (2002) 90; values recalled, not opened",
)


@dataclass(frozen=True)
class Archard(WearLaw):
    """Archard's law per cell, d(y) = sum_x k p s dx / H with the slip s per metre rolled.

    hardness : of the worn body [Pa];  wear_map : of k;  share : of its scatter (WearMap.coefficient)
    one_a_patch : one k for the whole patch, from its largest pressure and largest slip velocity, as thesis section
        4.4.1 does (with share 1)
    coefficient : k itself [1]; the map is not asked then
    Source: thesis eq. 4-12, 4-13 with its misprint corrected: depth = k/H p |s| dx / V.
    """

    hardness: float
    wear_map: WearMap = field(default_factory=lambda: JENDEL)
    share: float = 0.5
    one_a_patch: bool = False
    coefficient: float | None = None
    label: str = "Archard, Jendel's map"

    def cells(self, patch: Patches, speed: float) -> np.ndarray:
        """(..., nx, ny) depth [m] of each cell."""
        refuse_unsolved(patch, speed)
        slip = slip_size(patch)
        return self.coefficients(patch, slip, speed) * patch.pressure * slip * to_cells(patch.grid.dx / self.hardness)

    def coefficients(self, patch: Patches, slip: np.ndarray, speed: float) -> np.ndarray:
        """(..., nx, ny) k of each cell, or (..., 1, 1) of each patch; slip (..., nx, ny) per metre rolled."""
        if self.coefficient is not None:
            return np.full((1, 1), self.coefficient)
        pressure, velocity = patch.pressure / self.hardness, slip * abs(speed)
        if self.one_a_patch:
            pressure, velocity = (field.max(axis=(-2, -1), keepdims=True) for field in (pressure, velocity))
            return self.wear_map.coefficient(pressure, velocity, self.share)
        return self.wear_map.cell_means(pressure, velocity, self.share)

    def seized(self, patch: Patches) -> np.ndarray:
        """(..., nx, ny) cells beyond the map's last border of pressure, in seizure whatever their slip."""
        return patch.pressure > self.wear_map.pressure[-1] * self.hardness

    def near_border(self, patch: Patches, speed: float) -> np.ndarray:
        """(..., nx, ny) cells within NEAR_BORDER of a border of the map, where k jumps."""
        return self.wear_map.near_border(patch.pressure / self.hardness, slip_size(patch) * abs(speed))


@dataclass(frozen=True)
class Usfd(WearLaw):
    """Wear rate of R8T on 900A steel by T gamma / A, dry, from twin discs: mass per metre rolled and area of the patch.

    limits : of the regimes [N/m2];  rate : slopes [kg/(m m2) per N/m2] of the first and the third, both through 0 of
        their own regime;  plateau : of the second [kg/(m m2)]
    x = T gamma / A below 10.4 N/mm2: 5.3 x ug/(m mm2); to 77.2: 55.0; above: 55.0 + 61.9 (x - 77.2).
    The rate belongs to the patch as a whole; it is spread over the strips as the friction work is.
    Source: Lewis and Dwyer-Joyce, Proc. IMechE J 218 (2004) 467; Braghin et al., Wear 261 (2006) 1253; numbers as in a
    public code that implements them.
    """

    limits: tuple[float, float] = (10.4e6, 77.2e6)
    slope: tuple[float, float] = (5.3e-9, 61.9e-9)
    plateau: float = 55.0e-3
    label: str = "USFD"

    def rate(self, index: np.ndarray) -> np.ndarray:
        """Mass per metre rolled and area [kg/m3] at T gamma / A [N/m2]."""
        x = np.asarray(index, float)
        high = self.plateau + self.slope[1] * (x - self.limits[1])
        return np.where(x < self.limits[0], self.slope[0] * x, np.where(x <= self.limits[1], self.plateau, high))

    def cells(self, patch: Patches, speed: float) -> np.ndarray:
        """(..., nx, ny) depth [m] of each cell."""
        refuse_unsolved(patch, speed)
        area = patch.contact_area
        return spread_as_work(patch, self.rate(ratio(patch.frictional_power, area)) * area / DENSITY)


@dataclass(frozen=True)
class BritishRail(WearLaw):
    """British Rail Research: worn area of a wheel's section per distance, from T gamma [N] and its diameter D.

    T gamma < 100 N: 0.25 T gamma / D mm2/km with D in mm; to 200 N: 25 / D; above: (1.19 T gamma - 154) / D (the
    jump at 200 N is the law's). A wheel that loses this section over its circumference loses pi times the numerator in
    mm3 per km rolled, whatever D is; the rail under it is taken to lose the same volume.
    limits [N], slope [mm2/km mm/N], plateau [mm2/km mm], offset [mm2/km mm].
    Source: Pearce and Sherratt, Wear 144 (1991) 343; recalled, not opened.
    """

    limits: tuple[float, float] = (100.0, 200.0)
    slope: tuple[float, float] = (0.25, 1.19)
    plateau: float = 25.0
    offset: float = 154.0
    label: str = "BRR"

    def section_times_diameter(self, index: float | np.ndarray) -> np.ndarray:
        """Worn section of the wheel per km times its diameter [mm2/km mm] at T gamma [N]."""
        x = np.asarray(index, float)
        high = np.where(x <= self.limits[1], self.plateau, self.slope[1] * x - self.offset)
        return np.where(x < self.limits[0], self.slope[0] * x, high)

    def cells(self, patch: Patches, speed: float) -> np.ndarray:
        """(..., nx, ny) depth [m] of each cell."""
        refuse_unsolved(patch, speed)
        volume = np.pi * self.section_times_diameter(patch.frictional_power) * 1e-12  # mm3/km -> m3/m
        return spread_as_work(patch, volume)


@dataclass(frozen=True)
class KrausePoll(WearLaw):
    """Volume per friction work, mild or severe by the friction power per area of the patch.

    mild, severe : [m3/J];  limit : [W/m2]. Source: Krause and Poll, Wear 113 (1986) 103; values recalled, not opened.
    """

    mild: float = 9.87e-14
    severe: float = 2.15e-13
    limit: float = 4e6
    label: str = "Krause-Poll"

    def cells(self, patch: Patches, speed: float) -> np.ndarray:
        """(..., nx, ny) depth [m] of each cell."""
        refuse_unsolved(patch, speed)
        power = ratio(patch.frictional_power * abs(speed), patch.contact_area)
        return friction_work_of_cells(patch) * to_cells(np.where(power > self.limit, self.severe, self.mild))


def worn_area(law: WearLaw, patch: Patches, speed: float) -> np.ndarray:
    """(...) area worn off the section by one pass [m2], or volume per metre rolled."""
    return law.depth(patch, speed).sum(axis=-1) * patch.grid.dy


def dry_laws(hardness: float) -> dict[str, WearLaw]:
    """The laws between which a result's band lies: name -> law, for a worn body of this hardness [Pa]."""
    return {
        "archard": Archard(hardness),
        "archard_low": Archard(hardness, share=0.0, label="Archard, least of the map"),
        "archard_high": Archard(hardness, share=1.0, label="Archard, most of the map"),
        "archard_patch": Archard(hardness, share=1.0, one_a_patch=True, label="Archard, one k a patch (thesis)"),
        "usfd": Usfd(),
        "brr": BritishRail(),
        "krause_poll": KrausePoll(),
    }


def laws_of(settings: DamageSettings, wheels: bool = False) -> dict[str, WearLaw]:
    """The laws of a study by name, or those by which its wheels wear."""
    hardness, k = settings.wheel_hardness if wheels else settings.hardness, settings.wear_coefficient
    laws = dry_laws(hardness)
    if k is not None:
        laws["archard"] = Archard(hardness, coefficient=k, label=f"Archard, k = {k:g}")
    return laws
