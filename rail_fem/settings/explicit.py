"""Numerics of each model, apart from the physics: one typed class a model, read from [run.<model>] of a case file."""

import functools
import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from geometry.axes import RAIL_DEPTH, WHEEL_DEPTH
from geometry.profiles.formats.raw import LARGEST_MESH, open_file
from rail_fem.scene.base import FileName, input_error
from rail_fem.scene.scene import Count, Frozen, Scene
from rail_fem.scene.units import Quantity

# every model's path unless a case gives another: from the wing ahead of its bend to behind the landing after the nose's
# first impact [m]
COMMON_WINDOW = 0.095, 0.700
IndentationLaw = Literal["rolled", "fully plastic"]  # of the light models, and of the approach of fe_window
SMOKE_ELEMENT_SIZE = 6e-3
SLAB_ELEMENTS = 3  # along the rail, of the slabs that a travelling window lets enter and leave
SLAB = 6e-3  # they are at least so long [m]
WINDOW_ENDS = "window_ahead", "window_behind"
EDGE_ELEMENTS = 2  # by which the patch of a coarse mesh is longer at its end
# of an automatic travelling window, to each side but for a slab and those elements: contact up to 4 mm from the axle,
# patch and plastic zone of the reference case's impact, and 13 mm more: forces are within 0.2 % of those with 120 mm
AROUND_PATCH = 36e-3  # [m]
SMOKE_STEPS = 50
SMOKE_STRETCH = 0.12  # m of crossing that is meshed
TWIN_COST = 0.25  # of the twin that gives the error bars, over the run's own
# Numerics by one word, of heavier small elements in a travelling window; docs/speed.md has what each costs and is off
PRESETS: dict[str, dict[str, Any]] = {
    name: {
        "element_size": size,
        "element_aspect": aspect,
        "wheel_element_ratio": 1.5,
        "mass_scaling": "auto",
        "scaled_elements": "small",
        "wave_ratio": 14.0,
        "window_ahead": "auto",
        "window_behind": "auto",
        "error_twin": twin,
    }
    for name, size, aspect, twin in (
        ("fast", "1.4 mm", 2.0, False),
        ("fine", "0.7 mm", 2.0, True),
        ("finest", "0.5 mm", 1.5, True),
    )
}
LEAST_BLOCK = 20e-3  # of the casting below its meshes [m]
MOST_SLENDER = 4.0  # length of an element along the rail over its size across, or the reverse


# of the beam that every model with a track runs on
BeamElement = Annotated[float, Quantity("mm", 10, 1000, "longest element of a beam on bearers (scene.bearers)")]
BeamReach = Annotated[
    float, Quantity("m", 2, 100, "track computed on each side of the window, its outer half absorbing waves")
]


class FeSettings(Frozen):
    """Explicit FE of the pass. To add a setting, add a field: unit, range, meaning, default."""

    # may differ from the run that is gone on with
    free_on_restart: ClassVar[tuple[str, ...]] = ("checkpoint_interval", "device", "max_steps", "mesh", "preset")

    preset: Literal["fast", "fine", "finest"] | None = Field(
        None,
        description="element sizes, mass scaling, travelling window and error bars by one word: elements of 1.4, 0.7"
        " or 0.5 mm; a key that stands beside it wins",
    )
    element_size: Annotated[float, Quantity("mm", 0.1, 20, "element size under the running band")] = 2.0e-3
    element_aspect: Annotated[
        float,
        Quantity(
            "", 1 / MOST_SLENDER, MOST_SLENDER, "length of elements along the rail, of the wheel too, over element_size"
        ),
    ] = 1.0
    wheel_element_ratio: Annotated[
        float, Quantity("", 0.25, 4, "element size in the wheel's patch over that of the rails")
    ] = 1.0
    rail_depth: Annotated[float, Quantity("mm", 40, 250, "depth below rail level at which wing and nose are rigid")] = (
        RAIL_DEPTH
    )
    foot_depth: Annotated[
        float | None,
        Quantity(
            "mm",
            60,
            400,
            "depth below rail level of the casting's foot: an elastic block as wide as wing and nose together lies"
            " between it and rail_depth (with windows of 100 mm: 60 mm move forces by 1 to 2 %); none: rigid from"
            " rail_depth on",
        ),
    ] = None
    wheel_depth: Annotated[
        float, Quantity("mm", 40, 250, "depth below the tread datum at which the wheel is rigid")
    ] = WHEEL_DEPTH
    start: Annotated[float, Quantity("mm", -2000, 3000, "position x of the wheel at the start")] = COMMON_WINDOW[0]
    end: Annotated[float, Quantity("mm", -2000, 3000, "position x of the wheel at the end")] = COMMON_WINDOW[1]
    courant: Annotated[float, Quantity("", 0.05, 0.97, "time step over the critical step")] = 0.9
    penalty: Annotated[
        float, Quantity("", 1e-3, 1e3, "factor on the contact penalty stiffness (10 times an element layer's)")
    ] = 1.0
    element: Literal["one-point", "full"] = Field(
        "one-point",
        description="of the rails: one point with hourglass control, or eight points with mean dilatation, which has"
        " no hourglass modes and judges the first at about three times the cost",
    )
    hourglass: Annotated[
        float, Quantity("", 0, 1, "hourglass stiffness over 3.5 shear moduli, of the one-point element")
    ] = 0.01
    mass_scaling: Annotated[
        float | str,
        Quantity(
            "",
            1,
            1e4,
            "factor on the density of all elements, the bodies' masses kept: steps longer by its root, waves slower by"
            " it; auto: as far as that does not show",
            words=("auto",),
        ),
    ] = 1.0
    scaled_elements: Literal["all", "small"] = Field(
        "all",
        description="that mass_scaling makes heavier: all by its factor, or the small ones, the smallest by the factor"
        " and each of the others as far as the same stable step asks: from 1 mm down half the steps of auto",
    )
    wave_ratio: Annotated[
        float,
        Quantity(
            "",
            5,
            1000,
            "speed of waves in the elements under the wheel over the wheel's, at least, where mass_scaling is auto and"
            " small elements are heavier: steps shorter in proportion",
        ),
    ] = 20.0
    settle_time: Annotated[
        float, Quantity("ms", 0, 1000, "run under a damper from the static start, before the pass")
    ] = 0.0
    spin: Literal["free", "held"] = Field(
        "free", description="the wheel's rotation: free against its inertia, or held at pure rolling at the start"
    )
    suspension: bool = Field(True, description="sprung mass and primary suspension")
    foundation: bool = Field(True, description="foundation spring and damper, or bearers; off: fixed base")
    track_mass: bool = Field(True, description="added mass of the track under the crossing")
    beam_element: BeamElement = 0.1
    beam_reach: BeamReach = 9.0
    window_ahead: Annotated[
        float | str | None,
        Quantity(
            "mm",
            0,
            5000,
            "length of the travelling window ahead of the wheel; auto: as scene and elements need; none: all",
            words=("auto",),
        ),
    ] = None
    window_behind: Annotated[
        float | str | None,
        Quantity(
            "mm", 0, 5000, "length of the travelling window behind the wheel; auto, none: as ahead", words=("auto",)
        ),
    ] = None
    passes: Count = Field(
        1, ge=1, le=10000, description="passes of the wheel, each on the steel that the one before it has left"
    )
    history_interval: Annotated[float, Quantity("us", 0.01, 1e5, "time between rows of the history")] = 20e-6
    field_frames: Count = Field(10, ge=1, le=10000, description="number of field outputs over the pass")
    checkpoint_interval: Annotated[float, Quantity("s", 1, 1e6, "wall time between restart files")] = 60.0
    error_twin: bool | Literal["calibrated"] = Field(
        False,
        description="first the same pass on elements of twice the size (a tenth of the cost): error bars; calibrated:"
        " wider ones without it, by what other scenes of the class were off",
    )
    device: Literal["cpu", "cuda"] = Field(
        "cpu", description="what makes the steps: cores, or a graphics card, to round-off the same"
    )
    max_steps: Count | None = Field(None, ge=1, description="stop after this many steps; none: the whole pass")
    mesh: FileName = Field(
        "",
        description="a file with one's own hexahedra in groups (.msh, .inp, .vtu, .med, .xdmf), run as they are; none:"
        " meshed here",
    )
    mesh_unit: Literal["mm", "m"] = Field("m", description="unit of the mesh file's lengths")
    mesh_digest: str = Field("", validate_default=True, description="digest of the mesh file")

    @model_validator(mode="before")
    @classmethod
    def _filled_by_its_preset(cls, values: Any) -> Any:
        name = values.get("preset") if isinstance(values, Mapping) else None
        return PRESETS[name] | values if isinstance(name, str) and name in PRESETS else values

    @field_validator("mesh")
    @classmethod
    def _mesh_is_there(cls, mesh: str, info: ValidationInfo) -> str:
        if not mesh:
            return mesh
        path = Path((info.context or {}).get("folder", ".")) / mesh
        if not path.is_file():
            raise input_error("absent_file", f'no file "{path.name}" in {path.parent}: give a path from the case file')
        return str(path)

    @field_validator("mesh_digest")
    @classmethod
    def _mesh_is_what_was_read(cls, digest: str, info: ValidationInfo) -> str:
        path = info.data.get("mesh")
        found = ""
        if path:
            with open_file(path, LARGEST_MESH, functools.partial(input_error, "mesh")) as file:
                found = hashlib.file_digest(file, "sha256").hexdigest()
        if digest and found != digest:
            raise input_error("changed_file", f"the mesh file has other content than is stated ({digest[:12]})")
        return found

    @model_validator(mode="after")
    def _fits_together(self) -> "FeSettings":
        if self.mesh and (self.error_twin or self.has_window):
            name = "error_twin" if self.error_twin else "window_ahead and window_behind"
            raise input_error("mesh", f"a mesh from a file is run as it is: leave {name} out")
        if self.foot_depth is not None and self.foot_depth < self.rail_depth + LEAST_BLOCK:
            raise input_error(
                "foot_depth",
                f"foot_depth {self.foot_depth * 1e3:g} mm lies less than {LEAST_BLOCK * 1e3:g} mm below rail_depth"
                f" {self.rail_depth * 1e3:g} mm: leave it out, or give a deeper one",
            )
        if self.foot_depth is not None and self.mesh:
            raise input_error("foot_depth", "a mesh from a file ends where it is held: leave foot_depth out")
        if None not in (self.start, self.end) and abs(self.end - self.start) < 4 * self.element_size:
            raise input_error(
                "window",
                f"start {self.start * 1e3:g} mm and end {self.end * 1e3:g} mm are less than 4 elements of"
                f" {self.element_size * 1e3:g} mm apart",
            )
        return self

    @property
    def has_twin(self) -> bool:
        """Whether a coarser pass comes first, for error bars."""
        return self.error_twin is True

    @property
    def wheel_size(self) -> float:
        """Element size in the wheel's patch [m]."""
        return self.wheel_element_ratio * self.element_size

    @property
    def along(self) -> float:
        """Length of the crossing's elements along the rail [m]."""
        return self.element_aspect * self.element_size

    def coarser(self, factor: float) -> "FeSettings":
        """The same with elements larger by a factor; a travelling window of a given length longer by as much as its
        slabs are."""
        longer = SLAB_ELEMENTS * (factor - 1) * self.along
        given = {name: getattr(self, name) for name in WINDOW_ENDS}
        longer_windows = {name: length + longer for name, length in given.items() if length and length != "auto"}
        return self.model_copy(update={"preset": None, "element_size": factor * self.element_size, **longer_windows})

    @property
    def window_lengths(self) -> tuple[float, float]:
        """Of the travelling window ahead of the wheel and behind it [m]; infinite where it has no end. Automatic ones
        as the elements need; rail_fem.fe.plan.travelling_window.with_window makes them longer where the scene does."""
        auto = AROUND_PATCH + self.window_margin
        given = self.window_ahead, self.window_behind
        ahead, behind = (float("inf") if at is None else auto if at == "auto" else float(at) for at in given)
        return ahead, behind

    @property
    def window_margin(self) -> float:
        """Of a travelling window for its slabs, which enter and leave whole, and the patch's edge on elements [m]."""
        return max(SLAB, SLAB_ELEMENTS * self.along) + EDGE_ELEMENTS * self.along

    @property
    def beyond_end(self) -> float:
        """How far ahead of the axle at its end a travelling window holds steel, its last slab included [m]."""
        ahead, _ = self.window_lengths
        return ahead + SLAB_ELEMENTS * self.along if 0 < ahead < float("inf") else 0.0

    takes_diverging_route: ClassVar[bool] = True  # whether this model lets a wheelset move across the track
    # what of the scene this model lets move, where the scene has it
    flexible_parts: ClassVar[tuple[str, ...]] = "bearers", "wheel_body"

    def stands_on_beam(self, scene: Scene) -> bool:
        """Whether the crossing stands on bearers."""
        return self.foundation and scene.bearers is not None

    @property
    def has_window(self) -> bool:
        """Whether only what lies near the wheel is computed."""
        return min(self.window_lengths) < float("inf")

    def smoke(self) -> "FeSettings":
        """The same path through the program in a few coarse steps on a short stretch (RAIL_FEM_SMOKE=1)."""
        end = self.end
        if self.start is not None and end is not None:
            end = self.start + math.copysign(min(abs(end - self.start), SMOKE_STRETCH), end - self.start)
        return self.model_copy(
            update={
                "end": end,
                "element_size": max(self.element_size, SMOKE_ELEMENT_SIZE),
                "element_aspect": 1.0,
                "wheel_element_ratio": 1.0,
                "max_steps": min(self.max_steps or SMOKE_STEPS, SMOKE_STEPS),
                "passes": min(self.passes, 2),
                "field_frames": 1,
            }
        )


class FeWindowSettings(FeSettings):
    """Explicit FE of a part of the pass that begins in the middle of it, in the state that rigid_hertz has found."""

    start: Annotated[
        float | None,
        Quantity(
            "mm",
            -2000,
            3000,
            "position x of the wheel at the start of the window; none: ahead of the rigid wheel's transfer",
        ),
    ] = None  # type: ignore[assignment]  # found by rigid_hertz where a window gives none
    end: Annotated[
        float | None, Quantity("mm", -2000, 3000, "position x of the wheel at its end; none: behind that transfer")
    ] = None  # type: ignore[assignment]  # found by rigid_hertz where a window gives none

    takes_diverging_route: ClassVar[bool] = False  # the approach by rigid_hertz moves vertically
    # with which of a wheel's modes it arrives is not handed over
    flexible_parts: ClassVar[tuple[str, ...]] = ("bearers",)

    approach_start: Annotated[
        float | None,
        Quantity(
            "mm", -9000, 3000, "where rigid_hertz begins its approach, at rest; none: where the other models begin"
        ),
    ] = None
    indentation_law: IndentationLaw = Field(
        "rolled", description="of that approach: how deep rigid_hertz lets a contact be indented plastically"
    )
