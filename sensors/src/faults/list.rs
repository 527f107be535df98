//! The checked faults of each sensor, and which of them hold at an instant.

use closecall_traffic::{ConfigError, Num, Parameters, Problem, Range, Side, Time};

use super::{LidarFault, ObjectFault, OdometryErrors, RadarFault};
use crate::camera::CameraFault;

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
            let problem = Problem::WrongCount { value: configs.len() as u64, allowed: "at most four entries" };
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
    fn throughout(self) -> Self {
        let always = |entry: Entry<T>| Entry { from_s: f64::NEG_INFINITY, until_s: f64::INFINITY, ..entry };
        Self { entries: self.entries.map(|entry| entry.map(always)) }
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

impl FaultList<LidarFault> {
    /// Returns the entries of the sensor with this name: the entries that name it, and the entries
    /// that name no sensor.
    pub(crate) fn of_sensor(self, name: &str) -> Self {
        let is_own = |entry: &Entry<LidarFault>| entry.effect.sensor.is_none_or(|sensor| sensor == name);
        Self { entries: self.entries.map(|entry| entry.filter(is_own)) }
    }

    /// Returns the names of sensors that the entries have.
    pub(crate) fn sensors(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.entries.into_iter().flatten().filter_map(|entry| entry.effect.sensor)
    }
}

impl FaultList<RadarFault> {
    /// Returns the entries of the radar on this side: the entries that name it, and the entries
    /// that name no side.
    pub(crate) fn of_side(self, side: Side) -> Self {
        let is_own = |entry: &Entry<RadarFault>| entry.effect.side.is_none_or(|of| of == side);
        Self { entries: self.entries.map(|entry| entry.filter(is_own)) }
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

/// The checked faults of all sensors. None by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    pub(crate) rear_lidar: FaultList<LidarFault>,
    pub(crate) front_lidar: FaultList<LidarFault>,
    pub(crate) rear_camera: FaultList<CameraFault>,
    pub(crate) front_radar: FaultList<ObjectFault>,
    pub(crate) surround: FaultList<ObjectFault>,
    pub(crate) rear_object: FaultList<ObjectFault>,
    pub(crate) rear_radar: FaultList<RadarFault>,
    /// The errors of the ego's odometry and map.
    pub odometry: OdometryErrors,
}

impl Faults {
    /// Returns whether a fault concerns the sensors that look back, or the odometry and the map
    /// that all sensors depend on.
    pub fn concern_rear(&self) -> bool {
        let has_sensor = !(self.rear_lidar.is_empty() && self.rear_camera.is_empty() && self.rear_object.is_empty());
        has_sensor || !self.rear_radar.is_empty() || !self.odometry.is_none()
    }

    /// Returns whether odometry and map are all that is wrong: such faults act in each mode of the
    /// sensors.
    pub fn concern_odometry_only(&self) -> bool {
        !self.odometry.is_none() && *self == Self { odometry: self.odometry, ..Self::default() }
    }

    /// Returns the same faults, each from before the start of the run to its end.
    #[must_use]
    pub fn throughout(self) -> Self {
        Self {
            rear_lidar: self.rear_lidar.throughout(),
            front_lidar: self.front_lidar.throughout(),
            rear_camera: self.rear_camera.throughout(),
            front_radar: self.front_radar.throughout(),
            surround: self.surround.throughout(),
            rear_object: self.rear_object.throughout(),
            rear_radar: self.rear_radar.throughout(),
            odometry: self.odometry.throughout(),
        }
    }
}
