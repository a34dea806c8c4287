//! Tests of ConcorDEM by behaviour; one file per question, fixtures in `scenarios/` and `golden/`.
