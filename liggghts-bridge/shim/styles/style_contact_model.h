/* Not in libliggghts-dev; LIGGGHTS generates it. No style of ours needs what it lists. */
