"""
Creep curve: full theory and FASTSIM
====================================

How does the longitudinal force grow with the creepage? The patch is solved once; each creepage is one tangential
problem on it.
"""

from collections.abc import Callable

import matplotlib.pyplot as plt
import numpy as np

from rail_fem import bem

patch = bem.normal_contact(
    lambda x, y: x**2 / 0.92 + y**2 / 0.6,
    bem.STEEL,
    bem.STEEL,
    load=100e3,
    window=((-0.02, 0.02), (-0.02, 0.02)),
    cells=44,
)
friction, creepages = 0.3, np.linspace(0, 6e-3, 13)
methods: dict[str, Callable] = {"full theory": bem.rolling_contact, "FASTSIM": bem.fastsim}

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for name, method in methods.items():
    forces = [
        -method(patch, bem.STEEL, bem.STEEL, friction, bem.Creepage(creepage)).tangential_force[0]
        for creepage in creepages
    ]
    axes.plot(creepages * 100, np.array(forces) / (friction * patch.normal_force), "o-", label=name)
axes.set(xlabel="longitudinal creepage [%]", ylabel="force over friction times load [1]")
axes.legend()
plt.show()
