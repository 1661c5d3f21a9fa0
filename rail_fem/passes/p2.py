"""Forces of a wheel over a dip by formula: P2 and P1 of the UK standards. SI.

Source: Coleman's thesis, eq. 7-1 and tables 7-4, 7-5 (after NR/SP/TRK/012); Jenkins et al., Railway Eng. J. 3 (1974) 2
for P1. The thesis prints P2 = (P0 + increment) * 1.2; its own table 7-5 holds on all 16 rows for P2 = P0 + 1.2 *
increment only. Both are here. What P2 is: the largest force of the track on its spring after a wheel has struck a track
mass and moves on with it, without damping (tests/rail_fem/test_dip_joint.py). The contact force of that motion is less,
by unsprung / (unsprung + track mass) of the increment.
"""

import numpy as np

from rail_fem.scene.scene import Scene

DYNAMIC_FACTOR = 1.2
DIP_LIMIT = 10e-3  # of the standard for a P8 wheel [rad]
P2_LIMITS = {"high-speed power car": 266e3, "modern freight locomotive": 223e3}  # table 7-4 [N]


def p2_increment(
    dip_angle: float,
    speed: float,
    unsprung: float,
    track_mass: float,
    track_stiffness: float,
    track_damping: float = 0.0,
) -> float:
    """2 alpha V sqrt(Kt Mu) sqrt(Mu / (Mu + Mt)) (1 - pi Ct / (4 sqrt(Kt (Mu + Mt)))) [N].

    dip_angle = 2 alpha, between both slopes [rad]; masses [kg], stiffness [N/m], damping [N s/m]. The crossing standard
    leaves the damping out. The last factor is, to first order, what damping leaves of the first peak of a mass on a
    spring: exp(-pi zeta / 2) with zeta = Ct / (2 sqrt(Kt (Mu + Mt))); a limit of track forces is quoted with it.
    """
    together = unsprung + track_mass
    damped = 1 - np.pi * track_damping / (4 * np.sqrt(track_stiffness * together))
    return dip_angle * speed * np.sqrt(track_stiffness * unsprung) * np.sqrt(unsprung / together) * damped


def p2_force(static_load: float, increment: float, reading: str = "increment") -> float:
    """P2 [N] with the factor 1.2 on the increment ("increment") or on all ("all", as printed)."""
    if reading == "increment":
        return static_load + DYNAMIC_FACTOR * increment
    if reading == "all":
        return DYNAMIC_FACTOR * (static_load + increment)
    raise ValueError(f'reading {reading!r} of the P2 formula is not known: "increment" or "all"')


def p1_force(
    static_load: float, dip_angle: float, speed: float, contact_stiffness: float, unsprung: float, moved: float
) -> float:
    """P1 = P0 + 2 alpha V sqrt(KH me / (1 + me / Mu)) [N]: the wheel and what of the track it moves at once, me, on the
    contact spring KH [N/m] alone.

    moved : me [kg], the rail's own effective mass in Jenkins' formula; the whole track mass gives the first peak of
        models that have no other
    """
    return static_load + dip_angle * speed * np.sqrt(contact_stiffness * moved / (1 + moved / unsprung))


def unsprung_mass(scene: Scene, reading: str) -> float:
    """Mass Mu [kg]: "wheelset" as table 7-5 takes it, "half wheelset" as the static load and the dynamic models take
    it."""
    return scene.vehicle.wheelset_unsprung_mass if reading == "wheelset" else scene.vehicle.wheel_unsprung_mass
