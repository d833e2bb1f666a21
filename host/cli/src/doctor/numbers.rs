//! Lists, masks and sizes as the kernel and people write them.

/// The CPUs of a list such as `0-2,5`; what is no list (`(null)`, empty) has none.
pub(super) fn cpu_list(text: &str) -> Vec<usize> {
    let part = |part: &str| -> Option<Vec<usize>> {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        // More than any kernel has: a broken list must not fill the memory.
        let (first, last) = (first.trim().parse().ok()?, last.trim().parse::<usize>().ok()?.min(8191));
        Some((first..=last).collect())
    };
    text.trim().split(',').filter_map(part).flatten().collect()
}

/// The CPUs of a mask such as `f` or `1,00000003`.
pub(super) fn cpu_mask(text: &str) -> Vec<usize> {
    let digits = text.trim().replace(',', "");
    let nibble = |(place, digit): (usize, char)| {
        let bits = digit.to_digit(16).unwrap_or(0);
        (0..4).filter(move |b| bits & (1 << b) != 0).map(move |b| 4 * place + b)
    };
    digits.chars().rev().enumerate().flat_map(nibble).collect()
}

/// CPUs, in order, as `0-2,5`; `none` without any.
pub(super) fn show_cpus(cpus: &[usize]) -> String {
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for cpu in cpus {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == *cpu => *last = *cpu,
            _ => ranges.push((*cpu, *cpu)),
        }
    }
    let show = |(first, last): &(usize, usize)| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    };
    if ranges.is_empty() { "none".into() } else { ranges.iter().map(show).collect::<Vec<_>>().join(",") }
}

/// A size in bytes for a person.
pub(super) fn show_bytes(bytes: u64) -> String {
    match bytes {
        b if b >= 1 << 30 => format!("{:.1} GiB", b as f64 / (1u64 << 30) as f64),
        b if b >= 1 << 20 => format!("{} MiB", b >> 20),
        b => format!("{} KiB", b >> 10),
    }
}

/// Words as a list: `a`, `a and b`, `a, b and c`.
pub(super) fn join(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists() {
        for (text, cpus, shown) in [
            ("0-3\n", vec![0, 1, 2, 3], "0-3"),
            ("0,2-3", vec![0, 2, 3], "0,2-3"),
            ("0-1,3,5", vec![0, 1, 3, 5], "0-1,3,5"),
            ("", vec![], "none"),
            (" (null)\n", vec![], "none"),
            ("3-1", vec![], "none"),
        ] {
            assert_eq!(cpu_list(text), cpus, "{text}");
            assert_eq!(show_cpus(&cpus), shown, "{text}");
        }
        assert_eq!(cpu_list("0-18446744073709551615").len(), 8192);
    }

    #[test]
    fn masks() {
        for (text, cpus) in
            [("f", vec![0, 1, 2, 3]), ("00000007\n", vec![0, 1, 2]), ("1,00000002", vec![1, 32]), ("", vec![])]
        {
            assert_eq!(cpu_mask(text), cpus, "{text}");
        }
    }

    #[test]
    fn sizes_and_words() {
        assert_eq!(show_bytes(65_536), "64 KiB");
        assert_eq!(show_bytes(8 << 20), "8 MiB");
        assert_eq!(show_bytes(3 << 29), "1.5 GiB");
        let words = |n: usize| ["a", "b", "c"][..n].iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!([0, 1, 2, 3].map(|n| join(&words(n))), ["", "a", "a and b", "a, b and c"]);
    }
}
