//! Names of vehicle classes that a file uses and the reader does not know.

use std::fmt;

use closecall_traffic::VehicleClass;
use serde::Serialize;

use super::fields::{FieldError, wrong_value};

/// Maximum number of different unknown names in one file. More of them mean that the column holds
/// something else.
const MAX_NAMES: usize = 16;

/// Stands for the names beyond [`MAX_NAMES`].
const OTHER_NAMES: &str = "(other names)";

/// Parts of names that mean a class other than a car, in lower case.
const HINTS: [(VehicleClass, &[&str]); 2] = [
    (VehicleClass::Truck, &["truck", "lorry", "bus", "coach", "trailer", "semi", "heavy", "hgv"]),
    (VehicleClass::Motorcycle, &["motor", "bike", "cycl", "scooter", "pedestrian"]),
];

/// An unknown name of a vehicle class.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct UnknownClass {
    /// The name in the file.
    pub name: String,
    /// The class as which its vehicles are read.
    pub read_as: VehicleClass,
    /// Number of rows with the name; number of vehicles if the layout states the class once for
    /// each vehicle.
    pub entries: u64,
}

impl fmt::Display for UnknownClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, read_as, entries } = self;
        let plural = if *entries == 1 { "entry" } else { "entries" };
        write!(f, "the vehicle class `{name}` is unknown and read as {} ({entries} {plural})", read_as.name())
    }
}

/// The unknown names of one file, in the order in which they first appear.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct UnknownClasses(Vec<UnknownClass>);

impl UnknownClasses {
    /// Returns the class `recognised` if there is one. Otherwise counts the name `text` and returns
    /// the nearest class: the class that its words suggest, or else a car.
    ///
    /// # Errors
    /// Fails if `text` is not a name, or if there are too many unknown names.
    pub(super) fn resolve(
        &mut self,
        recognised: Option<VehicleClass>,
        text: &str,
        column: &'static str,
    ) -> Result<VehicleClass, FieldError> {
        if let Some(class) = recognised {
            return Ok(class);
        }
        let is_name = text.starts_with(char::is_alphabetic) && text.parse::<f64>().is_err();
        let has_room = self.0.len() < MAX_NAMES;
        let entry = self.0.iter_mut().find(|unknown| unknown.name == text);
        match entry {
            Some(unknown) => {
                unknown.entries += 1;
                Ok(unknown.read_as)
            }
            None if is_name && has_room => {
                let read_as = nearest(text);
                self.0.push(UnknownClass { name: text.to_owned(), read_as, entries: 1 });
                Ok(read_as)
            }
            None => {
                let words = VehicleClass::ALL.map(VehicleClass::name).join(", ");
                let allowed = format!("one of {words}, or one of at most {MAX_NAMES} other names");
                Err(FieldError::at(column, wrong_value(text, allowed)))
            }
        }
    }

    /// Returns the class that the words of `text` suggest, or else a car, and counts the name. Unlike
    /// [`UnknownClasses::resolve`], it takes any text: names of types belong to the user of a
    /// simulation. What is beyond the room for names counts as one more name.
    pub(super) fn nearest_of(&mut self, text: &str) -> VehicleClass {
        let read_as = nearest(text);
        let has_room = self.0.len() < MAX_NAMES;
        let entry = self.0.iter_mut().rev().find(|unknown| unknown.name == text || unknown.name == OTHER_NAMES);
        match entry {
            Some(unknown) => unknown.entries += 1,
            None => {
                let (name, read_as) = if has_room { (text, read_as) } else { (OTHER_NAMES, VehicleClass::Car) };
                self.0.push(UnknownClass { name: name.to_owned(), read_as, entries: 1 });
            }
        }
        read_as
    }

    /// Returns the unknown names.
    pub(super) fn names(&self) -> &[UnknownClass] {
        &self.0
    }
}

fn nearest(text: &str) -> VehicleClass {
    let lower = text.to_lowercase();
    let hinted = HINTS.into_iter().find(|(_, parts)| parts.iter().any(|part| lower.contains(part)));
    hinted.map_or(VehicleClass::Car, |(class, _)| class)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_are_counted_and_read_as_the_nearest_class() {
        let mut classes = UnknownClasses::default();
        let mut read = |text| classes.resolve(None, text, "vehicle_class").map(VehicleClass::name).ok();
        assert_eq!(
            ["van", "Semi-Trailer", "e-scooter", "van", "other"].map(&mut read),
            [Some("car"), Some("truck"), Some("motorcycle"), Some("car"), Some("car")]
        );
        assert_eq!(["", "7", "nan", "4.5"].map(&mut read), [None; 4], "these are not names");
        let shown: Vec<_> = classes.names().iter().map(ToString::to_string).collect();
        assert_eq!(shown[0], "the vehicle class `van` is unknown and read as car (2 entries)");
        assert_eq!(shown.len(), 4);
        for number in 0..MAX_NAMES {
            let is_read = classes.resolve(None, &format!("kind-{number}"), "vehicle_class").is_ok();
            assert_eq!(is_read, number < MAX_NAMES - 4);
        }
    }
}
