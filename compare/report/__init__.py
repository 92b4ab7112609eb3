"""The report and the terminal: sections, the page of all, the registry of commands."""
