//! Units of measurement, read from the suffixes of names.

/// The suffixes of names with their units. A suffix that ends in another one precedes it.
const UNITS: [(&str, &str); 14] = [
    ("mm-per-h", "mm/h"),
    ("m-per-h", "m/h"),
    ("per-m", "1/m"),
    ("mps3", "m/s³"),
    ("mps2", "m/s²"),
    ("mps", "m/s"),
    ("rad", "rad"),
    ("deg", "°"),
    ("kg", "kg"),
    ("mm", "mm"),
    ("ms", "ms"),
    ("hz", "Hz"),
    ("m", "m"),
    ("s", "s"),
];

/// Returns the unit that the suffix of a name stands for, or `None` if there is none. The parts of
/// the name may be joined by `-` or `_`.
pub(crate) fn unit_of(name: &str) -> Option<&'static str> {
    split(name).1
}

/// Returns a name as a label for a reader: `closing-mps` becomes `closing [m/s]`.
pub(crate) fn labelled(name: &str) -> String {
    match split(name) {
        (stem, Some(unit)) => format!("{} [{unit}]", stem.replace(['-', '_'], " ")),
        (stem, None) => stem.replace(['-', '_'], " "),
    }
}

/// Splits a name into its stem and the unit of its suffix.
fn split(name: &str) -> (&str, Option<&'static str>) {
    let parts = UNITS.iter().find_map(|(suffix, unit)| {
        // Suffixes contain hyphens; names of columns have underscores instead.
        let stem = name.len().checked_sub(suffix.len() + 1)?;
        let tail = name.get(stem..)?;
        let is_joined = tail.starts_with(['-', '_']);
        (is_joined && tail[1..].replace('_', "-") == *suffix).then(|| (&name[..stem], Some(*unit)))
    });
    parts.unwrap_or((name, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_suffix_of_a_name_gives_its_unit() {
        for (name, unit) in [
            ("closing-mps", Some("m/s")),
            ("brake-mps2", Some("m/s²")),
            ("min_ttc_rear_s", Some("s")),
            ("rain-mm-per-h", Some("mm/h")),
            ("curvature_per_m", Some("1/m")),
            ("rear-class", None),
            ("brake-phase", None),
            ("s", None),
            ("mass", None),
        ] {
            assert_eq!(unit_of(name), unit, "{name}");
        }
        assert_eq!(labelled("closing-mps"), "closing [m/s]");
        assert_eq!(labelled("brake-phase"), "brake phase");
    }
}
