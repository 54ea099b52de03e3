"""mlrt-bench: MLRT beside Embree on the same rays, in one process, in turns."""
