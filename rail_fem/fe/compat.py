"""The only file that knows which dolfinx is installed (0.5 on Debian 12, 0.9 on Debian 13, 0.11 from the package
index): by feature, not by version.

It alone imports dolfinx, in an empty folder: PETSc, dolfinx's compiler of forms and ffcx read settings from the current
folder when they begin, and these may load a library. mpi4py.MPI is imported before: the package index's dolfinx finds
its MPI library by that alone.
"""

from __future__ import annotations

import contextlib
import inspect
import tempfile

import mpi4py.MPI  # noqa: F401
import numpy as np
from scipy import sparse

from rail_fem.fe.heap import give_back_large_arrays

with tempfile.TemporaryDirectory() as _empty, contextlib.chdir(_empty):
    import basix
    import ffcx
    import ufl
    from dolfinx import cpp, fem, graph, io, jit
    from dolfinx import mesh as dmesh

    try:
        from dolfinx.fem import petsc  # noqa: F401
    except ImportError:  # a dolfinx without PETSc
        petsc = None
    try:
        from petsc4py import PETSc
        from slepc4py import SLEPc
    except ImportError:  # of the package index
        PETSc = SLEPc = None
    try:
        import basix.ufl

        elements = basix.ufl
    except ImportError:  # of 0.5, whose elements are ufl's
        elements = None
    for _compiler in (jit, ffcx):
        (getattr(_compiler, "get_options", None) or _compiler.get_parameters)()  # kept from the first call on
give_back_large_arrays()


def coordinate_element(shape: str, degree: int, dimension: int):
    """Of a mesh of such cells, "triangle", "quadrilateral" or "hexahedron", as `create_mesh` wants it."""
    if elements is not None:
        return elements.element("Lagrange", shape, degree, shape=(dimension,))
    return ufl.Mesh(ufl.VectorElement("Lagrange", ufl.Cell(shape, geometric_dimension=dimension), degree))


def create_mesh(comm, cells: np.ndarray, points: np.ndarray, domain, *rest):
    """dolfinx's create_mesh of points (n, d) [m]; 0.11 takes coordinate element and points in the other order."""
    names = list(inspect.signature(dmesh.create_mesh).parameters)
    ordered = (points, domain) if names.index("x") == 2 else (domain, points)
    return dmesh.create_mesh(comm, cells, *ordered, *rest)


def create_hexahedral_mesh(comm, cells: np.ndarray, points: np.ndarray, destination: np.ndarray):
    """A dolfinx mesh without ghost cells from arrays on root; cells (m, 8) in dolfinx order, destination (m,) rank of
    each cell."""
    domain = coordinate_element("hexahedron", 1, 3)
    # 0.5 finds shared nodes through ghost cells, then drops those
    ghosts_first = hasattr(domain, "ufl_coordinate_element")
    make_list = getattr(graph, "adjacencylist", None) or graph.create_adjacencylist
    ranks, offsets = (
        with_neighbours(cells, destination) if ghosts_first else (destination, np.arange(len(destination) + 1))
    )

    def partitioner(*_):
        dest = make_list(np.asarray(ranks, dtype=np.int32), np.asarray(offsets, dtype=np.int32))
        return getattr(dest, "_cpp_object", dest)

    if ghosts_first:
        return create_mesh(comm, cells, points, domain, dmesh.GhostMode.none, partitioner)
    return create_mesh(comm, cells, points, domain, partitioner)


def with_neighbours(cells: np.ndarray, destination: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ranks of each cell: its owner first, then every rank that owns a cell with a common node; as data and offsets of
    a list."""
    if len(cells) == 0:
        return np.empty(0, np.int32), np.zeros(1, np.int32)
    rows, nodes = np.repeat(np.arange(len(cells)), 8), cells.ravel()
    incidence = sparse.csr_array((np.ones(rows.size, np.int32), (rows, nodes)))
    owns = sparse.csr_array((np.ones(len(cells), np.int32), (np.arange(len(cells)), destination)))
    near = (incidence @ (incidence.T @ owns)).tocoo()
    other = near.col != destination[near.row]
    cell = np.concatenate([np.arange(len(cells)), near.row[other]])
    rank = np.concatenate([destination, near.col[other]])
    order = np.argsort(cell, kind="stable")
    return rank[order], np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=len(cells)))])


def geometry_dofmap(mesh) -> np.ndarray:
    """Nodes of the local cells (m, 8), dolfinx order; rank-local."""
    several = getattr(mesh.geometry, "dofmaps", None)  # a list from 0.11 on, one for each kind of cell
    dofmap = several[0] if isinstance(several, (list, tuple)) else mesh.geometry.dofmap
    if hasattr(dofmap, "array"):
        return np.asarray(dofmap.array).reshape(-1, 8)
    return np.asarray(dofmap)


def function_space(mesh, element):
    return fem.functionspace(mesh, element) if hasattr(fem, "functionspace") else fem.FunctionSpace(mesh, element)


def original_cells(mesh) -> np.ndarray:
    """Index that each local cell had in the input of `create_mesh`; rank-local."""
    return np.asarray(mesh.topology.original_cell_index)


def plane_mesh(comm, cells: np.ndarray, points: np.ndarray, shape: str, degree: int):
    """A mesh of plane cells (m, k) in dolfinx order with nodes (n, 2) [m], on one rank; shape "triangle" or
    "quadrilateral", its sides of a degree."""
    return create_mesh(comm, cells, points, coordinate_element(shape, degree, 2))


def lagrange_vectors(mesh, degree: int):
    """The space of continuous displacements of a degree, as many components as the mesh has coordinates."""
    dimension = mesh.geometry.dim
    if elements is not None:
        element = elements.element("Lagrange", mesh.basix_cell(), degree, shape=(dimension,))
    else:
        element = ufl.VectorElement("Lagrange", mesh.ufl_cell(), degree, dim=dimension)
    return function_space(mesh, element)


def vectors_at_points(mesh, degree: int, count: int):
    """The space of `count` numbers at each Gauss point of the rule of a degree, and these points (p, d) of a cell."""
    if elements is not None:
        cell = mesh.basix_cell()
        element = elements.quadrature_element(cell, value_shape=(count,), degree=degree)
    else:
        cell = basix.cell.string_to_type(mesh.ufl_cell().cellname())
        element = ufl.VectorElement("Quadrature", mesh.ufl_cell(), degree, dim=count, quad_scheme="default")
    return function_space(mesh, element), basix.make_quadrature(cell, degree)[0]


def evaluate(expression, mesh, cells: np.ndarray) -> np.ndarray:
    """Values of a fem.Expression in cells, as a flat array: cell by cell, point by point."""
    try:
        return np.asarray(expression.eval(mesh, cells)).ravel()
    except TypeError:
        return np.asarray(expression.eval(cells)).ravel()


def create_shared_mesh(comm, cells: np.ndarray, points: np.ndarray):
    """A dolfinx mesh for forms and files, partitioned by dolfinx, with ghost cells across shared facets; arrays on
    root, cells (m, 8) in dolfinx order."""
    domain, mode = coordinate_element("hexahedron", 1, 3), dmesh.GhostMode.shared_facet
    if hasattr(domain, "ufl_coordinate_element"):
        return create_mesh(comm, cells, points, domain, mode)
    try:
        partitioner = dmesh.create_cell_partitioner(mode)
    except TypeError:  # 0.11 asks how many cells may share a facet
        partitioner = dmesh.create_cell_partitioner(mode, 2)
    return create_mesh(comm, cells, points, domain, partitioner)


def facet_nodes(mesh, facets: np.ndarray) -> np.ndarray:
    """Geometry nodes (k, 4) of quadrilateral facets (k,) of a hexahedral mesh; rank-local."""
    facets = np.asarray(facets, np.int32)
    mesh.topology.create_connectivity(2, 3)
    if hasattr(dmesh, "entities_to_geometry"):
        nodes = dmesh.entities_to_geometry(mesh, 2, facets)
    else:
        nodes = cpp.mesh.entities_to_geometry(mesh._mesh, 2, facets, False)
    return np.asarray(nodes).reshape(-1, 4)


def discontinuous(mesh, degree: int = 0, shape: tuple[int, ...] = ()):
    """The space of polynomials of a degree in each cell (0: constants): scalars, or of a shape such as (3, 3)."""
    if elements is not None:
        element = elements.element("DG", mesh.basix_cell(), degree, shape=shape)
    else:
        cell = mesh.ufl_cell()
        element = ufl.TensorElement("DG", cell, degree, shape=shape) if shape else ufl.FiniteElement("DG", cell, degree)
    return function_space(mesh, element)


def cell_dofs(space) -> np.ndarray:
    """Degrees of freedom of each local cell (m, n), blocks counted once; rank-local."""
    dofs = space.dofmap.list
    return np.asarray(dofs.array).reshape(dofs.num_nodes, -1) if hasattr(dofs, "array") else np.asarray(dofs)


def write_tags(file, mesh, tags) -> None:
    """Mesh tags into an open XDMFFile. Collective."""
    try:
        file.write_meshtags(tags, mesh.geometry)
    except TypeError:
        file.write_meshtags(tags)


def vtx_writer():
    """dolfinx's writer of VTX (.bp) files; None where dolfinx was built without ADIOS2."""
    return getattr(io, "VTXWriter", None) if getattr(cpp.common, "has_adios2", False) else None
