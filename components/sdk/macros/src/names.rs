//! Nearest names, for messages that suggest what was meant.

/// The candidate nearest to `name`, if one is near enough to be a slip of the fingers.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |c: &&str| strsim::damerau_levenshtein(name, c);
    let best = candidates.into_iter().min_by_key(distance)?;
    (distance(&best) <= (name.len() / 3).max(2)).then_some(best)
}

/// "; did you mean `x`?", or nothing.
pub(crate) fn suggestion<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, candidates).map_or_else(String::new, |c| format!("; did you mean `{c}`?"))
}
