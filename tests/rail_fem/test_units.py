import pytest
from hypothesis import given, strategies

from rail_fem.scene.units import Quantity, QuantityError, parse, show

LENGTH = Quantity("mm", 1, 100, "test length")


@pytest.mark.parametrize("text, unit, value", [
    ("75 mph", "mph", 75 * 1609.344 / 3600),          # the international mile, exact
    ("160 kN/mm", "kN/mm", 160e6),
    ("66.25 t", "t", 66250.0),
    ("55.4 kN s/m", "kN s/m", 55400.0),
    ("190.772 GPa", "GPa", 190.772e9),
    ("400 %", "%", 4.0),
    ("1.435 m", "mm", 1.435),
    ("56.5 in", "mm", 56.5 * 0.0254),                 # exact by definition
    ("20 us", "us", 20e-6), ("20 µs", "us", 20e-6),
    ("0.3", "", 0.3), ("30 %", "", 0.3),
    ("-900mm", "mm", -0.9), ("1.5e-3 m", "mm", 1.5e-3),
])
def test_units_are_converted_to_si(text, unit, value):
    assert parse(text, unit)[0] == pytest.approx(value, rel=1e-15, abs=0)


@pytest.mark.parametrize("text, said", [
    ("1,5 mm", "decimal point"), ("mm", "not a number"), ("", "not a number"), ("1.5", "has no unit"),
    ("1.5 mn", 'unknown unit "mn"'), ("3 kg", "[mass]"), ("nan mm", "not a finite"), ("inf mm", "not a finite"),
    ("1e999 mm", "not a finite"), ("2 m 3", "unknown unit"), ("1 mm; 2", "unknown unit"), ("0x10 mm", "unknown unit"),
    ("3 °", "dimension"),
])
def test_text_that_is_no_length_is_refused_with_a_remedy(text, said):
    with pytest.raises(QuantityError) as fault:
        LENGTH.read(text)
    assert said in str(fault.value)


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
    with pytest.raises(QuantityError, match=r"9 m = 9000 mm is outside \[1, 100\] for the test length"):
        LENGTH.read("9 m")
    with pytest.raises(QuantityError, match="outside"):
        LENGTH.read(0.1001)


@given(strategies.floats(1e-6, 1e6), strategies.sampled_from(["mph", "kN/mm", "t", "MPa", "us", "%", "kN s/m"]))
def test_what_is_shown_reads_back(value, unit):
    """Ten digits shown, so the relative difference is at most 5e-10."""
    assert parse(show(value, unit, digits=10), unit)[0] == pytest.approx(value, rel=6e-10)
