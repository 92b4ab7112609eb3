"""Parameters of scenes and ribbons fitted to what was measured on the bench."""
