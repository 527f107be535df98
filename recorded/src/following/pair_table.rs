//! A table of pairs: one row for each pair and instant, in metres and seconds.

use std::io::Read;

use super::read::{LineError, Pairs, number};
use super::{FollowingInstant, FollowingPair};

/// The columns that are read; a file may have others.
const COLUMNS: [&str; 6] =
    ["time_s", "follower_front_y_m", "follower_speed_mps", "leader_front_y_m", "leader_length_m", "leader_speed_mps"];

/// Reads the pairs of a table. The rows of a pair stand together, in the order of time.
pub(super) fn read(input: impl Read) -> Result<Pairs, LineError> {
    let mut reader = csv::Reader::from_reader(input);
    let header = reader.headers()?.clone();
    let column = |name: &str| {
        header
            .iter()
            .position(|column| column == name)
            .ok_or_else(|| LineError { line: Some(1), message: format!("column `{name}` is missing") })
    };
    let pair_column = column("pair_id")?;
    let mut columns = [0; COLUMNS.len()];
    for (index, name) in columns.iter_mut().zip(COLUMNS) {
        *index = column(name)?;
    }
    let mut pairs = Pairs::new();
    let mut current: Option<(String, Vec<FollowingInstant>)> = None;
    for record in reader.records() {
        let record = record?;
        let name = record.get(pair_column).unwrap_or_default();
        if current.as_ref().is_none_or(|(pair_name, _)| pair_name != name)
            && let Some((pair_name, instants)) = current.replace((name.to_owned(), Vec::new()))
        {
            pairs.push(FollowingPair::new(pair_name, instants));
        }
        let mut values = [0.0; COLUMNS.len()];
        for ((value, column), name) in values.iter_mut().zip(columns).zip(COLUMNS) {
            *value = number(&record, column, name)?.ok_or_else(|| LineError {
                line: record.position().map(csv::Position::line),
                message: format!("column `{name}` is empty"),
            })?;
        }
        let [time_s, follower_front_m, follower_mps, leader_front_m, leader_length_m, leader_mps] = values;
        if let Some((_, instants)) = &mut current {
            instants.push(FollowingInstant {
                time_s,
                leader_rear_m: leader_front_m - leader_length_m,
                leader_mps,
                leader_mps2: 0.0,
                follower_front_m,
                follower_mps,
            });
        }
    }
    if let Some((name, instants)) = current {
        pairs.push(FollowingPair::new(name, instants));
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_pair_are_adjacent_and_the_gap_is_bumper_to_bumper() {
        let mut text = String::from(
            "pair_id,time_s,follower_front_y_m,follower_speed_mps,leader_front_y_m,leader_length_m,leader_speed_mps,extra\n",
        );
        for name in ["a", "b"] {
            for index in 0..250 {
                let time_s = 0.1 * f64::from(index);
                text.push_str(&format!("{name},{time_s:.1},{},10,{},4.5,10,x\n", 10.0 * time_s, 24.5 + 10.0 * time_s));
            }
        }
        let pairs: Vec<FollowingPair> =
            read(text.as_bytes()).map_err(|error| error.message).unwrap().into_iter().map(Result::unwrap).collect();
        assert_eq!(pairs.iter().map(|pair| pair.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
        assert!(pairs[1].instants.iter().all(|instant| (instant.gap_m() - 20.0).abs() < 1e-9));
    }
}
