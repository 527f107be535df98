//! Expressions of OpenSCENARIO: `$name`, and `${…}` with `+ - * / %`, parentheses and functions.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::maths;

/// The values of the parameters that an element can use. The element and the elements around it
/// declare them. An inner value hides an outer one of the same name.
#[derive(Clone, Debug, Default)]
pub(super) struct Values<'a> {
    inner: BTreeMap<String, String>,
    outer: Option<&'a Values<'a>>,
}

impl<'a> Values<'a> {
    /// Creates the values of an element inside another.
    pub(super) const fn within(outer: &'a Values<'a>) -> Self {
        Self { inner: BTreeMap::new(), outer: Some(outer) }
    }

    /// Sets a value, and returns the earlier value of the same element.
    pub(super) fn insert(&mut self, name: String, value: String) -> Option<String> {
        self.inner.insert(name, value)
    }

    pub(super) fn get(&self, name: &str) -> Option<&str> {
        let value = self.inner.get(name).map(String::as_str);
        value.or_else(|| self.outer.and_then(|outer| outer.get(name)))
    }

    /// Returns the message that there is no parameter of this name, with the names that there are.
    pub(super) fn unknown(&self, name: &str) -> String {
        let mut names: BTreeSet<&str> = BTreeSet::new();
        let mut values = Some(self);
        while let Some(Values { inner, outer }) = values {
            names.extend(inner.keys().map(String::as_str));
            values = *outer;
        }
        no_parameter(name, &names)
    }
}

/// Returns the message that there is no parameter of this name, with the names that there are.
pub(super) fn no_parameter(name: &str, names: &BTreeSet<&str>) -> String {
    let list: Vec<&str> = names.iter().copied().take(MOST_NAMES).collect();
    if list.is_empty() {
        return format!("there is no parameter `{name}`: the file has none");
    }
    let more = names.len().saturating_sub(MOST_NAMES);
    let more = if more > 0 { format!(" and {more} others") } else { String::new() };
    format!("there is no parameter `{name}`, only {}{more}", list.join(", "))
}

/// Number of names that a message lists.
const MOST_NAMES: usize = 30;
/// Deepest nesting of parentheses and signs.
const MOST_DEPTH: usize = 100;

/// Returns the text with its parameter replaced or its expression computed.
pub(super) fn resolve(text: &str, values: &Values<'_>) -> Result<String, String> {
    let text = text.trim();
    if let Some(inner) = text.strip_prefix("${").and_then(|rest| rest.strip_suffix('}')) {
        let mut parser = Parser { rest: inner, values, depth: 0 };
        let number = parser.sum()?;
        return match parser.rest.trim() {
            "" if number.is_finite() => Ok(number.to_string()),
            "" => Err(format!("`{text}` is not a finite number")),
            rest => Err(format!("`{text}`: `{rest}` is not expected")),
        };
    }
    match text.strip_prefix('$') {
        Some(name) => values.get(name).map(str::to_owned).ok_or_else(|| values.unknown(name)),
        None => Ok(text.to_owned()),
    }
}

struct Parser<'a> {
    rest: &'a str,
    values: &'a Values<'a>,
    depth: usize,
}

impl Parser<'_> {
    /// Skips `sign` if it comes next. Returns whether it did.
    fn skip(&mut self, sign: char) -> bool {
        let rest = self.rest.trim_start();
        let after_sign = rest.strip_prefix(sign);
        self.rest = after_sign.unwrap_or(rest);
        after_sign.is_some()
    }

    fn sum(&mut self) -> Result<f64, String> {
        let mut total = self.product()?;
        loop {
            if self.skip('+') {
                total += self.product()?;
            } else if self.skip('-') {
                total -= self.product()?;
            } else {
                return Ok(total);
            }
        }
    }

    fn product(&mut self) -> Result<f64, String> {
        let mut total = self.operand()?;
        loop {
            if self.skip('*') {
                total *= self.operand()?;
            } else if self.skip('/') {
                total /= self.operand()?;
            } else if self.skip('%') {
                total %= self.operand()?;
            } else {
                return Ok(total);
            }
        }
    }

    fn operand(&mut self) -> Result<f64, String> {
        self.depth += 1;
        if self.depth > MOST_DEPTH {
            return Err(format!("an expression has more than {MOST_DEPTH} levels"));
        }
        let value = self.inner_operand();
        self.depth -= 1;
        value
    }

    fn inner_operand(&mut self) -> Result<f64, String> {
        if self.skip('-') {
            return Ok(-self.operand()?);
        }
        if self.skip('(') {
            let value = self.sum()?;
            return if self.skip(')') { Ok(value) } else { Err("a parenthesis is not closed".to_owned()) };
        }
        if self.skip('$') {
            let name = self.word();
            let text = self.values.get(&name).ok_or_else(|| self.values.unknown(&name))?;
            return text.trim().parse().map_err(|_| format!("the parameter `{name}` is `{text}`, and no number"));
        }
        let word = self.word();
        if !self.skip('(') {
            return word.parse().map_err(|_| format!("`{word}` is neither a number nor a parameter such as `$name`"));
        }
        let mut arguments = vec![self.sum()?];
        while self.skip(',') {
            arguments.push(self.sum()?);
        }
        if !self.skip(')') {
            return Err(format!("`{word}(` is not closed"));
        }
        match (word.as_str(), &arguments[..]) {
            ("round", [a]) => Ok(a.round()),
            ("floor", [a]) => Ok(a.floor()),
            ("ceil", [a]) => Ok(a.ceil()),
            ("sqrt", [a]) => Ok(a.sqrt()),
            ("abs", [a]) => Ok(a.abs()),
            ("sign", [a]) => Ok(if *a == 0.0 { 0.0 } else { a.signum() }),
            ("max", [a, b]) => Ok(a.max(*b)),
            ("min", [a, b]) => Ok(a.min(*b)),
            ("pow", [a, b]) => Ok(maths::powf(*a, *b)),
            _ => Err(format!("`{word}` with {} arguments is not a function of an expression", arguments.len())),
        }
    }

    /// Reads a name, or a number with its exponent.
    fn word(&mut self) -> String {
        let rest = self.rest.trim_start();
        let is_number = rest.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let mut previous = ' ';
        let end = rest.find(|c: char| {
            let is_exponent_sign = is_number && (c == '-' || c == '+') && matches!(previous, 'e' | 'E');
            previous = c;
            !(c.is_alphanumeric() || c == '_' || c == '.' || is_exponent_sign)
        });
        let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
        self.rest = rest;
        word.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_have_the_precedence_of_arithmetic() {
        let mut outer = Values::default();
        outer.insert("v".to_owned(), "20.0".to_owned());
        outer.insert("name".to_owned(), "car".to_owned());
        let mut values = Values::within(&outer);
        values.insert("v".to_owned(), "-20.0".to_owned());
        let number = |text| resolve(text, &values).unwrap().parse::<f64>().unwrap();
        assert_eq!(number("${30 + (-10.0 * ($v / 3.6))}"), 30.0 + 200.0 / 3.6);
        assert_eq!(number("${-$v * 2 - 1e-1}"), 39.9);
        assert_eq!(number("${max(abs($v), sqrt(4)) % 7}"), 6.0);
        assert_eq!(number("${pow(2, 3)}"), 8.0);
        assert_eq!(number("${pow(-2, 2)}"), 4.0);
        assert_eq!(resolve("$name", &values).unwrap(), "car");
        assert!(resolve("$name$", &values).is_err());
        for wrong in ["${$w}", "${1 +}", "${(1}", "${$name * 2}", "${1 / 0}", "${wrong(1)}", "${2 3}"] {
            assert!(resolve(wrong, &values).is_err(), "{wrong}");
        }
        let deep = format!("${{{}1{}}}", "(".repeat(5_000), ")".repeat(5_000));
        assert!(resolve(&deep, &values).unwrap_err().contains("levels"));
    }

    #[test]
    fn a_message_lists_some_of_many_parameters() {
        let mut values = Values::default();
        assert_eq!(values.unknown("a"), "there is no parameter `a`: the file has none");
        for number in 0..100 {
            values.insert(format!("p{number:02}"), String::new());
        }
        let message = values.unknown("a");
        assert!(message.ends_with("p28, p29 and 70 others"), "{message}");
    }
}
