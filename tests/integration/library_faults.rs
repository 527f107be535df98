//! A sensor that is dead or frozen leaves the margin increase system not available, with its
//! reason, and no campaign passes.

use std::path::{Path, PathBuf};

use crate::support::{ROOT, closecall, code, folder, json, message, stdout};

/// The scenarios in which a sensor delivers nothing, or always the same, and the reason that the
/// ego gives.
const FAILED: [(&str, &str); 11] = [
    ("camera-dead", "not available: rear sensors failed"),
    ("camera-frozen", "not available: rear sensors failed"),
    ("front-lidar-dead", "not available: front radar failed"),
    ("front-lidar-frozen", "not available: front radar failed"),
    ("front-radar-dead", "not available: front radar failed"),
    ("front-radar-frozen", "not available: front radar failed"),
    ("lidar-dead", "not available: rear sensors failed"),
    ("lidar-frozen", "not available: rear sensors failed"),
    ("object-dead", "not available: rear sensors failed"),
    ("object-frozen", "not available: rear sensors failed"),
    ("surround-dead", "not available: surround sensors failed"),
];

fn text_of(name: &str) -> String {
    std::fs::read_to_string(Path::new(ROOT).join(format!("scenarios/library/faults/{name}.toml"))).unwrap()
}

/// Writes the scenario without what judges it. With `is_sound`, its fault begins when the encounter
/// is over.
fn unjudged(folder: &Path, name: &str, is_sound: bool) -> PathBuf {
    let text = text_of(name);
    let (before, rest) = text.split_once("[checks]").unwrap();
    let (_, fault) = rest.split_once("[[fault").unwrap();
    let before = before.replace("requirements = [\"MIS-2\"]\n", "");
    let mut text = format!("{before}[[fault{fault}");
    if is_sound {
        let is_kept = |line: &&str| !line.starts_with("until-s");
        text = text.lines().filter(is_kept).map(|line| format!("{line}\n")).collect();
        text = text.replace("from-s = 5.0", "from-s = 59.9");
    }
    let path = folder.join(format!("{name}-{is_sound}.toml"));
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_failed_sensor_leaves_the_system_not_available_with_its_reason_and_no_gate_passes() {
    let folder = folder();
    for (name, reason) in FAILED {
        let outcome = json(&closecall(["run", name, "--format", "json"]), 0).to_string();
        assert!(outcome.contains(reason), "{name}: {outcome}");
        // A gate that nothing misses, and no other criterion.
        let campaign = |path: &Path| {
            let path = path.to_str().unwrap();
            let args = ["campaign", path, "-n", "4", "--seed", "1", "--paired", "--no-validity-checks"];
            closecall(args.iter().chain(&["--max-collisions", "1000"]))
        };
        let text = stdout(&campaign(&unjudged(folder.path(), name, false)), 4);
        assert!(text.contains("INCONCLUSIVE") && !text.contains("PASS"), "{name}: {text}");
        assert!(text.contains("was not available, because sensors had failed, in 4 of 4 samples"), "{name}: {text}");
    }
    // The same campaigns pass if the sensors work during the encounter.
    for name in ["camera-dead", "front-radar-dead", "surround-dead", "object-frozen"] {
        let path = unjudged(folder.path(), name, true);
        let args = ["campaign", path.to_str().unwrap(), "-n", "24", "--seed", "1", "--paired", "--no-validity-checks"];
        let text = stdout(&closecall(args.iter().chain(&["--max-collisions", "20"])), 0);
        assert!(text.contains("PASS"), "{name}: {text}");
    }
}

#[test]
fn the_shipped_scenarios_of_failed_sensors_do_not_pass() {
    for (name, _) in FAILED {
        let output = closecall(["campaign", name, "-n", "4", "--seed", "1", "--paired", "--no-validity-checks"]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!([1, 4].contains(&code(&output)) && !text.contains("PASS"), "{name}: {text} {}", message(&output));
        assert!(text.contains("not available in 4"), "{name}: {text}");
    }
}
