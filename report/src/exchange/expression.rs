//! Values of attributes: numbers, parameters, and expressions of both.
//!
//! OpenSCENARIO names a parameter `$name` and writes an expression `${$name * 2}`. Names have
//! underscores in place of Closecall's hyphens.

use std::fmt;
use std::ops::{Add, Div, Mul, Sub};

use closecall_traffic::{Num, ParameterName, Parameters, Value};

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Expression {
    Number(f64),
    /// A parameter, or a formula in parentheses.
    Formula(String),
}

impl From<f64> for Expression {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value) => write!(f, "{value}"),
            Self::Formula(text) if text.starts_with('$') => f.write_str(text),
            Self::Formula(text) => write!(f, "${{{text}}}"),
        }
    }
}

impl Expression {
    /// Returns how the value stands in a formula.
    fn operand(&self) -> String {
        match self {
            Self::Number(value) if *value < 0.0 => format!("({value})"),
            Self::Number(value) => value.to_string(),
            Self::Formula(text) => text.clone(),
        }
    }

    fn combined(self, other: Self, sign: char, numbers: fn(f64, f64) -> f64) -> Self {
        match (&self, &other) {
            (Self::Number(a), Self::Number(b)) => Self::Number(numbers(*a, *b)),
            _ => Self::Formula(format!("({} {sign} {})", self.operand(), other.operand())),
        }
    }
}

impl Add for Expression {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.combined(other, '+', |a, b| a + b)
    }
}

impl Sub for Expression {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.combined(other, '-', |a, b| a - b)
    }
}

impl Mul for Expression {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        // A sign of 1 leaves the formula as it is.
        if other == Self::Number(1.0) { self } else { self.combined(other, '*', |a, b| a * b) }
    }
}

impl Div for Expression {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        self.combined(other, '/', |a, b| a / b)
    }
}

/// Returns the name of a parameter in OpenSCENARIO.
pub(super) fn parameter_name(name: &ParameterName) -> String {
    name.as_str().replace('-', "_")
}

/// Whether parameters are written as their names, or as the values of one sample.
#[derive(Clone, Copy)]
pub(super) struct Values<'a> {
    pub(super) sample: &'a Parameters,
    pub(super) are_named: bool,
}

impl Values<'_> {
    /// Returns the text for a number of the scenario file.
    pub(super) fn expression(&self, num: &Num) -> Expression {
        match num {
            Num::Fixed(value) => Expression::Number(*value),
            Num::Parameter(name) if self.are_named => Expression::Formula(format!("${}", parameter_name(name))),
            Num::Parameter(_) => Expression::Number(self.of_sample(num)),
        }
    }

    /// Returns the text for a number, or for the default of an absent key.
    pub(super) fn or(&self, num: Option<&Num>, default: f64) -> Expression {
        num.map_or(Expression::Number(default), |num| self.expression(num))
    }

    /// Returns the number in the sample. A checked scenario has no other kind of value here.
    pub(super) fn of_sample(&self, num: &Num) -> f64 {
        match num {
            Num::Fixed(value) => *value,
            Num::Parameter(name) => match self.sample.get(name) {
                Some(Value::Number(value)) => *value,
                _ => f64::NAN,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_computed_and_parameters_stay_in_the_formula() {
        let named = Expression::Formula("$cruise_mps".to_owned());
        assert_eq!(named.to_string(), "$cruise_mps");
        assert_eq!((Expression::from(2.0) * 3.0.into() + 0.5.into()).to_string(), "6.5");
        assert_eq!((named * Expression::from(-0.7) + 4.6.into()).to_string(), "${(($cruise_mps * (-0.7)) + 4.6)}");
    }
}
