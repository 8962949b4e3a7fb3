"""Whether scan, reference, pose, outline and recipe belong together."""
