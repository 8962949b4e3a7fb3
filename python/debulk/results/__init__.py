"""Report and comparison as plain data, as JSON and as text. What stands here knows nothing of pages or inspectors."""
