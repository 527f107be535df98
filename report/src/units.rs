//! Units of measurement, which are the ends of names.

/// The ends of names and their units. If one end is the end of another, the longer one comes first.
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

/// Returns the unit that a name ends with, or `None` if it ends with no unit. The parts of the name are joined by `-` or
/// `_`.
pub(crate) fn unit_of(name: &str) -> Option<&'static str> {
    split(name).1
}

/// Returns the name as reports show it: `closing-mps` becomes `closing [m/s]`.
pub(crate) fn labelled(name: &str) -> String {
    match split(name) {
        (stem, Some(unit)) => format!("{} [{unit}]", stem.replace(['-', '_'], " ")),
        (stem, None) => stem.replace(['-', '_'], " "),
    }
}

fn split(name: &str) -> (&str, Option<&'static str>) {
    let found = UNITS.iter().find_map(|(end, unit)| {
        // The ends contain hyphens; names of columns have underscores instead.
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
