"""What paths, contact tables and meshes ask of a crossing, whichever it is: parametric, by its own sections, or either
of them worn.

All have: heights(x, y, body), top_height(x, y, body), wing_section(x), nose_section(x), x_range, plain_x, nose_x,
leg_range, tables.
"""

from geometry.surfaces.worn_crossing import UnwornCrossing, WornCrossing

AnyCrossing = UnwornCrossing | WornCrossing
