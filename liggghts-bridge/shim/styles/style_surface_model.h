/* Replaces a generated LIGGGHTS header that libliggghts-dev lacks. Our styles need only the default surface model. */
#ifdef SURFACE_MODEL
SURFACE_MODEL(SURFACE_DEFAULT, default, 0)
#endif
