/* Replaces a generated LIGGGHTS header that libliggghts-dev lacks: the cohesion models that act beside ours. */
#include "cohesion_model_sjkr.h"
#include "cohesion_model_sjkr2.h"
#include "cohesion_model_washino_capillary_viscous.h"
#include "cohesion_model_easo_capillary_viscous.h"
