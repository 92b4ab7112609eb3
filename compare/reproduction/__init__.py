"""The paper's scenes and runs, computed here for every question that asks of them."""
