"""The source documents, run again: their tables with our figures beside the printed ones."""
