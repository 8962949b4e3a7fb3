"""Report and comparison as HTML pages, each a self-contained file."""
