"""Studies: commands that show what a part can do, with a table and a figure each."""
