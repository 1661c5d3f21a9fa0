"""
Results in dolfinx, and one's own form on them
==============================================

A run becomes a dolfinx mesh with tags for bodies and surfaces, and Functions for displacement, stress and plastic
strain. Two questions that the program does not answer by itself are then a line of UFL each: how much of the nose has
yielded beyond some strain, and what axial force and bending moment its sections carry at the end of the run, here with
the wheel still on it.
"""

import matplotlib.pyplot as plt
import numpy as np
import ufl
from mpi4py import MPI
from coarse_pass import coarse_pass
from dolfinx import fem

import rail_fem

folder = coarse_pass()  # or the folder of your run: "runs/nose_transfer"
run = rail_fem.export_dolfinx(folder, MPI.COMM_WORLD)
dx = ufl.Measure("dx", domain=run.mesh, subdomain_data=run.cell_tags)
ds = ufl.Measure("ds", domain=run.mesh, subdomain_data=run.facet_tags)


def integral(form):
    return run.mesh.comm.allreduce(fem.assemble_scalar(fem.form(form)))


# %%
# The volume of the nose beyond a plastic strain. The form is compiled once; only its constant changes.
level = fem.Constant(run.mesh, 0.0)
beyond = fem.form(ufl.conditional(ufl.gt(run.plastic_strain, level), 1.0, 0.0) * dx(run.cell("nose")))
levels = np.linspace(0, 0.03, 31)
volumes = []
for value in levels:
    level.value = value
    volumes.append(run.mesh.comm.allreduce(fem.assemble_scalar(beyond)))
print(f"nose beyond 1 %: {1e9 * volumes[10]:.0f} mm3, yielded at all: {1e9 * volumes[0]:.0f} mm3")
one = fem.Constant(run.mesh, 1.0)
print(f"contact surface of the nose: {1e6 * integral(one * ds(run.facet('nose contact'))):.0f} mm2")

# %%
# Stress resultants of the nose's sections: axial force, and bending moment about the line z = 0 (positive with tension
# above it), as means over slabs of 10 mm.
x, z = ufl.SpatialCoordinate(run.mesh)[0], ufl.SpatialCoordinate(run.mesh)[2]
low, width = fem.Constant(run.mesh, 0.0), 0.010
slab = ufl.conditional(ufl.And(ufl.ge(x, low), ufl.lt(x, low + width)), 1.0 / width, 0.0)
force_form = fem.form(slab * run.stress[0, 0] * dx(run.cell("nose")))
moment_form = fem.form(slab * run.stress[0, 0] * z * dx(run.cell("nose")))
starts = np.arange(0.335, 0.375, width)
forces, moments = [], []
for start in starts:
    low.value = start
    forces.append(run.mesh.comm.allreduce(fem.assemble_scalar(force_form)))
    moments.append(run.mesh.comm.allreduce(fem.assemble_scalar(moment_form)))

# %%
middles = 1e3 * (starts + width / 2)
figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.8), layout="constrained")
left.plot(100 * levels, 1e9 * np.array(volumes))
left.set(xlabel="plastic strain (PEEQ) [%]", ylabel="volume of the nose beyond it [mm³]")
middle.plot(middles, np.array(forces) / 1e3, "o-")
middle.set(xlabel="position along the nose x [mm]", ylabel="axial force, tension positive [kN]")
right.plot(middles, moments, "s-")
right.set(xlabel="position along the nose x [mm]", ylabel="bending moment about z = 0 [N m]")
for axes in (left, middle, right):
    axes.set_ylim(min(0, axes.get_ylim()[0]), max(0, axes.get_ylim()[1]))
plt.show()
