"""The cheapest model that will do, and the laws by which it is chosen."""
