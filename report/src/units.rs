//! Units of measurement, as the end of every name says them.

/// The ends of names, longer ones first where one ends in another, and what they stand for.
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

/// The unit that a name ends with, be its parts joined by `-` or `_`; nothing where the value is a plain number.
pub(crate) fn unit_of(name: &str) -> Option<&'static str> {
    split(name).1
}

/// A name for people: `closing-mps` is `closing [m/s]`.
pub(crate) fn labelled(name: &str) -> String {
    match split(name) {
        (stem, Some(unit)) => format!("{} [{unit}]", stem.replace(['-', '_'], " ")),
        (stem, None) => stem.replace(['-', '_'], " "),
    }
}

fn split(name: &str) -> (&str, Option<&'static str>) {
    let found = UNITS.iter().find_map(|(end, unit)| {
        // The ends hold hyphens themselves; names of columns have underscores in their place.
        let stem = name.len().checked_sub(end.len() + 1)?;
        let tail = name.get(stem..)?;
        let is_joined = tail.starts_with(['-', '_']);
        (is_joined && tail[1..].replace('_', "-") == *end).then(|| (&name[..stem], Some(*unit)))
    });
    found.unwrap_or((name, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_name_is_its_unit() {
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
