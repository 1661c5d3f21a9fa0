"""The study of the diverging route: a row by the light model, its table and figure."""

import numpy as np
import pytest

from rail_fem.show.style import save
from rail_fem.studies import diverging


@pytest.mark.validate
def test_rows_are_drawn_and_told(tmp_path):
    """The wheel stands 4.5 mm to the outside and comes to the nose before it does on the through route."""
    rows = [(name, diverging.light(name)) for name in diverging.EXPLICIT]
    through, curve = (result.history for _, result in rows)
    nose = [h["x"][np.argmax(h["force_nose"] > h["force_wing"])] for h in (through, curve)]
    assert nose[1] < nose[0] - 0.02 and 4e-3 < curve["wheel_lateral"][0] < 5e-3
    assert np.isnan(through["force_check"]).all() and curve["force_check"].min() > 0
    lines = diverging.table(rows).splitlines()
    assert len(lines) == 4 and lines[2].startswith("| through route | rigid_hertz | 0.00 | - | - |")
    assert save(diverging.figure(rows), tmp_path / "diverging.png").stat().st_size > 30e3
