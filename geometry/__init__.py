"""Shapes and kinematics of wheel and rail: profiles, crossings, contact points, wheel paths, meshes. Axes and signs:
geometry.axes::

    from rail_fem import geometry
    wheel, rail = geometry.read_profile("wheel.whl"), geometry.rail_head("60E1", inclination=1 / 40)
    search = geometry.ContactSearch(geometry.Wheelset(wheel, radius=0.46), geometry.Track(rail))
    print(search.contacts(search.settle(3e-3), "left").position)

Names are imported when they are first used."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geometry.contact.conicity import equivalent_conicity
    from geometry.contact.lofted_search import SurfaceSearch
    from geometry.contact.prismatic_search import ContactSearch
    from geometry.path.wheel_path import wheel_path
    from geometry.profiles.doctor import examine
    from geometry.profiles.formats.by_suffix import read_raw
    from geometry.profiles.profile import Profile, ProfileError
    from geometry.profiles.rail import rail_head
    from geometry.profiles.reading import read_profile
    from geometry.profiles.wheel import wheel_profile
    from geometry.surfaces.crossing import CastCrossing
    from geometry.surfaces.lofted_rail import RailSurface
    from geometry.surfaces.switch import Switch
    from geometry.wheelset import CheckRail, Track, Wheelset

__all__ = [
    "CastCrossing", "CheckRail", "ContactSearch", "Profile", "ProfileError", "RailSurface", "SurfaceSearch", "Switch",
    "Track", "Wheelset", "equivalent_conicity", "examine", "rail_head", "read_profile", "read_raw", "wheel_path",
    "wheel_profile",
]  # fmt: skip

_HOMES = {
    "CastCrossing": ".surfaces.crossing",
    "CheckRail": ".wheelset",
    "ContactSearch": ".contact.prismatic_search",
    "Profile": ".profiles.profile",
    "ProfileError": ".profiles.profile",
    "RailSurface": ".surfaces.lofted_rail",
    "SurfaceSearch": ".contact.lofted_search",
    "Switch": ".surfaces.switch",
    "Track": ".wheelset",
    "Wheelset": ".wheelset",
    "equivalent_conicity": ".contact.conicity",
    "examine": ".profiles.doctor",
    "rail_head": ".profiles.rail",
    "read_profile": ".profiles.reading",
    "read_raw": ".profiles.formats.by_suffix",
    "wheel_path": ".path.wheel_path",
    "wheel_profile": ".profiles.wheel",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute '{name}'; it offers {', '.join(__all__)}")
    return getattr(importlib.import_module(_HOMES[name], __name__), name)


def __dir__() -> list[str]:
    return list(__all__)
