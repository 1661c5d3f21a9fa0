"""What a crossing stands on, bearer by bearer: rail and casting as one beam on pads, bearers and ballast.

All values are those of one rail: half a bearer that carries two. The track goes on alike to both sides; how much of it
is computed is a model's business.
"""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rail_fem.scene.base import Count, Frozen, input_error
from rail_fem.scene.units import Quantity

FARTHEST = 500  # number of a bearer that may be named

Number = Annotated[Count, Field(ge=-FARTHEST, le=FARTHEST)]
Factor = Annotated[float, Quantity("", 0, 100, "factor on what the other bearers have")]


class BeamSection(Frozen):
    """Section of a beam: Timoshenko's with a shear area, Euler's and Bernoulli's without."""

    second_moment: Annotated[float, Quantity("cm^4", 10, 1e6, "second moment of area about the lateral axis")]
    mass: Annotated[float, Quantity("kg/m", 5, 5000, "mass per length")]
    foot_depth: Annotated[float, Quantity("mm", 5, 1000, "depth of the foot below the neutral axis")]
    shear_area: Annotated[
        float | None, Quantity("cm^2", 1, 1e4, "area times shear coefficient; none: no shear deformation")
    ] = None
    youngs_modulus: Annotated[float, Quantity("GPa", 1, 1000, "Young's modulus")] = 210e9
    poisson: Annotated[float, Quantity("", 0, 0.4999, "Poisson's ratio")] = 0.3
    density: Annotated[float, Quantity("kg/m^3", 100, 30000, "density, for rotary inertia with a shear area")] = 7850.0

    @property
    def bending_stiffness(self) -> float:
        """EI [N m2]."""
        return self.youngs_modulus * self.second_moment

    @property
    def shear_stiffness(self) -> float:
        """Of the section [N]; infinite where shear is left out."""
        if self.shear_area is None:
            return float("inf")
        return self.youngs_modulus / (2 * (1 + self.poisson)) * self.shear_area

    @property
    def rotary_inertia(self) -> float:
        """Per length [kg m]; 0 where shear is left out, too."""
        return 0.0 if self.shear_area is None else self.density * self.second_moment


class CastingSection(BeamSection):
    """The casting from `start` to `end`, in place of the rail."""

    start: Annotated[float, Quantity("mm", -20000, 20000, "x where the casting begins")]
    end: Annotated[float, Quantity("mm", -20000, 20000, "x where it ends")]


# 56E1. Mass: EN 13674-1 as a maker quotes it; second moment and neutral axis: from memory, not verified
RAIL = BeamSection(second_moment=2321e-8, mass=56.3, foot_depth=74.5e-3)


class Bearers(Frozen):
    """Bearers under one beam; bearer 0 lies at `position`, numbers grow with x."""

    spacing: Annotated[float, Quantity("mm", 100, 3000, "distance between bearers")] = 0.6
    position: Annotated[float, Quantity("mm", -3000, 3000, "x of bearer 0")] = 0.0
    pad_stiffness: Annotated[float, Quantity("kN/mm", 1, 1e5, "stiffness of a pad")]
    pad_damping: Annotated[float, Quantity("kN s/m", 0, 5000, "damping of a pad")]
    mass: Annotated[float, Quantity("kg", 1, 5000, "mass of a bearer under one rail")]
    ballast_stiffness: Annotated[
        float, Quantity("kN/mm", 1, 1e5, "stiffness of ballast, or slab, under a bearer of one rail")
    ]
    ballast_damping: Annotated[float, Quantity("kN s/m", 0, 5000, "damping of ballast, or slab, there")]
    voided: tuple[Number, ...] = Field((), description="numbers of bearers that hang: no ballast carries them")
    missing: tuple[Number, ...] = Field((), description="numbers of bearers that are not there")
    unlike: tuple[Number, ...] = Field((), description="numbers of bearers with values of their own")
    unlike_pad: tuple[Factor, ...] = Field((), description="their factors on a pad's stiffness and damping; none: 1")
    unlike_mass: tuple[Factor, ...] = Field((), description="their factors on a bearer's mass; none: 1")
    unlike_ballast: tuple[Factor, ...] = Field(
        (), description="their factors on the ballast's stiffness and damping; none: 1"
    )
    rail: BeamSection = Field(RAIL, description="section of the rail, or of all where no casting is given")
    casting: CastingSection | None = Field(None, description="section of the casting; none: the rail goes through")

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        for name in ("unlike_pad", "unlike_mass", "unlike_ballast"):
            count = len(getattr(self, name))
            if count and count != len(self.unlike):
                raise input_error(
                    "bearers",
                    f"{count} factor(s) for {len(self.unlike)} bearer(s) of unlike: give one each",
                    key=f"bearers.{name}",
                )
        named = [*self.voided, *self.missing, *self.unlike]
        twice = sorted({number for number in named if named.count(number) > 1})
        if twice:
            raise input_error("bearers", f"bearer {twice[0]} is named twice among voided, missing and unlike")
        if any(factor == 0 for factor in (*self.unlike_mass, *self.unlike_pad)):
            raise input_error("bearers", "a factor of 0 on pad or mass: name the bearer in missing instead")
        if self.casting is not None and not self.casting.end - self.casting.start > self.spacing / 2:
            raise input_error(
                "bearers",
                f"casting from {self.casting.start * 1e3:g} to {self.casting.end * 1e3:g} mm: give an end more than"
                " half a bearer spacing beyond the start",
                key="bearers.casting",
            )
        return self

    def section(self, x: float) -> BeamSection:
        """The beam's section at x [m]."""
        casting = self.casting
        return casting if casting is not None and casting.start <= x <= casting.end else self.rail

    def factors(self, number: int) -> tuple[float, float, float]:
        """Of pad, mass and ballast of a bearer; of one that is missing all are 0."""
        if number in self.missing:
            return 0.0, 0.0, 0.0
        if number in self.voided:
            return 1.0, 1.0, 0.0
        if number not in self.unlike:
            return 1.0, 1.0, 1.0
        at = self.unlike.index(number)
        pad, mass, ballast = (
            values[at] if values else 1.0 for values in (self.unlike_pad, self.unlike_mass, self.unlike_ballast)
        )
        return pad, mass, ballast
