//! Names that were likely meant: the field a typo stands for.

/// The known name that is most like a given one, if any is so like it that nothing else can have been meant: the same but for
/// case and separators, the same with its unit left out or another one (`azimuth`, `base_km`), or a few slips of the fingers
/// away.
pub(super) fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let distances = known.into_iter().filter_map(|name| Some((distance(given, name)?, name)));
    // The first of equals: the order of the fields decides.
    distances.min_by_key(|(distance, _)| *distance).map(|(_, name)| name)
}

/// Slips between two names; none if there are too many for their length.
fn distance(given: &str, name: &str) -> Option<usize> {
    /// Slips that are forgiven: two, in short words one.
    const SLIPS: [(usize, usize); 2] = [(5, 2), (0, 1)];
    /// No name is longer; nobody's key is compared letter by letter beyond.
    const LONGEST: usize = 64;
    if given.len() > LONGEST {
        return None;
    }
    let bare = |text: &str| -> Vec<char> {
        text.chars().filter(|c| !"_- .".contains(*c)).flat_map(char::to_lowercase).collect()
    };
    let (a, b) = (bare(given), bare(name));
    if a == b {
        return Some(0);
    }
    if name.strip_prefix(given).is_some_and(|unit| unit.starts_with('_')) {
        return Some(1);
    }
    let allowed = SLIPS.iter().find(|(length, _)| a.len().min(b.len()) >= *length).map_or(0, |(_, slips)| *slips);
    Some(slips(&a, &b)).filter(|slips| *slips <= allowed)
}

/// Letters left out, added, mistaken or swapped with their neighbour (optimal string alignment; Damerau 1964).
fn slips(a: &[char], b: &[char]) -> usize {
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let mistaken = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = mistaken.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_case_and_separators_are_seen_through_and_other_words_are_not() {
        let known = ["kind", "base_m", "thickness", "droplets", "wind", "henyey_greenstein"];
        for (given, meant) in [
            ("thicknes", Some("thickness")),
            ("thikcness", Some("thickness")),
            ("Thickness", Some("thickness")),
            ("baseM", Some("base_m")),
            ("base-m", Some("base_m")),
            ("base", Some("base_m")),
            ("base_km", Some("base_m")),
            ("wint", Some("wind")),
            ("king", Some("kind")),
            ("HenyeyGreenstien", Some("henyey_greenstein")),
            ("wine_m", None),
            ("typo", None),
            ("comment", None),
            ("", None),
        ] {
            assert_eq!(nearest(given, known), meant, "{given}");
        }
        assert_eq!(nearest(&"w".repeat(100_000), known), None);
        assert_eq!(slips(&['a', 'b'], &['b', 'a']), 1);
        assert_eq!(slips(&[], &['b', 'a']), 2);
    }
}
