"""The parts of the ply that were not seen, and what they may hide."""
