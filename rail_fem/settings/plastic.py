"""Numerics of the model bem_plastic, read from [run.bem_plastic] of a case file."""

from typing import Annotated

from pydantic import Field

from rail_fem.scene.scene import Count
from rail_fem.scene.units import Quantity
from rail_fem.settings.light import IndentationSettings

SMOKE_CELL = 3e-3


class BemPlasticSettings(IndentationSettings):
    """Forces as rigid_hertz finds them, rolled over a plastic half-space along wing and nose."""

    cell_size: Annotated[
        float, Quantity("mm", 0.1, 5, "side of the cells that hold plastic strain, across and in depth")
    ] = 1.5e-3
    cell_aspect: Annotated[float, Quantity("", 0.5, 6, "length of the cells along the track over their side")] = 1.0
    step: Annotated[float, Quantity("mm", 0.1, 20, "distance between positions of the wheel that are solved")] = 3e-3
    agreement: Annotated[
        float, Quantity("", 1e-6, 1e-1, "change of the surface over the approach at which pressure and flow agree")
    ] = 2e-3
    kinematic: bool = Field(
        False,
        description="kinematic hardening whatever a steel's curve says; off: as declared; a cyclic law has its own",
    )
    passes: Count = Field(
        1,
        ge=1,
        le=10000,
        description="wheels one after the other, under the forces of the first, until the steel is at rest",
    )
    error_estimate: bool = Field(True, description="roll once more on cells of twice the side, for the error estimate")

    def smoke(self) -> "BemPlasticSettings":
        """The same path through the program on coarse cells (RAIL_FEM_SMOKE=1)."""
        return self.model_copy(
            update={
                "cell_size": max(self.cell_size, SMOKE_CELL),
                "step": max(self.step, 4 * SMOKE_CELL),
                "passes": min(self.passes, 2),
            }
        )
