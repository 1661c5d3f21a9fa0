"""What happens when a wheel passes a railway crossing: one scene, a hierarchy of models, an honest error on each::

    import rail_fem
    case = rail_fem.load_case(rail_fem.example("nose_transfer"))
    faster = case.scene.replace(speed="100 mph")
    result = rail_fem.solve("rigid_hertz", faster)

Names are imported when they are first used, so that `import rail_fem` is light.
"""

import importlib
import importlib.util
import logging
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import bem as bem
    import geometry as geometry
    from rail_fem.case.casefile import Case, CaseError, load_case
    from rail_fem.case.examples import example
    from rail_fem.export.entry import export_dolfinx
    from rail_fem.hierarchy import MODELS, solve
    from rail_fem.result.result import PassResult, Peak
    from rail_fem.result.result import load as load_result
    from rail_fem.scene.scene import Scene
    from rail_fem.show.force import force_figure as plot_force
    from rail_fem.sweeps.parameter_figure import parameter_figure as plot_sweep
    from rail_fem.sweeps.results import SweepResults, load_sweep

__all__ = [
    "MODELS",
    "Case",
    "CaseError",
    "PassResult",
    "Peak",
    "Scene",
    "SweepResults",
    "example",
    "export_dolfinx",
    "load_case",
    "load_result",
    "load_sweep",
    "plot_force",
    "plot_sweep",
    "solve",
]

_HOMES = {
    "Case": "rail_fem.case.casefile",
    "CaseError": "rail_fem.case.casefile",
    "load_case": "rail_fem.case.casefile",
    "example": "rail_fem.case.examples",
    "export_dolfinx": "rail_fem.export.entry",
    "MODELS": "rail_fem.hierarchy",
    "solve": "rail_fem.hierarchy",
    "PassResult": "rail_fem.result.result",
    "Peak": "rail_fem.result.result",
    "load_result": "rail_fem.result.result:load",
    "Scene": "rail_fem.scene.scene",
    "SweepResults": "rail_fem.sweeps.results",
    "load_sweep": "rail_fem.sweeps.results",
    "plot_force": "rail_fem.show.force:force_figure",
    "plot_sweep": "rail_fem.sweeps.parameter_figure:parameter_figure",
}

_PARTS = ("bem", "geometry", "kernel_cache")


class _Beside(MetaPathFinder, Loader):
    """In a checkout _PARTS are folders beside this package; a wheel has them beneath it (setup.py). Here they answer to
    the names that they have there, as the same modules: `rail_fem.geometry.axes is geometry.axes`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        home, _, own = fullname.partition(".")
        if home != __name__ or own.partition(".")[0] not in _PARTS or importlib.util.find_spec(own) is None:
            return None
        return ModuleSpec(fullname, self)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(spec.name.partition(".")[2])
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """It is loaded; the import has given it the other name's specification meanwhile."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state or module.__spec__


logging.getLogger(__name__).addHandler(logging.NullHandler())  # shown where a program asks for it
if not (Path(__file__).parent / "geometry").is_dir():  # before the finder that would load a second copy
    sys.meta_path.insert(0, _Beside())


def __getattr__(name: str) -> Any:
    if name in _PARTS:
        return importlib.import_module(f"{__name__}.{name}")
    if name == "__version__":
        from rail_fem.result.versions import own_version

        return own_version()
    if name not in _HOMES:
        raise AttributeError(f"module 'rail_fem' has no attribute '{name}'; it offers {', '.join(__all__)}")
    module, _, known_as = _HOMES[name].partition(":")
    return getattr(importlib.import_module(module), known_as or name)


def __dir__() -> list[str]:
    return [*__all__, *_PARTS, "__version__"]
