"""Fields of all ranks on root, in the numbering of the input mesh, for tests."""

import numpy as np

from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.fields import cell_rows


def gather_rows(comm, index: np.ndarray, rows: np.ndarray, total: int) -> np.ndarray | None:
    """Rows (k, m) of all ranks put at their global index (total, m). Root only, others get None. Collective."""
    parts = comm.gather((index, rows), root=0)
    if comm.rank != 0:
        return None
    out = np.full((total, *rows.shape[1:]), np.nan)
    for where, values in parts:
        out[where] = values
    return out


def gather_nodes(domain: Domain, field: np.ndarray) -> np.ndarray | None:
    """Nodal vector (3 n_nodes,) -> (n_global, 3) by input node. Root only. Collective."""
    owned = domain.n_owned
    return gather_rows(domain.comm, domain.node_input[:owned], field.reshape(-1, 3)[:owned], domain.n_global)


def gather_cells(dynamics: Dynamics) -> np.ndarray | None:
    """Stress (6), plastic strain of every cell (m_global, 7) in input order. Root only. Collective."""
    domain = dynamics.domain
    return gather_rows(domain.comm, domain.cell_input, cell_rows(dynamics), domain.m_global)
