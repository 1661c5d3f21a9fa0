"""The case file: how it is read, and whether what it asks for can be run."""
