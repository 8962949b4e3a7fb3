"""From a scan to its report: the inspector, what finds pockets, and what evaluates one."""
