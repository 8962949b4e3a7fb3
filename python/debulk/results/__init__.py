"""Report and comparison as plain data, as JSON and as text. Nothing in here depends on pages or inspectors."""
