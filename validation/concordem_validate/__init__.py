"""One scenario, every code, one verdict: ConcorDEM against YADE, LIGGGHTS, and closed forms."""
