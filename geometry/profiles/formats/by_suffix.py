"""Read and write profiles by the suffix of their file: .prw .prr .whl .ban .mpt .slcs, and two columns for all
others."""

from dataclasses import replace
from numbers import Real
from pathlib import Path

import numpy as np

from geometry.axes import FLANGE_BACK
from geometry.profiles.formats.columns import read_columns, write_columns
from geometry.profiles.formats.miniprof import read_miniprof, read_mpt
from geometry.profiles.formats.raw import KINDS, RawProfile
from geometry.profiles.formats.simpack import read_simpack, write_simpack
from geometry.profiles.formats.slices import RailSlices, read_slices
from geometry.profiles.profile import ProfileError


def read_raw(path: Path | str, kind: str | None = None, unit: float | None = None, number: int = 1) -> RawProfile:
    """The points of a profile file, as the file declares them.

    Parameters
    ----------
    path : Path or str
        The file; its ending says the format.
    kind : {"rail", "wheel"}, optional
        What the caller knows; overrules the file.
    unit : float, optional
        Length of the file's unit [m]; overrules the file.
    number : int
        Which profile of an .mpt file, which section of a .slcs, from 1.

    Returns
    -------
    RawProfile

    Raises
    ------
    ProfileError
        File, line, reason.
    OSError
        Where it cannot be read.

    Examples
    --------
    >>> np.savetxt("rail.csv", geometry.rail_head("56E1").points * 1e3, delimiter=",")  # [mm]
    >>> geometry.read_raw("rail.csv", kind="rail", unit=1e-3).points.shape[1]
    2
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if path.is_dir() or not path.exists():
        raise ProfileError(f"{path}: {'a folder, no file' if path.is_dir() else 'no such file'}")
    if unit is not None and not (isinstance(unit, Real) and 0 < unit < np.inf):
        raise ProfileError(f"unit {unit!r}: give its length in metres, 1e-3 for mm")
    if kind is not None and kind not in KINDS:
        raise ProfileError(f"kind {kind!r} is neither of {', '.join(KINDS)}")
    if suffix in (".prw", ".prr"):
        raw = read_simpack(path)
    elif suffix in (".whl", ".ban"):
        raw = read_miniprof(path)
    elif suffix == ".mpt":
        several = read_mpt(path)
        if not 1 <= number <= len(several):
            raise ProfileError(f"{path}: profile {number} asked for, the file holds {len(several)}")
        raw = several[number - 1]
    elif suffix in (".slcs", ".slcw"):
        if kind == "wheel":
            raise ProfileError(f"{path}: slices of a rail; a wheel is asked for")
        return one_of(path, read_slices(path, unit), number)
    else:
        raw = read_columns(path, unit)
    return replace(
        raw,
        kind=raw.kind if kind is None else kind,
        unit=raw.unit if unit is None else unit,
        unit_told=raw.unit_told or unit is not None,
    )


def one_of(path: Path, slices: RailSlices, number: int) -> RawProfile:
    """One section of a rail in slices, counted from 1, with a note on where it stands among them."""
    x, count = slices.x, len(slices.x)
    if not 1 <= number <= count:
        raise ProfileError(f"{path}: section {number} asked for, the file holds {count}")
    gaps = np.diff(x)
    note = (
        f"section {number} of {count}, at x = {x[number - 1]:.4f} m of {x[0]:.4f} to {x[-1]:.4f} m, {gaps.min():.4f} to"
        f" {gaps.max():.4f} m apart"
    )
    if slices.features:
        note += f"; {slices.features} features along each section not used"
    section = slices.sections[number - 1]
    return replace(section, notes=(note, *section.notes))


def write_profile(path: Path, points: np.ndarray, kind: str = "rail", note: str = "") -> None:
    """Write points (n, 2) [m] of geometry.axes: a rail's .prr and a wheel's .prw as Simpack, .txt, .csv and .dat as two
    columns in mm."""
    suffix = Path(path).suffix.lower()
    if suffix == {"rail": ".prr", "wheel": ".prw"}[kind]:
        write_simpack(path, points, kind, note)
    elif suffix in ("", ".txt", ".csv", ".dat"):
        back = f"flange back: {-1e3 * FLANGE_BACK:g}" if kind == "wheel" else ""
        write_columns(path, points, notes=(note, back))
    else:
        raise ProfileError(f"a {kind} cannot be written as {suffix}; known: .prr (rail), .prw (wheel), .txt .csv .dat")
