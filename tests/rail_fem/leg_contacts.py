"""Two contacts on the leg, gauge side and field side of the head at once, by the light model.

rigid_hertz has one contact on each body, the one that carries a rigid wheel. On the leg the wheel changes from the one
to the other side of the head: there both carry, and what the wheel rides is no kink. The wheel is cut in two along its
tread; each part has its own contact, as wing and nose have elsewhere. Ahead of the nose, which is out of reach there.
"""

from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np

from geometry.path.path_search import BodySearch
from geometry.profiles.profile import Profile
from rail_fem.contact.contact_table import BY_BODY, ContactTable, TableKey, fresh_table, table_key, table_of
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_pass import run_pass
from rail_fem.result.events import Loss, lost_contact
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import RigidHertzSettings

CUT = 8e-3  # y on the rail's head at which the wheel is cut: no wheel is carried there on the leg [m]
RESOLUTION, REACH = 0.25e-3, 0.1  # of the rigid path [m]


class LegPass(NamedTuple):
    """Positions x (m,) [m] and force (m,) [N] on the wheel; flight : the longest loss of contact, if there is one."""

    x: np.ndarray
    force: np.ndarray
    flight: Loss | None


def part_of(profile: Profile, low: float, high: float) -> Profile:
    """The profile between two distances from its tread datum [m]."""
    keep = (profile.points[:, 0] >= low) & (profile.points[:, 0] <= high)
    arrays = {f.name: getattr(profile, f.name)[keep] for f in fields(profile) if f.name not in ("label", "provenance")}
    return replace(profile, **arrays)


def two_contact_table(key: TableKey) -> ContactTable:
    """Contacts of the wing body alone: row 0 on the gauge side of CUT, row 1 on its field side; heights as of the whole
    wheel."""
    whole, at = table_of(key), CUT - key.datum
    parts = [part_of(key.wheel, -np.inf, at), part_of(key.wheel, at, np.inf)]
    tables = [fresh_table(key._replace(wheel=part)) for part in parts]
    plain = [_height_on_plain_rail(key, part) for part in parts]  # each table counts from its own wheel's
    own = {name: np.stack([getattr(table, name)[0] for table in tables]) for name in BY_BODY}
    own["height"] = own["height"] + np.array(plain)[:, None] - max(plain)
    return replace(whole, **own)


def _height_on_plain_rail(key: TableKey, wheel: Profile) -> float:
    x = np.array([key.crossing.plain_x])
    search = BodySearch(key.crossing, wheel, "wing", x, key.radius, key.datum, RESOLUTION, REACH)
    return float(search.contacts(x)[0][0])


def two_contact_pass(scene: Scene, settings: RigidHertzSettings) -> LegPass:
    """A pass with both contacts. Errors: ValueError where the window reaches the nose."""
    table = two_contact_table(table_key(scene, *settings.window(scene), settings.path_spacing))
    if len(table.transfers):
        raise ValueError(
            f"two contacts on the leg: the wheel comes to the nose at x = {1e3 * table.transfers[0]:.0f} mm"
        )
    run = run_pass(scene, settings, contacts_of(scene, settings, table))
    force = run.force.sum(axis=0)
    lost = lost_contact(run.time, run.x, force, scene.static_wheel_load)
    return LegPass(run.x, force, max(lost, key=lambda loss: loss.end - loss.start, default=None))
