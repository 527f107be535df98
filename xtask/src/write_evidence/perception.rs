//! Sections on what the rear sensors see: tables of the figures that `closecall study sensors` prints.

use std::error::Error;
use std::fmt::Write as _;

use serde_json::Value;

use super::page::Size;
use super::printed::json;

/// The first case of the study.
const USUAL: &str = "usual: car, paint 0.5, own lane, clear day";
/// The LiDARs that are compared, and what the table says of them.
const LIDARS: [(&str, &str); 3] = [
    ("scala-2", "16 layers 0.6° apart, 25 Hz"),
    ("os1-64", "64 layers 0.5° apart, 10 Hz, 40 m at 10 %"),
    ("pandar-xt-16", "16 layers 2° apart, 10 Hz, 80 m at 10 %"),
];
/// Two LiDARs of the same model, 0.7 m to either side of the middle.
const TWO: [&str; 3] = [
    "sensors.rear-lidar.name=\"left\"",
    "sensors.rear-lidar.left-m=0.7",
    "sensors.additional-rear-lidars=[{name=\"right\",left-m=-0.7}]",
];
/// The same, turned outward.
const OUTWARD: [&str; 4] = [
    "sensors.rear-lidar.name=\"left\"",
    "sensors.rear-lidar.left-m=0.7",
    "sensors.rear-lidar.azimuth-deg=15",
    "sensors.additional-rear-lidars=[{name=\"right\",left-m=-0.7,azimuth-deg=-15}]",
];
/// The cases in which one LiDAR is compared with two.
const COMPARED: [&str; 8] = [
    USUAL,
    "motorcycle",
    "paint 0.1",
    "paint 0.1, plate none",
    "rain 10 mm/h",
    "fog, visibility 100 m",
    "car 25 m behind, 1.9 m aside",
    "car 25 m behind, in line",
];
/// Faults of one of two LiDARs from the start on.
const FAULTS: [&str; 3] = ["dead=true", "blocked-from-deg=-8,blocked-to-deg=8", "yaw-deg=0.5"];

/// Returns the cases of a study of a few approaches, with settings.
fn study(size: Size, settings: &[&str]) -> Result<Vec<Value>, Box<dyn Error>> {
    let seed = size.seed.to_string();
    let mut words = vec!["study", "sensors", "--quick", "--seed", &seed];
    settings.iter().for_each(|setting| words.extend(["--set", setting]));
    let cases = json(&words)?["cases"].take();
    Ok(serde_json::from_value(cases)?)
}

/// Returns a case by its name.
fn case<'a>(cases: &'a [Value], name: &str) -> Result<&'a Value, String> {
    cases.iter().find(|case| case["case"] == name).ok_or_else(|| format!("the study has no case `{name}`"))
}

/// Returns a number with these digits, and a dash for none.
fn digits(value: &Value, digits: usize) -> String {
    value.as_f64().map_or_else(|| "-".to_owned(), |number| format!("{number:.digits$}"))
}

/// Returns the distance of the first confirmed track, with its interval.
fn range(case: &Value) -> String {
    let [value, low, high] = ["value", "low_95", "high_95"].map(|end| digits(&case["range_m"][end], 0));
    if value == "0" { "never".to_owned() } else { format!("{value} ({low} to {high})") }
}

/// Returns the root mean square of an error.
fn error(case: &Value, name: &str) -> String {
    digits(&case["errors"][name]["rmse"]["value"], 2)
}

/// The study of all conditions.
pub(super) fn conditions(size: Size) -> Result<String, Box<dyn Error>> {
    let mut text = "`closecall study sensors --quick` with this seed, 8 approaches of each case:\n\n\
                    | case | first confirmed track (m, 95 %) | along (m) | across (m) | speed (m/s) | class right (%) \
                    | NEES (4) |\n|---|---|---|---|---|---|---|\n"
        .to_owned();
    for case in study(size, &[])? {
        let right = case["class_accuracy"]["value"].as_f64();
        let right = right.map_or_else(|| "-".to_owned(), |share| format!("{:.0}", 100.0 * share));
        let [along, across, speed] = ["along_m", "across_m", "speed_mps"].map(|name| error(&case, name));
        let nees = digits(&case["nees"]["value"], 1);
        let name = case["case"].as_str().unwrap_or_default();
        writeln!(text, "| {name} | {} | {along} | {across} | {speed} | {right} | {nees} |", range(&case))?;
    }
    Ok(text)
}

/// The usual case with other LiDARs.
pub(super) fn lidars(size: Size) -> Result<String, Box<dyn Error>> {
    let mut text =
        "`closecall study sensors --quick --set sensors.rear-lidar.model=MODEL` with this seed, usual case:\n\n\
                    | model | first confirmed track (m, 95 %) | along (m) | speed (m/s) | NEES (4) |\n\
                    |---|---|---|---|---|\n"
            .to_owned();
    for (model, what) in LIDARS {
        let cases = study(size, &[&format!("sensors.rear-lidar.model={model}")])?;
        let usual = case(&cases, USUAL)?;
        let [along, speed] = ["along_m", "speed_mps"].map(|name| error(usual, name));
        let nees = digits(&usual["nees"]["value"], 1);
        writeln!(text, "| `{model}`: {what} | {} | {along} | {speed} | {nees} |", range(usual))?;
    }
    Ok(text)
}

/// One rear LiDAR and two: what they see, and what a fault of one costs.
pub(super) fn two_lidars(size: Size) -> Result<String, Box<dyn Error>> {
    let settings: [&[&str]; 3] = [&[], &TWO, &OUTWARD];
    let studies = settings.map(|settings| study(size, settings));
    let mut text =
        "`closecall study sensors --quick` with this seed. First confirmed track (m, 95 %), and error across (m):\n\n\
                    | case | one in the middle | | two | | two, 15° outward | |\n|---|---|---|---|---|---|---|\n"
            .to_owned();
    for name in COMPARED {
        write!(text, "| {name} |")?;
        for cases in &studies {
            let case = case(cases.as_ref().map_err(ToString::to_string)?, name)?;
            write!(text, " {} | {} |", range(case), error(case, "across_m"))?;
        }
        text.push('\n');
    }
    let samples = size.member_samples.to_string();
    let without = campaign(size, &[])?["controllers"]["acc"]["collisions"].clone();
    write!(
        text,
        "\n`closecall campaign low-thw-overtake -n {samples} --paired` with this seed and full sensors, {without} collisions \
         without the system:\n\n| fault, from the start on | collisions with the system: one LiDAR | two, and one of them \
         has the fault |\n|---|---|---|\n"
    )?;
    for fault in [None].into_iter().chain(FAULTS.map(Some)) {
        let of = |sensor: &str| fault.map(|fault| format!("fault.rear-lidar=[{{sensor=\"{sensor}\",{fault}}}]"));
        let [one, left] = ["rear-lidar", "left"].map(of);
        let one = campaign(size, &one.iter().map(String::as_str).collect::<Vec<_>>())?;
        let two = campaign(size, &TWO.into_iter().chain(left.as_deref()).collect::<Vec<_>>())?;
        let [one, two] = [one, two].map(|report| report["controllers"]["mis"]["collisions"].to_string());
        writeln!(text, "| `{}` | {one} | {two} |", fault.unwrap_or("none"))?;
    }
    Ok(text)
}

/// Returns the report of a paired campaign of the headline with full sensors.
fn campaign(size: Size, settings: &[&str]) -> Result<Value, Box<dyn Error>> {
    let (seed, samples) = (size.seed.to_string(), size.member_samples.to_string());
    let mut words =
        vec!["campaign", "low-thw-overtake", "-n", &samples, "--seed", &seed, "--paired", "--sensors", "full"];
    words.extend(["--no-gate", "--no-out"]);
    settings.iter().for_each(|setting| words.extend(["--set", setting]));
    json(&words)
}
