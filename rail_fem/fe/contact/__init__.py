"""Penalty contact between two surfaces of a structure: who lies over whom, pressures, friction, forces of a step."""
