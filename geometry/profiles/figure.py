"""Picture of a diagnosed profile: as read and as repaired, its tangent and its curvature along the line."""

from pathlib import Path

import numpy as np

from geometry.profiles.doctor import Diagnosis

MM = 1e-3


def draw_diagnosis(found: Diagnosis, path: Path) -> Path:
    """Draw the profile [mm], how far repairing moved it, and its curvature; findings beneath. Returns the file."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    profile = found.profile
    figure, axes = plt.subplots(3, 1, figsize=(9, 11), height_ratios=(3, 1.2, 1.2), layout="constrained")
    y, z = profile.points.T / MM
    axes[0].plot(*best_match(found).T / MM, ".", ms=3, color="tab:orange", label="points as read, moved onto it")
    axes[0].plot(y, z, "-", color="black", lw=0.8, label="as used")
    axes[0].set(
        xlabel="y, + to the field side [mm]", ylabel="z up [mm]", title=f"{profile.label}: {found.kind}", aspect="equal"
    )
    axes[0].legend(loc="best")
    s = profile.arc_length / MM
    axes[1].plot(s, np.degrees(profile.angle_after), color="black", lw=1)
    axes[1].set(xlabel="length along the line [mm]", ylabel="tangent angle [deg]")
    axes[2].plot(s, np.clip(profile.curvature, -400, 400), color="black", lw=1)
    axes[2].set(xlabel="length along the line [mm]", ylabel="curvature, cut at 400 [1/m]")
    figure.supxlabel(
        "\n".join(f"{f.weight}: {f.text}" for f in found.findings), fontsize=7, ha="left", x=0.02, wrap=True
    )
    for ax in axes:
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return Path(path)


def best_match(found: Diagnosis) -> np.ndarray:
    """The points as read [m], mirrored and shifted onto the repaired profile, so that only what repairing changed
    shows."""
    raw, used = found.raw_points, found.profile.points
    options = [raw * [a, b] for a in (1, -1) for b in (1, -1)]
    moved = [p + (used.max(axis=0) + used.min(axis=0)) / 2 - (p.max(axis=0) + p.min(axis=0)) / 2 for p in options]
    far = [np.median([np.hypot(*(used - q).T).min() for q in p[:: max(1, len(p) // 50)]]) for p in moved]
    return moved[int(np.argmin(far))]
