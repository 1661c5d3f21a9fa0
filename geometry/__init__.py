"""Shapes and kinematics of wheel and rail: profiles, crossings, contact points, wheel paths, meshes. Axes and signs:
geometry.axes.

    import geometry
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
    "CastCrossing": "geometry.surfaces.crossing",
    "CheckRail": "geometry.wheelset",
    "ContactSearch": "geometry.contact.prismatic_search",
    "Profile": "geometry.profiles.profile",
    "ProfileError": "geometry.profiles.profile",
    "RailSurface": "geometry.surfaces.lofted_rail",
    "SurfaceSearch": "geometry.contact.lofted_search",
    "Switch": "geometry.surfaces.switch",
    "Track": "geometry.wheelset",
    "Wheelset": "geometry.wheelset",
    "equivalent_conicity": "geometry.contact.conicity",
    "examine": "geometry.profiles.doctor",
    "rail_head": "geometry.profiles.rail",
    "read_profile": "geometry.profiles.reading",
    "read_raw": "geometry.profiles.formats.by_suffix",
    "wheel_path": "geometry.path.wheel_path",
    "wheel_profile": "geometry.profiles.wheel",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'geometry' has no attribute '{name}'; it offers {', '.join(__all__)}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return list(__all__)
