"""The report: sections, their folder and HTML page, output on the terminal, and the registry of commands."""
