"""What the app lets move, and what the light models say of it: controls made of the case file's own keys (unit, range,
meaning), a pass as charts and tables of the page, the command and the case file that repeat it."""

import math
import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from rail_fem.case.casefile import Case, CaseError, load_case
from rail_fem.case.template import written
from rail_fem.case.variations import as_setting, field_of, folder_name, short_keys, value_of
from rail_fem.case.warnings import case_warnings
from rail_fem.contact.contact_table import contact_table
from rail_fem.contact.rigid import with_path
from rail_fem.hierarchy import MODELS, solve
from rail_fem.result.result import PassResult
from rail_fem.run.form import form
from rail_fem.scene.crossing import FAMILY_KEYS
from rail_fem.scene.input_errors import meaning, plain, quantity_of, suggest
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import show, si_factor, typed
from rail_fem.scene.wheel_profile import WHEEL_NAMES
from rail_fem.show.page import numbers, remark, shares, text, trust
from rail_fem.show.page_charts import Chart, NamedResult, any_history, curve, heights
from rail_fem.show.style import GREY, scene_words

SHOWN, BESIDE = "rigid_hertz", "lumped"  # models that answer within the time that a hand needs to notice
PROFILE, LOAD, CROSSING = "scene.wheel.profile", "scene.vehicle.axle_load", "scene.crossing."
KEYS = (
    PROFILE,
    "scene.wheel.radius",
    CROSSING + "ratio",
    CROSSING + "wing_raise",
    CROSSING + "nose_lowering",
    "scene.speed",
    LOAD,
    "scene.foundation.stiffness",
    "scene.friction",
)
# of a slider, in the key's unit, where the key takes far more than tracks have
SPANS = {
    "scene.speed": (10.0, 200.0),
    LOAD: (4.0, 40.0),
    CROSSING + "ratio": (8.0, 32.0),
    "scene.foundation.stiffness": (10.0, 500.0),
    "scene.friction": (0.0, 1.0),
}
STEPS = 500  # of a slider, at least
MOST_ROWS = 5000  # of a history: a slow wheel's are farther apart
PLACE = "contact y"  # of all other quantities the first


class Slider(NamedTuple):
    """One key that moves. value : as it is written, without its unit;  low, high, step : of a slider, in the unit
    span : what the key takes;  choices : of a key that has no slider"""

    key: str
    meaning: str
    unit: str
    value: str
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0
    span: tuple[float, float] = (0.0, 0.0)
    choices: tuple[str, ...] = ()


class Seen(NamedTuple):
    """title : the scene in a line;  charts : of the page;  told : tables and words, as HTML;  case : the text of the
    case file;  command : the line that repeats it in a terminal"""

    title: str
    charts: list[Chart]
    told: str
    case: str
    command: str


def controls(case: Case) -> list[Slider]:
    """Those of KEYS that the case's crossing has, where the case stands."""
    own = FAMILY_KEYS[case.scene.crossing.family]
    return [_control(case, key) for key in KEYS if not key.startswith(CROSSING) or key.removeprefix(CROSSING) in own]


def _control(case: Case, key: str) -> Slider:
    field = field_of(key)
    quantity, value = quantity_of(field), case.scene.axle_load if key == LOAD else value_of(case, key)
    if quantity is None:
        return Slider(key, meaning(field), "", str(value), choices=tuple(dict.fromkeys((str(value), *WHEEL_NAMES))))
    span = quantity.low, quantity.high
    low, high = SPANS.get(key, span)
    step = 10.0 ** math.floor(math.log10((high - low) / STEPS))
    number = value / si_factor(quantity.unit)
    low, high = min(low, number), max(high, number)
    return Slider(key, quantity.meaning.partition(";")[0], quantity.unit, show(number, ""), low, high, step, span)


def changed(case: Case, values: Any) -> Case:
    """The case with other values of its controls, {key: text with its unit, or number}, read and named as a sweep does.

    Errors: CaseError, also for a key that is no control and for a profile that is none of its choices: what a browser
    sends names no file.
    """
    if not isinstance(values, Mapping):
        raise CaseError(case.path, [f"values: {typed(values)} is no table of keys"])
    known = {one.key: one for one in controls(case)}
    errors = [f"{plain(key)}: is not moved here{suggest(key, known)}" for key in values if key not in known]
    for key, value in values.items():
        if key in known and known[key].choices and value not in known[key].choices:
            errors.append(f"{key}: {typed(value)} is none of {', '.join(known[key].choices)}")
    if errors:
        raise CaseError(case.path, errors)
    short = short_keys([*values])
    name = folder_name(case.path.stem, {short[key]: value for key, value in values.items()})
    return load_case(case.path, values, name)


def seen(case: Case) -> Seen:
    """What the light models say of it. Errors: CaseError, and what they raise (ValueError)."""
    case = case.by(SHOWN).by(BESIDE)
    settings, other = (_few_rows(case.scene, case.runs[model]) for model in (SHOWN, BESIDE))
    result, beside = solve(SHOWN, case.scene, settings), solve(BESIDE, case.scene, other)
    warnings = (*case_warnings(case.scene, with_path(case.scene, settings)), *result.warnings)
    trust_of = {**result.trust, "rigid_path": _path(case.scene, settings)}
    result = replace(result, title=case.title, warnings=warnings, form=form(result, by_passes=False), trust=trust_of)
    runs = [NamedResult(SHOWN, result)]
    return Seen(
        scene_words(case.scene),
        _charts(result, beside),
        "\n".join(map(str, (*numbers(runs), _off(), *trust(runs), *shares(runs)))),
        written(case.title, case.scene, SHOWN, settings),
        command(case, SHOWN),
    )


def _few_rows(scene: Scene, settings: Any) -> Any:
    """The settings with rows so far apart that a browser draws them at once."""
    least = scene.travel_time(*settings.window(scene)) / MOST_ROWS
    return settings if settings.history_interval >= least else settings.replace_si(history_interval=least)


def _path(scene: Scene, settings: Any) -> dict[str, Any]:
    """The rigid wheel's path as the pass has searched it; another search would take as long as the pass."""
    start, end = settings.window(scene)
    table = contact_table(scene, start, end, settings.path_spacing)
    return {"x": table.x, "height": table.height.max(axis=0)}


def _charts(result: PassResult, beside: PassResult) -> list[Chart]:
    """Forces and heights, the other model's force among them; any other quantity, the contact's place first."""
    run = NamedResult(SHOWN, result)
    top = heights([run])
    words = f"whole wheel by {BESIDE}: {MODELS[BESIDE].meaning}"
    other = curve(1e3 * beside.history["x"], beside.history["force"] / 1e3, words, GREY, visible="legendonly")
    picture = dict(top.pictures[""])
    picture["data"] = [*picture["data"], other]
    more = any_history([run])
    if more is None:
        return [top._replace(pictures={"": picture})]
    first = sorted(more.pictures, key=lambda words: not words.startswith(PLACE))
    return [top._replace(pictures={"": picture}), more._replace(menus={"quantity": first})]


def _off() -> str:
    most, every = MODELS[SHOWN].off or (math.nan, math.nan)
    return remark(
        f"{SHOWN} against fe_full, in the sixteen cases of the documents: nine tenths of its forces within"
        f" {100 * most:.0f} %, all within {100 * every:.0f} %; the latter is in the bar of form. It resolves no plastic"
        " strain, bem_plastic and fe_full do; it feels no friction, fe_full does: start them below."
    )


def command(case: Case, model: str) -> str:
    """The line of a terminal that runs this case."""
    settings = [word for key, value in case.changes.items() for word in ("--set", as_setting(key, value))]
    line = ["rail-fem", "run", str(case.path), "--model", model, *settings, "--out", str(Path("runs") / case.name)]
    return shlex.join(line)


def form_of(case: Case) -> str:
    """The controls as HTML: a slider beside a number, or a list."""
    rows = []
    for one in controls(case):
        about = f'data-key="{text(one.key)}" data-unit="{text(one.unit)}" data-first="{text(one.value)}"'
        words = f"<span>{text(one.meaning)}<br><small>{text(one.key)}</small></span>"
        if one.choices:
            options = "".join(f"<option>{text(choice)}</option>" for choice in one.choices)
            rows.append(f"<label>{words}<select {about}>{options}</select></label>")
            continue
        span = f'min="{one.low:g}" max="{one.high:g}"'
        slider = f'<input type="range" {span} step="{one.step:g}" value="{text(one.value)}">'
        taken = f'min="{one.span[0]:g}" max="{one.span[1]:g}"'
        number = f'<input type="number" {taken} step="any" value="{text(one.value)}" {about}> {text(one.unit)}'
        rows.append(f"<label>{words}{slider}<span>{number}</span></label>")
    return f'<form id="controls">{"".join(rows)}</form>'
