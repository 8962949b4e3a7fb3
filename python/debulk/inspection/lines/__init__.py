"""A pocket judged by its fibre lines: by their excess, and by the bridges of those that are too short."""
