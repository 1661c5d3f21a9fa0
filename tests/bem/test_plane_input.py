"""Input that the plane methods refuse, each with the cause, the position or value, and what to do; nothing becomes a
silent nan."""

import numpy as np
import pytest

from bem.exact.conformal import PinError, pin_clearance, pin_pressure
from bem.exact.hertz import HertzError
from bem.exact.subsurface import line_stress
from bem.exact.tangential import carter_creepage, cattaneo_line_shear, cattaneo_line_stick, spence_line_stick
from bem.material import STEEL, Elastic, MaterialError
from bem.plane.body import Body
from bem.plane.boundary import FIXED, Condition, ConditionError, EquilibriumError, solve_boundary
from bem.plane.contact import Settings, SettingsError, solve_contact
from bem.plane.coulomb import Control, FrictionError
from bem.plane.curve import CurveError, arc
from bem.plane.internal import PositionError, field_at, grid_below, stress_at
from bem.plane.mesh import Sizing, Zone, mesh_outline
from bem.plane.outline import Edge, Outline, OutlineError
from bem.plane.point_load import PointLoad, PointLoadError
from bem.plane.rolling import RollingError, solve_rolling
from bem.verification.cases import LOAD, non_conformal

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.0]])
BLOCK = Outline([[Edge(SQUARE[[k, k + 1]], name) for k, name in enumerate(("bottom", "right", "top", "left"))]])
MESH = mesh_outline(BLOCK, Sizing(0.2))
FIXED_BODY, MOVING = non_conformal()
COARSE = Settings(size=0.4e-3)
PRESSED = solve_contact(FIXED_BODY, MOVING, LOAD, 0.3, COARSE, steps=1)


def loops(*polygons, **options):
    return Outline([[Edge(points, "wall")] for points in polygons], **options)


def on_hub(hub):
    """A disc of 0.1 m about (0, 0.1) on a hub, pressed on the block."""
    return Body(Outline([[Edge(arc((0, 0.1), 0.1, np.pi / 2, 2.5 * np.pi), "face")]]), STEEL, hub=hub)


def refused(cases):
    return pytest.mark.parametrize("error, message, call", cases)


def check(error, message, call):
    with pytest.raises(error, match=message):
        call()


@refused(
    [
        (
            OutlineError,
            r"near \(1.2, 0.6\) m .segment 0 .* segment 2",
            lambda: loops(np.array([[0, 0], [2, 1], [2, 0], [0, 1.5], [0, 0.0]])),
        ),
        (
            OutlineError,
            r"near \(0.5, 0\) m",
            lambda: loops(np.array([[0, 0], [1, 0], [0.5, 0], [1, 1], [0, 1], [0, 0.0]])),
        ),
        (
            OutlineError,
            r"loop 1, which begins at \(5, 5\) m, lies outside loop 0",
            lambda: loops(SQUARE, SQUARE * 0.3 + 5),
        ),
        (OutlineError, r"loop 1.* within loops \[0\]", lambda: loops(SQUARE, SQUARE * 0.3 + 0.1, infinite=True)),
        (
            OutlineError,
            r"loop 2.* within loops \[0, 1\]",
            lambda: loops(SQUARE, SQUARE * 0.5 + 0.2, SQUARE * 0.1 + 0.4),
        ),
        (OutlineError, "each a list of Edge", lambda: Outline([Edge(SQUARE)])),
        (
            OutlineError,
            "loop 0 is open: edge 'roof' ends",
            lambda: Outline([[Edge(SQUARE[:3], "floor"), Edge(SQUARE[2:4], "roof")]]),
        ),
        (
            OutlineError,
            "loop 0 is open: edge 'floor' ends",
            lambda: Outline([[Edge(SQUARE[:2], "floor"), Edge(SQUARE[2:], "roof")]]),
        ),
        (CurveError, r"point 2 of 4 is \(nan, 0\)", lambda: loops(np.array([[0, 0], [2, 1], [np.nan, 0], [0, 0.0]]))),
        (CurveError, "no array of numbers", lambda: loops(np.array([["a", "b"], ["c", "d"]]))),
        (CurveError, "no array of numbers", lambda: loops([[0, 0], [1]])),
        (CurveError, "0 points", lambda: loops(np.zeros((0, 2)))),
        (CurveError, "all points are the same", lambda: loops(np.zeros((5, 2)))),
        (CurveError, r"shape \(4, 3\)", lambda: loops(np.zeros((4, 3)))),
        (CurveError, "1e-07 m cut a curve of 1 m into 1e[+]07", lambda: mesh_outline(BLOCK, Sizing(1e-7))),
        (OutlineError, "no points", lambda: Sizing(0.1, [Zone(np.zeros((0, 2)), 0.01)])),
        (OutlineError, "not finite", lambda: Sizing(0.1, [Zone([[np.nan, 0.0]], 0.01)])),
        (OutlineError, "growth = -1", lambda: Sizing(0.1, growth=-1)),
    ]
)
def test_outlines_and_meshes(error, message, call):
    check(error, message, call)


def test_holes_side_by_side_and_holes_in_the_plane_are_allowed():
    small = SQUARE * 0.2
    for infinite, outer in ((False, [SQUARE]), (True, [])):
        mesh = mesh_outline(loops(*outer, small + 0.1, small + 0.6, infinite=infinite), Sizing(0.1))
        assert len(mesh.loops) == 2 + len(outer)


@refused(
    [
        (MaterialError, r"Young's modulus \[Pa\] = '210e9'", lambda: Elastic("210e9", 0.3)),
        (MaterialError, "Poisson's ratio = nan", lambda: Elastic(1.0, np.nan)),
        (OutlineError, "both held and touched", lambda: Body(FIXED_BODY.outline, STEEL, held="face")),
        (OutlineError, r"\(nan, 0\)", lambda: Body(FIXED_BODY.outline, STEEL, hub=(np.nan, 0.0))),
        (TypeError, "ndarray", lambda: Body(SQUARE, STEEL)),
        (TypeError, "float", lambda: Body(FIXED_BODY.outline, 210e9)),
        (
            PointLoadError,
            r"\(0, 0.3\) m .* outside the body.* to 0.2 m",
            lambda: solve_contact(FIXED_BODY, on_hub((0, 0.3)), LOAD, settings=COARSE),
        ),
        (
            PointLoadError,
            "from the boundary",
            lambda: solve_contact(FIXED_BODY, on_hub((0, 0.2)), LOAD, settings=COARSE),
        ),
    ]
)
def test_materials_and_bodies(error, message, call):
    check(error, message, call)


@refused(
    [
        (ConditionError, "second component of the traction = nan", lambda: Condition(traction=(0, np.nan))),
        (ConditionError, "second component of the displacement = nan", lambda: Condition(displacement=(0, np.nan))),
        (ConditionError, "two components", lambda: Condition(traction=(1.0,))),
        (ConditionError, "two components", lambda: Condition(traction=-1e6)),
        (ConditionError, "'bottom' is 0", lambda: solve_boundary(MESH, STEEL, {"bottom": 0})),
        (
            ConditionError,
            r"gives shape \(3,\).* at 5 points",
            lambda: solve_boundary(
                MESH, STEEL, {"bottom": FIXED, "top": Condition(traction=(0, lambda points, normals: np.zeros(3)))}
            ),
        ),
        (
            ConditionError,
            "5 not finite",
            lambda: solve_boundary(
                MESH,
                STEEL,
                {"bottom": FIXED, "top": Condition(traction=(0, lambda points, normals: np.full(5, np.nan)))},
            ),
        ),
        (OutlineError, "'floor'", lambda: solve_boundary(MESH, STEEL, {"floor": FIXED})),
        (
            PointLoadError,
            r"\(5, 5\) m .* outside the body",
            lambda: solve_boundary(MESH, STEEL, {"bottom": FIXED}, (PointLoad((5.0, 5.0)),)),
        ),
        (
            PointLoadError,
            "half its element of 0.2 m",
            lambda: solve_boundary(MESH, STEEL, {"bottom": FIXED}, (PointLoad((0.5, 1.0)),)),
        ),
        (PointLoadError, "not finite", lambda: PointLoad((0.5, 0.5), (np.nan, 0.0))),
        (
            PositionError,
            r"shape \(3,\)",
            lambda: stress_at(solve_boundary(MESH, STEEL, {"bottom": FIXED}), np.zeros(3)),
        ),
        (
            PositionError,
            r"point 1 of 2 is \(nan, 0.5\)",
            lambda: field_at(PRESSED.solution("fixed"), np.array([[0, 0.5], [np.nan, 0.5]])),
        ),
        (PositionError, "two dimensions", lambda: field_at(PRESSED.solution("fixed"), 3.0)),
        (PositionError, "size = 0.0", lambda: grid_below(FIXED_BODY.outline, "face", np.zeros(2), 0.01, 0.015, 0.0)),
        (
            PositionError,
            r"3e\+14 points",
            lambda: grid_below(FIXED_BODY.outline, "face", np.zeros(2), 0.01, 0.015, 1e-9),
        ),
    ]
)
def test_conditions_and_places(error, message, call):
    check(error, message, call)


@refused(
    [
        (EquilibriumError, r"force \(None,\)", lambda: Control.of(force=(None,))),
        (EquilibriumError, "force -1000000.0", lambda: Control.of(force=-1e6)),
        (EquilibriumError, "load of y = -inf", lambda: Control.of(force=(None, -np.inf))),
        (EquilibriumError, "load of y = 'x'", lambda: Control.of(force=(None, "x"))),
        (EquilibriumError, r"shapes \(2,\)", lambda: Control(np.zeros(2), np.zeros(2))),
        (EquilibriumError, "the other nan", lambda: Control(np.full(3, np.nan), np.full(3, np.nan))),
        (EquilibriumError, "give a Control", lambda: solve_contact(FIXED_BODY, MOVING, -1e6)),
        (
            EquilibriumError,
            "moment 1000 N. cannot be balanced",
            lambda: solve_contact(FIXED_BODY, MOVING, Control.of(force=(None, 0.0), moment=1e3)),
        ),
        (SettingsError, "steps = 0", lambda: solve_contact(FIXED_BODY, MOVING, LOAD, steps=0)),
        (FrictionError, "friction = '0.3'", lambda: solve_contact(FIXED_BODY, MOVING, LOAD, "0.3")),
        (SettingsError, "growth = -1", lambda: Settings(growth=-1)),
        (SettingsError, "coarse = nan", lambda: Settings(coarse=np.nan)),
        (SettingsError, "rounds = 0", lambda: Settings(rounds=0)),
        (SettingsError, "rounds = 1.5", lambda: Settings(rounds=1.5)),
        (SettingsError, r"reach \[m\] = -1", lambda: Settings(reach=-1)),
        (RollingError, "creepage = nan", lambda: solve_rolling(PRESSED, 0.3, creepage=np.nan)),
        (RollingError, "forward = 0", lambda: solve_rolling(PRESSED, 0.3, creepage=1e-3, forward=0)),
        (FrictionError, "friction = -0.3", lambda: solve_rolling(PRESSED, -0.3, creepage=1e-3)),
        (
            EquilibriumError,
            "x 1e[+]09 N/m.* cannot be balanced",
            lambda: solve_rolling(PRESSED, 0.3, tangential_load=1e9),
        ),
        (
            RollingError,
            "do not touch",
            lambda: solve_rolling(solve_contact(FIXED_BODY, MOVING, Control.of(force=(None, 0.0))), 0.3, creepage=1e-3),
        ),
    ]
)
def test_loads_settings_and_rolling(error, message, call):
    check(error, message, call)


@refused(
    [
        (HertzError, "depth -1 m", lambda: line_stress(0.0, -1.0, 1.0, 1.0)),
        (HertzError, "half_width = 0.0", lambda: line_stress(0.0, 1.0, 0.0, 1.0)),
        (HertzError, "max_pressure = nan", lambda: line_stress(0.0, 1.0, 1.0, np.nan)),
        (PinError, "0.0 rad", lambda: pin_clearance(0.0)),
        (PinError, "rad", lambda: pin_pressure(0.0, np.pi)),
        (HertzError, "tangential = nan", lambda: cattaneo_line_stick(np.nan, 1.0)),
        (HertzError, "half_width = 0.0", lambda: cattaneo_line_shear(0.0, 0.0, 1.0, 0.5)),
        (HertzError, "half_width = 0.0", lambda: carter_creepage(0.5, 0.0, 1.0, 0.3)),
        (HertzError, "beta = nan", lambda: spence_line_stick(np.nan, 0.3)),
    ]
)
def test_closed_forms(error, message, call):
    check(error, message, call)
