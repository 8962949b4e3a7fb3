"""What is done with any cloud before it is read: checks, units, marks, cleaning, one origin, a fingerprint."""
