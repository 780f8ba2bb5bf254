"""What a scene calls for: its picture with the measured table, with models, and with no more of a model than it shows."""
