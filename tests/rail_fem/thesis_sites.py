"""The six measured sites of the thesis (Tables 3-2, 3-3) and the shift at which its P8 wheel meets the flange
(Figs. 3-7, 3-8).

What comes out:
- All printed "theoretical" positions are multiples of 5/6 mm and all "experimental" ones of 2.3023 mm: they were
counted in picture points, which are
  as coarse as the difference of 1 mm that they are said to meet.
- The six theoretical positions are one rising curve of the wheel's shift towards the track's middle, when a positive
offset of Table 3-2 is
  such a shift and half of the gauge variation adds to it. The other sign gives no curve at all.
- The nominal P8 on BS113A at 1:20 has the slopes of that curve but not its jump: no reading of the offsets, gauge,
alignment, cross level,
  back-to-back and inclination brings sites b to e nearer than 3 mm, all four at once.
- A tread worn by 0.5 mm within 11 mm of the rolling circle does, within the picture points: the train's wheels were
measured ones.
  Three numbers fitted to four rows show that such a wheel exists, not that it was this one.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.profile import Profile
from geometry.profiles.wheel import wheel_profile, worn
from geometry.wheelset import Track, Wheelset
from rail_fem.contact.load_sharing import static_equilibrium

MM = 1e-3
THEORETICAL_STEP, MEASURED_STEP = 5 / 6 * MM, 2.3023 * MM  # of the printed positions
INCLINATION = 1 / 20  # Table 3-1
WHEEL_LOAD = 98.15e3 / 2
FITTED = ("b", "c", "d", "e")
# depth, half width, middle from the tread datum [mm]: where the search for the worn wheel starts
WEAR_GUESS = 0.5, 11.0, 5.0
STEEP = np.radians(30)  # a contact angle beyond which it is the flange that carries


@dataclass(frozen=True)
class TableSite:
    """A column of Table 3-2 with its row of Table 3-3 [m, rad]; offset : of the wheelset, as printed."""

    name: str
    gauge_variation: float
    alignment: float
    cross_level: float
    offset: float
    yaw: float
    theoretical: float
    measured: float


def _sites() -> dict[str, TableSite]:
    columns = {
        "a": (-0.36, -0.29, 10.82, 0.39, -0.02, 70.00, 78.28),
        "b": (-1.00, -1.61, 11.46, -0.11, 0.02, 61.67, 62.16),
        "c": (1.79, 0.00, 7.48, 3.00, -0.06, 87.50, 87.49),
        "d": (10.40, 0.22, 5.62, -2.50, 0.16, 86.67, 87.49),
        "e": (-1.19, 0.58, 24.75, -0.27, 0.01, 60.83, 59.86),
        "f": (0.45, 0.02, 163.10, -4.72, 0.07, 55.83, 73.67),
    }
    scale = np.array([MM, MM, MM, MM, np.radians(1.0), MM, MM])
    return {name: TableSite(name, *(scale * column)) for name, column in columns.items()}


SITES = _sites()


@dataclass(frozen=True)
class TableReading:
    """How Table 3-2 is understood; the defaults are the only ones that order the six positions.

    sign : +1: a positive offset moves the wheel that was seen towards the track's middle;
    gauge_share : of the gauge variation at this rail
    alignment_share : of the alignment that adds to the offset;  level_share : of cross level / 1.5 m that rolls the
        rail
    inclination : of the rails;  play : half of what gauge and back-to-back may differ from nominal, as a shift [m]
    """

    sign: float = 1.0
    gauge_share: float = 0.5
    alignment_share: float = 0.0
    level_share: float = 0.0
    inclination: float = INCLINATION
    play: float = 0.0

    def inward(self, site: TableSite) -> float:
        """Shift of the wheel that was seen, towards the track's middle [m]."""
        return (
            self.sign * site.offset
            + self.gauge_share * site.gauge_variation
            + self.alignment_share * site.alignment
            + self.play
        )

    def lean(self, site: TableSite) -> float:
        """Inclination of the rail at the site."""
        return max(self.inclination + self.level_share * site.cross_level / 1.5, 0.0)


class ContactPositions:
    """Position of contact from the flange back for one wheel, each state looked for once."""

    def __init__(self, wheel: Profile, back_to_back: float = 1.360):
        self.wheelset = Wheelset(wheel, back_to_back=back_to_back)
        self.searches: dict[float, ContactSearch] = {}
        self.known: dict[tuple[float, ...], float] = {}

    def at(self, inward: float, inclination: float = INCLINATION, yaw: float = 0.0) -> float:
        """[m] at a shift towards the track's middle [m], to a hundredth of a mm."""
        lean, key = round(inclination, 4), (round(inclination, 4), round(inward, 5), round(yaw, 6))
        if lean not in self.searches:
            self.searches[lean] = ContactSearch(self.wheelset, Track.plain_line(inclination=lean))
        if key not in self.known:
            search = self.searches[lean]
            self.known[key] = float(
                search.contacts(search.settle(-key[1], key[2]), "left").lowest().from_flange_back[0]
            )
        return self.known[key]

    def site(self, site: TableSite, reading: TableReading = TableReading()) -> float:
        return self.at(reading.inward(site), reading.lean(site), site.yaw)

    def misses(self, reading: TableReading = TableReading(), names: tuple[str, ...] = FITTED) -> np.ndarray:
        """(n,)  position less the thesis' theoretical one at these sites [m]."""
        return np.array([self.site(SITES[k], reading) - SITES[k].theoretical for k in names])


def readings(play_step: float = 0.25 * MM) -> list[TableReading]:
    """All readings of Table 3-2 that a reader might take: signs, shares, inclinations, 1.75 mm of play to either
    side."""
    plays = np.arange(-7, 8) * 0.25 * MM if play_step == 0.25 * MM else np.arange(-1.75 * MM, 1.76 * MM, play_step)
    choices = (1, -1), (0, 0.5, 1), (-1, 0, 1), (-1, 0, 1), (0.0, 1 / 40, 1 / 30, INCLINATION), plays
    return [TableReading(*map(float, c)) for c in itertools.product(*choices)]


def best_reading(positions: ContactPositions, candidates: list[TableReading]) -> tuple[TableReading, float]:
    """The reading whose largest miss at sites b to e is least, and that miss [m]."""
    misses = [np.abs(positions.misses(r)).max() for r in candidates]
    best = int(np.argmin(misses))
    return candidates[best], float(misses[best])


def worn_wheel(numbers: tuple[float, float, float]) -> Profile:
    """P8 less `depth` [mm] of tread within about `half width` of `middle`, both from the tread datum [mm]."""
    depth, half_width, middle = numbers
    return worn(wheel_profile("P8"), depth * MM, half_width * MM, f"P8 SYNTHETIC worn {depth:.2f} mm", middle * MM)


def fitted_wheel() -> tuple[tuple[float, float, float], float]:
    """Wear (depth, half width, middle) [mm] that brings b to e nearest with the readings' defaults, and the largest
    miss left [m]."""
    miss = lambda x: np.abs(ContactPositions(worn_wheel(x)).misses()).max() if 0 <= x[0] < 3 and 8 < x[1] < 40 else 1.0
    found = minimize(miss, WEAR_GUESS, method="Nelder-Mead", options={"xatol": 0.01, "fatol": 1e-5, "maxfev": 60})
    shift, first, second = (float(v) for v in found.x)
    return (shift, first, second), float(found.fun)


def sensitivities(site: TableSite) -> dict[str, float]:
    """Change of the position [m] for a change of what is not known, nominal profiles."""
    nominal, one = ContactPositions(wheel_profile("P8")), TableReading()
    shift, lean = one.inward(site), one.lean(site)
    here = nominal.at(shift, lean, site.yaw)
    search = nominal.searches[round(lean, 4)]
    loaded = static_equilibrium(search, (WHEEL_LOAD, WHEEL_LOAD), -shift, site.yaw).left
    mean = float(loaded.contacts.from_flange_back @ loaded.normal_force / loaded.normal_force.sum())
    return {
        "gauge +1 mm": nominal.at(shift + 0.5 * MM, lean, site.yaw) - here,
        "back-to-back +1 mm": ContactPositions(wheel_profile("P8"), 1.361).at(shift, lean, site.yaw) - here,
        "shift inwards 1 mm": nominal.at(shift + 1 * MM, lean, site.yaw) - here,
        "rail upright by 10 mrad": nominal.at(shift, lean - 0.01, site.yaw) - here,
        "yaw +5 mrad": nominal.at(shift, lean, site.yaw + 5e-3) - here,
        "wheel load 49 kN": mean - here,
        "tread worn 0.1 mm": ContactPositions(worn_wheel((0.1, *WEAR_GUESS[1:]))).at(shift, lean, site.yaw) - here,
    }


def flange_shift(search: ContactSearch, held_at: str = "rail") -> float:
    """Shift [m] at which the left contact goes over to the flange, to 1e-7 m."""
    low, high = 4 * MM, 14 * MM
    while high - low > 1e-7:
        middle = (low + high) / 2
        steep = search.contacts(search.settle(middle, held_at=held_at), "left").lowest().angle[0] > STEEP
        low, high = (low, middle) if steep else (middle, high)
    return (low + high) / 2


def flange_shifts() -> dict[str, float]:
    """Shift of the flange jump of P8 on BS113A at 1:20 [m], and what moves it. Fig. 3-8's text: "approximately +-9
    mm"."""
    search = lambda gauge, back: ContactSearch(
        Wheelset(wheel_profile("P8"), back_to_back=back), Track.plain_line(gauge=gauge)
    )
    table31 = search(1.435, 1.360)
    return {"Table 3-1, shift of the wheelset at rail level": flange_shift(table31),
            "Table 3-1, shift of the axle": flange_shift(table31, "axle"),
            "gauge 1432, rail level": flange_shift(search(1.432, 1.360)),
            "gauge 1432, axle": flange_shift(search(1.432, 1.360), "axle"),
            "back-to-back 1363, rail level": flange_shift(search(1.435, 1.363)),
            "half of gauge - back-to-back - 2 x 28.5 mm": (1.435 - 1.360 - 2 * 28.5 * MM) / 2}  # fmt: skip
