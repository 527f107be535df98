//! The classes of a network's labels.

use closecall_traffic::VehicleClass;

/// The classes of a network's labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelMap(Vec<(i64, VehicleClass)>);

impl LabelMap {
    /// Reads labels and classes such as `1=car 2=truck 3=motorcycle`. Labels that are not named are
    /// ignored in the output.
    ///
    /// # Errors
    /// The word that cannot be read.
    pub fn parse(text: &str) -> Result<Self, String> {
        let pair = |word: &str| {
            let (label, name) = word.split_once('=')?;
            let class = VehicleClass::ALL.into_iter().find(|class| class.name() == name)?;
            Some((label.parse().ok()?, class))
        };
        let pairs: Result<Vec<_>, String> =
            text.split_whitespace().map(|word| pair(word).ok_or_else(|| word.to_owned())).collect();
        pairs.and_then(|pairs| if pairs.is_empty() { Err(text.to_owned()) } else { Ok(Self(pairs)) })
    }

    /// Returns the class of a label, or `None` if it is none of a vehicle's.
    pub(super) fn class(&self, label: i64) -> Option<VehicleClass> {
        self.0.iter().find(|(listed, _)| *listed == label).map(|(_, class)| *class)
    }
}
