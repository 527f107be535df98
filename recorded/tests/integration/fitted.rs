//! The committed result of a fit: scenarios can use it, and a new fit of the data reproduces it.

use closecall_recorded::fit::{Heading, fit, to_toml};
use closecall_recorded::trajectory_data::read;
use closecall_scenarios::parameters::ParametersConfig;

use crate::support::data_folder;

const COMMITTED: &str = include_str!("../../../scenarios/library/fitted/us101.toml");

#[test]
fn both_parameter_tables_are_valid_in_a_scenario() {
    let document: toml::Table = COMMITTED.parse().unwrap();
    for table in ["parameters", "parametric"] {
        let config: ParametersConfig = document[table].clone().try_into().unwrap();
        assert!(!config.0.is_empty());
        config.check().unwrap();
        for (name, parameter) in &config.0 {
            let fitted = parameter.fitted.as_ref().unwrap();
            assert!(fitted.n >= 5 && fitted.interval_95.is_some(), "{name}");
        }
    }
}

#[test]
fn a_new_fit_reproduces_the_committed_figures() {
    let Some(folder) = data_folder() else { return };
    let names = ["a", "b", "f", "g", "h", "i"];
    let path = |name| folder.join(format!("ngsim_us101/trajectories/us101_{name}.csv"));
    let data_sets: Vec<_> = names.iter().map(|name| read(&path(name)).unwrap()).collect();
    let text = to_toml(&fit(&data_sets, 0), &Heading::default());
    let from_recordings_on = |text: &str| text.split_once("# trajectory files").unwrap().1.to_owned();
    assert_eq!(from_recordings_on(&text), from_recordings_on(COMMITTED));
}
