//! Recordings: their format, and running them again.
