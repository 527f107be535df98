//! `docs/reference/output.md` against the files, columns and keys that small campaigns and runs
//! write.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::Path;

use closecall_scenarios::criteria::{MEASURES, MeasureKind, PairFlag};
use parquet::basic::{LogicalType, Type};
use parquet::file::reader::{FileReader, SerializedFileReader};
use serde_json::Value;

use super::documented::{document, hold, rows};
use crate::native_controllers::compile;
use crate::support::{ROOT, closecall, folder, json, json_file, library, stdout};

/// A list of objects as its objects.
fn each(value: &Value) -> Vec<&Value> {
    value.as_array().map_or_else(|| vec![value], |list| list.iter().collect())
}

fn program(args: &[&str], code: i32) -> Value {
    let words: Vec<String> =
        args.iter().map(ToString::to_string).chain(["--format", "json"].map(str::to_owned)).collect();
    json(&closecall(words), code)
}

/// The columns of a Parquet file, each with its type and its unit.
fn columns(path: &Path) -> Vec<[String; 3]> {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let unit = |name: &str| {
        let unit = metadata.key_value_metadata()?.iter().find(|entry| entry.key == format!("unit:{name}"))?;
        unit.value.clone()
    };
    let columns = metadata.schema_descr().columns().iter().map(|column| {
        let kind = match (column.physical_type(), column.logical_type_ref()) {
            (Type::BYTE_ARRAY, Some(LogicalType::String)) => "text",
            (Type::DOUBLE | Type::FLOAT, _) => "number",
            (Type::INT64 | Type::INT32, _) => "count",
            (Type::BOOLEAN, _) => "flag",
            (other, _) => panic!("{}: {other}", column.name()),
        };
        [column.name().to_owned(), kind.to_owned(), unit(column.name()).unwrap_or_default()]
    });
    columns.collect()
}

/// The documented columns of a table, each with its type and its unit. A value that may be absent
/// has its reason in a column of its own behind it.
fn documented_columns(table: &str) -> Vec<[String; 3]> {
    let rows = rows(&format!("columns: {table} -->"));
    let columns = rows.iter().flat_map(|cells| {
        let name = cells[0].trim_matches('`');
        let reason =
            cells[3].contains("reason beside it").then(|| [format!("{name}_absent"), "text".into(), "".into()]);
        std::iter::once([name.to_owned(), cells[1].clone(), cells[2].clone()]).chain(reason)
    });
    columns.collect()
}

#[test]
fn the_columns_of_a_campaign_s_tables_are_those_documented() {
    let folder = folder();
    let out = folder.path().join("out");
    let args = [
        "campaign",
        library("low-thw-overtake").to_str().unwrap(),
        "-n",
        "4",
        "--no-gate",
        "--paired",
        "--out",
        out.to_str().unwrap(),
    ]
    .map(str::to_owned);
    stdout(&closecall(args), 0);
    let (parameters, written): (Vec<_>, Vec<_>) =
        columns(&out.join("outcomes.parquet")).into_iter().partition(|[name, ..]| name.starts_with("param_"));
    let (patterns, expected): (Vec<_>, Vec<_>) =
        documented_columns("outcomes.parquet").into_iter().partition(|[name, ..]| name.starts_with("param_"));
    assert_eq!(written, expected);
    for kind in patterns.iter().map(|[_, kind, _]| kind) {
        assert!(parameters.iter().any(|[_, written, _]| written == kind), "no parameter is a {kind}");
    }
    assert!(
        parameters.iter().all(|[_, kind, _]| patterns.iter().any(|[_, documented_kind, _]| documented_kind == kind))
    );
    // Only Arrow's metadata state the unit of this table.
    let names = |columns: Vec<[String; 3]>| columns.into_iter().map(|[name, kind, _]| [name, kind]).collect::<Vec<_>>();
    for table in ["timings.parquet", "arm_pairs.parquet"] {
        assert_eq!(names(columns(&out.join(table))), names(documented_columns(table)));
    }
}

#[test]
fn the_columns_of_a_trace_are_those_documented() {
    let folder = folder();
    let expected: Vec<String> = documented_columns("trace").into_iter().map(|[name, ..]| name).collect();
    let at = |name: &str| folder.path().join(name);
    for name in ["trace.csv", "trace.parquet"] {
        let path = at(name);
        let args =
            ["run", library("paper-figure").to_str().unwrap(), "--trace", path.to_str().unwrap()].map(str::to_owned);
        stdout(&closecall(args), 0);
    }
    let text = std::fs::read_to_string(at("trace.csv")).unwrap();
    assert_eq!(text.lines().next().unwrap().split(',').collect::<Vec<_>>(), expected);
    let written: Vec<String> = columns(&at("trace.parquet")).into_iter().map(|[name, ..]| name).collect();
    assert_eq!(written, expected);
}

#[test]
fn the_columns_of_the_scans_are_those_documented() {
    let folder = folder();
    let path = folder.path().join("scans.parquet");
    let scenario = library("paper-figure");
    let options =
        ["--set", "duration-s=1", "--set", "sensors.rear-camera.pipeline=off", "--scans", path.to_str().unwrap()];
    let args = [&["run", scenario.to_str().unwrap(), "--sensors", "full"], options.as_slice()].concat();
    stdout(&closecall(args), 0);
    let expected: Vec<String> = documented_columns("scans").into_iter().map(|[name, ..]| name).collect();
    let written: Vec<String> = columns(&path).into_iter().map(|[name, ..]| name).collect();
    assert_eq!(written, expected);
}

#[test]
fn the_columns_of_tracks_and_clusters_are_those_documented() {
    let folder = folder();
    let paths = ["tracks", "clusters"].map(|name| folder.path().join(format!("{name}.parquet")));
    let scenario = library("paper-figure");
    let options = ["--set", "duration-s=1", "--set", "sensors.rear-camera.pipeline=off"];
    let files = ["--tracks", paths[0].to_str().unwrap(), "--clusters", paths[1].to_str().unwrap()];
    let args = [&["run", scenario.to_str().unwrap(), "--sensors", "full"], options.as_slice(), &files].concat();
    stdout(&closecall(args), 0);
    // The unit stands in Arrow's metadata alone.
    let names = |columns: Vec<[String; 3]>| columns.into_iter().map(|[name, kind, _]| [name, kind]).collect::<Vec<_>>();
    for (table, path) in ["tracks", "clusters"].into_iter().zip(&paths) {
        assert_eq!(names(columns(path)), names(documented_columns(table)));
    }
}

/// The records of a file with one JSON value on each line, behind a checksum if it has one.
fn lines(path: &Path, has_checksum: bool) -> Vec<Value> {
    let text = std::fs::read_to_string(path).unwrap();
    let record = |line: &str| if has_checksum { line.split_once(' ').unwrap().1.to_owned() } else { line.to_owned() };
    text.lines().map(|line| serde_json::from_str(&record(line)).unwrap()).collect()
}

/// The files of a folder, by their paths below it.
fn files(folder: &Path, below: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder.join(below)).unwrap().map(|entry| entry.unwrap());
    entries
        .flat_map(|entry| {
            let name = format!("{below}{}", entry.file_name().to_str().unwrap());
            if entry.path().is_dir() { files(folder, &format!("{name}/")) } else { BTreeSet::from([name]) }
        })
        .collect()
}

#[test]
fn the_files_and_keys_of_a_campaign_are_those_documented() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (headline, harmless) = (library("low-thw-overtake"), library("overtake-without-brake"));
    let (headline, harmless) = (headline.to_str().unwrap(), harmless.to_str().unwrap());
    let both = ["campaign", headline, harmless, "-n", "10", "--seed", "1", "--set", "duration-s=60"];
    let with = |more: &[&str], code| program(&[&both[..], more].concat(), code);
    // Few samples leave a strict bound open. A loose bound is certain after some of them, which the
    // clock may not decide. They leave the requirements open in both.
    let open = with(&["--paired", "--max-probability", "0.2", "--out", &at("open"), "--record", "worst:1"], 4);
    let certain = with(&["--paired", "--max-probability", "0.6", "--until-certain"], 4);
    // A flag has an interval and a percentile has none; the last gate needs more samples.
    let gates = ["p1(min_ttc_rear_s) >= 0.001", "lower(prevented | baseline.ego_collided) >= 0.6"];
    let gated = ["campaign", headline, "-n", "20", "--seed", "1", "--paired", "--gate", gates[0], "--gate", gates[1]];
    let gated = program(&gated, 4);
    // This scenario expects something of its runs. Its percentile needs more samples.
    let every_key = [
        "campaign",
        "docs/reference/scenario/every-key.toml",
        "-n",
        "4",
        "--sensors",
        "object",
        "--max-probability",
        "0.9",
    ];
    let expecting = program(&every_key, 4);
    hold("campaign", [&open, &certain, &gated, &expecting]);

    let out = folder.path().join("open");
    let documented: Vec<String> = rows("files -->").iter().map(|cells| cells[0].trim_matches('`').to_owned()).collect();
    let is_file = |pattern: &str, path: &str| match pattern.split_once("{scenario}-{sample}") {
        Some((before, after)) => path.starts_with(before) && path.ends_with(after),
        None => pattern == path,
    };
    let written = files(&out, "");
    for path in &written {
        assert!(documented.iter().any(|pattern| is_file(pattern, path)), "{path} is not documented");
    }
    for pattern in &documented {
        assert!(written.iter().any(|path| is_file(pattern, path)), "{pattern} is not written");
    }

    let bad = "exec:sh tests/fixtures/controllers/bad.sh dies";
    program(&["campaign", headline, "-n", "5", "--controller", bad, "--sensors", "full", "--out", &at("exec")], 5);
    let ends = ["campaign", headline, "-n", "5", "--fail-fast", "--controller", bad, "--sensors", "object"];
    let ended = [&[][..], &["--out", &at("ended")]].map(|more| program(&[&ends[..], more].concat(), 5));
    hold("ended-early", &ended);
    program(&["campaign", headline, "-n", "60", "--partition", "1/2", "--no-gate", "--out", &at("part")], 0);
    let journals = ["open", "exec"].map(|name| lines(&folder.path().join(name).join("journal.jsonl"), true));
    hold("journal", journals.iter().flatten());
    hold("wall-times", &lines(&out.join("wall-times.jsonl"), false));
    let shared = compile("examples/acc_controller.c", &folder.path().join("acc.so"), &[]);
    let native = format!("lib:{}", shared.display());
    program(&["campaign", headline, "-n", "2", "--no-gate", "--controller", &native, "--out", &at("lib")], 0);
    let manifests =
        ["open", "exec", "part", "lib"].map(|name| json_file(&folder.path().join(name).join("manifest.json")));
    hold("manifest", &manifests);

    // Among the first eight samples the system prevents a collision, and induces none.
    program(
        &["campaign", headline, "-n", "8", "--seed", "1", "--controller", "acc", "--no-gate", "--out", &at("acc")],
        0,
    );
    program(&["campaign", headline, "-n", "8", "--seed", "1", "--no-gate", "--out", &at("mis")], 0);
    let fixed = program(&["compare", &at("acc"), &at("mis")], 0);
    let failing = program(&["compare", &at("mis"), &at("acc")], 1);
    hold("compare", [&fixed, &failing]);
    let baseline = at("baseline.json");
    stdout(&closecall(["baseline", "save", &at("mis"), &baseline]), 0);
    let saved = json_file(Path::new(&baseline));
    hold("baseline-file", [&saved]);
    hold("baseline", [&program(&["baseline", "compare", &at("acc"), &baseline], 1)]);
    hold("list", [&program(&["list"], 0)]);
    std::fs::write(at("bad.toml"), "nme = 'a'\n").unwrap();
    hold("check", [&program(&["check", headline, &at("bad.toml"), "--set", "duration-s=60"], 3)]);
    let replayed = program(&["replay", &at("open"), "3", "--scenario", "low-thw-overtake", "--paired"], 0);
    let run = program(&["run", headline, "--paired", "--set", "brake-mps2=6"], 0);
    hold("run", each(&run).into_iter().chain(each(&replayed)));
}

#[test]
fn the_keys_of_two_fidelities_are_those_documented() {
    let folder = folder();
    let out = folder.path().join("out");
    // With 60 samples one rate has an interval, and no sample is induced.
    let words = ["campaign", "low-thw-overtake", "-n", "60", "--seed", "1", "--paired", "--no-gate"];
    let fast = ["--sensors", "object", "--fidelity", "ground-truth:3", "--record", "failures:0", "--out"];
    let report = program(&[&words[..], &fast, &[out.to_str().unwrap()]].concat(), 0);
    let file = json_file(&out.join("fidelity.json"));
    hold("fidelity", [&file]);
    assert_eq!(report["fidelity"], file);
}

#[test]
fn the_keys_of_the_commands_on_trajectory_data_are_those_documented() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let csv = at("own.csv");
    let scenario = library("overtake-without-brake");
    let record = ["traffic", "record", scenario.to_str().unwrap(), "-n", "20", "--controller", "acc", "-o", &csv]
        .map(str::to_owned);
    stdout(&closecall(record), 0);
    let changes = program(&["traffic", "lane-changes", &csv], 0);
    hold("lane-changes", each(&changes));
    let list = at("list.csv");
    let first = &changes[0];
    let known_change = format!("overtake-without-brake,{},{},left,1\n", first["track_id"], first["crossing_s"]);
    std::fs::write(&list, format!("recording_id,track_id,time_s,direction,clear\n{known_change}")).unwrap();
    hold("lane-changes-scored", [&program(&["traffic", "lane-changes", &csv, "--reference", &list], 0)]);
    // Of few vehicles some metrics have no value, and some quantities too few.
    let few = at("few.csv");
    let record = ["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "--controller", "acc", "-o", &few]
        .map(str::to_owned);
    stdout(&closecall(record), 0);
    let alone = at("alone.csv");
    alone_in(&few, first["track_id"].as_u64().unwrap(), &alone);
    let (many, single) = (
        program(&["traffic", "criticality", &csv, "--curvilinear"], 0),
        program(&["traffic", "criticality", &alone, "--curvilinear"], 0),
    );
    hold("criticality", each(&many).into_iter().chain(each(&single)));
    hold("aerial", [&program(&["traffic", "aerial", &few, "--around-s", "2", "-o", &at("flown")], 0)]);
    hold("reenact", [&program(&["traffic", "reenact", &csv], 0)]);
    let sampled =
        program(&["traffic", "sample", &csv, "--vary", "cc1", "--from", "1", "--to", "0.5", "--steps", "2"], 0);
    hold("sample", [&sampled]);
    let fit = |file: &str, code| program(&["traffic", "fit", file, "--correlations"], code);
    hold("fit", [&fit(&csv, 0), &fit(&few, 4)]);
    let (fitted, headline) = (at("fitted.toml"), library("low-thw-overtake").display().to_string());
    stdout(&closecall(["traffic", "fit", &csv, "-o", &fitted]), 0);
    hold(
        "drift",
        [
            &program(&["traffic", "drift", &fitted, &csv], 0),
            &program(&["traffic", "drift", &fitted, &few], 4),
            &program(&["traffic", "drift", &headline, &csv], 0),
        ],
    );
    hold("statistics", [&program(&["traffic", "statistics", &csv], 0)]);
    hold("robustness", [&program(&["traffic", "robustness", &few, "--repetitions", "1"], 4)]);
    let broken = at("broken.csv");
    std::fs::write(&broken, BROKEN).unwrap();
    let dropped = program(&["traffic", "inspect", &broken, "--drop-bad-rows"], 0);
    hold("inspect", [&program(&["traffic", "inspect", &csv], 0), &dropped]);
    hold("render", [&program(&["tool", "render", "-n", "1", "-o", &at("pictures")], 0)]);
}

/// Leaves one vehicle of a trajectory file.
fn alone_in(from: &str, track_id: u64, to: &str) {
    let text = std::fs::read_to_string(from).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let column = header.split(',').position(|name| name == "track_id").unwrap();
    let is_kept = |line: &&str| line.split(',').nth(column) == Some(track_id.to_string().as_str());
    let kept: Vec<&str> = std::iter::once(header).chain(lines.filter(is_kept)).collect();
    std::fs::write(to, kept.join("\n") + "\n").unwrap();
}

/// A vehicle that jumps, and a row that is not a number.
const BROKEN: &str = "\
track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class
1,0,0.00,0.00,5.2,2,30,,4.5,1.8,car
1,1,0.04,1.20,5.2,2,30,,4.5,1.8,car
1,2,0.08,52.40,5.2,2,30,,4.5,1.8,car
1,3,0.12,53.60,5.2,2,30,,4.5,1.8,car
1,4,0.16,54.80,5.2,2,30,,4.5,1.8,car
1,5,0.20,x,5.2,2,30,,4.5,1.8,car
1,6,0.24,57.20,5.2,2,30,,4.5,1.8,car
";

#[test]
fn the_measures_of_gates_are_those_documented() {
    let text = std::fs::read_to_string(Path::new(ROOT).join("docs/reference/criteria.md")).unwrap();
    let (_, section) = text.split_once("## Criteria").unwrap();
    let rows = section.lines().take_while(|line| !line.starts_with("## ")).filter_map(|line| line.strip_prefix("| `"));
    let documented: BTreeSet<&str> = rows.filter_map(|row| row.split('`').next()).collect();
    let names = MEASURES.iter().map(|measure| measure.name).chain(PairFlag::ALL.map(PairFlag::name));
    assert_eq!(documented, names.collect());
    for number in MEASURES.iter().filter(|measure| measure.kind == MeasureKind::Number) {
        let (name, range) = (number.name, number.range);
        let row = section.lines().find(|line| line.starts_with(&format!("| `{name}` |"))).unwrap();
        assert!(row.ends_with(&format!("| {} to {} |", range.low(), range.high())), "{row}");
    }
}

#[test]
fn the_exit_codes_are_those_of_the_help() {
    let help = stdout(&closecall(["--help"]), 0);
    let listed = help
        .split_once("Exit codes:\n")
        .unwrap()
        .1
        .lines()
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next());
    let text = document();
    let table = text.split_once("## Exit codes").unwrap().1;
    let rows = table.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    let documented: Vec<&str> =
        rows.skip(2).map(|row| row.trim_matches('|').split('|').next().unwrap().trim()).collect();
    assert_eq!(documented, listed.collect::<Vec<_>>());
}

#[test]
fn the_keys_of_studies_are_those_documented() {
    let seeded = |args: &[&str], code| program(&[args, &["--seed", "2", "--set", "duration-s=60"]].concat(), code);
    let small = [
        "study",
        "sensitivity",
        "low-thw-overtake",
        "--no-default-factors",
        "--trajectories",
        "3",
        "-n",
        "32",
        "--top",
        "1",
    ];
    let both = seeded(&small, 0);
    // No factor of the list applies to all scenarios: some are left out here.
    let listed = ["study", "sensitivity", "low-thw-overtake", "--method", "morris", "--trajectories", "2"];
    let listed = seeded(&listed, 0);
    let sobol = seeded(&[&small[..], &["--method", "sobol", "--controller", "exec:false"]].concat(), 5);
    hold("sensitivity", [&both, &listed, &sobol]);
    let frontier =
        ["study", "frontier", "low-thw-overtake", "-n", "20", "--vary", "actor.ego.driver.ego-stack.mis.hold-s=1,2"];
    let errors = seeded(&[&frontier[..], &["--controller", "exec:false"]].concat(), 5);
    hold("frontier", [&seeded(&frontier, 0), &errors]);
    let along = ["--along", "cut-out-thw-s", "closing-mps=3..7", "--event", "min_gap_rear_m < 6", "-n", "30"];
    let boundary = [&["study", "boundary", "low-thw-overtake", "--sensors", "object"][..], &along].concat();
    let conclusive = seeded(&[&boundary[..], &["--controller", "acc"]].concat(), 0);
    let errors = seeded(&[&boundary[..], &["--controller", "exec:false"]].concat(), 5);
    hold("boundary", [&conclusive, &errors]);
    let anchor = ["study", "anchor", "-n", "80", "--ensemble", "glances", "steer-none"];
    hold("anchor", [&seeded(&anchor, 0)]);
    let folder = folder();
    let scans = folder.path().join("scans.parquet");
    let scans = scans.to_str().unwrap();
    let run = ["run", "low-thw-overtake", "--set", "duration-s=1", "--set", "actor.rear.start.behind.gap-m=45"];
    stdout(&closecall([&run[..], &["--sensors", "full", "--controller", "mis", "--scans", scans]].concat()), 0);
    let labelled = program(&["study", "perceive", scans], 0);
    std::fs::remove_file(folder.path().join("scans.labels.csv")).unwrap();
    hold("perceive", [&labelled, &program(&["study", "perceive", scans], 0)]);
}
