"""From a scan to its pockets: through regions of interest, or in the whole scan."""
