"""The wheel behind its profile: hub, web and rim as a body of revolution that vibrates.

Its section is made of rectangles, the web led from the rim to the hub; the profile's own shape is left out.
"""

from typing import Annotated, ClassVar, Self

from pydantic import model_validator

from rail_fem.scene.base import Frozen, input_error
from rail_fem.scene.units import Quantity

# A monobloc wheel of a coach; all from memory, not verified: give those of the wheel in question
RIM_WIDTH, RIM_DEPTH, FLANGE_BACK = 0.135, 0.065, 0.070


class WheelBody(Frozen):
    """Section of a wheel on an axle; y counts from the tread datum towards the field side."""

    rim_width: Annotated[float, Quantity("mm", 50, 300, "width of the rim from the flange back")] = RIM_WIDTH
    rim_depth: Annotated[float, Quantity("mm", 15, 200, "depth of the rim below the tread datum")] = RIM_DEPTH
    flange_height: Annotated[float, Quantity("mm", 5, 60, "height of the flange above the tread datum")] = 0.028
    flange_thickness: Annotated[float, Quantity("mm", 5, 60, "mean thickness of the flange")] = 0.025
    web_thickness: Annotated[float, Quantity("mm", 5, 100, "thickness of the web")] = 0.025
    web_position: Annotated[float, Quantity("mm", -100, 150, "y of the web's middle where it meets the rim")] = 0.005
    web_offset: Annotated[
        float, Quantity("mm", -150, 150, "how far the web's middle lies to the field side where it meets the hub")
    ] = -0.030
    hub_radius: Annotated[float, Quantity("mm", 40, 400, "outer radius of the hub")] = 0.130
    hub_width: Annotated[float, Quantity("mm", 30, 400, "width of the hub")] = 0.180
    bore_radius: Annotated[float, Quantity("mm", 20, 300, "radius of the bore, where the axle is rigid")] = 0.095
    damping_ratio: Annotated[float, Quantity("", 0, 0.5, "damping of each mode over its critical damping")] = 1e-3

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if not self.bore_radius < self.hub_radius:
            raise input_error(
                "wheel_body",
                f"bore {self.bore_radius * 1e3:g} mm must be smaller than the hub's {self.hub_radius * 1e3:g} mm",
                key="wheel_body.bore_radius",
            )
        if not self.web_thickness < min(self.rim_width, self.hub_width):
            raise input_error(
                "wheel_body", "the web must be thinner than rim and hub are wide", key="wheel_body.web_thickness"
            )
        low, high = self.web_position - self.web_thickness / 2, self.web_position + self.web_thickness / 2
        if not self.rim_back <= low < high <= self.rim_back + self.rim_width:
            raise input_error("wheel_body", "the web must lie within the rim's width", key="wheel_body.web_position")
        return self

    rim_back: ClassVar[float] = -FLANGE_BACK  # y of the flange back [m]
