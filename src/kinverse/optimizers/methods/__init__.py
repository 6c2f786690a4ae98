"""The population methods, one a file, each readable beside its paper."""
