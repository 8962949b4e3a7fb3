"""Readers and writers of point clouds, one file format a module. Use :mod:`debulk.files`."""
