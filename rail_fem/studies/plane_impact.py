"""A wheel strikes a rail in the plane: P8 on BS113A by boundary elements with inertia, section 6.3.1 of the thesis.

    rail-fem study plane-impact --out impact [--judge]        with plane-strain finite elements of the same section

The wheel comes down at 100 mm/s and presses for the time in which a patch of 10 mm passes at 75 mph; then the load is
gone and the section rings. What the thesis does not state is chosen here: the wheel's mass per thickness, the rail's
density, and that the foot is held. The section is the head's profile on a web and foot of straight lines.
"""

import warnings
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer

from bem.dynamic.body import Inertial
from bem.dynamic.cells import fill_with_cells
from bem.dynamic.impact import Impact, Striker, StrikerOutline, Struck, strike
from bem.dynamic.marching import March, StepWarning
from bem.dynamic.schemes import BACKWARD_EULER, TRAPEZOIDAL, Scheme
from bem.material import STEEL
from bem.plane.body import Body
from bem.plane.internal import field_at, grid_below
from bem.plane.mesh import Sizing, Zone, mesh_outline
from bem.plane.outline import Edge, Outline
from geometry.profiles.rail import rail_head
from rail_fem.contact.contact_pairs import INCLINATION, plain_rail_pair
from rail_fem.contact.patch_methods import plain_rail_section
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.harness import OUT, QUICK, spent

MM, MPA, US = 1e-3, 1e6, 1e-6
DENSITY = 7800.0  # of the rail [kg/m^3]; the thesis does not state it
APPROACH = 0.1  # vertical speed of the wheel [m/s]
CONTACT_TIME = 2 * 5 * MM / 33.528  # 2 a / V of a patch half-length of 5 mm at 75 mph [s]
WHEEL_MASS = 600 / (2 * 5 * MM)  # a wheel's share of the wheelset over the patch's length [kg/m]; chosen here
END = 1.9e-3  # [s]
# BS 113A below its head, from memory and not verified: height, foot width, web thickness, and straight lines between
HEIGHT, FOOT, WEB = 158.75 * MM, 139.70 * MM, 20.0 * MM


def rail_outline() -> Outline:
    """The whole section: head profile, web and foot, inclined; edges "face", "side" and "held" (the foot's base)."""
    head = rail_head("56E1", INCLINATION).points
    upright = rail_head("56E1", 0.0).points
    below = np.array(
        [
            [WEB / 2, -46 * MM], [WEB / 2, -126 * MM], [FOOT / 2, -147 * MM], [FOOT / 2, -HEIGHT],
            [-FOOT / 2, -HEIGHT], [-FOOT / 2, -147 * MM], [-WEB / 2, -126 * MM], [-WEB / 2, -46 * MM],
        ]
    )  # fmt: skip
    # the turn and shift that take the upright head's ends to the inclined one's
    one, two = (points[[0, -1], 0] + 1j * points[[0, -1], 1] for points in (upright, head))
    turn = (two[1] - two[0]) / (one[1] - one[0])
    z = (below[:, 0] + 1j * below[:, 1] - one[0]) * turn + two[0]
    placed = np.column_stack([z.real, z.imag])
    right, left = head[-1], head[0]
    return Outline(
        [
            [
                Edge(head, "face"),
                Edge(np.vstack([right, placed[:4]]), "side"),
                Edge(placed[3:5], "held"),
                Edge(np.vstack([placed[4:], left]), "side"),
            ]
        ]
    )


def wheel_and_rail() -> tuple[Body, Body]:
    """The rail's section and the wheel (stiff here) just touching it, as plane bodies y, z."""
    _, wheel = plain_rail_section(plain_rail_pair())
    return Body(rail_outline(), STEEL), wheel


def nearest_point(rail: Body, wheel: Body) -> np.ndarray:
    """Point (2,) of the rail's face that the wheel is nearest to along z."""
    (face,), tread = rail.outline.edge_curves("face"), wheel.outline.edge_curves("face")[0]
    points = face.at(np.linspace(0, face.length, 4001))
    other = tread.at(np.linspace(0, tread.length, 8001))
    order = np.argsort(other[:, 0])
    gap = np.interp(points[:, 0], other[order, 0], other[order, 1]) - points[:, 1]
    return points[np.argmin(np.where(np.abs(points[:, 0]) < 0.03, gap, np.inf))]


def struck_rail(element: float, cell: float) -> Struck:
    """The rail ready to be struck: boundary elements and cells near the contact [m]."""
    rail, wheel = wheel_and_rail()
    middle = nearest_point(rail, wheel)[None]
    sizing = Sizing(4 * MM, [Zone(middle, element, 4 * MM)], 0.25)
    mesh, other = mesh_outline(rail.outline, sizing), mesh_outline(wheel.outline, sizing)
    cells = fill_with_cells(mesh, Sizing(5 * MM, [Zone(middle, cell, 5 * MM)], 0.2))
    return Struck(Inertial(rail, mesh, cells, DENSITY), StrikerOutline(wheel, other), 0.3 * MM)


def striker(release: float | None = CONTACT_TIME) -> Striker:
    """The wheel on its way down."""
    return Striker(mass=WHEEL_MASS, velocity=-APPROACH, release=release)


def patch_grid() -> np.ndarray:
    """Points (rows, columns, 2) below the contact, 12 by 6 mm."""
    rail, wheel = wheel_and_rail()
    return grid_below(rail.outline, "face", nearest_point(rail, wheel), 6 * MM, 6 * MM, 0.25 * MM)


@dataclass(frozen=True)
class ImpactRun:
    """One march: step [s], CPU time of the setting up and of the steps [s], the impact, and over the instants kept the
    time [s] and largest von Mises stress below the contact [Pa]."""

    scheme: Scheme
    step: float
    setup: float
    steps: float
    impact: Impact
    time: np.ndarray
    stress: np.ndarray

    @property
    def peak(self) -> tuple[float, float]:
        """Largest von Mises stress [Pa] and its time [s]."""
        k = int(np.argmax(self.stress))
        return float(self.stress[k]), float(self.time[k])

    @property
    def penetration(self) -> float:
        """How far the wheel has come down when the load goes [m]."""
        return -float(self.impact.position[self.impact.time <= CONTACT_TIME].min())

    def afterwards(self) -> float:
        """Largest von Mises stress [Pa] later than 20 us after the load has gone."""
        late = self.time > CONTACT_TIME + 20 * US
        return float(self.stress[late].max()) if late.any() else np.nan


def march(struck: Struck, scheme: Scheme, step: float, end: float = END, every: float = 20 * US) -> ImpactRun:
    """Strike with steps of one length; stresses are looked at about `every` so many seconds."""
    count, stride = round(end / step), max(round(every / step), 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # the study's subject
        setup, going = spent(lambda: March(struck.body, step, scheme))
    steps, impact = spent(lambda: strike(struck, striker(), going, count, lambda k: k % stride == 0))
    grid = patch_grid().reshape(-1, 2)
    instants = sorted(impact.states)
    stress = np.array([np.nanmax(field_at(impact.solution(k), grid).von_mises) for k in instants])
    return ImpactRun(scheme, step, setup, steps, impact, impact.time[instants], stress)


def table(runs: list[ImpactRun]) -> Table:
    """A line for each scheme and step."""
    head = [
        "scheme", "step [us]", "steps", "CPU [s]", "force, peak [kN/mm]", "penetration [mm]",
        "von Mises, peak [MPa]", "at [ms]", "later than 20 us after the load [MPa]", "energy balance",
    ]  # fmt: skip
    rows = [
        [
            run.scheme.name, f"{run.step / US:g}", f"{len(run.impact.time) - 1}", f"{run.setup + run.steps:.1f}",
            f"{run.impact.force.max() / 1e6:.3f}", f"{run.penetration / MM:.4f}",
            f"{run.peak[0] / MPA:.1f}", f"{run.peak[1] * 1e3:.3f}", f"{run.afterwards() / MPA:.1f}",
            f"{run.impact.imbalance[np.argmax(np.abs(run.impact.imbalance))]:+.1e}",
        ]
        for run in runs
    ]  # fmt: skip
    return Table(head, rows)


def judged(run: ImpactRun, element: float, end: float = 0.4e-3) -> str:
    """How far the run's largest von Mises stress is from that of plane-strain finite elements of the same section under
    the same wheel, with its scheme and step, until 0.1 ms after the load has gone: at the points where these are
    highest."""
    from rail_fem.static_fe.plane_impact import finite_impact
    from rail_fem.static_fe.plane_strain import Fineness

    rail, wheel = wheel_and_rail()
    middle, count = nearest_point(rail, wheel), round(end / run.step)
    kept, pairs = [k for k in sorted(run.impact.states) if 0 < k <= count], []
    fine, face = Fineness(middle[None], element, 4 * MM, 5 * MM), wheel.outline.edge_curves("face")
    window, keep = (middle[0] - 8 * MM, middle[0] + 8 * MM), lambda k: k in kept
    seconds, finite = spent(
        lambda: finite_impact(rail, face, striker(), DENSITY, run.step, count, fine, window, run.scheme, keep, 0.3 * MM)
    )
    for k in kept:
        points, stress = finite.von_mises(k)
        near = np.flatnonzero(np.hypot(*(points - middle).T) < 10 * MM)
        highest = near[np.argsort(-stress[near])[:40]]
        pairs.append((stress[highest[0]], np.nanmax(field_at(run.impact.solution(k), points[highest]).von_mises)))
        run.impact.struck.body.forget_points()
    there, ours = np.array(pairs).T
    return (
        f"Plane-strain finite elements, {len(finite.body.nodes)} nodes, step {run.step / US:g} us, {seconds:.0f} s of"
        f" CPU: largest von Mises stress {there.max() / MPA:.1f} MPa; boundary elements at the same points"
        f" {ours.max() / there.max() - 1:+.2%}, at any instant {np.abs(ours - there).max() / there.max():.2%} of it."
    )


def panels(runs: list[ImpactRun]) -> list[Panel]:
    """Stress, force and the energy gained or lost, of each scheme and step."""
    over = lambda of: {f"{run.scheme.name}, {run.step / US:g} \u00b5s": of(run) for run in runs}
    asked = {
        "largest von Mises stress below the contact [MPa]": over(lambda run: (run.time * 1e3, run.stress / MPA)),
        "contact force [kN per mm]": over(lambda run: (run.impact.time * 1e3, run.impact.force / 1e6)),
        "energy gained or lost [%]": over(lambda run: (run.impact.time * 1e3, 100 * run.impact.imbalance)),
    }
    return [Panel("time since first contact [ms]", words, lines) for words, lines in asked.items()]


def main(
    step: Annotated[list[float] | None, typer.Option(help="steps of both schemes [us]: 20, 5, 2")] = None,
    element: Annotated[float, typer.Option(help="boundary elements in the contact [mm]")] = 0.1,
    cell: Annotated[float, typer.Option(help="cells near the contact [mm]")] = 1.5,
    judge: Annotated[bool, typer.Option("--judge", help="finite elements beside the finest run")] = False,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """Impact of a wheel on a rail section by boundary elements with inertia; convergence in the step."""
    made_in, struck = spent(lambda: struck_rail(element * MM, cell * MM))
    steps = sorted(step or ([20.0, 5.0] if quick else [20.0, 5.0, 2.0]), reverse=True)
    runs = [march(struck, scheme, each * US) for scheme in (BACKWARD_EULER, TRAPEZOIDAL) for each in steps]
    counts = f"{struck.body.mesh.densities} densities, {len(struck.body.cells)} cells, {len(struck.mass)} contact nodes"
    note = f"{counts}; matrices in {made_in:.1f} s of CPU."
    note += "\n\n" + judged(runs[-1], element * MM) if judge else ""
    title = "P8 wheel striking a BS 113A rail section at 100 mm/s (plane strain, foot held)"
    publish("plane_impact", out, [table(runs)], panels(runs), title, note, columns=1)
