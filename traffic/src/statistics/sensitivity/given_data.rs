//! The first-order index of a parameter for an event, from samples that were drawn for another
//! purpose.
//!
//! ```text
//!   parameter ─▶ class: one of 8 equally probable parts of its distribution, or one of its labels
//!   index = share of the event's variance between the classes, corrected for what chance puts there
//! ```
//!
//! The share between classes is the correlation ratio, the estimator of Plischke, Borgonovo and
//! Smith (2013). For a parameter without influence, the uncorrected index would be (classes −
//! 1)/(samples − 1). The correction follows T. L. Kelley, *An unbiased correlation ratio measure*,
//! PNAS 21 (1935) 554–559. Classes hide what happens within them: the index is a lower bound of the
//! first-order Sobol' index. If the event depends linearly on the parameter, eight classes hide
//! 1/64 of it.

use super::jackknife::{Estimate, REPLICATES, jackknife};
use crate::statistics::interval::{COVERAGE, clopper_pearson};

/// Number of classes of a continuous parameter.
pub const CLASSES: usize = 8;
/// Number of classes if there are few events.
const FEW_CLASSES: usize = 4;
/// Least mean number of events, and of samples without the event, in a class: the usual rule for
/// tables of counts (W. G. Cochran, *Some methods for strengthening the common χ² tests*,
/// Biometrics 10 (1954) 417–451).
const MIN_PER_CLASS: u64 = 5;

/// Counts of an event over the classes of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassCounts {
    /// The number of samples and of events, by class and replicate.
    counts: Vec<[[u64; 2]; REPLICATES]>,
    /// Whether adjacent classes may be merged, as for a continuous parameter.
    is_continuous: bool,
}

/// The influence of a parameter on an event.
#[derive(Clone, Debug, PartialEq)]
pub struct Influence {
    /// The first-order index.
    pub index: Estimate,
    /// The probability of the event in each class in use, with its exact interval.
    pub rates: Vec<Estimate>,
}

impl ClassCounts {
    /// Returns counts of no samples for a continuous parameter.
    pub fn continuous() -> Self {
        Self { counts: vec![[[0; 2]; REPLICATES]; CLASSES], is_continuous: true }
    }

    /// Returns counts of no samples for a parameter with this number of labels.
    pub fn labels(labels: usize) -> Self {
        Self { counts: vec![[[0; 2]; REPLICATES]; labels], is_continuous: false }
    }

    /// Adds a sample. `number` assigns it to a replicate, and must not depend on the parameters. A
    /// class that does not exist is ignored.
    pub fn push(&mut self, class: usize, number: u64, is_event: bool) {
        if let Some(of_class) = self.counts.get_mut(class) {
            let [samples, events] = &mut of_class[(number % REPLICATES as u64) as usize];
            *samples += 1;
            *events += u64::from(is_event);
        }
    }

    /// Returns the number of samples and of events.
    pub fn total(&self) -> [u64; 2] {
        self.counts.iter().flatten().fold([0; 2], |[samples, events], [more, hits]| [samples + more, events + hits])
    }

    /// Returns the influence of the parameter on the event; `None` if there are too few events, or
    /// too few samples without it.
    pub fn influence(&self) -> Option<Influence> {
        let [samples, events] = self.total();
        let per_class = |classes: usize| events.min(samples - events) / classes.max(1) as u64;
        let counts = if per_class(self.counts.len()) >= MIN_PER_CLASS {
            self.counts.clone()
        } else if self.is_continuous && per_class(FEW_CLASSES) >= MIN_PER_CLASS {
            self.counts.chunks(CLASSES / FEW_CLASSES).map(merged).collect()
        } else {
            return None;
        };
        let rate = |of_class: &[[u64; 2]; REPLICATES]| {
            let [samples, events] = sum(of_class);
            let interval_95 = clopper_pearson(events, samples, COVERAGE);
            (samples > 0).then(|| Estimate { value: events as f64 / samples as f64, interval_95 })
        };
        Some(Influence { index: index(&counts)?, rates: counts.iter().filter_map(rate).collect() })
    }
}

fn sum(of_class: &[[u64; 2]; REPLICATES]) -> [u64; 2] {
    of_class.iter().fold([0; 2], |[samples, events], [more, hits]| [samples + more, events + hits])
}

fn merged(classes: &[[[u64; 2]; REPLICATES]]) -> [[u64; 2]; REPLICATES] {
    let mut all = [[0; 2]; REPLICATES];
    for class in classes {
        for ([samples, events], [more, hits]) in all.iter_mut().zip(class) {
            *samples += more;
            *events += hits;
        }
    }
    all
}

/// Returns Kelley's ε² of the counts by class and replicate.
fn index(counts: &[[[u64; 2]; REPLICATES]]) -> Option<Estimate> {
    // One array holds the sums of up to 8 classes; further labels share the last place.
    let mut replicates = [[0.0; 2 * CLASSES]; REPLICATES];
    for (class, of_class) in counts.iter().enumerate() {
        let place = 2 * class.min(CLASSES - 1);
        for (sums, [samples, events]) in replicates.iter_mut().zip(of_class) {
            sums[place] += *samples as f64;
            sums[place + 1] += *events as f64;
        }
    }
    jackknife(&replicates, |sums| {
        let classes = || sums.chunks_exact(2).filter(|class| class[0] > 0.0);
        let (samples, events): (f64, f64) = classes().fold((0.0, 0.0), |(n, k), class| (n + class[0], k + class[1]));
        let squares = |n: f64, k: f64| k * (n - k) / n;
        let within: f64 = classes().map(|class| squares(class[0], class[1])).sum();
        let (all, used) = (squares(samples, events), classes().count() as f64);
        (all > 0.0 && samples > used).then(|| 1.0 - within / (samples - used) * (samples - 1.0) / all)
    })
}
