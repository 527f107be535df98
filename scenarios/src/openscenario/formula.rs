//! Expressions of OpenSCENARIO: `$name`, and `${…}` with `+ - * / %`, parentheses and functions.

use std::collections::BTreeMap;

use closecall_traffic::maths;

/// The values of parameters, by their names.
pub(super) type Values = BTreeMap<String, String>;

/// Deepest nesting of parentheses and signs.
const MOST_DEPTH: usize = 100;

/// Returns the text with its parameter replaced or its expression computed.
pub(super) fn resolve(text: &str, values: &Values) -> Result<String, String> {
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
        Some(name) => values.get(name).cloned().ok_or_else(|| unknown(name, values)),
        None => Ok(text.to_owned()),
    }
}

fn unknown(name: &str, values: &Values) -> String {
    let names: Vec<_> = values.keys().map(String::as_str).collect();
    format!(
        "there is no parameter `{name}`, only {}",
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    )
}

struct Parser<'a> {
    rest: &'a str,
    values: &'a Values,
    depth: usize,
}

impl Parser<'_> {
    fn takes(&mut self, sign: char) -> bool {
        let rest = self.rest.trim_start();
        let after_sign = rest.strip_prefix(sign);
        self.rest = after_sign.unwrap_or(rest);
        after_sign.is_some()
    }

    fn sum(&mut self) -> Result<f64, String> {
        let mut total = self.product()?;
        loop {
            if self.takes('+') {
                total += self.product()?;
            } else if self.takes('-') {
                total -= self.product()?;
            } else {
                return Ok(total);
            }
        }
    }

    fn product(&mut self) -> Result<f64, String> {
        let mut total = self.operand()?;
        loop {
            if self.takes('*') {
                total *= self.operand()?;
            } else if self.takes('/') {
                total /= self.operand()?;
            } else if self.takes('%') {
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
        if self.takes('-') {
            return Ok(-self.operand()?);
        }
        if self.takes('(') {
            let value = self.sum()?;
            return if self.takes(')') { Ok(value) } else { Err("a parenthesis is not closed".to_owned()) };
        }
        if self.takes('$') {
            let name = self.word();
            let text = self.values.get(&name).ok_or_else(|| unknown(&name, self.values))?;
            return text.trim().parse().map_err(|_| format!("the parameter `{name}` is `{text}`, and no number"));
        }
        let word = self.word();
        if !self.takes('(') {
            return word.parse().map_err(|_| format!("`{word}` is neither a number nor a parameter such as `$name`"));
        }
        let mut arguments = vec![self.sum()?];
        while self.takes(',') {
            arguments.push(self.sum()?);
        }
        if !self.takes(')') {
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
            ("pow", [a, b]) => Ok(maths::exp(b * maths::ln(*a))),
            _ => Err(format!("`{word}` with {} arguments is no function of an expression", arguments.len())),
        }
    }

    /// Takes a name or a number, with its exponent.
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
        let values = Values::from([("v".to_owned(), "-20.0".to_owned()), ("name".to_owned(), "car".to_owned())]);
        let number = |text| resolve(text, &values).unwrap().parse::<f64>().unwrap();
        assert_eq!(number("${30 + (-10.0 * ($v / 3.6))}"), 30.0 + 200.0 / 3.6);
        assert_eq!(number("${-$v * 2 - 1e-1}"), 39.9);
        assert_eq!(number("${max(abs($v), sqrt(4)) % 7}"), 6.0);
        assert_eq!(resolve("$name", &values).unwrap(), "car");
        assert!(resolve("$name$", &values).is_err());
        for wrong in ["${$w}", "${1 +}", "${(1}", "${$name * 2}", "${1 / 0}", "${wrong(1)}", "${2 3}"] {
            assert!(resolve(wrong, &values).is_err(), "{wrong}");
        }
        let deep = format!("${{{}1{}}}", "(".repeat(5_000), ")".repeat(5_000));
        assert!(resolve(&deep, &values).unwrap_err().contains("levels"));
    }
}
