"""What ``Swarm`` is made of: the objective, the searches, the descents from their members."""
