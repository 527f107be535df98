//! The influence of each parameter on the result, from the campaign's own samples.

use closecall_campaign::ledger::PairFate;
use closecall_campaign::partition::split_mix;
use closecall_campaign::record::Record;
use closecall_scenarios::parameters::{Distribution, ParameterSpace, Variation};
use closecall_scenarios::sampling::Design;
use closecall_traffic::statistics::format::percent;
use closecall_traffic::statistics::sensitivity::given_data::{CLASSES, ClassCounts, Influence};
use closecall_traffic::{Parameters, Value};

/// The text of a report with too few events.
pub const FEW_EVENTS: &str = "too few samples with or without it to say";

/// An event of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The system prevents a collision.
    Prevented,
    /// The system induces a collision.
    Induced,
    /// The ego collides in the baseline.
    CollidedWithout,
    /// The ego collides in the arm under test.
    Collided,
}

impl Event {
    const PAIRED: [Self; 4] = [Self::Prevented, Self::Induced, Self::CollidedWithout, Self::Collided];
    const SINGLE: [Self; 1] = [Self::Collided];

    /// Returns the name, as a key of JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Prevented => "prevented",
            Self::Induced => "induced",
            Self::CollidedWithout => "collided_without",
            Self::Collided => "collided",
        }
    }

    /// Returns a title for readers.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Prevented => "prevented collisions",
            Self::Induced => "induced collisions",
            Self::CollidedWithout => "collisions in the baseline",
            Self::Collided => "collisions in the arm under test",
        }
    }

    /// Returns whether the event happened; `None` if an arm has no outcome.
    fn of(self, record: &Record) -> Option<bool> {
        let tallies = record.tallies();
        let (baseline, tested) = (tallies.first()?, tallies.last()?);
        let fate = || PairFate::of(baseline, tested);
        match self {
            Self::Prevented => Some(fate()? == PairFate::Prevented),
            Self::Induced => Some(fate()? == PairFate::Induced),
            Self::CollidedWithout => baseline.collided.filter(|_| tested.collided.is_some()),
            Self::Collided => tested.collided.filter(|_| baseline.collided.is_some()),
        }
    }
}

/// The counts of events by class of each parameter.
#[derive(Clone, Debug)]
pub struct InfluenceCounts {
    events: &'static [Event],
    /// The parameters that vary.
    parameters: Vec<(String, Distribution)>,
    variation: Variation,
    /// For each event: the counts of each parameter.
    counts: Vec<Vec<ClassCounts>>,
}

/// The influence of the parameters on one event.
#[derive(Clone, Debug, PartialEq)]
pub struct EventInfluence {
    /// The event.
    pub event: Event,
    /// Number of samples.
    pub samples: u64,
    /// Number of samples with the event.
    pub events: u64,
    /// The parameters, the one with the largest index first; `None` if there are too few events.
    pub parameters: Option<Vec<(String, Influence)>>,
}

impl InfluenceCounts {
    pub(super) fn new(space: &ParameterSpace, is_paired: bool) -> Self {
        let events: &[Event] = if is_paired { &Event::PAIRED } else { &Event::SINGLE };
        let parameters: Vec<(String, Distribution)> =
            space.varying().map(|(name, entry)| (name.as_str().to_owned(), entry.distribution.clone())).collect();
        let empty = |(_, distribution): &(String, Distribution)| match distribution.labels().len() {
            0 => ClassCounts::continuous(),
            labels => ClassCounts::labels(labels),
        };
        let counts = vec![parameters.iter().map(empty).collect(); events.len()];
        Self { events, parameters, variation: space.variation(), counts }
    }

    pub(super) fn push(&mut self, record: &Record) {
        let Some(outcome) = record.arms.iter().find_map(|arm| arm.result.as_ref().ok()) else { return };
        let of_parameters: Vec<Option<usize>> =
            self.parameters.iter().map(|(name, distribution)| class(name, distribution, &outcome.parameters)).collect();
        for (event, counts) in self.events.iter().zip(&mut self.counts) {
            let Some(happened) = event.of(record) else { continue };
            for (counts, class) in counts.iter_mut().zip(&of_parameters) {
                if let Some(class) = class {
                    // The points of a low-discrepancy sequence have a pattern in their numbers: a
                    // hash has none.
                    counts.push(*class, split_mix(record.sample), happened);
                }
            }
        }
    }

    /// Returns the influence of the parameters on each event.
    ///
    /// # Errors
    /// The reason for which nothing can be said.
    pub fn events(&self, design: Design) -> Result<Vec<EventInfluence>, &'static str> {
        match (design, self.variation) {
            (_, Variation::None) => return Err("no parameter varies"),
            (_, Variation::Discrete) => {
                return Err("the parameters take few values, so that samples repeat each other");
            }
            (Design::Grid, _) => return Err("the points of a grid are not random samples"),
            (Design::Coverage, _) => return Err("samples that visit bins in turn are not random samples"),
            (Design::Random | Design::Sobol, Variation::Continuous) => {}
        }
        Ok(self.events.iter().zip(&self.counts).map(|(event, counts)| self.of_event(*event, counts)).collect())
    }

    fn of_event(&self, event: Event, counts: &[ClassCounts]) -> EventInfluence {
        let [samples, events] = counts.first().map_or([0; 2], ClassCounts::total);
        let parameters = self
            .parameters
            .iter()
            .zip(counts)
            .filter_map(|((name, _), counts)| Some((name.clone(), counts.influence()?)));
        let mut parameters: Vec<(String, Influence)> = parameters.collect();
        parameters.sort_by(|(_, a), (_, b)| b.index.value.total_cmp(&a.index.value));
        EventInfluence { event, samples, events, parameters: (!parameters.is_empty()).then_some(parameters) }
    }
}

impl EventInfluence {
    /// Returns the rates of the event in the first and in the last class of a parameter.
    pub fn from_to(&self, influence: &Influence) -> String {
        let rate = |rate: Option<&closecall_traffic::statistics::sensitivity::jackknife::Estimate>| {
            rate.map_or_else(|| "-".to_owned(), |rate| percent(rate.value))
        };
        format!("{} → {}", rate(influence.rates.first()), rate(influence.rates.last()))
    }
}

/// Returns the class of a parameter's value: one of equally probable parts of its distribution, or
/// its label.
fn class(name: &str, distribution: &Distribution, parameters: &Parameters) -> Option<usize> {
    match parameters.iter().find(|(parameter, _)| parameter.as_str() == name)?.1 {
        Value::Label(label) => distribution.labels().iter().position(|candidate| candidate == label),
        Value::Number(value) => {
            let share = distribution.cdf(*value)? * CLASSES as f64;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a probability; a cast saturates"
            )]
            let class = share as usize;
            share.is_finite().then(|| class.min(CLASSES - 1))
        }
    }
}
