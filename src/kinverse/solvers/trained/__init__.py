"""What the learned solvers are made of: examples, experts, descents and files."""
