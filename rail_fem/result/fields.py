"""The fields that a run leaves (VTU files in `fields/`), and how they are read back.

Six components mean XX YY ZZ XY YZ XZ to VTK, which is not the order of geometry.axes: files hold VTK's, arrays VOIGT.
"""

import zlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from geometry.axes import VOIGT
from geometry.surfaces.bodies import REGIONS
from rail_fem.files.vtu_layout import read_arrays

MESH = "mesh.npz"  # the mesh of a run, in its folder
VTK_COMPONENTS = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
VTK_ORDER = [VOIGT.index(name.lower()) for name in VTK_COMPONENTS]


class FieldsError(ValueError):
    """Fields that are not there or cannot be used: which file, what is wrong, what to do."""


@dataclass(frozen=True)
class Fields:
    """Fields of a pass at one moment, on the hexahedra in their undeformed positions [SI].

    points : (n, 3) [m], the wheel where it stands along x at that moment;  cells : (m, 8) VTK order
    region : (m,) number of each cell's body (geometry.surfaces.bodies.PassBody)
    displacement : (n, 3) from `points` [m], NaN-free;  plastic_strain : (m,) PEEQ [1]
    stress : (m, 6) Cauchy stress, order VOIGT [Pa];  time : [s];  source : name of the file
    """

    points: np.ndarray
    cells: np.ndarray
    region: np.ndarray
    displacement: np.ndarray
    plastic_strain: np.ndarray
    stress: np.ndarray
    time: float
    source: str

    def of(self, body: str) -> np.ndarray:
        """Numbers (k,) of a body's cells: "wing", "nose", "wheel"."""
        return np.flatnonzero(self.region == REGIONS.index(body))

    def nodes_of(self, body: str) -> np.ndarray:
        """Places (k, 3) of a body's nodes [m]."""
        return self.points[np.unique(self.cells[self.of(body)])]

    def worst(self, body: str) -> int | None:
        """The cell of a body with the largest plastic strain; None where nothing has yielded."""
        mine = self.of(body)
        if not len(mine) or not self.plastic_strain[mine].max() > 0:
            return None
        return int(mine[self.plastic_strain[mine].argmax()])

    def centre(self, cell: int) -> np.ndarray:
        """Mean of a cell's nodes (3,) [m]."""
        return self.points[self.cells[cell]].mean(axis=0)


def field_file(folder: Path, frame: int | None = None) -> Path:
    """A field file of a run: frame number `frame`, or else final.vtu, or else the last frame. Errors: FieldsError."""
    fields = Path(folder) / "fields"
    frames = sorted(fields.glob("frame_*.vtu"))
    if frame is not None:
        wanted = fields / f"frame_{frame:04d}.vtu"
        if wanted not in frames:
            raise FieldsError(f"{fields}: no {wanted.name} there; it holds {len(frames)} frame(s), counted from 0")
        return wanted
    final = fields / "final.vtu"
    frames = [final] if final.is_file() else frames
    if not frames:
        raise FieldsError(
            f"{fields}: no final.vtu and no frame_*.vtu there; is {folder} the folder of a run (--out), by an explicit"
            " model (light ones leave no fields), and were they moved?"
        )
    return frames[-1]


def read_fields(path: Path) -> Fields:
    """A field file of a run. Errors: FieldsError for a file that is damaged, foreign, or of an unstable run."""
    import meshio  # with the explicit models only

    try:
        arrays, time = _stored(path) or _stored_by_meshio(path)
        cells, region = arrays["connectivity"].reshape(-1, 8), arrays["region"].ravel().astype(int)
        of_metal = arrays["displacement"], arrays["plastic_strain"].ravel(), arrays["stress"]
        stored = Fields(arrays["Points"], cells, region, *of_metal, time, Path(path).name)
    except KeyError as error:
        raise FieldsError(
            f"{path}: holds no {error.args[0]} on hexahedra; is it a field file of this program?"
        ) from None
    # a cut-off file fails in the XML reader
    except (meshio.ReadError, OSError, ValueError, SystemExit, SyntaxError, zlib.error) as error:
        raise FieldsError(f"{path}: cannot be read ({type(error).__name__}: {error}); run the case again") from None
    if not np.isfinite(stored.plastic_strain).all():
        wrong = int((~np.isfinite(stored.plastic_strain)).sum())
        raise FieldsError(f"{path}: plastic strain is not a number in {wrong} cells; the run was unstable")
    tensor = np.empty_like(stored.stress)
    tensor[:, VTK_ORDER] = stored.stress
    return replace(stored, stress=tensor)


def _stored(path: Path) -> tuple[dict[str, np.ndarray], float] | None:
    """Arrays by name and time of a file of this program, stress in VTK's order; None for one that is laid out in
    another way."""
    found = read_arrays(path)
    return found and ({key.rpartition("/")[2]: array for key, array in found[0].items()}, found[1])


def _stored_by_meshio(path: Path) -> tuple[dict[str, np.ndarray], float]:
    """The same of any other VTU file, such as those of earlier versions."""
    import meshio

    mesh = meshio.read(path)
    arrays = {"Points": mesh.points, "connectivity": mesh.cells_dict["hexahedron"]}
    for name in ("region", "plastic_strain", "stress"):
        arrays[name] = np.asarray(mesh.cell_data_dict[name]["hexahedron"])
    arrays["displacement"] = np.asarray(mesh.point_data["displacement"])
    return arrays, float(np.ravel(mesh.field_data.get("TimeValue", [np.nan]))[0])
