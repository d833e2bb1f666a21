//! Component tests: cases, steps, what is expected.
