"""A crossing as STEP: spline surfaces through its outlines, a sheet of faces for each body. Axes: geometry.axes.

Points of equal number on the outlines of all stations lie on one line along the track: a cubic with the limited slopes
of Fritsch and Butland (SciPy's PCHIP), as a reader of sections has it. Across, each segment of an outline is a cubic
spline through its points. The file is ISO 10303-21 text of the schema AP214, written here; lengths in mm.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator, make_interp_spline

from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.crossing import CrossingError

MM = 1e-3
HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('running surfaces of a crossing'),'2;1');
FILE_NAME('','2000-01-01T00:00:00',(''),(''),'rail-fem','rail-fem','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
"""
TAIL = "ENDSEC;\nEND-ISO-10303-21;\n"
CORNERS = ((0, 0), (-1, 0), (-1, -1), (0, -1))  # of a patch, in turn


class SplineSurface(NamedTuple):
    """A spline surface: control points (a, b, 3) [m], knots along (of degree 3) and across with its degree."""

    control: np.ndarray
    along: np.ndarray
    across: np.ndarray
    degree: int


def step_text(crossing: AnyCrossing, x: np.ndarray) -> str:
    """Wing and nose of a crossing through their outlines at stations x (m,) [m]. Errors: CrossingError."""
    lines = StepLines()
    for name, section, features in (
        ("wing", crossing.wing_section, crossing.wing_features),
        ("nose", crossing.nose_section, crossing.nose_features),
    ):
        outlines = [section(float(at)) for at in x]
        there = [k for k, outline in enumerate(outlines) if outline is not None]
        if len(there) > 1:
            lines.body(name, body_patches(x[there], np.array([outlines[k] for k in there]), features))
        elif name == "wing":
            raise CrossingError("the crossing has no wing between these stations: nothing to write")
    return HEAD + "".join(f"#{k}={text};\n" for k, text in enumerate(lines.entities, 1)) + TAIL


def body_patches(x: np.ndarray, points: np.ndarray, features: dict[str, int]) -> list[SplineSurface]:
    """Patches of a body: outlines points (m, n, 2) at x (m,), cut at the features."""
    patches, start = [], 0
    for end in features.values():
        patches.append(spline_patch(x, points[:, start : end + 1]))
        start = end
    return patches


def spline_patch(x: np.ndarray, points: np.ndarray) -> SplineSurface:
    """The surface through one segment: points (m, n, 2) of y, z at stations x (m,) [m]."""
    m, n, _ = points.shape
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).mean(axis=0)
    across = np.r_[0.0, np.cumsum(np.maximum(lengths, 1e-9))]
    spline = make_interp_spline(across / across[-1], np.moveaxis(points, 1, 0), k=min(3, n - 1))
    at = np.moveaxis(spline.c, 0, 1)  # (m, n, 2) control points across
    slope = PchipInterpolator(x, at, axis=0).derivative()(x)
    step = np.diff(x) / 3
    control = np.empty((2 * m, n, 3))
    control[0, :, 0], control[-1, :, 0] = x[0], x[-1]
    control[1:-1:2, :, 0], control[2:-1:2, :, 0] = (x[:-1] + step)[:, None], (x[1:] - step)[:, None]
    control[0, :, 1:], control[-1, :, 1:] = at[0], at[-1]
    control[1:-1:2, :, 1:] = at[:-1] + step[:, None, None] * slope[:-1]
    control[2:-1:2, :, 1:] = at[1:] - step[:, None, None] * slope[1:]
    knots = np.r_[np.repeat(x[0], 4), np.repeat(x[1:-1], 2), np.repeat(x[-1], 4)]
    return SplineSurface(control, knots, spline.t, spline.k)


class StepLines:
    """Entities of a STEP file as they come; each is known by its number, from 1."""

    def __init__(self) -> None:
        self.entities: list[str] = []
        self.context = self._context()

    def add(self, text: str) -> str:
        """Reference of a new entity."""
        self.entities.append(text)
        return f"#{len(self.entities)}"

    def body(self, name: str, patches: list[SplineSurface]) -> None:
        """Sheets of one name: each patch a part with one face, which every reader knows by the part's name."""
        for patch in patches:
            face = self._face(name, patch)
            shell = self.add(f"OPEN_SHELL('{name}',({face}))")
            model = self.add(f"SHELL_BASED_SURFACE_MODEL('{name}',({shell}))")
            self._part(name, model)

    def _context(self) -> str:
        """Units mm and rad, points equal to 1e-4 mm."""
        length = self.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
        angle = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        solid = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        equal = self.add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-04),{length},'distance','')")
        self.application = self.add("APPLICATION_CONTEXT('automotive design')")
        return self.add(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({equal}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))REPRESENTATION_CONTEXT('',''))"
        )

    def _part(self, name: str, model: str) -> None:
        context = self.add(f"PRODUCT_CONTEXT('',{self.application},'mechanical')")
        product = self.add(f"PRODUCT('{name}','{name}','',({context}))")
        formation = self.add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        stage = self.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{self.application},'design')")
        definition = self.add(f"PRODUCT_DEFINITION('design','',{formation},{stage})")
        shape = self.add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        origin = self._axes()
        shown = self.add(f"MANIFOLD_SURFACE_SHAPE_REPRESENTATION('{name}',({origin},{model}),{self.context})")
        self.add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{shown})")

    def _axes(self) -> str:
        at = self._point((0.0, 0.0, 0.0))
        up, ahead = self.add("DIRECTION('',(0.,0.,1.))"), self.add("DIRECTION('',(1.,0.,0.))")
        return self.add(f"AXIS2_PLACEMENT_3D('',{at},{up},{ahead})")

    def _face(self, name: str, patch: SplineSurface) -> str:
        control = patch.control / MM
        points = [[self._point(point) for point in row] for row in control]
        rows = ",".join(f"({','.join(row)})" for row in points)
        surface = self.add(
            f"B_SPLINE_SURFACE_WITH_KNOTS('',3,{patch.degree},({rows}),.UNSPECIFIED.,.F.,.F.,.F.,"
            f"{_knots(patch.along / MM, patch.across)},.UNSPECIFIED.)"
        )
        corners = [self.add(f"VERTEX_POINT('',{points[i][j]})") for i, j in CORNERS]
        along, across = (patch.along / MM, 3), (patch.across, patch.degree)
        sides = (
            ([row[0] for row in points], *along, 0, 1),
            (points[-1], *across, 1, 2),
            ([row[-1] for row in points], *along, 3, 2),
            (points[0], *across, 0, 3),
        )
        edges = []
        for (line, knots, degree, first, last), same in zip(sides, "TTFF"):
            curve = self.add(
                f"B_SPLINE_CURVE_WITH_KNOTS('',{degree},({','.join(line)}),.UNSPECIFIED.,.F.,.F.,{_knots(knots)},"
                ".UNSPECIFIED.)"
            )
            edge = self.add(f"EDGE_CURVE('',{corners[first]},{corners[last]},{curve},.T.)")
            edges.append(self.add(f"ORIENTED_EDGE('',*,*,{edge},.{same}.)"))
        loop = self.add(f"EDGE_LOOP('',({','.join(edges)}))")
        bound = self.add(f"FACE_OUTER_BOUND('',{loop},.T.)")
        return self.add(f"ADVANCED_FACE('{name}',({bound}),{surface},.T.)")

    def _point(self, point) -> str:
        return self.add(f"CARTESIAN_POINT('',({','.join(_real(value) for value in point)}))")


def _knots(*lines: np.ndarray) -> str:
    """Multiplicities of all lines of knots, then their values."""
    found = [np.unique(line, return_counts=True) for line in lines]
    counts = ",".join(f"({','.join(map(str, count))})" for _, count in found)
    return f"{counts},{','.join('(' + ','.join(map(_real, values)) + ')' for values, _ in found)}"


def _real(value: float) -> str:
    """A real number of STEP: with a decimal point."""
    text = f"{value:.9g}".upper()
    if "E" in text:
        mantissa, exponent = text.split("E")
        return f"{mantissa if '.' in mantissa else mantissa + '.'}E{exponent}"
    return text if "." in text else text + "."
