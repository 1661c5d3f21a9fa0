"""Bodies of which contact has an exact solution."""
import numpy as np

from bem.body import Body
from bem.curve import arc
from bem.material import Elastic
from bem.outline import Edge, Outline

SOFT_STEEL = Elastic.from_shear(82e9, 0.28)


def disc(center, radius, material, top=True, points=721):
    """Disc on a hub at its centre; its boundary begins opposite to the contact, at the top or at the bottom."""
    begin = np.pi / 2 if top else -np.pi / 2
    return Body(Outline([[Edge(arc(center, radius, begin, begin + 2 * np.pi, points), "face")]]), material, hub=tuple(center))


def two_discs(radius, lower, upper, points=1441):
    """Two equal discs that touch at the origin, the fixed one below: relative radius radius / 2.

    Their stresses differ from half-planes' by the order of P / (pi R), 1/2000 of p0 at a half-width of R / 1000.
    """
    return disc((0.0, -radius), radius, lower, top=False, points=points), disc((0.0, radius), radius, upper, points=points)


def pin_and_hole(radius, clearance, material):
    hole = Body(Outline([[Edge(arc((0, 0), radius, np.pi / 2, 2.5 * np.pi, 721), "face")]], infinite=True), material)
    return hole, disc((0.0, 0.0), radius - clearance, material)
