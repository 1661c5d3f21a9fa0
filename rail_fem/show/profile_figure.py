"""Picture of a diagnosed profile: as read and as repaired, its tangent and its curvature along the line."""

import numpy as np
from matplotlib.figure import Figure

from geometry.profiles.doctor import Diagnosis
from rail_fem.show.panels import Panel, new_panels
from rail_fem.show.style import WIDTH

MM = 1e-3
CUT = 400.0  # of the curvature drawn [1/m]
SPAN = 2.0  # length over which it is averaged: points to a micrometre differ by 100 1/m from one to the next [mm]


def diagnosis_figure(found: Diagnosis) -> Figure:
    """The profile [mm], how far repairing moved it, its tangent and its curvature; findings beneath."""
    profile = found.profile
    (y, z), s = profile.points.T / MM, profile.arc_length / MM
    middle, mean = mean_curvature(s, profile.angle_after)
    heights = 0.9 * WIDTH * np.ptp(z) / np.ptp(y) + 0.6, 2.6, 2.6  # the shape in true proportion [inch]
    figure, axes = new_panels(sum(heights) + 1.5, 3, 1, height_ratios=heights)
    along, curvature = "length along the line [mm]", np.clip(profile.curvature, -CUT, CUT)
    read = {"as used": (y, z), "points as read, moved onto it": (*best_match(found).T / MM, ".")}
    means = {"from point to point": (s, curvature), f"mean over {SPAN:g} mm": (middle, mean)}
    panels = (
        Panel("y, + to the field side [mm]", "z up [mm]", read, f"{profile.label}: {found.kind}", equal=True),
        Panel(along, "tangent angle [deg]", {"_": (s, np.degrees(profile.angle_after))}),
        Panel(along, f"curvature, cut at {CUT:g} [1/m]", means),
    )
    for axis, panel in zip(axes, panels):
        panel.draw(axis)
    axes[2].set_ylim(*np.clip([1.3 * mean.min() - 20, 1.3 * mean.max() + 20], -CUT, CUT))
    words = "\n".join(f"{finding.weight}: {finding.text}" for finding in found.findings)
    figure.supxlabel(words, fontsize=9, ha="left", x=0.02, wrap=True)
    return figure


def mean_curvature(s: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Curvature as the change of the tangent's angle over SPAN: positions [mm] and values [1/m].

    s : (n,) length along the line [mm];  angle : (n,) tangent after each point [rad]
    """
    half = 0.5 * min(SPAN, np.ptp(s) / 4)
    at = np.linspace(s[0] + half, s[-1] - half, 400)
    change = np.interp(at + half, s, angle) - np.interp(at - half, s, angle)
    return at, np.clip(change / (2 * half * MM), -CUT, CUT)


def best_match(found: Diagnosis) -> np.ndarray:
    """The points as read [m], mirrored and shifted onto the repaired profile, so that only what repairing changed
    shows."""
    raw, used = found.raw_points, found.profile.points
    options = [raw * [a, b] for a in (1, -1) for b in (1, -1)]
    moved = [p + (used.max(axis=0) + used.min(axis=0)) / 2 - (p.max(axis=0) + p.min(axis=0)) / 2 for p in options]
    far = [np.median([np.hypot(*(used - q).T).min() for q in p[:: max(1, len(p) // 50)]]) for p in moved]
    return moved[int(np.argmin(far))]
