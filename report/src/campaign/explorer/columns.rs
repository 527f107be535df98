//! The samples of one scenario in columns, as the page holds them.
//!
//! The parameters of a sample are the same in all arms, so the page holds them once. A column
//! without a second value is left out.

use std::collections::BTreeMap;

use closecall_campaign::record::{ArmRecord, Record};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::parameters::ParameterSpace;
use closecall_scenarios::promise::Hindrance;
use closecall_traffic::shown::shown;
use serde::Serialize;

use crate::campaign::outcomes::{CellValue, Column, OutcomeRow, PARAMETER, ParameterKind, columns};
use crate::campaign::overview::{Fate, ScenarioOverview};
use crate::units::labelled;

/// Largest number of different words of a column. Free text has more, and is left out.
const MOST_WORDS: usize = 100;
/// Columns that say nothing about one sample among others, or are free text.
const LEFT_OUT: [&str; 7] = ["scenario", "seed", "sample", "controller", "error_message", "mis_reasons", "status"];
/// Name of the column of the reasons of the margin increase system.
const REASON: &str = "mis_reason";
/// Name of the column that says why a collision was not prevented.
const CAUSE: &str = "cause";
/// Digits of a number behind the first one. Charts show no more.
const DIGITS: usize = 3;

/// The samples of a scenario.
#[derive(Serialize)]
pub(super) struct Samples {
    scenario: String,
    arms: Vec<String>,
    is_paired: bool,
    numbers: Vec<u64>,
    fates: Vec<u8>,
    parameters: Vec<Values>,
    /// The columns of each arm.
    outcomes: Vec<Vec<Values>>,
    /// Names of the two parameters that determine the outcome most.
    map: Vec<String>,
    #[serde(skip)]
    sources: Vec<Column>,
}

/// One column.
#[derive(Serialize)]
struct Values {
    name: String,
    label: String,
    /// The words that `values` counts; `None` if the values are numbers.
    words: Option<Vec<String>>,
    values: Vec<Option<f32>>,
    #[serde(skip)]
    indices: BTreeMap<String, u16>,
}

impl Values {
    fn new(name: &str, is_number: bool) -> Self {
        let label = labelled(name.strip_prefix(PARAMETER).unwrap_or(name));
        let words = (!is_number).then(Vec::new);
        Self { name: name.to_owned(), label, words, values: Vec::new(), indices: BTreeMap::new() }
    }

    fn push(&mut self, value: Option<CellValue>) {
        let value = match value {
            Some(CellValue::Number(number)) => rounded(number),
            Some(CellValue::Word(word)) => self.index_of(word).map(f32::from),
            None => None,
        };
        self.values.push(value);
    }

    /// Returns the index of a word. A word beyond the largest number of words has none.
    fn index_of(&mut self, word: String) -> Option<u16> {
        if let Some(index) = self.indices.get(&word) {
            return Some(*index);
        }
        let words = self.words.as_mut().filter(|words| words.len() <= MOST_WORDS)?;
        let index = u16::try_from(words.len()).ok()?;
        words.push(shown(&word).into_owned());
        self.indices.insert(word, index);
        Some(index)
    }

    /// Returns true if the column can be looked at: it has several values, and not as many words as
    /// free text.
    fn is_shown(&self) -> bool {
        let first = self.values.first();
        self.values.iter().any(|value| Some(value) != first)
            && self.words.as_ref().is_none_or(|words| words.len() <= MOST_WORDS)
    }
}

impl Samples {
    pub(super) fn new(file: &ScenarioFile, arms: &[String]) -> Self {
        let sources: Vec<Column> = columns(&parameters(file.space()))
            .into_iter()
            .filter(|column| !LEFT_OUT.contains(&column.name.as_str()) && !column.name.ends_with("_absent"))
            .collect();
        let values_of = |is_parameter: bool| {
            let chosen = sources.iter().filter(move |column| column.name.starts_with(PARAMETER) == is_parameter);
            chosen.map(|column| Values::new(&column.name, column.is_number()))
        };
        let outcomes = || values_of(false).chain([Values::new(CAUSE, false)]).collect();
        Self {
            scenario: file.config().name.clone(),
            arms: arms.iter().map(|arm| shown(arm).into_owned()).collect(),
            is_paired: arms.len() > 1,
            numbers: Vec::new(),
            fates: Vec::new(),
            parameters: values_of(true).collect(),
            outcomes: arms.iter().map(|_| outcomes()).collect(),
            map: Vec::new(),
            sources,
        }
    }

    /// Adds a sample.
    pub(super) fn push(&mut self, record: Record, seed: u64) {
        self.numbers.push(record.sample);
        self.fates.push(Fate::of(&record) as u8);
        // A sample that ends in an error in one arm has its parameters in the other.
        let drawn = record.arms.iter().position(|arm| arm.result.is_ok()).unwrap_or_default();
        for (index, arm) in record.arms.into_iter().enumerate() {
            let Some(values) = self.outcomes.get_mut(index) else { continue };
            let ArmRecord { controller, result, .. } = arm;
            let row = OutcomeRow { scenario: record.scenario.clone(), seed, sample: record.sample, controller, result };
            let mut parameters = self.parameters.iter_mut();
            let mut values = values.iter_mut();
            for column in &self.sources {
                if !column.name.starts_with(PARAMETER) {
                    values.next().into_iter().for_each(|values| values.push(column.value(&row)));
                } else if index == drawn {
                    parameters.next().into_iter().for_each(|values| values.push(column.value(&row)));
                }
            }
            let outcome = row.result.as_ref().ok().filter(|outcome| !outcome.collisions.is_empty());
            let cause = outcome.and_then(Hindrance::of).map(|cause| CellValue::Word(cause.to_string()));
            if let Some(values) = values.next() {
                values.push(cause);
            }
        }
    }

    /// Leaves out the columns that cannot be looked at, and adds the parameters that determine the
    /// outcome most. `overview` is of the same samples.
    pub(super) fn finish(&mut self, overview: &ScenarioOverview) {
        self.parameters.retain(Values::is_shown);
        let shown: Vec<bool> = match self.outcomes.first() {
            Some(columns) => (0..columns.len())
                .map(|index| {
                    let first = columns[index].values.first().copied().flatten();
                    let differs = |arm: &Vec<Values>| arm[index].values.first().copied().flatten() != first;
                    let is_filter = [REASON, CAUSE].contains(&columns[index].name.as_str());
                    // A column may be constant in one arm and differ from arm to arm.
                    is_filter || self.outcomes.iter().any(|arm| arm[index].is_shown() || differs(arm))
                })
                .collect(),
            None => Vec::new(),
        };
        for arm in &mut self.outcomes {
            let mut shown = shown.iter();
            arm.retain(|_| shown.next().copied().unwrap_or_default());
        }
        let names = overview.map().map(|pair| pair.axes.map(|axis| overview.axes[axis].name()));
        let names = names.into_iter().flatten().map(|name| format!("{PARAMETER}{}", name.replace('-', "_")));
        self.map = names.filter(|name| self.parameters.iter().any(|values| values.name == *name)).collect();
    }
}

/// Returns the parameters that vary.
fn parameters(space: &ParameterSpace) -> BTreeMap<closecall_traffic::ParameterName, ParameterKind> {
    let kind = |has_labels: bool| if has_labels { ParameterKind::Label } else { ParameterKind::Number };
    space.iter().map(|(name, entry)| (name.clone(), kind(!entry.distribution.labels().is_empty()))).collect()
}

/// Returns a number with as many digits as a chart shows.
fn rounded(number: f64) -> Option<f32> {
    number.is_finite().then(|| format!("{number:.DIGITS$e}").parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits_and_what_is_no_number_is_absent() {
        assert_eq!([1234.56, -0.001_234_9, f64::NAN].map(rounded), [Some(1235.0), Some(-0.001_235), None]);
    }

    #[test]
    fn free_text_and_constants_are_left_out() {
        let column = |count: usize, distinct: usize| {
            let mut values = Values::new("a_m", false);
            (0..count).for_each(|index| values.push(Some(CellValue::Word(format!("w{}", index % distinct)))));
            values
        };
        assert!(column(300, 7).is_shown());
        assert!(!column(300, 1).is_shown(), "a constant");
        assert!(!column(300, 250).is_shown(), "free text");
        assert_eq!(column(3, 2).values, [Some(0.0), Some(1.0), Some(0.0)]);
    }
}
