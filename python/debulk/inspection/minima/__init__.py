"""A pocket judged by its minima: its net laid, settled under the vacuum from several starts, and read for ridges."""
