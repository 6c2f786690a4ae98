"""Readers of robot files: URDF, MJCF and kinverse's own TOML; use :func:`kinverse.load`."""
