from typing import Annotated

import pytest
from hypothesis import given, strategies
from pydantic import BaseModel

from rail_fem.scene.units import Quantity, QuantityError, parse, show

LENGTH = Quantity("mm", 1, 100, "test length")


@pytest.mark.parametrize(
    "text, unit, value",
    [
        ("75 mph", "mph", 75 * 1609.344 / 3600),  # the international mile, exact
        ("160 kN/mm", "kN/mm", 160e6),
        ("66.25 t", "t", 66250.0),
        ("55.4 kN s/m", "kN s/m", 55400.0),
        ("190.772 GPa", "GPa", 190.772e9),
        ("400 %", "%", 4.0),
        ("1.435 m", "mm", 1.435),
        ("56.5 in", "mm", 56.5 * 0.0254),  # exact by definition
        ("20 us", "us", 20e-6),
        ("20 µs", "us", 20e-6),
        ("0.3", "", 0.3),
        ("30 %", "", 0.3),
        ("-900mm", "mm", -0.9),
        ("1.5e-3 m", "mm", 1.5e-3),
    ],
)
def test_units_are_converted_to_si(text, unit, value):
    assert parse(text, unit)[0] == pytest.approx(value, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    "text, said",
    [
        ("1,5 mm", "decimal point"),
        ("mm", "not a number"),
        ("", "not a number"),
        ("1.5", "has no unit"),
        ("1.5 mn", 'unknown unit "mn"'),
        ("3 kg", "[mass]"),
        ("nan mm", "not a finite"),
        ("inf mm", "not a finite"),
        ("1e999 mm", "not a finite"),
        ("2 m 3", "unknown unit"),
        ("1 mm; 2", "unknown unit"),
        ("0x10 mm", "unknown unit"),
        ("3 °", "dimension"),
    ],
)
def test_text_that_is_no_length_is_refused_with_a_remedy(text, said):
    with pytest.raises(QuantityError) as error:
        LENGTH.read(text)
    assert said in str(error.value)


@pytest.mark.parametrize("value", [True, None, [1], {"value": 1}, float("nan"), float("inf")])
def test_values_that_are_no_quantity_are_refused(value):
    with pytest.raises(QuantityError):
        LENGTH.read(value)


def test_bare_number_is_si_in_python_and_refused_in_a_case_file():
    assert LENGTH.read(0.05) == 0.05
    with pytest.raises(QuantityError, match='50 has no unit, write e.g. "50 mm"'):
        LENGTH.read(50, units_required=True)


def test_range_holds_in_every_unit_and_its_ends_are_allowed():
    for text in ("1 mm", "100 mm", "0.001 m", "10 cm", "0.1 m"):
        LENGTH.read(text)
    with pytest.raises(QuantityError, match=r"9 m = 9000 mm is outside \[1, 100\] mm for the test length"):
        LENGTH.read("9 m")
    with pytest.raises(QuantityError, match=r"^900 mm is outside \[1, 100\] mm"):
        LENGTH.read("900 mm")
    with pytest.raises(QuantityError, match="outside"):
        LENGTH.read(0.1001)


@given(strategies.floats(1e-6, 1e6), strategies.sampled_from(["mph", "kN/mm", "t", "MPa", "us", "%", "kN s/m"]))
def test_what_is_shown_reads_back(value, unit):
    """Ten digits shown, so the relative difference is at most 5e-10."""
    assert parse(show(value, unit, digits=10), unit)[0] == pytest.approx(value, rel=6e-10)


@pytest.mark.parametrize(
    "text, unit, value",
    [
        ("1 kg m s^-2", "kN", 1.0),
        ("1 kg*m/s/s", "kN", 1.0),
        ("1 kg·m/s²", "kN", 1.0),
        ("2 GN/m^1.5", "GN/m^1.5", 2e9),
        ("120 km / h", "mph", 120 / 3.6),
        ("75 MPH", "mph", 75 * 0.44704),
        ("7.8 g/cm**3", "kg/m^3", 7800.0),
        ("1 tonne", "t", 1000.0),
        ("1 long_ton", "t", 1016.0469088),
        ("30 deg", "mrad", 0.5235987755982988),
    ],
)
def test_products_and_quotients_of_known_units_with_small_exponents_are_read(text, unit, value):
    assert parse(text, unit)[0] == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "text, unit, said",
    [
        ("30 deg", "", "[angle], not that of a plain number"),
        ("0.3 rad", "%", "[angle]"),
        ("0.3 m/m rad", "", "blank behind"),
        ("3 %", "mrad", "of a plain number"),
        ("66 ton", "t", 'write "t" for 1000 kg'),
        ("66 Tons", "t", 'write "t" for 1000 kg'),
        ("3 count", "", "[count]"),
        ("1 kN/m s", "kN s/m", 'a blank behind "/"'),
        ("1 m^9", "mm", "exponent"),
        ("1 m^99", "mm", "unknown unit"),
        ("1 m^2^2", "mm", "unknown unit"),
        ("75 mph**9**9**9", "mph", "exponent 9"),
        ("75 (mph)", "mph", "unknown unit"),
        ("75 mph\0", "mph", "is not a number with a unit"),
        ("75 mph\n", "mph", "is not a number"),
        ("1 " + "m" * 100_000, "mm", "characters)"),
        ("1 " + "*".join(["m/m"] * 12), "", "more than 8 factors"),
        ("9" * 5000 + " m", "mm", "is not a number"),
        ("1 __import__", "mm", "unknown unit"),
        ("1 /s", "mm", "dimension"),
        ("1 *", "mm", "unknown unit"),
        ("1 degC", "mm", "[temperature]"),
    ],
)
def test_expressions_that_are_no_unit_are_refused_in_no_time_and_on_one_short_line(text, unit, said):
    with pytest.raises(QuantityError) as error:
        parse(text, unit)
    assert said in str(error.value) and len(str(error.value)) < 300 and str(error.value).isprintable()


@pytest.mark.parametrize("value", [10**400, -(10**400), [0] * 100_000, {"a": "b" * 100_000}, "x" * 10_000_000])
def test_huge_values_are_refused_on_one_short_line(value):
    with pytest.raises(QuantityError) as error:
        LENGTH.read(value)
    assert len(str(error.value)) < 300


def test_a_word_may_stand_in_place_of_a_value():
    """As written only; every message names it."""

    class Section(BaseModel):
        factor: Annotated[float | str, Quantity("", 1, 100, "factor", words=("auto",))]

    assert Section(factor="auto").factor == "auto" and Section(factor="2.5").factor == 2.5
    for wrong in ("Auto", "0.5", 1000, "fast"):
        with pytest.raises(ValueError, match='or "auto"'):
            Section(factor=wrong)
    assert Quantity("", 1, 100, "factor", words=("auto",)).show("auto") == "auto"
