"""Fits of finite elements for a sphere and a rigid flat, elastic and perfectly plastic: load and area by approach.

Loads, areas and approaches over those at first yield, w = approach / (pi C Y / 2 E*)^2 R. Both are fits of large-strain
finite elements of a sphere that a flat presses, good to some per cent; a half-space that a sphere indents is another
problem from a few per cent of a / R on.

Sources, as they are coded in published programs (the papers themselves were not opened):
    Kogut and Etsion, J. Appl. Mech. 69 (2002) 657: asperity_f_cal.m, asperity_a_cal.m of github.com/TaoYang1999/
        SCHC-framework, in dimensional form; 4/3 * 1.03 = 1.37, 4/3 * 1.40 = 1.87
    Jackson and Green, J. Tribol. 127 (2005) 343: ROUTINES/FRIC_MODELS/PLASTIC/GHAEDNIA_ET_AL_FLATTENING.m of
        github.com/tmd-lab/microslip-rough-contact, eq. 5, 6, 23, 24, 27 to 29 there, with its later hardness
"""

from typing import NamedTuple

import numpy as np

from bem.checks import refuse_unless_positive
from bem.exact.hertz import HertzError


class SphereAtYield(NamedTuple):
    """First yield of a sphere: approach [m], load [N], area [m^2]."""

    approach: float
    load: float
    area: float


def first_yield(radius: float, modulus: float, yield_stress: float, poisson: float = 0.3) -> SphereAtYield:
    """radius [m]; modulus : contact modulus E* [Pa]; yield_stress [Pa]. C = 1.295 exp(0.736 nu), mean pressure 2/3 C Y:
    p0 = 1.615 Y at nu 0.3 (von Mises below a circular Hertz contact: 1.613)."""
    refuse_unless_positive(
        HertzError, **{"radius [m]": radius, "modulus [Pa]": modulus, "yield stress [Pa]": yield_stress}
    )
    c = 1.295 * np.exp(0.736 * poisson)
    approach = (np.pi * c * yield_stress / (2 * modulus)) ** 2 * radius
    load = 4 / 3 * (radius / modulus) ** 2 * (np.pi * c * yield_stress / 2) ** 3
    return SphereAtYield(float(approach), float(load), float(np.pi * radius * approach))


def kogut_etsion(w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Load and area (n,) over those at first yield, at approaches w (n,) of 1 to 110; Hertz' below, NaN beyond."""
    w = np.asarray(w, float)
    ranges = [w <= 1, w <= 6, w <= 110]
    load = np.select(ranges, [w**1.5, 1.03 * w**1.425, 1.40 * w**1.263], np.nan)
    area = np.select(ranges, [w, 0.93 * w**1.136, 0.94 * w**1.146], np.nan)
    return load, area


def jackson_green(
    w: np.ndarray, radius: float, modulus: float, yield_stress: float, poisson: float = 0.3
) -> tuple[np.ndarray, np.ndarray]:
    """Load and area (n,) over those at first yield, at approaches w (n,); Hertz' up to 1.9.

    Hardness over yield stress: 2.84 - 0.92 (1 - cos(pi a / R)), which tends to 2.84 where a / R is small.
    """
    w, c = np.asarray(w, float), 1.295 * np.exp(0.736 * poisson)
    power = 0.14 * np.exp(23 * yield_stress / modulus)
    area = np.where(w <= 1.9, w, w * (w / 1.9) ** power)
    slope = np.sqrt(area * first_yield(radius, modulus, yield_stress, poisson).area / np.pi) / radius  # a / R
    hardness = 2.84 - 0.92 * (1 - np.cos(np.pi * slope))
    flowing = np.exp(-0.25 * w ** (5 / 12)) * w**1.5 + 4 * hardness / c * (1 - np.exp(-(w ** (5 / 9)) / 25)) * w
    return np.where(w <= 1.9, w**1.5, flowing), area
