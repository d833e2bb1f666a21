//! Names: the nearest of those that exist, and WIT's kebab case in other languages.

use heck::{ToLowerCamelCase, ToShoutySnakeCase, ToSnakeCase, ToUpperCamelCase};

/// The name that was probably meant.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |k: &&str| strsim::damerau_levenshtein(name, k);
    let best = known.into_iter().min_by_key(distance).filter(|_| !name.is_empty())?;
    (distance(&best) <= 2.max(name.len() / 3)).then_some(best)
}

/// `; did you mean …?`, or nothing.
pub(crate) fn suggestion<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, known).map_or_else(String::new, |n| format!("; did you mean `{n}`?"))
}

pub(crate) fn camel(name: &str) -> String {
    name.to_upper_camel_case()
}

pub(crate) fn lower_camel(name: &str) -> String {
    name.to_lower_camel_case()
}

pub(crate) fn snake(name: &str) -> String {
    name.to_snake_case()
}

pub(crate) fn shout(name: &str) -> String {
    name.to_shouty_snake_case()
}

/// A type's name as it is, or with `Type` behind it where the language or the glue has taken it.
pub(crate) fn unless(taken: &[&str], name: String) -> String {
    if taken.contains(&name.as_str()) { name + "Type" } else { name }
}

/// The first two that have become one name, as they are in WIT: of pairs of that and what has become of it.
pub(crate) fn twice(names: &[(String, String)]) -> Option<(&str, &str)> {
    names.iter().enumerate().find_map(|(i, (second, name))| {
        let first = names[..i].iter().find(|(_, other)| other == name)?;
        Some((first.0.as_str(), second.as_str()))
    })
}

/// Whether a project can have this name: it becomes a crate, a package and a file of that name.
pub(crate) fn is_name(name: &str) -> bool {
    name.len() <= 64
        && name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
        && !name.ends_with('-')
        && !name.contains("--")
}

/// A documentation text as comment lines.
pub(crate) fn comment(text: &str, prefix: &str) -> String {
    let line = |l: &str| {
        let line = format!("{prefix} {l}");
        let line = line.trim_end();
        // In C a backslash at the end would take the next line into the comment.
        format!("{line}{}\n", if line.ends_with('\\') { "." } else { "" })
    };
    text.lines().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_crates_packages_and_files() {
        for good in ["pump", "feed-pump", "pump-2", "pump-2x", "a"] {
            assert!(is_name(good), "{good}");
        }
        for bad in ["", "Pump", "2pump", "pump-", "pump--x", "-p", "pump_x", "../x"] {
            assert!(!is_name(bad), "{bad}");
        }
    }

    #[test]
    fn no_comment_takes_the_line_behind_it() {
        assert_eq!(comment("path C:\\\nand  \n\nmore", "//"), "// path C:\\.\n// and\n//\n// more\n");
    }

    #[test]
    fn only_near_names_are_suggested() {
        assert_eq!(nearest("pyhton", ["python", "c"]), Some("python"));
        assert_eq!(nearest("fortran", ["python", "c"]), None);
    }
}
