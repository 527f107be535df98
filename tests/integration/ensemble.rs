//! A campaign over a driver ensemble: entries on the same samples, the verdict, partitions,
//! resumption, replay.

use std::path::Path;

use closecall_controllers::{
    Driver, DriverInput, EvidenceConfig, LaneNeighbours, LapseConfig, Neighbour, Neighbours, PerceptionConfig,
    ReactionConfig, Wiedemann99Config, Wiedemann99Driver,
};
use closecall_traffic::{
    ActorId, Check, Indicator, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState, stream,
};
use serde_json::Value;

use crate::support::{closecall, code, folder, journal, json, message, stdout};

const ARGS: [&str; 9] =
    ["campaign", "low-thw-overtake", "--paired", "-n", "6", "--sensors", "ground-truth", "--no-gate", "--seed=71"];

fn campaign(out: &Path, more: &[&str]) -> std::process::Output {
    let args = ARGS.iter().chain(more).copied().map(str::to_owned);
    closecall(args.chain(["--out".to_owned(), out.display().to_string()]))
}

#[test]
fn every_member_is_an_entry_of_its_own_and_the_verdict_names_median_and_worst() {
    let out = folder();
    let output = campaign(&out.path().join("c"), &["--format=json", "--ensemble", "idm", "steer-none", "evidence"]);
    let result = json(&output, 0);
    let names: Vec<&String> = result["scenarios"].as_object().unwrap().keys().collect();
    assert_eq!(names, ["low-thw-overtake@evidence", "low-thw-overtake@idm", "low-thw-overtake@steer-none"]);
    let [verdict] = &result["ensemble"].as_array().unwrap()[..] else { panic!("{}", result["ensemble"]) };
    assert_eq!(verdict["scenario"], "low-thw-overtake");
    assert_eq!(verdict["members"].as_array().unwrap().len(), 3);
    let induced = &verdict["quantities"]["induced_share"];
    assert!(induced["median"]["member"].is_string() && induced["worst"]["value"].is_number(), "{induced}");
    for page in ["report.html", "summary.md"] {
        let text = std::fs::read_to_string(out.path().join("c").join(page)).unwrap();
        assert!(text.contains("induced share") && text.contains("low-thw-overtake@idm"), "{page}");
    }
    let manifest = std::fs::read_to_string(out.path().join("c/manifest.json")).unwrap();
    assert!(manifest.contains("low-thw-overtake@idm"));
}

#[test]
fn partition_resume_and_replay_know_the_member() {
    let out = folder();
    let at = |name: &str| out.path().join(name);
    let members = ["--ensemble", "slow", "steer-none"];
    campaign(&at("whole"), &members);
    for part in ["1/2", "2/2"] {
        campaign(&at(&part.replace('/', "of")), &[&members[..], &["--partition", part]].concat());
    }
    let parts = [at("1of2"), at("2of2")].map(|path| path.display().to_string());
    let merged = at("merged").display().to_string();
    stdout(&closecall(["tool", "merge", &parts[0], &parts[1], "--out", &merged, "--no-gate"]), 0);
    let read = |name: &str| std::fs::read(at(name).join("outcomes.parquet")).unwrap();
    assert_eq!(read("merged"), read("whole"));
    // The same samples for each member: the reaction time is the member's, everything else agrees.
    let records = journal(&at("whole"));
    assert_eq!(records.len(), 12);
    let parameters = |record: &Value| record["arms"][0]["result"]["Ok"]["parameters"].clone();
    for (slow, steers) in records[..6].iter().zip(&records[6..]) {
        let (mut slow, mut steers) = (parameters(slow), parameters(steers));
        assert!(slow["reaction-s"].as_f64().unwrap() >= 1.5 && steers["evasive-lateral-mps2"] == 0.0);
        for name in ["reaction-s", "evasive-lateral-mps2"] {
            slow[name] = Value::Null;
            steers[name] = Value::Null;
        }
        assert_eq!(slow, steers);
    }
    let again = campaign(&at("whole"), &[&members[..], &["--resume"]].concat());
    assert_eq!(code(&again), 0, "{}", message(&again));
    let other = campaign(&at("whole"), &["--resume", "--ensemble", "slow", "idm"]);
    assert_ne!(code(&other), 0);
    assert!(message(&other).contains("low-thw-overtake@"), "{}", message(&other));
    let whole = at("whole").display().to_string();
    stdout(&closecall(["replay", &whole, "3", "--scenario", "low-thw-overtake@slow"]), 0);
}

#[test]
fn a_member_without_effect_is_said_and_not_counted() {
    let args =
        ["campaign", "rear-follower-stays", "-n", "2", "--sensors", "ground-truth", "--no-gate", "--format=json"];
    let output = closecall(args.iter().chain(&["--ensemble", "steer-none", "slow"]));
    let result = json(&output, 0);
    assert_eq!(result["scenarios"].as_object().unwrap().len(), 1);
    assert_eq!(result["ensemble"][0]["without_effect"][0], "steer-none");
    assert!(message(&output).contains("`steer-none` has no effect"), "{}", message(&output));
    let none = closecall(args.iter().chain(&["--ensemble", "steer-none"]));
    assert_eq!(code(&none), 2, "{}", message(&none));
}

#[test]
fn a_wrong_member_is_refused_with_its_file_and_key() {
    let folder = folder();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let head = "schema-version = 1\nname = 'mine'\ndescription = 'd'\n";
    let typo = write("typo.toml", &format!("{head}[[set]]\nkey = 'reaction'\nvalue = 1.0\nsource = 's'\n"));
    let range = write("range.toml", &format!("{head}[[set]]\nkey = 'reaction-s'\nvalue = 9.0\nsource = 's'\n"));
    for (member, exit, parts) in [
        (typo.as_str(), 3, ["typo.toml", "did you mean `reaction-s`"]),
        (&range, 3, ["range.toml", "reaction-s"]),
        ("distractd", 2, ["distractd", "did you mean `distracted`"]),
    ] {
        let output = closecall(["campaign", "low-thw-overtake", "-n", "2", "--ensemble", member]);
        assert_eq!(code(&output), exit, "{}", message(&output));
        assert!(parts.iter().all(|part| message(&output).contains(part)), "{}", message(&output));
    }
}

#[test]
fn the_list_shows_the_members() {
    let listed = json(&closecall(["list", "--format=json"]), 0);
    let members = listed["members"].as_array().unwrap();
    let folder = std::fs::read_dir(Path::new(crate::support::ROOT).join("scenarios/ensemble")).unwrap();
    assert_eq!(members.len(), folder.count());
    let sources = |member: &Value| member["sources"].as_array().unwrap().iter().all(|source| source != "");
    assert!(members.iter().all(sources), "{members:?}");
}

#[test]
fn the_page_of_the_drivers_names_every_member_with_its_values() {
    let (_, page) =
        include_str!("../../docs/reference/drivers.md").split_once("## The members of the program").unwrap();
    let listed = json(&closecall(["list", "--format=json"]), 0);
    for member in listed["members"].as_array().unwrap() {
        let name = member["name"].as_str().unwrap();
        let row = page.lines().find(|line| line.starts_with(&format!("| `{name}` |")));
        let row = row.unwrap_or_else(|| panic!("docs/reference/drivers.md has no row for `{name}`"));
        assert!(row.contains(member["description"].as_str().unwrap()), "{name}");
        for source in member["sources"].as_array().unwrap() {
            assert!(row.contains(source.as_str().unwrap()), "{name}: {source}");
        }
    }
}

/// Returns the time at which a driver first brakes by more than 1 m/s² (s). The driver follows at
/// 30 m/s, 25 m behind a vehicle that brakes at `braking_mps2` from 2 s on. The vehicle beyond that
/// one brakes from 1 s on.
fn brakes_at_s(config: &Wiedemann99Config, braking_mps2: f64) -> f64 {
    let settings = config.check(&Parameters::default()).unwrap();
    let mut driver = Wiedemann99Driver::new(settings);
    let mut rng = stream(1, 0, &ActorId::new("rear").unwrap(), "driver");
    let (vehicle, road) = (Vehicle::typical(VehicleClass::Car), Road::straight(3));
    let ahead = |actor, gap_m: f64, from_s: f64, time_s: f64| {
        let for_s = (time_s - from_s).max(0.0);
        let acceleration_mps2 = if for_s > 0.0 { -braking_mps2 } else { 0.0 };
        Neighbour {
            actor,
            gap_m: gap_m - 0.5 * braking_mps2 * for_s * for_s,
            speed_mps: 30.0 - braking_mps2 * for_s,
            acceleration_mps2,
            brake_light: for_s > 0.0,
            indicator: Indicator::Off,
            class: VehicleClass::Car,
            length_m: 4.6,
            width_m: 1.85,
            lateral_offset_m: 0.0,
        }
    };
    for step in 0..600 {
        let time = Time::from_ms(10 * step);
        let own_lane = LaneNeighbours { lead: Some(ahead(1, 25.0, 2.0, time.s())), ..LaneNeighbours::default() };
        let neighbours =
            Neighbours { own: own_lane, beyond: Some(ahead(2, 60.0, 1.0, time.s())), ..Neighbours::default() };
        let state = VehicleState { s_m: 30.0 * time.s(), d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() };
        let input = DriverInput {
            time,
            vehicle: &vehicle,
            own: &state,
            neighbours: &neighbours,
            road: &road,
            lane_change_target: None,
            lateral_deviation_m: 0.0,
            desired_speed_offset_mps: 0.0,
        };
        if driver.step(&input, &mut rng).unwrap().acceleration_mps2 < -1.0 {
            return time.s();
        }
    }
    panic!("the driver never brakes")
}

#[test]
fn each_property_of_a_member_changes_when_a_driver_brakes() {
    let typical = Wiedemann99Config {
        cc1_s: Some(0.5.into()),
        desired_speed_mps: Some(30.0.into()),
        reaction_s: Some(ReactionConfig::Value(0.8.into())),
        perception: Some(PerceptionConfig { anticipation: Some(0.0.into()), evidence: None }),
        ..Wiedemann99Config::default()
    };
    let onset_s = brakes_at_s(&typical, 6.0);
    assert!((2.8..3.0).contains(&onset_s), "one reaction time after the brake light ahead: {onset_s}");

    let slow = Wiedemann99Config { reaction_s: Some(ReactionConfig::Value(1.6.into())), ..typical.clone() };
    assert!((brakes_at_s(&slow, 6.0) - onset_s - 0.8).abs() < 0.02);

    let lapse = LapseConfig { at_s: Some(1.9.into()), every_s: None, duration_s: 1.5.into(), duration_sigma: None };
    let away = Wiedemann99Config { lapse: Some(lapse), ..typical.clone() };
    let away_s = brakes_at_s(&away, 6.0);
    assert!((away_s - (1.9 + 1.5 + 0.8)).abs() < 0.15, "one reaction time after the glance: {away_s}");

    let full = PerceptionConfig { anticipation: Some(1.0.into()), evidence: None };
    let full_s = brakes_at_s(&Wiedemann99Config { perception: Some(full), ..typical.clone() }, 6.0);
    assert!((1.8..2.0).contains(&full_s), "before the brake light directly ahead: {full_s}");

    let evidence = PerceptionConfig { anticipation: Some(0.0.into()), evidence: Some(EvidenceConfig::default()) };
    let accumulating = Wiedemann99Config {
        perception: Some(evidence),
        reaction_s: Some(ReactionConfig::Value(0.1.into())),
        ..typical.clone()
    };
    let [hard_s, gentle_s] = [8.0, 1.5].map(|braking_mps2| brakes_at_s(&accumulating, braking_mps2) - 2.0);
    assert!(hard_s > 0.3 && gentle_s > hard_s + 0.5, "later to slow looming: {hard_s} {gentle_s}");

    let soft = Wiedemann99Config { brake_build_up_mps3: Some(1.0.into()), ..typical };
    assert!(brakes_at_s(&soft, 6.0) > onset_s + 0.2);
}
