"""The paper's scenes, named runs, diagrams, figures and claims; nothing else imports this folder."""
