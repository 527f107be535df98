//! `docs/reference/scenario.md` against its generator, and its statements against the program.

use closecall_traffic::{KeyPath, Segment};

use crate::support::{closecall, stdout};

#[path = "../../../xtask/src/write_references/files.rs"]
mod files;
#[path = "../../../xtask/src/write_references/page.rs"]
mod page;
#[path = "../../../xtask/src/write_references/probe.rs"]
mod probe;
#[path = "../../../xtask/src/write_references/schema.rs"]
mod schema;
#[path = "../../../xtask/src/write_references/text.rs"]
mod text;

use files::{EVERY_KEY, PAGE, at_root};
use page::{SENSOR_DEFAULTS, scenario_page, title};
use probe::Probe;
use schema::{Kind, Step, tables};
use text::default_in;

/// The example that the page links.
const ANNOTATED: &str = "docs/reference/scenario/annotated.toml";
/// The object-level sensors, in the order of [`SENSOR_DEFAULTS`].
const SENSORS: [&str; 3] = ["front-radar", "surround", "rear-object"];

#[test]
fn the_scenario_reference_is_what_its_generator_writes() {
    let (written, committed) = (scenario_page().unwrap(), std::fs::read_to_string(at_root(PAGE)).unwrap());
    let first = written.lines().zip(committed.lines()).find(|(written, committed)| written != committed);
    assert!(
        committed == written,
        "{PAGE} is out of date: run `cargo run --release -p closecall-xtask -- write-references` and commit the file\n\
         the generator writes, and the file has: {first:#?}"
    );
}

#[test]
fn the_examples_of_the_scenario_reference_are_valid() {
    for path in [ANNOTATED, EVERY_KEY] {
        let text = stdout(&closecall(["check", path]), 0);
        assert!(text.contains("valid"), "{text}");
    }
}

#[test]
fn every_key_of_a_scenario_has_a_description_and_an_example() {
    let probe = Probe::new().unwrap();
    let schema = schemars::schema_for!(closecall::scenarios::ScenarioConfig);
    for table in tables(schema.as_value(), &|key| probe.position(key)) {
        for key in &table.keys {
            assert!(!key.description.is_empty(), "{}: {}", title(&table.ways[0]), key.name);
            let used = table.ways.iter().any(|way| {
                let inner: Vec<_> = way.iter().cloned().chain([Step::Key(key.name.clone())]).collect();
                !probe.values(&inner).is_empty()
            });
            assert!(used, "{EVERY_KEY} does not use `{}` of {}", key.name, title(&table.ways[0]));
        }
    }
}

#[test]
fn the_defaults_that_the_scenario_reference_states_are_those_of_the_program() {
    let probe = Probe::new().unwrap();
    let schema = schemars::schema_for!(closecall::scenarios::ScenarioConfig);
    let mut checked = 0;
    for table in tables(schema.as_value(), &|key| probe.position(key)) {
        for key in table.keys.iter().filter(|key| matches!(key.kind, Kind::Number { .. } | Kind::Whole)) {
            let stated = default_in(&key.description).map(|default| default.value);
            let Some(stated) = stated.and_then(|text| number(&text, &key.kind)) else { continue };
            for way in &table.ways {
                let inner: Vec<_> = way.iter().cloned().chain([Step::Key(key.name.clone())]).collect();
                let Some((at, _)) = probe.values(&inner).into_iter().next() else { continue };
                assert!(is_default(&probe, &at, &stated), "{at}: {stated} is not the default");
                checked += 1;
            }
        }
    }
    assert!(checked >= 30, "only {checked} defaults were found in the doc comments");
    for (key, values) in SENSOR_DEFAULTS {
        for (sensor, value) in SENSORS.iter().zip(values) {
            let Some(value) = value else { continue };
            let at = KeyPath(["sensors", sensor, key].map(|part| Segment::Key(part.to_owned())).to_vec());
            let value = if key.starts_with("confirm-") {
                #[expect(clippy::cast_possible_truncation, reason = "a small whole number")]
                toml::Value::Integer(value as i64)
            } else {
                toml::Value::Float(value)
            };
            assert!(is_default(&probe, &at, &value), "{at}: {value} is not the default");
        }
    }
}

/// True if the scenario with `value` at `at` is the scenario without any value there, or is refused
/// for the same reason.
fn is_default(probe: &Probe, at: &KeyPath, value: &toml::Value) -> bool {
    let concrete = |value: Option<toml::Value>| {
        let file = probe.check(&probe.with(at, value).unwrap()).map_err(|error| error.to_string())?;
        Ok::<_, String>(format!("{:?}", file.concrete(&file.space().nominal()).unwrap()))
    };
    concrete(Some(value.clone())) == concrete(None)
}

/// A stated default as a value of the file. The minus sign of prose differs from the minus sign of
/// a file.
fn number(text: &str, kind: &Kind) -> Option<toml::Value> {
    let plain = text.replace('−', "-");
    match kind {
        Kind::Whole => plain.parse().ok().map(toml::Value::Integer),
        _ => plain.parse().ok().map(toml::Value::Float),
    }
}
