"""The benchmark: kinverse and its peers on the same poses, judged by a plain NumPy oracle.

``make bench`` installs the peers in an environment of their own and runs ``python -m
kinverse.bench``; ``--quick`` is a glance, ``--section`` picks. Every figure is a median with the
range of its rounds, on one thread.
"""
