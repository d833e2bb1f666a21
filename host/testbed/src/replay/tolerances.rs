//! Deviations that do not count, by globs of output tags.

use globset::{Glob, GlobMatcher};

/// Tolerances, checked.
#[derive(Clone, Debug, Default)]
pub struct Tolerances(Vec<(GlobMatcher, f64)>);

/// Why a tolerance is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ToleranceError(String);

impl Tolerances {
    /// Tags or globs of them, each with the largest deviation, in the port's own unit, that does not count.
    pub fn new<'a>(wanted: impl IntoIterator<Item = (&'a str, f64)>) -> Result<Self, ToleranceError> {
        let matcher = |(tag, within): (&str, f64)| {
            if !(within.is_finite() && within >= 0.0) {
                let sentence =
                    format!("the tolerance of {tag} is {within}; expected a number from 0 on, as in {tag}=1e-6");
                return Err(ToleranceError(sentence));
            }
            match Glob::new(tag) {
                Ok(glob) => Ok((glob.compile_matcher(), within)),
                Err(e) => Err(ToleranceError(format!(
                    "\"{tag}\" is not a glob of tags: {e}; use * and ?, as in \"unit.outputs.*\""
                ))),
            }
        };
        wanted.into_iter().map(matcher).collect::<Result<_, _>>().map(Self)
    }

    /// The largest tolerance that names an output of a block.
    pub fn of(&self, block: &str, output: &str) -> Option<f64> {
        let tag = format!("{block}.outputs.{output}");
        self.0.iter().filter(|(glob, _)| glob.is_match(&tag)).map(|(_, within)| *within).reduce(f64::max)
    }
}
