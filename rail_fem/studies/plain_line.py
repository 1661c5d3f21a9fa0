"""Study: a wheelset on plain line. Curves against lateral shift (thesis Figs. 3-7 to 3-9), conicity, and speed against
error.

python -m rail_fem.studies.plain_line --out DIR   draws plain_line.png and writes plain_line.csv and speed.csv; a minute
"""

import argparse
import time
from pathlib import Path

import numpy as np

from geometry.contact.conicity import ShiftCurves, equivalent_conicity, shift_curves
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile
from geometry.wheelset import Track, Wheelset
from rail_fem.light.load_sharing import LoadedWheelset, static_equilibrium

MM = 1e-3
AXLE_LOAD = 98.15e3  # thesis Table 3-1 [N]
AMPLITUDES = np.array([1, 2, 3, 4, 5, 6, 7, 8]) * MM
RESOLUTIONS = np.array([2.0, 1.0, 0.5, 0.25, 0.1]) * MM
REFINED = 0.02 * MM


def main() -> None:
    arguments = _arguments()
    out = Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    search = ContactSearch(
        Wheelset(wheel_profile(arguments.wheel)), Track.plain_line(arguments.rail, arguments.inclination)
    )
    shift = np.arange(-120, 121) * 0.1 * MM
    curves = shift_curves(search, shift)
    loaded = [static_equilibrium(search, (AXLE_LOAD / 2, AXLE_LOAD / 2), y) for y in shift]
    conicity = [equivalent_conicity(curves, a) for a in AMPLITUDES]
    write_curves(out / "plain_line.csv", curves, loaded)
    draw(
        out / "plain_line.png",
        curves,
        loaded,
        conicity,
        f"{arguments.wheel} on {arguments.rail}, 1:{1 / arguments.inclination:g}, gauge 1435 mm",
    )
    print(f"jumps of the contact at {np.array2string(curves.jumps() / MM, precision=2)} mm")
    print("equivalent conicity", ", ".join(f"{a / MM:g} mm: {c:.4f}" for a, c in zip(AMPLITUDES, conicity)))
    rows = speed_against_error(search)
    np.savetxt(
        out / "speed.csv",
        rows,
        delimiter=",",
        fmt="%.6g",
        header="resolution_mm,time_ms,largest_position_error_mm,largest_share_error",
        comments="",
    )
    for row in rows:
        print(
            "resolution {:5.2f} mm: {:6.3f} ms a loaded state, largest error of a point {:.2e} mm,"
            " of a force {:.1e}".format(*row)
        )


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", required=True, help="folder for figure and tables")
    parser.add_argument("--wheel", default="P8", choices=WHEEL_NAMES)
    parser.add_argument("--rail", default="56E1", help="56E1 (BS113A), 60E1 or 60E2")
    parser.add_argument("--inclination", type=float, default=1 / 20, help="slope of the rails' lean, e.g. 0.05")
    return parser.parse_args()


def write_curves(path: Path, curves: ShiftCurves, loaded: list[LoadedWheelset]) -> None:
    """One row a shift: lengths in mm, angles in degrees, forces in kN."""
    carried = [len(l.left.normal_force) for l in loaded]
    columns = np.column_stack(
        [
            curves.shift / MM,
            curves.radius_difference / MM,
            np.degrees(curves.angle_difference),
            curves.rail_station.T / MM,
            curves.station.T / MM,
            curves.roll / MM,
            [l.lateral_force / 1e3 for l in loaded],
            carried,
        ]
    )
    names = (
        "shift,radius_difference,angle_difference,rail_left,rail_right,wheel_left,wheel_right,roll_mrad,"
        "lateral_force,points_left"
    )
    np.savetxt(path, columns, delimiter=",", fmt="%.6f", header=names, comments="")


def speed_against_error(search: ContactSearch, count: int = 200, seed: int = 1) -> np.ndarray:
    """Rows: resolution [mm], time of one loaded state [ms], largest error of a carrying point's position [mm] and of a
    normal force over the wheel load [1], against the finest search, at random shifts, yaws and loads."""
    random = np.random.default_rng(seed)
    states = np.column_stack(
        [
            random.uniform(-11, 11, count) * MM,
            random.uniform(-0.02, 0.02, count),
            random.uniform(20e3, 120e3, (count, 2)),
        ]
    )
    exact = _answers(ContactSearch(search.wheelset, search.track, REFINED), states)[1]
    rows = []
    for resolution in RESOLUTIONS:
        spent, answers = _answers(ContactSearch(search.wheelset, search.track, resolution), states)
        error = np.abs(answers - exact).max(axis=0)
        rows.append([resolution / MM, spent / count * 1e3, error[:3].max() / MM, error[3]])
    return np.array(rows)


def _answers(search: ContactSearch, states: np.ndarray) -> tuple[float, np.ndarray]:
    """Least processor time of two passes [s]; (n, 4) position of the most loaded point of the left wheel [m], its share
    of the wheel load."""
    spent = []
    for _ in range(2):
        start = time.process_time()
        found = [static_equilibrium(search, (left, right), y, yaw) for y, yaw, left, right in states]
        spent.append(time.process_time() - start)
    most = [int(np.argmax(f.left.normal_force)) for f in found]
    return min(spent), np.array(
        [(*f.left.contacts.position[k], f.left.normal_force[k] / load) for f, k, load in zip(found, most, states[:, 2])]
    )


def draw(path: Path, curves: ShiftCurves, loaded: list[LoadedWheelset], conicity: list[float], title: str) -> Path:
    """Six panels against the shift [mm]. Returns the file."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 2, figsize=(10, 10), layout="constrained")
    shift = curves.shift / MM
    lines = dict(marker=".", ms=2.5, lw=0.6)
    axes[0, 0].plot(shift, curves.radius_difference / MM, color="black", **lines)
    axes[0, 0].set(title="rolling radius difference, left - right", ylabel="mm")
    axes[0, 1].plot(shift, np.degrees(curves.angle_difference), color="black", **lines)
    axes[0, 1].set(title="contact angle difference, left - right", ylabel="degrees")
    for k, (side, colour) in enumerate((("left", "tab:blue"), ("right", "tab:orange"))):
        axes[1, 0].plot(shift, curves.rail_station[k] / MM, color=colour, label=f"{side} rail", **lines)
        for y, l in zip(shift, loaded):
            points = getattr(l, side).contacts.rail_station / MM
            axes[1, 1].scatter(
                np.full(len(points), y), points, s=3e-4 * getattr(l, side).normal_force, color=colour, lw=0
            )
    axes[1, 0].set(title="first point of contact on the rail, + to the field side", ylabel="mm from the rail's middle")
    axes[1, 0].legend()
    axes[1, 1].set(
        title=f"carrying points under {AXLE_LOAD / 1e3:g} kN, size: force", ylabel="mm from the rail's middle"
    )
    axes[2, 0].plot(shift, [l.lateral_force / 1e3 for l in loaded], color="black", **lines)
    axes[2, 0].set(title=f"lateral force of the contacts under {AXLE_LOAD / 1e3:g} kN", ylabel="kN")
    axes[2, 1].plot(AMPLITUDES / MM, conicity, "o-", color="black", ms=4, lw=0.8)
    axes[2, 1].set(title="equivalent conicity, EN 15302", xlabel="amplitude [mm]", ylabel="tan gamma", ylim=(0, None))
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    for axis in axes.flat[:5]:
        axis.set(xlabel="lateral shift, + to the left [mm]", xlim=(-12, 12))
    figure.suptitle(title)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


if __name__ == "__main__":
    main()
