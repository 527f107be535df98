//! Dense traffic with any number of vehicles.

use std::fmt::Write;

/// Duration of the runs in dense traffic (s).
const TRAFFIC_S: f64 = 10.0;
/// Distance between two vehicles of a lane in dense traffic (m): a time headway of 1.8 s at 30 m/s,
/// bumper to bumper.
const SPACING_M: f64 = 60.0;

/// Returns the text of a scenario with `vehicles` vehicles in three lanes, the ego in their middle.
pub(crate) fn traffic(vehicles: usize) -> String {
    let mut text = format!(
        "schema-version = 1\nname = \"traffic-{vehicles}\"\nduration-s = {TRAFFIC_S:.1}\n\
         road = {{ lanes = 3, lane-width-m = 3.75, curvature-per-m = 0.0, speed-limit-mps = 36.1, overtaking-side = \"left\" }}\n\
         [sensors]\nmode = \"full\"\n"
    );
    for index in 0..vehicles {
        let (lane, row) = (index % 3 + 1, index / 3);
        let s_m = 500.0 + SPACING_M * row as f64 + 10.0 * lane as f64;
        let is_ego = index == vehicles / 6 * 3 + 1;
        let id = if is_ego { "ego".to_owned() } else { format!("v{index:03}") };
        let driver = if is_ego {
            "{ ego-stack = { acc = { time-gap-s = 1.5 }, aeb = {}, mis = {} } }"
        } else {
            "{ wiedemann99 = {} }"
        };
        let _ = write!(
            text,
            "[[actor]]\nid = \"{id}\"\nvehicle = {{ class = \"car\" }}\n\
             start = {{ absolute = {{ lane = {lane}, s-m = {s_m:.1}, speed-mps = 30.0 }} }}\ndriver = {driver}\n"
        );
    }
    text
}
