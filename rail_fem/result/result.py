"""What a model says about one pass, and its files.

What a model does not resolve is NaN, never 0 and never borrowed from another model.
"""

import hashlib
import html
import io
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import ValidationError

from rail_fem.files.atomic import csv_text, write_atomically, write_text_atomically
from rail_fem.files.strict_json import NAN, dumps, nan_for_none, to_plain
from rail_fem.result.history import COLUMNS, complete_history, shown_table
from rail_fem.result.trust import trust_text
from rail_fem.result.versions import needed, versions
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import SI_OF, engineering

if TYPE_CHECKING:
    from rail_fem.result.fields import Fields
    from rail_fem.result.warning_records import WarningRecord

RESULT_VERSION = 3


@dataclass(frozen=True)
class Peak:
    """A largest value and where it is.

    Parameters
    ----------
    value : float
        In `unit`.
    unit : str
        Of SI.
    x, y, z : float
        Where [m]; NaN where not known.
    time : float
        When [s].
    size : float
        Of its element [m], where the value grows as that shrinks.

    Examples
    --------
    >>> rail_fem.Peak(195e3, "N", x=0.357).value
    195000.0
    """

    value: float
    unit: str
    x: float = NAN
    y: float = NAN
    z: float = NAN
    time: float = NAN
    size: float = NAN


@dataclass(frozen=True)
class PatchSummary:
    """One contact patch at one moment [SI]: centre, extent along x and y, area, force, largest pressure."""

    time: float
    x: float
    y: float
    region: str
    length: float = NAN
    width: float = NAN
    area: float = NAN
    force: float = NAN
    max_pressure: float = NAN


@dataclass(frozen=True)
class BearerSummary:
    """One bearer under a beam and what it has had to carry on a pass, static load included [SI].

    number, x : its number and where it lies;  state : "", "voided" or "unlike";  pad_force : largest force that the
        rail presses on it with, springs and dampers;  ballast_force : largest that it presses on the ballast with;
        uplift : largest that its pad is pulled with;  deflection : largest of the bearer, down
    """

    number: int
    x: float
    state: str
    pad_force: float
    uplift: float
    ballast_force: float
    deflection: float


@dataclass(frozen=True)
class Cost:
    """What the answer cost: wall time [s], elements, steps, ranks, element updates per second of all ranks, peak memory
    [B] of all ranks.

    search_time : of the wall time, what is kept for other runs on the same surfaces: contacts along them, meshes, those
        of a twin too [s];  compile_time : of the wall time, kernels compiled, once on a machine [s]
    """

    wall_time: float = NAN
    elements: int = 0
    steps: int = 0
    ranks: int = 1
    updates_per_second: float = NAN
    peak_memory: float = NAN
    search_time: float = 0.0
    compile_time: float = 0.0

    @property
    def solve_time(self) -> float:
        """The wall time of the model itself [s]: what another run of it costs at least."""
        return self.wall_time - self.search_time - self.compile_time


@dataclass(frozen=True, repr=False, eq=False)  # one result is itself alone: its arrays have no one truth value
class PassResult:
    """One pass by one model. What a model does not resolve is NaN, or left out.

    Attributes
    ----------
    model : str
        Name of the model.
    scene : Scene
        The scene that was solved.
    settings : mapping
        The model's numerics as plain values [SI].
    history : mapping of str to (n,) array
        The columns of rail_fem.result.history.COLUMNS [SI]; columns left out become NaN.
    peaks : mapping of str to Peak
        "impact_on_wheel", "first_impact_on_nose" or "_wing", "largest_force", "largest_force_leg", "_wing", "_nose"
        (rail_fem.result.events), "plastic_strain_wing", ...
    patches : tuple of PatchSummary
        Contact patches at chosen moments.
    bearers : tuple of BearerSummary
        What each bearer near the window has carried; () on a rigid mass.
    transfer_x : float
        x [m] where the body that the wheel comes to takes over half of the force for good; NaN if it never does.
    energies : mapping of str to float
        Final energies [J] and their balance error.
    cost : Cost
        What the run has cost.
    error_estimate : mapping of str to float
        Relative error of a quantity that the run claims; NaN where it makes no claim.
    error_bars : mapping of str to float
        By names of rail_fem.result.quantities.REPORTED: half width of the interval in which the run claims that its
        limit for vanishing elements lies [SI]; a name that is not there is not claimed.
    form : mapping of str to mapping
        By simplification of the model, in words, and reported quantity: what it moves by where the next better one
        takes its place [SI] (rail_fem.run.form).
    metal : mapping of str to mapping
        By body: what the pass leaves in it, plain values of rail_fem.result.plastic_zone.PlasticZone [SI].
    passes : tuple of mapping
        Of a pass that was repeated on the steel of the one before: what each reported [SI], the last as this result; ()
        for a single pass.
    trust : mapping
        By row: what the trust report found (plain values).
    warnings : tuple of str
        What is doubtful; `warning_records` has kind and place of each.
    notes : tuple of str
        What was repaired in the files that were read, and where its error bars come from where that is no twin.
    versions : mapping of str to str
        Of this program and of what it stands on.
    fault : str
        Why the run failed; empty when it did not.
    cut_off : str
        What ended the run before the end of its path, as its settings ask; empty when it went to the end.
    title : str
        Of the case that was run; empty where none was.
    folder : Path or None
        That `load_result` has read it from; no entry of it, its fields lie there.

    Examples
    --------
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> result = rail_fem.solve("lumped", scene, {"start": "300 mm", "end": "400 mm"})
    >>> result.peaks["largest_force"].value > scene.static_wheel_load  # [N]
    True
    >>> result.history["force"].shape == result.history["x"].shape
    True
    """

    folder: ClassVar[Path | None] = None

    model: str
    scene: Scene
    settings: Mapping[str, Any]
    history: Mapping[str, np.ndarray]
    peaks: Mapping[str, Peak] = field(default_factory=dict)
    patches: tuple[PatchSummary, ...] = ()
    bearers: tuple[BearerSummary, ...] = ()
    transfer_x: float = NAN
    energies: Mapping[str, float] = field(default_factory=dict)
    cost: Cost = Cost()
    error_estimate: Mapping[str, float] = field(default_factory=dict)
    error_bars: Mapping[str, float] = field(default_factory=dict)
    form: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    metal: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    passes: tuple[Mapping[str, float], ...] = ()
    trust: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=versions)
    fault: str = ""
    cut_off: str = ""
    title: str = ""

    def __post_init__(self):
        object.__setattr__(self, "history", complete_history(self.history))

    @property
    def warning_records(self) -> "tuple[WarningRecord, ...]":
        """The warnings with the kind and the place of each; of results of older releases, too."""
        from rail_fem.result.warning_records import record

        return tuple(map(record, self.warnings))

    @property
    def calibrated(self) -> bool:
        """Whether error bars are those of other scenes of its class (rail_fem.result.error_bars.calibrated_bars)."""
        return self.settings.get("error_twin") == "calibrated"

    def form_bar(self, name: str) -> float:
        """Half width of what a reported quantity may be off by for its model's form.

        Parameters
        ----------
        name : str
            Of rail_fem.result.quantities.REPORTED.

        Returns
        -------
        float
            The root of the sum of the squares of what each simplification moves it by [SI]; NaN where nothing is
            claimed.
        """
        moved = [row[name] for row in self.form.values() if name in row]
        return math.hypot(*moved) if moved else NAN

    def __repr__(self) -> str:
        shown = ", ".join(f"{name} {value}" for name, value in self.summary_rows()[:4])
        return f"<PassResult {self.model}: {shown}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in self.summary_rows()
        )
        return f"<table><caption>{html.escape(self.model)}</caption>{rows}</table>"

    def summary_rows(self) -> list[tuple[str, str]]:
        """What was found in engineers' units: peaks with their positions, transfer, steps and time; a fault first."""
        rows = [("failure", self.fault)] if self.fault else []
        for name, peak in self.peaks.items():
            rows.append(
                (
                    name.replace("_", " "),
                    engineering(peak.value, peak.unit, 4)
                    + (f" at x = {peak.x * 1e3:.1f} mm" if math.isfinite(peak.x) else "")
                    + (f", in an element of {peak.size * 1e3:.2g} mm" if math.isfinite(peak.size) else ""),
                )
            )
        if math.isfinite(self.transfer_x):
            rows.append(("transfer", f"x = {self.transfer_x * 1e3:.1f} mm"))
        return [
            *rows,
            ("rows of history", str(len(self.history["x"]))),
            ("wall time", f"{self.cost.wall_time:.3g} s"),
            ("warnings", str(len(self.warnings))),
        ]

    def to_dataframe(self, si: bool = False):
        """The history as a pandas.DataFrame.

        Parameters
        ----------
        si : bool
            Bare names in SI; else units in their names, as in history.csv.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ModuleNotFoundError
            Where pandas is not installed.
        """
        with needed("pandas"):
            import pandas
        if si:
            return pandas.DataFrame(dict(self.history))
        header, table = shown_table(self.history)
        return pandas.DataFrame(table, columns=header)

    def to_xarray(self):
        """The history over time as an xarray.Dataset in SI, x a second coordinate; peaks as numbers of their own with
        place, time and bars in their attributes. All have units and long_name.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        ModuleNotFoundError
            Where xarray is not installed.
        """
        with needed("xarray"):
            import xarray
        columns = {
            name: (
                "time",
                self.history[name],
                {"units": SI_OF.get(column.unit, column.unit), "long_name": column.meaning},
            )
            for name, column in COLUMNS.items()
        }
        coordinates = {name: columns.pop(name) for name in ("time", "x")}
        about = {"model": self.model, "title": self.title, "fault": self.fault, "transfer_x": self.transfer_x}
        peaks = {}
        for name, peak in self.peaks.items():
            told = {"units": peak.unit, "long_name": name.replace("_", " ")}
            told |= {key: getattr(peak, key) for key in ("x", "y", "z", "time", "size")}
            bars = {"error_bar": self.error_bars.get(name, NAN), "form_bar": self.form_bar(name)}
            known = {key: value for key, value in (told | bars).items() if value == value}
            peaks[name] = ((), peak.value, known)
        return xarray.Dataset(columns | peaks, coordinates, about)

    @property
    def fields(self) -> "Fields":
        """Plastic strain, stress and displacement on the hexahedra at the end of the run [SI], read anew at each call.

        Errors: FieldsError where the result was not read from a folder, or no fields lie there.
        """
        from rail_fem.result.fields import read_fields

        return read_fields(self._field_file())

    def mesh(self, frame: int | None = None):
        """The same as a pyvista.UnstructuredGrid in SI, as ParaView shows it: arrays `plastic_strain`, `von_mises`,
        `stress` (VTK's order), `region`, `displacement`.

        Parameters
        ----------
        frame : int or None
            Number of a frame of the run; None: its end.

        Returns
        -------
        pyvista.UnstructuredGrid

        Raises
        ------
        FieldsError
            As `fields`.
        ModuleNotFoundError
            Where pyvista is not installed.
        """
        with needed("pyvista"):
            import pyvista
        return pyvista.read(self._field_file(frame))

    def _field_file(self, frame: int | None = None) -> Path:
        from rail_fem.result.fields import FieldsError, field_file

        if self.folder is None:
            raise FieldsError("this result was not read from a folder: load_result(DIR) of a run that has left fields")
        return field_file(self.folder, frame)

    def save(self, folder: Path | str) -> None:
        """Write history.csv (units in its header), history.npz (SI), trust.txt, result.json and the profile of a
        measured wheel; each appears whole or not at all. Root only under MPI.

        Parameters
        ----------
        folder : Path or str
            Made where it is not there.

        Raises
        ------
        OSError
            Read-only folder, full disk.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.scene.keep_files(folder)
        history = self._history_npz()
        write_atomically(folder / "history.npz", lambda path: path.write_bytes(history))
        header, table = shown_table(self.history)
        line = ",".join(["%.9g"] * len(header)) + "\n"
        rows = line * len(table) % tuple(table.ravel().tolist())  # in a third of the time of one number after another
        write_text_atomically(folder / "history.csv", csv_text([header]) + rows)
        write_text_atomically(folder / "trust.txt", trust_text(self.trust, self.warnings))
        summary = to_plain(self.summary())
        seal = _seal(summary, history)
        write_text_atomically(folder / "result.json", dumps(summary | {"seal": seal}) + "\n")

    def _history_npz(self) -> bytes:
        stream = io.BytesIO()  # an archive that a full disk cuts off complains once more when it is forgotten
        np.savez_compressed(stream, **self.history)
        return stream.getvalue()

    def summary(self) -> dict[str, Any]:
        """Everything but the history, as result.json holds it [SI]."""
        summary = {"result_version": RESULT_VERSION}
        for entry in fields(self):
            if entry.name != "history":
                summary[entry.name] = getattr(self, entry.name)
        return summary | {
            "scene": self.scene.model_dump(mode="json"),
            "cost": asdict(self.cost),
            "peaks": {name: asdict(peak) for name, peak in self.peaks.items()},
            "patches": [asdict(patch) for patch in self.patches],
            "bearers": [asdict(bearer) for bearer in self.bearers],
        }


def _seal(summary: Mapping[str, Any], history: bytes) -> str:
    """SHA-256 of what result.json holds but for its seal, as plain values, and of history.npz."""
    return hashlib.sha256(json.dumps(summary, sort_keys=True).encode() + history).hexdigest()


class ResultError(ValueError):
    """A result that this program cannot use as it is; the message says why."""


def load(folder: Path | str) -> PassResult:
    """Read back what `PassResult.save` wrote.

    Parameters
    ----------
    folder : Path or str
        Of a finished run (--out).

    Returns
    -------
    PassResult

    Raises
    ------
    FileNotFoundError
        Where there is no result.
    ValueError
        For a damaged or changed file, and for one of a version that this program does not read.

    Examples
    --------
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> rail_fem.solve("p2_formula", scene).save("p2")
    >>> rail_fem.load_result("p2").model
    'p2_formula'
    """
    folder = Path(folder)
    if not (folder / "result.json").is_file():
        raise FileNotFoundError(f"{folder}: no result.json there; is it the folder of a finished run (--out)?")
    try:
        return _read(folder)
    except ResultError:
        raise
    except Exception as error:  # what is cut or altered fails anywhere in json, zip or the classes
        raise ValueError(
            f"{folder}: result.json or history.npz is damaged ({type(error).__name__}: {error}): --restart writes them"
            " again"
        ) from error


def _read(folder: Path) -> PassResult:
    summary = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    history = (folder / "history.npz").read_bytes()
    seal = summary.pop("seal", None)
    unchanged = seal == _seal(summary, history)
    version = summary.pop("result_version", None)
    if version != RESULT_VERSION:
        raise ResultError(
            f"{folder / 'result.json'}: written as result version {version}, this program reads version"
            f" {RESULT_VERSION}: run it again"
        )
    summary = nan_for_none(summary, keep=("scene", "settings", "trust"))
    try:
        summary["scene"] = Scene.model_validate(summary["scene"], context={"run_folder": folder})
    except ValidationError as error:
        first = error.errors()[0]
        raise ResultError(
            f"{folder / 'result.json'}: scene.{'.'.join(map(str, first['loc']))}: {first['msg']}"
        ) from error
    summary["cost"] = Cost(**summary["cost"])
    summary["peaks"] = {name: Peak(**peak) for name, peak in summary["peaks"].items()}
    summary["patches"] = tuple(PatchSummary(**patch) for patch in summary["patches"])
    summary["bearers"] = tuple(BearerSummary(**bearer) for bearer in summary.get("bearers", ()))
    for name in ("warnings", "notes", "passes"):
        summary[name] = tuple(summary.get(name, ()))
    with np.load(io.BytesIO(history)) as stored:
        result = PassResult(history=dict(stored), **summary)
    if not unchanged:
        raise ResultError(
            f"{folder}: result.json or history.npz was changed after the run had written it (its seal does not fit):"
            " --restart writes them again"
        )
    object.__setattr__(result, "folder", folder)
    return result
