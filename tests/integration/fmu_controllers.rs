//! Controllers that are FMUs. The examples for FMI 2.0 and 3.0 have the outcomes of the built-in
//! controller, to the last bit. An FMU that misbehaves costs its own samples; one that cannot be
//! used is refused before the first sample.

use std::path::{Path, PathBuf};
use std::process::Command;

use closecall_testing::has_python;

use crate::native_controllers::{assert_costs_fast_samples, campaign, is_as_baseline};
use crate::support::{ROOT, code, folder, headline_with, message, program, records, stderr, stdout};

/// Builds the FMU of the example, and returns the value of `--controller`.
pub(crate) fn fmu(fmi: &str, to: &Path, options: &[&str]) -> String {
    let mut command = Command::new("python3");
    let output = command.current_dir(ROOT).args(["examples/fmu/build.py", fmi]).arg(to).args(options).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    format!("fmu:{}", to.display())
}

/// Writes the description of the example with the first `from` replaced by `to`, and returns the
/// FMU.
fn fmu_with(folder: &Path, name: &str, (fmi, from, to): (&str, &str, &str), options: &[&str]) -> String {
    let source = Path::new(ROOT).join(format!("examples/fmu/modelDescription-fmi{fmi}.xml"));
    let text = std::fs::read_to_string(source).unwrap();
    assert!(text.contains(from), "{from}");
    let description = folder.join(format!("{name}.xml"));
    std::fs::write(&description, text.replacen(from, to, 1)).unwrap();
    let description_option = ["--description", description.to_str().unwrap()];
    fmu(fmi, &folder.join(format!("{name}.fmu")), &[&description_option, options].concat())
}

#[test]
fn fmus_of_both_versions_have_the_outcomes_of_the_built_in_controller() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let once = ("2", "modelIdentifier=\"acc\"", "modelIdentifier=\"acc\" canBeInstantiatedOnlyOncePerProcess=\"true\"");
    let controllers = [
        fmu("2", &folder.path().join("two.fmu"), &[]),
        fmu("3", &folder.path().join("three.fmu"), &[]),
        // Reset between the runs instead of created anew.
        fmu_with(folder.path(), "once", once, &[]),
    ];
    for (number, controller) in controllers.iter().enumerate() {
        let outs = ["1", "2"].map(|jobs| {
            let out = folder.path().join(format!("{number}-{jobs}"));
            stdout(&campaign(controller, &out, jobs, None, &[]), 0);
            out
        });
        let records = records(&outs[0]);
        assert!(records.iter().all(is_as_baseline), "{controller}");
        assert!(records.iter().any(|record| record.arms[1].tally().collided == Some(true)), "nothing happens");
        let [version_1, version_2] = outs.each_ref().map(|out| std::fs::read(out.join("outcomes.parquet")).unwrap());
        assert!(version_1 == version_2, "{controller}");
    }
    let run = |controller: &str| {
        let arguments = ["run", "low-thw-overtake", "--sensors", "object", "--controller", controller];
        let text = stdout(&program().args(arguments).output().unwrap(), 0);
        text.lines().skip(1).filter(|line| !line.contains("margin increase")).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(run(&controllers[0]), run(&controllers[1]));
}

#[test]
fn a_fixed_step_divides_the_control_step() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let source = ["--source", "tests/fixtures/controllers/faulty_fmu.c"];
    let steps = |step: &str, can_vary: &str| {
        let from = "canHandleVariableCommunicationStepSize=\"true\"";
        let to = format!("canHandleVariableCommunicationStepSize=\"{can_vary}\"");
        let controller = fmu_with(folder.path(), "step", ("2", from, &to), &source);
        // The step of the experiment is replaced as well.
        let path = folder.path().join("step.xml");
        let text =
            std::fs::read_to_string(&path).unwrap().replace("stepSize=\"0.04\"", &format!("stepSize=\"{step}\""));
        std::fs::write(&path, text).unwrap();
        let options = [&["--description", path.to_str().unwrap()][..], &source].concat();
        fmu("2", &folder.path().join("step.fmu"), &options);
        let arguments = ["run", "low-thw-overtake", "--sensors", "object", "--controller", &controller];
        program().args(arguments).env("FAULT", "fatal").output().unwrap()
    };
    for (step, can_vary) in [("0.1", "false"), ("0.03", "false"), ("0", "false")] {
        let output = steps(step, can_vary);
        assert_eq!(code(&output), 3, "{step}: {}", stderr(&output));
        assert!(message(&output).contains(&format!("it has a fixed step of {step} s")), "{}", stderr(&output));
    }
    // The FMU is used: its fault shows.
    for (step, can_vary) in [("0.1", "true"), ("0.04", "false"), ("0.01", "false")] {
        let output = steps(step, can_vary);
        assert_eq!(code(&output), 5, "{step}: {}", stderr(&output));
        let expected = "fmi2DoStep answered fmi2Fatal: the solver does not converge";
        assert!(message(&output).contains(expected), "{step}: {}", stderr(&output));
    }
}

/// The faults of `faulty_fmu.c`, each with a part of the message of its samples.
const FAULTS: [(&str, &str); 12] = [
    ("segfault", "the controller ended its process (signal: 11 (SIGSEGV))"),
    ("throws-cpp", "the library threw a C++ exception out of fmi2DoStep: catch it inside the function"),
    ("hang", "failed at 2.00 s: no answer within 500 ms"),
    ("nan", "asked for an acceleration of NaN m/s² at 2.00 s"),
    ("millimetres", "asked for an acceleration of -9810 m/s² at 2.00 s: it must be a number from -100 to 100"),
    ("sets-not", "the variable `ego_speed`: fmi2SetReal answered fmi2Error"),
    ("terminates-not", "fmi2Terminate answered fmi2Error: the log is lost"),
    ("state", "the FMU answered the state 7: the state must be 0 (following)"),
    ("error", "fmi2DoStep answered fmi2Error: the solver does not converge"),
    ("fatal", "fmi2DoStep answered fmi2Fatal: the solver does not converge"),
    ("formats", "the solver stops at %g s (Closecall does not fill in the values of this message)"),
    ("discard", "fmi2DoStep answered fmi2Discard"),
];

#[test]
fn a_fault_of_an_fmu_costs_its_samples_and_changes_no_other() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let source = ["--source", "tests/fixtures/controllers/faulty_fmu.c"];
    let controller = fmu("2", &folder.path().join("faulty.fmu"), &source);
    for (fault, expected) in FAULTS {
        let out = folder.path().join(fault);
        let output = campaign(&controller, &out, "2", Some(fault), &["--controller-timeout-ms", "500"]);
        assert_eq!(code(&output), 5, "{fault}: {}", stderr(&output));
        assert_costs_fast_samples(&records(&out), fault, expected);
    }
    // A process that crashes leaves nothing behind: the program that has unpacked the FMU for it
    // removes the folder.
    let temporary = folder.path().join("temporary");
    std::fs::create_dir(&temporary).unwrap();
    let run = |fault: &str| {
        let arguments = ["run", "low-thw-overtake", "--seed", "3", "--sensors", "object", "--controller", &controller];
        program()
            .args(arguments)
            .env("FAULT", fault)
            .env("FAULT_ALWAYS", "1")
            .env("TMPDIR", &temporary)
            .output()
            .unwrap()
    };
    let left =
        || -> Vec<PathBuf> { std::fs::read_dir(&temporary).unwrap().map(|entry| entry.unwrap().path()).collect() };
    assert_eq!(code(&run("segfault")), 5);
    assert!(left().is_empty(), "{:?}", left());
    stdout(&run("none"), 0);
    assert!(left().is_empty(), "{:?}", left());
    let out = folder.path().join("none");
    assert_eq!(code(&campaign(&controller, &out, "1", Some("no-instance"), &[])), 5);
    let failure = records(&out)[0].arms[1].result.clone().unwrap_err();
    let expected = "fmi2Instantiate answered null: the FMU created no instance: no licence";
    assert!(failure.message.contains(expected), "{}", failure.message);
    let terminated = run("terminates-not");
    assert_eq!(code(&terminated), 5, "{}", stderr(&terminated));
    let expected = "fmi2Terminate answered fmi2Error: the log is lost";
    assert!(message(&terminated).contains(expected), "{}", stderr(&terminated));
}

#[test]
fn variables_are_mapped_by_a_table_of_the_scenario() {
    if !has_python() {
        return;
    }
    let folder = folder();
    // The names of another company.
    let controller = {
        let controller = fmu_with(folder.path(), "other", ("2", "name=\"ego_speed\"", "name=\"VEH_SPD\""), &[]);
        let path = folder.path().join("other.xml");
        let text = std::fs::read_to_string(&path).unwrap().replace("name=\"acceleration\"", "name=\"AX_CMD\"");
        std::fs::write(&path, text).unwrap();
        fmu("2", &folder.path().join("other.fmu"), &["--description", path.to_str().unwrap()]);
        controller
    };
    let table = "[controller.fmu]\ninputs = { VEH_SPD = \"ego_speed\" }\noutputs = { acceleration = \"AX_CMD\" }\n\n[parameters]";
    let write = |name: &str, table: &str| -> PathBuf {
        let path = folder.path().join(format!("{name}.toml"));
        std::fs::write(&path, headline_with("[parameters]", table)).unwrap();
        path
    };
    let run = |scenario: &Path, controller: &str| {
        let arguments = ["run", scenario.to_str().unwrap(), "--sensors", "object", "--controller", controller];
        program().args(arguments).output().unwrap()
    };
    let mapped = write("mapped", table);
    let shown = |scenario: &Path, controller: &str| {
        let text = stdout(&run(scenario, controller), 0);
        text.lines().skip(1).filter(|line| !line.contains("margin increase")).collect::<Vec<_>>().join("\n")
    };
    let plain = fmu("3", &folder.path().join("three.fmu"), &[]);
    assert_eq!(shown(&mapped, &controller), shown(Path::new("low-thw-overtake"), &plain));
    let refused = [
        (Path::new("low-thw-overtake").to_owned(), "its input `VEH_SPD` is not the name of a quantity"),
        (
            write("typo", &table.replace("VEH_SPD", "VEH_SPEED")),
            "the table names the input `VEH_SPEED`, which the FMU does not have; its inputs are VEH_SPD, front_present, front_gap",
        ),
        (
            write("quantity", &table.replace("\"ego_speed\"", "\"own_speed\"")),
            "the table gives `VEH_SPD` the quantity `own_speed`; there are time, ego_speed, ego_acceleration",
        ),
        (write("output", &table.replace("AX_CMD", "AX")), "it has no output `AX`; its outputs are AX_CMD, state"),
        (write("key", &table.replace("acceleration =", "braking =")), "the table names the output `braking`; expected"),
    ];
    for (scenario, expected) in refused {
        for command in ["run", "campaign"] {
            let arguments = [command, scenario.to_str().unwrap(), "--controller", &controller];
            let output = program().args(arguments).output().unwrap();
            assert_eq!(code(&output), 3, "{command}: {}", stderr(&output));
            assert!(message(&output).contains(expected), "{command}: {}", stderr(&output));
        }
    }
}

#[test]
fn an_fmu_that_cannot_be_used_is_refused_before_the_first_sample() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let with = |name: &str, fmi: &str, from: &str, to: &str| fmu_with(folder.path(), name, (fmi, from, to), &[]);
    let text = folder.path().join("text.fmu");
    std::fs::write(&text, "not a zip archive").unwrap();
    let foreign = |fmi| fmu(fmi, &folder.path().join(format!("foreign{fmi}.fmu")), &["--platform", "win64"]);
    let cases = [
        (format!("fmu:{}", text.display()), "it is not an FMU, which is a zip archive"),
        (foreign("2"), "it has binaries for win64; expected one for"),
        (foreign("3"), "it has binaries for win64; expected one for"),
        (
            with("one", "2", "fmiVersion=\"2.0\"", "fmiVersion=\"1.0\""),
            "it is an FMU of FMI version `1.0`; expected 2.0 or 3.0",
        ),
        (
            with("me", "2", "<CoSimulation", "<ModelExchange"),
            "it is for model exchange only; expected an FMU for co-simulation",
        ),
        (with("xml", "2", "</ModelVariables>", "</Variables>"), "its description is not XML"),
        (
            with("output", "3", "name=\"acceleration\"", "name=\"a\""),
            "it has no output `acceleration`; its outputs are a, state",
        ),
        (with("unit", "3", "unit=\"m/s\"", "unit=\"km/h\""), "has the unit `km/h`; expected `m/s`"),
        (with("input", "2", "name=\"front_gap\"", "name=\"range\""), "its input `range` is not the name of a quantity"),
        (with("swapped", "3", "fmiVersion=\"3.0\"", "fmiVersion=\"2.0\""), "acc.so does not export `fmi2Instantiate`"),
    ];
    for (controller, expected) in cases {
        let out = folder.path().join("out");
        let output = campaign(&controller, &out, "1", None, &[]);
        assert_eq!(code(&output), 3, "{controller}: {}", stderr(&output));
        let said = message(&output);
        assert!(said.contains(expected) && !said.contains("closecall-fmu-"), "{controller}: {said}");
        assert!(!out.exists(), "{controller}");
    }
}

/// Writes an archive with the files of another one, whose names and description a line of Python
/// changes.
const REWRITE: &str = "\
import sys, zipfile
source, target, change = sys.argv[1:]
with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, 'w') as new:
    for info in old.infolist():
        name, data = info.filename, old.read(info)
        is_description = name == 'modelDescription.xml'
        exec(change)
        entry = zipfile.ZipInfo(name)
        entry.filename = name
        new.writestr(entry, data)
";

#[test]
fn archives_of_other_tools_are_read_or_refused_by_what_is_odd_in_them() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let plain = fmu("2", &folder.path().join("plain.fmu"), &[]);
    let run = |controller: &str| {
        let arguments = ["run", "low-thw-overtake", "--sensors", "object", "--controller", controller];
        program().args(arguments).output().unwrap()
    };
    let expected = stdout(&run(&plain), 0);
    let odd = |name: &str, change: &str| {
        let target = folder.path().join(name).join("plain.fmu");
        std::fs::create_dir(folder.path().join(name)).unwrap();
        let mut command = Command::new("python3");
        let output =
            command.args(["-c", REWRITE, plain.trim_start_matches("fmu:")]).arg(&target).arg(change).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        run(&format!("fmu:{}", target.display()))
    };
    let accepted = [
        ("backslash", r"name = name.replace('/', '\\')"),
        ("dotslash", "name = './' + name"),
        (
            "latin1",
            "data = data.replace(b'encoding=\"UTF-8\"', b'encoding=\"ISO-8859-1\"').replace(b'modelName', b'author=\"M\\xfcller\" modelName') \
             if is_description else data",
        ),
    ];
    for (name, change) in accepted {
        assert_eq!(stdout(&odd(name, change), 0), expected, "{name}");
    }
    let refused = [
        (
            "utf16",
            "data = data.decode().encode('utf-16') if is_description else data",
            "has the encoding UTF-16; expected UTF-8",
        ),
        (
            "other",
            "data = data.replace(b'encoding=\"UTF-8\"', b'encoding=\"Shift_JIS\"') if is_description else data",
            "has the encoding Shift_JIS; expected UTF-8",
        ),
        ("above", "name = '../' + name", "leads out of the archive"),
        ("absolute", "name = '/tmp/' + name", "leads out of the archive"),
    ];
    for (name, change, expected) in refused {
        let output = odd(name, change);
        assert_eq!(code(&output), 3, "{name}: {}", stderr(&output));
        assert!(message(&output).contains(expected), "{name}: {}", stderr(&output));
    }
}

#[test]
fn an_fmu_is_unpacked_once_for_all_processes_of_a_campaign_and_removed_at_its_end() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let controller = fmu("2", &folder.path().join("plain.fmu"), &[]);
    let place = folder.path().join("temporary");
    std::fs::create_dir(&place).unwrap();
    let words = ["campaign", "low-thw-overtake", "-n", "40", "--sensors", "object", "--no-gate", "--no-out"];
    let mut command = program();
    command.args(words).args(["--jobs", "2", "--controller", &controller]).env("TMPDIR", &place);
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null());
    let mut child = command.spawn().unwrap();
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        let unpacked = std::fs::read_dir(&place).unwrap().flatten();
        most = most.max(unpacked.filter(|entry| entry.path().extension().is_some_and(|end| end == "unpacked")).count());
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    assert_eq!(most, 1);
    assert_eq!(std::fs::read_dir(&place).unwrap().count(), 0);
}
