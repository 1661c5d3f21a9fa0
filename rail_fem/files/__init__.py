"""Files that are whole or not there: written beside and renamed, sealed, locked, laid out for many writers."""
