"""Profiles with the faults that measured ones have, made from the project's own standard profiles, and files of them in
every format."""

import numpy as np

from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile

MM = 1e-3


def measured_wheel(name: str = "S1002", begin: float = 1.55, rim: float = 32.0) -> np.ndarray:
    """(n, 2)  a wheel as a hand instrument measures it [mm]: y from the flange back, flange up, from `begin` behind the
    back to a rim face that reaches `rim` beyond the tread, farther than the flange does."""
    y, z = wheel_profile(name).points.T / MM
    y, z = y + 70.0, -z
    kept = (y > begin) & (y < 128.0)
    turn = np.radians(np.arange(0, 91, 3))
    last = np.array([y[kept][-1], z[kept][-1]])
    rounding = last + 12.0 * np.column_stack([np.sin(turn), np.cos(turn) - 1.0])
    face = np.column_stack([np.full(60, rounding[-1, 0]), np.linspace(rounding[-1, 1], -rim, 61)[1:]])
    return np.vstack([np.column_stack([y, z])[kept][::2], rounding[1:], face])


def measured_rail(name: str = "60E1") -> np.ndarray:
    """(n, 2)  a rail as a hand instrument measures it [mm]: gauge side at +y and 10 mm lower than the field side, crown
    at -6.01."""
    points = rail_head(name).points[::2] / MM
    points = points[points[:, 1] > np.where(points[:, 0] < 0, -34.0, -20.0)]
    return points[::-1] * [-1, 1] + [0.0, -6.01]


def leaning_rail() -> np.ndarray:
    """(n, 2)  a worn rail [m] whose gauge face leans over its foot by 2 mm from 12 mm below the crown on; the foot
    comes out again lower down."""
    head = rail_head("60E1").points[::4]
    top = head[head[:, 1] > -12 * MM]
    under = (
        top[0] + np.array([[0.5, -1], [1.5, -2.5], [2.0, -4], [1.0, -7], [-1.0, -10], [-4.0, -14], [-5.0, -18]]) * MM
    )
    dense = np.vstack(
        [np.linspace(a, b, 8, endpoint=False) for a, b in zip(under[::-1][:-1], under[::-1][1:])] + [under[:1]]
    )
    return np.vstack([dense, top])


def rows(points: np.ndarray, form: str = "{:.4f} {:.4f}") -> str:
    return "\n".join(form.format(*p) for p in points) + "\n"


MINIPROF_OLD = "MINIPROF 101 148 1994 3 24\nmade.prd\nStock.......:\nWheel ID....:\n32.58 37.11 14.71  (Sd/Sh/qR)\n\n"
MINIPROF_KEYS = "ProgramName=made\nXYPoints={count}\nXoffset=0.0000\nColumnDef=X,Y\nGauge=1436.9\n"


def written(path, text: str):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def simpack(points: np.ndarray, kind: str, comment: str = "") -> str:
    """A .prr or .prw [mm], vertical axis down, as CONTACT's test bank has them: short header, comments from %."""
    return (
        f"header.begin\n  version  = 1\n  type     = {int(kind == 'wheel')}\nheader.end\nspline.begin\n  approx.smooth"
        f" = 0.0\n{comment}  units.len.f   = 1000.\n  units.ang.f   =    1.\n "
        f" point.begin\n{rows(points * [1, -1], '{:12.6f} {:12.6f}')}  point.end\nspline.end\n"
    )
