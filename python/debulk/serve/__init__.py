"""The service of a cell: scans in and verdicts out over HTTP and OPC UA, and a page for the operator's screen."""
