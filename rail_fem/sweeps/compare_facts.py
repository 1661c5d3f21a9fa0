"""A comparison as plain values for scripts."""

from dataclasses import asdict
from typing import Any

from rail_fem.sweeps.compare import (
    IMPACT,
    QUANTITIES,
    Comparison,
    accident,
    advice,
    common_path,
    core_seconds,
    forces_on,
    peak,
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
