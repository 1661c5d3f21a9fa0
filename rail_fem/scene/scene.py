"""The scene: which wheel passes which crossing, how fast, on what. Physics only, no numerics.

Values are SI. Every field carries its unit, range and meaning once, in its `Quantity`.

Files that a scene names are read once, when it is made: the scene carries what they held, and everything after works on
that.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import PydanticCustomError

from geometry.axes import tread_datum_y
from geometry.surfaces.bodies import REGIONS
from rail_fem.scene.base import GRAVITY, PRINTABLE, Count, FileName, FromFile, Frozen, input_error, kept
from rail_fem.scene.bearers import Bearers
from rail_fem.scene.crossing import CAST, SWITCH, Crossing
from rail_fem.scene.cyclic_hardening import CyclicHardening
from rail_fem.scene.diverging import Diverging
from rail_fem.scene.steel import GRADES, Steel, cyclic_steel
from rail_fem.scene.units import Quantity
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.scene.wheel_profile import KEPT, WHEEL_NAMES, MeasuredWheel, ProfileReading, read_wheel, wheel_shape

if TYPE_CHECKING:
    from geometry.profiles.profile import Profile

LOAD_KEYS = {"axle_load": "vehicle_sprung_mass", "vehicle_sprung_mass": "axle_load"}  # each is told by the other
NO_VALUE = (None, "none")  # of a key that is left out, in Python and in a file
LOAD_DIGITS = 1e-3  # to which both agree where both are told: tables have three digits
SPIN_GYRATION = 0.25  # of a wheelset about its axle, where a case gives no inertia [m]
READING = tuple(ProfileReading.__dataclass_fields__)  # keys of a wheel that say how its profile file is to be read


class Wheel(FromFile):
    """One wheel: a profile that geometry knows by name, or the path of a profile file beside the case file.

    digest : of what the profile file held; a run writes it, and a scene that states it takes no other content. measured
        : what was read.
    """

    READ, KEPT, TOLD = "measured", KEPT, frozenset({"profile", *READING})

    profile: FileName = Field(description="name of a wheel profile, or the path of a profile file")
    far_tread_slope: Annotated[float, Quantity("%", 5, 15, "slope of the far tread of the P8 family")] = 0.067
    radius: Annotated[float, Quantity("mm", 250, 700, "rolling radius at the tread datum")] = 0.425
    label: str = Field("", max_length=100, pattern=PRINTABLE, description="free text that tables and plots show")
    unit: Literal["mm", "cm", "m", "inch"] | None = Field(
        None, description="unit of the profile file; none: as it says, or by its width"
    )
    number: Annotated[Count, Field(ge=1)] | None = Field(
        None, description="which profile of an .mpt file; none: the first"
    )
    flange_back: Annotated[
        float | None,
        Quantity(
            "mm", -1000, 1000, "y of the flange back in the profile file; none: by its datum, its format or its shape"
        ),
    ] = None
    smoothing: Annotated[
        float | None, Quantity("um", 0.1, 999, "scatter to take out of the profile file; none: what its points show")
    ] = None
    measured: SkipJsonSchema[Any] = Field(None, exclude=True, repr=False, validate_default=True)
    digest: str = Field("", validate_default=True, description="digest of the profile file's content")

    @field_validator("profile")
    @classmethod
    def _profile_is_there(cls, profile: str, info: ValidationInfo) -> str:
        if profile in WHEEL_NAMES or kept(profile, info):
            return profile
        if not Path(profile).suffix:
            raise PydanticCustomError("choice", "unknown", {"choices": WHEEL_NAMES})
        return cls.path_of(profile, info, f"one of {', '.join(WHEEL_NAMES)}, ")

    @field_validator("measured", mode="plain")
    @classmethod
    def _read_once(cls, measured: Any, info: ValidationInfo) -> MeasuredWheel | None:
        if measured is not None:
            raise input_error("not_a_key", "unknown key")
        profile, told = info.data.get("profile", WHEEL_NAMES[0]), {name: info.data.get(name) for name in READING}
        if profile in WHEEL_NAMES:
            _refuse_reading(profile if "profile" in info.data else "", told)
            return None
        if known := kept(profile, info):
            return known
        try:
            return read_wheel(
                Path(profile), ProfileReading() if "run_folder" in (info.context or {}) else ProfileReading(**told)
            )
        except (OSError, ValueError) as error:
            raise input_error("profile_file", str(error), key="profile") from error

    @property
    def name(self) -> str:
        """What tables and plots call the wheel."""
        return self.label or (self.profile if self.measured is None else self.measured.profile.label)

    @property
    def shape(self) -> "Profile":
        """The profile's line (geometry.profiles.profile.Profile)."""
        if self.profile in WHEEL_NAMES:
            return wheel_shape(self.profile, self.far_tread_slope)
        if self.measured is None or self.measured.source != self.profile:
            raise ValueError(f"{self.profile} was not read when this wheel was made: make a new Wheel of it")
        return self.measured.profile


def _refuse_reading(profile: str, told: dict[str, Any]) -> None:
    for name, value in told.items():
        if profile and value is not None:
            raise input_error(
                "not_of_a_name", f"is told of a profile file, {profile} is known by its name: leave it out", key=name
            )


class Vehicle(Frozen):
    """Masses of the whole vehicle and of one wheelset, as tables give them, and the primary suspension of one wheel.

    The load is told by axle_load or by vehicle_sprung_mass, which is known in either case.
    """

    wheelset_unsprung_mass: Annotated[float, Quantity("t", 0.1, 6, "unsprung mass of one wheelset")]
    wheel_count: Count = Field(8, ge=2, le=64, multiple_of=2, description="number of wheels that carry the vehicle")
    axle_load: Annotated[
        float | None, Quantity("t", 0.3, 100, "mass that one axle carries, its own included; none: by sprung mass")
    ] = None
    vehicle_sprung_mass: Annotated[
        float, Quantity("t", 1, 300, "sprung mass of the whole vehicle; none: by axle_load")
    ] = Field(None, validate_default=True)
    wheelset_spin_inertia: Annotated[
        float | None,
        Quantity(
            "kg m^2", 1, 2000, "moment of inertia of one wheelset about its axle; none: unsprung mass times (0.25 m)^2"
        ),
    ] = None
    primary_stiffness: Annotated[float, Quantity("MN/m", 0.01, 50, "primary suspension stiffness per wheel")] = 1.2e6
    primary_damping: Annotated[float, Quantity("kN s/m", 0, 1000, "primary suspension damping per wheel")] = 10.0e3

    @field_validator("vehicle_sprung_mass", mode="before")
    @classmethod
    def _by_axle_load(cls, mass: Any, info: ValidationInfo) -> Any:
        if mass is not None:
            return mass
        known = info.data
        if not {"wheelset_unsprung_mass", "wheel_count", "axle_load"} <= set(known):
            return "1 t"  # never seen: their own errors are told
        if known["axle_load"] is None:
            remedy = 'neither it nor vehicle_sprung_mass is given: write one of the two, e.g. axle_load = "22.5 t"'
            raise input_error("no_load", remedy, key="axle_load")
        axle, wheelset = known["axle_load"], known["wheelset_unsprung_mass"]
        if axle <= wheelset:
            raise input_error(
                "no_load", f"{axle / 1e3:g} t is no more than the wheelset's own {wheelset / 1e3:g} t", key="axle_load"
            )
        return f"{(axle - wheelset) * known['wheel_count'] / 2!r} kg"

    @model_validator(mode="after")
    def _loads_agree(self) -> Self:
        carried = 2 * (self.wheel_sprung_mass + self.wheel_unsprung_mass)
        if self.axle_load is not None and abs(carried - self.axle_load) > LOAD_DIGITS * self.axle_load:
            raise input_error(
                "two_loads",
                f"{self.axle_load / 1e3:g} t, but vehicle_sprung_mass, wheel_count and wheelset_unsprung_mass make"
                f" {carried / 1e3:g} t: leave one of the two out",
                key="vehicle.axle_load",
            )
        return self

    def replace_si(self, **changes: Any) -> Self:
        """As Frozen.replace_si; a new axle load or sprung mass takes the place of the other."""
        given = "vehicle_sprung_mass" if "vehicle_sprung_mass" in changes else "axle_load"
        other = LOAD_KEYS[given]
        if changes.get(given, self.axle_load) not in NO_VALUE:
            changes = {other: None} | changes
        return self._replaced(changes, {})

    @property
    def wheel_sprung_mass(self) -> float:
        """Sprung mass on one wheel [kg]: an eighth of a vehicle on eight wheels."""
        return self.vehicle_sprung_mass / self.wheel_count

    @property
    def wheel_unsprung_mass(self) -> float:
        """Unsprung mass of one wheel [kg]: half a wheelset."""
        return self.wheelset_unsprung_mass / 2

    @property
    def wheel_spin_inertia(self) -> float:
        """About the axle, of one wheel [kg m2]: half a wheelset. Radius of gyration, where nothing is given: that of
        the passenger vehicle of the Manchester benchmarks, 112 kg m2 of 1813 kg (Iwnicki, 1998; recalled, not looked
        up)."""
        given = self.wheelset_spin_inertia
        return (self.wheelset_unsprung_mass * SPIN_GYRATION**2 if given is None else given) / 2


class Foundation(Frozen):
    """Spring, damper and added mass under the crossing, one rail. Damping: GM/TT0088; mass: the P2 formula's lumped
    track mass."""

    stiffness: Annotated[float, Quantity("kN/mm", 1, 5000, "foundation stiffness of one rail")]
    damping: Annotated[float, Quantity("kN s/m", 0, 5000, "foundation damping of one rail")] = 55.4e3
    track_mass: Annotated[float, Quantity("kg", 0, 10000, "lumped track mass of one rail")] = 750.0


class Material(Frozen):
    """A steel by its grade; `strength` scales the yield curve, the other fields replace the grade's values."""

    grade: str = Field(description=f"steel grade: {', '.join(GRADES)}")
    strength: Annotated[float, Quantity("%", 20, 1000, "factor on the stresses of the yield curve")] = 1.0
    youngs_modulus: Annotated[float | None, Quantity("GPa", 1, 1000, "Young's modulus")] = None
    poisson: Annotated[float | None, Quantity("", 0, 0.4999, "Poisson's ratio")] = None
    density: Annotated[float | None, Quantity("kg/m^3", 100, 30000, "density")] = None
    hardening_strain: tuple[Annotated[float, Quantity("", 0, 10, "plastic strain of a curve point")], ...] | None = None
    hardening_stress: (
        tuple[Annotated[float, Quantity("MPa", 1, 20000, "true yield stress of a curve point")], ...] | None
    ) = None
    hardening: Literal["isotropic", "kinematic"] | None = Field(
        None, description="how the curve is meant: the yield surface grows, or moves"
    )
    cyclic: CyclicHardening | None = Field(
        None,
        description="plasticity over many cycles in place of the curve, which other models take from its first one",
    )

    @model_validator(mode="before")
    @classmethod
    def _grade_alone(cls, value: Any) -> Any:
        return {"grade": value} if isinstance(value, str) else value

    @field_validator("grade")
    @classmethod
    def _known_grade(cls, grade: str) -> str:
        if grade not in GRADES:
            raise PydanticCustomError("choice", "unknown", {"choices": (*GRADES,)})
        return grade

    @model_validator(mode="after")
    def _is_a_steel(self) -> "Material":
        try:
            steel = self.steel()
        except ValueError as error:
            raise input_error("steel", str(error)) from error
        if steel.is_elastic and self.strength != 1.0:
            raise input_error(
                "steel",
                f"{self.grade} is elastic, strength has nothing to scale: leave it out, or give a hardening curve",
            )
        return self

    def steel(self) -> Steel:
        """The steel that this material names."""
        grade = GRADES[self.grade]
        pick = lambda name: getattr(grade, name) if getattr(self, name) is None else getattr(self, name)
        elastic, curve = ("youngs_modulus", "poisson", "density"), ("hardening_strain", "hardening_stress", "hardening")
        if self.cyclic is None:
            return Steel(*(pick(name) for name in elastic + curve)).scaled(self.strength)
        if given := [name for name in curve if getattr(self, name) is not None]:
            raise ValueError(f"steel: {given[0]} and cyclic both say how it hardens: give one of the two")
        return cyclic_steel(*(pick(name) for name in elastic), **self.cyclic.constants).scaled(self.strength)


class Materials(Frozen):
    """The steel of each region; the legs belong to the wing."""

    wing: Material = Field(Material(grade="Mn13"), description="steel of the wing rails and legs")
    nose: Material = Field(Material(grade="Mn13"), description="steel of the crossing nose")
    wheel: Material = Field(Material(grade="R8T"), description="steel of the wheel")

    def steels(self) -> list[Steel]:
        """The steel of each body, by its number (geometry.surfaces.bodies.PassBody)."""
        return [getattr(self, body).steel() for body in REGIONS]


class Scene(Frozen):
    """Everything that is there when the wheel passes; frozen. Read from a case file (`load_case`), changed by
    `replace`.

    Parameters
    ----------
    crossing : Crossing
        Shape: a family with its numbers, or a file.
    wheel : Wheel
        Profile and radius.
    vehicle : Vehicle
        Masses and springs above the wheel.
    foundation : Foundation
        Mass, stiffness and damping beneath the crossing.
    bearers : Bearers or None
        Track on bearers in place of one mass.
    wheel_body : WheelBody or None
        A wheel that vibrates.
    diverging : Diverging or None
        The diverging route.
    materials : Materials
        Steels of wing, nose and wheel.
    speed : float
        Running speed [m/s].
    direction : {"facing", "trailing"}
        Of travel.
    friction : float
        Between wheel and crossing [1].
    gauge, back_to_back : float
        Of the track; between the wheels' flange backs [m].

    Examples
    --------
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> faster = scene.replace(speed="100 mph", foundation={"stiffness": "160 kN/mm"})
    >>> faster.foundation.stiffness  # [N/m]
    160000000.0
    >>> try:
    ...     scene.replace(speed=100)  # mph or m/s?
    ... except ValueError as error:
    ...     print("has no unit" in str(error))
    True
    """

    crossing: Crossing = Field(Crossing(), description="the crossing")
    wheel: Wheel = Field(description="the wheel")
    vehicle: Vehicle = Field(description="the vehicle on the wheel")
    foundation: Foundation = Field(description="what the crossing stands on")
    bearers: Bearers | None = Field(
        None,
        description="rail and casting as a beam on bearers, in place of mass, spring and damper of scene.foundation;"
        " for light models of a wheel that moves vertically",
    )
    wheel_body: WheelBody | None = Field(
        None,
        description="hub, web and rim of a wheel that vibrates; none: a rigid wheel; for light models of a wheel that"
        " moves vertically",
    )
    diverging: Diverging | None = Field(
        None,
        description="the diverging route of the crossing: curve, force across the wheelset, check rail; none: the"
        " through route; for rigid_hertz (degrees_of_freedom lateral_roll) and fe_full",
    )
    materials: Materials = Field(Materials(), description="the steels")
    speed: Annotated[float, Quantity("mph", 0.5, 350, "running speed v")]
    direction: Literal["facing", "trailing"] = Field(description="facing runs from the legs towards the nose")
    friction: Annotated[float, Quantity("", 0, 10, "coefficient of friction between wheel and crossing")] = 0.3
    gauge: Annotated[float, Quantity("mm", 500, 2000, "track gauge")] = 1.435
    back_to_back: Annotated[float, Quantity("mm", 400, 1950, "distance between the wheels' flange backs")] = 1.360

    @model_validator(mode="after")
    def _fits_together(self) -> "Scene":
        clearance = self.gauge - self.back_to_back
        if not 0.02 < clearance < 0.2:
            raise input_error(
                "geometry",
                f"gauge {self.gauge * 1e3:g} mm less back_to_back {self.back_to_back * 1e3:g} mm is"
                f" {clearance * 1e3:g} mm, must lie between 20 and 200 mm",
            )
        if self.diverging is None:
            return self
        if self.crossing.family == SWITCH:
            raise input_error(
                "diverging",
                "a switch's diverging route runs on its other switch rail, which is not modelled: leave the table out",
                key="diverging",
            )
        if self.crossing.family == CAST and self.crossing.gauge_widening:
            raise input_error(
                "diverging",
                "crossing.gauge_widening sets the nose's through-route face back, the diverging route's face stays:"
                " leave one of the two out",
                key="diverging",
            )
        return self

    def plain(self) -> dict[str, Any]:
        """All that a model sees, as plain values [SI]: a profile file by its content, not by its name or position."""
        plain = self.model_dump(mode="json") | {"crossing": self.crossing.plain()}
        digest = plain["wheel"].pop("digest")
        for name in READING:  # part of the digest
            plain["wheel"].pop(name)
        for material in plain["materials"].values():  # steels by a curve are those they were
            if material["cyclic"] is None:
                material.pop("cyclic")
        for part in ("bearers", "wheel_body", "diverging"):  # scenes without are those they were
            if getattr(self, part) is None:
                plain.pop(part)
        plain["vehicle"].pop("axle_load" if self.vehicle.axle_load is None else "vehicle_sprung_mass")
        if digest:
            plain["wheel"]["profile"] = f"file of content {digest}"
        return plain

    def keep_files(self, folder: Path | str) -> None:
        """Write what was read from files into a run's folder, so that the run can be gone on with and repeated.

        Parameters
        ----------
        folder : Path or str
            Of the run.

        Raises
        ------
        OSError
            Read-only folder, full disk.
        """
        if self.wheel.measured is not None:
            self.wheel.measured.keep(folder)
        if self.crossing.read is not None:
            self.crossing.read.keep(folder)

    @property
    def static_wheel_load(self) -> float:
        """Force of one wheel on the rail at rest [N]: (sprung mass / wheels + half a wheelset) g."""
        return (self.vehicle.wheel_sprung_mass + self.vehicle.wheel_unsprung_mass) * GRAVITY

    @property
    def axle_load(self) -> float:
        """Mass that one axle carries [kg]: static_wheel_load is half of it times g."""
        return 2 * (self.vehicle.wheel_sprung_mass + self.vehicle.wheel_unsprung_mass)

    @property
    def direction_sign(self) -> float:
        """+1 when the wheel runs towards +x (facing), -1 when it runs towards -x (trailing)."""
        return 1.0 if self.direction == "facing" else -1.0

    @property
    def velocity(self) -> float:
        """Of the wheel along x, with its sign [m/s]."""
        return self.direction_sign * self.speed

    def in_order_of_travel(self, one: float, other: float) -> tuple[float, float]:
        """Two positions, the one that the wheel passes first before the other.

        Parameters
        ----------
        one, other : float
            x [m].

        Returns
        -------
        tuple of float
            x [m].
        """
        low, high = sorted((one, other))
        return (low, high) if self.direction_sign > 0 else (high, low)

    def travel_time(self, start: float, end: float) -> float:
        """Time in which the wheel runs from one position to the other.

        Parameters
        ----------
        start, end : float
            x [m].

        Returns
        -------
        float
            [s]
        """
        return abs(end - start) / self.speed

    @property
    def lateral_force(self) -> float:
        """Of the vehicle across the wheelset, + towards the field side of the wheel on the crossing [N]: as given, or
        the mass on the axle times the acceleration that cant does not balance."""
        if self.diverging is None:
            return 0.0
        if self.diverging.lateral_force is not None:
            return self.diverging.lateral_force
        return self.axle_load * self.diverging.acceleration(self.speed, self.gauge)

    @property
    def wheel_datum_y(self) -> float:
        """Lateral position [m] of the wheel's tread datum for a wheelset that is centred, or stands as its diverging
        route says."""
        aside = 0.0 if self.diverging is None else (self.diverging.lateral or 0.0)
        return tread_datum_y(self.gauge, self.back_to_back) + aside
