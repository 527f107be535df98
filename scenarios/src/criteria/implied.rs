//! Flags that decide other flags of the same sample.
//!
//! A gate on a flag under a condition that decides it says nothing: `count(induced |
//! baseline.ego_collided) <= 0` holds whatever the system does, because no collision is induced
//! where the ego collides without the system.

use super::expression::Quantity;

/// Pairs of flags: if the first holds in a sample, the second one holds, too. Both are flags of one
/// arm, or the first is a flag of the pair.
const IMPLIES: [(&str, &str); 14] = [
    ("ego_strikes", "ego_collided"),
    ("ego_is_struck", "ego_collided"),
    ("others_collided_alone", "others_collided"),
    ("ego_touched", "touched"),
    ("prevented", "baseline.ego_collided"),
    ("hazard", "lead_braked"),
    ("hazard", "rear_near"),
    ("goal_in_reach", "engaged"),
    ("goal_due", "rear_near"),
    ("goal_due", "rear_critical"),
    ("goal_reached", "rear_near"),
    ("goal_reached", "rear_critical"),
    ("braked_at_crossing", "rear_crossed"),
    ("rear_passed", "rear_crossed"),
];

/// Pairs of flags that never hold in the same sample.
const EXCLUDES: [(&str, &str); 5] = [
    ("ego_collided", "others_collided_alone"),
    ("prevented", "induced"),
    ("prevented", "ego_collided"),
    ("prevented", "others_collided"),
    ("induced", "baseline.ego_collided"),
];

const BASELINE: &str = "baseline.";

/// Returns the flags that hold wherever `flag` does, with itself.
fn all_implied(flag: &str) -> Vec<String> {
    let mut all = vec![flag.to_owned()];
    for (_, implied) in IMPLIES.iter().filter(|(first, _)| *first == flag) {
        all.extend(all_implied(implied));
    }
    if let Some(of_baseline) = flag.strip_prefix(BASELINE) {
        all.extend(all_implied(of_baseline).iter().skip(1).map(|flag| format!("{BASELINE}{flag}")));
    }
    all
}

fn excludes(first: &str, second: &str) -> bool {
    let is_listed = |[a, b]: [&str; 2]| EXCLUDES.contains(&(a, b)) || EXCLUDES.contains(&(b, a));
    is_listed([first, second])
        || first.strip_prefix(BASELINE).zip(second.strip_prefix(BASELINE)).is_some_and(|(a, b)| is_listed([a, b]))
}

/// Returns whether `flag` holds in the samples in which `condition` holds, if the condition decides
/// it.
pub(super) fn by(condition: Quantity, flag: Quantity) -> Option<bool> {
    let (given, asked) = (all_implied(&condition.to_string()), all_implied(&flag.to_string()));
    // A flag that is short for a comparison is the same as the comparison.
    let is_same = condition.comparison().is_some_and(|of_condition| flag.comparison() == Some(of_condition));
    if given.contains(&asked[0]) || is_same {
        return Some(true);
    }
    let is_excluded = given.iter().any(|given| asked.iter().any(|asked| excludes(given, asked)));
    is_excluded.then_some(false)
}

#[cfg(test)]
mod tests {
    use super::super::expression::parse_quantity;
    use super::*;

    #[test]
    fn a_flag_decides_what_it_implies_and_what_it_excludes() {
        for (condition, flag, expected) in [
            ("ego_collided", "ego_collided", Some(true)),
            ("ego_strikes", "ego_collided", Some(true)),
            ("baseline.ego_strikes", "baseline.ego_collided", Some(true)),
            ("prevented", "baseline.ego_collided", Some(true)),
            ("ego_collided", "ego_strikes", None),
            ("baseline.ego_collided", "induced", Some(false)),
            ("baseline.ego_is_struck", "induced", Some(false)),
            ("induced", "prevented", Some(false)),
            ("ego_strikes", "prevented", Some(false)),
            ("prevented", "others_collided_alone", Some(false)),
            ("baseline.ego_collided", "baseline.others_collided_alone", Some(false)),
            ("baseline.ego_collided", "prevented", None),
            ("baseline.ego_collided", "ego_collided", None),
            ("baseline.others_collided", "induced", None),
            ("rear_near", "engaged", None),
            ("hazard", "lead_braked", Some(true)),
            ("hazard", "rear_near", Some(true)),
            ("baseline.hazard", "baseline.rear_near", Some(true)),
            ("lead_braked", "hazard", None),
            ("hazard", "baseline.rear_near", None),
            ("goal_in_reach", "engaged", Some(true)),
            ("goal_due", "rear_near", Some(true)),
            ("goal_due", "rear_critical", Some(true)),
            ("goal_due", "goal_reached", None),
            ("goal_due", "braked_at_crossing", None),
            ("goal_reached", "rear_critical", Some(true)),
            ("braked_at_crossing", "rear_crossed", Some(true)),
            ("rear_passed", "rear_crossed", Some(true)),
            ("rear_crossed", "rear_passed", None),
            ("unprompted_deficit_mps > 0.5", "slowed_unprompted", Some(true)),
            ("slowed_unprompted", "unprompted_deficit_mps > 0.5", Some(true)),
            ("crossing_braking_mps2 > 1.5", "braked_at_crossing", Some(true)),
            ("baseline.unprompted_deficit_mps > 0.5", "slowed_unprompted", None),
            ("unprompted_deficit_mps > 0.4", "slowed_unprompted", None),
        ] {
            let [condition, flag] = [condition, flag].map(|name| parse_quantity(name).unwrap());
            assert_eq!(by(condition, flag), expected, "{flag} | {condition}");
        }
    }
}
