use std::path::Path;

use closecall_scenarios::sampling::Design;

use super::*;
use crate::run::film::{Film, FilmRecorder, Level};
use closecall_campaign::runner::{Sampling, concrete};
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::{Arm, RunKey, simulate};

fn films(name: &str, arms: &[ControllerChoice]) -> Vec<Film> {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenarios/library/{name}.toml"));
    let file = ScenarioFile::load(&library, &[]).unwrap();
    let sampling = Sampling { seed: 1, design: Design::Random, samples: 1 };
    let scenario = concrete(&file, sampling, 0).unwrap();
    let key = RunKey { seed: 1, sample: 0 };
    let film = |controller: &ControllerChoice| {
        let arm = Arm { controller: controller.factory(), sensors: None };
        let mut recorder = FilmRecorder::new(&scenario, key, &arm, Level::Objects);
        let outcome = simulate(&scenario, key, &arm, &mut recorder).unwrap();
        recorder.finish(&outcome)
    };
    arms.iter().map(film).collect()
}

#[test]
fn the_figure_of_the_papers_scenario_shows_all_five_moments_and_the_prevented_collision() {
    let films = films("paper-figure", &[ControllerChoice::ACC, ControllerChoice::MIS]);
    let text = encounter(&films);
    for letter in ["(a)", "(b)", "(c)", "(d)", "(e)", "COLLISION", "No collision", "critical 0.9 s", "increasing"] {
        assert!(text.contains(letter), "{letter}");
    }
    assert!(!text.contains("NaN") && !text.contains("inf"), "the figure contains a number that is not finite");
}

#[test]
fn a_picture_renders_its_text_and_gives_the_same_bytes_each_time() {
    let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"60\" height=\"20\">\
               <text x=\"2\" y=\"15\" font-size=\"14\" font-family=\"'DejaVu Sans', sans-serif\">ΔV 9.8</text></svg>";
    let bytes = png(svg).unwrap();
    assert_eq!(bytes, png(svg).unwrap());
    let empty = png(&svg.replace("ΔV 9.8", "")).unwrap();
    assert!(bytes.len() > empty.len() + 100, "{} {}", bytes.len(), empty.len());
}

#[test]
fn a_run_without_other_vehicles_nearby_has_a_still_and_a_figure() {
    let films = films("empty-wet-road", &[ControllerChoice::MIS]);
    for text in [still(&films[0]), encounter(&films)] {
        assert!(text.contains("No collision") && !text.contains("NaN") && !text.contains("inf"));
    }
}

#[test]
fn invalid_svg_is_an_error() {
    assert!(png("no picture").is_err());
}
