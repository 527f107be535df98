use std::path::Path;

use closecall_traffic::{ParameterName, Value as Sampled};

use super::*;
use crate::library;
use crate::member::{MemberError, entries, members};

fn scenario(name: &str) -> ScenarioFile {
    ScenarioFile::parse(&library::path(name), library::text(name).unwrap(), &[]).unwrap()
}

fn member(set: &str) -> Member {
    let text = format!("schema-version = 1\nname = \"tested\"\ndescription = \"\"\n{set}");
    Member::parse(Path::new("tested.toml"), &text).unwrap()
}

fn entry(member: &Member, file: &ScenarioFile) -> ScenarioFile {
    match member.apply(file).unwrap() {
        Application::Entry(entry) => *entry,
        Application::NoEffect => panic!("no effect"),
    }
}

/// Returns the sampled value of a parameter in sample 7.
fn sampled(file: &ScenarioFile, name: &str) -> Sampled {
    let parameters = file.space().sample(crate::sampling::Design::Sobol, 3, 7, 64);
    parameters.get(&ParameterName::new(name).unwrap()).unwrap().clone()
}

#[test]
fn a_sampled_parameter_of_the_driver_is_replaced_and_all_others_keep_their_values() {
    let file = scenario("low-thw-overtake");
    let entry = entry(&member("[[set]]\nkey = 'reaction-s'\nvalue = 2.0\nsource = 'x'\n"), &file);
    assert_eq!(entry.config().name, "low-thw-overtake@tested");
    assert_eq!(sampled(&entry, "reaction-s"), Sampled::Number(2.0));
    for (name, _) in file.space().iter().filter(|(name, _)| name.as_str() != "reaction-s") {
        assert_eq!(sampled(&entry, name.as_str()), sampled(&file, name.as_str()), "{name}");
    }
    assert!(entry.text().contains("member tested of the driver ensemble: x"));
    // The entry is an ordinary scenario: its text gives the same entry again.
    let again = ScenarioFile::parse(file.path(), entry.text(), &[]).unwrap();
    assert_eq!(again.config(), entry.config());
    again.check().unwrap();
}

#[test]
fn the_human_driver_of_the_ego_is_changed_as_the_others_are_with_draws_of_its_own() {
    let file = scenario("anchor-lead-brakes");
    let set = "[[set]]\nkey = 'reaction-s'\nvalue = { uniform = { min = 1.5, max = 2.5 } }\nsource = 'x'\n";
    let entry = entry(&member(set), &file);
    let [ego, rear] = ["ego-reaction-s", "rear-reaction-s"].map(|name| match sampled(&entry, name) {
        Sampled::Number(reaction_s) => reaction_s,
        other => panic!("{other:?}"),
    });
    assert!((1.5..2.5).contains(&ego) && (1.5..2.5).contains(&rear) && ego != rear, "{ego} {rear}");
    let idm = self::entry(&members(&["idm".into()]).unwrap()[0], &file);
    assert!(idm.text().contains("human = { idm = {"), "{}", idm.text());
}

#[test]
fn the_parameter_of_a_vehicle_of_any_name_has_a_name_of_a_parameter() {
    let text = library::text("paper-figure").unwrap().replace("\"rear\"", "\"OverTaker_2\"");
    let file = ScenarioFile::parse(&library::path("paper-figure"), &text, &[]).unwrap();
    let set = "[[set]]\nkey = 'reaction-s'\nvalue = { uniform = { min = 1.0, max = 2.0 } }\nsource = 'x'\n";
    let entry = entry(&member(set), &file);
    let Sampled::Number(reaction_s) = sampled(&entry, "overtaker-2-reaction-s") else { panic!("a number") };
    assert!((1.0..2.0).contains(&reaction_s));
    entry.check().unwrap();
}

#[test]
fn a_distribution_for_a_fixed_value_becomes_a_new_parameter() {
    let file = scenario("paper-figure");
    let set = "[[set]]\nkey = 'reaction-s'\nvalue = { uniform = { min = 1.0, max = 2.0 } }\nsource = 'x'\n";
    let entry = entry(&member(set), &file);
    let Sampled::Number(reaction_s) = sampled(&entry, "rear-reaction-s") else { panic!("a number") };
    assert!((1.0..2.0).contains(&reaction_s));
    assert!(entry.text().contains("reaction-s = \"$rear-reaction-s\""), "{}", entry.text());
}

#[test]
fn a_parameter_that_another_value_uses_stays_as_it_is() {
    let text = library::text("low-thw-overtake").unwrap();
    let text = text.replace(
        "speed-keeping = { acceleration-noise-mps2 = 0.1 }",
        "speed-keeping = { acceleration-noise-mps2 = \"$rear-cc1-s\" }",
    );
    let file = ScenarioFile::parse(Path::new("a.toml"), &text, &[]).unwrap();
    let entry = entry(&member("[[set]]\nkey = 'cc1-s'\nvalue = 0.3\nsource = 'x'\n"), &file);
    assert_eq!(sampled(&entry, "rear-cc1-s"), sampled(&file, "rear-cc1-s"));
    assert!(entry.text().contains("cc1-s = 0.3"), "{}", entry.text());
}

#[test]
fn another_model_keeps_the_headway_of_the_scenario() {
    let idm = member("follow = { model = 'idm', source = 'x' }\n");
    let driver = |file: &ScenarioFile| {
        let table: toml::Table = file.text().parse().unwrap();
        table["actor"].as_array().unwrap().iter().find(|actor| actor["id"].as_str() == Some("rear")).unwrap()["driver"]
            .clone()
    };
    let text = |value: &toml::Value| value.as_str().unwrap().to_owned();
    let overtaking = driver(&entry(&idm, &scenario("low-thw-overtake")));
    let follow = &overtaking["overtaker"]["follow"]["idm"];
    assert_eq!(text(&follow["time-gap-s"]), "$rear-cc1-s");
    assert_eq!(text(&follow["hardest-braking-mps2"]), "$hardest-braking-mps2");
    assert_eq!(follow["standstill-gap-m"].as_float(), Some(1.5));
    let following = entry(&idm, &scenario("rear-follower-stays"));
    assert_eq!(text(&driver(&following)["idm"]["time-gap-s"]), "$rear-cc1-s");
    assert_eq!(text(&driver(&following)["idm"]["reaction-s"]), "$reaction-s");
    // The other way round gives Wiedemann 99 again, with the same headway.
    let plain = following.text().replace("rear-follower-stays@tested", "rear-follower-stays");
    let plain = ScenarioFile::parse(following.path(), &plain, &[]).unwrap();
    let back = driver(&entry(&member("follow = { model = 'wiedemann99', source = 'x' }\n"), &plain));
    assert_eq!(text(&back["wiedemann99"]["cc1-s"]), "$rear-cc1-s");
}

#[test]
fn a_member_whose_keys_no_driver_has_is_without_effect() {
    let steers = member("[[set]]\nkey = 'evasive-lateral-mps2'\nvalue = 0.0\nsource = 'x'\n");
    assert!(matches!(steers.apply(&scenario("rear-follower-stays")).unwrap(), Application::NoEffect));
    let wiedemann = member("follow = { model = 'wiedemann99', source = 'x' }\n");
    assert!(matches!(wiedemann.apply(&scenario("low-thw-overtake")).unwrap(), Application::NoEffect));
    assert!(matches!(steers.apply(&scenario("low-thw-overtake")).unwrap(), Application::Entry(_)));
}

#[test]
fn a_value_that_a_driver_refuses_names_the_member_the_scenario_and_the_key() {
    let lapse = member("[[set]]\nkey = 'lapse.duration-s'\nvalue = 2.0\nsource = 'x'\n");
    let error = lapse.apply(&scenario("low-thw-overtake")).unwrap_err().to_string();
    for part in ["tested.toml", "low-thw-overtake", "lapse.at-s"] {
        assert!(error.contains(part), "{error}");
    }
    let slow = member("[[set]]\nkey = 'reaction-s'\nvalue = 9.0\nsource = 'x'\n");
    assert!(slow.apply(&scenario("low-thw-overtake")).unwrap_err().to_string().contains("reaction-s"));
}

#[test]
fn every_member_of_the_program_fits_every_scenario_of_the_library() {
    let shipped = members(&[]).unwrap();
    assert_eq!(shipped.len(), entries().unwrap().len());
    for name in library::names() {
        let file = scenario(name);
        for member in &shipped {
            member.apply(&file).unwrap();
        }
    }
    assert!(members(&["distractd".into()]).unwrap_err().to_string().contains("did you mean `distracted`?"));
    let same = members(&["idm".into(), "idm".into()]).unwrap_err();
    assert!(matches!(same, MemberError::SameName { .. }), "{same}");
}

#[test]
fn a_wrong_member_file_is_refused_with_its_file_and_key() {
    let message = |text: &str| Member::parse(Path::new("wrong.toml"), text).unwrap_err().to_string();
    let head = "schema-version = 1\nname = 'a'\ndescription = ''\n";
    let set = |rest: &str| message(&format!("{head}[[set]]\nsource = 'x'\n{rest}"));
    for (text, expected) in [
        (message("schema-version = 1\nnaem = 'a'\n"), "wrong.toml:2: "),
        (message(&head.replace('1', "2")), "`schema-version`: 2"),
        (message(&head.replace("'a'", "'A b'")), "`name`: `A b`"),
        (message(head), "changes nothing"),
        (set("key = 'reaction'\nvalue = 1.0\n"), "did you mean `reaction-s`?"),
        (set("key = 'reaction-s'\nvalue = 'fast'\n"), "`set[0].value`"),
        (set("key = 'reaction-s'\nvalue = nan\n"), "expected a finite number"),
        (set("key = 'reaction-s'\nvalue = { uniform = { min = 2.0, max = 1.0 } }\n"), "`set[0].value.uniform"),
        (set("key = 'reaction-s'\nvalue = { uniform = { min = 2.0, mx = 1.0 } }\n"), "mx"),
        (set("key = 'reaction-s'\nvalue = 1.0\ndrivers = ['truck']\n"), "`truck`: expected"),
        (set("key = 'cc6'\nvalue = 1.0\n[[set]]\nkey = 'cc6'\nvalue = 2\nsource = 'x'\n"), "set twice"),
        (message(&format!("{head}[[set]]\nkey = 'cc6'\nvalue = 1\nsource = ' '\n")), "the source is empty"),
        (message(&format!("{head}follow = {{ model = 'gipps', source = 'x' }}\n")), "expected `wiedemann99` or `idm`"),
    ] {
        assert!(text.contains("wrong.toml") && text.contains(expected), "{text}");
    }
}
