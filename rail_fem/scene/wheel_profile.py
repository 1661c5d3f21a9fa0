"""The wheel's profile of a scene: one of geometry's by name, or a measured one, read once through the profile doctor.

A run keeps the line that it used as wheel_profile.csv in its folder. That file restores the very same profile, to the
last bit and with the digest of what was once read, so that a run can be shown, gone on with and repeated when the first
file has gone or has changed.
"""

import hashlib
import io
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from geometry.profiles.formats.raw import RawProfile, open_file
from geometry.profiles.formats.units import metres_of
from geometry.profiles.profile import Profile, ProfileError
from geometry.profiles.shape import FLANGE
from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile
from rail_fem.files.atomic import write_text_atomically

KEPT = "wheel_profile.csv"
KEPT_HEAD = "# rail-fem wheel profile as a run used it"
COLUMNS = ("points", "angle_before", "angle_after", "curvature")
FEWEST_POINTS = 20
LEAST_TREAD = 0.02  # that a profile must reach beyond the tread datum on the field side [m]


@dataclass(frozen=True)
class MeasuredWheel:
    """A profile file as it was read: what the models see, whatever becomes of the file.

    source  : path of the file
    digest  : SHA-256 of the points and declarations that were read and of how they were to be read; not of the file's
        name, position or comments
    findings : the profile doctor's, as (weight, text)
    profile : the line that models use, z a function of y
    """

    source: str
    digest: str
    findings: tuple[tuple[str, str], ...]
    profile: Profile

    @property
    def warnings(self) -> list[str]:
        """What is doubtful about the file, one line each."""
        return self._said("warning")

    @property
    def notes(self) -> list[str]:
        """What was repaired in the file, one line each."""
        return self._said("repaired")

    def _said(self, weight: str) -> list[str]:
        return [f"wheel profile {Path(self.source).name}: {text}" for own, text in self.findings if own == weight]

    def keep(self, folder: Path) -> None:
        """Write wheel_profile.csv into a run's folder. Errors: OSError."""
        rows = np.column_stack([getattr(self.profile, name) for name in COLUMNS])
        notes = [f"# {weight}: {text}" for weight, text in self.findings]
        head = ["# unit: m", "# axes: y + to the field side, z up; angles in rad, curvature in 1/m",
                f"# label: {self.profile.label}", *notes, "y,z,angle_before,angle_after,curvature"]  # fmt: skip
        body = "\n".join([*head, *(",".join(repr(float(value)) for value in row) for row in rows)]) + "\n"
        first = f"{KEPT_HEAD}; read: {self.digest}; kept: {_sha(body.encode())}\n"
        write_text_atomically(Path(folder) / KEPT, first + body)


def wheel_shape(profile: str, far_tread_slope: float = 0.067) -> Profile:
    """The profile of a name or a file. Errors: ProfileError, OSError."""
    if profile in WHEEL_NAMES:
        return wheel_profile(profile, far_tread_slope)
    return read_wheel(Path(profile)).profile


@dataclass(frozen=True)
class ProfileReading:
    """What is known of a profile file and overrules what it says or shows; None: nothing.

    unit : "mm", "cm", "m" or "inch";  number : which profile of an .mpt file, from 1
    flange_back : y of the flange back in the file [m];  smoothing : the scatter to take out [m]
    """

    unit: str | None = None
    number: int | None = None
    flange_back: float | None = None
    smoothing: float | None = None

    def told(self) -> dict[str, str | float]:
        """What is given, by its key."""
        return {name: value for name, value in asdict(self).items() if value is not None}


def read_wheel(path: Path, reading: ProfileReading = ProfileReading()) -> MeasuredWheel:
    """Read a wheel profile file of any format, repair and examine it. Errors: ProfileError that says where and what is
    wrong, OSError."""
    from geometry.profiles.formats.by_suffix import read_raw

    kept = _read_kept(path) if Path(path).name == KEPT else None
    if kept and reading.told():
        raise ProfileError(f"{path}: is the profile as a run used it, there is nothing left to tell of its reading: "
                           f"leave out {', '.join(reading.told())}")  # fmt: skip
    return kept or _judged(path, read_raw(path, "wheel", metres_of(reading.unit), reading.number or 1), reading)


def _judged(path: Path, raw: RawProfile, reading: ProfileReading) -> MeasuredWheel:
    from geometry.profiles.doctor import examine  # of a profile by its name there is nothing to examine

    found = examine(raw, smoothing=reading.smoothing, flange_back=reading.flange_back)
    profile = found.profile.graph_part()
    _check(path, profile.points)
    return MeasuredWheel(str(path), _digest(raw, reading), tuple((f.weight, f.text) for f in found.findings), profile)


def _digest(raw: RawProfile, reading: ProfileReading) -> str:
    """Of the points as read and of how they are to be read: repairing rounds differently on each machine, reading
    not."""
    back = raw.flange_back if reading.flange_back is None else reading.flange_back
    declared = repr((raw.points.shape, raw.unit, raw.kind, raw.up, raw.layout, reading.smoothing, back))
    return _sha(declared.encode() + np.ascontiguousarray(raw.points, "<f8").tobytes())


def _sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _read_kept(path: Path) -> MeasuredWheel | None:
    """What `keep` wrote; None for any other file. Errors: ProfileError where it was changed since."""
    with open_file(path) as stream:
        if not stream.read(len(KEPT_HEAD)) == KEPT_HEAD.encode():
            return None
        head, _, body = stream.read().partition(b"\n")
    words = dict(part.strip().split(": ", 1) for part in head.decode("utf-8", "replace").split(";") if ": " in part)
    if words.get("kept") != _sha(body):
        raise ProfileError(f"{path}: was changed since a run wrote it; "
                           "take out its first line to use it as a profile of its own")  # fmt: skip
    lines = body.decode("utf-8").splitlines()
    notes = [line[2:].split(": ", 1) for line in lines if line.startswith("# ")]
    table = np.loadtxt(
        io.StringIO("\n".join(line for line in lines if not line.startswith(("#", "y")))), delimiter=",", ndmin=2
    )
    label = next(text for key, text in notes if key == "label")
    findings = tuple((key, text) for key, text in notes if key in ("found", "repaired", "warning"))
    before, after, curvature = table[:, 2:].T
    profile = Profile(table[:, :2], before, after, curvature, label, provenance=f"file {path}")
    return MeasuredWheel(str(path), words["read"], findings, profile)


def _check(path: Path, points: np.ndarray) -> None:
    """What is left where z is a function of y must still be a wheel."""
    if len(points) < FEWEST_POINTS:
        raise ProfileError(f"{path}: {len(points)} point(s), a wheel profile needs at least {FEWEST_POINTS}")
    flange, reach = -points[:, 1].min(), points[-1, 0]
    if not FLANGE[0] <= flange <= FLANGE[1] or reach < LEAST_TREAD:
        raise ProfileError(
            f"{path}: where its height is a function of its width, the line reaches {flange * 1e3:.4g} mm below the"
            f" tread datum and {reach * 1e3:.4g} mm beyond it; a wheel reaches {FLANGE[0] * 1e3:g} to"
            f" {FLANGE[1] * 1e3:g} mm below and at least {LEAST_TREAD * 1e3:g} mm beyond"
        )
