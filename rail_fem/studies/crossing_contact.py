"""Study: time of a loaded wheelset state on a crossing against its error, as the search and the sections are refined.

python -m rail_fem.studies.crossing_contact --out DIR   draws crossing_contact.png and writes crossing_contact.csv; a
minute or two

A state is both sides, all points, load shared to equilibrium. Errors are taken against sections 1 mm apart, searched
every 0.1 mm.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from geometry.contact.lofted_search import SurfaceSearch
from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.lofted_rail import RailSurface
from geometry.wheelset import SIDES, Track, Wheelset
from rail_fem.light.load_sharing import static_equilibrium

MM = 1e-3
RANGE = -0.7, 0.5  # of the axle [m]
BEYOND = 0.12  # of the surface over that range [m]
REFINED = (1 * MM, 0.1 * MM)
SETTINGS = (
    (16 * MM, 0.5 * MM),
    (8 * MM, 0.5 * MM),
    (4 * MM, 0.5 * MM),
    (2 * MM, 0.5 * MM),
    (4 * MM, 4 * MM),
    (4 * MM, 2 * MM),
    (4 * MM, 1 * MM),
    (4 * MM, 0.25 * MM),
)
NAMES = (
    "sections_mm,stations_mm,time_ms,median_position_error_mm,position_error_95_mm,largest_position_error_mm,"
    "median_force_error,largest_force_error"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", required=True, help="folder for figure and table")
    parser.add_argument("--wheel", default="P8", choices=WHEEL_NAMES)
    parser.add_argument("--ratio", type=float, default=9.25, help="N of the crossing 1:N")
    parser.add_argument("--count", type=int, default=200, help="number of random states")
    arguments = parser.parse_args()
    out = Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    rows = speed_against_error(CastCrossing(arguments.ratio), arguments.wheel, arguments.count)
    np.savetxt(out / "crossing_contact.csv", rows, delimiter=",", fmt="%.6g", header=NAMES, comments="")
    for row in rows:
        print(
            "sections {:4.1f} mm, stations {:4.2f} mm: {:6.2f} ms a loaded state; position off by {:.1e} (median)"
            " {:.1e} (95 %) {:.1e} mm (most); force by {:.1e} (median) {:.1e} (most)".format(*row)
        )
    draw(
        out / "crossing_contact.png",
        rows,
        f"{arguments.wheel} on the crossing 1:{arguments.ratio:g}, {arguments.count} random states",
    )


def random_states(count: int, seed: int = 1) -> np.ndarray:
    """(count, 5)  x of the axle, lateral shift [m], yaw [rad], loads [N]."""
    random = np.random.default_rng(seed)
    return np.column_stack(
        [
            random.uniform(*RANGE, count),
            random.uniform(-8, 8, count) * MM,
            random.uniform(-0.01, 0.01, count),
            random.uniform(20e3, 120e3, (count, 2)),
        ]
    )


def speed_against_error(
    crossing: CastCrossing, wheel: str, count: int, settings=SETTINGS, refined=REFINED
) -> np.ndarray:
    """Rows as NAMES says. Position: mean of a side's points, weighted by force, so that it does not jump; force: vector
    sum over the load."""
    states = random_states(count)
    exact, _ = answers(search_of(crossing, wheel, *refined), states, 1)
    rows = []
    for spacing, resolution in settings:
        found, spent = answers(search_of(crossing, wheel, spacing, resolution), states, 3)
        distance = np.linalg.norm(found[..., :3] - exact[..., :3], axis=2).max(axis=1) / MM
        force = (np.linalg.norm(found[..., 3:] - exact[..., 3:], axis=2) / states[:, 3:]).max(axis=1)
        rows.append(
            [
                spacing / MM,
                resolution / MM,
                spent * 1e3,
                np.median(distance),
                np.percentile(distance, 95),
                distance.max(),
                np.median(force),
                force.max(),
            ]
        )
    return np.array(rows)


def search_of(crossing: CastCrossing, wheel: str, spacing: float, resolution: float) -> SurfaceSearch:
    surface = RailSurface.of_crossing(crossing, RANGE[0] - BEYOND, RANGE[1] + BEYOND, spacing)
    return SurfaceSearch(Wheelset(wheel_profile(wheel)), Track.plain_line(), left=surface, resolution=resolution)


def answers(search: SurfaceSearch, states: np.ndarray, repeats: int) -> tuple[np.ndarray, float]:
    """(count, 2, 6)  mean position and total force of left and right; mean processor time of a state [s], the least of
    several rounds."""
    solve = lambda s: static_equilibrium(search.at(s[0]), (s[3], s[4]), s[1], s[2])
    solve(states[0])
    least = np.inf
    for _ in range(repeats):
        start = time.process_time()
        found = [solve(s) for s in states]
        least = min(least, (time.process_time() - start) / len(states))
    mean = lambda side: np.concatenate(
        [side.normal_force @ side.contacts.position / side.normal_force.sum(), side.force.sum(axis=0)]
    )
    return np.array([[mean(getattr(f, side)) for side in SIDES] for f in found]), least


def draw(path: Path, rows: np.ndarray, title: str) -> Path:
    """Time against the error of a point's position. Returns the file."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(7.5, 5), layout="constrained")
    for marker, column, name in (("o", 3, "median"), ("s", 4, "95 % of states"), ("^", 5, "largest")):
        for colour, chosen, varied in (
            ("tab:blue", rows[:, 1] == 0.5, "sections varied"),
            ("tab:orange", rows[:, 0] == 4, "stations varied"),
        ):
            part = rows[chosen][np.argsort(rows[chosen, 0] if varied == "sections varied" else rows[chosen, 1])]
            axis.loglog(
                np.maximum(part[:, column], 1e-10),
                part[:, 2],
                marker + "-",
                color=colour,
                ms=5,
                lw=0.7,
                label=f"{name}, {varied}",
            )
    axis.axvline(0.01, color="grey", lw=0.8, ls="--")
    axis.axhline(1.0, color="grey", lw=0.8, ls="--")
    axis.set(
        xlabel="error of a side's position of contact [mm]",
        ylabel="time of a loaded state, both sides [ms]",
        title=title,
    )
    axis.grid(alpha=0.3, which="both")
    axis.legend(fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


if __name__ == "__main__":
    main()
