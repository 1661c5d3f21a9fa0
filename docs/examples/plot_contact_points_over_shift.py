"""
Contact points against the lateral shift
========================================

A wheelset with S1002 wheels on 60E1 rails, 1:40, is shifted by up to 8 mm to each side. Where do its wheels touch?
"""

import matplotlib.pyplot as plt
import numpy as np

from rail_fem import geometry

search = geometry.ContactSearch(
    geometry.Wheelset(geometry.wheel_profile("S1002"), radius=0.46), geometry.Track(geometry.rail_head("60E1", 1 / 40))
)
shifts = np.linspace(-8e-3, 8e-3, 81)
states = [search.settle(shift) for shift in shifts]
points = {side: [search.contacts(state, side).lowest() for state in states] for side in ("left", "right")}

# %%
# Jumps of the contact point show in the rolling radius difference, which steers the wheelset.
figure, (above, below) = plt.subplots(2, 1, figsize=(6, 6), sharex=True, layout="constrained")
for side in points:
    above.plot(shifts * 1e3, [point.rail_station[0] * 1e3 for point in points[side]], ".", label=f"{side} rail")
above.set(ylabel="contact on the rail head y [mm]")
above.legend()
difference = [
    left.rolling_radius[0] - right.rolling_radius[0]
    for left, right in zip(points["left"], points["right"], strict=True)
]
below.plot(shifts * 1e3, np.array(difference) * 1e3, color="black")
below.set(xlabel="lateral shift [mm]", ylabel="rolling radius difference [mm]")
plt.show()
