"""The largest stable step of central differences: by Lanczos on the assembled operator, and an element-wise bound."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rail_fem.fe.structure import Structure

# of Lanczos' start vector: a few nodes a wave, oblique to every mesh line [1/m]
START_WAVE = np.array([1.7e3, 2.3e3, 2.9e3])


def largest_frequency(structure: Structure, free: np.ndarray, iterations: int = 24) -> float:
    """Largest angular frequency sqrt(lambda_max(M^-1 K)) [rad/s] of the bodies with the unknowns `free` (3 n_nodes,
    bool).

    Lanczos without reorthogonalisation in the mass inner product: a lower bound that is within 1 % after 24 iterations
    (tests/fe/test_stable_step.py). The start vector depends on the positions of nodes only, so it is the same on any
    number of ranks, and on meshes that differ far from their smallest elements. Collective.
    """
    domain, comm = structure.domain, structure.domain.comm
    owned = 3 * domain.n_owned
    mass = np.repeat(structure.mass, 3)
    phase = domain.reference.reshape(-1, 3) @ START_WAVE
    q = np.where(free, np.sin(np.repeat(phase, 3) + np.tile([0.0, 2.0, 4.0], domain.n_nodes)), 0.0)

    def product(a, b):
        return comm.allreduce(float(a[:owned] @ (mass[:owned] * b[:owned])), op=MPI.SUM)

    q /= np.sqrt(product(q, q))
    before, beta, alphas, betas = np.zeros_like(q), 0.0, [], []
    for _ in range(iterations):
        w = np.where(free, structure.stiffness_times(q) / mass, 0.0)
        alpha = product(w, q)
        w -= alpha * q + beta * before
        alphas.append(alpha)
        beta = np.sqrt(product(w, w))
        betas.append(beta)
        if beta <= 1e-12 * abs(alpha):
            break
        before, q = q, w / beta
    n = len(alphas)
    tridiagonal = np.diag(alphas) + np.diag(betas[: n - 1], 1) + np.diag(betas[: n - 1], -1)
    return float(np.sqrt(np.linalg.eigvalsh(tridiagonal)[-1]))


def damped_limit(frequency: float, damping_ratio: float) -> float:
    """Stable step [s] of central differences with lagged velocity damping: 2/w (sqrt(1 + z^2) - z) (Belytschko et al.,
    2014, eq. 6.2.9).

    Bulk viscosity of coefficient z damps a mode that also widens by up to M / K more than z: the true limit was 1 to 2
    % below this one at z = 0.06, 5 % at 0.2 (tests/fe/test_stable_step.py keeps 3 % distance); quadratic viscosity adds
    to that.
    """
    return 2.0 / frequency * (np.sqrt(1.0 + damping_ratio**2) - damping_ratio)


def round_down(step: float, digits: int = 3) -> float:
    """A step of few digits, so that round-off between numbers of ranks does not change it."""
    scale = 10.0 ** (np.floor(np.log10(step)) - digits + 1)
    return float(np.floor(step / scale * (1 + 1e-9)) * scale)
