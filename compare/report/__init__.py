"""How results are shown: report, pictures, scene files."""
