"""The tables of the MLRTA paper (Reshetov, Soupikov and Hurley, SIGGRAPH 2005), anew."""
