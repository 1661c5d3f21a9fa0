"""Numerics of the light models, one typed class each, read from [run.<model>] of a case file."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from rail_fem.scene.base import input_error
from rail_fem.scene.scene import Count, Frozen, Scene
from rail_fem.scene.units import Quantity
from rail_fem.settings.explicit import COMMON_WINDOW, BeamElement, BeamReach, IndentationLaw

SHORTEST_WINDOW = 0.01
SMOKE_CELL = 3e-3
FLEXIBLE_PARTS = "bearers", "wheel_body"  # of a scene, which not every model lets move


class LightSettings(Frozen):
    """What every light model takes."""

    flexible_parts: ClassVar[tuple[str, ...]] = ()  # what of the scene this model lets move, where the scene has it

    def smoke(self) -> "LightSettings":
        """These models are quick as they are."""
        return self


class P2Settings(LightSettings):
    """The standard's formula."""

    dip_angle: Annotated[
        float | None, Quantity("mrad", 0, 100, "dip angle 2 alpha; none: from the rigid wheel path")
    ] = None
    reading: Literal["increment", "all"] = Field(
        "increment", description="what the dynamic factor 1.2 acts on: the increment (Table 7-5), or all (as printed)"
    )
    unsprung: Literal["wheelset", "half wheelset"] = Field(
        "wheelset", description="unsprung mass per wheel in the formula: Table 7-5 takes the wheelset's"
    )


class PassSettings(LightSettings):
    """The stretch that is run over and the steps in time and along the path."""

    start: Annotated[
        float | None,
        Quantity("mm", -9000, 9000, "position x of the wheel at the start; none: from wing to nose, as every model"),
    ] = None
    end: Annotated[
        float | None,
        Quantity("mm", -9000, 9000, "position x of the wheel at the end; none: from wing to nose, as every model"),
    ] = None
    time_step: Annotated[float, Quantity("us", 0.01, 1000, "time step")] = 10e-6
    path_spacing: Annotated[
        float, Quantity("mm", 0.1, 20, "distance between positions where the surfaces are searched for contact")
    ] = 2.5e-3
    history_interval: Annotated[float, Quantity("us", 0.01, 1e5, "time between rows of the history")] = 20e-6
    beam_element: BeamElement = 0.1
    beam_reach: BeamReach = 9.0

    wheel_modes: Annotated[
        float, Quantity("kHz", 0.1, 30, "highest frequency of a wheel's own modes that are run (scene.wheel_body)")
    ] = 5e3

    flexible_parts: ClassVar[tuple[str, ...]] = FLEXIBLE_PARTS

    @model_validator(mode="after")
    def _has_a_length(self) -> "PassSettings":
        if self.start is not None and self.end is not None and abs(self.end - self.start) < SHORTEST_WINDOW:
            raise input_error(
                "window",
                f"start {self.start * 1e3:g} mm and end {self.end * 1e3:g} mm are less than"
                f" {SHORTEST_WINDOW * 1e3:g} mm apart",
            )
        return self

    def window(self, scene: Scene) -> tuple[float, float]:
        """Start and end [m] in the scene's direction; what is not given is that of the path common to all models."""
        first, last = scene.in_order_of_travel(*COMMON_WINDOW)
        return first if self.start is None else self.start, last if self.end is None else self.end


class LumpedSettings(PassSettings):
    """Masses, springs, dampers and one contact spring over the rigid wheel path."""

    contact: Literal["hertz", "linear"] = Field(
        "hertz", description="contact spring: Hertz' law, or linear with its stiffness at the static load"
    )
    contact_stiffness: Annotated[
        float | None,
        Quantity("GN/m^1.5", 1, 1e5, "Hertz constant of the contact; none: of the static load at the start"),
    ] = None


class IndentationSettings(PassSettings):
    """Contacts on wing and nose that may be plastically indented."""

    plastic_indentation: bool = Field(
        True,
        description="a contact whose mean pressure reaches the steel's limit is plastically indented; off: elastic",
    )
    indentation_law: IndentationLaw = Field(
        "rolled",
        description=(
            "how deep: as found by rolling over an elastoplastic half-space, or as a fully plastic contact (Tabor),"
            " farther from fe_full"
        ),
    )

    contact_law: Literal["static load", "two loads"] = Field(
        "static load",
        description=(
            "the paraboloid in place of a gap: the one under the static load, F = K d^1.5, or those under one and three"
            " of them and F = K d^n between, with the second place where a body is touched: for cones, wheels in a"
            " fillet, the leg"
        ),
    )


class RigidHertzSettings(IndentationSettings):
    """Contacts found on the true surfaces of wing and nose, each with its own Hertz law."""

    degrees_of_freedom: Literal["vertical", "roll", "lateral_roll"] = Field(
        "vertical",
        description=(
            "of the wheel, or of a wheelset whose other wheel runs on its stock rail: roll, or roll, lateral and yaw"
        ),
    )
    lateral_range: Annotated[
        float, Quantity("mm", 0.5, 12, "how far to each side a wheelset's contacts are looked for")
    ] = 4e-3
    gyration: Annotated[
        float | None,
        Quantity(
            "mm", 100, 2000, "radius of gyration of the wheelset in roll and yaw; none: half of it at each tread datum"
        ),
    ] = None
    check_rail: Annotated[
        float | None, Quantity("mm", 0, 200, "flangeway of the check rail beside the other rail; none: no check rail")
    ] = None

    @model_validator(mode="after")
    def _moves_to_its_check_rail(self) -> "RigidHertzSettings":
        if self.check_rail is not None and not self.takes_diverging_route:
            raise input_error(
                "check_rail", "check_rail is for degrees_of_freedom lateral_roll: leave it out, or take these"
            )
        return self

    @property
    def flexible_parts(self) -> tuple[str, ...]:  # type: ignore[override]  # by what else of it is asked
        return FLEXIBLE_PARTS if self.degrees_of_freedom == "vertical" else ()

    @property
    def takes_diverging_route(self) -> bool:
        """Whether this model lets a wheelset move across the track."""
        return self.degrees_of_freedom == "lateral_roll"


class BemPassageSettings(IndentationSettings):
    """As rigid_hertz, with contacts solved on the true gaps."""

    patch_spacing: Annotated[
        float,
        Quantity("mm", 0.5, 100, "distance between positions where the gap is solved for the contact's stiffness"),
    ] = 10e-3
    cells: Count = Field(32, ge=8, le=512, description="cells across a patch, each way")


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


def unfit_parts(scene: Scene, settings: Frozen) -> list[str]:
    """What of the scene a model cannot let move, a line each; none where it can."""
    found = [*_flexible_part_errors(scene, settings), *_diverging_errors(scene, settings)]
    if scene.crossing.joint_gap and isinstance(settings, (BemPassageSettings, BemPlasticSettings)):
        low, high = sorted(settings.window(scene))
        if low < 0 < high:
            found.append(
                "scene.crossing.joint_gap parts the rail at x = 0, and beside a rail's end lies no half-space: take"
                " rigid_hertz or fe_full, or a window that ends before the gap or begins behind it"
            )
    return found


def _diverging_errors(scene: Scene, settings: Frozen) -> list[str]:
    if scene.diverging is None:
        return []
    if not getattr(settings, "takes_diverging_route", False):
        return [
            "scene.diverging is for rigid_hertz (degrees_of_freedom lateral_roll) and fe_full: leave it out, or"
            " leave out this model"
        ]
    if getattr(settings, "check_rail", None) is not None:
        return ["check_rail: the check rail is that of scene.diverging: leave it out here"]
    return []


def _flexible_part_errors(scene: Scene, settings: Frozen) -> list[str]:
    moved = getattr(settings, "flexible_parts", ())
    return [
        f"scene.{part} is for lumped, rigid_hertz (degrees_of_freedom vertical), bem_passage, bem_plastic"
        f"{', fe_full and fe_window' if part == 'bearers' else ' and fe_full'}: leave it out, or leave out this model"
        for part in FLEXIBLE_PARTS
        if part not in moved and getattr(scene, part) is not None
    ]
