"""The crossing of a scene: a cast crossing by its parameters, or any crossing by its own sections.

What only one family needs is imported where that family is made.
"""

from __future__ import annotations

import functools
import re
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic.json_schema import SkipJsonSchema

from geometry.surfaces.crossing import CastCrossing, CrossingError
from rail_fem.scene.base import KEPT_SECTIONS, STEP_SUFFIXES, FileName, FromFile, input_error, kept
from rail_fem.scene.units import Quantity

if TYPE_CHECKING:
    from geometry.surfaces.worn_crossing import UnwornCrossing
    from rail_fem.scene.section_files import CrossingFile

CAST: Final = "UK-cast"
SECTIONS: Final = "sections"
STEP: Final = "step"
JOINT: Final = "joint"
SWITCH: Final = "switch"
CAST_KEYS = tuple(field.name for field in fields(CastCrossing))
# Shapes of the leg that had names, fitted to a flight that the thesis prints without a place (section 7.4)
FORMER_LEGS = {"fitted": ("322.184 mm", 0.652113, "1.13683 mm"), "fitted-explicit": ("271 mm", 0.838, "1.217 mm")}
# by name: keys of the parametric crossing; cases/design/casting.toml has found them, docs/crossings.md says how well
NAMED_CASTINGS = {
    "thesis-fit": {
        "wing_raise": "-3.4 mm",
        "cast_slope": "25 mrad",
        "topping_slope": "16.4 mrad",
        "topping_depth": "6.4 mm",
        "transition_length": "106 mm",
    }
}
# what is said of wing, nose and casting, of what has none
OWN_WORDS = {
    JOINT: {
        "gauge lines intersect": "the joint",
        "casting on bearers": "rail on bearers",
        "wing rail": "rail",
        "wing": "rail",
        "nose": "rail at x > 0",
    },
    SWITCH: {
        "casting on bearers": "rail on bearers",
        "gauge lines intersect": "the switch's toe",
        "wing rail": "stock rail",
        "wing": "stock rail",
        "nose": "switch rail",
    },
}
FILE_KEYS = "file", "mirror", "lateral", "height", "along", "extend"
FAMILY_KEYS = {  # what each family may be told beside `family`
    CAST: (*CAST_KEYS, "casting"),
    SECTIONS: (*FILE_KEYS, "stations", "unit", "station_unit"),
    STEP: (*FILE_KEYS, "faces", "tolerance"),
    JOINT: ("dip_angle", "dip_length", "dip_shape", "dip_bend", "joint_gap"),
    SWITCH: ("switch_radius", "switch_entry"),
}
# how the files are read: rail_fem.scene.section_files.SectionReading
READING = tuple(sorted({*FAMILY_KEYS[SECTIONS], *FAMILY_KEYS[STEP]} - {"file", "extend"}))


class Crossing(FromFile):
    """Family UK-cast: by the design rules of the 56E1-R245-1:9.25 benchmark crossing, stretched to 1 in `ratio`.

    Family sections: by a file of its own sections, measured or drawn; see docs/case_file.md for the forms it may have.
    Family step: by a STEP file of its surfaces, sliced into sections. Family joint: no crossing but plain 56E1 rail
    with a dipped joint or weld at x = 0, or an insulated joint's gap; without either, plain line. Family switch: from
    stock rail to switch rail, our own shape, no drawing.
    """

    READ, KEPT, TOLD = "read", KEPT_SECTIONS, frozenset({"file", *READING})

    family: Literal["UK-cast", "sections", "step", "joint", "switch"] = Field(
        CAST, description="by design rules, by a file of sections, by a STEP file, plain rail with a joint, or a switch"
    )
    casting: Literal["benchmark", "thesis-fit"] = Field(
        "benchmark",
        description="its shape where no key is given: that of the benchmark, or one found by inversion of what"
        " Coleman's thesis prints of its own, which is not public",
    )
    ratio: Annotated[float, Quantity("", 6, 32, "crossing ratio N of 1:N")] = 10.75
    flangeway: Annotated[float, Quantity("mm", 30, 70, "flangeway between wing and nose, 14 mm down")] = (
        CastCrossing.flangeway
    )
    cast_slope: Annotated[float, Quantity("mrad", 10, 70, "rise of the top of leg and wing rail to the field side")] = (
        CastCrossing.cast_slope
    )
    topping_slope: Annotated[float, Quantity("mrad", 0, 50, "rise of the topped nose at 1:9.25")] = (
        CastCrossing.topping_slope
    )
    topping_depth: Annotated[float, Quantity("mm", 2, 10, "depth of the topped nose where its rise begins")] = (
        CastCrossing.topping_depth
    )
    transition_length: Annotated[
        float, Quantity("mm", 20, 1000, "length of the leg's change from plain rail to cast section; its end is fixed")
    ] = CastCrossing.transition_length
    transition_smoothness: Annotated[
        float, Quantity("", 0, 2, "shape of that change: 0 straight, 1 cubic with level ends, 2 quintic")
    ] = 1.0
    leg_lowering: Annotated[float, Quantity("mm", -3, 5, "depth cut off the running surface at the leg's end")] = 0.0
    leg_fade: Annotated[float, Quantity("mm", 50, 1000, "length over which the leg regains its height")] = 0.3
    wing_raise: Annotated[
        float, Quantity("mm", -6, 8, "height that the wing gains from knuckle to theoretical intersection")
    ] = 0.0
    wing_flare: Annotated[float, Quantity("mrad", 0, 50, "further opening of the flangeway by the wing")] = 0.0
    flare_start: Annotated[float, Quantity("mm", 0, 1200, "x where the wing's flare begins")] = 0.5
    nose_lowering: Annotated[float, Quantity("mm", -1.5, 5, "depth by which the whole nose is lowered")] = 0.0
    nose_widening: Annotated[float, Quantity("mm", -6, 6, "added width of the nose, half on each side")] = 0.0
    gauge_widening: Annotated[
        float, Quantity("mm", -2, 6, "distance of the nose's through-route face behind the gauge line")
    ] = 0.0
    dip_angle: Annotated[float, Quantity("mrad", 0, 60, "angle between both slopes of a joint at its bend")] = 10e-3
    dip_length: Annotated[float, Quantity("mm", 100, 5000, "length of a joint's dip on each side")] = 1.0
    dip_shape: Literal["straight", "parabolic"] = Field(
        "straight", description="of a joint's dip: straight slopes, or parabolas that leave the plain rail level"
    )
    dip_bend: Annotated[float, Quantity("mm", 0.1, 20, "length over which a joint's slopes change, on each side")] = (
        1e-3
    )
    joint_gap: Annotated[float, Quantity("mm", 0, 30, "gap between the rail ends of a joint")] = 0.0
    switch_radius: Annotated[float, Quantity("m", 50, 1e5, "radius in which a switch's stock rail turns away")] = 290.0
    switch_entry: Annotated[float, Quantity("mrad", 0, 50, "angle between stock rail and switch rail at the toe")] = (
        6.6667e-3
    )
    file: FileName = Field(
        "",
        description="of family sections: a .slcs, a .csv of x, y, z, or a folder of sections; of family step: a .step",
    )
    stations: FileName = Field("", description="list of stations in a folder of sections; none: stations.csv")
    unit: Literal["mm", "cm", "m", "inch"] | None = Field(None, description="unit of the sections; none: as they say")
    station_unit: Literal["mm", "cm", "m", "inch"] | None = Field(
        None, description="unit of a folder's stations; none: as the list says"
    )
    mirror: bool = Field(False, description="exchange the sections' sides: y is to grow towards the wing's field side")
    lateral: Annotated[float, Quantity("mm", -2000, 2000, "added to the sections' y")] = 0.0
    height: Annotated[float, Quantity("mm", -500, 500, "added to the sections' z")] = 0.0
    along: Annotated[float, Quantity("mm", -1e5, 1e5, "added to the sections' x")] = 0.0
    faces: Literal["named", "found"] = Field(
        "named",
        description='of a STEP file: those of bodies named "wing" and "nose", or found: the highest of all faces',
    )
    tolerance: Annotated[float, Quantity("um", 1, 1000, "of the surface between a STEP file's sections")] = 10e-6
    extend: bool = Field(False, description="carry both ends on straight beyond the first and last section")
    read: SkipJsonSchema[Any] = Field(None, exclude=True, repr=False, validate_default=True)
    digest: str = Field("", validate_default=True, description="digest of the sections")

    @field_validator("ratio", mode="before")
    @classmethod
    def _written_with_its_one(cls, ratio: Any) -> Any:
        """ "1:9.25" says what 9.25 does."""
        written = re.fullmatch(r"\s*1\s*:([^:]+)", ratio) if isinstance(ratio, str) else None
        return written[1] if written else ratio

    @field_validator("file")
    @classmethod
    def _file_is_there(cls, file: str, info: ValidationInfo) -> str:
        return file if not file or kept(file, info) else cls.path_of(file, info)

    @field_validator("read", mode="plain")
    @classmethod
    def _read_once(cls, read: Any, info: ValidationInfo) -> CrossingFile | None:
        if read is not None:
            raise input_error("not_a_key", "unknown key")
        if "file" not in info.data or not info.data["file"]:
            return None
        if known := kept(info.data["file"], info):
            return known
        from rail_fem.scene.section_files import SectionReading, read_crossing

        told = {} if "run_folder" in (info.context or {}) else {name: info.data.get(name) for name in READING}
        path = Path(info.data["file"])
        is_step = path.suffix.lower() in STEP_SUFFIXES
        try:
            if told and is_step != (info.data.get("family") == STEP):
                raise ValueError(
                    f'{path}: family = "step" is for a .step or .stp file, family = "sections" for all others'
                )
            reading = SectionReading(**{name: value for name, value in told.items() if value is not None})
            return read_crossing(path, reading)
        except (OSError, ValueError) as error:
            raise input_error("crossing_file", str(error), key="file") from error

    @model_validator(mode="before")
    @classmethod
    def _has_the_shape_of_its_name(cls, values: Any) -> Any:
        """The keys of a named casting where none are given."""
        name = values.get("casting") if isinstance(values, dict) else None
        return (NAMED_CASTINGS.get(name, {}) if isinstance(name, str) else {}) | values if name else values

    @model_validator(mode="before")
    @classmethod
    def _names_no_leg(cls, values: Any) -> Any:
        """A result that was written while legs had names says "benchmark" where it has none of its own."""
        if not isinstance(values, dict) or "leg" not in values:
            return values
        if values["leg"] in FORMER_LEGS:
            length, smoothness, lowering = FORMER_LEGS[values["leg"]]
            raise input_error(
                "former_leg",
                f'"{values["leg"]}" was fitted to a flight that is not said to be the leg\'s: to have its shape, write'
                f' transition_length = "{length}", transition_smoothness = {smoothness}, leg_lowering = "{lowering}"',
                key="crossing.leg",
            )
        return {name: value for name, value in values.items() if (name, value) != ("leg", "benchmark")}

    @model_validator(mode="after")
    def _is_one_family(self) -> Self:
        others = {name for keys in FAMILY_KEYS.values() for name in keys} - set(FAMILY_KEYS[self.family])
        told = [name for name in type(self).model_fields if name in others and self._is_told(name)]
        if told:
            raise input_error(
                "family", f"does not belong to family {self.family}: leave it out", key=f"crossing.{told[0]}"
            )
        if self.family in (SECTIONS, STEP) and not self.file:
            needed = "a STEP file" if self.family == STEP else "the file of its sections"
            raise input_error("family", f"family {self.family} needs {needed}", key="crossing.file")
        try:
            self.surface.x_range  # noqa: B018 an impossible shape is refused now
        except CrossingError as error:
            raise input_error("crossing", str(error)) from error
        return self

    @property
    def name(self) -> str:
        """What titles call the crossing."""
        if self.family == JOINT:
            parts = [f"a dip of {1e3 * self.dip_angle:g} mrad"] if self.dip_angle else []
            parts += [f"a gap of {1e3 * self.joint_gap:g} mm"] if self.joint_gap else []
            return f"joint with {' and '.join(parts)}" if parts else "plain line"
        if self.family == SWITCH:
            return f"switch of R {self.switch_radius:g} m"
        return f"{CAST} crossing 1:{self.ratio:g}" if self.family == CAST else f"crossing {Path(self.file).name}"

    def told(self, words: str) -> str:
        """Words about wing, nose and casting in those of a joint or a switch, where it is one."""
        for one, own in OWN_WORDS.get(self.family, {}).items():
            words = words.replace(one, own)
        return words

    @property
    def surface(self) -> UnwornCrossing:
        """The crossing itself; the same object for the same numbers or sections. Errors: CrossingError."""
        if self.read is not None:
            return self.read.crossing(self.extend)
        keys = CAST_KEYS if self.family == CAST else FAMILY_KEYS[self.family]
        return _made(self.family, *(getattr(self, name) for name in keys))

    @property
    def leg_end(self) -> float:
        """x up to which forces are the leg's: the knuckle, or the end of the change from the plain rail [m]."""
        return self.surface.x_range[0] if self.family in (JOINT, SWITCH) else self.surface.knuckle_x

    def plain(self) -> dict[str, Any]:
        """All that a model sees, as plain values: of a file its content, of parameters those that are not the
        benchmark's."""
        if self.family in (JOINT, SWITCH):
            return {"family": self.family, **{name: getattr(self, name) for name in FAMILY_KEYS[self.family]}}
        if self.family != CAST:
            return {"family": self.family, "extend": self.extend, "sections": f"of content {self.digest}"}
        defaults = type(self).model_fields
        changed = {name: value for name in CAST_KEYS if (value := getattr(self, name)) != defaults[name].default}
        return {"family": self.family, **changed, "ratio": self.ratio}

    def _is_told(self, name: str) -> bool:
        value, default = getattr(self, name), type(self).model_fields[name].default
        if isinstance(default, float):
            return abs(value - default) > 1e-9 * abs(default)  # a unit's factor rounds
        return value != default


@functools.lru_cache(maxsize=64)
def _made(family: str, *values: Any) -> UnwornCrossing:
    """Of a family by its keys; kept for its loft, which takes longer to make than a patch to solve."""
    if family == JOINT:
        from geometry.surfaces.joint import Joint, joint_rail

        return joint_rail(Joint(*values))
    if family == SWITCH:
        from geometry.surfaces.switch import Switch, switch_rails

        return switch_rails(Switch(radius=values[0], entry=values[1]))
    return CastCrossing(**dict(zip(CAST_KEYS, values)))
