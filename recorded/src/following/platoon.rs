//! A platoon of the OpenACC database (Makridis et al., Transportation Research Part C 125 (2021)):
//! five lines of description, then one row for each instant.
//!
//! `Speed`*i* is the speed of vehicle *i* (m/s) and `IVS`*i* the spacing between vehicle *i* and
//! the vehicle *i* + 1 behind it, bumper to bumper (m). The position of the follower along its path
//! is the integral of its speed. The position of the leader follows from the spacing.

use std::collections::BTreeMap;
use std::io::Read;

use super::read::{LineError, Pairs, number};
use super::{FollowingInstant, FollowingPair};

/// Reads every pair of neighbours whose speeds and spacing the file has. An instant with an empty
/// cell ends a pair; the next instant with values begins another pair, whose name ends in its
/// number.
pub(super) fn read(input: impl Read) -> Result<Pairs, LineError> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(input);
    let mut records = reader.records();
    let mut order = Vec::new();
    let header = loop {
        let Some(record) = records.next().transpose()? else {
            return Err(LineError { line: None, message: "the platoon has no line `Time,…`".to_owned() });
        };
        match record.get(0) {
            Some("Time") => break record,
            Some("Vehicle_order") => order = record.iter().skip(1).map(str::to_owned).collect(),
            _ => {}
        }
    };
    let columns: BTreeMap<&str, usize> = header.iter().enumerate().map(|(index, name)| (name, index)).collect();
    let mut pairs: Vec<Building> = Vec::new();
    for leader in 1..=order.len() {
        let names = [format!("IVS{leader}"), format!("Speed{leader}"), format!("Speed{}", leader + 1)];
        if let [Some(spacing), Some(leader_speed), Some(follower_speed)] =
            names.each_ref().map(|name| columns.get(name.as_str()).copied())
        {
            let vehicle = |index: usize| order.get(index).map_or("?", String::as_str);
            let name = format!("{}-{}", vehicle(leader), vehicle(leader - 1));
            pairs.push(Building::new(name, names, [spacing, leader_speed, follower_speed]));
        }
    }
    if pairs.is_empty() {
        let message = "no column `IVS1`, `IVS2`, … has the columns `Speed…` of both vehicles beside it".to_owned();
        return Err(LineError { line: header.position().map(csv::Position::line), message });
    }
    let mut finished = Pairs::new();
    for record in records {
        let record = record?;
        let Some(time_s) = number(&record, 0, "Time")? else { continue };
        for pair in &mut pairs {
            pair.push(&record, time_s, &mut finished)?;
        }
    }
    for mut pair in pairs {
        pair.end(&mut finished);
    }
    Ok(finished)
}

/// A pair that is being read.
struct Building {
    name: String,
    names: [String; 3],
    columns: [usize; 3],
    instants: Vec<FollowingInstant>,
    part: u32,
}

impl Building {
    fn new(name: String, names: [String; 3], columns: [usize; 3]) -> Self {
        Self { name, names, columns, instants: Vec::new(), part: 0 }
    }

    fn push(&mut self, record: &csv::StringRecord, time_s: f64, finished: &mut Pairs) -> Result<(), LineError> {
        let mut values = [None; 3];
        for ((value, column), name) in values.iter_mut().zip(self.columns).zip(&self.names) {
            *value = number(record, column, name)?;
        }
        let [Some(gap_m), Some(leader_mps), Some(follower_mps)] = values else {
            self.end(finished);
            return Ok(());
        };
        let follower_front_m = self.instants.last().map_or(0.0, |last| {
            last.follower_front_m + 0.5 * (last.follower_mps + follower_mps) * (time_s - last.time_s)
        });
        self.instants.push(FollowingInstant {
            time_s,
            leader_rear_m: follower_front_m + gap_m,
            leader_mps,
            leader_mps2: 0.0,
            follower_front_m,
            follower_mps,
        });
        Ok(())
    }

    fn end(&mut self, finished: &mut Pairs) {
        let instants = std::mem::take(&mut self.instants);
        if !instants.is_empty() {
            self.part += 1;
            finished.push(FollowingPair::new(format!("{} part {}", self.name, self.part), instants));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_fix_ends_a_pair_and_begins_another() {
        let mut text = "Date,1\nVehicle_order,A,B,C,\nNumber_of_vehicles,3\nACC,0\nDistance_setting,\nTime,Speed1,Speed2,Speed3,IVS1,IVS2\n".to_owned();
        for index in 0..600 {
            let spacing = if index == 300 { String::new() } else { "12.5".to_owned() };
            text.push_str(&format!("{:.1},10,10,10,{spacing},8\n", 0.1 * f64::from(index)));
        }
        let results = read(text.as_bytes()).map_err(|error| error.message).unwrap();
        let pairs: Vec<FollowingPair> = results.into_iter().map(Result::unwrap).collect();
        let names: Vec<&str> = pairs.iter().map(|pair| pair.name.as_str()).collect();
        assert_eq!(names, ["B-A part 1", "B-A part 2", "C-B part 1"]);
        assert_eq!((pairs[0].instants.len(), pairs[2].instants.len()), (300, 600));
        assert!((pairs[1].instants[7].gap_m() - 12.5).abs() < 1e-9);
        assert!((pairs[2].instants[599].follower_front_m - 599.0).abs() < 1e-6);
    }
}
