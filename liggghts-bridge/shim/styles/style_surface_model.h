/* Replaces a generated LIGGGHTS header that libliggghts-dev lacks: the surface models that act beside ours. */
#include "surface_model_default.h"
