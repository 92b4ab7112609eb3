"""The choice of the cheapest model for an accuracy, and the laws of cost and error that it uses."""
