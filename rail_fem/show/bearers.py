"""What the bearers under a beam have carried, in words."""

from __future__ import annotations

from rail_fem.output.result import PassResult

HEADS = ("bearer", "x [mm]", "pad [kN]", "uplift [kN]", "ballast [kN]", "down [mm]", "")


def bearer_rows(result: PassResult) -> list[str]:
    """A line for each bearer near the window: largest forces, static load included; nothing on a rigid mass."""
    if not result.bearers:
        return []
    lines = ["".join(f"{head:>14}" for head in HEADS[:-1])]
    for one in result.bearers:
        numbers = (1e3 * one.x, one.pad_force / 1e3, one.uplift / 1e3, one.ballast_force / 1e3, 1e3 * one.deflection)
        lines.append(f"{one.number:>14}" + "".join(f"{value:>14.5g}" for value in numbers) + f"  {one.state}".rstrip())
    return lines
