//! Values and changes in the units of a reader.

use closecall_traffic::Value;

use super::Offset;
use crate::attribution::{Attribution, phase_word};

/// Kilometres per hour in one metre per second.
const KMH_PER_MPS: f64 = 3.6;

/// A unit by the ending of a parameter's name: the unit of a reader, the factor to it, and its decimals.
const UNITS: [(&str, &str, f64, usize); 7] = [
    ("-mps2", "m/s²", 1.0, 1),
    ("-mps3", "m/s³", 1.0, 1),
    ("-mps", "km/h", KMH_PER_MPS, 1),
    ("-rad", "rad", 1.0, 3),
    ("-km", "km", 1.0, 2),
    ("-m", "m", 1.0, 1),
    ("-s", "s", 1.0, 2),
];

/// A parameter's name without its unit, and how its numbers are written.
struct Named<'a> {
    name: String,
    unit: &'a str,
    factor: f64,
    decimals: usize,
}

impl Named<'_> {
    fn of(name: &str) -> Self {
        let found = UNITS.into_iter().find_map(|(ending, unit, factor, decimals)| {
            Some(Named { name: name.strip_suffix(ending)?.replace('-', " "), unit, factor, decimals })
        });
        found.unwrap_or_else(|| Named { name: name.replace('-', " "), unit: "", factor: 1.0, decimals: 2 })
    }

    /// Returns a number in the unit of a reader, with more decimals if `beside` would look the same.
    fn number(&self, value: f64, beside: f64) -> String {
        let text = |decimals: usize, value: f64| format!("{:.decimals$}", value * self.factor);
        let decimals =
            (self.decimals..self.decimals + 4).find(|&decimals| text(decimals, value) != text(decimals, beside));
        format!("{} {}", text(decimals.unwrap_or(self.decimals), value), self.unit).trim_end().to_owned()
    }
}

/// Returns a value and the nominal one in words, such as `closing 39.2 km/h (nominal 30.1 km/h)`.
pub(super) fn value(name: &str, value: &Value, nominal: &Value) -> String {
    let named = Named::of(name);
    match (value, nominal) {
        (Value::Number(value), Value::Number(nominal)) => {
            format!("{} {} (nominal {})", named.name, named.number(*value, *nominal), named.number(*nominal, *value))
        }
        _ => format!("{} {value} (nominal {nominal})", named.name),
    }
}

/// Returns a change in words, after "passes when".
pub(super) fn change(name: &str, failing: &Value, passing: &Value) -> String {
    let named = Named::of(name);
    match (failing, passing) {
        (Value::Number(failing), Value::Number(passing)) => {
            let how = if passing > failing { "more" } else { "less" };
            let by = named.number((passing - failing).abs(), 0.0);
            let (from, to) = (named.number(*failing, *passing), named.number(*passing, *failing));
            format!("{} is {by} {how} ({to} instead of {from})", named.name)
        }
        _ => format!("{} is {passing} instead of {failing}", named.name),
    }
}

/// Returns the smallest failing case in a sentence.
pub(super) fn sentence(collision: &Attribution, off: &[Offset]) -> String {
    let what = format!(
        "{} strikes {} with {:.1} km/h, {:.1} s after the start (phase {})",
        collision.striking.actor,
        collision.struck.actor,
        KMH_PER_MPS * collision.relative_speed_mps,
        collision.time_s,
        phase_word(collision.phase),
    );
    let off: Vec<&str> = off.iter().map(|offset| &offset.words[..]).collect();
    match &off[..] {
        [] => format!("{what}, with all parameters at their nominal values."),
        off => format!("{what}, with {}, and all other parameters at their nominal values.", off.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_changes_have_the_units_of_a_reader() {
        let number = Value::Number;
        assert_eq!(value("closing-mps", &number(10.0), &number(8.35)), "closing 36.0 km/h (nominal 30.1 km/h)");
        assert_eq!(
            change("brake-mps2", &number(6.0), &number(5.95)),
            "brake is 0.05 m/s² less (5.95 m/s² instead of 6.00 m/s²)"
        );
        let label = |text: &str| Value::Label(text.to_owned());
        assert_eq!(
            change("rear-class", &label("motorcycle"), &label("car")),
            "rear class is car instead of motorcycle"
        );
    }
}
