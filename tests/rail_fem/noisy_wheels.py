"""Wheels as measured: what the profile doctor makes of points with scatter."""

from pathlib import Path

import numpy as np

from geometry.profiles.doctor import examine
from geometry.profiles.formats.raw import RawProfile
from geometry.profiles.profile import Profile
from geometry.profiles.wheel import wheel_profile


def noisy_p8(noise: float, random: np.random.Generator) -> Profile:
    """A P8 through every third of its points, each moved by normal scatter of `noise` [m]; 0: the P8 itself."""
    new = wheel_profile("P8")
    points = new.points[::3] + [0.0, noise] * random.standard_normal((len(new.points[::3]), 2))
    if noise == 0:
        return new
    raw = RawProfile(points, np.arange(len(points)), Path("noisy"), "points", 1.0, "wheel", 1)
    return examine(raw).profile.graph_part()
