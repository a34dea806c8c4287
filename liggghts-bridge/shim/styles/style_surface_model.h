/* Not in libliggghts-dev; LIGGGHTS generates it. The default surface is all that our styles use. */
#ifdef SURFACE_MODEL
SURFACE_MODEL(SURFACE_DEFAULT, default, 0)
#endif
