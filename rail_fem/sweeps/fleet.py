"""The passes of a fleet: what differs from wheel to wheel is drawn at random, and the answer is a distribution.

In a list of changes (rail_fem.sweeps.rows) in place of [rows]:

    [fleet]
    passes = 128                                     # a power of two keeps Sobol's sequence in balance
    seed = 1
    [fleet.draw]
    "scene.speed" = { mean = "75 mph", deviation = "8 mph", low = "40 mph", high = "100 mph" }  # normal, cut off
    "scene.vehicle.axle_load" = { low = "12 t", high = "25 t" }                                 # anything between
    "scene.wheel.profile" = { of = ["P8", "P8-worn", "P1"], weights = [2, 5, 1] }

With proven_by = "fe_full" and proven = 20 so many passes, half of them evenly over all, half about the quantiles, are
run by that model too, and the quantiles of all corrected by what they find.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from pydantic import Field, model_validator
from scipy.stats import binom

from rail_fem.case.variations import quantity_at
from rail_fem.files.markdown import markdown_table
from rail_fem.hierarchy import MODELS
from rail_fem.result.result import PassResult
from rail_fem.scene.units import Quantity, show
from rail_fem.settings.draws import Change, Draws, number_of
from rail_fem.show.panels import curve, legend_above, new_panels, titled
from rail_fem.show.style import LINE_OF_MODEL
from rail_fem.sweeps.trends import MEASURES

QUANTILES = 0.5, 0.9, 0.99
LEVEL = 0.95  # of the interval of a quantile
WORST = 0.05  # share of the passes that are looked at by themselves
RESAMPLED = 1000  # draws of what the proven passes leave open, for the error of the model
LEAST_PROVEN = 8  # passes

Results = Mapping[str, PassResult]  # pass -> result


class Fleet(Draws):
    """How many passes, and what is drawn for each."""

    passes: int = Field(128, ge=2, le=10_000)
    proven_by: str = ""
    proven: int = Field(20, ge=LEAST_PROVEN)

    @model_validator(mode="after")
    def _by_a_model(self) -> Fleet:
        if self.proven_by and self.proven_by not in MODELS:
            raise ValueError(f"proven_by '{self.proven_by}' is not one of {', '.join(MODELS)}")
        return self

    def rows(self) -> dict[str, dict[str, Change]]:
        """Name of a pass -> its changes, by Sobol's sequence. Errors: DrawError, VariationError for a key that there is
        not."""
        drawn = self.drawn(self.passes, quantity_at)
        return {f"pass {number:05d}": changes for number, changes in enumerate(drawn, 1)}


def to_be_proven(values: Mapping[str, float], count: int) -> list[str]:
    """Names of the passes that a better model runs: by the rank of their values, half of them evenly over all, which
    tells how its ratio to the light model goes and scatters, the others nearest to the quantiles, each in turn."""
    ranked = sorted((name for name, value in values.items() if math.isfinite(value)), key=values.__getitem__)
    whole = len(ranked)
    evenly = ((np.arange(count // 2) + 0.5) / (count // 2) * whole).astype(int) if whole else []
    near = [sorted(range(whole), key=lambda at: abs(at + 0.5 - share * whole)) for share in QUANTILES]
    in_turn = [at for turn in zip(*near, strict=True) for at in turn]
    return [ranked[at] for at in list(dict.fromkeys([*map(int, evenly), *in_turn]))[:count]]


def corrected(light: Mapping[str, float], exact: Mapping[str, float], share: float) -> tuple[float, float, float]:
    """A quantile as passes proven by a better model have it: (value, model's error, scatter of the traffic), the last
    two as the logarithms that the value may be off by, each at level LEVEL.

    The logarithm of what the better model finds over what the light one does is a line over the light one's logarithm
    and a scatter about it. Line and scatter are drawn from what the proven passes leave open of them (normal
    regression with flat priors: Gelman et al., Bayesian Data Analysis, 14.2, recalled), what every other pass is off
    the line from their residuals, each over its own leverage.
    """
    rng, names = np.random.default_rng(0), [name for name in light if light[name] > 0 and math.isfinite(light[name])]
    place = np.array([at for at, name in enumerate(names) if exact.get(name, 0.0) > 0])
    x = np.log([light[name] for name in names])
    off = np.log([exact[names[at]] for at in place]) - x[place]
    line = np.stack([np.ones_like(x), x - x.mean()], axis=1)
    own, free = line[place], len(place) - 2
    inverse = np.linalg.inv(own.T @ own)
    best = inverse @ own.T @ off
    left = off - own @ best
    left = left / np.sqrt(1 - np.einsum("ij,jk,ik->i", own, inverse, own))  # all of one variance, their own scatter
    scatter = math.sqrt(((off - own @ best) ** 2).sum() / free)
    wide = np.sqrt(free / rng.chisquare(free, RESAMPLED))[:, None]
    moved = rng.standard_normal((RESAMPLED, 2)) @ np.linalg.cholesky(inverse).T
    found = x + (best + scatter * wide * moved) @ line.T + wide * rng.choice(left, (RESAMPLED, len(x)))
    found[:, place] = x[place] + off
    drawn = np.log(np.quantile(np.exp(found), share, axis=1))
    low, value, high = np.quantile(drawn, [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2])
    middle, *ends = quantile_of(x, share)
    return math.exp(value), max(high - value, value - low), max(abs(end - middle) for end in ends)


def quantile_of(values: np.ndarray, share: float) -> tuple[float, float, float]:
    """A quantile of n values and its interval of level LEVEL by the order of the values, whatever their distribution
    (binomial; inf where there are too few to bound it)."""
    ranked = np.concatenate([[-np.inf], np.sort(values), [np.inf]])
    low, high = binom.ppf([(1 - LEVEL) / 2, (1 + LEVEL) / 2], len(values), share).astype(int)
    return float(np.quantile(values, share)), float(ranked[low]), float(ranked[high + 1])


def fleet_lines(
    fleet: Fleet, columns: Sequence[str], rows: Mapping[str, Mapping[str, Change]], of_model: Mapping[str, Results]
) -> list[str]:
    """Markdown: quantiles of each quantity by each model with what so few passes leave open, as a better model corrects
    them, and who the worst are. rows : changes of each pass;  of_model : model -> pass -> result"""
    table, lines = [], []
    whole = {model: results for model, results in of_model.items() if model != fleet.proven_by}
    for model, results in whole.items():
        for column in columns:
            values = values_of(column, results)
            which = [f"{column} [{MEASURES[column].unit}]", str(len(values))]
            numbers = np.array(list(values.values()))
            cells = [_interval(*quantile_of(numbers, share)) if len(values) else "-" for share in QUANTILES]
            table.append([model, *which, *cells])
            proven = values_of(column, of_model.get(fleet.proven_by, {}))
            if sum(min(proven[name], values.get(name, 0.0)) > 0 for name in proven) >= LEAST_PROVEN:
                by = f"{model}, corrected by {fleet.proven_by} ({len(proven)} passes)"
                table.append([by, *which, *(_two_errors(*corrected(values, proven, share)) for share in QUANTILES)])
        lines += ["", *worst_lines(fleet, columns[0], rows, results, model)]
    head = ["model", "quantity", "passes", *(f"{share:.0%} of the passes below" for share in QUANTILES)]
    known = {model: off for model in whole if (off := MODELS[model].off)}
    said = ", ".join(f"{model} is off by up to {usual:.0%} in nine of ten" for model, (usual, _) in known.items())
    about = f"In brackets what so few passes leave open ({LEVEL:.0%}); the model's own error is not in it"
    return [*markdown_table(head, table), "", f"{about}{f' ({said})' if said else ''}.", *lines]


def values_of(column: str, results: Results) -> dict[str, float]:
    """Pass -> value in its unit, where the model resolves it."""
    measure = MEASURES[column]
    values = {name: measure.factor * measure.of(result) for name, result in results.items()}
    return {name: value for name, value in values.items() if math.isfinite(value)}


def _interval(value: float, low: float, high: float) -> str:
    ends = [f"{end:.4g}" if math.isfinite(end) else "open" for end in (low, high)]
    return f"{value:.4g} ({' to '.join(ends)})"


def _two_errors(value: float, model: float, traffic: float) -> str:
    off = [f"{value * math.expm1(error):.2g}" if math.isfinite(error) else "open" for error in (model, traffic)]
    return f"{value:.4g} (model +- {off[0]}, so few passes +- {off[1]})"


def worst_lines(
    fleet: Fleet, column: str, rows: Mapping[str, Mapping[str, Change]], results: Results, model: str
) -> list[str]:
    """Who the worst passes are: of few values of which one comes, each one's share among them and among all; of numbers
    the means."""
    value = values_of(column, results)
    ranked = sorted(value, key=value.__getitem__)
    worst = ranked[-max(1, round(WORST * len(ranked))) :]
    if not ranked:
        return []
    table = []
    for key, draw in fleet.draw.items():
        among = lambda names, key=key: [rows[name][key] for name in names]
        kinds, quantity = sorted({str(kind) for kind in among(ranked)}), quantity_at(key)
        if draw.of and (quantity is None or len(kinds) < len(ranked) / 2):
            share = lambda kind, names: f"{sum(str(one) == kind for one in among(names)) / len(names):.0%}"
            table += [[f"{key} = {kind}", share(kind, worst), share(kind, ranked)] for kind in kinds]
        else:
            table.append([key, *(_mean(key, quantity, among(names)) for names in (worst, ranked))])
    head = ["what is drawn", f"worst {len(worst)} of {len(ranked)} by {column}, {model}", "all"]
    return markdown_table(head, table)


def _mean(key: str, quantity: Quantity | None, values: Sequence[Change]) -> str:
    unit = "" if quantity is None else quantity.unit
    mean = np.mean([number_of(key, value, unit) for value in values])
    return show(float(mean), unit, 4)


def fleet_figure(title: str, columns: Sequence[str], of_model: Mapping[str, Results]) -> Figure:
    """Share of the passes below each value, with what so few passes leave open."""
    figure, panels = new_panels(3.6 * len(columns), len(columns), 1, squeeze=False)
    for axes, column in zip(panels[:, 0], columns, strict=True):
        for model, results in of_model.items():
            values = np.sort(list(values_of(column, results).values()))
            if not len(values):
                continue
            shares = (np.arange(len(values)) + 0.5) / len(values)
            ends = np.clip([quantile_of(values, share)[1:] for share in shares], values[0], values[-1])
            colour = LINE_OF_MODEL[model][0]
            axes.fill_betweenx(100 * shares, *ends.T, color=colour, alpha=0.25, lw=0)
            words = f"{model}, {len(values)} passes; shaded: left open by so few ({LEVEL:.0%})"
            curve(axes, values, 100 * shares, words, colour)
        axes.set(xlabel=f"{column} [{MEASURES[column].unit}]", ylabel="passes below [%]", ylim=(0, 100))
        legend_above(axes)
    return titled(figure, title)
