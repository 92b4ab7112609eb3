"""The paper: its scenes, named runs, diagrams, figures and claims; nothing else imports it."""
