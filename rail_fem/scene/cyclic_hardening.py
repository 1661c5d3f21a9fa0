"""The table of a case file that gives a steel a law over many cycles (bem.steel)."""

from typing import Annotated, Any

from pydantic import Field

from rail_fem.scene.base import Frozen
from rail_fem.scene.units import Quantity

MOST_BACK_STRESSES = 10


class CyclicHardening(Frozen):
    """Plasticity of a steel over many cycles: back stresses and an isotropic part that saturates."""

    yield_stress: Annotated[float, Quantity("MPa", 1, 20000, "first yield stress")]
    modulus: tuple[Annotated[float, Quantity("GPa", 0, 1e4, "C of each back stress")], ...] = Field(
        min_length=1, max_length=MOST_BACK_STRESSES
    )
    recovery: tuple[Annotated[float, Quantity("", 0, 1e6, "gamma of each back stress")], ...]
    mixing: tuple[
        Annotated[float, Quantity("", 0, 1, "mu of each back stress, or one of all: 1 Chaboche, 0 Ohno-Wang; none: 1")],
        ...,
    ] = ()
    hardening: Annotated[float, Quantity("MPa", -20000, 20000, "Q, what the yield stress gains over many cycles")] = 0.0
    hardening_rate: Annotated[float, Quantity("", 0, 1e6, "b, how fast it gains it over the plastic strain")] = 0.0

    @property
    def constants(self) -> dict[str, Any]:
        """Those of bem.steel.cyclic_law.cyclic_law [SI]."""
        return self.model_dump() | {"mixing": self.mixing or 1.0}
