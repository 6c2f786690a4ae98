"""What the bench measures: each section makes its lines, one noun a file."""
