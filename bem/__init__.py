"""Elastic and plastic contact in NumPy and SciPy: closed forms, boundary elements, half-space. No word of rails::

    from rail_fem import bem
    window = (-0.02, 0.02), (-0.02, 0.02)
    patch = bem.normal_contact(lambda x, y: x**2 / 0.92 + y**2 / 0.6, bem.STEEL, bem.STEEL, load=100e3, window=window)
    rolling = bem.rolling_contact(patch, bem.STEEL, bem.STEEL, friction=0.3, creepage=bem.Creepage(1e-3))

Names are imported when they are first used. Reading order of the plane problems: material, exact; plane/kelvin
(kernels), curve, outline, mesh; boundary (one body), internal (its fields); body, pairing, coulomb, contact (two
bodies); rolling; verification."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bem.exact.hertz import line_contact, point_contact
    from bem.halfspace.fastsim import fastsim
    from bem.halfspace.figures import patch_figure
    from bem.halfspace.normal import normal_contact
    from bem.halfspace.stress import subsurface_stress
    from bem.halfspace.tangential import rolling_contact, shift_contact
    from bem.material import STEEL, Elastic, contact_modulus
    from bem.patch import Creepage, Grid, Patch
    from bem.plane.body import Body
    from bem.plane.contact import solve_contact
    from bem.plane.coulomb import Control
    from bem.plane_plastic.yielding_contact import PlasticContact, Region
    from bem.plastic.contact import PlasticHalfSpace
    from bem.plastic.rolling_line import rolling_line_contact
    from bem.slices.assumed_load import loaded_slices
    from bem.slices.coupled import slice_contact
    from bem.slices.slices import Slices
    from bem.steel.cyclic_law import cyclic_law
    from bem.steel.hardening import Hardening

_HOMES = {
    "STEEL": ".material",
    "Body": ".plane.body",
    "Control": ".plane.coulomb",
    "Creepage": ".patch",
    "Elastic": ".material",
    "Grid": ".patch",
    "Hardening": ".steel.hardening",
    "Patch": ".patch",
    "PlasticContact": ".plane_plastic.yielding_contact",
    "PlasticHalfSpace": ".plastic.contact",
    "Region": ".plane_plastic.yielding_contact",
    "Slices": ".slices.slices",
    "contact_modulus": ".material",
    "cyclic_law": ".steel.cyclic_law",
    "fastsim": ".halfspace.fastsim",
    "line_contact": ".exact.hertz",
    "loaded_slices": ".slices.assumed_load",
    "normal_contact": ".halfspace.normal",
    "patch_figure": ".halfspace.figures",
    "point_contact": ".exact.hertz",
    "rolling_contact": ".halfspace.tangential",
    "rolling_line_contact": ".plastic.rolling_line",
    "shift_contact": ".halfspace.tangential",
    "slice_contact": ".slices.coupled",
    "solve_contact": ".plane.contact",
    "subsurface_stress": ".halfspace.stress",
}

__all__ = [
    "STEEL", "Body", "Control", "Creepage", "Elastic", "Grid", "Hardening", "Patch", "PlasticContact",
    "PlasticHalfSpace", "Region", "Slices", "contact_modulus", "cyclic_law", "fastsim", "line_contact",
    "loaded_slices", "normal_contact", "patch_figure", "point_contact", "rolling_contact", "rolling_line_contact",
    "shift_contact", "slice_contact", "solve_contact", "subsurface_stress",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute '{name}'; it offers {', '.join(__all__)}")
    return getattr(importlib.import_module(_HOMES[name], __name__), name)


def __dir__() -> list[str]:
    return list(__all__)
