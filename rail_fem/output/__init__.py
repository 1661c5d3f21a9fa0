"""What a run leaves: result, history, events, folder, status, versions."""
