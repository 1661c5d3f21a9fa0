"""How heavy the elements of an explicit run may be before their inertia shows: the rules, before anything is meshed.

The steel near a rolling contact deforms quasi-statically: a patch takes some 400 us to pass, a wave some 17 us to cross
100 mm. Density times n makes that wave sqrt(n) times slower and the stable step as much longer. The bodies'
rigid masses are not touched: what a mesh gains, its lumped mass gives back (rail_fem.fe.mass_scaling).
"""

from bem.exact.hertz import PointContact, point_contact
from bem.material import contact_modulus
from rail_fem.scene.scene import Scene

TREAD_RADIUS = 0.330  # transverse radius of an EPS (P8) tread at the datum; the casting's top is a plane there
WAVE_DISTANCE = 0.1  # a wave's path through the steel near the contact [m]
# the largest transit time over the time that a patch takes to pass, with which "auto" is content: the reference case's
# force history then differs by less than 1.5 % (L2) from the unscaled one
TRANSIT = 0.25
# where only small elements are heavy: of the patch, beyond which elements are heavy to a greater depth, in proportion,
# and waves are kept faster by its root: the same error
PATCH_PART = 1 / 16
CUBE = 0.734  # wave speed times critical step of a cube over its side: geometry.meshing.quality.eigen_length
# the part of a body's mass that "auto" lets its mesh weigh, and the part that it lets small elements gain, whose mass
# lies near the patch
SHARE, GAIN = 0.8, 0.25


def static_patch(scene: Scene) -> PointContact:
    """Hertz patch of the static load on the planar top of the casting; a first guess, before geometry and plastic
    flow."""
    modulus = contact_modulus(scene.materials.wheel.steel().elastic, scene.materials.wing.steel().elastic)
    return point_contact(scene.static_wheel_load, scene.wheel.radius, TREAD_RADIUS, modulus)


def transit_ratio(scene: Scene, factor: float) -> float:
    """Time of a dilatational wave through the modelled steel, its density times `factor`, over the time that the patch
    under the static load takes to pass a point [1]."""
    transit = WAVE_DISTANCE * factor**0.5 / scene.materials.wing.steel().wave_speed
    return transit * scene.speed / (2 * static_patch(scene).semi_x)


def quasi_static_step(scene: Scene, length: float, ratio: float) -> float:
    """The longest critical step [s] of the elements under the wheel, of `length` = wave speed times critical step [m],
    with which dilatational waves in them are `ratio` times as fast as the wheel; faster, by the root of their length
    over PATCH_PART of the patch under the static load, where they are longer than that."""
    fine = PATCH_PART * 2 * static_patch(scene).semi_x
    return min(1.0, fine / length) ** 0.5 * length / (ratio * scene.speed)


def quasi_static_factor(scene: Scene) -> float:
    """The largest factor on the density with a transit ratio of at most TRANSIT; at least 1."""
    return max(1.0, (TRANSIT / transit_ratio(scene, 1.0)) ** 2)
