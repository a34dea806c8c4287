/* Replaces a generated LIGGGHTS header that libliggghts-dev lacks: the rolling models that act beside ours. */
#ifndef ROLLING_MODEL
#include "global_properties.h"   // LIGGGHTS' list of normal models includes it, ours is empty
#endif
#include "rolling_model_cdt.h"
#include "rolling_model_epsd.h"
#include "rolling_model_epsd2.h"
#include "rolling_model_epsd3.h"
#include "rolling_model_luding.h"
