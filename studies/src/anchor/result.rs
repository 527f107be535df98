//! The result of the study: a row for each member and each variation, and what follows from them.

use closecall_campaign::sensitivity::RunErrors;
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;

use super::paired::{Happened, Paired};

/// What is compared with crash records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// How often the ego strikes the vehicle ahead.
    Striking,
    /// How often the ego is struck from behind.
    Struck,
}

impl Quantity {
    /// Both quantities.
    pub const ALL: [Self; 2] = [Self::Striking, Self::Struck];

    /// Returns the published ratio of rates, with a warning and emergency braking to without
    /// (Cicchino 2017).
    pub const fn published(self) -> f64 {
        match self {
            Self::Striking => 0.50,
            Self::Struck => 1.20,
        }
    }

    /// Returns the name in words.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Striking => "striking",
            Self::Struck => "being struck from behind",
        }
    }

    /// Returns the name in JSON.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Striking => "striking",
            Self::Struck => "struck",
        }
    }
}

/// The counts of one member or one variation.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The member's name, or what is varied, in words.
    pub name: String,
    /// The setting of a variation.
    pub setting: Option<String>,
    /// Samples with an outcome in both arms.
    pub samples: u64,
    /// Samples in which the ego strikes.
    pub striking: Paired,
    /// Samples in which the ego is struck.
    pub struck: Paired,
}

impl Row {
    /// Returns a row without samples.
    pub(super) fn new(name: String, setting: Option<String>) -> Self {
        Self { name, setting, samples: 0, striking: Paired::default(), struck: Paired::default() }
    }

    /// Counts a sample.
    pub(super) fn add(&mut self, without: Happened, with: Happened) {
        self.samples += 1;
        self.striking.add(without.strikes, with.strikes);
        self.struck.add(without.is_struck, with.is_struck);
    }

    /// Returns the counts of a quantity.
    pub const fn paired(&self, quantity: Quantity) -> &Paired {
        match quantity {
            Quantity::Striking => &self.striking,
            Quantity::Struck => &self.struck,
        }
    }

    /// Returns the ratio if there are enough collisions for a range.
    fn ranged(&self, quantity: Quantity) -> Option<Estimate> {
        let paired = self.paired(quantity);
        paired.ratio().filter(|_| paired.is_enough())
    }
}

/// The result of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Anchor {
    /// The scenario's name.
    pub scenario: String,
    /// The settings that were applied to it.
    pub settings: Vec<String>,
    /// The seed.
    pub seed: u64,
    /// The number of samples of each row.
    pub samples: u64,
    /// The two arms.
    pub controllers: [String; 2],
    /// The scenario's own drivers, then each member that changes them.
    pub members: Vec<Row>,
    /// The members that change nothing in the scenario.
    pub without_effect: Vec<String>,
    /// One assumption changed at a time.
    pub variations: Vec<Row>,
    /// Samples without an outcome.
    pub errors: RunErrors,
}

impl Anchor {
    /// Returns the smallest and the largest ratio of the members that have enough collisions;
    /// `None` if none has.
    pub fn range(&self, quantity: Quantity) -> Option<[f64; 2]> {
        let ratios = self.members.iter().filter_map(|row| row.ranged(quantity)).map(|ratio| ratio.value);
        ratios.fold(None, |range: Option<[f64; 2]>, ratio| {
            let [low, high] = range.unwrap_or([ratio; 2]);
            Some([low.min(ratio), high.max(ratio)])
        })
    }

    /// Returns whether the range covers the published ratio; `None` if there is no range.
    pub fn covers(&self, quantity: Quantity) -> Option<bool> {
        self.range(quantity).map(|[low, high]| low <= quantity.published() && quantity.published() <= high)
    }

    /// Returns the members whose 95 % interval contains the published ratio.
    pub fn agreeing(&self, quantity: Quantity) -> impl Iterator<Item = &str> {
        let agrees = move |row: &&Row| row.ranged(quantity).is_some_and(|ratio| ratio.covers(quantity.published()));
        self.members.iter().filter(agrees).map(|row| row.name.as_str())
    }

    /// Returns the variation that moves the ratio furthest from the ratio of the scenario's own
    /// drivers, by its logarithm, with both ratios; `None` if too few collide.
    pub fn mover(&self, quantity: Quantity) -> Option<(&Row, [f64; 2])> {
        let own = self.members.first()?;
        let (of_own, own) = (own.paired(quantity).log_ratio(), own.ranged(quantity)?.value);
        let moved = |row| {
            let ratio = Row::ranged(row, quantity)?.value;
            Some((row, ratio, (Row::paired(row, quantity).log_ratio() - of_own).abs()))
        };
        let furthest = self.variations.iter().filter_map(moved).max_by(|one, other| one.2.total_cmp(&other.2));
        furthest.map(|(row, ratio, _)| (row, [own, ratio]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, without: u64, with: u64) -> Row {
        let both = without.min(with);
        let paired = Paired { both, only_without: without - both, only_with: with - both };
        Row { striking: paired, struck: paired, samples: 1_000, ..Row::new(name.to_owned(), None) }
    }

    fn anchor(members: Vec<Row>, variations: Vec<Row>) -> Anchor {
        Anchor {
            scenario: "a".to_owned(),
            settings: Vec::new(),
            seed: 1,
            samples: 1_000,
            controllers: ["human-aeb".to_owned(), "human+aeb".to_owned()],
            members,
            without_effect: Vec::new(),
            variations,
            errors: RunErrors::default(),
        }
    }

    #[test]
    fn the_range_is_of_the_members_with_enough_collisions() {
        let anchor = anchor(vec![row("own", 100, 45), row("slow", 100, 110), row("alert", 9, 90)], vec![]);
        assert_eq!(anchor.range(Quantity::Striking), Some([0.45, 1.1]));
        assert_eq!([Quantity::Striking, Quantity::Struck].map(|of| anchor.covers(of)), [Some(true), Some(false)]);
        assert_eq!(anchor.agreeing(Quantity::Striking).collect::<Vec<_>>(), ["own"]);
        assert_eq!(self::anchor(vec![row("own", 9, 9)], vec![]).covers(Quantity::Struck), None);
    }

    #[test]
    fn the_mover_is_furthest_by_the_logarithm() {
        let variations = vec![row("to a half", 100, 50), row("by a half", 100, 150), row("few", 9, 90)];
        let anchor = anchor(vec![row("own", 100, 100)], variations);
        let (mover, ratios) = anchor.mover(Quantity::Struck).unwrap();
        assert_eq!((mover.name.as_str(), ratios), ("to a half", [1.0, 0.5]));
    }
}
