"""Profile files as they are written: one reader a format, all giving a RawProfile."""
