//! The selection of samples for which a campaign saves a recording.
//!
//! ```text
//!  worst:5,failures:20,random:3
//! ```
//!
//! - *worst*: the samples with the hardest collisions of the ego, then those with the smallest time
//!   headways, without uneventful ones, in which no vehicle collides and no moment of the encounter
//!   is reached (*random* may draw these);
//! - *failures*: the first samples in which the ego collided. Those that the system induced, in
//!   which the ego of the baseline did not collide, precede all others;
//! - *random*: samples drawn at random, which show the usual case.
//!
//! All of this refers to the arm under test, and the counts are for each scenario. A count alone is
//! the count of failures. A sample that is selected for several reasons is recorded once.
//!
//! The word `each-kind` stands for at most three samples of the whole campaign: the worst collision
//! that the system prevented, the worst that it induced, and the worst that happens in both arms.
//! The measure is the harm ([`closecall_scenarios::harm`]) in the arm that collides: the baseline
//! for a prevented collision, else the arm under test. If no sample is of any of the three kinds,
//! as in a campaign with one controller, the worst sample as above stands for them.

use std::collections::BTreeMap;
use std::str::FromStr;

use closecall_scenarios::outcome::Outcome;
use closecall_traffic::{ActorId, Measured, stream};
use rand::RngExt;

use super::ledger::PairFate;
use super::record::{ArmRecord, Record};

/// The channel of the random stream.
const CHANNEL: &str = "recordings";

/// The number of samples of each kind for which a recording is saved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Number of the most critical samples.
    pub worst: u64,
    /// Number of samples in which the ego collided, the first ones.
    pub failures: u64,
    /// Number of samples drawn at random.
    pub random: u64,
    /// True for the worst sample of each kind of the whole campaign.
    pub each_kind: bool,
}

/// The word for the worst sample of each kind.
const EACH_KIND: &str = "each-kind";

impl Selection {
    /// Returns true if no sample is selected.
    pub const fn is_empty(&self) -> bool {
        self.worst == 0 && self.failures == 0 && self.random == 0 && !self.each_kind
    }
}

impl FromStr for Selection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(failures) = text.parse() {
            return Ok(Self { failures, ..Self::default() });
        }
        let mut selection = Self::default();
        let mut named: Vec<&str> = Vec::new();
        for part in text.split(',').map(str::trim) {
            let wrong = || format!("`{part}` is not `each-kind`, `worst:N`, `failures:N` or `random:N`");
            let (kind, count) = if part == EACH_KIND { (part, "1") } else { part.split_once(':').ok_or_else(wrong)? };
            let count = count.parse().map_err(|_| wrong())?;
            if named.contains(&kind) {
                return Err(format!("`{kind}` is named twice"));
            }
            named.push(kind);
            match kind {
                EACH_KIND if part == EACH_KIND => selection.each_kind = true,
                "worst" => selection.worst = count,
                "failures" => selection.failures = count,
                "random" => selection.random = count,
                _ => return Err(wrong()),
            }
        }
        Ok(selection)
    }
}

impl std::fmt::Display for Selection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let each_kind = if self.each_kind { ",each-kind" } else { "" };
        write!(f, "worst:{},failures:{},random:{}{each_kind}", self.worst, self.failures, self.random)
    }
}

/// A selected sample, and the reasons for which it was selected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// The sample's number.
    pub sample: u64,
    /// The kinds for which it was selected: `worst`, `failure`, `random`, and the words of
    /// [`Kind`].
    pub reasons: Vec<&'static str>,
}

/// The kind of a sample. The worst sample of each kind is selected from a whole campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The system prevents the collision.
    Prevented,
    /// The system induces the collision.
    Induced,
    /// There is a collision in both arms.
    Both,
    /// No sample is of any of these kinds: the sample with the hardest collision, else with the
    /// smallest time headway.
    Any,
}

impl Kind {
    /// Returns the words for the worst sample of this kind.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::Prevented => "worst prevented collision",
            Self::Induced => "worst induced collision",
            Self::Both => "worst collision in both arms",
            Self::Any => "worst sample",
        }
    }
}

/// Selects the worst sample of each kind of a campaign, whose records are passed to it one by one.
#[derive(Debug, Default)]
pub struct KindChooser {
    /// The worst sample so far of each of [`KINDS`], with its harm.
    worst: [Option<(f64, String, u64)>; 3],
    /// The worst sample so far, whatever its kind, and its scenario.
    any: Option<(Severity, String)>,
}

/// The kinds in the order in which their samples are named.
const KINDS: [Kind; 3] = [Kind::Prevented, Kind::Induced, Kind::Both];

impl KindChooser {
    /// Adds a sample. A sample that ended in an error in any arm is left out, since it cannot be
    /// recorded.
    ///
    /// The runs themselves, which a recording shows, determine the kind. The validity checks do not
    /// change it.
    pub fn push(&mut self, record: &Record) {
        let outcomes: Option<Vec<&Outcome>> = record.arms.iter().map(|arm| arm.result.as_ref().ok()).collect();
        let (Some(outcomes), Some(tested)) = (outcomes, record.arms.last()) else { return };
        let tested = tested.tally();
        if let [baseline, _, ..] = &record.arms[..] {
            let baseline = baseline.tally();
            let candidate = match PairFate::of(&baseline, &tested) {
                Some(PairFate::Prevented) => Some((0, baseline.harm)),
                Some(PairFate::Induced) => Some((1, tested.harm)),
                Some(PairFate::Both) => Some((2, tested.harm)),
                Some(PairFate::Neither) | None => None,
            };
            if let Some((kind, harm)) = candidate
                && self.worst[kind].as_ref().is_none_or(|(worst, ..)| harm > *worst)
            {
                self.worst[kind] = Some((harm, record.scenario.clone(), record.sample));
            }
        }
        let severity = outcomes.last().map(|outcome| severity(record.sample, outcome));
        if let Some(severity) = severity.filter(|severity| severity.is_eventful)
            && self.any.as_ref().is_none_or(|(worst, _)| measure(&severity, worst).is_gt())
        {
            self.any = Some((severity, record.scenario.clone()));
        }
    }

    /// Returns the worst sample of each kind: its scenario and its number. Of two equal samples the
    /// earlier one is the worse.
    pub fn choose(&self) -> Vec<(Kind, &str, u64)> {
        let kinds = KINDS.into_iter().zip(&self.worst);
        let samples =
            kinds.filter_map(|(kind, worst)| worst.as_ref().map(|(_, name, sample)| (kind, &**name, *sample)));
        let samples: Vec<_> = samples.collect();
        if !samples.is_empty() {
            return samples;
        }
        self.any.iter().map(|(severity, name)| (Kind::Any, &**name, severity.sample)).collect()
    }
}

/// The severity of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Severity {
    sample: u64,
    /// Change of the ego's velocity in its hardest collision (m/s); `None` if the ego did not
    /// collide.
    delta_v_mps: Option<f64>,
    /// Smallest time headway in front of and behind the ego (s).
    thw_s: f64,
    /// True if the ego of the baseline did not collide.
    is_safe_in_baseline: bool,
    /// True if a vehicle collided or a moment of the encounter was reached.
    is_eventful: bool,
}

/// Selects samples of one scenario, whose records are passed to it one by one. Its memory grows
/// with the selection, not with the samples.
#[derive(Debug)]
pub struct Chooser {
    selection: Selection,
    /// The worst samples, the worst first.
    worst: Vec<Severity>,
    /// The first samples in which the ego collided: induced collisions, and the others.
    induced: Vec<u64>,
    others: Vec<u64>,
    samples: SpacedNumbers,
}

impl Chooser {
    /// Returns a chooser without samples.
    pub fn new(selection: Selection) -> Self {
        let (worst, induced, others) = (Vec::new(), Vec::new(), Vec::new());
        Self { selection, worst, induced, others, samples: SpacedNumbers::default() }
    }

    /// Adds a sample. A sample that ended in an error in any arm is left out, since it cannot be
    /// recorded.
    pub fn push(&mut self, record: &Record) {
        let has_failed = record.arms.iter().any(|arm| arm.result.is_err());
        if let (false, Some(ArmRecord { result: Ok(outcome), .. })) = (has_failed, record.arms.last()) {
            let is_safe_in_baseline = match &record.arms[..] {
                [baseline, .., _] => baseline.result.as_ref().is_ok_and(|outcome| !outcome.ego_collided()),
                _ => false,
            };
            self.add(Severity { is_safe_in_baseline, ..severity(record.sample, outcome) });
        }
    }

    fn add(&mut self, severity: Severity) {
        self.samples.push(severity.sample);
        if severity.delta_v_mps.is_some() {
            let failures = if severity.is_safe_in_baseline { &mut self.induced } else { &mut self.others };
            if failures.len() < count(self.selection.failures) {
                failures.push(severity.sample);
            }
        }
        let index = self.worst.partition_point(|worse| compare(worse, &severity).is_ge());
        if severity.is_eventful && index < count(self.selection.worst) {
            self.worst.insert(index, severity);
            self.worst.truncate(count(self.selection.worst));
        }
    }

    /// Returns the selected samples: the worst first, then the failures and the random ones, each
    /// in the order of their numbers. `seed` and `ego` key the random stream.
    pub fn choose(&self, seed: u64, ego: &ActorId) -> Vec<Chosen> {
        let mut chosen: Vec<Chosen> = Vec::new();
        let mut add = |sample: u64, reason: &'static str| match chosen.iter_mut().find(|chosen| chosen.sample == sample)
        {
            Some(sample_entry) => sample_entry.reasons.push(reason),
            None => chosen.push(Chosen { sample, reasons: vec![reason] }),
        };
        self.worst.iter().for_each(|severity| add(severity.sample, "worst"));
        let failures = self.induced.iter().chain(&self.others);
        failures.take(count(self.selection.failures)).for_each(|sample| add(*sample, "failure"));
        let mut drawn = self.samples.draw(count(self.selection.random), &mut stream(seed, 0, ego, CHANNEL));
        drawn.sort_unstable();
        drawn.into_iter().for_each(|sample| add(sample, "random"));
        chosen
    }
}

/// Returns a number of samples as a length of a list.
fn count(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

/// Numbers in the order in which they came, most of them equally spaced.
#[derive(Debug, Default)]
struct SpacedNumbers {
    runs: Vec<Run>,
    len: usize,
}

/// Equally spaced numbers.
#[derive(Debug)]
struct Run {
    first: u64,
    spacing: u64,
    len: usize,
}

impl SpacedNumbers {
    fn push(&mut self, number: u64) {
        self.len += 1;
        if let Some(run) = self.runs.last_mut() {
            if run.len == 1 {
                run.spacing = number.wrapping_sub(run.first);
            }
            if run.at(run.len) == number {
                run.len += 1;
                return;
            }
        }
        self.runs.push(Run { first: number, spacing: 0, len: 1 });
    }

    fn at(&self, mut index: usize) -> Option<u64> {
        self.runs.iter().find_map(|run| {
            let number = (index < run.len).then(|| run.at(index));
            index = index.wrapping_sub(run.len);
            number
        })
    }

    /// Draws numbers without replacement; all of them if there are not as many. Each drawn one
    /// changes places with the last one that is left.
    fn draw(&self, most: usize, rng: &mut impl RngExt) -> Vec<u64> {
        let mut moved = BTreeMap::new();
        let number = |draw: usize| {
            let left = self.len - 1 - draw;
            let index = rng.random_range(0..=left);
            let last = moved.get(&left).copied().unwrap_or(left);
            self.at(moved.insert(index, last).unwrap_or(index))
        };
        (0..most.min(self.len)).filter_map(number).collect()
    }
}

impl Run {
    fn at(&self, index: usize) -> u64 {
        self.first.wrapping_add(self.spacing.wrapping_mul(index as u64))
    }
}

fn severity(sample: u64, outcome: &Outcome) -> Severity {
    let finite = |value: Measured| value.ok().filter(|value| value.is_finite());
    let margins = [outcome.margins.min_thw_front_s, outcome.margins.min_thw_rear_s];
    let thw_s = margins.into_iter().filter_map(finite).fold(f64::INFINITY, f64::min);
    let is_eventful = !outcome.collisions.is_empty() || !outcome.moments.is_empty();
    Severity { sample, delta_v_mps: outcome.ego_delta_v_mps(), thw_s, is_safe_in_baseline: false, is_eventful }
}

/// Compares by the change of velocity, then by the time headway. Of two equal samples the earlier
/// one is the worse.
fn compare(a: &Severity, b: &Severity) -> std::cmp::Ordering {
    measure(a, b).then(b.sample.cmp(&a.sample))
}

/// Compares by the change of velocity, then by the time headway.
fn measure(a: &Severity, b: &Severity) -> std::cmp::Ordering {
    let collided = |severity: &Severity| severity.delta_v_mps.unwrap_or(f64::NEG_INFINITY);
    collided(a).total_cmp(&collided(b)).then(b.thw_s.total_cmp(&a.thw_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_selection_is_parsed_and_printed() {
        let read = |text: &str| text.parse::<Selection>();
        let counts = Selection { worst: 5, failures: 20, random: 3, each_kind: false };
        assert_eq!(read("worst:5,failures:20,random:3"), Ok(counts));
        assert_eq!(read("each-kind"), Ok(Selection { each_kind: true, ..Selection::default() }));
        assert_eq!(
            read("each-kind,failures:2"),
            Ok(Selection { failures: 2, each_kind: true, ..Selection::default() })
        );
        assert_eq!(read("failures:0"), Ok(Selection::default()));
        assert_eq!(read("4"), read("failures:4"));
        let selection = Selection { worst: 1, failures: 0, random: 2, each_kind: true };
        assert_eq!(selection.to_string().parse(), Ok(selection));
        for wrong in [
            "",
            "worst",
            "worst:-1",
            "best:3",
            "worst:1,worst:2",
            "random:1;worst:1",
            "each-kind:2",
            "each-kind,each-kind",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    fn eventful(samples: &[(Option<f64>, f64)]) -> Vec<Severity> {
        let severity = |(&(delta_v_mps, thw_s), sample): (&(Option<f64>, f64), u64)| Severity {
            sample,
            delta_v_mps,
            thw_s,
            is_safe_in_baseline: false,
            is_eventful: true,
        };
        samples.iter().zip(0..).map(severity).collect()
    }

    fn chooser(selection: Selection, samples: Vec<Severity>) -> Chooser {
        let mut chooser = Chooser::new(selection);
        samples.into_iter().for_each(|severity| chooser.add(severity));
        chooser
    }

    #[test]
    fn collisions_are_worse_than_near_misses_and_each_sample_is_selected_once() {
        let samples = [(None, 0.4), (Some(2.0), 0.1), (None, 0.1), (Some(9.0), 0.3)];
        let chosen = chooser(Selection { worst: 3, failures: 1, ..Selection::default() }, eventful(&samples))
            .choose(0, &ActorId::new("ego").unwrap());
        let numbers: Vec<u64> = chosen.iter().map(|chosen| chosen.sample).collect();
        assert_eq!(numbers, [3, 1, 2]);
        assert_eq!(chosen[1].reasons, ["worst", "failure"]);
    }

    #[test]
    fn an_uneventful_sample_is_not_among_the_worst() {
        let selection = Selection { worst: 2, ..Selection::default() };
        let mut samples = eventful(&[(None, 0.7), (None, 0.9)]);
        samples[0].is_eventful = false;
        let chosen = chooser(selection, samples).choose(0, &ActorId::new("ego").unwrap());
        assert_eq!(chosen.iter().map(|chosen| chosen.sample).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn induced_failures_precede_all_others() {
        let mut samples = eventful(&[(Some(9.0), 0.1), (Some(2.0), 0.1), (Some(1.0), 0.1)]);
        samples[2].is_safe_in_baseline = true;
        let chosen = chooser(Selection { failures: 2, ..Selection::default() }, samples)
            .choose(0, &ActorId::new("ego").unwrap());
        let numbers: Vec<u64> = chosen.iter().map(|chosen| chosen.sample).collect();
        assert_eq!(numbers, [2, 0]);
    }

    #[test]
    fn the_seed_determines_the_random_samples_and_none_repeats() {
        let samples = [(None, 1.0); 20];
        let choose = |random, seed| {
            chooser(Selection { random, ..Selection::default() }, eventful(&samples))
                .choose(seed, &ActorId::new("ego").unwrap())
        };
        assert_eq!(choose(5, 1), choose(5, 1));
        assert_ne!(choose(5, 1), choose(5, 2));
        assert_eq!(choose(100, 1).len(), 20);
    }

    #[test]
    fn the_worst_are_those_of_all_samples_sorted() {
        let samples: Vec<(Option<f64>, f64)> =
            (0..500_u32).map(|n| ((n % 7 == 0).then(|| f64::from(n * 37 % 23)), f64::from(n * 71 % 101))).collect();
        let mut sorted = eventful(&samples);
        sorted.sort_by(|a, b| compare(b, a));
        let expected: Vec<u64> = sorted.iter().take(100).map(|severity| severity.sample).collect();
        let chooser = chooser(Selection { worst: 100, failures: 3, ..Selection::default() }, eventful(&samples));
        assert_eq!(chooser.worst.iter().map(|severity| severity.sample).collect::<Vec<_>>(), expected);
        assert_eq!(chooser.others, [0, 7, 14]);
    }

    #[test]
    fn the_draws_are_those_of_a_list_and_the_numbers_take_no_memory() {
        let numbers: Vec<u64> = (0..10_000).map(|n| 3 + 4 * n).filter(|n| n % 1_000 != 7).chain([2, 1]).collect();
        let mut spaced = SpacedNumbers::default();
        numbers.iter().for_each(|number| spaced.push(*number));
        assert!(spaced.runs.len() < 50 && (0..numbers.len()).all(|index| spaced.at(index) == Some(numbers[index])));
        assert_eq!(spaced.at(numbers.len()), None);
        for most in [0, 1, 30, 9_000, 20_000] {
            let rng = || stream(5, 0, &ActorId::new("ego").unwrap(), CHANNEL);
            let (mut left, mut generator, mut drawn) = (numbers.clone(), rng(), Vec::new());
            while drawn.len() < most && !left.is_empty() {
                drawn.push(left.swap_remove(generator.random_range(0..left.len())));
            }
            assert_eq!(spaced.draw(most, &mut rng()), drawn, "{most}");
        }
    }
}
