"""Output of results: plots, tables, films, surfaces, VTU, HTML pages; each imported when it is called."""
