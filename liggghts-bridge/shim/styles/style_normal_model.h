/* Replaces a generated LIGGGHTS header that libliggghts-dev lacks. Our styles need nothing from it. */
