"""How element state and materials lie in memory, shared by the kernels, the solver and the output.

Elements of one material stand in blocks of LANES. A state array is flat, (n_blocks * N_STATE * LANES,): block, entry,
lane.
"""

LANES = 32
# entries of the element state
STRESS = 0  # 6, order VOIGT [Pa]
PLASTIC_STRAIN = 6  # cumulated equivalent plastic strain [1]
YIELD = 7  # yield stress at that plastic strain [Pa]
HOURGLASS = 8  # generalised hourglass forces, 4 modes x 3 components, divided by 8 [N]
N_STATE = 20
# the fully integrated element: at each of its points the first POINT_STATE of these, point by point
POINTS, POINT_STATE = 8, 8
N_STATE_FULL = POINTS * POINT_STATE
# columns of the material table
LAME, SHEAR, DENSITY, SPEED, LINEAR_VISCOSITY, QUADRATIC_VISCOSITY, HOURGLASS_STIFFNESS, LAW, LEAST_LENGTH = range(9)
YIELD_STRESS, HARDENING, HARDENING_RATE = 9, 10, 11  # of a law over cycles
N_MATERIAL = 12
ISOTROPIC, KINEMATIC, CYCLIC = range(3)  # return laws: what LAW says
# works that a step adds up [J]
PLASTIC_WORK, HOURGLASS_WORK, VISCOUS_WORK = range(3)
N_WORK = 3
