"""What an accelerometer sees of a pass, and a record of it as few numbers that can be held against it.

The numbers are the Fourier coefficients of the acceleration over a window of the wheel's positions, those below a
cut-off; a window with sloping ends (Tukey's), so that what lies at its ends counts little. They are sums over the
samples as they come: a record needs no resampling, whatever its rate.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate
from scipy.signal.windows import tukey

from rail_fem.contact.contact_table import contact_table
from rail_fem.measurement.record import ACCELERATIONS, BEARER, FEWEST, FILTER, NOISE, PLACE, Record, RecordError
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_dynamics import TRACK, WHEEL
from rail_fem.passes.vertical_pass import LightPass, run_pass
from rail_fem.result.low_pass import low_pass
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import RigidHertzSettings

CUTOFF = 500.0  # beyond it masses, springs and beams say little of sleeper and axle box [Hz]
OF_FILTER, OF_RATE = 0.7, 0.25  # of a record's own low pass (3 % lost there by fourth order) and of its sampling rate
SLOPING = 0.3  # of the window
QUIET, PARTS = 0.2, 40  # the noise is that of so large a share of so many parts of the record, the quietest
FLAT = 4  # equal samples in a row at the largest or smallest value: the range of the sensor
NEXT_AXLE = 1.4  # nearer to each other no two axles are [m]
# correlation of a record with itself farther on, from which on another axle is in it: of two that are alike 0.5, of one
# alone 0.02 to 0.17 (six states of sleeper and casting)
AGAIN = 0.3
STEPS = 30  # of the offset, within a period of the cut-off
MOST_OFFSETS = 2000  # that are looked at


@dataclass(frozen=True)
class Sensor:
    """quantity : an acceleration of record.QUANTITIES;  bearer : its number;  place : x on the casting [m]"""

    quantity: str
    bearer: int | None = None
    place: float | None = None

    @property
    def words(self) -> str:
        """Where it is, for tables."""
        where = f" of bearer {self.bearer}" if self.bearer is not None else ""
        where += f" at x = {1e3 * self.place:g} mm" if self.place is not None else ""
        return self.quantity.replace("_", " ") + where

    def of(self, scene: Scene, settings: RigidHertzSettings) -> Record:
        """What it records of a pass. Errors: RecordError where it has no place there; those of the model."""
        table = contact_table(scene, *settings.window(scene), settings.path_spacing)
        run = run_pass(scene, settings, contacts_of(scene, settings, table))
        values = np.diff(self._velocity(run)) / run.step
        return Record(self.quantity, run.x, values, 1 / run.step, "rigid_hertz")

    def _velocity(self, run: LightPass) -> np.ndarray:
        """(m + 1,) at the ends of the steps [m/s]."""
        motion, beam = run.motion, run.beam
        if self.quantity == "axle_box_acceleration":
            return motion.velocity[:, WHEEL]
        if beam is None or motion.beam_velocity is None:
            return motion.velocity[:, TRACK]
        if self.place is not None:
            if not beam.x[0] <= self.place <= beam.x[-1]:
                raise RecordError(f"place: x = {1e3 * self.place:g} mm lies on no rail of this case")
            return motion.beam_velocity @ beam.force_at(self.place)
        own = {one.number: one.own for one in beam.bearers}
        if self.bearer not in own:
            raise RecordError(f"bearer: {self.bearer} is none of this case, {min(own)} to {max(own)}")
        return motion.beam_velocity[:, own[self.bearer]]


def sensor_of(record: Record, scene: Scene) -> Sensor:
    """Where a record was made. Errors: RecordError, also where it is no acceleration."""
    if record.quantity not in ACCELERATIONS:
        raise RecordError(
            f"{record.label}: {record.quantity} is no acceleration: give one of {', '.join(ACCELERATIONS)}"
        )
    if scene.bearers is None or record.quantity == "axle_box_acceleration":
        return Sensor(record.quantity)
    if record.quantity == "casting_acceleration":
        place = record.noted(PLACE, "mm")
        if place is None:
            raise RecordError(
                f'{record.label}: say where on the casting, "# place: 350 mm", on a line before the titles'
            )
        return Sensor(record.quantity, place=place)
    told = record.notes.get(BEARER, "")
    if not told.removeprefix("-").isdecimal():
        raise RecordError(f'{record.label}: say on which bearer, "# bearer: 2", on a line before the titles')
    return Sensor(record.quantity, bearer=int(told))


@dataclass(frozen=True, eq=False)
class PassWindow:
    """start, end : of the wheel, in the direction of travel [m];  speed : signed [m/s];  cutoff [Hz]"""

    start: float
    end: float
    speed: float
    cutoff: float

    @property
    def duration(self) -> float:
        """[s]"""
        return (self.end - self.start) / self.speed

    @property
    def frequencies(self) -> np.ndarray:
        """(k,) [Hz]"""
        return np.arange(1, int(self.cutoff * self.duration) + 1) / self.duration

    @property
    def names(self) -> list[str]:
        """(2 k,) of the numbers."""
        where = f"{1e3 * self.start:.6g} to {1e3 * self.end:.6g} mm"
        return [f"{where}, {f:.5g} Hz, {part}" for part in ("cosine", "sine") for f in self.frequencies]

    def rows(self, position: np.ndarray, rate: float) -> np.ndarray:
        """(2 k, n) that make the numbers [m/s^2] of n samples at these positions [m]."""
        into = (position - self.start) / self.speed
        share = into / self.duration
        inside = (share >= 0) & (share <= 1)
        grid = np.linspace(0, 1, 4001)
        weight = np.where(inside, np.interp(share, grid, tukey(len(grid), SLOPING)), 0.0)
        turn = np.exp(-2j * np.pi * self.frequencies[:, None] * into) * weight * 2 / (rate * self.duration)
        return np.concatenate([turn.real, turn.imag])

    def of(self, record: Record, moved: float = 0.0) -> np.ndarray:
        """(2 k,)  the numbers of a record that is moved along the track by `moved` [m]."""
        return self.rows(record.position + moved, record.rate) @ record.values

    def turned(self, numbers: np.ndarray, moved: float) -> np.ndarray:
        """(2 k,)  the same of what is moved, where nothing lies at the window's ends."""
        half = len(numbers) // 2
        turn = np.exp(-2j * np.pi * self.frequencies * moved / self.speed)
        both = (numbers[:half] + 1j * numbers[half:]) * turn
        return np.concatenate([both.real, both.imag])


@dataclass(frozen=True, eq=False)
class Trace:
    """A record as numbers: seen (s, n) [m/s^2] at offsets moved (s,) [m], slope (s, n) of them [1/s^2];  strongest : at
    which they are largest;  noise (n, n) : covariance there, with all that a constant and a drift of the sensor may
    add;  deviation : of a sample [m/s^2]"""

    record: Record
    sensor: Sensor
    window: PassWindow
    moved: np.ndarray
    seen: np.ndarray
    slope: np.ndarray
    strongest: int
    noise: np.ndarray
    deviation: float

    @property
    def reference(self) -> np.ndarray:
        """(n,)  where the record is strongest."""
        return self.seen[self.strongest]


def trace_of(record: Record, scene: Scene, settings: RigidHertzSettings, reach: float) -> Trace:
    """A record for the pass of a scene. reach : how far its positions, where it has such, may be off [m]; one over time
    may have begun wherever it covers the pass. Errors: RecordError where it is no acceleration, is clipped, or does not
    cover the pass or holds two axles in it."""
    sensor = sensor_of(record, scene)
    _refuse_clipped(record)
    sensor.of(scene, settings)  # a place that is none is refused now
    cutoff = min(CUTOFF, OF_RATE * record.rate, OF_FILTER * (record.noted(FILTER, "Hz") or np.inf))
    window = PassWindow(*settings.window(scene), scene.velocity, cutoff)
    if 2 * len(window.frequencies) < FEWEST:
        raise RecordError(
            f"{record.label}: {2 * len(window.frequencies)} numbers below {cutoff:.0f} Hz, {FEWEST} are needed:"
            " give a record of a higher rate, or a longer pass"
        )
    _refuse_second_axle(record, window)
    moved, step = _offsets(record, window, reach)
    seen = np.array([window.of(record, one) for one in moved])
    strongest = int((seen**2).sum(axis=1).argmax())
    told = record.noted(NOISE, "m/s^2")
    deviation = quietest(record.values) if told is None else told
    rows = window.rows(record.position + moved[strongest], record.rate)
    drift = rows @ np.vander(np.linspace(-1, 1, len(record.values)), 2) * np.std(record.values)
    noise = deviation**2 * rows @ rows.T + drift @ drift.T
    return Trace(record, sensor, window, moved, seen, np.gradient(seen, step, axis=0), strongest, noise, deviation)


def _offsets(record: Record, window: PassWindow, reach: float) -> tuple[np.ndarray, float]:
    """(s,) by which a record may be moved so that it covers the window [m], and their distance."""
    sign = np.sign(window.speed)
    low, high = sign * (window.end - record.position[-1]), sign * (window.start - record.position[0])
    if record.placed:
        low, high = max(low, -reach), min(high, reach)
    step = abs(window.speed) / window.cutoff / STEPS
    if not 2 * step <= high - low <= MOST_OFFSETS * step:
        longer = 1e3 * (np.ptp(record.position) - abs(window.end - window.start))
        beside = f"{longer:.0f} mm longer than the pass: cut it, or"
        if longer < 0:
            beside = f"{-longer:.0f} mm shorter than the pass:"
        raise RecordError(
            f"{record.label}: {beside} set start and end of [run.rigid_hertz], so that wherever it was begun it covers"
            f" the pass and is {2e3 * step:.0f} to {1e3 * MOST_OFFSETS * step:.0f} mm longer"
            + (f"; or its x lie more than {1e3 * reach:g} mm off" if record.placed else "")
        )
    return sign * np.arange(low, high, step), float(sign * step)


def quietest(values: np.ndarray) -> float:
    """Standard deviation of noise in a record: of its quietest parts, each about its own straight line."""
    parts = np.array_split(values, max(1, min(PARTS, len(values) // 10)))
    ranked = sorted(parts, key=lambda part: _rest(part) / len(part))
    some = ranked[: max(1, int(np.ceil(QUIET * len(parts))))]
    return float(np.sqrt(sum(map(_rest, some)) / sum(len(part) - 2 for part in some)))


def _rest(values: np.ndarray) -> float:
    """Sum of squares about the straight line through values."""
    u = np.linspace(-1, 1, len(values))
    values = values - values.mean()
    return float(values @ values - (u @ values) ** 2 / (u @ u))


def _refuse_second_axle(record: Record, window: PassWindow) -> None:
    """Of what stands in the track; an axle box has one axle."""
    if record.quantity == "axle_box_acceleration":
        return
    values = low_pass(record.values, record.rate, window.cutoff)
    values = values - values.mean()
    like = correlate(values, values)[len(values) - 1 :]
    far = np.abs(record.position - record.position[0])
    within = (far >= NEXT_AXLE) & (far <= abs(window.end - window.start))
    at = int(np.where(within, like, 0.0).argmax())
    if like[at] > AGAIN * like[0] and at:
        raise RecordError(
            f"{record.label}: comes again {1e3 * far[at]:.0f} mm on (correlation {like[at] / like[0]:.2f}, more than"
            f" {AGAIN:g}): a second axle passes within the {1e3 * abs(window.end - window.start):.0f} mm that are held"
            f" against one: set start and end of [run.rigid_hertz] less than {1e3 * far[at]:.0f} mm apart"
        )


def _refuse_clipped(record: Record) -> None:
    for most in (record.values.max(), record.values.min()):
        flat = np.diff(np.flatnonzero(np.diff(np.r_[False, record.values == most, False].astype(int))))[::2]
        if len(flat) and flat.max() >= FLAT:
            raise RecordError(
                f"{record.label}: {flat.max()} samples in a row lie at {most:.4g} m/s^2: the sensor's range ends there,"
                " what it cut off would be taken for a softer crossing: give a record of a wider range"
            )
