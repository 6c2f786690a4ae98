"""What ``kinverse.paths.track`` is made of: samples, their layers, the search, its gaps."""
