"""Controls of a trend: the same cases with one thing changed, run by a light model, to see whether that thing makes the
trend.

A reason why a trend differs from a source is no more than a guess until the change that it names has been made.
"""

from __future__ import annotations

from pathlib import Path

from rail_fem.case.casefile import load_case
from rail_fem.hierarchy import solve
from rail_fem.sweeps.trends import MEASURES, CaseChanges, ControlExperiment, Trend, TrendError, TrendFinding, check

AS_IT_IS = CaseChanges()


def run_control(control: ControlExperiment, trend: Trend, folder: Path, swept: CaseChanges = AS_IT_IS) -> TrendFinding:
    """What the control's model finds. folder : of the case files CASE.toml;  swept : what the sweep has changed in
    them, the control changes that. Errors: CaseError, TrendError where it does not resolve the
    quantity, the model's own."""
    asked = trend.model_copy(
        update={"quantity": control.quantity or trend.quantity, "order": control.order or trend.order}
    )
    results = {}
    for name in dict.fromkeys(asked.order):
        case = load_case(Path(folder) / f"{name}.toml", swept.of(name) | control.of(name)).by(control.model)
        results[name] = {control.model: solve(control.model, case.scene, case.runs[control.model])}
    found = check(asked, results)
    if not found:
        raise TrendError(
            f"control '{control.says}': {control.model} does not resolve the {asked.quantity} of"
            f" {', '.join(asked.order)}"
        )
    return found[0]


def control_words(control: ControlExperiment, trend: Trend, folder: Path, swept: CaseChanges = AS_IT_IS) -> str:
    """The control in a line, with what came out, or that nothing did on this scene; what it changes stands in the file
    of groups."""
    quantity = control.quantity or trend.quantity
    order = f" ({quantity}: {' < '.join(control.order or trend.order)})" if control.quantity or control.order else ""
    try:
        found = run_control(control, trend, folder, swept).words(MEASURES[quantity].unit)
    except TrendError:
        found = f"{control.model} does not resolve it on this scene"
    return f"{control.says}{order}: {found}"
