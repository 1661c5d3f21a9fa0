"""Axes, signs and stress order of the whole project, stated once.

| quantity | axis or sign |
|---|---|
| x | running direction; 0 at the theoretical intersection of the crossing's gauge lines; facing runs towards +x |
| y | lateral; 0 on the centre line of the upright approach rail, + towards the field side, gauge face at y = -35 mm |
| z | up; 0 on the crown of the approach rail |
| wheel profile | y from the tread datum D0 (70 mm from the flange back), + towards the field side; z up, 0 at D0 (the
flange tip has z < 0) |
| stress | tension positive; order VOIGT with *tensor* shears |
| pressure, normal_force | positive in compression |
| gap | positive when open |
| facing | from the legs towards the nose (+x); trailing is the reverse |

With x forward and z up, +y is to the left: the model is the left rail and the left wheel.
Everything is SI inside the program (m, kg, s, N, Pa); mm and kN exist only in case files, tables and plots.
"""

import numpy as np

VOIGT = ("xx", "yy", "zz", "yz", "xz", "xy")

# Lateral position of the wheel's tread datum D0 for a centred wheelset:
# gauge 1435 mm puts the track centre at y = -35 - 717.5 = -752.5 mm; back-to-back 1360 mm puts D0 at -752.5 + 680 + 70.
GAUGE_FACE_Y = -0.035
GAUGE_POINT_DEPTH = 0.014
# below rail level and below the tread datum, from where on meshed bodies are rigid [m]
RAIL_DEPTH, WHEEL_DEPTH = 0.055, 0.060
FLANGE_BACK = 0.070  # from the flange back to the tread datum D0 [m]


def tread_datum_y(gauge: float = 1.435, back_to_back: float = 1.360) -> float:
    """Lateral position of D0 [m] of the left wheel of a centred wheelset (gauge and back-to-back in m)."""
    return GAUGE_FACE_Y - gauge / 2 + back_to_back / 2 + FLANGE_BACK


def as_tensor(stress: np.ndarray) -> np.ndarray:
    """Symmetric tensors (..., 3, 3) from six components (..., 6) in the order VOIGT."""
    return stress[..., [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(*stress.shape[:-1], 3, 3)
