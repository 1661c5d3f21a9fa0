"""Shapes and kinematics of wheel and rail: profiles, crossing, wheel path, meshes. Axes and signs: geometry.axes."""
