"""The model bem_plastic: a short stretch of the nose, its files and figures, and what it says of itself."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from bem.steel.hardening import Hardening
from bem.steel.nonlinear_kinematic import NonlinearKinematic
from geometry.surfaces.bodies import REGIONS
from rail_fem.case.casefile import load_case
from rail_fem.contact.contact_pairs import ContactPair
from rail_fem.files.sealed import SealError
from rail_fem.hierarchy import solve
from rail_fem.models.bem_plastic import flow_flags, hardening_of, strain_bars
from rail_fem.passes.plastic_fields import metal_of
from rail_fem.passes.plastic_rolling import Flow, SolvedStation, Station, flow_in, surface_fall
from rail_fem.result.fields import field_file, read_fields
from rail_fem.result.parts import parts_between
from rail_fem.result.result import load
from rail_fem.scene.steel import cyclic_steel
from rail_fem.show.fields import read_crossing


@pytest.fixture(scope="module")
def short_pass(tmp_path_factory):
    """80 mm of the reference pass about the first impact on the nose, coarse."""
    folder = tmp_path_factory.mktemp("plastic")
    scene = load_case("nose_transfer").scene
    settings = {"start": "360 mm", "end": "440 mm", "cell_size": "3 mm", "step": "15 mm", "error_estimate": False}
    result = solve("bem_plastic", scene, settings, folder=folder)
    result.save(folder)
    return folder, result


def test_plastic_strain_lies_below_the_surface_where_the_wheel_strikes(short_pass):
    _, result = short_pass
    peak, force = result.peaks["plastic_strain_nose"], result.peaks["largest_force_nose"]
    assert 0.01 < peak.value < 0.2
    assert abs(peak.x - force.x) < 0.03 and -0.01 < peak.z < 0
    row = result.trust["plastic_flow_nose"]
    assert row["deepest_groove"] > 10e-6
    left = result.metal["nose"]
    assert 0 < left["values"]["worst_1000"] < left["values"]["block"] < peak.value
    assert max(left["surface"]["fall"]) == pytest.approx(row["deepest_groove"])
    assert any(flag["what"] == "no friction" for flag in result.trust["validity"])


def test_its_files_are_read_back_by_results_and_figures(short_pass):
    folder, result = short_pass
    assert load(folder).peaks["plastic_strain_nose"].value == result.peaks["plastic_strain_nose"].value
    pytest.importorskip("meshio")
    fields = read_crossing(folder)
    worst = fields.worst("nose")
    assert fields.plastic_strain[worst] == pytest.approx(result.peaks["plastic_strain_nose"].value)
    assert fields.centre(worst)[0] == pytest.approx(result.peaks["plastic_strain_nose"].x, abs=1e-6)
    with np.load(folder / "plastic.npz") as archive:
        assert archive["nose_peeq"].max() == pytest.approx(fields.plastic_strain[worst], rel=1e-6)
        assert archive["nose_residual_stress"].shape == (*archive["nose_peeq"].shape, 6)


def test_its_stress_is_the_whole_residual_stress(short_pass):
    """Planes along the surface carry no force: zz sums up to nothing over the uppermost cells, where the deviator's
    does not; along and across the metal below the wheel is pressed."""
    folder, result = short_pass
    pytest.importorskip("meshio")
    fields = read_fields(field_file(folder))
    mine = fields.region == REGIONS.index("nose")
    assert np.isfinite(fields.stress[mine]).all()
    with np.load(folder / "plastic.npz") as archive:
        top = np.nan_to_num(archive["nose_residual_stress"][0].astype(float))
    down, across = top[..., 2], top[..., :2].sum(axis=-1)
    assert np.abs(down).max() > 50e6 and abs(down.sum()) < 0.03 * np.abs(down).sum()
    deviator = down - (down + across) / 3
    assert abs(deviator.sum()) > 0.5 * np.abs(deviator).sum()
    left = np.array(result.metal["nose"]["stress"])
    assert np.isfinite(left).all() and (left[:5] < -50e6).all()


class Stop(Exception):
    """In place of a kill."""


class StopsIn:
    """A progress that ends the run once the nose has come so far; 80 mm at 75 mph last 2.4 ms."""

    def __init__(self, share: float) -> None:
        self.share = share

    @contextlib.contextmanager
    def part(self, start, end, name):
        self.name = name
        yield

    def update(self, step, time, end_time) -> None:
        assert time <= end_time == pytest.approx(0.08 / (75 * 0.44704), rel=0.05)
        if "nose" in self.name and time > end_time * self.share:
            raise Stop


REPEATED = {"start": "360 mm", "end": "440 mm", "cell_size": "3 mm", "step": "15 mm", "error_estimate": False}


def test_wheels_one_after_the_other_add_less_and_less_and_a_stop_changes_no_bit(short_pass, tmp_path):
    _, once = short_pass
    settings = {**REPEATED, "passes": 3}
    whole = solve("bem_plastic", once.scene, settings, folder=tmp_path / "whole")
    assert len(whole.passes) == 3
    strain = [report["integral_nose"] for report in whole.passes]
    added = np.diff(strain)
    assert strain[0] == pytest.approx(once.metal["nose"]["values"]["integral"], rel=0.1)  # the wheel is lifted off
    assert strain[0] > added[0] > added[1] > 0
    assert whole.metal["nose"]["values"]["integral"] == pytest.approx(strain[-1])
    assert whole.passes[2]["largest_force_nose"] == whole.passes[0]["largest_force_nose"]
    flags = [row["reason"] for row in whole.trust["validity"] if row["what"] == "repeated wheels"]
    assert any(
        ": shakedown or ratchetting is not told by so few cycles (" in words
        and "the cell to which wheel 3 adds most" in words
        and "do not feel the changed shape" in words
        for words in flags
    )

    with pytest.raises(Stop):
        solve("bem_plastic", once.scene, settings, folder=tmp_path / "cut", progress=StopsIn(0.8))
    went_on = solve("bem_plastic", once.scene, settings, folder=tmp_path / "cut", restart=True)
    assert went_on.passes == whole.passes and went_on.metal == whole.metal
    with np.load(tmp_path / "cut" / "plastic.npz") as ours, np.load(tmp_path / "whole" / "plastic.npz") as theirs:
        assert all(np.array_equal(ours[name], theirs[name], equal_nan=True) for name in theirs)

    kept = tmp_path / "cut" / "restart_nose.npz"
    kept.write_bytes(kept.read_bytes()[:-100])
    with pytest.raises(SealError, match="restart_nose.npz.*begins again"):
        solve("bem_plastic", once.scene, settings, folder=tmp_path / "cut", restart=True)


def test_a_law_over_cycles_goes_to_the_cells_and_one_without_back_stresses_as_its_curve():
    whole = cyclic_steel(210e9, 0.3, 7800, yield_stress=310e6, modulus=[60e9, 8e9], recovery=[600.0, 60.0])
    law = hardening_of(whole, kinematic=False)
    assert isinstance(law, NonlinearKinematic) and law.back_stresses == 2
    np.testing.assert_allclose(law.at(whole.hardening_strain), whole.hardening_stress, rtol=1e-9)
    bare = cyclic_steel(210e9, 0.3, 7800, yield_stress=310e6, hardening=80e6, hardening_rate=20.0)
    curve = hardening_of(bare, kinematic=False)
    assert isinstance(curve, Hardening) and not curve.kinematic and curve.at(np.array(10.0)) == pytest.approx(390e6)


def test_steel_at_rest_is_rolled_over_no_more(short_pass, tmp_path):
    """A tenth of the load on steel of four times the strength: what the first wheel does is all."""
    _, once = short_pass
    scene = once.scene.replace_si(
        vehicle={"vehicle_sprung_mass": 6e3}, materials={"nose": {"grade": "Mn13", "strength": 4}}
    )
    settings = {**REPEATED, "passes": 50}
    result = solve("bem_plastic", scene, settings)
    rows = [row["reason"] for row in result.trust["validity"] if row["what"] == "repeated wheels"]
    assert rows and any("at rest after wheel" in words for words in rows), rows
    assert len(result.passes) == 50


def test_a_sharp_crown_is_flagged(short_pass):
    """The nose's crown of 8 mm radius is a fraction of the zone's depth; a flat of the same flow is not flagged."""
    _, result = short_pass
    row = result.trust["plastic_flow_nose"]
    assert row["surface_fall"] > 0.2 and any(flag["what"] == "corner" for flag in result.trust["validity"])
    peeq = np.zeros((8, 30, 30))
    peeq[:3, 12:17, 12:17] = 0.02
    x = (np.arange(30) + 0.5) * 1e-3
    zeros = np.zeros((8, 30, 30, 6)), np.zeros((30, 30))
    for radius, flagged in ((1e-3 * 3 * 6, False), (1e-3 * 3 * 4, True)):
        flow = Flow(x, x, x[:8], 1e-3, 1e-3, peeq, *zeros, np.full((30, 30), np.inf), [], 3e-3 / (2 * radius))
        assert any(flag["what"] == "corner" for flag in flow_flags("nose", flow)) == flagged


def test_the_fall_of_a_cylinder_is_that_of_its_radius():
    """A pair on a cylinder of 10 depths' radius along the track: 1 / 20."""
    peeq = np.zeros((4, 9, 9))
    peeq[:2, 3:6, 3:6] = 0.01
    x = (np.arange(9) - 4) * 1e-3
    flow = Flow(x, x, x[4:8], 1e-3, 1e-3, peeq, np.zeros((4, 9, 9, 6)), *np.zeros((2, 9, 9)), [])
    rail = lambda x, y: np.sqrt(0.02**2 - np.asarray(y) ** 2) - 0.02 + 0.0 * np.asarray(x)
    pair = ContactPair(np.zeros(3), np.eye(3), None, rail)
    station = Station(0.0, pair, 1.0, (1e-3, 1e-3))
    assert surface_fall(flow, [station]) == pytest.approx(1 / 20, rel=5e-3)
    assert np.isnan(surface_fall(replace(flow, peeq=0 * peeq), [station]))


def test_block_mean_and_integral_are_those_of_the_cells():
    """5 x 5 x 3 cells of 1 mm at 2 %, and half of that in as many below."""
    peeq = np.zeros((8, 30, 30))
    peeq[:3, 12:17, 12:17], peeq[3:6, 12:17, 12:17] = 0.02, 0.01
    x = (np.arange(30) + 0.5) * 1e-3
    flow = Flow(x, x, x[:8], 1e-3, 1e-3, peeq, np.full((8, 30, 30, 6), 2e6), *np.full((2, 30, 30), 2e-5), [])
    left = metal_of(flow, lambda x, y: 0.0 * x)
    assert left["values"]["block"] == pytest.approx(0.02)
    assert left["values"]["integral"] == pytest.approx(0.03 * 75e-9)
    assert left["values"]["worst_100"] == pytest.approx((0.02 * 75 + 0.01 * 25) / 100)
    assert left["block"] == pytest.approx([14.5e-3, 14.5e-3, 0.0])
    assert flow.zone_depth == pytest.approx(6e-3)
    assert np.array(left["stress"])[:4] == pytest.approx(2e6)


def test_bars_are_what_cells_of_twice_the_side_differ_by():
    bars = strain_bars(
        "nose", {"values": {"block": 0.05, "volume_10": 0.0}}, {"values": {"block": 0.03, "volume_10": 0.0}}
    )
    assert bars == {"block_nose": pytest.approx(0.02)}
    assert strain_bars("nose", {"values": {"block": 0.05}}, {}) == {}


def test_leg_and_wing_rail_are_parted_where_their_forces_are():
    """Two zones on the wing body, 10 mm apart, the leg's end between them; an edge nearer to the first."""
    peeq, edge = np.zeros((6, 30, 9)), np.full((30, 9), 9e-3)
    peeq[:2, 4:9, 2:7], peeq[:3, 19:24, 2:7], edge[:10] = 0.03, 0.02, 1e-3
    x = (np.arange(30) + 0.5) * 1e-3
    solved = [SolvedStation(at, 1e-6, pressure, 1e-5) for at, pressure in ((6e-3, 2e9), (21e-3, 1e9))]
    lowered = np.where(x[:, None] < 15e-3, 1e-4, 5e-5) * np.ones(9)
    flow = Flow(x, x[:9], x[:6], 1e-3, 1e-3, peeq, np.zeros((6, 30, 9, 6)), lowered, edge, solved)
    pair = ContactPair(np.zeros(3), np.eye(3), None, lambda x, y: 0.0 * np.asarray(x) + 0.0 * np.asarray(y))
    stations = [Station(0.0, pair, 1.0, (1e-3, 1e-3))]
    leg, wing, nose = parts_between(0.0, 30e-3, 15e-3)
    one, two = flow_in(leg, flow, stations), flow_in(wing, flow, stations)
    assert (one.worst()[0], two.worst()[0]) == (0.03, 0.02)
    assert (one.zone_depth, two.zone_depth) == (pytest.approx(2e-3), pytest.approx(3e-3))
    assert (one.edge_distance, two.edge_distance) == (1e-3, 9e-3)
    assert [piece.stations[0].max_pressure for piece in (one, two)] == [2e9, 1e9]
    left = metal_of(flow, lambda x, y: 0.0 * x)
    apart = [metal_of(piece, lambda x, y: 0.0 * x) for piece in (one, two)]
    for name in ("integral", "volume_1"):
        assert sum(part["values"][name] for part in apart) == pytest.approx(left["values"][name])
    assert [max(part["surface"]["fall"]) for part in apart] == [1e-4, 5e-5]
    bare = replace(flow, peeq=np.where(x[:, None] < 15e-3, 0.0, peeq))
    assert flow_in(leg, bare, stations) is None
    assert [part.name for part in parts_between(20e-3, 30e-3, 15e-3)] == ["wing", "nose"]
    assert (leg.body, wing.body, nose.body) == (0, 0, 1)
