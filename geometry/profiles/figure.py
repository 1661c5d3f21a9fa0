"""Picture of a diagnosed profile: as read and as repaired, its tangent and its curvature along the line."""

from pathlib import Path

import numpy as np

from geometry.profiles.doctor import Diagnosis

MM = 1e-3
CUT = 400.0  # of the curvature drawn [1/m]
SPAN = 2.0  # length over which it is averaged: points to a micrometre differ by 100 1/m from one to the next [mm]


def draw_diagnosis(found: Diagnosis, path: Path) -> Path:
    """Draw the profile [mm], how far repairing moved it, and its curvature; findings beneath. Returns the file."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    profile = found.profile
    y, z = profile.points.T / MM
    tall = 8.0 * np.ptp(z) / np.ptp(y)  # of the shape, which is drawn in true proportion [inch]
    ratios = (tall + 0.6, 2.4, 2.4)
    figure, axes = plt.subplots(3, 1, figsize=(9, sum(ratios) + 1.5), height_ratios=ratios, layout="constrained")
    axes[0].plot(*best_match(found).T / MM, ".", ms=3, color="tab:orange", label="points as read, moved onto it")
    axes[0].plot(y, z, "-", color="black", lw=0.8, label="as used")
    axes[0].set(
        xlabel="y, + to the field side [mm]", ylabel="z up [mm]", title=f"{profile.label}: {found.kind}", aspect="equal"
    )
    axes[0].legend(loc="best")
    s = profile.arc_length / MM
    axes[1].plot(s, np.degrees(profile.angle_after), color="black", lw=1)
    axes[1].set(xlabel="length along the line [mm]", ylabel="tangent angle [deg]")
    axes[2].plot(s, np.clip(profile.curvature, -CUT, CUT), color="silver", lw=0.8, label="from point to point")
    middle, mean = mean_curvature(s, profile.angle_after)
    axes[2].plot(middle, mean, color="black", lw=1.2, label=f"mean over {SPAN:g} mm")
    axes[2].set(xlabel="length along the line [mm]", ylabel=f"curvature, cut at {CUT:g} [1/m]")
    axes[2].set_ylim(*np.clip([1.3 * mean.min() - 20, 1.3 * mean.max() + 20], -CUT, CUT))
    axes[2].legend(loc="upper right", ncols=2, fontsize=9)
    figure.supxlabel(
        "\n".join(f"{f.weight}: {f.text}" for f in found.findings), fontsize=9, ha="left", x=0.02, wrap=True
    )
    for ax in axes:
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return Path(path)


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
