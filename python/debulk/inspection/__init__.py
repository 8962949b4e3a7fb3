"""From a scan to its report: the inspector, what finds pockets, what evaluates one, and replays of its solves."""
