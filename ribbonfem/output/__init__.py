"""What becomes of a result: plots, tables, films, surfaces, VTU, pages; imported when it is called."""
