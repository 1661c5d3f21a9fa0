"""What a run leaves: result, history, events, reported quantities and their bars, fields, folder, versions."""
