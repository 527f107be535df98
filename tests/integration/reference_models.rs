//! The reference models of UN Regulation 157 against published outcomes, and as arms of a campaign.

#[expect(dead_code, reason = "the test calls what `main` of the task calls")]
#[path = "../../xtask/src/validate_reference_models.rs"]
mod validate_reference_models;

use std::fs::File;

use flate2::read::MultiGzDecoder;
use validate_reference_models::{Agreement, compare};

#[test]
fn the_models_have_the_published_outcomes_of_cut_ins() {
    let Some(data) = closecall_testing::data() else { return };
    let path = data.join("r157_cut_in_reference/jrc_fsm_cut_in_low_speed.csv.gz");
    let agreements = compare(MultiGzDecoder::new(File::open(path).unwrap())).unwrap();
    for Agreement { cases, same } in agreements {
        assert!(cases > 10_000);
        // In the others, the vehicles touch or not by rounding: the lateral path ends in multiples
        // of the step.
        assert!(same as f64 >= 0.995 * cases as f64, "{same} of {cases}");
    }
}

#[test]
fn a_table_without_a_column_or_a_number_is_refused() {
    let header = "model,ego_speed_kmh,cut_in_speed_kmh,front_distance_m,lateral_speed_mps,crash\n";
    let row = |crash: &str| format!("{header}RSS,,,,,\nFSM,60,10,8,1.5,{crash}\n");
    let agreements = compare(row("1").as_bytes()).unwrap();
    assert_eq!(agreements.map(|model| (model.cases, model.same)), [(0, 0), (1, 1)]);
    let agreements = compare(row("0").as_bytes()).unwrap();
    assert_eq!(agreements.map(|model| (model.cases, model.same)), [(0, 0), (1, 0)]);
    assert_eq!(compare(row("x").as_bytes()).unwrap_err().to_string(), "line 3: `x` is not a number");
    assert_eq!(compare(&b"model,crash\n"[..]).unwrap_err().to_string(), "no column `ego_speed_kmh`");
}
