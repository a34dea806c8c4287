"""Speed of ConcorDEM beside YADE, LIGGGHTS, and LAMMPS on the same inputs; `validation/speed.py` runs it."""
