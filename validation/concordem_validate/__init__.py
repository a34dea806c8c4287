"""Runs one scenario in several codes and compares ConcorDEM with YADE, LIGGGHTS, LAMMPS, ESyS-Particle, and analytical solutions."""
