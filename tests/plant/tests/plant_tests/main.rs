//! Test files with `plant = …`: what they do to a plant, what they tell, and what is said of their mistakes.

mod mistakes;
mod quality;
mod runs;
mod support;
