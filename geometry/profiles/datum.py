"""Where a profile's zero lies: a wheel on its tread datum 70 mm from the flange back, a rail with its crown at z =
0."""

import numpy as np

from geometry.axes import FLANGE_BACK
from geometry.profiles.profile import ProfileError
from geometry.profiles.shape import FLANGE

OFF_DATUM = 0.2e-3  # of the tread, or of the flange back, from a file's own datum that is worth saying [m]
OFF_CROWN = 1e-6  # of a rail's crown from z = 0 that is moved [m]
NEAR_CROWN = 5e-3
# a flange back is measured where the line leans less than this over this length [rad, m]
LEAN, OVER = np.radians(10.0), 2e-3
# how far from the flange back a measured flange begins, when MiniProf's origin is that back [m]
BEFORE_BACK = (-2e-3, 0.020)


def on_datum(points: np.ndarray, out, flange_back: float | None = None, said: float | None = None) -> np.ndarray:
    """Wheel set so that its flange back lies at y = -70 mm and the tread passes (0, 0).

    points : (n, 2) upright, from the flange to the field side [m];  out : Diagnosis that is told what was done
    flange_back : y of the flange back in these points [m]; None: the file's own datum within 2 mm, then where the file
        or its format says that the back is (`said`), then the vertical part of the line itself. Raises ProfileError
        where none of them says it.
    """
    y, z = points.T
    tread = np.interp(0.0, y, z) if y.min() < 0 < y[-1] else np.nan
    own = abs(tread) < 2e-3 and abs(y.min() + FLANGE_BACK) < 5e-3 and FLANGE[0] < -z.min() < FLANGE[1]
    measured = measured_back(points)
    if flange_back is None and own:
        return on_own_datum(points, tread, measured, out)
    if flange_back is not None:
        back, how = flange_back, "from the flange back as told"
        if not BEFORE_BACK[0] < y.min() - back < 0.045:
            raise ProfileError(
                f"flange_back = {1e3 * back:.3f} mm: the line begins {1e3 * (y.min() - back):.3f} mm beside it, at y ="
                f" {1e3 * y.min():.3f} mm"
            )
    elif said is not None and BEFORE_BACK[0] < y.min() - said < BEFORE_BACK[1]:
        back, how = said, f"from the file's y = {1e3 * said:g}, the flange back as it says"
    elif measured is not None:
        back, how = measured, "from the flange back as measured"
    else:
        raise ProfileError(
            f"the flange back is not measured: the line begins on the flange, at y = {1e3 * y[0]:.3f} mm,"
            f" {1e3 * (np.median(z) - z[0]):.1f} mm beyond the tread, where it is not vertical: give flange_back, its y"
            " in the file (0 in many files)"
        )
    return set_from(points, back, how, out)


def on_own_datum(points, tread: float, measured: float | None, out) -> np.ndarray:
    """The file's own (0, 0) is kept; what speaks against it is said."""
    out.say("found", f"tread datum at the file's own (0, 0): flange {1e3 * -points[:, 1].min():.2f} mm high")
    if abs(tread) > OFF_DATUM:
        out.say(
            "warning",
            f"the tread passes {1e3 * tread:+.2f} mm off the file's datum: the wheel's radius is then taken at the"
            " datum, not on the tread",
        )
    if measured is not None and abs(measured + FLANGE_BACK) > OFF_DATUM:
        out.say(
            "warning",
            f"the flange back is measured at y = {1e3 * measured:.2f} mm, the file's datum puts it at -70 mm: give"
            " flange_back if the measured one counts",
        )
    return points


def measured_back(points: np.ndarray) -> float | None:
    """y of the flange back where the line measures it: its least y, when the line is vertical there; None otherwise.

    A flange rounded with 20 mm that is cut where it leans 10 degrees over 2 mm ends 0.16 mm before its back.
    """
    tip = int(np.argmin(points[:, 1]))
    back = points[: tip + 1]
    if len(back) < 2:
        return None
    first = int(np.argmin(back[:, 0]))
    ahead = np.hypot(*(back[first:] - back[first]).T)
    far = np.flatnonzero(ahead >= OVER)
    if len(far) == 0:
        return None
    step = np.abs(back[first + far[0]] - back[first])
    return float(back[first, 0]) if np.arctan2(step[0], step[1]) < LEAN else None


def set_from(points, back: float, how: str, out) -> np.ndarray:
    """Shifted so that `back` lies at -70 mm and the tread at (0, 0)."""
    moved = points + [-FLANGE_BACK - back, 0.0]
    top = int(np.argmin(moved[:, 1]))
    if moved[top:, 0].max() < 0:
        raise ProfileError(
            f"the line ends {1e3 * (moved[top:, 0].max() + FLANGE_BACK):.1f} mm from the flange back, before the"
            " tread datum at 70 mm: measure more of the tread"
        )
    z_shift = -np.interp(0.0, moved[top:, 0], moved[top:, 1])
    height = -(moved[:, 1].min() + z_shift)
    if not FLANGE[0] < height < FLANGE[1]:
        raise ProfileError(
            f"the flange stands {1e3 * height:.4g} mm over the tread 70 mm from its back; one is {1e3 * FLANGE[0]:g} to"
            f" {1e3 * FLANGE[1]:g} mm: is the whole flange measured, and is it a wheel?"
        )
    y_shift = -FLANGE_BACK - back
    out.say(
        "repaired",
        f"set on the tread datum 70 mm {how}: shifted by {1e3 * y_shift:.3f}, {1e3 * z_shift:.3f} mm; flange"
        f" {1e3 * height:.2f} mm high",
    )
    return moved + [0.0, z_shift]


def on_crown(
    points: np.ndarray, out, origin: str | tuple[float, float] = "crown", placed: bool = False, scatter: float = 0.0
) -> np.ndarray:
    """Rail moved so that its highest point has z = 0, as geometry.wheelset.Track asks; y is kept.

    origin : "crown"; "file" keeps the file's own zero; (y, z) [m] is the point, after turning, that becomes (0, 0)
    placed : the file's zero is that of a track (a section among others): kept
    scatter : of its points [m]: the highest of them lies too high by it; above 0 the crown is the top of the parabola
        through those within 5 mm
    """
    crown = fitted_crown(points) if scatter else float(points[:, 1].max())
    if not isinstance(origin, str):
        out.say(
            "repaired",
            f"moved by {-1e3 * origin[0]:.3f}, {-1e3 * origin[1]:.3f} mm, as told; crown at z ="
            f" {1e3 * (crown - origin[1]):.3f} mm",
        )
        return points - np.asarray(origin, float)
    if abs(crown) <= max(OFF_CROWN, scatter):
        return points
    if origin == "file" or placed:
        why = "as told" if origin == "file" else "a section among others"
        out.say(
            "warning" if origin == "file" else "found",
            f"crown at z = {1e3 * crown:.3f} mm by the file's own zero, kept ({why})",
        )
        return points
    out.say("repaired", f"crown set to z = 0: moved by {-1e3 * crown:.3f} mm in height")
    return points - [0.0, crown]


def fitted_crown(points: np.ndarray) -> float:
    """Height of the top of the parabola through the points within 5 mm of the highest [m]."""
    top = points[np.argmax(points[:, 1])]
    y, z = points[(np.abs(points[:, 0] - top[0]) < NEAR_CROWN) & (top[1] - points[:, 1] < NEAR_CROWN)].T
    if len(y) < 6:
        return float(top[1])
    bend, slope, height = np.polyfit(y - top[0], z, 2)
    at = np.clip(-slope / (2 * bend), -NEAR_CROWN, NEAR_CROWN) if bend < 0 else 0.0
    return float(height + slope * at + bend * at**2)
