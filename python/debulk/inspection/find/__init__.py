"""From a scan to its pockets."""
