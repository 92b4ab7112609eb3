"""Commands about a scene or the models: one a file."""
