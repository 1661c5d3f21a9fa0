"""Bodies of revolution that yield, by static finite elements: small strain, J2 with linear isotropic hardening.

Bilinear quadrilaterals in r and z whose change of volume is its mean over the element (B-bar), so that plastic flow
does not lock; Newton's method with the consistent tangent. The return map is written out here: nothing of the boundary
elements' is used. Stress and strain are ordered rr, zz, hoop, rz; strains have the engineering shear.
Sources: Simo and Hughes, Computational Inelasticity (1998), boxes 3.1 and 3.2 and ch. 4 (from memory; held to exact
solutions by tests/versus/test_axisymmetric.py). Error: second order in displacement, first in the stress at a point.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu

from bem.checks import refuse_unless_finite, refuse_unless_positive
from bem.material import Elastic

_MOST_STEPS, _PATIENCE = 30, 8
PARTS = 1, 4, 16  # in which the gap of the next node is closed, more where fewer find no equilibrium
_POINTS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / np.sqrt(3)
_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
_TRACE = np.array([1.0, 1.0, 1.0, 0.0])
_DEVIATOR = np.diag([1.0, 1.0, 1.0, 0.5]) - np.outer(_TRACE, _TRACE) / 3  # of engineering strain, as a tensor


class AxisymmetricError(ValueError):
    """A mesh, material or load that has no answer."""


@dataclass(frozen=True)
class YieldingSteel:
    """elastic constants; yield_stress, slope d(stress)/d(plastic strain) [Pa], slope 0 is perfectly plastic."""

    elastic: Elastic
    yield_stress: float
    slope: float = 0.0

    def __post_init__(self) -> None:
        refuse_unless_positive(AxisymmetricError, **{"yield stress [Pa]": self.yield_stress})
        refuse_unless_finite(AxisymmetricError, **{"slope [Pa]": self.slope})
        if self.slope < 0:
            raise AxisymmetricError(f"slope {self.slope:g} Pa: softening has no answer that is independent of the mesh")


@dataclass(frozen=True)
class Plastic:
    """At the four points of each element: plastic strain (e, 4, 4) with tensor shear, equivalent one (e, 4)."""

    strain: np.ndarray
    equivalent: np.ndarray


@dataclass(frozen=True)
class Answer:
    """Of a displacement: stress (e, 4, 4) [Pa], consistent moduli (e, 4, 4, 4) [Pa], plastic strain after it."""

    stress: np.ndarray
    moduli: np.ndarray
    plastic: Plastic


@dataclass(frozen=True)
class BalancedState:
    """displacement (2m,) [m] r and z by node; nodal force (2m,) [N], over the whole circle; the answer of the steel;
    amplitudes (q,) of the held motions; mismatch of each step of Newton's method."""

    displacement: np.ndarray
    force: np.ndarray
    answer: Answer
    amplitudes: np.ndarray
    mismatch: list[float]


@dataclass(frozen=True)
class HeldMotions:
    """Degrees of freedom (c,) that move as target (c,) + motions (c, q) times amplitudes, which fulfil
    on_force (q, 2m) force + on_amplitude (q, q) amplitudes = 0."""

    dofs: np.ndarray
    target: np.ndarray
    motions: np.ndarray
    on_force: np.ndarray
    on_amplitude: np.ndarray

    @classmethod
    def still(cls, dofs: np.ndarray, total: int) -> HeldMotions:
        """Degrees of freedom that do not move, of `total`."""
        none = np.zeros((len(dofs), 0))
        return cls(dofs, np.zeros(len(dofs)), none, np.zeros((0, total)), np.zeros((0, 0)))


class AxisymmetricBody:
    """nodes (m, 2) r, z [m]; quads (e, 4) counter-clockwise. Errors: AxisymmetricError for folded elements."""

    def __init__(self, nodes: np.ndarray, quads: np.ndarray, steel: YieldingSteel) -> None:
        self.nodes, self.quads, self.steel = np.asarray(nodes, float), np.asarray(quads), steel
        corners = self.nodes[self.quads]
        xi, eta = _POINTS[:, :1], _POINTS[:, 1:]
        shape = (1 + xi * _CORNERS[:, 0]) * (1 + eta * _CORNERS[:, 1]) / 4
        by_xi = _CORNERS[:, 0] * (1 + eta * _CORNERS[:, 1]) / 4
        by_eta = _CORNERS[:, 1] * (1 + xi * _CORNERS[:, 0]) / 4
        jacobian = np.stack([by_xi @ corners, by_eta @ corners], axis=2)  # (e, point, parameter, r z)
        volume = np.linalg.det(jacobian)
        radius = corners[..., 0] @ shape.T
        if volume.min() <= 0 or radius.min() <= 0:
            raise AxisymmetricError(f"{(volume <= 0).any(axis=1).sum()} elements are folded or left of the axis")
        slope = np.linalg.solve(jacobian, np.broadcast_to(np.stack([by_xi, by_eta], axis=1), (*jacobian.shape[:3], 4)))
        self.weight = 2 * np.pi * radius * volume
        b = np.zeros((*radius.shape, 4, 8))
        b[:, :, 0, 0::2], b[:, :, 1, 1::2] = slope[:, :, 0], slope[:, :, 1]
        b[:, :, 2, 0::2] = shape / radius[..., None]
        b[:, :, 3, 0::2], b[:, :, 3, 1::2] = slope[:, :, 1], slope[:, :, 0]
        dilatation = b[:, :, :3].sum(axis=2)
        mean = np.einsum("eg,egi->ei", self.weight, dilatation) / self.weight.sum(axis=1)[:, None]
        b[:, :, :3] += ((mean[:, None] - dilatation) / 3)[:, :, None]
        self._b = b
        self._dofs = (2 * self.quads[:, :, None] + [0, 1]).reshape(-1, 8)
        self._rows, self._columns = np.repeat(self._dofs, 8, axis=1).ravel(), np.tile(self._dofs, 8).ravel()

    @property
    def count(self) -> int:
        """Degrees of freedom."""
        return 2 * len(self.nodes)

    @property
    def points(self) -> np.ndarray:
        """(e, 4, 2) r, z of the points [m]."""
        shape = (1 + _POINTS[:, :1] * _CORNERS[:, 0]) * (1 + _POINTS[:, 1:] * _CORNERS[:, 1]) / 4
        return np.einsum("gk,ekd->egd", shape, self.nodes[self.quads])

    def virgin(self) -> Plastic:
        """No plastic strain."""
        return Plastic(np.zeros((len(self.quads), 4, 4)), np.zeros((len(self.quads), 4)))

    def respond(self, displacement: np.ndarray, before: Plastic) -> Answer:
        """Stress, moduli and plastic strain under a displacement (2m,) [m]. Pure."""
        strain = np.einsum("egij,ej->egi", self._b, displacement[self._dofs])
        elastic, hardening = self.steel.elastic, self.steel.slope
        shear, bulk = elastic.shear, elastic.young / (3 * (1 - 2 * elastic.poisson))
        trial = 2 * shear * (strain @ _DEVIATOR - before.strain)
        size = np.sqrt((trial[..., :3] ** 2).sum(axis=-1) + 2 * trial[..., 3] ** 2)
        excess = np.sqrt(1.5) * size - (self.steel.yield_stress + hardening * before.equivalent)
        growth = np.maximum(excess, 0) / (3 * shear + hardening)
        direction = trial / np.maximum(size, 1e-300)[..., None]
        flow = np.sqrt(1.5) * growth[..., None] * direction
        volume = strain[..., :3].sum(axis=-1)
        stress = trial - 2 * shear * flow + (bulk * volume)[..., None] * _TRACE
        theta = 1 - 2 * shear * np.sqrt(1.5) * growth / np.maximum(size, 1e-300)
        across = np.where(growth > 0, 1 / (1 + hardening / (3 * shear)) - (1 - theta), 0.0)
        moduli = bulk * np.outer(_TRACE, _TRACE) + 2 * shear * theta[..., None, None] * _DEVIATOR
        moduli = moduli - 2 * shear * across[..., None, None] * direction[..., :, None] * direction[..., None, :]
        return Answer(stress, moduli, Plastic(before.strain + flow, before.equivalent + growth))

    def force(self, stress: np.ndarray) -> np.ndarray:
        """Nodal forces (2m,) [N] that hold a stress (e, 4, 4) [Pa]."""
        each = np.einsum("eg,egij,egi->ej", self.weight, self._b, stress)
        return np.bincount(self._dofs.ravel(), each.ravel(), self.count)

    def stiffness(self, moduli: np.ndarray) -> csc_matrix:
        """(2m, 2m) [N/m] of moduli (e, 4, 4, 4) [Pa]."""
        weighted = self.weight[..., None, None] * moduli
        each = (np.swapaxes(self._b, 2, 3) @ (weighted @ self._b)).sum(axis=1)
        return coo_matrix((each.ravel(), (self._rows, self._columns)), shape=(self.count, self.count)).tocsc()

    def equilibrium(
        self,
        held: HeldMotions,
        start: np.ndarray,
        before: Plastic,
        load: np.ndarray | float = 0.0,
        tolerance: float = 1e-8,
    ) -> BalancedState:
        """Balance with forces `load` (2m,) [N] from a displacement (2m,) to start with; nothing is kept.

        tolerance : largest force that is not balanced, over the largest there is. Raises AxisymmetricError when none is
        found.
        """
        free = np.setdiff1d(np.arange(self.count), held.dofs)
        u, s, mismatch = start.copy(), np.zeros(held.motions.shape[1]), []
        for step in range(_MOST_STEPS):
            answer = self.respond(u, before)
            inner = self.force(answer.stress)
            residual = inner - load
            off = held.target + held.motions @ s - u[held.dofs]
            scale = max(np.abs(inner).max(), np.abs(load).max(), 1e-300)
            lacking = held.on_force @ residual + held.on_amplitude @ s
            mismatch.append(float(max(np.abs(residual[free]).max(), np.abs(lacking).max(initial=0.0)) / scale))
            if step and mismatch[-1] <= tolerance and np.abs(off).max() <= 1e-12 * np.abs(u).max():
                return BalancedState(u, residual, answer, s, mismatch)
            if not np.isfinite(mismatch[-1]) or min(mismatch[-_PATIENCE:]) > 0.5 and step >= _PATIENCE:
                break
            stiff = self.stiffness(answer.moduli)
            columns = np.column_stack([off, held.motions])
            right = -(stiff[:, held.dofs] @ columns)
            right[:, 0] -= residual
            factor = splu(stiff[free][:, free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
            change = np.zeros((self.count, columns.shape[1]))
            change[free], change[held.dofs] = factor.solve(np.ascontiguousarray(right[free])), columns
            if len(s):
                by = held.on_force @ (stiff @ change)
                ds = np.linalg.solve(by[:, 1:] + held.on_amplitude, -(lacking + by[:, 0]))
                s, u = s + ds, u + change[:, 0] + change[:, 1:] @ ds
            else:
                u = u + change[:, 0]
        shown = " ".join(f"{value:.1e}" for value in mismatch[-5:])
        raise AxisymmetricError(f"no equilibrium in {len(mismatch)} steps (mismatch ... {shown}): take smaller loads")


def lined_block(line: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Distance and depth (n^2,) [m] of the nodes of a block with a line (n,) of them each way, their numbers (n, n) and
    quads (e, 4), depth counted down."""
    across, depth = (values.ravel() for values in np.meshgrid(line, line, indexing="ij"))
    at = np.arange(len(line) ** 2).reshape(len(line), -1)
    quads = np.stack([at[:-1, 1:], at[1:, 1:], at[1:, :-1], at[:-1, :-1]], axis=-1).reshape(-1, 4)
    return across, depth, at, quads


def press_by_nodes(
    body: AxisymmetricBody,
    surface: np.ndarray,
    height: np.ndarray,
    still: np.ndarray,
    across: int,
    outer: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[BalancedState]:
    """A rigid body pressed into a surface: the contact grows by one node at a time, 1 to `across`. Each load is the one
    at which the next node just touches and carries nothing, so that the contact's size is known without interpolation.

    surface (n,) : degrees of freedom along z of its nodes;  height (n,) [m] of the rigid body above its lowest point;
    still (c,) : degrees of freedom that do not move;  outer : those (o,) that move with the load, and by how much (o,)
        [m/N]; the second amplitude is then the load [N], the first always the approach [m]
    Raises AxisymmetricError where there is no equilibrium, or a node within pulls.
    """
    none, q = np.zeros(body.count), 1 if outer is None else 2
    far_dofs, far = (np.zeros(0, int), np.zeros(0)) if outer is None else outer
    state = BalancedState(none, none, body.respond(none, body.virgin()), np.zeros(q), [])
    for k in range(1, across + 1):
        inside = surface[: k + 1]
        dofs = np.r_[still, far_dofs, inside]
        motions, on_force = np.zeros((len(dofs), q)), np.zeros((q, body.count))
        motions[-(k + 1) :, 0] = -1.0
        on_force[0, inside[-1]] = 1.0  # the last node carries nothing
        if outer is not None:
            motions[len(still) : len(still) + len(far), 1], on_force[1, inside] = far, 1.0
        opening = height[k] - state.amplitudes[0] - state.displacement[surface[k]]
        for parts in PARTS:
            found = state
            try:
                for part in range(1, parts + 1):
                    target = np.r_[np.zeros(len(dofs) - k - 1), height[: k + 1]]
                    target[-1] -= (1 - part / parts) * opening
                    held = HeldMotions(dofs, target, motions, on_force, np.diag([0.0, 1.0][:q]))
                    found = body.equilibrium(held, found.displacement, found.answer.plastic)
                break
            except AxisymmetricError:
                if parts == PARTS[-1]:
                    raise
        state = found
        force = -state.force[inside[:-1]]
        if force.min() < -1e-6 * force.max():
            raise AxisymmetricError(f"a node within pulls ({force.min():.3g} N) after {k} of {across}")
        yield state
