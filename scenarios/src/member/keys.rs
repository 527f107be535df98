//! The keys of a driver table that a member may set, and their places in each kind of driver.

use closecall_traffic::suggest::hint;

/// A kind of human driver that a member changes: the name of its table.
pub(super) const KINDS: [&str; 3] = ["overtaker", "wiedemann99", "idm"];

/// The car-following models.
pub(super) const MODELS: [&str; 2] = ["wiedemann99", "idm"];

/// Keys of every kind of driver, beside the car-following model.
const OF_DRIVER: [&str; 8] = [
    "reaction-s",
    "lapse.at-s",
    "lapse.every-s",
    "lapse.duration-s",
    "lapse.duration-sigma",
    "perception.anticipation",
    "brake-build-up-mps3",
    "perception.evidence.threshold",
];

/// More keys of every kind of driver.
const OF_EVIDENCE: [&str; 1] = ["perception.evidence.gating-per-s"];

/// Keys of an overtaking driver only.
const OF_OVERTAKER: [&str; 3] = ["cut-out-thw-s", "lane-change-duration-s", "evasive-lateral-mps2"];

/// Keys of both car-following models.
const OF_MODEL: [&str; 2] = ["hardest-braking-mps2", "desired-speed-mps"];

/// Keys of the Wiedemann 99 model.
const OF_WIEDEMANN: [&str; 10] =
    ["cc0-m", "cc1-s", "cc2-m", "cc3-s", "cc4-mps", "cc5-mps", "cc6", "cc7-mps2", "cc8-mps2", "cc9-mps2"];

/// Keys of the Intelligent Driver Model.
const OF_IDM: [&str; 4] = ["time-gap-s", "standstill-gap-m", "acceleration-mps2", "comfortable-braking-mps2"];

/// Keys that mean the same in both models: Wiedemann 99 and the Intelligent Driver Model.
pub(super) const ALIKE: [(&str, &str); 2] = [("cc0-m", "standstill-gap-m"), ("cc1-s", "time-gap-s")];

fn all() -> impl Iterator<Item = &'static str> {
    let lists: [&[&'static str]; 6] = [&OF_DRIVER, &OF_EVIDENCE, &OF_OVERTAKER, &OF_MODEL, &OF_WIEDEMANN, &OF_IDM];
    lists.into_iter().flatten().copied()
}

/// Returns the allowed keys if `key` is not a key of any driver.
pub(super) fn unknown(key: &str) -> Option<String> {
    if all().any(|key_name| key_name == key) {
        return None;
    }
    let names: Vec<String> = all().map(|key_name| format!("`{key_name}`")).collect();
    let names = names.join(", ");
    Some(format!("expected one of {names}{}", hint(key, &names)))
}

/// Returns the path of `key` below the table of a driver of this kind that follows by `model`, or
/// `None` if such a driver does not have the key.
pub(super) fn path_in(kind: &str, model: &str, key: &str) -> Option<Vec<String>> {
    let split = |prefix: &[&str]| prefix.iter().copied().chain(key.split('.')).map(str::to_owned).collect::<Vec<_>>();
    let of_model = OF_MODEL.contains(&key)
        || (model == "wiedemann99" && OF_WIEDEMANN.contains(&key))
        || (model == "idm" && OF_IDM.contains(&key));
    if OF_DRIVER.contains(&key) || OF_EVIDENCE.contains(&key) || (kind == "overtaker" && OF_OVERTAKER.contains(&key)) {
        Some(split(&[]))
    } else if of_model {
        Some(if kind == "overtaker" { split(&["follow", model]) } else { split(&[]) })
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_of_the_model_stands_below_follow_for_an_overtaking_driver() {
        let path = |kind, model, key| path_in(kind, model, key).map(|path| path.join("."));
        assert_eq!(path("overtaker", "idm", "time-gap-s").unwrap(), "follow.idm.time-gap-s");
        assert_eq!(path("wiedemann99", "wiedemann99", "cc1-s").unwrap(), "cc1-s");
        assert_eq!(path("idm", "idm", "perception.evidence.threshold").unwrap(), "perception.evidence.threshold");
        assert_eq!(path("idm", "idm", "cc1-s"), None);
        assert_eq!(path("wiedemann99", "wiedemann99", "evasive-lateral-mps2"), None);
        assert!(unknown("reaction").unwrap().ends_with("did you mean `reaction-s`?"));
        assert_eq!(unknown("cc6"), None);
    }
}
