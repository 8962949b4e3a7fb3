"""The cloud below the ply, prepared once: the surface fitted to it, its frame and its resolution."""
