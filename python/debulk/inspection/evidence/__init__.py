"""What a scan shows before any filter: a sample of its points, squares of pixels, the edge of the ply."""
