"""Everything that knows USD. `pxr` is imported in this package and nowhere else."""
