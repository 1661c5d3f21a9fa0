"""What a damage study takes, read from [damage] of a case file."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from rail_fem.scene.base import FileName, InputError, input_error
from rail_fem.scene.scene import Count, Frozen, Wheel
from rail_fem.scene.units import Quantity
from rail_fem.settings.draws import Draw, Draws

MOST_PASSES, MOST_STOPS = 1e8, 200
# of plastic flow: p0 / k at which ten passes of fe_full come to rest, what of the rest one of them does, [m]
FLOW_LIMIT, FLOW_SHARE, FLOW_STEP = 7.0, 0.65, 50e-6
# what a profile's reader asks for, and how the profile command is told it (0: the flange back of many files)
TELLS_A_FILE = {"give flange_back": "--flange-back 0", "state the unit": "--unit mm"}
WHEEL = "scene.wheel.profile"  # key that a fleet draws
Years = Annotated[float, Quantity("", 0, 100, "years from now")]


def _checked_wheel(wheel: str, info: ValidationInfo) -> str:
    """Name of a profile, or its file beside the case."""
    if not wheel:
        return ""
    try:
        return Wheel.checked({"profile": wheel}, info.context).profile
    except InputError as error:
        told = "; ".join(remedy for _, remedy in error.faults)
        flag = next((flag for asked, flag in TELLS_A_FILE.items() if asked in told), None)
        if flag:
            file = Path((info.context or {}).get("folder", ".")) / wheel
            told += f"; its table has no key for it: rail-fem profile {file} {flag} --write {file.stem}-told.csv"
        raise input_error("wheel", told) from None


WheelName = Annotated[str, AfterValidator(_checked_wheel)]


class SwitchSite(Frozen):
    """The section of a switch that wears, and the sine on which the wheelset runs (thesis section 4.5)."""

    distance: Annotated[float, Quantity("m", 0.1, 5.5, "distance of the section from the toe")] = 1.0
    lateral: Annotated[float, Quantity("mm", -20, 20, "mean shift of the wheelset towards the switch rail")] = 10.2e-3
    amplitude: Annotated[float, Quantity("mm", 0, 10, "of the sine about the mean")] = 1.25e-3
    positions: Count = Field(12, ge=1, le=200, description="lateral positions that stand for the sine")
    yaw: Annotated[float, Quantity("mrad", -50, 50, "yaw of the wheelset")] = 0.0
    rail_stiffness: Annotated[float, Quantity("MN/m", 1, 1e4, "lateral stiffness of one rail")] = 20e6


class Traffic(Frozen):
    """A kind of pass in the traffic of a damage study."""

    wheel: WheelName = Field(
        "", description="wheel profile by name, or as a path beside the case file; none: the scene's"
    )
    stock: Literal["passenger", "freight", "tractive"] = Field("passenger", description="by which its tonnage counts")
    share: Annotated[float, Quantity("", 0, 1, "of all passes; shares sum to 1")] = 1.0
    speed: Annotated[float | None, Quantity("mph", 0.5, 350, "speed; none: the scene's")] = None
    axle_load: Annotated[
        float | None, Quantity("t", 1, 60, "axle load, by which its sprung mass differs; none: the scene's")
    ] = None


class DamageFleet(Draws):
    """Traffic that is drawn: each kind of pass as its draws have it, all of one share."""

    kinds: Count = Field(32, ge=2, le=1000, description="kinds of pass that are drawn")
    stock: Literal["passenger", "freight", "tractive"] = Field("passenger", description="by which its tonnage counts")

    @field_validator("draw")
    @classmethod
    def _wheels_are_there(cls, draw: dict[str, Draw], info: ValidationInfo) -> dict[str, Draw]:
        if own := draw.get(WHEEL):
            wheels = tuple(_checked_wheel(str(wheel), info) for wheel in own.of)
            return draw | {WHEEL: own.model_copy(update={"of": wheels})}
        return draw


class LineWear(Frozen):
    """Where a wheel wears between two turnings, by the law of the study, and when it is turned."""

    deviation: Annotated[
        float, Quantity("mm", 0.2, 10, "standard deviation of the wheelset's lateral position on straight line")
    ] = 3e-3
    hollow: Annotated[float, Quantity("mm", 0.05, 5, "of the tread at which it is turned; recalled")] = 2e-3
    flange_height: Annotated[
        float, Quantity("mm", 20, 40, "at which it is turned, from the tread datum; EN 15313, recalled")
    ] = 36e-3


class Turning(Frozen):
    """Wheels of a life study that come at all ages between two turnings."""

    worn: WheelName = Field("", description="profile to which wheels wear, by name, or as a path beside the case file")
    line: LineWear | None = Field(None, description="in place of worn: they wear on straight line, up to a limit")
    until: Annotated[float, Quantity("", 0, 1, "of that wear, at which they are turned; 0: they stay new")] = 1.0
    ages: Count = Field(3, ge=1, le=50, description="equal parts of the way between two turnings, a wheel each")

    @model_validator(mode="after")
    def _one_way_to_wear(self) -> Self:
        if bool(self.worn) == (self.line is not None):
            raise ValueError("give either worn, a profile, or a table turning.line")
        return self


class ExplicitFlow(Frozen):
    """Plastic flow of a crossing in a life study by passes of fe_full, as [run.fe_full] has its numerics."""

    every: Annotated[float, Quantity("", 1, MOST_PASSES, "passes of the study between two stops, the first before all")]
    passes: Count = Field(10, ge=1, le=1000, description="of fe_full at each stop, by the most frequent kind of pass")


class DamageSettings(Frozen):
    """Wear, fatigue and life of a rail under many passes."""

    site: Literal["crossing", "switch"] = Field("crossing", description="what is damaged: crossing, switch section")
    passes: Annotated[float, Quantity("", 0, MOST_PASSES, "wheel passes")] = 2000.0
    hardness: Annotated[float, Quantity("GPa", 0.5, 8, "hardness of the rail; 260 HB is 2.6 GPa, worked Mn13 5")]
    wheel_hardness: Annotated[
        float, Quantity("GPa", 0.5, 8, "hardness of the wheels that wear on a crossing; 2.6 is 260 HB")
    ] = 2.6e9
    law: Literal["archard", "archard_patch", "usfd", "brr", "krause_poll"] = Field(
        "archard", description="wear law by which the shape changes; all laws are reported"
    )
    calibration: Annotated[
        float | None,
        Quantity("", 1e-3, 1e3, "factor on all wear laws for lubrication and climate; none: 1, and no years"),
    ] = None
    wear_coefficient: Annotated[float | None, Quantity("", 0, 1, "Archard's k in place of the map; none: the map")] = (
        None
    )
    cells: Count = Field(50, ge=10, le=400, description="cells of a patch, each way")
    tangential: Literal["plane", "conformal"] = Field(
        "plane",
        description="FASTSIM with one creepage in a patch's tangent plane, or with normal and creepage of each strip"
        " where a patch of a crossing bends around a corner",
    )
    patch_spacing: Annotated[float, Quantity("mm", 0.1, 50, "between the patches along a crossing")] = 2e-3
    plan_spacing: Annotated[
        float, Quantity("mm", 0.05, 2, "across a crossing between the depths of its plan; along it is patch_spacing")
    ] = 0.25e-3
    block: Annotated[
        float | None, Quantity("", 1, 1e7, "passes between two shapes, at most on a switch; none: by tolerance")
    ] = None
    block_depth: Annotated[float, Quantity("um", 0.01, 100, "deepest that a crossing may wear between two shapes")] = (
        5e-6
    )
    block_share: Annotated[
        float | None,
        Quantity("", 1e-3, 1, "least length of a block in parts of the passes done; none: 0.1 crossing, 0.02 switch"),
    ] = None
    tolerance: Annotated[float, Quantity("%", 0.01, 20, "of the depth that a finer block may change")] = 0.01
    smoothing: Annotated[
        float, Quantity("mm", 0, 2, "standard deviation by which depths are spread along the line")
    ] = 0.1e-3
    depth_limit: Annotated[float, Quantity("mm", 0.01, 50, "depth at which the section is worn through")] = 10e-3
    kinetic_friction: Annotated[
        float | None, Quantity("", 0, 2, "friction at large slip, below or above the scene's; none: the same")
    ] = None
    decay_speed: Annotated[
        float, Quantity("m/s", 1e-3, 100, "slip velocity over which friction's change with slip falls to 1/e")
    ] = 1.0
    initial_slope: Annotated[float, Quantity("", 0.01, 1, "third-body reduction of the creep curve's first slope")] = (
        1.0
    )
    traffic: tuple[Traffic, ...] = Field((), description="kinds of pass, a table each; none: the scene's alone")
    fleet: DamageFleet | None = Field(
        None, description="in place of traffic: what differs from wheel to wheel is drawn, life is a distribution"
    )
    turning: Turning | None = Field(None, description="wheels that wear and are turned; none: all stay as they are")
    lateral_scatter: Annotated[float, Quantity("mm", 0, 10, "standard deviation of the wheels' lateral position")] = 0.0
    shear_yield: Annotated[
        float, Quantity("MPa", 50, 2000, "shear yield stress of the worked surface, for the shakedown map")
    ] = 300e6
    dang_van: Annotated[float, Quantity("", 0, 2.9, "Dang Van's weight of the hydrostatic stress; recalled")] = 0.3
    fatigue_limit: Annotated[float, Quantity("MPa", 10, 2000, "shear fatigue limit below the surface; recalled")] = (
        200e6
    )
    residual_stress: Annotated[
        float, Quantity("MPa", -2000, 2000, "hydrostatic residual stress below the surface, + tension")
    ] = 0.0
    onset: Annotated[float, Quantity("N", 0, 1e4, "T gamma where fatigue begins")] = 15.0
    peak: Annotated[float, Quantity("N", 0, 1e4, "T gamma of most fatigue; the thesis prints 75")] = 65.0
    balance: Annotated[float, Quantity("N", 0, 1e4, "T gamma where wear takes away all cracks")] = 175.0
    axles_per_year: Annotated[float, Quantity("", 1, 1e8, "axles that run over it in a year")] = 500e3
    track_category: Literal["1A", "1", "2", "3", "4", "5", "6"] | None = Field(
        None, description="by which the crossing is inspected; none: nothing is said of inspections"
    )
    flow: FileName = Field(
        "",
        description="folder of a run of bem_plastic or fe_full on the same crossing, relative to the case file: wear"
        " begins on the surface that its plastic flow has left; none: on the casting",
    )
    plastic_flow: bool = Field(
        False,
        description="the steel of wing and nose flows with the passes where patches press beyond shakedown, hardens by"
        " its curve, and heaps up beside the grooves",
    )
    flow_limit: Annotated[
        float,
        Quantity(
            "", 2, 20, "largest pressure of Hertz over shear yield stress at which flow rests; 7: that of fe_full"
        ),
    ] = FLOW_LIMIT
    flow_step: Annotated[float, Quantity("um", 1, 1000, "deepest plastic flow between two shapes")] = FLOW_STEP
    flow_share: Annotated[float, Quantity("", 0.01, 0.99, "of what is left to flow that one pass does")] = FLOW_SHARE
    explicit: ExplicitFlow | None = Field(
        None, description="flow of wing and nose by fe_full at stops, on the shape worn by then; none: by no passes"
    )
    grindings: tuple[Years, ...] = Field(
        (), description="years at which the first shape is ground again: cracks go, height is lost"
    )
    grinding_depth: Annotated[
        float, Quantity("mm", 0, 5, "that a grinding takes off below the deepest wear, to the bottom of cracks")
    ] = 0.2e-3
    weldings: tuple[Years, ...] = Field((), description="years at which welding brings back the first shape and height")
    sensitivities: bool = Field(
        False, description="of a crossing's wear to speed, axle load, friction and foundation: sixteen more passes"
    )
    switch: SwitchSite = Field(SwitchSite(), description="section of a switch and its traffic")

    @property
    def factor(self) -> float:
        """On all wear laws; that of the dry laboratory where no calibration is given."""
        return 1.0 if self.calibration is None else self.calibration

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.site == "switch" and self.plastic_flow:
            self._refuse("plastic_flow: plastic flow is known of a crossing's wing and nose; leave it out")
        if self.plastic_flow and (self.grindings or self.weldings):
            self._refuse(
                "plastic_flow: how hard the steel is after grindings or weldings is not known; leave one of them out"
            )
        other = [name for name in ("plastic_flow", "flow", "grindings", "weldings") if getattr(self, name)]
        if self.explicit and (other or self.site == "switch"):
            self._refuse(f"explicit: flow of a crossing by fe_full alone; leave out {(*other, 'it')[0]}")
        if self.explicit and self.passes > MOST_STOPS * self.explicit.every:
            self._refuse(f"explicit.every: {self.passes / self.explicit.every:.4g} stops, at most {MOST_STOPS}")
        if self.plastic_flow and self.flow:
            self._refuse(
                "plastic_flow: flow, a run's surface, holds the first passes' flow already; leave one of them out"
            )
        if self.site == "switch" and self.flow:
            self._refuse("flow: plastic flow is known of a crossing's wing and nose; leave it out")
        if self.site == "switch" and self.tangential == "conformal":
            self._refuse('tangential: strips of their own normals are known of a crossing\'s patches; write "plane"')
        if self.site == "switch" and self.lateral_scatter:
            self._refuse("lateral_scatter: the switch's wheelset runs on a sine; leave it out")
        if not 0 <= self.onset < self.peak < self.balance:
            self._refuse(f"onset {self.onset:g}, peak {self.peak:g} and balance {self.balance:g} N must grow")
        if self.fleet and (self.traffic or self.site == "switch"):
            self._refuse("fleet: is drawn over a crossing in place of traffic; leave one of them out")
        if self.fleet and (other := [key for key in self.fleet.draw if not key.startswith("scene.")]):
            self._refuse(f"fleet.draw: {other[0]}: what a wheel brings along is a key of the scene, scene.speed")
        if self.fleet and (fixed := [key for key in self.fleet.draw if key.startswith("scene.crossing")]):
            self._refuse(f"fleet.draw: {fixed[0]}: the crossing that wears is one; leave it out")
        if self.turning and self.fleet:
            self._refuse("turning: a fleet's wheels are drawn with their wear; leave one of them out")
        total = sum(kind.share for kind in self.traffic)
        if self.traffic and abs(total - 1) > 1e-6:
            self._refuse(f"traffic: shares add up to {total:.6g}, they must sum to 1")
        return self

    @staticmethod
    def _refuse(message: str) -> None:
        raise PydanticCustomError("damage", "{message}", {"message": message})
