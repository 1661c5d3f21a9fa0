"""Processes: an end by a signal, several ranks, tasks dealt out, and how far each is."""
