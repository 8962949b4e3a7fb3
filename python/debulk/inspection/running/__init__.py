"""The clock of an inspection and of its preparation: stages, deadline, stops, and what a recipe costs."""
