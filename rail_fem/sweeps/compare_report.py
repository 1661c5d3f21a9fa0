"""What a comparison of results says: tables of errors and of plastic strain, warnings, which result is enough; and the
same as plain values for scripts."""

from dataclasses import asdict
from typing import Any

import numpy as np

from rail_fem.files.markdown import markdown_table
from rail_fem.result.quantities import BODIES
from rail_fem.result.result import PassResult
from rail_fem.show.metal import reported
from rail_fem.sweeps.compare import IMPACT, QUANTITIES, Comparison, accident, common_path, core_seconds, forces_on, peak

SHOWN = {"block": "worst 5 x 5 x 3 mm", "worst_1000": "worst 1000 mm3", "integral": "integral over the volume"}
STRAIN_FLAGS = ("edge", "corner", "large strain", "stiff cells", "no friction", "elastic")  # of bem_plastic


def comparison_text(comparison: Comparison, limit: float | None = None, quantity: str = "impact on the wheel") -> str:
    """Markdown: all of it, with the least expensive result within a relative error of a quantity where a limit is
    given."""
    enough = "" if limit is None else advice(comparison, limit, quantity) + "\n"
    parts = [table(comparison), strain_table(comparison), enough, warnings(comparison)]
    return "\n".join(filter(None, parts))


def table(comparison: Comparison) -> str:
    """Markdown: a row for each result, least expensive first. A force is marked "outside" where the one that a run
    states lies outside the common path, "at its end" where that on the path lies within 10 mm of an end of it: it may
    then be an accident of the window."""
    head = ["run", "model", "core seconds", "search, compilation [s]", "common path [mm]"]
    head += [*QUANTITIES, "transfer x [mm]", "its own error estimate", "warnings"]
    lines = []
    for name, result in zip(comparison.names, comparison.results):
        errors = [_shown(comparison, result, quantity) for quantity in QUANTITIES]
        position = "-" if np.isnan(result.transfer_x) else f"{result.transfer_x * 1e3:.1f}"
        own = ", ".join(f"{key} {value:.2g}" for key, value in result.error_estimate.items() if np.isfinite(value))
        cost = f"{core_seconds(result):.3g}", f"{result.cost.search_time:.3g}, {result.cost.compile_time:.3g}"
        path = common_path(result, comparison.reference).words
        said = position, own or "none claimed", f"{len(result.warnings)}"
        lines.append([name, result.model, *cost, path, *errors, *said])
    return "\n".join(markdown_table(head, lines)) + "\n"


def _shown(comparison: Comparison, result: PassResult, quantity: str) -> str:
    if result is comparison.reference:
        return "reference"
    error = comparison.error(result, quantity)
    if np.isnan(error):
        return "-"
    why = accident(result, comparison.reference, *QUANTITIES[quantity].forces)
    return f"{error:.1%}" if quantity == "history" else f"{error:+.1%}" + (f" ({why})" if why else "")


def strain_table(comparison: Comparison) -> str:
    """Markdown: a row for each quantity of each part that some result resolves, "not resolved" where one does not, a
    value in brackets where its block lies outside the common path, "none" where nothing has yielded; empty where
    fewer than two results resolve any."""
    told = [(name, result) for name, result in zip(comparison.names, comparison.results) if result.metal]
    if len(told) < 2:
        return ""
    parts = [part for part in reversed(BODIES) if any(part in result.metal for _, result in told)]
    rows = []
    for part in parts:
        for quantity, words in SHOWN.items():
            rows.append([f"{part}: {words}", *(_value(comparison, r, part, quantity) for _, r in told)])
        rows.append([f"{part}: x of that block [mm]", *(_place(result, part) for _, result in told)])
    rows.append(["flags about it", *(_flags(result, parts) for _, result in told)])
    head = ["plastic strain", *(f"{name} ({result.model})" for name, result in told)]
    return "\n".join(markdown_table(head, rows)) + "\n"


def _value(comparison: Comparison, result: PassResult, part: str, quantity: str) -> str:
    if part not in result.metal:
        return _missing(result, part)
    shown = reported(result, f"{quantity}_{part}").with_bar
    path, x = common_path(result, comparison.reference), result.metal[part]["block"][0]
    return shown if quantity == "integral" or path.holds(x) else f"({shown})"


def _missing(result: PassResult, part: str) -> str:
    """A result that resolves strain and does not name a part has run over it elastically, or not at all."""
    force = result.peaks.get(f"largest_force_{part}")
    return "none" if force is not None and force.value > 0 else "not resolved"


def _place(result: PassResult, part: str) -> str:
    x = result.metal[part]["block"][0] if part in result.metal else np.nan
    return f"{x * 1e3:.0f}" if np.isfinite(x) else "-"


def _flags(result: PassResult, parts: list[str]) -> str:
    """Names of the validity flags about strain, by part."""
    found = []
    for flag in result.trust.get("validity", ()):
        part = flag["reason"].partition(":")[0]
        if flag["what"] in STRAIN_FLAGS and part in parts:
            found.append(f"{part} {flag['what']}")
    return ", ".join(found) or "-"


def warnings(comparison: Comparison) -> str:
    """Markdown: what each result warns of, by its name."""
    return "\n\n".join(
        "\n- ".join([f"{name}:\n", *result.warnings])
        for name, result in zip(comparison.names, comparison.results)
        if result.warnings
    )


def advice(comparison: Comparison, limit: float, quantity: str) -> str:
    """The least expensive result within a relative error, in a sentence that says how far to trust it."""
    reference = comparison.names[comparison.results.index(comparison.reference)]
    found = comparison.least_expensive_within(limit, quantity)
    claimed = [v for v in comparison.reference.error_estimate.values() if np.isfinite(v)]
    caution = f"; {reference} itself claims no less than {max(claimed):.2%}" if claimed and max(claimed) > limit else ""
    bar = comparison.bar(quantity)
    caution += f"; the error bar of {reference}, {bar:.2%}, is counted in" if bar else ""
    form = comparison.form(quantity)
    caution += f"; what every one of them leaves out moves it by {form:.0%} besides (form)" if form == form else ""
    if found is None:
        return (
            f"nothing less expensive than {reference} is within {limit:.3g} of it in"
            f" {QUANTITIES[quantity].meaning}{caution}"
        )
    result = comparison.results[found]
    ratio = core_seconds(comparison.reference) / core_seconds(result)
    flags = f", with {len(result.warnings)} warning(s) of its own" if result.warnings else ""
    return (
        f"{comparison.names[found]} ({result.model}) is the least expensive within {limit:.3g} of {reference} in"
        f" {QUANTITIES[quantity].meaning}: off by {comparison.error(result, quantity):+.1%} at a cost {ratio:.3g} times"
        f" less{flags}{caution}"
    )


def comparison_facts(comparison: Comparison, limit: float | None, quantity: str) -> dict[str, Any]:
    """The rows of the table, relative errors by quantity, null where one does not resolve it [SI]."""
    reference = comparison.reference
    runs = []
    for name, result in zip(comparison.names, comparison.results):
        path = common_path(result, reference)
        doubtful = {what: accident(result, reference, *q.forces) for what, q in QUANTITIES.items()}
        runs.append(
            {
                "name": name,
                "model": result.model,
                "reference": result is reference,
                "cost": asdict(result.cost),
                "core_seconds": core_seconds(result),
                "common_path": [path.low, path.high],
                "errors": {what: 0.0 if result is reference else comparison.error(result, what) for what in QUANTITIES},
                "doubtful": {what: why for what, why in doubtful.items() if why},
                "impact_on_wheel": peak(result, *IMPACT),
                "forces_on_common_path": {key: found.value for key, found in forces_on(result, path).items()},
                "transfer_x": result.transfer_x,
                "error_estimate": result.error_estimate,
                "warnings": result.warnings,
            }
        )
    facts: dict[str, Any] = {"reference": comparison.names[comparison.results.index(reference)], "runs": runs}
    if limit is not None:
        found = comparison.least_expensive_within(limit, quantity)
        chosen = None if found is None else comparison.names[found]
        facts["within"] = {
            "limit": limit,
            "quantity": quantity,
            "least_expensive": chosen,
            "advice": advice(comparison, limit, quantity),
        }
    return facts
