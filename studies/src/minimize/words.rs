//! Values and changes in words, with their units.

use closecall_traffic::{Value, maths};

use super::Offset;
use crate::attribution::{Attribution, phase_word};

/// A unit by the ending of a parameter's name, and its decimals.
const UNITS: [(&str, &str, usize); 7] = [
    ("-mps2", "m/s²", 1),
    ("-mps3", "m/s³", 1),
    ("-mps", "m/s", 1),
    ("-rad", "rad", 3),
    ("-km", "km", 2),
    ("-m", "m", 1),
    ("-s", "s", 2),
];

/// A parameter's name without its unit, and how its numbers are written.
struct Named<'a> {
    name: String,
    unit: &'a str,
    decimals: usize,
}

impl Named<'_> {
    fn of(name: &str) -> Self {
        let named = UNITS.into_iter().find_map(|(ending, unit, decimals)| {
            Some(Named { name: name.strip_suffix(ending)?.replace('-', " "), unit, decimals })
        });
        named.unwrap_or_else(|| Named { name: name.replace('-', " "), unit: "", decimals: 2 })
    }

    /// Returns two numbers and their difference with the unit, all with the same decimals. The
    /// decimals are those that a step of the grid needs, or more if the two numbers would look the
    /// same. The difference is the difference of the written numbers.
    fn numbers(&self, values: [f64; 2], step: Option<f64>) -> [String; 3] {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "steps are above 1e-12")]
        let needed = |step: f64| (-maths::log10(step)).ceil().max(0.0) as usize;
        let least = step.map_or(self.decimals, needed);
        let written = |decimals: i32| values.map(|value| (value * 10_f64.powi(decimals)).round());
        let differ = |decimals: &usize| {
            let [first, second] = written(*decimals as i32);
            first != second
        };
        let decimals = (least..least + 4).find(differ).unwrap_or(least);
        let [first, second] = written(decimals as i32);
        let text = |number: f64| {
            let number = number / 10_f64.powi(decimals as i32);
            format!("{number:.decimals$} {}", self.unit).trim_end().to_owned()
        };
        [text(first), text(second), text((first - second).abs())]
    }
}

/// Returns a value and the nominal one in words, such as `closing 10.9 m/s (nominal 8.4 m/s)`.
/// `step` is the step of the parameter's grid.
pub(super) fn value(name: &str, value: &Value, nominal: &Value, step: Option<f64>) -> String {
    let named = Named::of(name);
    match (value, nominal) {
        (Value::Number(value), Value::Number(nominal)) => {
            let [value, nominal, _] = named.numbers([*value, *nominal], step);
            format!("{} {value} (nominal {nominal})", named.name)
        }
        _ => format!("{} {value} (nominal {nominal})", named.name),
    }
}

/// Returns how far a number is from the nominal one in words, such as `2.5 m/s more`; `None` of a
/// label. `step` is the step of the parameter's grid.
pub(super) fn difference(name: &str, value: &Value, nominal: &Value, step: Option<f64>) -> Option<String> {
    let (Value::Number(value), Value::Number(nominal)) = (value, nominal) else { return None };
    let how = if value > nominal { "more" } else { "less" };
    let [_, _, by] = Named::of(name).numbers([*value, *nominal], step);
    Some(format!("{by} {how}"))
}

/// Returns a change in words, after "passes when". `step` is the step of the parameter's grid.
pub(super) fn change(name: &str, failing: &Value, passing: &Value, step: Option<f64>) -> String {
    let named = Named::of(name);
    match (failing, passing) {
        (Value::Number(failing), Value::Number(passing)) => {
            let how = if passing > failing { "more" } else { "less" };
            let [to, from, by] = named.numbers([*passing, *failing], step);
            format!("{} is {by} {how} ({to} instead of {from})", named.name)
        }
        _ => format!("{} is {passing} instead of {failing}", named.name),
    }
}

/// Returns the smallest failing case in a sentence.
pub(super) fn sentence(collision: &Attribution, off: &[Offset]) -> String {
    let strike = format!(
        "{} strikes {} with {:.1} m/s, {:.1} s after the start (phase {})",
        collision.striking.actor,
        collision.struck.actor,
        collision.relative_speed_mps,
        collision.time_s,
        phase_word(collision.phase),
    );
    let off: Vec<&str> = off.iter().map(|offset| &offset.words[..]).collect();
    match &off[..] {
        [] => format!("{strike}, with all parameters at their nominal values."),
        off => format!("{strike}, with {}, and all other parameters at their nominal values.", off.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_does_not_contradict_itself() {
        let change =
            |name, failing, passing, step| change(name, &Value::Number(failing), &Value::Number(passing), Some(step));
        assert_eq!(
            change("braking-mps2", 6.88, 6.84, 0.02),
            "braking is 0.04 m/s² less (6.84 m/s² instead of 6.88 m/s²)"
        );
        assert_eq!(change("brake-phase", 0.245, 0.26, 0.005), "brake phase is 0.015 more (0.260 instead of 0.245)");
        assert_eq!(change("brake-at-s", 16.2, 16.0, 0.1), "brake at is 0.2 s less (16.0 s instead of 16.2 s)");
        assert_eq!(change("gap-m", 120.0, 100.0, 20.0), "gap is 20 m less (100 m instead of 120 m)");
        // The difference is the difference of the written numbers.
        assert_eq!(change("closing-mps", 8.36, 8.24, 0.1), "closing is 0.2 m/s less (8.2 m/s instead of 8.4 m/s)");
    }

    #[test]
    fn values_and_changes_have_the_units_of_a_reader() {
        let number = Value::Number;
        assert_eq!(value("closing-mps", &number(10.0), &number(8.3), None), "closing 10.0 m/s (nominal 8.3 m/s)");
        assert_eq!(
            change("brake-mps2", &number(6.0), &number(5.95), None),
            "brake is 0.05 m/s² less (5.95 m/s² instead of 6.00 m/s²)"
        );
        let label = |text: &str| Value::Label(text.to_owned());
        let to_nominal = |from: f64, to: f64| difference("closing-mps", &number(from), &number(to), None);
        assert_eq!(to_nominal(10.0, 8.3).as_deref(), Some("1.7 m/s more"));
        assert_eq!(to_nominal(8.3, 10.0).as_deref(), Some("1.7 m/s less"));
        assert_eq!(difference("rear-class", &label("truck"), &label("car"), None), None);
        assert_eq!(
            change("rear-class", &label("motorcycle"), &label("car"), None),
            "rear class is car instead of motorcycle"
        );
    }
}
