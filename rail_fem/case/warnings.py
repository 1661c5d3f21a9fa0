"""What is allowed in a case but doubtful: one warning each, with both numbers."""

from bem.exact.hertz import PointContact, point_contact
from bem.material import Elastic, contact_modulus
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

TREAD_RADIUS = 0.330          # transverse radius of an EPS (P8) tread at the datum; the casting's top is a plane there
ELEMENTS_ACROSS_PATCH = 6
STAND_INS = {"P8-worn": "nominal P8 with 0.8 mm of assumed tread wear", "P8-hollow": "nominal P8 with 3 mm of assumed hollow wear",
             "P1": "a 1:20 cone built from recalled dimensions"}


def static_patch(scene: Scene) -> PointContact:
    """Hertz patch of the static load on the planar top of the casting; a first guess, before geometry and plastic flow."""
    wheel, wing = scene.materials.wheel.steel(), scene.materials.wing.steel()
    modulus = contact_modulus(*(Elastic(steel.youngs_modulus, steel.poisson) for steel in (wheel, wing)))
    return point_contact(scene.static_wheel_load, scene.wheel.radius, TREAD_RADIUS, modulus)


def scene_doubts(scene: Scene) -> list[str]:
    """Doubts about the physics."""
    doubts = [] if scene.wheel.measured is None else scene.wheel.measured.doubts
    if scene.wheel.profile in STAND_INS:
        doubts.append(f"wheel profile {scene.wheel.profile} is a stand-in ({STAND_INS[scene.wheel.profile]}), not a measured wheel")
    if scene.friction > 0.7:
        doubts.append(f"friction {scene.friction:g} > 0.7: steel on steel, dry, has 0.2 to 0.6")
    if any(not 0 <= material.steel().poisson < 0.45 for material in (scene.materials.wing, scene.materials.nose)):
        doubts.append("Poisson's ratio >= 0.45: the critical step falls with the bulk modulus")
    return doubts


def fe_doubts(scene: Scene, settings: FeSettings) -> list[str]:
    """Doubts about the numerics of an explicit FE run of this scene."""
    doubts = []
    patch = static_patch(scene)
    across, needed = 2 * min(patch.semi_x, patch.semi_y), ELEMENTS_ACROSS_PATCH * settings.element_size
    if across < needed:
        doubts.append(f"patch {across * 1e3:.1f} mm < {ELEMENTS_ACROSS_PATCH} elements of {settings.element_size * 1e3:g} mm: pressure and plastic strain will be coarse")
    if settings.courant > 0.95:
        doubts.append(f"courant {settings.courant:g} > 0.95: contact stiffens the surface, the step may become unstable")
    if not 0.1 <= settings.penalty <= 10:
        doubts.append(f"penalty {settings.penalty:g} is outside [0.1, 10]: soft contact overlaps, stiff contact chatters and needs a shorter step")
    return doubts
