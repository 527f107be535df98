//! The widths of the lanes of a road: one for all of them, one for each, or the cross-sections of a
//! road whose lanes change ([`super::cross_sections`]).

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::SeqAccessDeserializer;
use serde::de::{self, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::cross_sections::CrossSections;
use crate::{ConfigError, KeyPath, Num, Parameters, Problem, Range, Segment};

/// Largest number of lanes.
pub(super) const MOST_LANES: usize = 8;
/// Widths of a lane that the models cover (m).
pub(super) const WIDTH_M: Range = Range::closed(2.5, 5.0);
/// The key in a scenario file.
const KEY: &str = "lane-width-m";

/// The widths of the lanes as a scenario file describes them: a number, or a list with a number for
/// each lane.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum LaneWidthsConfig {
    /// The width of every lane (m).
    Equal(Num),
    /// The width of each lane, from lane 1 on (m).
    Each(Vec<Num>),
}

impl From<f64> for LaneWidthsConfig {
    fn from(width_m: f64) -> Self {
        Self::Equal(Num::Fixed(width_m))
    }
}

struct WidthsVisitor;

impl<'de> Visitor<'de> for WidthsVisitor {
    type Value = LaneWidthsConfig;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, a parameter such as \"$name\", or a list with one of them for each lane")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<LaneWidthsConfig, E> {
        Num::deserialize(value.into_deserializer()).map(LaneWidthsConfig::Equal)
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<LaneWidthsConfig, E> {
        Num::deserialize(value.into_deserializer()).map(LaneWidthsConfig::Equal)
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<LaneWidthsConfig, E> {
        Num::deserialize(value.into_deserializer()).map(LaneWidthsConfig::Equal)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<LaneWidthsConfig, E> {
        Num::deserialize(text.into_deserializer()).map(LaneWidthsConfig::Equal)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<LaneWidthsConfig, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(LaneWidthsConfig::Each)
    }
}

impl<'de> Deserialize<'de> for LaneWidthsConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WidthsVisitor)
    }
}

impl JsonSchema for LaneWidthsConfig {
    fn schema_name() -> Cow<'static, str> {
        "LaneWidths".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let equal = generator.subschema_for::<Num>();
        let mut each = generator.subschema_for::<Num>();
        each.insert("minimum".to_owned(), WIDTH_M.low().into());
        each.insert("maximum".to_owned(), WIDTH_M.high().into());
        json_schema!({ "anyOf": [equal, { "type": "array", "items": each, "minItems": 1, "maxItems": MOST_LANES }] })
    }
}

impl LaneWidthsConfig {
    /// Checks the widths on a road with this number of lanes.
    pub(super) fn check(&self, lanes: u8, parameters: &Parameters) -> Result<LaneWidths, ConfigError> {
        let widths = match self {
            Self::Equal(num) => return parameters.number(num, KEY, WIDTH_M).map(LaneWidths::Equal),
            Self::Each(widths) => widths,
        };
        if widths.len() != usize::from(lanes) {
            let (count, roads) = (plural(widths.len(), "width"), plural(lanes.into(), "lane"));
            let rule = format!(
                "it has {count} and the road has {roads}: one number for all lanes is needed, or a list with one for \
                 each lane, from lane 1 (leftmost) on"
            );
            return Err(ConfigError::new(KEY, Problem::Contradiction { other: "lanes", rule }));
        }
        let mut widths_m = Vec::new();
        for (index, num) in widths.iter().enumerate() {
            let path = KeyPath(vec![Segment::Key(KEY.to_owned()), Segment::Index(index)]);
            let width_m = parameters.number(num, KEY, WIDTH_M);
            widths_m.push(width_m.map_err(|error| ConfigError { path, ..error })?);
        }
        Ok(LaneWidths::new(&widths_m))
    }
}

pub(super) fn plural(count: usize, name: &str) -> String {
    format!("{count} {name}{}", if count == 1 { "" } else { "s" })
}

/// Checked widths of the lanes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LaneWidths {
    /// The width of every lane (m).
    Equal(f64),
    /// The width of each lane (m), from lane 1 on; 0 beyond the last lane.
    Each([f64; MOST_LANES]),
    /// The boundaries of the lanes along the road.
    Along(CrossSections),
}

impl LaneWidths {
    /// Creates the widths of lanes from lane 1 on (m).
    pub(super) fn new(widths_m: &[f64]) -> Self {
        let first_m = widths_m.first().copied().unwrap_or_default();
        if widths_m.iter().all(|width_m| *width_m == first_m) {
            return Self::Equal(first_m);
        }
        let mut each_m = [0.0; MOST_LANES];
        for (to_m, width_m) in each_m.iter_mut().zip(widths_m) {
            *to_m = *width_m;
        }
        Self::Each(each_m)
    }

    /// Returns the width of a lane at a position along the road (m).
    #[inline]
    pub(super) fn width_m(&self, lane: u8, s_m: f64) -> f64 {
        match self {
            Self::Equal(width_m) => *width_m,
            Self::Each(each_m) => each_m.get(usize::from(lane).wrapping_sub(1)).copied().unwrap_or_default(),
            Self::Along(along) => along.width_m(lane, s_m),
        }
    }

    /// Returns the lateral position of the right edge of lane `number` (m), or of the left edge of
    /// lane 1 if it is 0.
    #[inline]
    pub(super) fn boundary_m(&self, number: u8, s_m: f64) -> f64 {
        match self {
            Self::Equal(width_m) => -f64::from(number) * width_m,
            Self::Each(each_m) => each_m.iter().take(number.into()).fold(0.0, |edge_m, width_m| edge_m - width_m),
            Self::Along(along) => along.boundary_m(number, s_m),
        }
    }

    /// Returns the lateral position of the rightmost place of the right edge of lane `lanes` (m).
    pub(super) fn right_edge_m(&self, lanes: u8) -> f64 {
        match self {
            Self::Equal(_) | Self::Each(_) => self.boundary_m(lanes, 0.0),
            Self::Along(along) => along.right_edge_m(),
        }
    }

    /// Returns the lateral position of the centre of a lane (m).
    #[inline]
    pub(super) fn centre_m(&self, lane: u8, s_m: f64) -> f64 {
        match self {
            Self::Equal(width_m) => -(f64::from(lane) - 0.5) * width_m,
            Self::Each(_) => self.boundary_m(lane, s_m) + 0.5 * self.width_m(lane, s_m),
            Self::Along(along) => along.centre_m(lane, s_m),
        }
    }

    /// Returns the lane of a road of `lanes` lanes in which a lateral position lies; beyond an edge,
    /// the lane at that edge.
    #[inline]
    pub(super) fn lane_at(&self, lanes: u8, s_m: f64, d_m: f64) -> u8 {
        match self {
            Self::Equal(width_m) => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "clamped to 0..=7 before the cast"
                )]
                let before = (-d_m / width_m).clamp(0.0, f64::from(lanes) - 1.0) as u8;
                before + 1
            }
            Self::Each(_) => {
                let passes = |number: &u8| d_m <= self.boundary_m(*number, s_m);
                (1..lanes).take_while(passes).last().unwrap_or_default() + 1
            }
            Self::Along(along) => along.lane_at(lanes, s_m, d_m),
        }
    }

    /// Returns the smallest and the largest width of a lane (m).
    pub(super) fn range_m(&self, lanes: u8) -> [f64; 2] {
        if let Self::Along(along) = self {
            return along.width_range_m(lanes);
        }
        let range = |[low_m, high_m]: [f64; 2], width_m: f64| [low_m.min(width_m), high_m.max(width_m)];
        (1..=lanes).map(|lane| self.width_m(lane, 0.0)).fold([f64::INFINITY, f64::NEG_INFINITY], range)
    }

    /// Returns the widths of the same lanes, counted from the right. `to_m` gives the new position
    /// along the road.
    pub(super) fn reversed(&self, lanes: u8, to_m: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::Equal(width_m) => Self::Equal(*width_m),
            Self::Each(each_m) => {
                let mut each_m = *each_m;
                each_m[..usize::from(lanes)].reverse();
                Self::Each(each_m)
            }
            Self::Along(along) => Self::Along(along.turned(lanes, to_m)),
        }
    }

    /// Returns the widths after a change of each of them (m).
    pub(super) fn changed(&self, lanes: u8, to_m: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::Equal(width_m) => Self::Equal(to_m(*width_m)),
            Self::Each(each_m) => {
                let mut each_m = *each_m;
                each_m.iter_mut().take(lanes.into()).for_each(|width_m| *width_m = to_m(*width_m));
                Self::Each(each_m)
            }
            Self::Along(along) => Self::Along(along.changed(lanes, to_m)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::RoadConfig;
    use super::*;
    use crate::{Check, Lane, Road, Side};

    const WIDTHS_M: [f64; 3] = [3.25, 3.5, 3.75];

    fn road() -> Road {
        Road::straight(3).with_lane_widths(&WIDTHS_M)
    }

    fn check(keys: &str) -> Result<Road, String> {
        let config: RoadConfig = toml::from_str(keys).map_err(|error| error.to_string())?;
        config.check(&Parameters::default()).map_err(|error| error.to_string())
    }

    #[test]
    fn lanes_of_their_own_widths_lie_beside_each_other() {
        let road = road();
        assert_eq!([0, 1, 2, 3].map(|number| road.full_boundary_m(number, 0.0)), [0.0, -3.25, -6.75, -10.5]);
        assert_eq!([1, 2, 3].map(|lane| road.lane_centre_m(Lane(lane), 0.0)), [-1.625, -5.0, -8.625]);
        assert_eq!([1, 2, 3].map(|lane| road.lane_width_m(Lane(lane), 0.0)), WIDTHS_M);
        assert_eq!(road.lane_widths_m(0.0).collect::<Vec<_>>(), WIDTHS_M);
        assert_eq!((road.right_edge_m(), road.lane_width_range_m()), (-10.5, [3.25, 3.75]));
        for (d_m, lane) in [(1.0, 1), (-3.24, 1), (-3.25, 2), (-3.5, 2), (-6.7, 2), (-6.8, 3), (-99.0, 3)] {
            assert_eq!(road.lane_at(0.0, d_m), Lane(lane), "{d_m}");
        }
        assert_eq!(road.lane_at(0.0, f64::NAN), Road::straight(3).lane_at(0.0, f64::NAN));
    }

    #[test]
    fn lanes_of_one_width_are_the_same_road_however_they_are_written() {
        let road = check("lanes = 3\nlane-width-m = 3.66").unwrap();
        assert_eq!(check("lanes = 3\nlane-width-m = [3.66, 3.66, 3.66]").unwrap(), road);
        assert_eq!(road.equal_lane_width_m(), Some(3.66));
        let different = check("lanes = 3\nlane-width-m = [3.25, 3.5, 3.75]").unwrap();
        assert_eq!((different.equal_lane_width_m(), different), (None, self::road()));
    }

    #[test]
    fn a_reversed_and_a_mirrored_road_have_their_lanes_in_the_other_order() {
        let road = road();
        for other in [road.reversed(), road.mirrored().unwrap()] {
            assert_eq!(other.lane_widths_m(0.0).collect::<Vec<_>>(), [3.75, 3.5, 3.25]);
            assert_eq!([0, 1, 2, 3].map(|number| other.full_boundary_m(number, 0.0)), [0.0, -3.75, -7.25, -10.5]);
        }
        assert_eq!(road.reversed().reversed(), road);
        let entry = crate::AccelerationLane { from_m: 100.0, to_m: 350.0, taper_end_m: 410.0 };
        let road = road.with_acceleration_lane(entry);
        assert_eq!([0.0, 380.0, 500.0].map(|s_m| road.boundary_at_m(3, s_m)), [-10.5, -8.625, -6.75]);
        assert_eq!(road.beside(Lane(2), Side::Right), road.entry_lane());
    }

    #[test]
    fn a_wrong_width_is_refused_by_its_key_and_what_is_allowed() {
        for (width, words) in [
            ("[3.5, 3.5]", "`lane-width-m` contradicts `lanes`: it has 2 widths and the road has 3 lanes"),
            ("[3.5]", "it has 1 width and the road has 3 lanes: one number for all lanes is needed, or a list"),
            ("[]", "it has 0 widths and the road has 3 lanes"),
            ("[3.5, 12, 3.5]", "`lane-width-m[1]` is 12, but a number from 2.5 to 5 is needed"),
            ("[3.5, 3.5, 0]", "`lane-width-m[2]` is 0, but a number from 2.5 to 5 is needed"),
            ("-3.5", "`lane-width-m` is -3.5, but a number from 2.5 to 5 is needed"),
            ("[3.5, \"$w\", 3.5]", "`lane-width-m[1]` names the parameter `$w`"),
            ("true", "expected a number, a parameter such as \"$name\", or a list with one of them for each lane"),
            ("[3.5, nan, 3.5]", "a finite number is needed"),
            ("[3.5, [3.5], 3.5]", "expected a number or a parameter"),
        ] {
            let error = check(&format!("lanes = 3\nlane-width-m = {width}")).unwrap_err();
            assert!(error.contains(words), "{width}: {error}");
        }
    }

    #[test]
    fn a_written_road_is_read_again() {
        for keys in ["lane-width-m = 3.5", "lane-width-m = \"$w\"", "lane-width-m = [3.25, \"$w\", 3.75]"] {
            let config: RoadConfig = toml::from_str(&format!("lanes = 3\n{keys}")).unwrap();
            let written = toml::to_string(&config).unwrap();
            assert!(written.contains(keys), "{written}");
            assert_eq!(toml::from_str::<RoadConfig>(&written).unwrap(), config);
        }
    }
}
