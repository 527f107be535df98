use std::path::Path;

use super::*;
use crate::{Scenario, ScenarioFile, library};

const SAMPLES: u64 = 4_000;

fn scenario(rear: &str) -> Scenario {
    let text = library::text("low-thw-overtake").unwrap();
    let library_vehicle = "vehicle = { class = \"$rear-class\", fleet = \"germany\" }";
    assert!(text.contains(library_vehicle));
    let file = ScenarioFile::parse(Path::new("own.toml"), &text.replace(library_vehicle, rear), &[]).unwrap();
    file.concrete(&file.space().nominal()).unwrap()
}

fn rear(scenario: &Scenario, sample: u64) -> Vehicle {
    let index = scenario.actors.iter().position(|actor| actor.id.as_str() == "rear").unwrap();
    scenario.vehicle(index, RunKey { seed: 3, sample })
}

#[test]
fn every_fleet_is_read_and_names_its_sources() {
    for text in TEXTS {
        Fleet::parse(text).unwrap();
    }
    assert_eq!(FLEETS.len(), TEXTS.len());
}

#[test]
fn wrong_fleets_are_refused_with_key_and_range() {
    let text = TEXTS[0];
    for (from, to, message) in [
        ("clean = 0.85", "clean = 0.95", "plates: the shares add up to 1.100"),
        ("clean = 0.85", "clean = nan", "plates: the shares"),
        ("saloon = 0.067", "coach = 0.067", "car.shapes: `coach` is not a shape of a car"),
        ("[0.04, 0.08]", "[0.08, 0.04]", "car.paints: the reflectivity of `black` is 0.08 to 0.04"),
        ("[0.04, 0.08]", "[0.0, 0.04]", "numbers above 0 and up to 1"),
        ("share = 0.330", "share = -0.330", "car.paints: the shares"),
        ("[plates]", "[plates]\ncracked = 0.1", "cracked"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = Fleet::parse(&text.replacen(from, to, 1)).unwrap_err();
        assert!(error.contains(message), "{to}: {error}");
    }
    let assumed = text.lines().find(|line| line.starts_with("assumed")).unwrap();
    assert!(Fleet::parse(&text.replace(assumed, "assumed = \"a guess\"")).unwrap_err().contains("plates.assumed"));
}

#[test]
fn an_unknown_fleet_is_refused_with_the_known_ones() {
    let config = VehicleConfig { fleet: Some("germani".to_owned()), ..VehicleConfig::typical(VehicleClass::Car) };
    let error = FleetOf::check(&config).unwrap_err().to_string();
    assert!(
        error.contains("`fleet`") && error.contains("germani") && error.contains("one of germany is needed"),
        "{error}"
    );
}

#[test]
fn looks_have_the_shares_of_the_file() {
    let scenario = scenario("vehicle = { class = \"car\", fleet = \"germany\" }");
    let drawn: Vec<Vehicle> = (0..SAMPLES).map(|sample| rear(&scenario, sample)).collect();
    let fleet = Fleet::named("germany").unwrap();
    let holds = |share: f64, is: &dyn Fn(&Vehicle) -> bool| {
        let drawn_share = drawn.iter().filter(|vehicle| is(vehicle)).count() as f64 / SAMPLES as f64;
        // Four standard deviations of a binomial share.
        let tolerance = 4.0 * (share * (1.0 - share) / SAMPLES as f64).sqrt();
        assert!((drawn_share - share).abs() <= tolerance, "{drawn_share} instead of {share}");
    };
    for (name, share) in &fleet.car.shapes {
        holds(*share, &|vehicle| vehicle.appearance.body_shape.name() == name);
    }
    // No two dark colours are the same, and black paints alone are this dark.
    holds(0.266, &|vehicle| vehicle.appearance.paint_reflectivity < 0.09);
    holds(fleet.plates.dirty, &|vehicle| vehicle.appearance.plate == Plate::Dirty);
    holds(fleet.plates.none, &|vehicle| vehicle.appearance.plate == Plate::None);
    let typical = Vehicle::typical(VehicleClass::Car);
    for vehicle in &drawn {
        let [size, usual] = [vehicle.dimensions, typical.dimensions];
        assert_eq!([size.length_m, size.width_m, vehicle.mass_kg], [usual.length_m, usual.width_m, typical.mass_kg]);
    }
}

#[test]
fn what_the_file_gives_is_kept_and_a_seed_draws_the_same() {
    let fixed = scenario(
        "vehicle = { class = \"car\", fleet = \"germany\", paint-reflectivity = 0.3, body-shape = \"van\", plate = \"dirty\" }",
    );
    let free = scenario("vehicle = { class = \"car\", fleet = \"germany\" }");
    let mut colours = Vec::new();
    for sample in 0..50 {
        let look = rear(&fixed, sample).appearance;
        assert_eq!((look.paint_reflectivity, look.body_shape, look.plate), (0.3, BodyShape::Van, Plate::Dirty));
        assert_eq!(look.paint_rgb, rear(&free, sample).appearance.paint_rgb);
        assert_eq!(rear(&free, sample), rear(&free, sample));
        colours.push(look.paint_rgb);
    }
    colours.sort();
    colours.dedup();
    assert!(colours.len() > 20);
}

#[test]
fn a_saved_sample_has_the_look_of_its_own_random_numbers() {
    let free = scenario("vehicle = { class = \"car\", fleet = \"germany\" }");
    let random_numbers = Some(crate::RandomNumbersConfig { seed: 3, sample: 7 });
    let saved = Scenario { random_numbers, ..free.clone() };
    assert_eq!(rear(&saved, 0), rear(&free, 7));
}

#[test]
fn without_a_fleet_nothing_is_drawn() {
    assert_eq!(rear(&scenario("vehicle = { class = \"car\" }"), 5), Vehicle::typical(VehicleClass::Car));
}
