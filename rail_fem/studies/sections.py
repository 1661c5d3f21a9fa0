"""The plane case studies of the thesis' chapter 5 by boundary elements, all four, with convergence charts and fields
from one command.

    python -m rail_fem.studies.sections --out sections          tables on the screen, a CSV and a PNG each in the folder
    `sections`
    python -m rail_fem.studies.sections --exact                 and speed against the error of exact solutions, scaling
    with memory
    RAIL_FEM_SMOKE=1                                         three sizes each: the same paths in seconds

Three pairs of blocks (bem/verification/cases.py) and a P8 wheel on a BS113A rail, inclined 1:20, gauge 1435 mm,
back-to-back 1360 mm, rail of 210 and of 190 GPa, 4 kN per mm of thickness. The charts are Figs. 5-10, 5-12, 5-14 and
5-20 in kind: change, error and time against boundary and internal mesh size; the fields are Figs. 5-11, 5-13, 5-15 to
5-18, 5-21 and 5-22. The thesis' geometry is known from pictures only (errata): its figures are an order of magnitude
here. Comparison with finite elements: rail_fem/studies/plane_contact.py.
"""

from __future__ import annotations

from pathlib import Path

import typer

from bem.material import Elastic
from bem.plane.body import Body
from bem.plane.coulomb import Control
from bem.verification.cases import CASES
from bem.verification.cases import LOAD as BLOCK_LOAD
from bem.verification.plane_study import EXACT, study
from rail_fem.light.contact_pairs import plain_rail_pair, plain_rail_section

RAIL_LOAD = 4e6  # of the wheel on the rail, per m of thickness [N/m]: the thesis' pressure of 740 MPa within 5 %


def wheel_on_rail(rail_young: float) -> tuple[Body, Body]:
    """P8 on BS113A 1:20, gauge 1435, back-to-back 1360: rail of a modulus [Pa] fixed, wheel of 210 GPa moving."""
    return plain_rail_section(plain_rail_pair(rail_steel=Elastic(rail_young, 0.3)))


def cases() -> dict[str, tuple[Body, Body, Control]]:
    """The four case studies, the fourth with two moduli: name -> fixed body, moving body, control."""
    found = {name: (*case(), BLOCK_LOAD) for name, case in CASES.items()}
    for young in (210, 190):
        found[f"P8 on BS113A, rail of {young} GPa"] = (
            *wheel_on_rail(young * 1e9),
            Control.of(force=(None, -RAIL_LOAD)),
        )
    return found


def main(
    out: Path = typer.Option(None, help="folder for CSV and PNG files"),
    exact: bool = typer.Option(False, help="exact solutions and scaling too"),
):
    """Convergence charts, speed and fields of the plane case studies."""
    study(cases(), out, EXACT if exact else {})


if __name__ == "__main__":
    typer.run(main)
