"""The results that README.md shows, drawn from the figures that are kept."""
