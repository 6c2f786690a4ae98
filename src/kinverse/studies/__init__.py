"""Studies of the source documents: their methods rebuilt, their claims measured."""
