//! The checked faults of one sensor, and which of them hold at an instant.

use closecall_traffic::{ConfigError, Num, Parameters, Problem, Range, Time};

/// Maximum number of entries of one sensor.
const MAX_ENTRIES: usize = 4;
/// Latest start or end of a fault (s): the longest duration of a run.
const MAX_TIME_S: f64 = 3_600.0;

/// Effects that can be combined if several entries hold at once.
pub(crate) trait Combine: Copy + PartialEq {
    /// Returns both effects together.
    fn and(self, other: Self) -> Self;
}

/// The entries of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FaultList<T> {
    entries: [Option<Entry<T>>; MAX_ENTRIES],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry<T> {
    from_s: f64,
    until_s: f64,
    effect: T,
}

impl<T: Copy> Default for FaultList<T> {
    fn default() -> Self {
        Self { entries: [None; MAX_ENTRIES] }
    }
}

impl<T: Combine> FaultList<T> {
    /// Checks the entries of the list `key`, which `check` turns into effects with their `from-s`
    /// and `until-s`.
    pub(crate) fn check<C>(
        key: &str,
        configs: &[C],
        check: impl Fn(&C) -> Result<(T, [f64; 2]), ConfigError>,
    ) -> Result<Self, ConfigError> {
        if configs.len() > MAX_ENTRIES {
            let problem = Problem::WrongLength { value: configs.len() as u64, allowed: "at most 4" };
            return Err(ConfigError::new(key, problem));
        }
        let mut list = Self::default();
        for (index, (slot, config)) in list.entries.iter_mut().zip(configs).enumerate() {
            let (effect, [from_s, until_s]) = check(config).map_err(|error| error.within_index(index).within(key))?;
            *slot = Some(Entry { from_s, until_s, effect });
        }
        Ok(list)
    }

    /// Returns whether there is no entry.
    pub(crate) fn is_empty(&self) -> bool {
        self.entries.iter().all(Option::is_none)
    }

    /// Returns what holds at `time`: all entries together whose time has begun and has not ended.
    /// `None` if there is none.
    pub(crate) fn at(&self, time: Time) -> Option<T> {
        self.held(time.s()).map(|entry| entry.effect).reduce(T::and)
    }

    /// Returns the time since the latest entry began that holds at `time` and has the effect `has`
    /// (s); `None` if none holds. An entry without a start begins with the run.
    pub(crate) fn since_s(&self, time: Time, has: impl Fn(&T) -> bool) -> Option<f64> {
        let supplier = self.held(time.s()).filter(|entry| has(&entry.effect)).last();
        supplier.map(|entry| time.s() - entry.from_s.max(0.0))
    }

    /// Returns the same entries with other effects.
    pub(crate) fn map(self, change: impl Fn(T) -> T) -> Self {
        let changed = |entry: Entry<T>| Entry { effect: change(entry.effect), ..entry };
        Self { entries: self.entries.map(|entry| entry.map(changed)) }
    }

    /// Returns the same entries, each from before the start of the run to its end.
    pub(super) fn throughout(self) -> Self {
        let always = |entry: Entry<T>| Entry { from_s: f64::NEG_INFINITY, until_s: f64::INFINITY, ..entry };
        Self { entries: self.entries.map(|entry| entry.map(always)) }
    }

    /// Returns the entries with the effects that `keeps` keeps.
    pub(super) fn only(self, keeps: impl Fn(&T) -> bool) -> Self {
        Self { entries: self.entries.map(|entry| entry.filter(|entry| keeps(&entry.effect))) }
    }

    /// Returns the effect of each entry with its begin and its end (s).
    pub(crate) fn spans(&self) -> impl Iterator<Item = (T, [f64; 2])> + '_ {
        self.entries.iter().flatten().map(|entry| (entry.effect, [entry.from_s, entry.until_s]))
    }

    /// Returns everything that holds together at some time, each with the index of the entry that
    /// begins or ends then.
    pub(crate) fn combinations(&self) -> impl Iterator<Item = (usize, T)> {
        let entries =
            self.entries.iter().enumerate().filter_map(|(index, entry)| entry.as_ref().map(|fault| (index, fault)));
        let instants_s = entries.flat_map(|(index, fault)| [fault.from_s, fault.until_s].map(|time_s| (index, time_s)));
        instants_s
            .filter_map(|(index, time_s)| Some((index, self.held(time_s).map(|entry| entry.effect).reduce(T::and)?)))
    }

    fn held(&self, time_s: f64) -> impl Iterator<Item = &Entry<T>> {
        self.entries.iter().flatten().filter(move |entry| entry.from_s <= time_s && time_s < entry.until_s)
    }
}

#[cfg(test)]
impl<T: Combine> FaultList<T> {
    /// Returns the list of one fault that always holds.
    pub(crate) fn throughout_of(effect: T) -> Self {
        let mut list = Self::default();
        list.entries[0] = Some(Entry { from_s: f64::NEG_INFINITY, until_s: f64::INFINITY, effect });
        list
    }
}

/// Checks start and end of an entry. Without them, it holds from before the start of the run, or to
/// its end.
pub(super) fn check_span([from, until]: [&Option<Num>; 2], parameters: &Parameters) -> Result<[f64; 2], ConfigError> {
    let number = |num: &Option<Num>, key, default| {
        parameters.number_or(num.as_ref(), key, Range::closed(0.0, MAX_TIME_S), default)
    };
    let span = [number(from, "from-s", f64::NEG_INFINITY)?, number(until, "until-s", f64::INFINITY)?];
    if !(span[0] < span[1]) {
        let rule = "a fault ends after it has begun".to_owned();
        return Err(ConfigError::new("until-s", Problem::Contradiction { other: "from-s", rule }));
    }
    Ok(span)
}
