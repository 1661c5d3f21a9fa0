"""What a card takes of a case, and what room that needs there; said before a run begins."""

from __future__ import annotations

from rail_fem.fe.state import N_STATE, N_STATE_FULL, POINTS
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

# on the card, beside state and back stresses: of an element nodes 32, forces 192, their places 64, works and volume 32;
# of a node, of which there are about as many, 179; by counting the arrays of rail_fem.fe.card.on_card
BYTES_PER_CELL = 499.0
CONTEXT = 0.5e9  # what the driver takes of each process [B]: from memory, not measured


def room_on_card(cells: float, scene: Scene, settings: FeSettings) -> float:
    """That a pass of so many cells takes there [B]."""
    from rail_fem.fe.blocks import ElementSettings, material_table

    rows, points = (N_STATE_FULL, POINTS) if settings.element == "full" else (N_STATE, 1)
    backs = material_table(scene.materials.steels(), ElementSettings()).back_stresses
    return CONTEXT + cells * (BYTES_PER_CELL + 8 * (rows + 6 * points * backs))


def unfit_for_card(scene: Scene, settings: FeSettings, ranks: int) -> list[str]:
    """What forbids the case on a card, a line each; none where cores make the steps."""
    if settings.device != "cuda":
        return []
    lacks = {
        f"{ranks} ranks: one drives it": ranks > 1,
        "bearers: their beam is the processor's": scene.bearers is not None and settings.foundation,
        "foot_depth: its block is the processor's": settings.foot_depth is not None,
        "[scene.wheel_body]: its modes are the processor's": scene.wheel_body is not None,
        "a diverging route: nothing there holds a wheelset across the track": scene.diverging is not None,
    }
    found = [f'"cuda" does not take {what}; take "cpu"' for what, there in lacks.items() if there]
    from rail_fem.fe.card.device import missing

    return [f"device: {why}" for why in (*found, missing()) if why]
